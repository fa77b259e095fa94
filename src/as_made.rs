//! Touches as they come: by tips that are larger or smaller than the usual one, some of their force along the surface.

use glam::DVec3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::draw::normal;
use crate::elasticity::{Push, Touch};
use crate::uncertainty::Making;

/// No tip is smaller than this share of the usual one.
const LEAST: f64 = 0.1;

/// Touches that press where and as hard as they are said to, made as far off as is usual. The same seed, the same draws.
pub(crate) fn as_made(touches: &[Touch], making: &Making, seed: u64) -> Vec<Push> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    touches.iter().map(|t| made(t, making, &mut rng)).collect()
}

/// One of them.
pub(crate) fn made(touch: &Touch, making: &Making, rng: &mut ChaCha8Rng) -> Push {
    let radius = touch.tip_radius + making.tip * normal(rng);
    let along = touch.normal.any_orthonormal_vector();
    let across = touch.normal.cross(along);
    let drag: DVec3 = along * normal(rng) + across * normal(rng);
    let touch = Touch {
        tip_radius: radius.max(LEAST * touch.tip_radius),
        ..*touch
    };
    let straight = Push::from(&touch);
    let drag = drag * (making.along_either() * touch.force);
    Push {
        force: straight.force + drag,
        ..straight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_are_off_by_as_much_as_is_said() {
        const COUNT: usize = 16_000;
        let touch = Touch {
            position: DVec3::ZERO,
            normal: DVec3::Z,
            force: 8.0,
            tip_radius: 5e-3,
        };
        let all = vec![touch; COUNT];
        let making = Making {
            tip: 0.5e-3,
            friction: 0.2,
        };
        let made = as_made(&all, &making, 3);
        let mean = |of: &dyn Fn(&Push) -> f64| made.iter().map(of).sum::<f64>() / COUNT as f64;
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
        close(mean(&|p| (p.touch.tip_radius - 5e-3).powi(2)), 0.25e-6);
        close(mean(&|p| p.force.truncate().length_squared()), 2.56);
        assert!(made.iter().all(|p| (p.force.z + 8.0).abs() < 1e-12));
        assert_eq!(as_made(&all, &making, 3), made);
        // Where nothing is off they are the touches themselves.
        let exact = as_made(&all, &Making::EXACT, 3);
        assert!(exact.iter().all(|p| *p == Push::from(&touch)));
    }
}

//! Known presses as somebody makes them by hand to calibrate: a little beside the place that was asked for, and not
//! quite as hard.

use std::f64::consts::TAU;
use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::as_built::WORKSHOPS;
use crate::dataset::SignalMatrix;
use crate::elasticity::Touch;
use crate::mesh::TriMesh;
use crate::uncertainty::HandPressing;

/// A press, as it was asked for and as it was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// What was asked for.
    pub asked: Touch,
    /// What was done.
    pub made: Touch,
}

/// Presses, and what gauges read of them.
#[derive(Clone, Debug, PartialEq)]
pub struct PressReadings {
    /// Workshop by workshop, as many on the gauges of each: what one would do depends on how that hand was off.
    pub presses: Vec<Press>,
    /// Sites, as the workshop built them that is pressed, × presses; without noise.
    pub x: SignalMatrix,
}

/// Presses on a surface as a hand makes them: each as far off as is usual for it, in any direction and either way.
pub(super) fn by_hand(
    mesh: &TriMesh,
    asked: Vec<Touch>,
    hand: &HandPressing,
    seed: u64,
) -> Vec<Press> {
    let index = mesh.index();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let make = |asked: Touch| {
        let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
        let along = asked.normal.any_orthonormal_vector();
        let across = asked.normal.cross(along);
        let beside = asked.position + (along * cos + across * sin) * hand.place;
        let at = index.nearest(beside).0;
        let off = if rng.random::<bool>() {
            hand.force
        } else {
            -hand.force
        };
        Press {
            asked,
            made: Touch {
                position: mesh.point(at),
                normal: mesh.normal(at),
                force: asked.force * (1.0 + off),
                ..asked
            },
        }
    };
    asked.into_iter().map(make).collect()
}

impl PressReadings {
    /// The numbers of the presses on the gauges of each workshop.
    pub fn of_each(&self) -> impl Iterator<Item = Range<usize>> {
        let each = self.presses.len() / WORKSHOPS as usize;
        (0..WORKSHOPS as usize).map(move |k| k * each..(k + 1) * each)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_hand_is_a_little_off_any_way_and_the_same_way_again() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
        let asked = |k: u32| Touch {
            position: DVec3::new(0.3, 0.01 * f64::from(k), 0.0),
            normal: DVec3::Z,
            force: 10.0,
            tip_radius: 5e-3,
        };
        let all: Vec<Touch> = (1..13).map(asked).collect();
        let hand = HandPressing {
            place: 2e-3,
            force: 0.05,
            friction: 0.0,
        };
        let presses = by_hand(&mesh, all.clone(), &hand, 5);
        let mut directions = DVec3::ZERO;
        for (press, asked) in presses.iter().zip(&all) {
            assert_eq!(press.asked, *asked);
            let off = press.made.position - asked.position;
            assert!((off.length() - hand.place).abs() < 1e-9, "{off}");
            let hard = (press.made.force / asked.force - 1.0).abs();
            assert!((hard - hand.force).abs() < 1e-12, "{hard}");
            directions += off / hand.place / all.len() as f64;
        }
        assert!(directions.length() < 0.9, "{directions}");
        let hard = presses.iter().filter(|p| p.made.force > 10.0).count();
        assert!((1..12).contains(&hard), "{hard}");
        assert_eq!(by_hand(&mesh, all.clone(), &hand, 5), presses);
        assert_ne!(by_hand(&mesh, all, &hand, 6), presses);
    }
}

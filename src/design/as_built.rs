//! Gauges as a workshop glues them: a little off their places, directions and gains.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Simulated, WORKSHOP_SEED};
use crate::gauge::Gauge;
use crate::uncertainty::Gluing;

/// How many workshops glue the gauges that are judged: one alone is a seventh better or worse than they are in the mean.
pub(super) const WORKSHOPS: u64 = 8;

/// The seed of one of the workshops that a design is judged by.
pub(super) fn of_workshop(seed: u64, workshop: u64) -> u64 {
    seed.wrapping_add(workshop << 32)
}

/// Gauges at sites of a dataset as a workshop glues them.
pub(super) fn sites_as_built(
    simulated: &Simulated,
    sites: &[usize],
    gluing: &Gluing,
    seed: u64,
) -> Vec<Gauge> {
    let all = &simulated.dataset.sites;
    let built = |&s: &usize| as_built(&all[s].gauge, gluing, seed, s);
    sites.iter().map(built).collect()
}

/// The gains that these gauges end up with.
pub(super) fn gains(sites: &[usize], gluing: &Gluing, seed: u64) -> impl Iterator<Item = f64> {
    sites
        .iter()
        .map(move |&s| workshop_draw(gluing, seed, s).gain)
}

/// What a workshop does to one gauge: where it is moved to and how far it is turned (radians), and its
/// gain.
pub(super) struct WorkshopDraw {
    toward: f64,
    turned: f64,
    pub gain: f64,
}

/// Off by as much as is usual for the workshop, in any direction and either way: the same for a site in whatever
/// set it is.
pub(super) fn workshop_draw(gluing: &Gluing, seed: u64, site: usize) -> WorkshopDraw {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_add(WORKSHOP_SEED));
    rng.set_stream(site as u64);
    let mut sign = || if rng.random::<bool>() { 1.0 } else { -1.0 };
    let (turned, gain) = (gluing.angle * sign(), 1.0 + gluing.gain * sign());
    WorkshopDraw {
        toward: std::f64::consts::TAU * rng.random::<f64>(),
        turned,
        gain,
    }
}

/// A gauge as a workshop glues it, by its number.
pub(super) fn as_built(gauge: &Gauge, gluing: &Gluing, seed: u64, number: usize) -> Gauge {
    let draw = workshop_draw(gluing, seed, number);
    let toward = gauge.turned(draw.toward).direction;
    Gauge {
        position: gauge.position + toward * gluing.place,
        ..gauge.turned(draw.turned)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn gauge() -> Gauge {
        Gauge {
            position: DVec3::new(0.01, 0.02, 0.03),
            direction: DVec3::X,
            normal: DVec3::Z,
        }
    }

    #[test]
    fn a_gauge_is_off_by_what_the_project_says() {
        let gluing = Gluing {
            place: 2e-3,
            angle: 0.1,
            gain: 0.05,
        };
        for number in 0..20 {
            let built = as_built(&gauge(), &gluing, 7, number);
            assert!((built.position.distance(gauge().position) - 2e-3).abs() < 1e-12);
            assert!((built.direction.angle_between(DVec3::X) - 0.1).abs() < 1e-9);
            let gain = workshop_draw(&gluing, 7, number).gain;
            assert!(((gain - 1.0).abs() - 0.05).abs() < 1e-12);
            // Another workshop is off the same way, by another amount.
            let usual = as_built(&gauge(), &Gluing::default(), 7, number);
            let [a, b] = [built, usual].map(|s| (s.position - gauge().position).normalize());
            assert!(a.distance(b) < 1e-9);
            assert_eq!(as_built(&gauge(), &Gluing::EXACT, 7, number), gauge());
        }
    }
}

//! Gauges in somebody's hand: what a set is expected to err by, told again with every move of one of them; what it is
//! blind to; which gauge more would help it most, and which one it can spare.

use std::ops::Range;

use glam::DVec3;

use super::bank::Bank;
use super::scan;
use super::scene::TouchScene;
use crate::budget::{Cancelled, Watch, report};

pub use crate::uncertainty::BLIND;

/// A set of which one gauge is in hand. The others are taken in once; each place of the one that moves then costs no
/// more than one gauge.
pub struct GaugeInHand<'a> {
    others: Bank<'a>,
}

impl<'a> GaugeInHand<'a> {
    /// Around the gauges of a set (rows of the scene), without the one that moves.
    #[must_use]
    pub fn around(scene: &'a TouchScene, set: &[usize], moves: usize) -> Self {
        let mut others = Bank::new(scene);
        for (turn, &site) in set.iter().enumerate().filter(|(turn, _)| *turn != moves) {
            others.take_turn(turn);
            others.add(site);
        }
        others.take_turn(moves);
        Self { others }
    }

    /// The expected error (mm) of each press with the gauge that moves at a site.
    #[must_use]
    pub fn errors_with(&self, site: usize) -> Vec<f64> {
        self.others.errors_with(site)
    }

    /// The expected error (mm) without it.
    fn error_without(&self) -> f64 {
        self.others.error()
    }
}

impl TouchScene {
    /// Where its presses are (mm).
    #[must_use]
    pub fn presses_mm(&self) -> Vec<DVec3> {
        self.presses.iter().map(|p| p.position).collect()
    }

    /// Which presses have one force: the lightest first, the hardest last.
    #[must_use]
    pub fn by_force(&self) -> Vec<Range<usize>> {
        self.levels.iter().map(|l| l.presses.clone()).collect()
    }

    /// The mean of something known of each press, over where touches come; nothing where no press is among some.
    #[must_use]
    pub fn mean_among(&self, of_presses: &[f64], among: impl Fn(usize) -> bool) -> Option<f64> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (k, (value, press)) in of_presses.iter().zip(&self.presses).enumerate() {
            if among(k) {
                sum += value * press.mass;
                weight += press.mass;
            }
        }
        (weight > 0.0).then(|| sum / weight)
    }
}

/// Which presses move no gauge of a set far enough to be told from noise, were they as hard as a force (N).
#[must_use]
pub fn blind(scene: &TouchScene, set: &[usize], force: f64) -> Vec<bool> {
    let mut blind = vec![true; scene.presses.len()];
    for &site in set {
        let readings = scene.at_presses.of(site).value;
        for (blind, reading) in blind.iter_mut().zip(readings) {
            *blind &= (force * f64::from(*reading)).abs() <= BLIND;
        }
    }
    blind
}

/// The site of some open ones with which a set is expected to err least when it is added, and by how much (mm) then.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn most_helpful(
    scene: &TouchScene,
    set: &[usize],
    open: &[usize],
    watch: Watch,
) -> Result<Option<(usize, f64)>, Cancelled> {
    /// Sites between two steps of progress.
    const PIECE: usize = 512;
    let bank = Bank::of(scene, set);
    let mut best: Option<(usize, f64)> = None;
    for (piece, sites) in open.chunks(PIECE).enumerate() {
        let errors = scan(&bank, sites, watch, (piece * PIECE, open.len()))?;
        for (&site, error) in sites.iter().zip(errors) {
            if best.is_none_or(|(_, least)| error < least) {
                best = Some((site, error));
            }
        }
    }
    Ok(best)
}

/// The gauge of a set (its number from zero) without which the others are expected to err least, and by how much (mm)
/// then.
///
/// # Errors
/// [`Cancelled`] when the watch asks for a stop.
pub fn least_helpful(
    scene: &TouchScene,
    set: &[usize],
    watch: Watch,
) -> Result<Option<(usize, f64)>, Cancelled> {
    let mut least: Option<(usize, f64)> = None;
    for k in 0..set.len() {
        report(watch, "Leaving gauges out", k, set.len())?;
        let error = GaugeInHand::around(scene, set, k).error_without();
        if least.is_none_or(|(_, least)| error < least) {
            least = Some((k, error));
        }
    }
    Ok(least)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::budget::unwatched;
    use crate::dataset::SignalMatrix;
    use crate::placement::expected_error::{Detail, SceneForces, SignalKnowledge, expected};

    /// Touches on a square of 60 mm; the signals of six sites fall with the distance from each (mm), but for the last,
    /// which hears next to nothing.
    pub fn plate() -> TouchScene {
        const SITES: [[f64; 2]; 6] = [
            [5.0, 5.0],
            [55.0, 8.0],
            [30.0, 50.0],
            [10.0, 40.0],
            [48.0, 35.0],
            [30.0, 30.0],
        ];
        let targets: Vec<[f64; 3]> = (0..400)
            .map(|t| [3.0 * f64::from(t % 20), 3.0 * f64::from(t / 20), 0.0])
            .collect();
        let signal = |site: usize, at: &[f64; 3]| {
            let [x, y] = SITES[site];
            let away = (at[0] - x).hypot(at[1] - y);
            let loud = if site == 5 { 1e-3 } else { 40.0 };
            loud * (-away / 25.0).exp()
        };
        let values = (0..6)
            .flat_map(|s| targets.iter().map(move |at| signal(s, at)))
            .collect();
        let forces = vec![1.0; targets.len()];
        let known = SignalKnowledge {
            noise: 1.0,
            variance: None,
            shared: None,
            density: None,
            among: None,
            forces: Some(SceneForces {
                touches: &forces,
                coming: [3.0, 12.0],
                possible: 20.0,
            }),
            seed: 7,
        };
        let x = SignalMatrix::new(targets.len(), values);
        let detail = Detail {
            places: 150,
            presses: 60,
        };
        TouchScene::new(&x, &targets, &known, detail, &unwatched).unwrap()
    }

    fn everything(scene: &TouchScene, errors: &[f64]) -> f64 {
        scene.mean_among(errors, |_| true).unwrap()
    }

    #[test]
    fn a_gauge_in_hand_is_worth_what_it_is_in_the_set() {
        let scene = plate();
        let set = [0, 1, 2, 3];
        let (error, errors) = expected(&scene, &set);
        // What a choice expects of the same gauge more.
        let last = GaugeInHand::around(&scene, &set, 3).errors_with(3);
        let others = Bank::of(&scene, &set[..3]);
        let chosen = others.with(&[3], &mut others.rows())[0];
        assert!((everything(&scene, &last) / chosen - 1.0).abs() < 1e-6);
        // And of the whole set: the same filters, corrected on the way or before, in single precision.
        for (a, b) in last.iter().zip(&errors) {
            assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        }
        // Whichever is in hand hears what it hears in the set.
        for moves in 0..set.len() {
            let held = GaugeInHand::around(&scene, &set, moves).errors_with(set[moves]);
            let mean = everything(&scene, &held);
            assert!(
                (mean / error - 1.0).abs() < 2e-2,
                "{moves}: {mean} and {error}"
            );
        }
        // Elsewhere it is worth something else.
        let moved = everything(&scene, &GaugeInHand::around(&scene, &set, 3).errors_with(5));
        assert!(moved > 1.02 * error, "{moved} {error}");
    }

    #[test]
    fn what_no_gauge_hears_is_blind() {
        let scene = plate();
        assert!(blind(&scene, &[5], 12.0).iter().all(|b| *b));
        assert!(blind(&scene, &[], 12.0).iter().all(|b| *b));
        let of = |force: f64| -> Vec<bool> { blind(&scene, &[0], force) };
        let places = scene.presses_mm();
        for (place, blind) in places.iter().zip(of(0.2)) {
            let away = place.distance(DVec3::new(5.0, 5.0, 0.0));
            let reading = 0.2 * 40.0 * (-away / 25.0).exp();
            if (reading - BLIND).abs() > 0.01 {
                assert_eq!(blind, reading < BLIND, "{place}");
            }
        }
        let count = |force: f64| of(force).into_iter().filter(|b| *b).count();
        assert!(count(0.2) > count(2.0) && count(20.0) == 0);
    }

    #[test]
    fn the_best_gauge_to_add_and_the_one_to_spare() {
        let scene = plate();
        let added = most_helpful(&scene, &[0, 1, 2], &[3, 4, 5], &unwatched);
        let (best, error) = added.unwrap().unwrap();
        assert_ne!(best, 5);
        let of = |site: usize| expected(&scene, &[0, 1, 2, site]).0;
        assert!(error <= of(3).min(of(4)) * 1.01, "{error}");
        // The one that hears nothing can be spared.
        let spared = least_helpful(&scene, &[0, 5, 1, 2], &unwatched);
        assert_eq!(spared.unwrap().unwrap().0, 1);
        assert_eq!(most_helpful(&scene, &[0], &[], &unwatched).unwrap(), None);
        assert_eq!(least_helpful(&scene, &[], &unwatched).unwrap(), None);
        let stop = |_: crate::budget::Progress| std::ops::ControlFlow::Break(());
        assert!(least_helpful(&scene, &[0, 1], &stop).is_err());
    }
}

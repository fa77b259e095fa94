//! How far a set can be from the best one: an error that no set of as many gauges from the same sites can go below.
//!
//! Around press p, what gauges i with weights w know of where (along, across) and how hard it was is
//! M(w) = P⁻¹ + Σᵢ wᵢ rᵢ rᵢᵀ: the prior's information and that of each reading, rᵢ being its slopes over its deviation.
//! What else all gauges feel of a touch is known with them, as far as it is really off: an estimator that allows for more
//! of it can only be worse.
//! The part of the expected error that is left where one place is meant is L(w) = E|N(0, C)|, with the place block C of
//! M⁻¹ (`elliptic`). L is convex in w: 1/(zᵀCz) is the smallest yᵀMy over all y whose place part has product 1 with z,
//! a minimum of functions linear in w, hence concave; √(zᵀCz) = (1/(zᵀCz))^(−1/2) is a convex and falling function of
//! it; and L is the mean of √(zᵀCz) over standard normal z. So is F, the mean of L over the presses. Whatever w is,
//!
//! F(s) ≥ F(w) + ∇F(w)·(s − w) ≥ F(w) − (the k largest −∂F/∂wᵢ, summed) + Σᵢ wᵢ·(−∂F/∂wᵢ)
//!
//! for every set s of k sites: that is the bound, and no search over sets is needed for it. It is best at the w that
//! is best under 0 ≤ w ≤ 1, Σw = k (S. Joshi and S. Boyd, Sensor selection via convex optimization, IEEE Trans. Signal
//! Processing 57, 2009; S. Boyd and L. Vandenberghe, Convex Optimization, 2004, 7.5), which is approached as optimal
//! designs of experiments are, by multiplying the weights with their worths −∂F/∂wᵢ (F. Pukelsheim, Optimal Design of
//! Experiments, 2006, ch. 3–6 and 9; Y. Yu, Monotonic convergence of a general algorithm for computing optimal designs,
//! Annals of Statistics 38, 2010).
//!
//! What it holds for: C is the smallest covariance that the linear
//! and normal model of that neighbourhood allows, the bank's filter at the true place where that allows for no more than comes, so that no estimator at all, told in what neighbourhood of the scene a
//! touch is, has a smaller mean error there (its posterior is normal, and T. W. Anderson's lemma, Proc. AMS 6, 1955,
//! puts the best answer into its middle). Told nothing of that it can only be worse: what far places that may be taken
//! for each other cost comes on top and is left out here. The bank's estimate of the whole error is of some presses and
//! draws of noise; where it comes out below the set's own local part, the latter is what counts ([`Certificate::excess`]).
//! The bound is of means, not of medians; of the presses of the scene, with their prior; of first-order readings, and
//! of variances as they are known. Spacings, costs and budgets are left out, and failures too: with any of them no
//! set can be better. It holds for the sites that there are, not for gauges that are moved off them.

use nalgebra::{Matrix2, SMatrix, SVector};
use rayon::prelude::*;
use serde::Serialize;

use super::bank::{Bank, MOST, PLAIN, Unknowns, prior, row};
use super::elliptic::mean_length_and_slope;
use super::scene::TouchScene;
use crate::budget::{Cancelled, Watch, report};

/// The bound is sought until it is known to this share.
const TOLERANCE: f64 = 5e-3;
/// At most so many rounds; what was reached by then is a bound all the same.
const ROUNDS: usize = 200;
/// Weights below this share of an even one are not felt, and none falls below a smaller share, from where it can rise.
const FELT: f64 = 1e-3;
const LEAST: f64 = 1e-6;
/// Presses whose information is summed up at a time.
const TILE: usize = 64;

const BOUNDING: &str = "Bounding the error of any set";

/// What a bound says and what it leaves out, for whoever reads one.
pub const ASSUMES: &str = "No set of as many gauges from these sites can have a smaller mean error than the bound, whatever estimator reads it (Bayesian Cramér–Rao bound, minimized over gauges that may be shared out in fractions). It assumes that readings change linearly around each touch, and that noise, gluing and model are off by what the project says. It takes as known in which neighbourhood a touch is: that far places may be taken for each other only makes the true error larger. Spacings, costs and failures are left out, which makes no set better.";

/// How far a set is at most from the best of as many gauges from the same sites.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Certificate {
    /// No set has a smaller error (mm) where one place is meant, nor a smaller expected error in all.
    pub bound_mm: f64,
    /// The error (mm) of this set where one place is meant: what the bound is of.
    pub local_mm: f64,
    /// Whether gauges of the set have left the sites that the bound is of.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub refined: bool,
}

impl Certificate {
    /// The same beside a set whose gauges have left the sites, with its own error (mm) where one place is meant.
    #[must_use]
    pub fn refined(self, local_mm: f64) -> Self {
        Self {
            local_mm,
            refined: true,
            ..self
        }
    }

    /// By what share (0.07: 7 %) a set with this expected error (mm) is at most worse than the best one; below zero for
    /// gauges that have left the sites and are better than any on them.
    #[must_use]
    pub fn excess(&self, expected_mm: f64) -> f64 {
        expected_mm.max(self.local_mm) / self.bound_mm - 1.0
    }

    /// The same in words, of a set with this expected error (mm).
    #[must_use]
    pub fn words(&self, expected_mm: f64) -> String {
        /// From here on a factor is easier to read than a percentage.
        const FAR: f64 = 1.0;
        // Rounded to where it holds as it is written.
        let bound = (100.0 * self.bound_mm).floor() / 100.0;
        let excess = self.excess(expected_mm);
        let possible = if self.refined {
            "possible on the sites before they were refined"
        } else {
            "possible"
        };
        if excess < 0.0 {
            format!("Better than the best {possible} (bound {bound:.2} mm)")
        } else if excess < FAR {
            let percent = (100.0 * excess).ceil();
            format!("Within {percent:.0} % of the best {possible} (bound {bound:.2} mm)")
        } else {
            let times = (10.0 * (1.0 + excess)).ceil() / 10.0;
            format!("At most {times:.1} times the best {possible} (bound {bound:.2} mm)")
        }
    }
}

/// The certificate of a chosen set against all sets of as many sites (as numbered in the scene) out of those that are
/// `allowed`, with those that are `required` in each of them. Absent where nothing can be bounded: without touches, for
/// a set with other sites in it, and where no error is left.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn certify(
    scene: &TouchScene,
    allowed: &[usize],
    required: &[usize],
    chosen: &[usize],
    watch: Watch,
) -> Result<Option<Certificate>, Cancelled> {
    let (held, own): (Vec<usize>, Vec<usize>) = chosen.iter().partition(|c| required.contains(c));
    let free: Vec<usize> = (allowed.iter().copied())
        .filter(|site| !held.contains(site))
        .collect();
    if scene.presses.is_empty() || own.iter().any(|site| !free.contains(site)) {
        return Ok(None);
    }
    // Nothing is worth computing of what is never off.
    let off = scene.unknowns.iter().filter(|u| u.made() > 0.0).count();
    let bound = match off {
        0 => bounded::<PLAIN>,
        1 => bounded::<4>,
        2 => bounded::<5>,
        3 => bounded::<6>,
        _ => bounded::<MOST>,
    };
    bound(scene, &free, (&held, &own), watch)
}

/// The certificate of the sites `own`, beside those that are `held` in any case, with so many unknowns of a press.
fn bounded<const N: usize>(
    scene: &TouchScene,
    free: &[usize],
    (held, own): (&[usize], &[usize]),
    watch: Watch,
) -> Result<Option<Certificate>, Cancelled> {
    let relaxed = Relaxed::<N>::new(scene, free, held);
    let bound = relaxed.bound(own.len(), watch)?;
    let sound = bound.filter(|b| *b > 0.0 && b.is_finite());
    Ok(sound.map(|bound_mm| Certificate {
        bound_mm,
        local_mm: Bank::of(scene, &[held, own].concat()).local(),
        refined: false,
    }))
}

/// Gauges at all sites, each counted with a weight.
struct Relaxed<const N: usize> {
    sites: usize,
    presses: usize,
    /// Sites × presses: what a reading says of along, across, force and the rest, over its deviation, in units of
    /// `priors`.
    rows: Vec<[f32; N]>,
    /// Information about each press in the same units: before anything is read, and of gauges that must be there.
    base: Vec<SMatrix<f64, N, N>>,
    /// Deviations of what is known of each press before anything is read (mm, mm, N, and what is really off).
    priors: Vec<SVector<f64, N>>,
    /// How likely each press is.
    masses: Vec<f64>,
}

/// What weights come to.
struct ExpectedBound<const N: usize> {
    /// The error (mm).
    mm: f64,
    /// For each press the matrix H with which a row r, as its weight grows, takes rᵀHr from the error.
    slopes: Vec<SMatrix<f64, N, N>>,
}

impl<const N: usize> Relaxed<N> {
    /// With the sites that are `free`, and those that are `held` in any case.
    fn new(scene: &TouchScene, free: &[usize], held: &[usize]) -> Self {
        let mut made = Unknowns::repeat(1.0);
        // Which unknowns are looked at.
        let mut which: Vec<usize> = (0..PLAIN).collect();
        for (k, unknown) in (PLAIN..).zip(&scene.unknowns) {
            made[k] = unknown.made();
            which.extend((made[k] > 0.0).then_some(k));
        }
        let some = |all: Unknowns| {
            SVector::<f64, N>::from_fn(|k, _| which.get(k).map_or(0.0, |&unknown| all[unknown]))
        };
        let really = |around| some(prior(scene, around).component_mul(&made));
        let priors: Vec<SVector<f64, N>> = scene.around.iter().map(really).collect();
        let forces: Vec<f64> = (scene.levels.iter())
            .flat_map(|level| level.presses.clone().map(move |_| level.force))
            .collect();
        let rows = |&site: &usize| -> Vec<[f32; N]> {
            let report = scene.at_presses.of(site);
            let of = |p: usize| {
                let (row, _) = row(scene, &report, p, forces[p]);
                <[f64; N]>::from(some(row).component_mul(&priors[p])).map(|r| r as f32)
            };
            (0..priors.len()).map(of).collect()
        };
        let mut base = vec![SMatrix::identity(); priors.len()];
        for site in held {
            add(&mut base, &rows(site), 1.0);
        }
        let mass: f64 = scene.presses.iter().map(|p| p.mass).sum();
        Self {
            sites: free.len(),
            presses: priors.len(),
            rows: free.par_iter().flat_map_iter(rows).collect(),
            base,
            masses: scene.presses.iter().map(|p| p.mass / mass).collect(),
            priors,
        }
    }

    /// The best bound (mm) found for sets of so many free sites; none where numbers fail.
    fn bound(&self, count: usize, watch: Watch) -> Result<Option<f64>, Cancelled> {
        let even = count as f64 / self.sites.max(1) as f64;
        let mut weights = vec![even; self.sites];
        let mut best = f64::NEG_INFINITY;
        for round in 0..ROUNDS {
            report(watch, BOUNDING, round, ROUNDS)?;
            let felt = |w: &f64| if *w < FELT * even { 0.0 } else { *w };
            let felt: Vec<f64> = weights.iter().map(felt).collect();
            let Some(expected) = self.expected(&felt) else {
                return Ok(None);
            };
            let worths = self.worths(&expected);
            best = best.max(expected.mm - duality_gap(&worths, &felt, count));
            if expected.mm - best <= TOLERANCE * expected.mm {
                break;
            }
            let wanted: Vec<f64> = (weights.iter().zip(&worths))
                .map(|(weight, worth)| weight.max(LEAST * even) * worth)
                .collect();
            weights = shared_out(&wanted, count);
        }
        Ok(Some(best))
    }

    /// What weights come to; nothing where numbers fail.
    fn expected(&self, weights: &[f64]) -> Option<ExpectedBound<N>> {
        let informed = self.informed(weights);
        let mut expected = ExpectedBound {
            mm: 0.0,
            slopes: Vec::with_capacity(self.presses),
        };
        for ((known, prior), mass) in informed.into_iter().zip(&self.priors).zip(&self.masses) {
            let covariance = known.cholesky()?.inverse();
            let scale = Matrix2::new(prior[0], 0.0, 0.0, prior[1]);
            let upper = scale * covariance.fixed_rows::<2>(0);
            let place = upper.fixed_columns::<2>(0) * scale;
            let (length, slope) =
                mean_length_and_slope(place[(0, 0)], place[(0, 1)], place[(1, 1)]);
            expected.mm += mass * length;
            expected
                .slopes
                .push(upper.transpose() * slope * upper * *mass);
        }
        Some(expected)
    }

    /// Information about each press.
    fn informed(&self, weights: &[f64]) -> Vec<SMatrix<f64, N, N>> {
        let mut informed = self.base.clone();
        let tiles = informed.par_chunks_mut(TILE).enumerate();
        tiles.for_each(|(tile, informed)| {
            for (site, &weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                let rows = &self.rows[site * self.presses + tile * TILE..][..informed.len()];
                add(informed, rows, weight);
            }
        });
        informed
    }

    /// By how much the error falls (mm) as the weight of each site grows, over what it grows by.
    fn worths(&self, expected: &ExpectedBound<N>) -> Vec<f64> {
        let worth = |rows: &[[f32; N]]| -> f64 {
            let pairs = rows.iter().zip(&expected.slopes);
            pairs
                .map(|(row, slope)| {
                    let r = wide(row);
                    r.dot(&(slope * r))
                })
                .sum()
        };
        self.rows.par_chunks(self.presses).map(worth).collect()
    }
}

fn wide<const N: usize>(row: &[f32; N]) -> SVector<f64, N> {
    SVector::from(row.map(f64::from))
}

/// Adds what a gauge of some weight says of presses.
fn add<const N: usize>(informed: &mut [SMatrix<f64, N, N>], rows: &[[f32; N]], weight: f64) {
    for (known, row) in informed.iter_mut().zip(rows) {
        let r = wide(row);
        *known += r * (r * weight).transpose();
    }
}

/// By how much the best `count` sites are worth more than the weighted ones, as if worths stayed as they are: the gap of
/// the convex problem's dual.
fn duality_gap(worths: &[f64], weights: &[f64], count: usize) -> f64 {
    let mut sorted = worths.to_vec();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let weighted = worths.iter().zip(weights).map(|(d, w)| d * w);
    sorted.iter().take(count).sum::<f64>() - weighted.sum::<f64>()
}

/// Weights in proportion to what is wanted, none above one, `count` in all.
fn shared_out(wanted: &[f64], count: usize) -> Vec<f64> {
    let mut full = vec![false; wanted.len()];
    loop {
        let left = count.saturating_sub(full.iter().filter(|f| **f).count());
        let open = wanted.iter().zip(&full).filter(|(_, full)| !**full);
        let sum: f64 = open.map(|(w, _)| w).sum();
        let share = if sum > 0.0 { left as f64 / sum } else { 0.0 };
        let mut more = false;
        for (full, w) in full.iter_mut().zip(wanted) {
            if !*full && w * share > 1.0 {
                (*full, more) = (true, true);
            }
        }
        if !more {
            let weight = |(w, full): (&f64, &bool)| if *full { 1.0 } else { w * share };
            return wanted.iter().zip(&full).map(weight).collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Detail, SceneForces, SignalKnowledge, Variance, local};
    use super::*;
    use crate::budget::unwatched;
    use crate::dataset::SignalMatrix;

    /// Sites that feel touches on a plane, each in its own way; of 10 N each where forces are known.
    fn scene(sites: usize, with_forces: bool) -> TouchScene {
        const SIDE: usize = 6;
        let touch = |t: usize| [(t % SIDE) as f64 * 7.0, (t / SIDE) as f64 * 7.0, 0.0];
        let targets: Vec<[f64; 3]> = (0..SIDE * SIDE).map(touch).collect();
        let felt = |site: usize, [x, y, _]: [f64; 3]| {
            let turn = 2.4 * site as f64;
            1.0 + (0.06 * (x * turn.cos() + y * turn.sin()) + turn).sin()
        };
        let values = (0..sites)
            .flat_map(|site| targets.iter().map(move |&at| felt(site, at)))
            .collect();
        let forces = vec![10.0; targets.len()];
        let variance: Variance = &|site: usize, touch: usize| 1e-3 * ((site + touch) % 5) as f64;
        let known = SignalKnowledge {
            noise: 0.05,
            variance: Some(variance),
            shared: None,
            density: None,
            among: None,
            forces: with_forces.then_some(SceneForces {
                touches: &forces,
                coming: [3.0, 25.0],
                possible: 40.0,
            }),
            seed: 1,
        };
        let detail = Detail {
            places: 30,
            presses: 24,
        };
        let x = SignalMatrix::new(targets.len(), values);
        TouchScene::new(&x, &targets, &known, detail, &unwatched).unwrap()
    }

    #[test]
    fn weights_of_one_are_gauges_as_the_bank_has_them() {
        for with_forces in [false, true] {
            let scene = scene(8, with_forces);
            for set in [vec![], vec![3], vec![1, 4], vec![0, 2, 5, 7]] {
                let (held, free) = set.split_at(set.len() / 2);
                let relaxed = Relaxed::<PLAIN>::new(&scene, free, held);
                let mm = relaxed.expected(&vec![1.0; free.len()]).unwrap().mm;
                let bank = local(&scene, &set);
                assert!((mm - bank).abs() < 1e-4 * bank, "{set:?}: {mm} {bank}");
            }
        }
    }

    #[test]
    fn worths_are_what_the_error_falls_by() {
        const STEP: f64 = 1e-5;
        for with_forces in [false, true] {
            let relaxed = Relaxed::<PLAIN>::new(&scene(7, with_forces), &[0, 1, 3, 4, 6], &[2]);
            let weights = [0.2, 0.7, 0.05, 0.4, 0.65];
            let worths = relaxed.worths(&relaxed.expected(&weights).unwrap());
            for (k, worth) in worths.iter().enumerate() {
                let at = |step: f64| {
                    let mut moved = weights;
                    moved[k] += step;
                    relaxed.expected(&moved).unwrap().mm
                };
                let fall = (at(-STEP) - at(STEP)) / (2.0 * STEP);
                assert!((worth / fall - 1.0).abs() < 1e-4, "{k}: {worth} {fall}");
            }
        }
    }

    #[test]
    fn the_error_is_convex_in_the_weights() {
        let relaxed = Relaxed::<PLAIN>::new(&scene(5, true), &[0, 1, 2, 3, 4], &[]);
        let at = |w: &[f64]| relaxed.expected(w).unwrap().mm;
        let (a, b) = ([1.0, 0.0, 0.3, 0.6, 0.0], [0.0, 1.0, 0.1, 0.0, 0.9]);
        let middle: Vec<f64> = (a.iter().zip(&b))
            .map(|(a, b)| f64::midpoint(*a, *b))
            .collect();
        assert!(at(&middle) < f64::midpoint(at(&a), at(&b)));
    }

    #[test]
    fn weights_are_shared_out_up_to_one_each() {
        let near = |a: &[f64], b: &[f64]| {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12), "{a:?}");
        };
        near(&shared_out(&[1.0, 1.0, 2.0], 1), &[0.25, 0.25, 0.5]);
        near(&shared_out(&[1.0, 1.0, 8.0], 2), &[0.5, 0.5, 1.0]);
        near(
            &shared_out(&[1.0, 6.0, 90.0], 2),
            &[1.0 / 7.0, 6.0 / 7.0, 1.0],
        );
        near(&shared_out(&[1.0, 2.0, 3.0], 3), &[1.0; 3]);
        near(&shared_out(&[0.0, 0.0, 3.0], 2), &[0.0, 0.0, 1.0]);
        near(&shared_out(&[0.0, 0.0], 1), &[0.0, 0.0]);
    }

    #[test]
    fn words_hold_as_they_are_written() {
        let certificate = Certificate {
            bound_mm: 0.548,
            local_mm: 0.56,
            refined: false,
        };
        assert_eq!(
            certificate.words(0.58),
            "Within 6 % of the best possible (bound 0.54 mm)"
        );
        assert_eq!(
            certificate.words(1.61),
            "At most 3.0 times the best possible (bound 0.54 mm)"
        );
        // An estimate below what is certain counts as that.
        assert_eq!(certificate.excess(0.1), certificate.excess(0.56));
        // Of gauges that have left the sites the bound says nothing but how they stand to those on them.
        let refined = certificate.refined(0.52);
        assert_eq!(
            refined.words(0.53),
            "Better than the best possible on the sites before they were refined (bound 0.54 mm)"
        );
        assert_eq!(
            refined.words(0.58),
            "Within 6 % of the best possible on the sites before they were refined (bound 0.54 mm)"
        );
    }
}

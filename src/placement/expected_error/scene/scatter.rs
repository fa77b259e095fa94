//! What data say of their own errors: how far repeats of a place scatter, and what its neighbours leave of a reading.
//!
//! A measured template is one press, or the mean of a few. How the tip stood, how deep it went, hysteresis and noise
//! are in it, and in the reading that is compared with it; and a touch comes to the places between. The variance of a
//! reading about a template is therefore that of a single press beside that of the template. The first is seen where
//! a place is pressed again. The second is seen by leaving each place out and guessing its reading from its
//! neighbours (cross-validation): what that leaves is the template's own error, and how far readings bend on the way to
//! the next place. Where nothing repeats the two cannot be told apart, and what is left counts for both.

use rayon::prelude::*;

use super::around::{Around, PlaceNeighbour};
use super::merged::Merged;
use crate::dataset::SignalMatrix;

/// The variance of each site's reading about the template of each place, as it is found in data.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadingScatter {
    /// The place of each touch.
    place_of: Vec<usize>,
    /// Its force squared (N²); 1 where forces are not known.
    squares: Vec<f64>,
    /// Sites × places: per newton squared, in the square of the signals' unit.
    variances: Vec<f64>,
    places: usize,
    /// Over the mean square of each site's readings.
    shares: Vec<f64>,
}

/// Places as good as seen once more, in what is taken for all of them: one residual is a poor variance.
const PRIOR_PLACES: f64 = 2.0;
/// As many repeats, for the same reason.
const PRIOR_REPEATS: f64 = 8.0;

impl ReadingScatter {
    /// Of signals (sites × touches) at positions (mm), per newton where the force of each touch (N) is known.
    #[must_use]
    pub fn of(x: &SignalMatrix, targets: &[[f64; 3]], forces: Option<&[f64]>) -> Self {
        let merged = Merged::new(targets, forces);
        let places = merged.len();
        let around = Around::new(&merged.positions, &merged.groups);
        let near: Vec<Vec<PlaceNeighbour>> = (0..places)
            .into_par_iter()
            .map(|k| around.of(k).neighbours)
            .collect();
        let force = |t: usize| forces.map_or(1.0, |f| f[t]);
        let of_site =
            |site: usize| SeenSite::new(x.row(site), &merged, &force, &near).variances(&near);
        let rows: Vec<(Vec<f64>, f64)> = (0..x.rows()).into_par_iter().map(of_site).collect();
        let mut place_of = vec![0; targets.len()];
        for (place, touches) in merged.touches.iter().enumerate() {
            for &(touch, _) in touches {
                place_of[touch] = place;
            }
        }
        Self {
            place_of,
            squares: (0..targets.len()).map(|t| force(t).powi(2)).collect(),
            shares: rows.iter().map(|row| row.1).collect(),
            variances: rows.into_iter().flat_map(|row| row.0).collect(),
            places,
        }
    }

    /// Variance of a site's reading, in the square of the signals' unit, at the place and force of a touch.
    #[must_use]
    pub fn variance(&self, site: usize, touch: usize) -> f64 {
        self.variances[site * self.places + self.place_of[touch]] * self.squares[touch]
    }

    /// Standard deviation of a site's reading over the rms of its readings, over all places.
    #[must_use]
    pub fn share(&self, site: usize) -> f64 {
        self.shares[site].sqrt()
    }

    /// Touches that repeat one before.
    #[must_use]
    pub fn repeats(&self) -> usize {
        self.place_of.len() - self.places
    }
}

/// What is seen of one site at every place, per newton.
struct SeenSite {
    /// Squares of the readings.
    squares: Vec<f64>,
    /// Of what neighbours leave, as the variance of one place.
    left: Vec<f64>,
    /// Sums of squares of what repeats are off their mean by, and how many of them are free.
    repeats: Vec<[f64; 2]>,
}

impl SeenSite {
    fn new(
        readings: &[f64],
        merged: &Merged,
        force: &dyn Fn(usize) -> f64,
        near: &[Vec<PlaceNeighbour>],
    ) -> Self {
        let values: Vec<f64> = (0..merged.len())
            .map(|k| merged.value(readings, k))
            .collect();
        let repeats = (merged.touches.iter().zip(&values)).map(|(touches, value)| {
            let off = |&(t, _): &(usize, f64)| (readings[t] / force(t) - value).powi(2);
            [
                touches.iter().map(off).sum::<f64>(),
                touches.len() as f64 - 1.0,
            ]
        });
        Self {
            repeats: repeats.collect(),
            left: (values.iter().zip(near))
                .map(|(value, near)| left(*value, near, &values))
                .collect(),
            squares: values.iter().map(|v| v * v).collect(),
        }
    }

    /// The variance of a reading at each place; and its mean over that of the squares.
    fn variances(&self, near: &[Vec<PlaceNeighbour>]) -> (Vec<f64>, f64) {
        let (square, left) = (mean_or_zero(&self.squares), mean_or_zero(&self.left));
        let [off, free] = sums(&self.repeats);
        // Of a single press; what neighbours leave is the first guess at it.
        let press = (off + PRIOR_REPEATS * left) / (free + PRIOR_REPEATS);
        let at = |k: usize| {
            let here = || std::iter::once(k).chain(near[k].iter().map(|n| n.place));
            let count = near[k].len() as f64 + 1.0;
            let local = |values: &[f64]| here().map(|p| values[p]).sum::<f64>();
            // Errors grow with the reading, down to a floor: half of either, as live matching has it.
            let size = if square > 0.0 {
                f64::midpoint(1.0, local(&self.squares) / (count * square))
            } else {
                1.0
            };
            let left = (local(&self.left) + PRIOR_PLACES * left * size) / (count + PRIOR_PLACES);
            if free == 0.0 {
                return 2.0 * left;
            }
            let [off, free] = here().fold([0.0; 2], |sum, p| {
                [sum[0] + self.repeats[p][0], sum[1] + self.repeats[p][1]]
            });
            left + (off + PRIOR_REPEATS * press * size) / (free + PRIOR_REPEATS)
        };
        let variances: Vec<f64> = (0..near.len()).map(at).collect();
        let share = if square > 0.0 {
            mean_or_zero(&variances) / square
        } else {
            0.0
        };
        (variances, share)
    }
}

/// The square of what neighbours leave of a value, over what it would be if all were off by one and the same
/// variance; nothing where there are none.
fn left(value: f64, near: &[PlaceNeighbour], values: &[f64]) -> f64 {
    if near.is_empty() {
        return 0.0;
    }
    let (mut guess, mut weights) = (0.0, 0.0);
    for n in near {
        guess += n.guess * values[n.place];
        weights += n.guess * n.guess;
    }
    (value - guess).powi(2) / (1.0 + weights)
}

/// The mean; zero of none.
fn mean_or_zero(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn sums(pairs: &[[f64; 2]]) -> [f64; 2] {
    (pairs.iter()).fold([0.0; 2], |sum, pair| [sum[0] + pair[0], sum[1] + pair[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::normal;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// A flat skin of 20 × 20 places 3 mm apart, pressed so many times.
    fn skin(turns: usize) -> Vec<[f64; 3]> {
        let at = |k: usize| [3.0 * (k / 20) as f64, 3.0 * (k % 20) as f64, 5.0];
        (0..turns * 400).map(|t| at(t % 400)).collect()
    }

    /// The share that is found of two sites, with a wave this long (mm) and normal errors of this deviation.
    fn found(turns: usize, wave: f64, deviation: f64) -> (ReadingScatter, f64) {
        let targets = skin(turns);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let values = (0..2).flat_map(|site| {
            let phase = f64::from(site);
            (targets.iter())
                .map(|p| ((p[0] + 0.7 * p[1]) / wave + phase).sin() + deviation * normal(&mut rng))
                .collect::<Vec<f64>>()
        });
        let x = SignalMatrix::new(targets.len(), values.collect());
        let scatter = ReadingScatter::of(&x, &targets, None);
        let mean = (0..targets.len())
            .map(|t| scatter.variance(0, t))
            .sum::<f64>();
        (scatter, (mean / targets.len() as f64).sqrt())
    }

    #[test]
    fn scatter_is_found_with_repeats_and_without() {
        // A press beside a template of as many presses as there are turns.
        for turns in [1, 3, 6] {
            let (scatter, deviation) = found(turns, 60.0, 0.05);
            let wanted = 0.05 * (1.0 + 1.0 / turns as f64).sqrt();
            let off = deviation / wanted - 1.0;
            assert!(off.abs() < 0.1, "{turns}: {deviation} {wanted}");
            assert_eq!(scatter.repeats(), 400 * (turns - 1));
            assert!(scatter.share(0) > 0.05 && scatter.share(0) < 0.15);
        }
    }

    #[test]
    fn what_is_smooth_and_exact_has_next_to_none_and_what_is_rough_has_much() {
        let (_, smooth) = found(1, 60.0, 0.0);
        assert!(smooth < 0.01, "{smooth}");
        let (_, rough) = found(1, 2.0, 0.0);
        assert!(rough > 0.5, "{rough}");
    }

    #[test]
    fn forces_scale_what_is_found() {
        let targets = skin(2);
        let forces: Vec<f64> = (0..800).map(|t| if t < 400 { 1.0 } else { 4.0 }).collect();
        let x = (0..800).map(|t| forces[t] * if t < 400 { 1.0 } else { 1.2 });
        let x = SignalMatrix::new(800, x.collect());
        let scatter = ReadingScatter::of(&x, &targets, Some(&forces));
        assert!((scatter.variance(0, 401) / scatter.variance(0, 1) - 16.0).abs() < 1e-9);
        assert!(scatter.variance(0, 1) > 0.01, "{}", scatter.variance(0, 1));
    }

    #[test]
    fn a_single_place_scatters_by_its_repeats_alone() {
        let x = SignalMatrix::new(4, vec![1.0, 2.0, 1.0, 2.0]);
        let scatter = ReadingScatter::of(&x, &[[1.0; 3]; 4], None);
        assert!(scatter.variance(0, 0) > 0.0);
        let one = ReadingScatter::of(&SignalMatrix::new(1, vec![3.0]), &[[1.0; 3]], None);
        assert!(one.variance(0, 0).abs() < f64::MIN_POSITIVE);
    }
}

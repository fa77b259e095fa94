//! How hard touches come, before anything is read: as often from two to four newtons as from ten to twenty. Where a place is
//! hardly felt, all forces would be as likely there otherwise, and a light touch beside it a hard one at it.
//!
//! ```text
//! p(f) ∝ 1 / (f + f₀)        0 ≤ f ≤ the largest
//! ```

/// f₀ (N): below it touches are no rarer the harder they are.
const LIGHT: f64 = 0.5;

/// How rare touches of a force (N) are: −ln p, but for a constant.
pub(super) fn rarity(force: f64) -> f64 {
    (force + LIGHT).ln()
}

/// What that grows by with the force (1/N).
pub(super) fn rarity_slope(force: f64) -> f64 {
    (force + LIGHT).recip()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::inference::plate::{plate, read_touches};
    use crate::inference::{Matching, ReadingErrors};

    #[test]
    fn as_many_are_between_two_and_four_as_between_ten_and_twenty() {
        let steps = 10_000;
        let share = |from: f64, to: f64| -> f64 {
            let width = (to - from) / f64::from(steps);
            let density = |k: i32| (-rarity(from + width * (f64::from(k) + 0.5))).exp();
            (0..steps).map(density).sum::<f64>() * width
        };
        let ratio = share(2.0, 4.0) / share(10.0, 20.0);
        assert!((ratio - 1.0).abs() < 0.15, "{ratio}");
        let slope = (rarity(5.0 + 1e-6) - rarity(5.0 - 1e-6)) / 2e-6;
        assert!((slope - rarity_slope(5.0)).abs() < 1e-9, "{slope}");
    }

    /// Towards x = 0 the plate is held: what gauges read there becomes less, and hardly another.
    #[test]
    fn a_light_touch_is_no_hard_one_where_the_part_is_held() {
        let across = 58e-3;
        let map = plate(30, 2e-3, |place| {
            let [x, y] = [place.x / across, place.y / across];
            let of = |c: usize| (3.0 * y + 0.8 * c as f64 + 0.2 * x).cos();
            std::array::from_fn::<_, 8, _>(|c| 20e-6 * x * x * of(c))
        });
        let reading = read_touches(&map, &[(15 * 30 + 15, 1.0)]);
        let mut matching = Matching::new(Arc::new(map), ReadingErrors::of_noise(1e-6, 8), 30.0);
        let mut force = |turn: i32| {
            let noise = |c: usize| 1.4e-6 * (2.1 * c as f64 + 7.7 * f64::from(turn)).sin();
            let read: Vec<f64> = (0..8).map(|c| reading[c] + noise(c)).collect();
            matching.find(&read).force
        };
        let forces: Vec<f64> = (0..24).map(&mut force).collect();
        // Nobody can tell where along x it is.
        assert!(forces.iter().all(|f| *f < 6.0), "{forces:?}");
    }
}

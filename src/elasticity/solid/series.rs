//! How far the last of several grids is from the converged answer.
//!
//! Where cells are larger than the walls, how the grid happens to lie in them moves the answer as much as a finer
//! grid does: two grids may agree and both be wrong. All grids together say more: u + s hᵖ is laid through them by
//! least squares, each weighted by what it can be trusted, and what scatters about that counts as error too
//! (L. Eça and M. Hoekstra 2014, for a known order p).

/// Grids that take part: the last ones.
const LATEST: usize = 4;

/// The fit through one quantity, the same for all quantities on the same grids.
pub struct GridSeries {
    /// The first grid that takes part, and hᵖ over that of the last from there on.
    first: usize,
    powers: Vec<f64>,
}

impl GridSeries {
    /// Of grids of these sizes (at least two, falling), with errors that fall as their power `order`.
    #[must_use]
    pub fn new(sizes: &[f64], order: f64) -> Self {
        let first = sizes.len().saturating_sub(LATEST);
        let last = sizes.last().copied().unwrap_or(1.0);
        let power = |size: &f64| (size / last).powf(order);
        Self {
            first,
            powers: sizes[first..].iter().map(power).collect(),
        }
    }

    /// What the last grid is off by in a quantity that the grids gave as `value` (by the number of the grid), and
    /// how far such a thing can be trusted: the size of what scatters.
    #[must_use]
    pub fn left(&self, value: impl Fn(usize) -> f64) -> (f64, f64) {
        // Divided by hᵖ, what is left of all grids weighs the same: y = u x + s with x = h⁻ᵖ.
        let points: Vec<(f64, f64)> = (self.powers.iter().enumerate())
            .map(|(k, power)| (1.0 / power, value(self.first + k) / power))
            .collect();
        let count = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let spread: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
        let both: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        let converged = both / spread;
        let slope = y - converged * x;
        let off = |p: &(f64, f64)| p.1 - converged * p.0 - slope;
        let squares: f64 = points.iter().map(|p| off(p).powi(2)).sum();
        let free = points.len().saturating_sub(2).max(1) as f64;
        let last = points.last().map_or(0.0, |p| p.1);
        (last - converged, (squares / free).sqrt())
    }

    /// Both together: the size of the error.
    #[must_use]
    pub fn error(&self, value: impl Fn(usize) -> f64) -> f64 {
        let (off, scatter) = self.left(value);
        off.hypot(scatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_falls_as_it_should_is_found_exactly() {
        let sizes = [8.0, 5.0, 3.0, 2.0];
        for count in 2..=4 {
            let sizes = &sizes[..count];
            let series = GridSeries::new(sizes, 2.0);
            let (off, scatter) = series.left(|k| 7.0 - 0.3 * sizes[k].powi(2));
            let truth = -0.3 * sizes[count - 1].powi(2);
            assert!((off - truth).abs() < 1e-12 && scatter < 1e-12);
        }
    }

    #[test]
    fn two_grids_that_agree_do_not_hide_what_a_third_shows() {
        // A channel with walls of 3 mm (% of the truth): the last two grids agree to half a percent.
        let (sizes, found) = ([8.0, 5.0, 3.33, 2.22], [-22.2, -8.63, -2.08, -2.66]);
        let series = GridSeries::new(&sizes, 2.0);
        let error = series.error(|k| found[k]);
        assert!((1.3..5.3).contains(&error), "{error}");
        let two = GridSeries::new(&sizes[2..], 2.0);
        assert!(two.error(|k| found[2 + k]) < 0.5);
    }
}

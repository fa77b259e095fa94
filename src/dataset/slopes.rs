//! How readings change with the way gauges are glued.
//!
//! With the angle exactly, from the three components of the strain. With the place by central differences of what
//! the model itself says of gauges that are moved, under some of the touches: sites lie too far from each other for
//! differences between them, which are off by a quarter to a half.

use rayon::prelude::*;

use super::columns::Columns;
use super::site::{SlopesAsked, gauges_on};
use crate::budget::{Cancelled, Watch};
use crate::elasticity::respond::{PressedModel, Quantity, Responses, respond};
use crate::gauge::Gauge;
use crate::uncertainty::Gluing;

/// How far a gauge is moved either way (m): about as far as a workshop is off.
const STEP: f64 = 0.75e-3;
/// A gauge is moved along itself and across itself.
const MOVES: usize = 2;
/// From the difference between gauges moved forth and back to the slope (1/m).
const SLOPE: f64 = 0.5 / STEP;

/// What the reading of every site changes by as its gauge is moved or turned, under some of the touches of a dataset
/// at their force. In single precision: they make up variances.
#[derive(Clone, Debug, PartialEq)]
pub struct GluingSlopes {
    columns: Columns,
    /// Sites × touches: strain a metre along the gauge, a metre across it, and strain a radian.
    along: Vec<f32>,
    across: Vec<f32>,
    turned: Vec<f32>,
}

impl GluingSlopes {
    /// Numbers in double precision that are held for a site and a touch while they, or those of touches that drag along after
    /// them, are computed: two that are solved for, and six in single precision.
    pub const HELD: f64 = MOVES as f64 + 3.0;

    /// Solves for the touches that are meant (at least one) once more, for gauges that are moved; `turned` are the
    /// slopes by the angle, sites × these touches. Also how many right-hand sides that took.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub(super) fn of(asked: &SlopesAsked, turned: Vec<f32>) -> Result<(Self, usize), Cancelled> {
        let moved: Vec<Gauge> = asked.gauges.iter().flat_map(shifted).collect();
        let (observer, angles) = gauges_on(asked.model, &moved);
        let responses = respond(
            asked.model,
            &asked.pressed(),
            &observer,
            Quantity::GaugeDifference(&angles, SLOPE),
            asked.watch,
        )?;
        let columns = asked.columns.to_vec();
        let slopes = Self::read(&responses, asked.gauges.len(), columns, turned);
        Ok((slopes, responses.solves))
    }

    /// As [`Self::of`] under all of some touches, of which the loads are there already.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub(super) fn under(
        pressed: &PressedModel,
        gauges: &[Gauge],
        turned: Vec<f32>,
        watch: Watch,
    ) -> Result<(Self, usize), Cancelled> {
        let moved: Vec<Gauge> = gauges.iter().flat_map(shifted).collect();
        let (observer, angles) = gauges_on(pressed.model(), &moved);
        let responses =
            pressed.read(&observer, Quantity::GaugeDifference(&angles, SLOPE), watch)?;
        let columns = (0..pressed.touches()).collect();
        let slopes = Self::read(&responses, gauges.len(), columns, turned);
        Ok((slopes, responses.solves))
    }

    /// From the slopes along and across each gauge, as they were solved for.
    fn read(responses: &Responses, sites: usize, touches: Vec<usize>, turned: Vec<f32>) -> Self {
        let count = touches.len();
        let mut along = vec![0.0_f32; sites * count];
        let mut across = vec![0.0_f32; sites * count];
        let rows = along
            .par_chunks_mut(count)
            .zip(across.par_chunks_mut(count));
        rows.enumerate().for_each_init(
            || vec![0.0; count],
            |row, (site, (along, across))| {
                for (k, into) in [along, across].into_iter().enumerate() {
                    responses.row_into(MOVES * site + k, row);
                    for (slope, &found) in into.iter_mut().zip(row.iter()) {
                        *slope = found as f32;
                    }
                }
            },
        );
        Self {
            columns: Columns::new(touches),
            along,
            across,
            turned,
        }
    }

    /// Of all sites: along, across and turned, sites × touches each.
    #[must_use]
    pub fn all(&self) -> [&[f32]; 3] {
        [&self.along, &self.across, &self.turned]
    }

    /// Slopes that are known already: along, across and turned.
    #[must_use]
    pub fn known(touches: Vec<usize>, [along, across, turned]: [Vec<f32>; 3]) -> Self {
        Self {
            columns: Columns::new(touches),
            along,
            across,
            turned,
        }
    }

    /// Forgets all sites but the first.
    pub(super) fn truncate(&mut self, sites: usize) {
        let count = sites * self.columns.len();
        for values in [&mut self.along, &mut self.across, &mut self.turned] {
            values.truncate(count);
        }
    }

    /// One site more, of which the slopes are known under every touch.
    pub(super) fn push(&mut self, site: &Self) {
        let [along, across, turned] = site.row(0);
        for &touch in self.columns.touches() {
            self.along.push(along[touch]);
            self.across.push(across[touch]);
            self.turned.push(turned[touch]);
        }
    }

    /// The touches of the dataset that they are known for.
    #[must_use]
    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// Of one site, column by column: strain a metre along the gauge, strain a metre across it (normal × direction),
    /// and strain a radian from the one to the other.
    #[must_use]
    pub fn row(&self, site: usize) -> [&[f32]; 3] {
        let count = self.columns.len();
        [&self.along, &self.across, &self.turned].map(|values| &values[site * count..][..count])
    }

    /// How far gauges are moved until they read something else (m): the rms of what all of them read over that of what it
    /// changes by; not a number where that is nothing. `row` is what a site reads of all touches.
    #[must_use]
    pub fn length_scale<'a>(&self, row: &(dyn Fn(usize) -> &'a [f64] + Sync)) -> f64 {
        let squares = |site: usize| {
            let readings = row(site);
            let [along, across, _] = self.row(site);
            let moved = along.iter().chain(across).map(|v| f64::from(*v).powi(2));
            let read = self
                .columns
                .touches()
                .iter()
                .map(|&touch| readings[touch].powi(2));
            [read.sum::<f64>(), moved.sum::<f64>()]
        };
        let sites = self.along.len() / self.columns.len().max(1);
        let all: Vec<[f64; 2]> = (0..sites).into_par_iter().map(squares).collect();
        let [read, moved] = [0, 1].map(|k| all.iter().map(|squares| squares[k]).sum::<f64>());
        (read / moved).sqrt()
    }

    /// Variance that gluing puts on a site's reading of the touch of a column; `reading` is what it reads as drawn.
    #[must_use]
    pub fn variance(&self, site: usize, column: usize, reading: f64, gluing: &Gluing) -> f64 {
        let [along, across, turned] = self.row(site).map(|values| f64::from(values[column]));
        gluing.variance(reading, along, across, turned)
    }

    /// Those of some sites, in the order given.
    #[must_use]
    pub fn select_rows(&self, sites: &[usize]) -> Self {
        let chosen = |which: usize| -> Vec<f32> {
            let rows = sites.iter().flat_map(|&site| self.row(site)[which]);
            rows.copied().collect()
        };
        Self {
            columns: self.columns.clone(),
            along: chosen(0),
            across: chosen(1),
            turned: chosen(2),
        }
    }
}

/// What strain along an angle changes by a radian under some of the touches, from its components (xx, yy, 2xy) under
/// all of them.
pub(super) fn turned(components: &[Vec<f64>], angle: f64, columns: &[usize]) -> Vec<f32> {
    let (s, c) = (2.0 * angle).sin_cos();
    let change = |&t: &usize| s * (components[1][t] - components[0][t]) + c * components[2][t];
    columns.iter().map(|t| change(t) as f32).collect()
}

/// A gauge moved along itself and across itself, forth and back.
fn shifted(gauge: &Gauge) -> [Gauge; 2 * MOVES] {
    [(STEP, 0.0), (-STEP, 0.0), (0.0, STEP), (0.0, -STEP)]
        .map(|(along, across)| gauge.moved(along, across))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::observe::along;

    #[test]
    fn turning_is_the_derivative_of_reading() {
        let components = [vec![0.0, 3.0], vec![0.0, -1.0], vec![0.0, 0.5]];
        let read = |angle: f64| -> f64 {
            let weights = along(angle);
            (0..3).map(|k| weights[k] * components[k][1]).sum()
        };
        for angle in [0.0, 0.4, 1.3, 2.9] {
            let step = 1e-5;
            let difference = (read(angle + step) - read(angle - step)) / (2.0 * step);
            let slope = f64::from(turned(&components, angle, &[1])[0]);
            assert!((slope - difference).abs() < 1e-5, "{slope} {difference}");
        }
    }

    #[test]
    fn rows_are_of_their_sites() {
        let slopes = GluingSlopes {
            columns: Columns::new(vec![3, 8]),
            along: vec![0.0, 1.0, 2.0, 3.0],
            across: vec![0.0, 10.0, 20.0, 30.0],
            turned: vec![0.0, 100.0, 200.0, 300.0],
        };
        let second: [&[f32]; 3] = [&[2.0, 3.0], &[20.0, 30.0], &[200.0, 300.0]];
        assert_eq!(slopes.row(1), second);
        let gluing = Gluing {
            place: 2.0_f64.sqrt(),
            angle: 1.0,
            gain: 0.5,
        };
        let expected = 9.0 + 900.0 + 9e4 + 4.0;
        assert!((slopes.variance(1, 1, 4.0, &gluing) - expected).abs() < 1e-6);
        assert_eq!(slopes.select_rows(&[1]).row(0), slopes.row(1));
        // Both touches of both sites: 4 + 9 + 16 + 25 read, over 14 and a hundred times as much across.
        let mut x = [1e3; 2 * 9];
        for (at, read) in [(3, 2.0), (8, -3.0), (9 + 3, 4.0), (9 + 8, 5.0)] {
            x[at] = read;
        }
        let scale = slopes.length_scale(&|site| &x[9 * site..][..9]);
        assert!(
            (scale - (54.0_f64 / 1414.0).sqrt()).abs() < 1e-12,
            "{scale}"
        );
        assert_eq!(slopes.select_rows(&[1, 0]).columns().touches(), [3, 8]);
    }
}

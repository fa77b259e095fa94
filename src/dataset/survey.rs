//! Gauges anywhere on a part under the touches of a dataset: what they read where they are, and to first order beside it.

use super::making::MakingSlopes;
use super::site::{Site, SlopesAsked, StrainMoments, gauges_on};
use super::slopes::{self, GluingSlopes};
use crate::budget::{Cancelled, Watch};
use crate::elasticity::Touch;
use crate::elasticity::observe::along;
use crate::elasticity::respond::{PressedModel, Quantity};
use crate::gauge::Gauge;
use crate::uncertainty::Making;

/// A gauge and what it reads of every touch (strain).
#[derive(Clone, Debug)]
pub struct Surveyed {
    /// Where it is.
    pub site: Site,
    /// What it reads of each touch (strain).
    pub x: Vec<f64>,
    /// The mean over all directions there.
    mean: Vec<f64>,
    /// Of this one gauge, under every touch.
    pub slopes: GluingSlopes,
    /// Likewise.
    pub making: MakingSlopes,
}

/// How a gauge is moved: along itself and across itself (m; normal × direction), and turned from the one to the other
/// (radians).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Along the gauge (m).
    pub along: f64,
    /// Across the gauge (m).
    pub across: f64,
    /// From along to across (radians).
    pub turn: f64,
}

impl Surveyed {
    /// What it would read after a move: to first order in the way, and where it does not change its place, exactly.
    #[must_use]
    pub fn after(&self, to: Move) -> Vec<f64> {
        let [along, across, turned] = self.slopes.row(0);
        let (sin, cos) = (2.0 * to.turn).sin_cos();
        let there = |t: usize| {
            let mean = self.mean[t];
            let here = mean + (self.x[t] - mean) * cos + 0.5 * f64::from(turned[t]) * sin;
            here + to.along * f64::from(along[t]) + to.across * f64::from(across[t])
        };
        (0..self.x.len()).map(there).collect()
    }
}

/// Solves for gauges at some places, with their directions as they are. Also how many right-hand sides that took: seven
/// a gauge, and one or two more where touches may be made otherwise: `touches` are those that are pressed.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn survey(
    pressed: &PressedModel,
    gauges: &[Gauge],
    (touches, making): (&[Touch], &Making),
    watch: Watch,
) -> Result<(Vec<Surveyed>, usize), Cancelled> {
    let (observer, angles) = gauges_on(pressed.model(), gauges);
    let strains = pressed.read(&observer, Quantity::Strain, watch)?;
    let count = pressed.touches();
    let columns: Vec<usize> = (0..count).collect();
    let mut turned = Vec::with_capacity(gauges.len() * count);
    let mut read = Vec::with_capacity(gauges.len());
    let mut rows = vec![vec![0.0; count]; 3];
    for (i, (gauge, &angle)) in gauges.iter().zip(&angles).enumerate() {
        for (k, row) in rows.iter_mut().enumerate() {
            strains.row_into(3 * i + k, row);
        }
        let weights = along(angle);
        let along_it = |t: usize| (0..3).map(|k| weights[k] * rows[k][t]).sum();
        let mean = |t: usize| f64::midpoint(rows[0][t], rows[1][t]);
        let moments = StrainMoments::of(&rows[0], &rows[1], &rows[2]);
        let site = moments.site(gauge.position, observer.frames()[i], angle, count);
        turned.extend(slopes::turned(&rows, angle, &columns));
        let x: Vec<f64> = columns.iter().map(|&t| along_it(t)).collect();
        let mean: Vec<f64> = columns.iter().map(|&t| mean(t)).collect();
        read.push((site, x, mean));
    }
    let read_gauges: Vec<Gauge> = read.iter().map(|(site, ..)| site.gauge).collect();
    let (changes, solves) = GluingSlopes::under(pressed, &read_gauges, turned, watch)?;
    let asked = SlopesAsked {
        model: pressed.model(),
        gauges: &read_gauges,
        touches,
        columns: &columns,
        watch,
    };
    let (otherwise, more) = MakingSlopes::of(&asked, making)?;
    let surveyed = (read.into_iter().enumerate()).map(|(i, (site, x, mean))| Surveyed {
        site,
        x,
        mean,
        slopes: changes.select_rows(&[i]),
        making: otherwise.only(i),
    });
    Ok((surveyed.collect(), strains.solves + solves + more))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn turned_by_right_angles_a_gauge_reads_what_its_components_say() {
        // ε along 0°, 90° and the shear of one touch; the gauge lies along 0°.
        let (xx, yy, xy) = (3.0, -1.0, 0.5);
        let gauge = Surveyed {
            site: Site {
                gauge: Gauge {
                    position: DVec3::ZERO,
                    direction: DVec3::X,
                    normal: DVec3::Z,
                },
                rms_strain: 0.0,
                peak_strain: 0.0,
            },
            x: vec![xx],
            mean: vec![f64::midpoint(xx, yy)],
            slopes: GluingSlopes::known(vec![0], [vec![10.0], vec![-20.0], vec![xy as f32]]),
            making: MakingSlopes::default(),
        };
        for turn in [0.0_f64, 0.3, 1.2, 2.0] {
            let weights = along(turn);
            let strain = weights[0] * xx + weights[1] * yy + weights[2] * xy;
            let still = Move {
                along: 0.0,
                across: 0.0,
                turn,
            };
            assert!((gauge.after(still)[0] - strain).abs() < 1e-6, "{turn}");
            let moved = Move {
                along: 0.1,
                across: 0.2,
                turn,
            };
            assert!((gauge.after(moved)[0] - (strain - 3.0)).abs() < 1e-6);
        }
    }
}

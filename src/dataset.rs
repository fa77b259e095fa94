//! What every site reports under every touch, and where the touches were.

mod columns;
mod making;
mod site;
mod slopes;
mod survey;

use glam::DVec3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::budget::{Cancelled, Watch, Work};
use crate::elasticity::observe::{Face, along};
use crate::elasticity::respond::{Quantity, respond};
use crate::elasticity::{Model, Push, Touch};
use crate::gauge::Gauge;
use crate::mesh::{SurfacePoint, TriMesh, geodesic, sample};
use crate::uncertainty::Making;
use crate::units;

use site::{SlopesAsked, StrainMoments, gauges_on};
use std::f64::consts::PI;

pub use columns::Columns;
pub use making::{MakingSlope, MakingSlopes};
pub use site::Site;
pub use slopes::GluingSlopes;
pub use survey::{Move, Surveyed, survey};

/// What a site reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Signal {
    /// Total displacement of the inside point, a magnitude (m): the paper's X.
    Displacement,
    /// Displacement along the outward normal, signed (m).
    NormalDisplacement,
    /// Strain along the gauge on the inside face: what a real gauge measures.
    #[default]
    Strain,
}

impl Signal {
    /// All, in the order of the enumeration.
    pub const ALL: [Self; 3] = [Self::Displacement, Self::NormalDisplacement, Self::Strain];

    /// As in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::NormalDisplacement => "normal-displacement",
            Self::Strain => "strain",
        }
    }
}

/// Values by rows: one row a site, one column a touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalMatrix {
    columns: usize,
    values: Vec<f64>,
}

impl SignalMatrix {
    /// `values` by rows; their number must be a multiple of `columns`.
    #[must_use]
    pub fn new(columns: usize, values: Vec<f64>) -> Self {
        debug_assert!(columns == 0 || values.len().is_multiple_of(columns));
        Self { columns, values }
    }
    /// Number of rows: sites.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.values.len().checked_div(self.columns).unwrap_or(0)
    }
    /// Number of columns: touches.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }
    /// One site's signal under every touch.
    #[must_use]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.columns..][..self.columns]
    }
    /// All values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }
    /// Some rows set to zero.
    #[must_use]
    pub fn with_zero_rows(mut self, rows: &[usize]) -> Self {
        for &r in rows {
            self.values[r * self.columns..][..self.columns].fill(0.0);
        }
        self
    }
    /// Each row times a factor of its own.
    #[must_use]
    pub fn scaled_rows(mut self, by: impl Iterator<Item = f64>) -> Self {
        for (row, by) in self.values.chunks_exact_mut(self.columns.max(1)).zip(by) {
            for v in row {
                *v *= by;
            }
        }
        self
    }
    /// All values times a factor.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        Self::new(self.columns, self.values.iter().map(|v| v * by).collect())
    }
    /// Some of the rows, in the order given.
    #[must_use]
    pub fn select_rows(&self, rows: &[usize]) -> Self {
        let values = rows.iter().flat_map(|&r| self.row(r)).copied().collect();
        Self::new(self.columns, values)
    }
    /// Some of the columns, in the order given.
    #[must_use]
    pub fn select_columns(&self, columns: &[usize]) -> Self {
        let values = (0..self.rows())
            .flat_map(|r| columns.iter().map(move |&c| self.row(r)[c]))
            .collect();
        Self::new(columns.len(), values)
    }
}

/// Signals of sites under touches.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// What the sites report.
    pub signal: Signal,
    /// A row of the signals each.
    pub sites: Vec<Site>,
    /// A column of the signals each.
    pub touches: Vec<Touch>,
    /// Sites × touches; m or strain.
    pub x: SignalMatrix,
    /// What readings change by as gauges are glued a little off, where that was asked for.
    pub slopes: Option<GluingSlopes>,
    /// What readings change by as touches are made otherwise, under the same touches.
    pub making: Option<MakingSlopes>,
    /// What it took.
    pub work: Work,
}

impl Dataset {
    /// Forgets all sites but the first.
    pub(crate) fn truncate(&mut self, sites: usize) {
        self.sites.truncate(sites);
        self.x.values.truncate(sites * self.x.columns);
        if let Some(slopes) = &mut self.slopes {
            slopes.truncate(sites);
        }
        if let Some(making) = &mut self.making {
            making.truncate(sites);
        }
    }

    /// One site more, read under every touch.
    pub(crate) fn push(&mut self, gauge: &Surveyed) {
        self.sites.push(gauge.site);
        self.x.values.extend_from_slice(&gauge.x);
        if let Some(slopes) = &mut self.slopes {
            slopes.push(&gauge.slopes);
        }
        if let Some(making) = &mut self.making {
            making.push(&gauge.making);
        }
    }

    /// Touch positions in millimetres: the targets that inference learns.
    #[must_use]
    pub fn targets_mm(&self) -> Vec<[f64; 3]> {
        self.touches
            .iter()
            .map(|t| units::mm(t.position).to_array())
            .collect()
    }
}

/// Where touches come, where that is not everywhere.
pub struct TouchRegion<'a> {
    /// For each triangle of the mesh whether any of the region may lie in it.
    pub triangles: Vec<bool>,
    /// Whether a place (m) belongs to it.
    pub contains: &'a dyn Fn(DVec3) -> bool,
    /// Where in it they come more often.
    pub often: Option<Often<'a>>,
}

/// Where touches come more often than elsewhere.
pub struct Often<'a> {
    /// For each triangle whether any place in it belongs there.
    pub triangles: Vec<bool>,
    /// Whether a place (m) belongs there.
    pub contains: &'a dyn Fn(DVec3) -> bool,
    /// How many times as many touches come to a piece of the surface there as to one beside it.
    pub times: f64,
}

/// Places by which areas are compared: to two or three per cent of what is accepted of them.
const MEASURED: usize = 4000;
const ORDER_SEED: u64 = 0x0f7e;

/// How much of some triangles (m²) is accepted, by trying.
fn accepted_area(
    mesh: &TriMesh,
    among: &dyn Fn(u32) -> bool,
    seed: u64,
    accept: &dyn Fn(SurfacePoint) -> bool,
) -> f64 {
    let triangles = 0..mesh.triangles().len() as u32;
    let area: f64 = triangles
        .filter(|&t| among(t))
        .map(|t| mesh.facet_area(t))
        .sum();
    let tried = sample::random_among(mesh, among, MEASURED, seed, |_| true);
    let accepted = tried.iter().filter(|at| accept(**at)).count();
    area * accepted as f64 / tried.len().max(1) as f64
}

/// How touches are spread over a surface.
#[derive(Clone, Copy, Debug)]
pub struct TouchPattern {
    /// How many there are.
    pub count: usize,
    /// Of their places.
    pub seed: u64,
    /// How far they stay from free edges (m).
    pub margin: f64,
    /// Evenly, for a model to learn from; else uniformly at random, for tests.
    pub even: bool,
    /// Force (N) and radius of the tip (m).
    pub tip: (f64, f64),
}

/// Touches spread over the surface, or over a region of it.
#[must_use]
pub fn distribute_touches(
    mesh: &TriMesh,
    pattern: &TouchPattern,
    region: Option<&TouchRegion>,
) -> Vec<Touch> {
    let TouchPattern {
        count,
        seed,
        margin,
        even,
        tip: (force, tip_radius),
    } = *pattern;
    let rims: Vec<u32> = (0..)
        .zip(mesh.boundary_vertices())
        .filter_map(|(v, rim)| rim.then_some(v))
        .collect();
    let edge = geodesic::from_vertices(mesh, &rims, 2.0 * margin + 4.0 * mesh.mean_edge());
    let far = |v: f64| if v.is_finite() { v } else { 1e3 };
    let edge: Vec<f64> = edge.into_iter().map(far).collect();
    let inside = |at: SurfacePoint| {
        (rims.is_empty() || mesh.interpolate(&edge, at) >= margin)
            && region.is_none_or(|region| (region.contains)(mesh.point(at)))
    };
    let among = |t: u32| region.is_none_or(|region| region.triangles[t as usize]);
    let draw =
        |count: usize, among: &dyn Fn(u32) -> bool, accept: &dyn Fn(SurfacePoint) -> bool| {
            if even {
                sample::even_among(mesh, among, count, seed, accept)
            } else {
                sample::random_among(mesh, among, count, seed, accept)
            }
        };
    let points = match region.and_then(|region| region.often.as_ref()) {
        None => draw(count, &among, &inside),
        Some(often) => {
            let there = |at: SurfacePoint| (often.contains)(mesh.point(at));
            let near = |t: u32| among(t) && often.triangles[t as usize];
            let frequented = |at: SurfacePoint| there(at) && inside(at);
            let often_area = accepted_area(mesh, &near, seed, &frequented);
            let all = accepted_area(mesh, &among, seed, &inside);
            let weight = often_area * often.times;
            let share = weight / (weight + (all - often_area).max(0.0)).max(f64::MIN_POSITIVE);
            let frequent = (count as f64 * share).round() as usize;
            let mut points = draw(frequent, &near, &frequented);
            points.extend(draw(count - frequent, &among, &|at| {
                !there(at) && inside(at)
            }));
            // As of all touches: in no order.
            points.shuffle(&mut ChaCha8Rng::seed_from_u64(
                seed.wrapping_add(ORDER_SEED),
            ));
            points
        }
    };
    points
        .into_iter()
        .map(|at| Touch {
            position: mesh.point(at),
            normal: mesh.normal(at),
            force,
            tip_radius,
        })
        .collect()
}

/// What is read of simulated touches.
#[derive(Clone, Copy)]
pub struct AskedSignals<'a> {
    /// The kind of signal.
    pub signal: Signal,
    /// How many sites one after the other share a point: the first lies along the largest strain, the others are evenly
    /// turned from it.
    pub directions: usize,
    /// Numbers of the touches for which it is found what gluing changes of a strain, and what it changes that they are made
    /// otherwise.
    pub slope_touches: &'a [usize],
    /// As touches may be made.
    pub making: &'a Making,
}

/// Simulates all touches and reads the signal at all sites. Gauge directions follow the strain over
/// these very touches.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn simulate(
    model: &dyn Model,
    touches: Vec<Touch>,
    points: &[SurfacePoint],
    asked: &AskedSignals,
    watch: Watch,
) -> Result<Dataset, Cancelled> {
    let AskedSignals {
        signal,
        directions,
        slope_touches,
        making,
    } = *asked;
    let observer = model.observer(points, Face::Inside);
    let reading = match signal {
        Signal::Strain => Quantity::Strain,
        Signal::Displacement | Signal::NormalDisplacement => Quantity::StrainAndDisplacement,
    };
    let responses = respond(model, &touches, &observer, reading, watch)?;
    let count = touches.len();
    let mut values = vec![0.0; points.len() * count];
    let read: Vec<(Site, Vec<f32>)> = values
        .par_chunks_mut(count)
        .enumerate()
        .map_init(
            || vec![vec![0.0; count]; 3],
            |rows, (i, into)| {
                for (k, row) in rows.iter_mut().enumerate() {
                    responses.row_into(3 * i + k, row);
                }
                let moments = StrainMoments::of(&rows[0], &rows[1], &rows[2]);
                let turned = (i % directions) as f64 * PI / directions as f64;
                let angle = (moments.dominant_angle() + turned) % PI;
                let frame = observer.frames()[i];
                let mut by_angle = Vec::new();
                if signal == Signal::Strain {
                    let w = along(angle);
                    for (t, x) in into.iter_mut().enumerate() {
                        *x = w[0] * rows[0][t] + w[1] * rows[1][t] + w[2] * rows[2][t];
                    }
                    by_angle = slopes::turned(rows, angle, slope_touches);
                } else {
                    for (k, row) in rows.iter_mut().enumerate() {
                        responses.row_into(3 * (points.len() + i) + k, row);
                    }
                    read_displacement(signal, frame.z_axis, rows, into);
                }
                let position = model.mesh().point(points[i]);
                (moments.site(position, frame, angle, count), by_angle)
            },
        )
        .collect();
    let (sites, by_angle): (Vec<Site>, Vec<Vec<f32>>) = read.into_iter().unzip();
    let mut work = model.system().work();
    work.solves += responses.solves as u64;
    // The strains go before moved gauges are read.
    drop(responses);
    let (mut slopes, mut otherwise) = (None, None);
    if signal == Signal::Strain && !slope_touches.is_empty() {
        let turned = by_angle.into_iter().flatten().collect();
        let gauges: Vec<Gauge> = sites.iter().map(|s| s.gauge).collect();
        let asked = SlopesAsked {
            model,
            gauges: &gauges,
            touches: &touches,
            columns: slope_touches,
            watch,
        };
        let (found, solves) = GluingSlopes::of(&asked, turned)?;
        work.solves += solves as u64;
        slopes = Some(found);
        let (found, solves) = MakingSlopes::of(&asked, making)?;
        work.solves += solves as u64;
        otherwise = Some(found);
    }
    Ok(Dataset {
        signal,
        sites,
        touches,
        x: SignalMatrix::new(count, values),
        slopes,
        making: otherwise,
        work,
    })
}

/// Reads the signal of given gauges under given touches: what a
/// finer model says of a design made on a coarser one. Also how many right-hand sides that took.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn measure(
    model: &dyn Model,
    touches: &[impl Copy + Sync + Into<Push>],
    gauges: &[Gauge],
    signal: Signal,
    watch: Watch,
) -> Result<(SignalMatrix, usize), Cancelled> {
    let (observer, angles) = gauges_on(model, gauges);
    let reading = match signal {
        Signal::Strain => Quantity::Gauge(&angles),
        Signal::Displacement | Signal::NormalDisplacement => Quantity::Displacement,
    };
    let responses = respond(model, touches, &observer, reading, watch)?;
    let mut values = vec![0.0; gauges.len() * touches.len()];
    let mut rows = vec![vec![0.0; touches.len()]; 3];
    for (i, into) in values.chunks_exact_mut(touches.len()).enumerate() {
        if signal == Signal::Strain {
            responses.row_into(i, into);
            continue;
        }
        for (k, row) in rows.iter_mut().enumerate() {
            responses.row_into(3 * i + k, row);
        }
        read_displacement(signal, observer.frames()[i].z_axis, &rows, into);
    }
    Ok((SignalMatrix::new(touches.len(), values), responses.solves))
}

/// The displacement signal from its three components by rows.
fn read_displacement(signal: Signal, normal: DVec3, rows: &[Vec<f64>], into: &mut [f64]) {
    for (t, x) in into.iter_mut().enumerate() {
        let u = DVec3::new(rows[0][t], rows[1][t], rows[2][t]);
        *x = if signal == Signal::Displacement {
            u.length()
        } else {
            u.dot(normal)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_follows_the_largest_strain() {
        // Uniaxial strain along 30°, of either sign: the gauge must lie along it.
        let angle = PI / 6.0;
        let (c, s) = (angle.cos(), angle.sin());
        let e = [1.0, -2.0, 0.5];
        let component = |k: f64| e.map(|e| e * k);
        let m = StrainMoments::of(
            &component(c * c),
            &component(s * s),
            &component(2.0 * c * s),
        );
        assert!((m.dominant_angle() - angle).abs() < 1e-6);
        assert!((m.peak - 2.0).abs() < 1e-12);
    }
}

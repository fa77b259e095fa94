//! What glued gauges read under any touch, from one solution a gauge.
//!
//! K is symmetric, so with b the row that reads a gauge from the displacements, u = K⁻¹ b is the field that
//! weighs the nodal forces of a touch (Maxwell–Betti): after one solve a gauge, any touch costs its own
//! quadrature and no solve at all. The factored model is not needed any more.

use std::sync::Arc;

use glam::DVec3;

use super::Model;
use super::load::{Push, Touch, pushed};
use super::observe::Face;
use super::respond::{Quantity, output_rows};
use super::rows::SparseRows;
use crate::budget::{Cancelled, Watch};
use crate::gauge::Gauge;
use crate::mesh::{SurfacePoint, TriMesh};

/// Gauss points over the half length and half width, with their weights: exact for quintics along the grid and
/// for cubics across it.
const ALONG: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 18.0),
    (0.0, 8.0 / 18.0),
    (0.774_596_669_241_483_4, 5.0 / 18.0),
];
const ACROSS: [(f64, f64); 2] = [
    (-0.577_350_269_189_625_8, 0.5),
    (0.577_350_269_189_625_8, 0.5),
];

/// Places over a gauge's grid of a length and a width (m), and what each weighs in the mean.
fn over_grid(gauge: &Gauge, [length, width]: [f64; 2]) -> impl Iterator<Item = (DVec3, f64)> {
    ALONG.into_iter().flat_map(move |(s, v)| {
        ACROSS.into_iter().map(move |(t, w)| {
            let off = gauge.direction * (s * length) + gauge.across() * (t * width);
            (gauge.position + off / 2.0, v * w)
        })
    })
}

/// The weights of nodal forces in every gauge's strain.
pub struct Sensitivity {
    /// The surface that touches press on (m).
    pub mesh: Arc<TriMesh>,
    gauges: usize,
    /// Vertices × gauges: strain a newton along x, y and z there.
    weights: Vec<DVec3>,
}

impl Sensitivity {
    /// Solves for gauges on a model, each of which reads the mean strain over a grid of this length and width (m).
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        model: &dyn Model,
        gauges: &[Gauge],
        grid: [f64; 2],
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let rows = mean_rows(model, gauges, grid);
        let system = model.system();
        let blocks =
            system.solve_rows(&rows, None, "Solving gauges", watch, |_, rows, solved| {
                (rows.to_vec(), model.translations(solved, rows.len()))
            })?;
        let mesh = model.mesh();
        let vertices = mesh.positions().len();
        let mut weights = vec![DVec3::ZERO; vertices * gauges.len()];
        for (rows, fields) in blocks {
            for (&gauge, field) in rows.iter().zip(&fields) {
                for (v, &w) in field.iter().enumerate() {
                    weights[v * gauges.len() + gauge as usize] = w;
                }
            }
        }
        Ok(Self {
            mesh: Arc::clone(mesh),
            gauges: gauges.len(),
            weights,
        })
    }

    /// From weights that are known (vertices × gauges: strain a newton along x, y and z there).
    #[must_use]
    pub fn of(mesh: Arc<TriMesh>, gauges: usize, weights: Vec<DVec3>) -> Self {
        debug_assert_eq!(weights.len(), mesh.positions().len() * gauges);
        Self {
            mesh,
            gauges,
            weights,
        }
    }

    /// Vertices × gauges: strain a newton along x, y and z there.
    #[must_use]
    pub fn weights(&self) -> &[DVec3] {
        &self.weights
    }

    /// How many gauges there are.
    #[must_use]
    pub fn gauges(&self) -> usize {
        self.gauges
    }

    /// Strains of all gauges under a touch.
    #[must_use]
    pub fn read(&self, touch: &Touch) -> Vec<f64> {
        self.read_push(&touch.into())
    }

    /// Strains of all gauges under one newton along x, y and z each, spread as the tip of a touch spreads its own.
    #[must_use]
    pub fn read_axes(&self, touch: &Touch) -> Vec<DVec3> {
        let mut strains = vec![DVec3::ZERO; self.gauges];
        let shares = Push {
            touch: *touch,
            force: DVec3::X,
        };
        for (vertex, share) in pushed(&self.mesh, &shares) {
            let row = &self.weights[vertex as usize * self.gauges..][..self.gauges];
            for (strain, weight) in strains.iter_mut().zip(row) {
                *strain += *weight * share.x;
            }
        }
        strains
    }

    /// Strains of all gauges under a push.
    #[must_use]
    pub fn read_push(&self, push: &Push) -> Vec<f64> {
        let mut strains = vec![0.0; self.gauges];
        for (vertex, force) in pushed(&self.mesh, push) {
            let row = &self.weights[vertex as usize * self.gauges..][..self.gauges];
            for (strain, weight) in strains.iter_mut().zip(row) {
                *strain += weight.dot(force);
            }
        }
        strains
    }
}

/// Mean strain over each gauge's grid, as rows over solved blocks.
fn mean_rows(model: &dyn Model, gauges: &[Gauge], grid: [f64; 2]) -> SparseRows {
    let (mut points, mut directions) = (Vec::<SurfacePoint>::new(), Vec::new());
    let mut means = SparseRows::default();
    for gauge in gauges {
        let first = points.len() as u32;
        let places: Vec<(DVec3, f64)> = over_grid(gauge, grid).collect();
        means.push((first..).zip(&places).map(|(i, (_, weight))| (i, *weight)));
        for (place, _) in places {
            points.push(model.index().nearest(place).0);
            directions.push(gauge.direction);
        }
    }
    let observer = model.observer(&points, Face::Inside);
    let angles: Vec<f64> = (directions.iter().zip(observer.frames()))
        .map(|(d, f)| d.dot(f.y_axis).atan2(d.dot(f.x_axis)))
        .collect();
    means.times(&output_rows(&observer, Quantity::Gauge(&angles)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::unwatched;
    use crate::elasticity::DofSet;
    use crate::elasticity::ShellModel;
    use crate::elasticity::respond::respond;
    use crate::limb::LimbSpec;
    use crate::mesh::sample;

    /// Against a solution of every touch, for a gauge so small that it is a point.
    #[test]
    fn what_gauges_read_is_what_the_model_says() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        let mesh = Arc::new(mesh);
        let low = |p: &DVec3| {
            if p.z < 5e-3 {
                DofSet::ALL
            } else {
                DofSet::default()
            }
        };
        let held: Vec<DofSet> = mesh.positions().iter().map(low).collect();
        let section = crate::project::Project::around("", None).section();
        let model = ShellModel::new(&mesh, section, &held, &unwatched).unwrap();
        let points = sample::random(&mesh, 5, 3, |_| true);
        let observer = model.observer(&points, Face::Inside);
        let gauges: Vec<Gauge> = (points.iter().zip(observer.frames()))
            .map(|(&at, frame)| Gauge {
                position: mesh.point(at),
                direction: frame.x_axis,
                normal: frame.z_axis,
            })
            .collect();
        let touches: Vec<Touch> = (sample::random(&mesh, 9, 4, |_| true).into_iter())
            .map(|at| Touch {
                position: mesh.point(at),
                normal: mesh.normal(at),
                force: 7.0,
                tip_radius: 5e-3,
            })
            .collect();
        let sensitivity = Sensitivity::new(&model, &gauges, [1e-7; 2], &unwatched).unwrap();
        let angles = vec![0.0; 5];
        let solved = respond(
            &model,
            &touches,
            &observer,
            Quantity::Gauge(&angles),
            &unwatched,
        );
        let solved = solved.unwrap();
        let mut row = vec![0.0; touches.len()];
        for gauge in 0..5 {
            solved.row_into(gauge, &mut row);
            let largest = row.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (t, touch) in touches.iter().enumerate() {
                let read = sensitivity.read(touch)[gauge];
                assert!((read - row[t]).abs() < 1e-4 * largest, "{read} {}", row[t]);
            }
        }
    }
}

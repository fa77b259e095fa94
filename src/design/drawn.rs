//! What gauges read everywhere as they were drawn, and where known touches are best pressed on them.

use std::sync::Arc;

use super::layout::touches_on;
use super::{DesignError, Ground, Inputs};
use crate::budget::{Cancelled, Watch};
use crate::elasticity::sensitivity::Sensitivity;
use crate::elasticity::{Model, Touch};
use crate::gauge::Gauge;
use crate::inference::{AsDrawn, ResponseMap};
use crate::mesh::TriMesh;
use crate::uncertainty::Making;
use crate::units;

/// Known touches that are proposed.
pub const PROPOSED: usize = 12;

const PROPOSED_SEED: u64 = 0xca11;

/// Known touches as they are proposed, on the surface that touches land on.
pub(super) fn proposed(mesh: &TriMesh, inputs: &Inputs) -> Result<Vec<Touch>, DesignError> {
    touches_on(mesh, inputs, PROPOSED, PROPOSED_SEED, (true, false))
}

/// Length and width (m) of the grid of a gauge that reads at a point.
pub(super) const POINT: [f64; 2] = [1e-9, 1e-9];

/// What gauges, with grids of a length and a width (m), read everywhere on a mesh, as drawn, as it changes with the way they are glued, and with that in which
/// touches by a tip of some radius (m) are made, as far as that may be off.
pub(super) fn drawn_on(
    model: &dyn Model,
    (gauges, grid): (&[Gauge], [f64; 2]),
    mesh: &Arc<TriMesh>,
    (tip_radius, making): (f64, &Making),
    watch: Watch,
) -> Result<AsDrawn, Cancelled> {
    let moved: Vec<Gauge> = gauges.iter().flat_map(moved).collect();
    let sensitivity = Sensitivity::new(model, &moved, grid, watch)?;
    let pressed = |radius: f64| ResponseMap::new(&sensitivity, Arc::clone(mesh), radius, watch);
    let mut drawn = if making.friction > 0.0 {
        let axes = ResponseMap::along_axes(&sensitivity, mesh, tip_radius, watch)?;
        let own = axes.each_ref().map(|m| m.mixed(&unmoved(gauges.len())));
        AsDrawn {
            axes: Some(Arc::new(own)),
            ..as_drawn(&ResponseMap::pressing(&axes), gauges.len())
        }
    } else {
        as_drawn(&pressed(tip_radius)?, gauges.len())
    };
    let off = making.tip;
    if off > 0.0 {
        let larger = as_drawn(&pressed(tip_radius + off)?, gauges.len());
        let rise = vec![[off.recip(), -off.recip()]; gauges.len()];
        let change = (larger.map).combined(std::array::from_ref(&*drawn.map), &rise);
        drawn.tip = Some(Arc::new(change));
    }
    Ok(drawn)
}

/// A gauge as drawn, and moved and turned either way.
fn moved(gauge: &Gauge) -> [Gauge; MOVES] {
    let at = |along: f64, across: f64, degrees: f64| Gauge {
        position: gauge.moved(along, across).position,
        ..gauge.turned(degrees.to_radians())
    };
    let (s, t) = (units::from_mm(STEP_MM), STEP_DEGREES);
    [
        at(0.0, 0.0, 0.0),
        at(s, 0.0, 0.0),
        at(-s, 0.0, 0.0),
        at(0.0, s, 0.0),
        at(0.0, -s, 0.0),
        at(0.0, 0.0, t),
        at(0.0, 0.0, -t),
    ]
}

/// Of central differences: as far as a workshop is off.
const STEP_MM: f64 = 0.75;

const STEP_DEGREES: f64 = 3.0;

pub(super) const MOVES: usize = 7;

/// The gauges as they were drawn, among all that were moved.
fn unmoved(gauges: usize) -> Vec<Vec<(usize, f64)>> {
    (0..gauges).map(|g| vec![(MOVES * g, 1.0)]).collect()
}

fn as_drawn(all: &ResponseMap, gauges: usize) -> AsDrawn {
    let change = |forth: usize, step: f64| {
        let difference = |g: usize| {
            let first = MOVES * g + forth;
            vec![(first, 0.5 / step), (first + 1, -0.5 / step)]
        };
        all.mixed(&(0..gauges).map(difference).collect::<Vec<_>>())
    };
    AsDrawn {
        map: Arc::new(all.mixed(&unmoved(gauges))),
        changes: [
            change(1, STEP_MM),
            change(3, STEP_MM),
            change(5, STEP_DEGREES),
        ],
        tip: None,
        axes: None,
    }
}

/// Edge length (m) of the mesh that readings are known on: fine enough for the tip, which smooths them, and
/// no more than about so many triangles.
pub(super) fn map_size(ground: &Ground, tip_radius: f64, triangles: usize) -> f64 {
    const OF_THE_TIP: f64 = 0.32;
    let coarsest = (ground.area() / triangles as f64 / 0.433).sqrt();
    (OF_THE_TIP * tip_radius).max(coarsest)
}

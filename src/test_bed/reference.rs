//! Which place is pressed again and again: where the gauges see best whether the tip stands beside it.

use std::path::Path;

use glam::DVec3;

use super::asked::BenchRequest;
use super::places::reached;
use crate::bench::{CheckPlace, Machine, Planned, TableMount};
use crate::design::{Inputs, Sensing};
use crate::elasticity::Touch;
use crate::io::bench_folder;

/// Places that are looked at for it.
const CANDIDATES: usize = 200;

/// The reference of a run; nothing where none is wanted, or no place answers to the gauges.
pub(super) fn reference(
    asked: &BenchRequest,
    folder: &Path,
    inputs: &Inputs,
    sensing: &Sensing,
    (machine, mount): (&Machine, &TableMount),
) -> anyhow::Result<Option<CheckPlace>> {
    if asked.check == 0 {
        return Ok(None);
    }
    let seed = inputs.project.budget.seed;
    let touches = sensing.touches(inputs, CANDIDATES, seed, true)?;
    let places: Vec<DVec3> = touches.iter().map(|t| t.position).collect();
    let reach = reached(&places, sensing, machine, mount)?;
    let tells = |planned: &Planned| tells(sensing, planned, machine.tip_radius);
    let scored = reach.presses.iter().map(|p| (tells(p), p));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, at)) = best.filter(|(change, _)| *change > 0.0) else {
        return Ok(None);
    };
    Ok(Some(CheckPlace {
        at: *at,
        every: asked.check,
        answer: bench_folder::read_answer(folder)?,
    }))
}

/// The least that the gauges change when the tip stands beside a place (strain, a newton and a millimetre).
fn tells(sensing: &Sensing, planned: &Planned, tip_radius: f64) -> f64 {
    /// How far beside it (m).
    const BESIDE: f64 = 1e-3;
    let surface = &sensing.drawn.map.mesh;
    let read = |place: DVec3| {
        let (at, _) = surface.index().nearest(place);
        sensing.sensitivity.read(&Touch {
            position: surface.point(at),
            normal: surface.normal(at),
            force: 1.0,
            tip_radius,
        })
    };
    let (u, v) = planned.normal.any_orthonormal_pair();
    let change = |along: DVec3| {
        let [there, here] = [1.0, -1.0].map(|s| read(planned.at + along * (s * BESIDE)));
        let squares = there.iter().zip(&here).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt() / 2.0
    };
    let directions = [u, v, (u + v).normalize(), (u - v).normalize()];
    directions
        .map(change)
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

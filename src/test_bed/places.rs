//! Where is pressed.

use std::path::Path;

use anyhow::ensure;
use glam::DVec3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::asked::BenchRequest;
use crate::bench::{Machine, MachineReach, TableMount, plan};
use crate::design::{DesignError, Inputs, Sensing, check_reach};
use crate::io::{bench_folder, points};
use crate::plain;

/// Where to press: as it was planned before, as somebody says, or evenly over the part in an order of chance, so that the first
/// presses cover all of it too.
pub(super) fn places(
    asked: &BenchRequest,
    folder: &Path,
    inputs: &Inputs,
    sensing: &Sensing,
    begun: bool,
) -> anyhow::Result<Vec<DVec3>> {
    if begun {
        return Ok(bench_folder::read_plan(folder)?);
    }
    if let Some(path) = &asked.points {
        return points_of(path, inputs);
    }
    let seed = inputs.project.budget.seed;
    let touches = sensing.touches(inputs, asked.places, seed, true)?;
    let mut places: Vec<DVec3> = touches.iter().map(|t| t.position).collect();
    places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    Ok(places)
}

/// Somebody's own points (m).
///
/// # Errors
/// One that lies far from the part, by its file and line.
pub(super) fn points_of(path: &Path, inputs: &Inputs) -> anyhow::Result<Vec<DVec3>> {
    let asked = points::read_points(path)?;
    let places: Vec<DVec3> = asked.into_iter().map(|p| p.position).collect();
    check_reach(&inputs.part, "point", places.iter().copied())
        .map_err(|error| in_file(error, path))?;
    Ok(places)
}

/// An error of one of the points, with its file and line before it.
fn in_file(error: DesignError, path: &Path) -> anyhow::Error {
    let place = match error {
        DesignError::OffThePart { number, .. } => points::place(path, number),
        _ => plain::path(path),
    };
    anyhow::Error::new(error).context(place)
}

/// Those that the machine gets to.
pub(super) fn reached(
    places: &[DVec3],
    sensing: &Sensing,
    machine: &Machine,
    mount: &TableMount,
) -> anyhow::Result<MachineReach> {
    let surface = &sensing.drawn.map.mesh;
    let on_surface: Vec<(DVec3, DVec3)> = (places.iter())
        .map(|place| {
            let (at, _) = surface.index().nearest(*place);
            (surface.point(at), surface.normal(at))
        })
        .collect();
    let reach = plan(&on_surface, surface, machine, mount).map_err(anyhow::Error::msg)?;
    ensure!(
        !reach.presses.is_empty(),
        "the machine gets to none of {}: {}",
        plain::either(places.len(), "place", "places"),
        reach.left_out.first().map_or("there is none", |l| &l.1)
    );
    Ok(reach)
}

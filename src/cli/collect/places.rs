//! Where is pressed.

use anyhow::ensure;
use glam::DVec3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::args::CollectArgs;
use crate::bench::{Reach, plan};
use crate::design::Sensing;
use crate::io::machine_file::MachineFile;
use crate::io::project_file::LoadedProject;
use crate::io::{bench_folder, points};
use crate::plain;

/// Where to press: as it was planned before, as somebody says, or evenly over the part in an order of chance, so that the first
/// presses cover all of it too.
pub(super) fn places(
    args: &CollectArgs,
    loaded: &LoadedProject,
    sensing: &Sensing,
    begun: bool,
) -> anyhow::Result<Vec<DVec3>> {
    if begun {
        return Ok(bench_folder::read_plan(&args.out)?);
    }
    if let Some(path) = &args.points {
        let points = points::read_points(path)?;
        return Ok(points.into_iter().map(|p| p.position).collect());
    }
    let seed = loaded.inputs.project.budget.seed;
    let touches = sensing.touches(&loaded.inputs, args.places, seed, true)?;
    let mut places: Vec<DVec3> = touches.iter().map(|t| t.position).collect();
    places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    Ok(places)
}

/// Those that the machine gets to.
pub(super) fn reached(
    places: &[DVec3],
    loaded: &LoadedProject,
    sensing: &Sensing,
    file: &MachineFile,
    say: &mut dyn FnMut(&str),
) -> anyhow::Result<Reach> {
    let surface = &sensing.drawn.map.mesh;
    let stance = loaded.inputs.project.part.axis.stance(&loaded.inputs.part);
    let (mount, off) = file
        .mount(&loaded.inputs.part, &stance)
        .map_err(anyhow::Error::msg)?;
    if !off.is_empty() {
        let each: Vec<String> = off.iter().map(|o| format!("{:.2}", o * 1e3)).collect();
        say(&format!(
            "the limb stands as its touched points say; they are {} mm off",
            each.join(", ")
        ));
    }
    let on_surface: Vec<(DVec3, DVec3)> = (places.iter())
        .map(|place| {
            let (at, _) = surface.index().nearest(*place);
            (surface.point(at), surface.normal(at))
        })
        .collect();
    let reach = plan(&on_surface, surface, &file.machine, &mount).map_err(anyhow::Error::msg)?;
    ensure!(
        !reach.presses.is_empty(),
        "the machine gets to none of {}: {}",
        plain::either(places.len(), "place", "places"),
        reach.left_out.first().map_or("there is none", |l| &l.1)
    );
    Ok(reach)
}

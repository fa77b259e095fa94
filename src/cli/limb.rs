//! `hapdef limb`: the generator of the bundled limbs and their families.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use clap::Args;
use serde_json::json;

use super::out;
use crate::design::Inputs;
use crate::io::{atomic, glb, project_file};
use crate::project::{Masks, Project};
use crate::varied::{LimbOptions, MadeLimb, made};

/// Without options it writes the bundled limb, with `--pattern triangles` the other one.
#[derive(Args, Debug, Clone)]
pub struct LimbArgs {
    /// Folder for limb.glb and limb.hapdef.toml, or barrel.glb and barrel.hapdef.toml of triangles.
    #[arg(long)]
    pub out: PathBuf,
    #[command(flatten)]
    pub limb: LimbOptions,
    /// Leave the project without chosen sites (they take a Draft design).
    #[arg(long)]
    pub no_sites: bool,
    /// Print what was written as one JSON object.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &LimbArgs) -> anyhow::Result<()> {
    let MadeLimb {
        name,
        mesh,
        mut project,
        radius_mm,
    } = made(&args.limb)?;
    std::fs::create_dir_all(&args.out)
        .with_context(|| format!("{}: the folder cannot be created", args.out.display()))?;
    let mesh_path = args.out.join(format!("{name}.glb"));
    let bytes = glb::write_glb(&mesh)?;
    atomic::write(&mesh_path, &bytes)?;
    if !args.no_sites {
        // On the mesh as it is in the file (single precision), like anyone who opens it.
        let stored = crate::io::mesh_file::parse_glb(&bytes)
            .map_err(anyhow::Error::msg)?
            .mesh;
        project.selection.sites = choose_sites(&project, stored)?;
    }
    project_file::save(
        &args.out.join(format!("{name}.hapdef.toml")),
        &project,
        None,
        &Masks::new(),
    )?;
    let figures = json!({
        "vertices": mesh.positions().len(),
        "triangles": mesh.triangles().len(),
        "mean_edge_mm": mesh.mean_edge() * 1000.0,
        "radius_mm": radius_mm,
        "area_mm2": mesh.area() * 1e6,
        "sites": project.selection.sites.len(),
    });
    if args.json {
        out::line(&figures.to_string())
    } else {
        out::line(&format!("{}: {figures}", args.out.display()))
    }
}

/// Seed of the draws that the example's gauges are chosen by. Sets of other draws are expected to be as little off, but a
/// choice asks for nothing else: how well they tell two fingers apart and feel light touches under a drift differs from
/// set to set, and the example is one that does both well (RESULTS.md, “Ten gauges are not ten gauges”).
const EXAMPLE_SEED: u64 = 11;

/// Ten sites by a Draft design, as the project chooses them.
fn choose_sites(
    project: &Project,
    mesh: crate::mesh::TriMesh,
) -> anyhow::Result<Vec<crate::project::ChosenSite>> {
    use crate::budget::{Quality, unwatched};
    let mut project = project.clone();
    project.budget.seed = EXAMPLE_SEED;
    let inputs = Inputs {
        project,
        part: Arc::new(mesh),
        painted: None,
        masks: Masks::new(),
    };
    let budget = Quality::Draft.budget();
    let simulated = crate::design::simulate(&inputs, &budget, &unwatched)?;
    let feasibility = crate::design::filter(&inputs, &simulated);
    let reduced = crate::design::reduce_sites(&inputs, &simulated, &feasibility, &budget)?;
    let from = crate::design::Choosing {
        inputs: &inputs,
        simulated: &simulated,
        reduced: &reduced,
        budget: &budget,
        watch: &unwatched,
    };
    let selection = from.select(inputs.project.selection.selector)?;
    let sites = selection.sets.last().map_or(&[][..], |s| &s.sites);
    Ok(crate::io::artifacts::as_chosen(
        &simulated.dataset.sites,
        sites,
    ))
}

//! `hapdef export`: the limb with its gauges as files for colleagues and robots.

use std::path::PathBuf;

use anyhow::{Context as _, ensure};
use clap::Args;
use glam::DVec3;

use super::common::Common;
use super::listen::sensing_for;
use super::out;
use super::ranges::between;
use super::spared::Spared;
use crate::budget::unwatched;
use crate::design::{Nearness, check_chosen};
use crate::elasticity::Touch;
use crate::io::handover::{StepScene, link};
use crate::io::project_file::LoadedProject;
use crate::io::run::Provenance;
use crate::io::{atomic, outlet};
use crate::mesh::TriMesh;
use crate::plain;
use crate::workshop::{self, Inner};

#[derive(Args, Debug, Clone)]
pub struct ExportArgs {
    #[command(flatten)]
    pub common: Common,
    /// The scene (.glb): limb and gauges, and with --touch what it does.
    #[arg(long)]
    pub gltf: Option<PathBuf>,
    /// A URDF fragment with a frame for each gauge (.urdf).
    #[arg(long)]
    pub urdf: Option<PathBuf>,
    /// The robot's link that the limb is; its name in the description, or the mesh's.
    #[arg(long)]
    pub link: Option<String>,
    /// Where the limb is touched, `X,Y,Z` (mm): it is drawn as it gives way then, coloured by how far.
    #[arg(long, value_parser = place, allow_hyphen_values = true)]
    pub touch: Option<DVec3>,
    /// How hard (N).
    #[arg(long, default_value_t = 10.0, value_parser = between(1e-3, 1e5))]
    pub force: f64,
    /// How often the displacement is drawn.
    #[arg(long, default_value_t = 1.0, value_parser = between(0.0, 1e4))]
    pub exaggerate: f64,
}

/// Three numbers (mm), as metres.
fn place(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|w| w.trim().parse().ok())
        .collect();
    match numbers[..] {
        [x, y, z] if numbers.iter().all(|v| v.is_finite()) => Ok(DVec3::new(x, y, z) * 1e-3),
        _ => Err("a place is X,Y,Z in millimetres".into()),
    }
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &ExportArgs) -> anyhow::Result<()> {
    ensure!(
        args.gltf.is_some() || args.urdf.is_some(),
        "say what to write: --gltf FILE.glb, --urdf FILE.urdf, or both"
    );
    let loaded = args.common.load()?;
    loaded.inputs.project.check()?;
    check_chosen(&loaded.inputs)?;
    for (option, path) in [("--gltf", &args.gltf), ("--urdf", &args.urdf)] {
        if let Some(path) = path {
            Spared::of(&loaded).check(option, Some(path))?;
            outlet::file(path)?;
        }
    }
    let inner = Inner::of_project(&loaded.inputs);
    if let Some(path) = &args.urdf {
        ensure!(
            !inner.gauges.is_empty(),
            "the project has no gauges yet: choose them first (hapdef design)"
        );
        let provenance = Provenance {
            mesh_path: &loaded.mesh_path,
            version: env!("CARGO_PKG_VERSION"),
            taken_in: None,
        };
        let own = link(&provenance);
        let link = args.link.as_ref().unwrap_or(&own);
        let text = workshop::urdf(&inner.gauges, link, link);
        atomic::write(path, text.as_bytes())?;
        out::say(&format!("wrote {}", plain::path(path)));
    }
    if let Some(path) = &args.gltf {
        let bytes = scene(args, &loaded, &inner)?;
        atomic::write(path, &bytes)?;
        out::say(&format!("wrote {}", plain::path(path)));
    }
    Ok(())
}

fn scene(args: &ExportArgs, loaded: &LoadedProject, inner: &Inner) -> anyhow::Result<Vec<u8>> {
    let keys = &loaded.inputs.project.gauge;
    let grid_mm = [keys.grid_length_mm, keys.grid_width_mm];
    let still = StepScene {
        limb: &loaded.inputs.part,
        field: None,
        inner,
        grid_mm,
        touch: None,
        run: None,
    };
    let Some(place) = args.touch else {
        return still.glb().map_err(anyhow::Error::msg);
    };
    let (limb, moved, touch) = pressed(args, loaded, place)?;
    let most = moved.iter().map(|u| u.length()).fold(0.0, f64::max);
    out::say(&format!(
        "{} N there move the limb by {} mm at most",
        args.force,
        plain::digits(most * 1e3)
    ));
    let field: Vec<f64> = moved
        .iter()
        .map(|u| u.length() / most.max(f64::MIN_POSITIVE))
        .collect();
    let shaken = |p: DVec3| {
        let (at, _) = limb.index().nearest(p);
        let tri = limb.triangles()[at.triangle as usize];
        let parts = tri.iter().zip(at.barycentric);
        p + parts.map(|(&v, w)| moved[v as usize] * w).sum::<DVec3>() * args.exaggerate
    };
    let mut gauges = inner.clone();
    for gauge in &mut gauges.gauges {
        gauge.gauge.position = shaken(gauge.gauge.position);
    }
    let both = limb.positions().iter().zip(&moved);
    let positions: Vec<DVec3> = both.map(|(p, u)| *p + *u * args.exaggerate).collect();
    // The same triangles at other places: nothing is measured on them.
    let drawn = TriMesh::from_checked(positions, limb.triangles().to_vec());
    StepScene {
        limb: &drawn,
        field: Some(&field),
        inner: &gauges,
        touch: Some((shaken(touch.position), -touch.normal)),
        grid_mm,
        run: None,
    }
    .glb()
    .map_err(anyhow::Error::msg)
}

/// The surface of the model, how it moves under the touch (m), and the touch on it.
fn pressed(
    args: &ExportArgs,
    loaded: &LoadedProject,
    place: DVec3,
) -> anyhow::Result<(TriMesh, Vec<DVec3>, Touch)> {
    /// What a place may be off the limb (m).
    const BESIDE: f64 = 5e-3;
    let off = Nearness::of(&loaded.inputs.part).distance(place);
    ensure!(
        off <= BESIDE,
        "the place of --touch is {} off the limb",
        plain::length(off)
    );
    let sensing = sensing_for(&args.common, loaded)
        .context("what a touch does is computed with the gauges of a project")?;
    let model = args
        .common
        .in_pool(|| Ok(sensing.model(&loaded.inputs, &unwatched)?))?;
    let mesh = model.mesh();
    let (at, _) = mesh.index().nearest(place);
    let touch = Touch {
        position: mesh.point(at),
        normal: mesh.normal(at),
        force: args.force,
        tip_radius: loaded.inputs.project.touch.tip_radius_mm * 1e-3,
    };
    Ok((
        (**mesh).clone(),
        model.moved(&[touch]).swap_remove(0),
        touch,
    ))
}

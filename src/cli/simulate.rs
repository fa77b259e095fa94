//! `hapdef simulate`: the elastic model only, over the whole part or at given points.

mod off;

use std::path::{Path, PathBuf};

use anyhow::ensure;
use clap::Args;
use serde_json::json;

use super::common::Common;
use super::spared::Spared;
use super::{out, progress::Bar};
use crate::design::{self, DesignError};
use crate::given;
use crate::io::artifacts::save_dataset;
use crate::io::project_file::LoadedProject;
use crate::io::{points, vtu};
use crate::memory;
use crate::units;

#[derive(Args, Debug, Clone)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub common: Common,
    /// Touches to answer for (.csv): `x_mm,y_mm,z_mm,nx,ny,nz,force_n,tip_radius_mm`. The force pushes
    /// along the opposite of the outward normal n.
    #[arg(long, requires = "sites")]
    pub touches: Option<PathBuf>,
    /// Gauges to answer for (.csv): `x_mm,y_mm,z_mm,dx,dy,dz`, with d the direction of the gauge.
    #[arg(long, requires = "touches")]
    pub sites: Option<PathBuf>,
    /// Stop at the first touch or gauge that is off the part, or points out of its surface, instead of leaving it
    /// out.
    #[arg(long, requires = "touches")]
    pub strict: bool,
    /// The dataset (.npz), or the answers at given points (.csv or .npz): touch, site, displacement
    /// (mm) and strain on the inside face, and how far the given points lay from the part (mm).
    #[arg(long)]
    pub out: PathBuf,
    /// Fields for `ParaView` (.vtu): mesh, supports, displacements and strains under the first touches.
    #[arg(long)]
    pub vtu: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &SimulateArgs) -> anyhow::Result<()> {
    let given = args.touches.as_deref().zip(args.sites.as_deref());
    let endings: &[&str] = if given.is_some() {
        &["csv", "npz"]
    } else {
        &["npz"]
    };
    check_output(&args.out, endings)?;
    if let Some(path) = &args.vtu {
        check_output(path, &["vtu"])?;
    }
    let loaded = args.common.load()?;
    let spared = Spared::of(&loaded)
        .and("the table of touches", args.touches.as_deref())
        .and("the table of gauges", args.sites.as_deref());
    spared.check_result("--out", Some(&args.out))?;
    spared.check_result("--vtu", args.vtu.as_deref())?;
    match given {
        Some((touches, sites)) => at_points(args, &loaded, touches, sites),
        None => everywhere(args, &loaded),
    }
}

fn check_output(path: &Path, endings: &[&str]) -> anyhow::Result<()> {
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    ensure!(
        endings.contains(&ending.as_ref()),
        "{}: this is written as .{}",
        path.display(),
        endings.join(" or .")
    );
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        ensure!(
            folder.is_dir(),
            "{}: there is no such folder. Create it first",
            folder.display()
        );
    }
    Ok(())
}

fn everywhere(args: &SimulateArgs, loaded: &LoadedProject) -> anyhow::Result<()> {
    let budget = loaded.inputs.project.budget.budget();
    let (sites, touches, bytes) = design::expected_size(&loaded.inputs, &budget);
    // What cannot be had is refused with its cause; a figure before it would only be in the way.
    if bytes <= memory::allowed() {
        out::say(&format!(
            "about {sites} sites × {touches} touches: {:.2} GB while they are computed",
            units::gigabytes(bytes)
        ));
    }
    let bar = Bar::default();
    let result = args
        .common
        .in_pool(|| Ok(design::simulate(&loaded.inputs, &budget, &|p| bar.show(p))?));
    bar.finish();
    let simulated = result?;
    save_dataset(&args.out, &simulated.dataset)?;
    if let Some(path) = &args.vtu {
        let model = simulated.model()?;
        let touches = &simulated.dataset.touches;
        let first = &touches[..touches.len().min(vtu::TOUCHES)];
        vtu::write(path, model.mesh(), &vtu::fields(&*model, first))?;
    }
    for doubt in simulated.doubts() {
        out::say(&format!("NOT TO BE TRUSTED: {}", doubt.words));
    }
    say(&simulated.achieved.words().cloned().collect::<Vec<_>>());
    let dataset = &simulated.dataset;
    let summary = json!({
        "sites": dataset.sites.len(),
        "touches": dataset.touches.len(),
        "signal": dataset.signal,
        "bytes": size_of_val(dataset.x.values()),
        "vertices": simulated.mesh.positions().len(),
        "unknowns": simulated.unknowns,
        "discretization": simulated.discretization,
        "linearity": simulated.linearity,
        "checks": simulated.checks,
        "repairs": loaded.repairs,
        "achieved": simulated.achieved,
    });
    finish(args, &summary)
}

fn at_points(
    args: &SimulateArgs,
    loaded: &LoadedProject,
    touches_file: &Path,
    sites_file: &Path,
) -> anyhow::Result<()> {
    let placed = |error| in_file(error, touches_file, sites_file);
    let touches = points::read_touches(touches_file)?;
    let sites = points::read_sites(sites_file)?;
    let mut rows = given::sift(&loaded.inputs.part, &touches, &sites);
    if args.strict {
        rows.refuse_any().map_err(placed)?;
    }
    let places = off::RowPlaces::of(touches_file, sites_file);
    places.say_all(&rows);
    let said_before = rows.left_out.len();
    let budget = loaded.inputs.project.budget.budget();
    let bar = Bar::default();
    let result = args.common.in_pool(|| {
        let watch = |p| bar.show(p);
        given::answer_sifted(&loaded.inputs, &touches, &sites, rows, &budget, &watch)
            .map_err(placed)
    });
    bar.finish();
    let mut answer = result?;
    if args.strict {
        answer.rows.refuse_any().map_err(placed)?;
    }
    places.say_later(&answer.rows, said_before);
    points::write_answers(&args.out, &answer)?;
    if let Some(path) = &args.vtu {
        let first = answer.rows.touches.iter().take(vtu::TOUCHES);
        let first: Vec<_> = first.map(|&row| touches[row]).collect();
        let fields = vtu::fields(&*answer.model, &first);
        vtu::write(path, answer.model.mesh(), &fields)?;
    }
    say(&answer.notes);
    if let Some(summary) = off::summary(&answer.rows) {
        out::say(&summary);
    }
    let summary = json!({
        "sites": answer.rows.sites.len(),
        "touches": answer.rows.touches.len(),
        "left_out": places.json(&answer.rows),
        "vertices": answer.model.mesh().positions().len(),
        "unknowns": answer.model.system().dimension(),
        "discretization": answer.discretization,
        "linearity": answer.linearity,
        "checks": answer.checks,
        "repairs": loaded.repairs,
        "notes": answer.notes,
    });
    finish(args, &summary)
}

/// An error of one of the given points, with its file and line before it.
pub(super) fn in_file(error: DesignError, touches: &Path, sites: &Path) -> anyhow::Error {
    let (path, number) = match error {
        DesignError::OffThePart {
            what: "touch",
            number,
            ..
        } => (touches, number),
        DesignError::OffThePart { number, .. } | DesignError::AcrossTheWall { number, .. } => {
            (sites, number)
        }
        _ => return error.into(),
    };
    anyhow::Error::new(error).context(points::place(path, number))
}

fn say(notes: &[String]) {
    for note in notes {
        out::say(&format!("note: {note}"));
    }
}

/// What the summary says of the model's error; of linearity where that was looked at, which solids are not.
fn estimated_error(summary: &serde_json::Value) -> String {
    let number = |path: &str| summary.pointer(path).and_then(serde_json::Value::as_f64);
    let under = number("/discretization/displacement_mm")
        .zip(number("/discretization/displacement_percent"))
        .map(|(mm, percent)| format!("{mm:.2e} mm ({percent:.1} %) under the touch"));
    let strain = number("/discretization/strain_percent").map(|percent| {
        format!("{percent:.1} % of a load's largest strain (beyond two tip radii from it)")
    });
    let parts: Vec<String> = under.into_iter().chain(strain).collect();
    let of_mesh = if parts.is_empty() {
        "not known".to_owned()
    } else {
        parts.join(", ")
    };
    let of_linearity = number("/linearity/largest_percent")
        .map(|percent| format!("; of linearity: up to {:.1} %", percent.abs()))
        .unwrap_or_default();
    format!("estimated error of the mesh: {of_mesh}{of_linearity}")
}

fn finish(args: &SimulateArgs, summary: &serde_json::Value) -> anyhow::Result<()> {
    if args.common.json {
        return out::line(&summary.to_string());
    }
    out::say(&estimated_error(summary));
    for path in std::iter::once(&args.out).chain(&args.vtu) {
        out::say(&format!("wrote {}", path.display()));
    }
    Ok(())
}

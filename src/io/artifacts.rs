//! What a design leaves behind: the table of sites, the dataset, the summary and a project that
//! reproduces it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::npz::NpzFile;
use super::{FileError, atomic, project_file, report};
use crate::dataset::{Dataset, Signal, Site};
use crate::design::{Design, Inputs};
use crate::placement::information::Geometry;
use crate::project::{ChosenSite, Project};

/// Everything that stands beside the numbers: where the project came from and who computed it.
pub struct Provenance<'a> {
    pub mesh_path: &'a Path,
    pub version: &'static str,
}

/// Writes all files of a design into a folder, each atomically; returns their paths.
///
/// # Errors
/// [`FileError`] naming what could not be written.
pub fn write_all(
    folder: &Path,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
) -> Result<Vec<PathBuf>, FileError> {
    std::fs::create_dir_all(folder).map_err(|e| FileError::of(folder, &e))?;
    let at = |name: &str| folder.join(name);
    let project_path = at("design.hapdef.toml");
    atomic::write(&at("sites.csv"), sites_csv(design).as_bytes())?;
    let summary = summary(inputs, design);
    let text = format!("{summary:#}\n");
    atomic::write(&at("design.json"), text.as_bytes())?;
    save_dataset(&at("dataset.npz"), &design.simulated.dataset)?;
    let project = with_result(&inputs.project, design, &project_path, provenance.mesh_path);
    let painted = inputs.painted.as_ref().map(|m| m.as_slice());
    project_file::save(&project_path, &project, painted, &inputs.masks)?;
    let html = report::html(inputs, design, provenance);
    atomic::write(&at("report.html"), html.as_bytes())?;
    Ok([
        "report.html",
        "sites.csv",
        "design.json",
        "dataset.npz",
        "design.hapdef.toml",
    ]
    .map(at)
    .to_vec())
}

/// The project that reproduces the run, with the chosen sites in it.
#[must_use]
pub fn with_result(project: &Project, design: &Design, at: &Path, mesh: &Path) -> Project {
    let mut project = project.clone();
    project.part.mesh = project_file::relative_to(at, mesh);
    project.budget.limits = project.budget.limits_at(design.budget.quality);
    project.budget.quality = design.budget.quality;
    project.selection.sites = as_chosen(&design.simulated.dataset.sites, design.chosen());
    project
}

/// The chosen sites as a project keeps them: to the micrometre and the ten-thousandth.
#[must_use]
pub fn as_chosen(all: &[Site], sites: &[usize]) -> Vec<ChosenSite> {
    let round = |x: f64, unit: f64| (x * unit).round() / unit + 0.0;
    sites
        .iter()
        .map(|&s| {
            let site = &all[s];
            ChosenSite {
                position_mm: (site.position * 1000.0).to_array().map(|x| round(x, 1e3)),
                direction: site.direction.to_array().map(|x| round(x, 1e4)),
            }
        })
        .collect()
}

/// The table of chosen sites; what one command writes another reads.
#[must_use]
pub fn sites_csv(design: &Design) -> String {
    let dataset = &design.simulated.dataset;
    let mut text = String::from(
        "x_mm,y_mm,z_mm,dx,dy,dz,index,gauge,rms_strain_microstrain,peak_strain_microstrain,signal_low,signal_high,signal_unit\n",
    );
    for (k, &s) in design.chosen().iter().enumerate() {
        let site = &dataset.sites[s];
        let p = site.position * 1000.0;
        let d = site.direction;
        let (low, high) = range(dataset, s);
        let _ = writeln!(
            text,
            "{:.4},{:.4},{:.4},{:.6},{:.6},{:.6},{s},{},{:.2},{:.2},{low:.4},{high:.4},{}",
            p.x,
            p.y,
            p.z,
            d.x,
            d.y,
            d.z,
            k + 1,
            site.rms_strain * 1e6,
            site.peak_strain * 1e6,
            signal_unit(dataset.signal)
        );
    }
    text
}

/// The unit a signal is shown in.
#[must_use]
pub fn signal_unit(signal: Signal) -> &'static str {
    match signal {
        Signal::Strain => "microstrain",
        Signal::Displacement | Signal::NormalDisplacement => "mm",
    }
}

/// Smallest and largest signal of a site over the touches, in [`signal_unit`].
#[must_use]
pub fn range(dataset: &Dataset, site: usize) -> (f64, f64) {
    let scale = match dataset.signal {
        Signal::Strain => 1e6,
        Signal::Displacement | Signal::NormalDisplacement => 1e3,
    };
    let row = dataset.x.row(site);
    (
        row.iter().copied().fold(f64::INFINITY, f64::min) * scale,
        row.iter().copied().fold(f64::NEG_INFINITY, f64::max) * scale,
    )
}

/// `X` sites × touches, `p_m` touches × 3, `site_m` sites × 3, `direction`, `signal`, `force_n`.
///
/// # Errors
/// [`FileError`] naming the file.
pub fn save_dataset(path: &Path, dataset: &Dataset) -> Result<(), FileError> {
    let (sites, touches) = (dataset.sites.len(), dataset.touches.len());
    let flat = |points: Vec<glam::DVec3>| -> Vec<f64> {
        points.into_iter().flat_map(|p| p.to_array()).collect()
    };
    let build = || -> std::io::Result<NpzFile> {
        let mut file = NpzFile::default();
        file.add("X", &[sites, touches], dataset.x.values())?;
        file.add(
            "p_m",
            &[touches, 3],
            &flat(dataset.touches.iter().map(|t| t.position).collect()),
        )?;
        file.add(
            "n",
            &[touches, 3],
            &flat(dataset.touches.iter().map(|t| t.normal).collect()),
        )?;
        file.add(
            "site_m",
            &[sites, 3],
            &flat(dataset.sites.iter().map(|s| s.position).collect()),
        )?;
        file.add(
            "direction",
            &[sites, 3],
            &flat(dataset.sites.iter().map(|s| s.direction).collect()),
        )?;
        let forces: Vec<f64> = dataset.touches.iter().map(|t| t.force).collect();
        file.add("force_n", &[touches], &forces)?;
        file.add_text("signal", dataset.signal.name())?;
        Ok(file)
    };
    build().map_err(|e| FileError::of(path, &e))?.save(path)
}

/// What `--json` prints and `design.json` keeps.
#[must_use]
pub fn summary(inputs: &Inputs, design: &Design) -> Value {
    let dataset = &design.simulated.dataset;
    let sites: Vec<Value> = design
        .chosen()
        .iter()
        .map(|&s| {
            let site = &dataset.sites[s];
            let p = site.position * 1000.0;
            json!({
                "index": s,
                "x_mm": p.x, "y_mm": p.y, "z_mm": p.z,
                "direction": site.direction.to_array(),
                "rms_microstrain": site.rms_strain * 1e6,
                "signal_to_noise": signal_to_noise(inputs, site.rms_strain),
            })
        })
        .collect();
    let taken: serde_json::Map<String, Value> = design
        .feasibility
        .taken()
        .into_iter()
        .filter_map(|(filter, n)| {
            Some((
                serde_json::to_value(filter).ok()?.as_str()?.to_owned(),
                n.into(),
            ))
        })
        .collect();
    let seconds: serde_json::Map<String, Value> = design
        .seconds
        .iter()
        .map(|s| (s.stage.to_owned(), s.seconds.into()))
        .collect();
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "quality": design.budget.quality,
        "seed": inputs.project.budget.seed,
        "signal": dataset.signal,
        "sites": sites,
        "counts": {
            "inside_sites": dataset.sites.len(),
            "touches": dataset.touches.len(),
            "feasible": design.reduced.feasible.len(),
            "candidates": design.reduced.sites.len(),
            "test_touches": design.truth.touches.len(),
        },
        "filters_took": taken,
        "unexplained": design.reduced.candidates.unexplained,
        "unexplained_curve": design.reduced.candidates.curve,
        "selections": *design.selections,
        "evaluation": design.evaluation.rows,
        "failures": design.evaluation.failures,
        "gaussian_process": design.reduced.geometry().map(Geometry::summary),
        "doubts": design.doubts(),
        "model": {
            "vertices": design.simulated.mesh.positions().len(),
            "unknowns": design.simulated.unknowns,
            "element_mm": design.simulated.element_mm,
            "truth_element_mm": design.truth.element_mm,
            "checks": design.simulated.checks,
            "discretization": design.simulated.discretization,
            "linearity": design.simulated.linearity,
        },
        "budget": design.budget,
        "seconds": seconds,
        "achieved": {
            "work": design.work(),
            "selection": design.led().map(|s| &s.achieved),
            "notes": design.notes(),
        },
    })
}

/// Rms strain over noise; absent when the project has no noise.
#[must_use]
pub fn signal_to_noise(inputs: &Inputs, rms_strain: f64) -> Option<f64> {
    let noise = inputs.project.gauge.noise_microstrain * 1e-6;
    (noise > 0.0).then(|| rms_strain / noise)
}

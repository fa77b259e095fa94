//! What a design leaves behind: the table of sites, the dataset, the summary and a project that
//! reproduces it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::fingerprint::Fingerprint;
use super::npz::NpzFile;
use super::together::Together;
use super::{FileError, atomic, project_file, report, source};
use crate::dataset::{Dataset, Signal, Site};
use crate::design::{Design, Inputs};
use crate::evaluation::{EstimatorKind, EvaluationRow};
use crate::placement::expected_error::ASSUMES;
use crate::placement::information::Geometry;
use crate::project::{ChosenSite, Project};

/// Everything that stands beside the numbers: where the project came from and who computed it.
pub struct Provenance<'a> {
    pub mesh_path: &'a Path,
    pub version: &'static str,
    /// What was left out, mended and taken over when the mesh was read, in words.
    pub taken_in: Option<String>,
}

/// The project among the files of a design.
const PROJECT: &str = "design.hapdef.toml";

/// Puts all files of a design into a folder, which is made where it is missing, in the place of those of another run:
/// all of them or none. Returns their paths.
///
/// # Errors
/// [`FileError`] naming what could not be written, or that somebody else is writing there.
pub fn write_all(
    folder: &Path,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
) -> Result<Vec<PathBuf>, FileError> {
    std::fs::create_dir_all(folder).map_err(|e| FileError::of(folder, &e))?;
    write_into(&Together::claim(folder)?, inputs, design, provenance)
}

/// As [`write_all`], into a folder that is claimed already.
///
/// # Errors
/// [`FileError`] naming what could not be written.
pub fn write_into(
    place: &Together,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
) -> Result<Vec<PathBuf>, FileError> {
    place.replace(|new| {
        let write = |name: &str, text: &str| atomic::write(&new.join(name), text.as_bytes());
        write("sites.csv", &sites_csv(inputs, design))?;
        write("design.json", &format!("{:#}\n", summary(inputs, design)))?;
        write("report.html", &report::html(inputs, design, provenance))?;
        let run = run_key(inputs, design);
        save_arrays(
            &new.join("dataset.npz"),
            &design.simulated.dataset,
            Some(&run),
        )?;
        write_project(new, place.folder(), inputs, design, provenance)
    })?;
    Ok([
        "report.html",
        "sites.csv",
        "design.json",
        "dataset.npz",
        PROJECT,
    ]
    .map(|name| place.folder().join(name))
    .to_vec())
}

/// Writes the project that reproduces the run into a folder, for another one. What stands there under its name, which
/// somebody may have gone on with, stays as its backup, with its masks.
fn write_project(
    new: &Path,
    place: &Path,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
) -> Result<(), FileError> {
    let (path, target) = (new.join(PROJECT), place.join(PROJECT));
    bring(&target, &path)?;
    bring(
        &project_file::arrays_path(&target),
        &project_file::arrays_path(&path),
    )?;
    let project = with_result(&inputs.project, design, &target, provenance.mesh_path);
    let painted = inputs.painted.as_ref().map(|m| m.as_slice());
    let comment = format!("Of run {}.", run_key(inputs, design));
    project_file::save_under(&path, &comment, &project, painted, &inputs.masks)
}

/// Copies a file, where there is one.
fn bring(from: &Path, to: &Path) -> Result<(), FileError> {
    match source::read(from) {
        Ok(bytes) => atomic::write(to, &bytes),
        Err(FileError::Missing { .. }) => Ok(()),
        Err(error) => Err(error),
    }
}

/// Which run a file belongs to: a key of everything that its figures depend on, the same whenever the same is computed
/// again, on whatever machine.
#[must_use]
pub fn run_key(inputs: &Inputs, design: &Design) -> String {
    let mut project = as_computed(&inputs.project, design);
    // What files are called says nothing of what is in them.
    project.part.mesh.clear();
    project.feasible.painted = None;
    let mut key = Fingerprint::default();
    key.add(env!("CARGO_PKG_VERSION").bytes());
    key.add(serde_json::to_string(&project).unwrap_or_default().bytes());
    key.add_part(inputs);
    key.hex()
}

/// The project that reproduces the run, with the chosen sites in it.
#[must_use]
pub fn with_result(project: &Project, design: &Design, at: &Path, mesh: &Path) -> Project {
    let mut project = as_computed(project, design);
    project.part.mesh = project_file::relative_to(at, mesh);
    project
}

/// The project at the quality of the design, with the sites that it chose.
fn as_computed(project: &Project, design: &Design) -> Project {
    let mut project = project.clone();
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
pub fn sites_csv(inputs: &Inputs, design: &Design) -> String {
    let dataset = &design.simulated.dataset;
    let run = run_key(inputs, design);
    let mut text = String::from(
        "x_mm,y_mm,z_mm,dx,dy,dz,index,gauge,rms_strain_microstrain,peak_strain_microstrain,signal_low,signal_high,signal_unit,run\n",
    );
    for (k, &s) in design.chosen().iter().enumerate() {
        let site = &dataset.sites[s];
        let p = site.position * 1000.0;
        let d = site.direction;
        let (low, high) = range(dataset, s);
        let _ = writeln!(
            text,
            "{:.4},{:.4},{:.4},{:.6},{:.6},{:.6},{s},{},{:.2},{:.2},{low:.4},{high:.4},{},{run}",
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
    save_arrays(path, dataset, None)
}

/// As [`save_dataset`], with the `run` of a design that the file belongs to.
fn save_arrays(path: &Path, dataset: &Dataset, run: Option<&str>) -> Result<(), FileError> {
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
        if let Some(run) = run {
            file.add_text("run", run)?;
        }
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
                "refined": s >= design.simulated.lattice,
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
    let notes = [design.cautions(), design.notes()].concat();
    let seconds: serde_json::Map<String, Value> = design
        .seconds
        .iter()
        .map(|s| (s.stage.to_owned(), s.seconds.into()))
        .collect();
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "run": run_key(inputs, design),
        "by_hand": design.by_hand,
        "quality": design.budget.quality,
        "seed": inputs.project.budget.seed,
        "signal": dataset.signal,
        "sites": sites,
        "counts": {
            "inside_sites": design.simulated.lattice,
            "touches": dataset.touches.len(),
            "feasible": design.reduced.feasible.len(),
            "candidates": design.candidate_count(),
            "test_touches": design.truth.touches.len(),
        },
        "filters_took": taken,
        "unexplained": design.candidates.as_ref().and_then(|c| c.unexplained),
        "unexplained_curve": design.candidates.as_ref().map_or(&[][..], |c| &c.curve),
        "selections": *design.selections,
        "certificate": certificate(design),
        "evaluation": judged_rows(inputs, design),
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
            "notes": notes,
        },
    })
}

/// How far the chosen set is at most from the best one; nothing where its selector cannot say.
fn certificate(design: &Design) -> Option<Value> {
    let set = design.chosen_set()?;
    let (certificate, expected) = (set.certificate?, set.criterion_mm?);
    Some(json!({
        "sensors": set.sites.len(),
        "expected_mm": expected,
        "local_mm": certificate.local_mm,
        "bound_mm": certificate.bound_mm,
        "excess": certificate.excess(expected),
        "words": certificate.words(expected),
        "assumes": ASSUMES,
    }))
}

/// Errors set by set, with the estimator and the force that they are of.
fn judged_rows(inputs: &Inputs, design: &Design) -> Value {
    let evaluation = &design.evaluation;
    if evaluation.judging.estimator() == EstimatorKind::Matching {
        return json!(evaluation.matched);
    }
    let with_force = |row: &EvaluationRow| {
        let mut value = json!(row);
        value["estimator"] = json!(EstimatorKind::Svr);
        value["force_n"] = json!(inputs.project.touch.force_n);
        value["as_built_mm"] = json!(row.workshop_mm);
        // Nothing is calibrated for a regression.
        value["calibrated_mm"] = Value::Null;
        value
    };
    evaluation.rows.iter().map(with_force).collect()
}

/// Rms strain over noise; absent when the project has no noise.
#[must_use]
pub fn signal_to_noise(inputs: &Inputs, rms_strain: f64) -> Option<f64> {
    let noise = inputs.project.gauge.noise_microstrain * 1e-6;
    (noise > 0.0).then(|| rms_strain / noise)
}

//! What a design leaves behind: the table of sites, the dataset, the summary and a project that
//! reproduces it.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::npz::NpzFile;
use super::run::as_computed;
use super::table::Writing;
use super::together::Together;
use super::{FileError, atomic, handover, project_file, report, source};
use crate::dataset::Dataset;
use crate::design::{Design, Inputs};
use crate::evaluation::{EstimatorKind, EvaluationRow};
use crate::paper::SheetSize;
use crate::placement::expected_error::ASSUMES;
use crate::placement::information::Geometry;
use crate::project::Project;

pub use super::run::{Provenance, as_chosen, range, run_key, signal_to_noise, signal_unit};

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
    let place = Together::claim(folder)?;
    write_into(
        &place,
        inputs,
        design,
        provenance,
        Some(SheetSize::default()),
    )
}

/// As [`write_all`], into a folder that is claimed already; what the workshop is given only where there is a format for it.
///
/// # Errors
/// [`FileError`] naming what could not be written.
pub fn write_into(
    place: &Together,
    inputs: &Inputs,
    design: &Design,
    provenance: &Provenance,
    handed_over: Option<SheetSize>,
) -> Result<Vec<PathBuf>, FileError> {
    let mut handed = Vec::new();
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
        if let Some(format) = handed_over {
            let files = handover::files(inputs, design, provenance, format)
                .map_err(|why| FileError::broken(place.folder(), why))?;
            for (name, bytes) in files {
                let path = new.join(&name);
                if let Some(folder) = path.parent() {
                    std::fs::create_dir_all(folder).map_err(|e| FileError::of(folder, &e))?;
                }
                atomic::write(&path, &bytes)?;
                handed.push(name);
            }
        }
        write_project(new, place.folder(), inputs, design, provenance)
    })?;
    let names = [
        "report.html",
        "sites.csv",
        "design.json",
        "dataset.npz",
        PROJECT,
    ];
    let names = names.into_iter().map(String::from).chain(handed);
    let paths: Vec<PathBuf> = names.map(|name| place.folder().join(name)).collect();
    if handed_over.is_some() {
        forget_old_jig(place.folder(), &paths);
    }
    Ok(paths)
}

/// Takes away the pieces of an earlier jig that this one does not have: they would be printed with it.
fn forget_old_jig(place: &Path, written: &[PathBuf]) {
    let folder = place.join(handover::jig::FOLDER);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        return;
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if handover::jig::is_of_a_jig(&name) && !written.contains(&path) {
            let _ = std::fs::remove_file(&path);
        }
    }
    // Where nothing is left in it.
    let _ = std::fs::remove_dir(&folder);
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

/// The project that reproduces the run, with the chosen sites in it.
#[must_use]
pub fn with_result(project: &Project, design: &Design, at: &Path, mesh: &Path) -> Project {
    let mut project = as_computed(project, design);
    project.part.mesh = project_file::relative_to(at, mesh);
    project
}

/// The table of chosen sites; what one command writes another reads.
#[must_use]
pub fn sites_csv(inputs: &Inputs, design: &Design) -> String {
    let dataset = &design.simulated.dataset;
    let run = run_key(inputs, design);
    let mut table = Writing::new([
        "x_mm",
        "y_mm",
        "z_mm",
        "dx",
        "dy",
        "dz",
        "index",
        "gauge",
        "rms_strain_microstrain",
        "peak_strain_microstrain",
        "signal_low",
        "signal_high",
        "signal_unit",
        "run",
    ]);
    for (k, &s) in design.chosen().iter().enumerate() {
        let site = &dataset.sites[s];
        let p = site.gauge.position * 1000.0;
        let d = site.gauge.direction;
        let (low, high) = range(dataset, s);
        table.row([
            format!("{:.4}", p.x),
            format!("{:.4}", p.y),
            format!("{:.4}", p.z),
            format!("{:.6}", d.x),
            format!("{:.6}", d.y),
            format!("{:.6}", d.z),
            s.to_string(),
            (k + 1).to_string(),
            format!("{:.2}", site.rms_strain * 1e6),
            format!("{:.2}", site.peak_strain * 1e6),
            format!("{low:.4}"),
            format!("{high:.4}"),
            signal_unit(dataset.signal).to_owned(),
            run.clone(),
        ]);
    }
    table.text()
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
            &flat(dataset.sites.iter().map(|s| s.gauge.position).collect()),
        )?;
        file.add(
            "direction",
            &[sites, 3],
            &flat(dataset.sites.iter().map(|s| s.gauge.direction).collect()),
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
            let p = site.gauge.position * 1000.0;
            json!({
                "index": s,
                "refined": s >= design.simulated.lattice,
                "x_mm": p.x, "y_mm": p.y, "z_mm": p.z,
                "direction": site.gauge.direction.to_array(),
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
            "test_touches": design.reference.touches.len(),
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
            "truth_element_mm": design.reference.element_mm,
            "checks": design.simulated.checks,
            "discretization": design.simulated.discretization,
            "linearity": design.simulated.linearity,
        },
        "budget": design.budget,
        "seconds": seconds,
        "achieved": {
            "work": design.work(),
            "selection": design.chosen_selection().map(|s| &s.achieved),
            "notes": notes,
        },
    })
}

/// How far the chosen set is at most from the best one; nothing where its selector cannot say.
fn certificate(design: &Design) -> Option<Value> {
    let set = design.chosen_set()?;
    let (certificate, expected) = (set.certificate?, set.promised_mm()?);
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

//! Which run files belong to, and figures that all of them give alike.

use std::path::Path;

use super::fingerprint::Fingerprint;
use crate::dataset::{Dataset, Signal, Site};
use crate::design::{Design, Inputs};
use crate::project::{ChosenSite, Project};

/// Everything that stands beside the numbers: where the project came from and who computed it.
pub struct Provenance<'a> {
    pub mesh_path: &'a Path,
    pub version: &'static str,
    /// What was left out, mended and taken over when the mesh was read, in words.
    pub taken_in: Option<String>,
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

/// The project at the quality of the design, with the sites that it chose.
pub(super) fn as_computed(project: &Project, design: &Design) -> Project {
    let mut project = project.clone();
    project.budget.limits = project.budget.limits_at(design.budget.quality);
    project.budget.quality = design.budget.quality;
    project.selection.sites = as_chosen(&design.simulated.dataset.sites, design.chosen());
    project
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

/// Rms strain over noise; absent when the project has no noise.
#[must_use]
pub fn signal_to_noise(inputs: &Inputs, rms_strain: f64) -> Option<f64> {
    let noise = inputs.project.uncertainty().of_channel();
    (noise > 0.0).then(|| rms_strain / noise)
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
                position_mm: (site.gauge.position * 1000.0)
                    .to_array()
                    .map(|x| round(x, 1e3)),
                direction: site.gauge.direction.to_array().map(|x| round(x, 1e4)),
            }
        })
        .collect()
}

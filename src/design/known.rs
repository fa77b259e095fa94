//! What is known of the signals of a simulation beside their values: noise, gluing, how touches are made, and what its
//! elements leave: all that [`Uncertainty`] describes.
//!
//! A drift that is common to all channels counts as noise of each, of the same variance: that they share it, so that
//! differences between channels are free of it, would take an unknown more in every filter.

use super::{Inputs, SELECTION_NOISE_SEED, Simulated};
use crate::budget::{Budget, Cancelled, Watch};
use crate::dataset::{GluingSlopes, MakingSlopes, Signal};
use crate::placement::expected_error::{Detail, Forces, Knowledge, Scene, Variance, expected};
use crate::project::Project;
use crate::uncertainty::{Making, Uncertainty};

/// A few sites are looked at in more detail than a choice among thousands can.
pub(super) const FINE: Detail = Detail {
    places: 1000,
    presses: 800,
};

/// What a choice by expected error is told of a simulation.
pub(super) struct Known<'a> {
    simulated: &'a Simulated,
    off: Uncertainty,
    /// Force of each touch (N).
    forces: Vec<f64>,
    range: [f64; 2],
    possible: f64,
    seed: u64,
}

impl<'a> Known<'a> {
    /// Gathers it from the project and from what was simulated of it.
    pub fn new(inputs: &Inputs, simulated: &'a Simulated) -> Self {
        let project = &inputs.project;
        Self {
            simulated,
            off: off(project, simulated),
            forces: (simulated.dataset.touches.iter())
                .map(|t| t.force)
                .collect(),
            range: project.touch.forces_n,
            possible: project.live.largest_force_n.max(project.touch.forces_n[1]),
            seed: project.budget.seed.wrapping_add(SELECTION_NOISE_SEED),
        }
    }

    /// What gluing, the way touches are made and elements put on the signal of a site (as numbered in the dataset) under a touch.
    pub fn variance(&self, site: usize, touch: usize) -> f64 {
        let reading = self.simulated.dataset.x.row(site)[touch];
        let dataset = &self.simulated.dataset;
        let changes = dataset.slopes.as_ref().zip(dataset.making.as_ref());
        self.variance_of(reading, changes, site, touch)
    }

    /// What they put on a gauge's reading of a touch where it is known what that changes by: of a site among some.
    pub fn variance_of(
        &self,
        reading: f64,
        changes: Option<(&GluingSlopes, &MakingSlopes)>,
        site: usize,
        touch: usize,
    ) -> f64 {
        let elements = (self.off.elements * reading).powi(2);
        let Some((glued, made)) = changes else {
            return elements;
        };
        let Ok(column) = glued.touches().binary_search(&touch) else {
            return elements;
        };
        let glued = glued.variance(site, column, reading, &self.off.gluing);
        glued + made.variance(site, column, &self.off.making) + elements
    }

    /// For a pool with this variance of its rows.
    pub fn knowledge<'b>(&'b self, variance: Variance<'b>) -> Knowledge<'b> {
        Knowledge {
            // All channels drift together, which a filter of three unknowns cannot hold: as if each did for itself.
            noise: self.off.of_channel_and_drift(),
            variance: Some(variance),
            among: (self.simulated.dataset.slopes.as_ref()).map(GluingSlopes::touches),
            forces: Some(Forces {
                touches: &self.forces,
                coming: self.range,
                possible: self.possible,
            }),
            seed: self.seed,
        }
    }
}

/// Everything that is known to be off with a simulation's signals: of strain what the project says and the elements are
/// estimated to leave, of displacements nothing but the gluing.
pub(super) fn off(project: &Project, simulated: &Simulated) -> Uncertainty {
    let off = project.uncertainty();
    match simulated.dataset.signal {
        Signal::Strain => off.with_elements(simulated.discretization.strain_percent),
        Signal::Displacement | Signal::NormalDisplacement => Uncertainty {
            noise: 0.0,
            drift: 0.0,
            making: Making::EXACT,
            allowed: 0.0,
            elements: 0.0,
            ..off
        },
    }
}

/// How much a choice by expected error looks at.
pub(super) fn detail(budget: &Budget) -> Detail {
    Detail {
        places: budget.expected_places,
        presses: budget.expected_presses,
    }
}

/// The error (mm) that matching is expected to make with each of some sets of sites (as numbered in the dataset), over
/// where touches come, how hard they are and what is off.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn expected_errors(
    inputs: &Inputs,
    simulated: &Simulated,
    sets: &[Vec<usize>],
    watch: Watch,
) -> Result<Vec<f64>, Cancelled> {
    let known = Known::new(inputs, simulated);
    let mut sites: Vec<usize> = sets.concat();
    sites.sort_unstable();
    sites.dedup();
    let variance = |row: usize, touch: usize| known.variance(sites[row], touch);
    let scene = Scene::new(
        &simulated.dataset.x.select_rows(&sites),
        &simulated.dataset.targets_mm(),
        &known.knowledge(&variance),
        FINE,
        watch,
    )?;
    let rows = |set: &Vec<usize>| -> Vec<usize> {
        set.iter()
            .filter_map(|s| sites.binary_search(s).ok())
            .collect()
    };
    Ok(sets
        .iter()
        .map(|set| expected(&scene, &rows(set)).0)
        .collect())
}

//! The judge's model, and what gauges read on it.

use super::presses::PressReadings;
use super::{Inputs, NOISE_SEED};
use crate::budget::Work;
use crate::dataset::{SignalMatrix, Site};
use crate::elasticity::load::Touch;
use crate::evaluation::{self, EstimatorKind, NamedRegion};
use crate::gauge::Gauge;
use crate::project::{Project, boxes};
use crate::uncertainty::Uncertainty;

/// The judge: a model of finer elements, with touches of its own.
#[derive(Clone)]
pub struct Reference {
    /// The held-out touches.
    pub touches: Vec<Touch>,
    /// Regions that errors are quoted for.
    pub regions: Vec<NamedRegion>,
    /// Element size of the reference model (mm).
    pub element_mm: f64,
    /// What it took.
    pub work: Work,
    /// Dataset sites that were measured, rising, and their signals.
    pub sites: Vec<usize>,
    /// Where they are: gauges off the lattice may have moved under the same number.
    pub drawn: Vec<Gauge>,
    /// Signals of these sites (sites × touches).
    pub x: SignalMatrix,
    /// The same sites as workshops would build them, which take turns from touch to touch.
    pub workshop: SignalMatrix,
    /// How far off they are built, and all else that was known to be off when they were measured.
    pub off: Uncertainty,
    /// Length and width of the grids (m) that gauges read over; absent where they read at a point, as regressions
    /// learn from.
    pub grid: Option<[f64; 2]>,
    /// Known presses on the gauges of each workshop, where an estimator learns from them.
    pub pressed: Option<PressReadings>,
}

/// Length and width of the grids (m) that a project's gauges are judged with: those that live touch reads them over, and
/// none where a regression has learned from points.
pub(super) fn grid(project: &Project) -> Option<[f64; 2]> {
    let matching = project.judging().estimator() == EstimatorKind::Matching;
    matching.then_some(project.gauge.grid())
}

pub(super) fn regions(project: &Project, touches: &[Touch]) -> Vec<NamedRegion> {
    project
        .evaluation
        .regions
        .iter()
        .map(|region| {
            let place = boxes::oriented(&region.box_mm, region.box_axis);
            let inside = |t: &Touch| boxes::contains(&place, t.position);
            NamedRegion {
                name: region.name.clone(),
                contains: touches.iter().map(inside).collect(),
            }
        })
        .collect()
}

/// Signals with the noise that the evaluation draws: `draw` tells training (1), test (2) and workshop (3) apart.
pub(super) fn noisy<'a>(
    inputs: &Inputs,
    x: &'a SignalMatrix,
    draw: u64,
    streams: &[u64],
) -> std::borrow::Cow<'a, SignalMatrix> {
    noisy_means(inputs, x, 1.0, draw, streams)
}

/// As [`noisy`], where every signal is the mean of so many samples.
pub(super) fn noisy_means<'a>(
    inputs: &Inputs,
    x: &'a SignalMatrix,
    samples: f64,
    draw: u64,
    streams: &[u64],
) -> std::borrow::Cow<'a, SignalMatrix> {
    let noise = inputs.project.uncertainty().of_channel() / samples.sqrt();
    let seed = inputs.project.budget.seed.wrapping_add(NOISE_SEED);
    evaluation::add_noise_by(x, noise, seed.wrapping_add(draw), &|row| streams[row])
}

impl Reference {
    /// Whether it measures exactly these of all sites, in any order, built and pressed as far off as that, and what this
    /// estimator asks for beside.
    #[must_use]
    pub fn measures(
        &self,
        sites: &[usize],
        all: &[Site],
        off: &Uncertainty,
        project: &Project,
    ) -> bool {
        let mut rows = sites.to_vec();
        rows.sort_unstable();
        rows.dedup();
        let here = rows.iter().filter_map(|&s| Some(&all.get(s)?.gauge));
        let by = project.judging().estimator();
        let presses = by == EstimatorKind::Svr || self.pressed.is_some();
        let same = off.builds_as(&self.off) && grid(project) == self.grid;
        rows == self.sites && here.eq(&self.drawn) && same && presses
    }

    /// The same, judged in the regions that a project asks for.
    #[must_use]
    pub fn in_regions_of(&self, project: &Project) -> Self {
        Self {
            regions: regions(project, &self.touches),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::uncertainty::Gluing;

    fn site() -> Site {
        Site {
            gauge: Gauge {
                position: DVec3::new(0.01, 0.02, 0.03),
                direction: DVec3::X,
                normal: DVec3::Z,
            },
            rms_strain: 0.0,
            peak_strain: 0.0,
        }
    }

    #[test]
    fn what_another_workshop_built_was_not_measured() {
        let reference = Reference {
            touches: Vec::new(),
            regions: Vec::new(),
            element_mm: 1.0,
            work: Work::default(),
            sites: vec![2, 5],
            drawn: vec![site().gauge; 2],
            x: SignalMatrix::default(),
            workshop: SignalMatrix::default(),
            off: Uncertainty::default(),
            grid: None,
            pressed: None,
        };
        let usual = Uncertainty::default();
        let other = Uncertainty {
            gluing: Gluing::EXACT,
            ..usual
        };
        let mut project = Project::around("limb.stl", None);
        project.evaluation.estimator = EstimatorKind::Svr;
        let mut all = vec![site(); 6];
        assert!(reference.measures(&[5, 2, 5], &all, &usual, &project));
        assert!(!reference.measures(&[5, 3], &all, &usual, &project));
        assert!(!reference.measures(&[5, 2], &all, &other, &project));
        project.evaluation.estimator = EstimatorKind::Matching;
        let matched = Reference {
            grid: grid(&project),
            pressed: Some(PressReadings {
                presses: Vec::new(),
                x: SignalMatrix::default(),
            }),
            ..reference.clone()
        };
        assert!(!reference.measures(&[5, 2], &all, &usual, &project));
        assert!(matched.measures(&[5, 2], &all, &usual, &project));
        // A gauge off the lattice may lie elsewhere now.
        all[5].gauge.position.x += 1e-4;
        assert!(!matched.measures(&[5, 2], &all, &usual, &project));
        all[5] = site();
        project.gauge.grid_length_mm += 1.0;
        assert!(!matched.measures(&[5, 2], &all, &usual, &project));
    }
}

//! Which sites gauges may have, and which they get.

use glam::DVec3;

use super::known::{KnownSimulation, detail};
use super::reduce::{Located, ReducedSites, noisy_signals};
use super::{DesignError, Inputs, Simulated};
use crate::budget::{Budget, Watch};
use crate::dataset::{SignalMatrix, Site};
use crate::placement::constraints::Thorough;
use crate::placement::entropy::Entropy;
use crate::placement::expected_error::{self, ExpectedError};
use crate::placement::greedy_svr::{self, GreedySvr};
use crate::placement::information::Geometry;
use crate::placement::mutual_information::MutualInformation;
use crate::placement::{
    Constraints, PlacementError, Pool, Selection, SelectionRequest, Selector, SelectorKind,
    SensorSet, margin, pca_qr,
};
use crate::project::ElementKind;
use crate::regression::Grouping;
use crate::regression::folds::evenly;
use crate::regression::tune::Effort;

/// Sites that a selector may choose from, with what the project asks of the choice.
struct OfferedSites<'a> {
    /// As numbered in the dataset.
    sites: &'a [usize],
    positions: Vec<DVec3>,
    constraints: Constraints,
}

impl<'a> OfferedSites<'a> {
    fn new(
        inputs: &Inputs,
        simulated: &Simulated,
        sites: &'a [usize],
    ) -> Result<Self, DesignError> {
        let positions: Vec<DVec3> = (sites.iter())
            .map(|&s| simulated.dataset.sites[s].gauge.position)
            .collect();
        let keys = &inputs.project.selection;
        let near = |at: DVec3| nearest(&positions, at).ok_or(PlacementError::NoSites);
        let required: Result<Vec<usize>, PlacementError> = keys.required().map(near).collect();
        let constraints = Constraints {
            sensors: keys.sensors,
            required: required?,
            spacing: keys.spacing(),
            costs: (!keys.costs.is_empty()).then(|| keys.costs_at(&positions)),
            budget: keys.cost_budget,
            target_mm: keys.target_mm,
            failure: keys.failure,
            loss: keys.loss(),
            thorough: Thorough {
                exchange: keys.exchange,
                starts: keys.starts,
            },
        };
        Ok(Self {
            sites,
            positions,
            constraints,
        })
    }

    /// What is chosen for signals of these sites under touches at some places (mm).
    fn choose(
        &self,
        x: &SignalMatrix,
        targets: &[[f64; 3]],
        (watch, found): Telling,
        selector: impl FnOnce(&Pool, &SelectionRequest) -> Result<Selection, PlacementError>,
    ) -> Result<Selection, PlacementError> {
        let pool = Pool {
            x,
            targets,
            sites: self.sites,
            positions: &self.positions,
        };
        let request = SelectionRequest {
            constraints: &self.constraints,
            watch,
            found,
        };
        selector(&pool, &request)
    }
}

/// Which of some positions (m) is nearest to a place (m).
fn nearest(positions: &[DVec3], at: DVec3) -> Option<usize> {
    (0..positions.len()).min_by(|&a, &b| {
        (positions[a].distance_squared(at)).total_cmp(&positions[b].distance_squared(at))
    })
}

/// Called with every set as soon as it is found, with the sites it counts in.
pub type OnFound<'a> = &'a (dyn Fn(SelectorKind, &SensorSet, &[Site]) + Sync);

/// What gauges are chosen from, and for: the same for every selector.
#[derive(Clone, Copy)]
pub struct Choosing<'a> {
    /// What the user asks for.
    pub inputs: &'a Inputs,
    /// What the model says of every site.
    pub simulated: &'a Simulated,
    /// The feasible ones of these.
    pub reduced: &'a ReducedSites,
    /// What may be spent.
    pub budget: &'a Budget,
    /// Who is asked whether to go on.
    pub watch: Watch<'a>,
}

/// What elements leave open of any criterion, as a share: a pick that leads by less than twice this may be another
/// on other elements, and elements that are laid anew for a part may differ wherever the part differs at all. Zero
/// for the part's own triangles, which stay as they are.
#[must_use]
pub fn model_tolerance(inputs: &Inputs, simulated: &Simulated) -> f64 {
    if inputs.project.part.elements == ElementKind::AsGiven {
        return 0.0;
    }
    let percent = simulated.discretization.strain_percent;
    if percent.is_nan() {
        simulated.discretization.displacement_percent / 100.0
    } else {
        percent / 100.0
    }
}

/// Who is asked whether to go on, and told of each set.
type Telling<'a> = (Watch<'a>, &'a (dyn Fn(&SensorSet) + Sync));

/// A selector that asks a Gaussian process over the sites.
type ByGeometry<'a> =
    &'a dyn Fn(&Geometry, &Pool, &SelectionRequest) -> Result<Selection, PlacementError>;

impl Choosing<'_> {
    /// Runs one selector.
    ///
    /// # Errors
    /// [`DesignError`] where the pool does not allow it.
    pub fn select(&self, kind: SelectorKind) -> Result<Selection, DesignError> {
        self.select_step_by_step(kind, &|_, _, _| ())
    }

    /// As [`Self::select`], telling of every step.
    ///
    /// # Errors
    /// As [`Self::select`].
    pub fn select_step_by_step(
        &self,
        kind: SelectorKind,
        found: OnFound,
    ) -> Result<Selection, DesignError> {
        let sites = &self.simulated.dataset.sites;
        let found = |set: &SensorSet| found(kind, set, sites);
        let mut selection = self.choose(kind, (self.watch, &found))?;
        // Expected error is judged on a sample of presses, whose scatter counts beside what elements leave open: which of
        // its picks are firm is not known.
        if kind != SelectorKind::ExpectedError {
            let tolerance = model_tolerance(self.inputs, self.simulated);
            let firm = margin::within_model(&selection.sets, tolerance);
            selection.achieved.notes.extend(firm);
        }
        Ok(selection)
    }

    fn choose(&self, kind: SelectorKind, telling: Telling) -> Result<Selection, DesignError> {
        match kind {
            SelectorKind::ExpectedError => self.by_expected_error(telling),
            SelectorKind::GreedySvr => self.by_svr(telling),
            SelectorKind::PcaQr => self.by_pivots(telling),
            SelectorKind::Entropy => {
                let by: ByGeometry =
                    &|geometry, pool, request| Entropy { geometry }.select(pool, request);
                self.by_geometry(by, telling)
            }
            SelectorKind::MutualInformation => {
                let by: ByGeometry =
                    &|geometry, pool, request| MutualInformation { geometry }.select(pool, request);
                self.by_geometry(by, telling)
            }
        }
    }

    fn offer<'s>(&self, sites: &'s [usize]) -> Result<OfferedSites<'s>, DesignError> {
        OfferedSites::new(self.inputs, self.simulated, sites)
    }

    fn by_pivots(&self, telling: Telling) -> Result<Selection, DesignError> {
        let offer = self.offer(&self.reduced.feasible)?;
        let x = noisy_signals(self.inputs, self.reduced);
        let with_noise = self.inputs.project.selection.with_noise;
        let targets = self.simulated.dataset.targets_mm();
        let selection = offer.choose(&x, &targets, telling, |pool, request| {
            if with_noise {
                pca_qr::PcaQr.select(pool, request)
            } else {
                pca_qr::from_components(self.reduced.components(telling.0)?, pool, request)
            }
        })?;
        Ok(selection)
    }

    fn by_geometry(&self, by: ByGeometry, telling: Telling) -> Result<Selection, DesignError> {
        let located = self
            .reduced
            .locate(self.inputs, self.simulated, self.budget, telling.0)?;
        let Located { geometry, rows, .. } = located;
        let known: Vec<usize> = rows.iter().map(|&r| self.reduced.feasible[r]).collect();
        let offer = self.offer(&known)?;
        let x = self.reduced.x.select_rows(rows);
        let targets = self.simulated.dataset.targets_mm();
        let mut selection = offer.choose(&x, &targets, telling, |pool, request| {
            by(geometry, pool, request)
        })?;
        if known.len() < self.reduced.feasible.len() {
            selection.achieved.notes.push(format!(
                "Chosen from {} of {} feasible sites, evenly taken.",
                known.len(),
                self.reduced.feasible.len()
            ));
        }
        Ok(selection)
    }

    fn by_expected_error(&self, telling: Telling) -> Result<Selection, DesignError> {
        let known = KnownSimulation::new(self.inputs, self.simulated);
        let variance = |row: usize, touch: usize| known.variance(self.reduced.feasible[row], touch);
        let felt = |row: usize, touch: usize| known.felt(self.reduced.feasible[row], touch);
        let shared = known.shared(&felt);
        let selector = ExpectedError {
            known: known.knowledge(&variance, &shared),
            detail: detail(self.budget),
            rounds: expected_error::ROUNDS,
        };
        let offer = self.offer(&self.reduced.feasible)?;
        let targets = self.simulated.dataset.targets_mm();
        let selection = offer.choose(&self.reduced.x, &targets, telling, |pool, request| {
            selector.select(pool, request)
        })?;
        Ok(selection)
    }

    /// The feasible sites nearest to the places where gauges must be: rows of the reduced signals.
    fn required_rows(&self) -> Vec<usize> {
        let positions: Vec<DVec3> = (self.reduced.feasible.iter())
            .map(|&s| self.simulated.dataset.sites[s].gauge.position)
            .collect();
        let required = self.inputs.project.selection.required();
        required.filter_map(|at| nearest(&positions, at)).collect()
    }

    fn by_svr(&self, telling: Telling) -> Result<Selection, DesignError> {
        let all = self.simulated.dataset.targets_mm();
        let sensors = self.inputs.project.selection.sensors;
        let limit = self.budget.selection_candidates.max(sensors);
        let candidates = self.reduced.candidates(telling.0)?;
        let mut rows = if candidates.rows.len() > limit {
            self.reduced.components(telling.0)?.pivots(limit)
        } else {
            candidates.rows.clone()
        };
        // A place that must have a gauge is a candidate whether or not the reduction kept it.
        for row in self.required_rows() {
            if !rows.contains(&row) {
                rows.push(row);
            }
        }
        let sites: Vec<usize> = rows.iter().map(|&r| self.reduced.feasible[r]).collect();
        let touches = evenly(all.len(), self.budget.selection_touches);
        let noisy_signals = noisy_signals(self.inputs, self.reduced);
        let x = noisy_signals.select_rows(&rows).select_columns(&touches);
        let targets: Vec<[f64; 3]> = touches.iter().map(|&t| all[t]).collect();
        let selector = GreedySvr {
            hyper: self.inputs.project.hyper(),
            folds: self.budget.folds,
            seed: self.inputs.project.budget.seed,
            // Computed touches lie apart.
            grouping: Grouping::Touch,
            effort: Effort {
                tolerance: self.budget.svr_tolerance_mm,
                max_steps: self.budget.svr_steps,
            },
            tolerance: greedy_svr::TOLERANCE,
            landmarks: 1.0,
        };
        let offer = self.offer(&sites)?;
        let mut selection = offer.choose(&x, &targets, telling, |pool, request| {
            selector.select(pool, request)
        })?;
        if touches.len() < all.len() || sites.len() < candidates.rows.len() {
            selection.achieved.notes.push(format!(
                "Scored on {} of {} touches and {} of {} candidates.",
                touches.len(),
                all.len(),
                sites.len(),
                candidates.rows.len()
            ));
        }
        Ok(selection)
    }
}

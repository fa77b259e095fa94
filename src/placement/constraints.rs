//! What is asked of a choice beside its number of gauges, the same for every selector.

use serde::{Deserialize, Serialize};

use super::{PlacementError, Pool, SensorSet};
use crate::pca::PcaError;
use crate::plain;
use crate::regression::Standardizer;
use crate::units;

/// What is asked of a choice; the default asks for nothing but the count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constraints {
    /// Most gauges.
    pub sensors: usize,
    /// Places in the pool that must be chosen, before all others: what is glued already.
    pub required: Vec<usize>,
    /// Least distance between two gauges (m), as the crow flies. Several gauges at the very same
    /// position (directions of a rosette) count as one.
    pub spacing: f64,
    /// Cost of each place in the pool; all the same when absent.
    pub costs: Option<Vec<f64>>,
    /// What all gauges together may cost.
    pub budget: Option<f64>,
    /// Error (mm) at which no more gauges are added: the selector's own where it has one in mm, else the
    /// cross-validated one that is computed of its sets.
    pub target_mm: Option<f64>,
    /// Probability that gauges are lost when they are needed, as `loss` says.
    pub failure: f64,
    /// Which gauges are lost, where any are.
    pub loss: Loss,
    /// What is done beyond gauge after gauge.
    pub thorough: Thorough,
}

/// Which gauges are lost where any are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    /// How many together, any of them.
    pub gauges: usize,
    /// What counts of all such losses.
    pub by: LostBy,
}

impl Default for Loss {
    /// Any one.
    fn default() -> Self {
        Self {
            gauges: 1,
            by: LostBy::Expected,
        }
    }
}

/// What counts of all the gauges that may be lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LostBy {
    /// The mean: each is as likely to be lost as any other.
    #[default]
    Expected,
    /// Those whose loss is the worst.
    Worst,
}

impl LostBy {
    /// All, the default first.
    pub const ALL: [Self; 2] = [Self::Expected, Self::Worst];

    /// As in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Expected => "expected",
            Self::Worst => "worst",
        }
    }

    /// As read by people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Expected => "The mean of all",
            Self::Worst => "The worst",
        }
    }
}

/// How far a choice goes beyond gauge after gauge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thorough {
    /// Whether gauges are exchanged after all are chosen. Expected error does that in any case.
    pub exchange: bool,
    /// From how many first gauges a set is begun; the best is kept.
    pub starts: usize,
}

impl Default for Thorough {
    /// As the paper's selectors.
    fn default() -> Self {
        Self {
            exchange: false,
            starts: 1,
        }
    }
}

impl Thorough {
    /// Whether more is asked for than gauge after gauge.
    #[must_use]
    pub fn is_asked(self) -> bool {
        self.exchange || self.starts > 1
    }
}

impl Constraints {
    /// So many gauges, and nothing else.
    #[must_use]
    pub fn count(sensors: usize) -> Self {
        Self {
            sensors,
            ..Self::default()
        }
    }

    /// A criterion as it counts where gauges may be lost: with all of them, and after each of the losses that are
    /// possible.
    #[must_use]
    pub fn weighed(&self, whole: f64, lost: impl Iterator<Item = f64>) -> f64 {
        if self.failure <= 0.0 {
            return whole;
        }
        let lost: Vec<f64> = lost.collect();
        if lost.is_empty() {
            return whole;
        }
        let counts = match self.loss.by {
            LostBy::Expected => lost.iter().sum::<f64>() / lost.len() as f64,
            LostBy::Worst => lost.into_iter().fold(f64::NEG_INFINITY, f64::max),
        };
        (1.0 - self.failure) * whole + self.failure * counts
    }
}

/// Whether sets have come to the error (mm) that was asked for, with all gauges that must be there.
#[must_use]
pub fn reached(sets: &[SensorSet], constraints: &Constraints) -> bool {
    let error = sets.last().and_then(|s| s.criterion_mm);
    matches!((error, constraints.target_mm), (Some(error), Some(target)) if error <= target)
        && sets.len() >= constraints.required.len()
}

/// A note on a choice that ended short of what was wanted, with what [`PartialSet::closed`] says.
#[must_use]
pub fn shortage(why: &str, reached: usize, wanted: usize) -> String {
    format!(
        "Only {reached} of {} fit: {why}.",
        plain::count(wanted, "gauge")
    )
}

/// What is to be said where the error that was asked for is not reached.
#[must_use]
pub fn unreached(sets: &[SensorSet], constraints: &Constraints) -> Option<String> {
    let error = sets.last().and_then(|s| s.criterion)?;
    let target = constraints.target_mm.filter(|t| error > *t)?;
    Some(format!(
        "The error asked for, {target} mm, was not reached: {error:.2} mm with {}.",
        plain::count(sets.len(), "gauge")
    ))
}

/// Which places may still be chosen, as the choice grows: none whose signal never changes.
#[derive(Clone)]
pub struct PartialSet<'a> {
    pool: &'a Pool<'a>,
    constraints: &'a Constraints,
    /// In the order they were chosen.
    pub chosen: Vec<usize>,
    open: Vec<bool>,
    /// Places whose signal is the same under every touch: chosen only where they must be.
    constant: Vec<bool>,
    spent: f64,
    /// What no gauge may cost more than.
    dearest: f64,
    /// The gauge to be chosen after those that must be there, whatever it adds.
    first: Option<usize>,
}

impl<'a> PartialSet<'a> {
    /// Nothing chosen yet.
    ///
    /// # Errors
    /// [`PlacementError`] for constraints that cannot be met.
    pub fn new(pool: &'a Pool<'a>, constraints: &'a Constraints) -> Result<Self, PlacementError> {
        let available = pool.sites.len();
        if available == 0 {
            return Err(PlacementError::NoSites);
        }
        let wanted = constraints.sensors.max(constraints.required.len());
        if wanted > available {
            return Err(PlacementError::TooFewSites { wanted, available });
        }
        let mut constant = vec![false; available];
        for place in Standardizer::of(pool.x).constant_rows() {
            if let Some(constant) = constant.get_mut(place) {
                *constant = true;
            }
        }
        if !constant.contains(&false) {
            return Err(PcaError::Constant.into());
        }
        let mut field = Self {
            pool,
            constraints,
            chosen: Vec::new(),
            open: vec![true; available],
            constant,
            spent: 0.0,
            dearest: f64::INFINITY,
            first: None,
        };
        field.check()?;
        field.chosen.clear();
        field.open = field.constant.iter().map(|constant| !constant).collect();
        field.spent = 0.0;
        Ok(field)
    }

    fn check(&mut self) -> Result<(), PlacementError> {
        let constraints = self.constraints;
        let bad = |what: &'static str| Err(PlacementError::Constraint { what });
        if constraints.sensors < constraints.required.len() {
            return bad(
                "more gauges must be there than are to be placed in all: raise their number",
            );
        }
        if constraints.costs.as_ref().is_some_and(|c| {
            c.len() != self.open.len() || c.iter().any(|c| !c.is_finite() || *c <= 0.0)
        }) {
            return bad("every site's cost must be a number above zero");
        }
        if !(0.0..=1.0).contains(&constraints.failure) {
            return bad("the probability of a failure must lie between 0 and 1");
        }
        if constraints.failure > 0.0 && constraints.loss.gauges == 0 {
            return bad("a failure must take one gauge at least");
        }
        if self.pool.positions.is_empty() && constraints.spacing > 0.0 {
            return bad("a spacing needs the positions of the sites (site_m)");
        }
        for &place in &constraints.required {
            if place >= self.open.len() {
                return bad("a gauge that must be there is not among the sites");
            }
            if !self.open[place] {
                return bad(
                    "two gauges that must be there are the same or nearer than the spacing: lower it or drop one",
                );
            }
            if !self.affordable(place) {
                return bad("the gauges that must be there cost more than the budget");
            }
            self.add(place);
        }
        Ok(())
    }

    /// Whether enough was chosen.
    #[must_use]
    pub fn full(&self) -> bool {
        self.chosen.len() >= self.constraints.sensors
    }

    /// What may be chosen; the next that must be, alone, while there is one.
    #[must_use]
    pub fn open(&self) -> Vec<usize> {
        if let Some(&next) = self.constraints.required.get(self.chosen.len()) {
            return vec![next];
        }
        let mut allowed = self.allowed();
        if let Some(first) = self.first
            && self.chosen.len() == self.constraints.required.len()
        {
            allowed.retain(|&place| place == first);
        }
        allowed
    }

    /// The same, with a place that is chosen after those that must be there, whatever it adds.
    #[must_use]
    pub(super) fn led_by(self, first: usize) -> Self {
        Self {
            first: Some(first),
            ..self
        }
    }

    /// How many gauges must be there.
    #[must_use]
    pub(super) fn required(&self) -> usize {
        self.constraints.required.len()
    }

    /// Of a field with nothing chosen: with the gauges that must be there.
    #[must_use]
    pub(super) fn with_required(&self) -> Self {
        let mut field = self.clone();
        for &place in &self.constraints.required {
            field.add(place);
        }
        field
    }

    /// Of a field with nothing chosen: with a set but for the gauge of a number, in whose stead none may come that
    /// is dearer. What a gain may cost was weighed when that one was chosen.
    #[must_use]
    pub(super) fn without(&self, set: &[usize], number: usize) -> Self {
        let mut field = self.clone();
        for (_, &place) in set.iter().enumerate().filter(|(k, _)| *k != number) {
            field.add(place);
        }
        field.dearest = self.cost(set[number]);
        field
    }

    /// What may be chosen, were there nothing that must be.
    #[must_use]
    pub fn allowed(&self) -> Vec<usize> {
        (0..self.open.len())
            .filter(|&p| self.open[p] && self.affordable(p))
            .collect()
    }

    /// Whether this place is the next that must be chosen.
    #[must_use]
    pub fn is_required(&self, place: usize) -> bool {
        self.constraints.required.get(self.chosen.len()) == Some(&place)
    }

    fn affordable(&self, place: usize) -> bool {
        /// Sums of costs round.
        const ROUNDING: f64 = 1e-12;
        let budget = self.constraints.budget.unwrap_or(f64::INFINITY);
        let cost = self.cost(place);
        cost <= self.dearest && self.spent + cost <= budget * (1.0 + ROUNDING)
    }

    /// Cost of a place in the pool.
    #[must_use]
    pub fn cost(&self, place: usize) -> f64 {
        self.constraints.costs.as_ref().map_or(1.0, |c| c[place])
    }

    /// A gain as it counts: by what it costs.
    #[must_use]
    pub fn worth(&self, place: usize, gain: f64) -> f64 {
        let cost = self.cost(place);
        if gain >= 0.0 {
            gain / cost
        } else {
            gain * cost
        }
    }

    /// Takes a place, and closes those too near to it.
    pub fn add(&mut self, place: usize) {
        self.spent += self.cost(place);
        self.chosen.push(place);
        self.open[place] = false;
        if self.constraints.spacing > 0.0 {
            let here = self.pool.positions[place];
            for (open, p) in self.open.iter_mut().zip(self.pool.positions) {
                let apart = p.distance(here);
                *open &= apart >= self.constraints.spacing || apart == 0.0;
            }
        }
    }

    /// Why nothing more may be chosen, and what to change; absent while something may.
    #[must_use]
    pub fn closed(&self) -> Option<String> {
        if self.full() || !self.open().is_empty() {
            return None;
        }
        let (mut constant, mut near, mut costly) = (0, 0, 0);
        for place in (0..self.open.len()).filter(|p| !self.chosen.contains(p)) {
            if self.constant[place] {
                constant += 1;
            } else if self.open[place] {
                costly += 1;
            } else {
                near += 1;
            }
        }
        // Without what rounds in metres.
        let spacing = units::to_thousandths(units::mm(self.constraints.spacing));
        let reasons = [
            (near, format!("nearer than {spacing} mm to a gauge")),
            (costly, "dearer than what is left of the budget".to_owned()),
            (constant, "the same under every touch".to_owned()),
        ];
        let reasons: Vec<String> = (reasons.into_iter().filter(|(sites, _)| *sites > 0))
            .map(|(sites, why)| format!("{sites} {why}"))
            .collect();
        let ways = [
            (near, "lower the spacing"),
            (costly, "raise the budget"),
            (1, "ask for fewer gauges"),
        ];
        let ways: Vec<&str> = (ways.iter().filter(|(sites, _)| *sites > 0))
            .map(|(_, way)| *way)
            .collect();
        Some(format!(
            "the sites left are {}; {}",
            reasons.join(", "),
            ways.join(" or ")
        ))
    }

    /// What is to be said of sites whose signal never changes.
    #[must_use]
    pub fn constant_notes(&self) -> Vec<String> {
        let required = |place: &usize| self.constraints.required.contains(place);
        let (kept, left_out): (Vec<usize>, Vec<usize>) = (0..self.constant.len())
            .filter(|&place| self.constant[place])
            .partition(required);
        let mut notes = Vec::new();
        if !left_out.is_empty() {
            notes.push(format!(
                "Left out: {} with the same report under every touch.",
                plain::count(left_out.len(), "site")
            ));
        }
        notes.extend(kept.iter().map(|&place| {
            format!(
                "Site {} must be there but reports the same under every touch: it tells nothing.",
                self.pool.sites[place]
            )
        }));
        notes
    }

    /// The choice as numbered in the dataset.
    #[must_use]
    pub fn sites(&self) -> Vec<usize> {
        self.chosen.iter().map(|&p| self.pool.sites[p]).collect()
    }
}

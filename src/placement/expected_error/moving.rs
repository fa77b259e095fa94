//! Sets of gauges that may be anywhere: the criterion of a choice where what a gauge reads is taken again as it moves.

use rayon::prelude::*;

use super::bank::Bank;
use super::expectation::ExpectedSet;
use super::hand::GaugeInHand;
use super::losses::Losses;
use super::scene::{Beside, NUISANCES, SceneOutlook, SharedUnknowns, TouchScene, Variance};
use super::{Detail, SignalKnowledge};
use crate::budget::{Cancelled, Watch};
use crate::dataset::SignalMatrix;
use crate::placement::Constraints;

/// Seats for gauges, numbered from zero, under the touches that a choice looked at; who sits there may change.
pub struct Moving<'a> {
    fine: Seated<'a>,
    /// Where so many gauges may be lost that this is looked at in less detail.
    coarse: Option<Seated<'a>>,
    losses: Option<Losses>,
    constraints: &'a Constraints,
}

/// The seats, in some detail.
struct Seated<'a> {
    outlook: SceneOutlook<'a>,
    scene: TouchScene,
}

impl<'a> Moving<'a> {
    /// So many seats, with nobody in them. Readings are measured as those of a choice from sites that read `x`; of what
    /// is known of these the variance is not asked for.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch asks for it.
    pub fn new(
        x: &SignalMatrix,
        targets: &[[f64; 3]],
        known: &SignalKnowledge<'a>,
        (detail, seats): (Detail, usize),
        constraints: &'a Constraints,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let nobody = SignalMatrix::new(x.columns(), vec![0.0; seats * x.columns()]);
        let seated = |detail: Detail| -> Result<Seated<'a>, Cancelled> {
            let outlook = SceneOutlook::new(x, targets, known, detail, watch)?;
            let scene = outlook.scene(&nobody, Beside::default(), watch)?;
            Ok(Seated { outlook, scene })
        };
        let losses = Losses::of(constraints, known.seed);
        let many = losses.as_ref().is_some_and(|l| l.many);
        let coarse = many.then(|| seated(detail.coarse())).transpose()?;
        Ok(Self {
            fine: seated(detail)?,
            coarse,
            losses,
            constraints,
        })
    }

    /// Puts a gauge into a seat: what it reads under every touch, the variance that is on it, and what it feels with all
    /// others ([`SharedUnknowns::felt`]), by the touch.
    pub fn seat(
        &mut self,
        seat: usize,
        x: &[f64],
        variance: &(dyn Fn(usize) -> f64 + Sync),
        felt: &(dyn Fn(usize) -> [f64; NUISANCES] + Sync),
    ) {
        let row = SignalMatrix::new(x.len(), x.to_vec());
        let variance: Variance = &|_, touch| variance(touch);
        // What there is to find is the outlook's.
        let shared = SharedUnknowns {
            felt: &|_, touch| felt(touch),
            nuisances: [None; NUISANCES],
            drift: 0.0,
        };
        let beside = Beside {
            variance: Some(variance),
            shared: Some(&shared),
        };
        for seated in std::iter::once(&mut self.fine).chain(&mut self.coarse) {
            (seated.outlook).retake(&mut seated.scene, seat, &row, beside);
        }
    }

    /// The criterion (mm) of a choice for the gauges in some seats; `report` is asked whether to go on.
    ///
    /// # Errors
    /// [`Cancelled`] when `report` does not want it to.
    pub fn error(
        &self,
        set: &[usize],
        report: &(dyn Fn() -> Result<(), Cancelled> + Sync),
    ) -> Result<f64, Cancelled> {
        let lossy = self.coarse.as_ref().unwrap_or(&self.fine);
        let losses = self.losses.as_ref().map(|l| (l, &lossy.scene));
        let expected = ExpectedSet::of(&self.fine.scene, losses, set, report)?;
        Ok(expected.weighed(self.constraints))
    }

    /// The part of the error (mm) that is left where one place is meant.
    #[must_use]
    pub fn local(&self, set: &[usize]) -> f64 {
        Bank::of(&self.fine.scene, set).local()
    }

    /// The expected error (mm), with no gauge lost, of a set in which one gauge (its number in the set) is replaced by
    /// each of some others.
    #[must_use]
    pub fn with_each(&self, set: &[usize], number: usize, others: &[usize]) -> Vec<f64> {
        let scene = &self.fine.scene;
        let hand = GaugeInHand::around(scene, set, number);
        let error = |&seat: &usize| {
            let errors = hand.errors_with(seat);
            scene.mean_among(&errors, |_| true).unwrap_or(f64::INFINITY)
        };
        others.par_iter().map(error).collect()
    }
}

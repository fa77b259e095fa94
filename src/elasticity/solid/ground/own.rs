//! The tetrahedra that a part came with: to which order they are raised, how far off they are then, and what it takes.

use glam::DVec3;

use super::SolidGround;
use super::foreseen::{Foreseen, is_quick};
use super::solved::{SAFETY, SolidGraded, SolvedModel};
use crate::budget::Watch;
use crate::elasticity::error::ElasticError;
use crate::elasticity::estimate::{self, AccuracyTarget, Discretization};
use crate::elasticity::grade::{PLACES, sample, subsample};
use crate::elasticity::load::Touch;
use crate::elasticity::model::Model as _;
use crate::elasticity::solid::immersed::Fineness;
use crate::elasticity::solid::orders::{self, FIRST};
use crate::elasticity::solid::piece::TetrahedraPiece;
use crate::elasticity::solid::simplex::{HIGHEST, Simplex};
use crate::elasticity::solid::tetrahedra::OrderedTetrahedra;
use crate::memory;
use crate::mesh::volume::VolumeMesh;

/// Entries of the factor × touches, and multiplications of the factorization, for each vertex × touch of an effort: at
/// standard quality about two minutes of CPU time, and a quarter of one.
const ENTRIES: f64 = 70_000.0;
const MULTIPLICATIONS: f64 = 25_000.0;
/// Pieces that are judged where the whole, one order higher, does not fit into memory.
const PIECES: usize = 6;

/// The orders that were solved for a sample of the touches: what each changed.
struct Climb {
    touches: Vec<Touch>,
    places: Vec<DVec3>,
    changes: Vec<Discretization>,
}

impl Climb {
    fn new(touches: &[Touch], places: &[DVec3]) -> Self {
        Self {
            touches: sample(touches),
            places: subsample(places, PLACES),
            changes: Vec::new(),
        }
    }

    fn step(&mut self, from: &SolvedModel, to: &SolvedModel) {
        let (touches, places) = (&self.touches, &self.places);
        self.changes
            .push(change(&from.sample, &to.sample, touches, places));
    }

    /// What is left at the last order, from which displacements are carried on, or at the one before it, as it is.
    fn left(&self, before_last: bool) -> Discretization {
        let left = left(&self.changes, before_last);
        left.scaled(if before_last { 1.0 } else { orders::OFF }, 1.0)
    }

    /// The share of the last change of displacements that is still to come.
    fn carried_on(&self) -> f64 {
        orders::left(&self.sizes(), orders::DISPLACEMENT)
    }

    fn sizes(&self) -> Vec<f64> {
        (self.changes.iter())
            .map(|c| c.displacement_percent)
            .collect()
    }
}

/// What changes from one order to the next.
fn change(
    from: &estimate::ModelSample,
    to: &estimate::ModelSample,
    touches: &[Touch],
    places: &[DVec3],
) -> Discretization {
    estimate::left(from, to, touches, places, 1.0)
}

/// What is left after some changes, or was before the last of them.
fn left(changes: &[Discretization], before_last: bool) -> Discretization {
    let Some(&last) = changes.last() else {
        return estimate::unknown(0, 0);
    };
    let over = |value: fn(&Discretization) -> f64, usual: f64| {
        let sizes: Vec<f64> = changes.iter().map(value).collect();
        orders::left(&sizes, usual) + if before_last { 1.0 } else { 0.0 }
    };
    last.scaled(
        over(|c| c.displacement_percent, orders::DISPLACEMENT),
        over(|c| c.strain_percent, orders::STRAIN),
    )
}

impl SolidGround {
    /// The part's own tetrahedra at an order, up to [`HIGHEST`] and as far as memory holds who is whose neighbour.
    pub(super) fn own_at(&self, order: usize) -> Option<(Fineness, OrderedTetrahedra)> {
        let own = self.immersed.own()?;
        let each = Simplex::count(order).pow(2) * size_of::<u32>();
        let bytes = own.tetrahedra.len() as f64 * each as f64;
        if order > HIGHEST || (order > FIRST && bytes > memory::allowed()) {
            return None;
        }
        let fineness = self.fineness_at(order);
        let elements = self.immersed.tetrahedra(&fineness)?;
        Some((fineness, elements))
    }

    /// The part's own tetrahedra at an order.
    fn fineness_at(&self, order: usize) -> Fineness {
        let edge = self.immersed.own().map_or(0.0, VolumeMesh::mean_edge);
        Fineness {
            order,
            ..self.fineness(edge)
        }
    }

    /// As [`Self::own_at`] where so many touches can be afforded at that order, beside a model that takes so much memory (bytes).
    fn affordable(
        &self,
        order: usize,
        target: &AccuracyTarget,
        beside: f64,
    ) -> Option<(Fineness, OrderedTetrahedra)> {
        let own = self.own_at(order);
        own.filter(|own| affords(Some(own), target, beside))
    }

    fn solve_own(
        &self,
        (fineness, elements): (Fineness, OrderedTetrahedra),
        climb: &Climb,
        watch: Watch,
    ) -> Result<SolvedModel, ElasticError> {
        let model = self
            .immersed
            .on_own(&self.whole, elements, &fineness, watch)?;
        let (touches, places) = (&climb.touches, &climb.places);
        Ok(SolvedModel::of(fineness, model, touches, places, watch)?)
    }

    /// As [`Self::solve_own`]; nothing where memory does not hold it.
    fn try_own(
        &self,
        own: Option<(Fineness, OrderedTetrahedra)>,
        climb: &Climb,
        watch: Watch,
    ) -> Result<Option<SolvedModel>, ElasticError> {
        let Some(own) = own else { return Ok(None) };
        match self.solve_own(own, climb, watch) {
            Err(error) if error.is_memory() => Ok(None),
            solved => solved.map(Some),
        }
    }

    /// The part's own tetrahedra, their order raised until the error under these touches is small enough or the
    /// effort spent; displacements are carried on from the last two. The second order is solved in any case: it judges the first.
    pub(super) fn raise(
        &self,
        first: (Fineness, OrderedTetrahedra),
        target: &AccuracyTarget,
        watch: Watch,
    ) -> Result<SolidGraded, ElasticError> {
        let (mut climb, aim) = (Climb::new(target.touches, target.places), target.aim);
        let given = self.solve_own(first, &climb, watch)?;
        let second = self.own_at(FIRST + 1);
        let affordable = affords(second.as_ref(), target, 0.0);
        let Some(mut last) = self.try_own(second, &climb, watch)? else {
            let estimate = self.by_pieces(&climb, watch)?;
            return Ok(given.graded(&climb.touches, estimate, 1));
        };
        climb.step(&given, &last);
        let estimate = climb.left(true);
        if !affordable || estimate.excess(aim) <= SAFETY {
            return Ok(given.graded(&climb.touches, estimate, 2));
        }
        let mut before = given.model;
        while climb.left(false).excess(aim) > SAFETY {
            let order = last.fineness.order;
            let beside = last.model.system().bytes();
            let next = self.affordable(order + 1, target, beside);
            if next.is_none() {
                break;
            }
            // Two models are there at a time.
            drop(before);
            let next = self.try_own(next, &climb, watch)?;
            let Some(next) = next else {
                before = self.model(&self.fineness_at(order - 1), watch)?;
                break;
            };
            climb.step(&last, &next);
            before = std::mem::replace(&mut last, next).model;
        }
        let models = 1 + climb.changes.len() as u64;
        let mut graded = last.graded(&climb.touches, climb.left(false), models);
        graded.fineness.carried_on = climb.carried_on();
        graded.model = (graded.model).carried_on(before, graded.fineness.carried_on);
        Ok(graded)
    }

    /// The part's own tetrahedra as they are, nothing solved; nothing for a part without.
    #[must_use]
    pub fn as_they_are(&self) -> Option<Foreseen> {
        let (_, elements) = self.own_at(FIRST)?;
        let mut foreseen = Foreseen::new(self.immersed.own()?.mean_edge());
        foreseen.raise(FIRST, &elements);
        Some(foreseen)
    }

    /// What [`Self::raise`] would come to for as many touches like these as the target counts, from the first two orders,
    /// those that are quick, and the pattern of the others.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub(super) fn foresee_raised(
        &self,
        first: (Fineness, OrderedTetrahedra),
        target: &AccuracyTarget,
        watch: Watch,
    ) -> Result<Foreseen, ElasticError> {
        let (mut climb, aim) = (Climb::new(target.touches, target.places), target.aim);
        let mut foreseen = Foreseen::new(self.immersed.own().map_or(0.0, VolumeMesh::mean_edge));
        foreseen.raise(FIRST, &first.1);
        let given = self.solve_own(first, &climb, watch)?;
        let second = self.own_at(FIRST + 1);
        let affordable = affords(second.as_ref(), target, 0.0);
        let mut cubic = foreseen;
        if let Some((_, elements)) = &second {
            cubic.raise(FIRST + 1, elements);
        }
        let Some(solved) = self.try_own(second, &climb, watch)? else {
            foreseen.estimate = self.by_pieces(&climb, watch)?;
            return Ok(foreseen);
        };
        climb.step(&given, &solved);
        foreseen.estimate = climb.left(true);
        if !affordable || foreseen.estimate.excess(aim) <= SAFETY {
            // The next order judges this one, and is built for that.
            foreseen.assembled = cubic.assembled;
            foreseen.multiplications = cubic.multiplications;
            return Ok(foreseen);
        }
        foreseen = cubic;
        foreseen.estimate = climb.left(false);
        let mut last = Some(solved);
        while foreseen.estimate.excess(aim) > SAFETY
            && let Some(next) = self.affordable(foreseen.order + 1, target, foreseen.bytes)
        {
            let order = foreseen.order;
            foreseen.raise(order + 1, &next.1);
            last = match last {
                Some(before) if next.1.plan().is_some_and(|p| is_quick(p.multiplications)) => {
                    let solved = self.solve_own(next, &climb, watch)?;
                    climb.step(&before, &solved);
                    foreseen.estimate = climb.left(false);
                    Some(solved)
                }
                _ => {
                    let falls = |usual| orders::falls(order, usual);
                    let displacement = falls(orders::DISPLACEMENT);
                    let strain = falls(orders::STRAIN);
                    foreseen.estimate = foreseen.estimate.scaled(displacement, strain);
                    None
                }
            };
        }
        Ok(foreseen)
    }

    /// What is left of the part's own tetrahedra as they are, judged by the next order on pieces around some touches:
    /// the way that takes little memory.
    ///
    /// # Errors
    /// [`ElasticError::Cancelled`].
    pub fn judge_by_pieces(
        &self,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<Discretization, ElasticError> {
        self.by_pieces(&Climb::new(touches, places), watch)
    }

    fn by_pieces(&self, climb: &Climb, watch: Watch) -> Result<Discretization, ElasticError> {
        let Some(own) = self.immersed.own() else {
            return Ok(estimate::unknown(0, 0));
        };
        let mut found = Vec::new();
        for touch in subsample(&climb.touches, PIECES) {
            let piece = TetrahedraPiece::around(own, touch.position);
            let near: Vec<DVec3> = piece.within(&climb.places);
            let solved = |order| -> Result<SolvedModel, ElasticError> {
                let fineness = Fineness {
                    order,
                    ..self.fineness(own.mean_edge())
                };
                let model = self
                    .immersed
                    .on_piece(&self.whole, &piece, &fineness, watch)?;
                Ok(SolvedModel::of(fineness, model, &[touch], &near, watch)?)
            };
            match (solved(FIRST), solved(FIRST + 1)) {
                (Ok(from), Ok(to)) => {
                    found.push(change(&from.sample, &to.sample, &[touch], &near));
                }
                (Err(ElasticError::Cancelled(stop)), _)
                | (_, Err(ElasticError::Cancelled(stop))) => {
                    return Err(ElasticError::Cancelled(stop));
                }
                // A piece that cannot be computed by itself says nothing.
                _ => {}
            }
        }
        Ok(left(&[Discretization::of_all(&found)], true))
    }
}

/// Whether a factor fits into memory, of which so much is taken (bytes), and its solutions into the effort.
fn affords(
    own: Option<&(Fineness, OrderedTetrahedra)>,
    target: &AccuracyTarget,
    taken: f64,
) -> bool {
    let plan = own.and_then(|(_, elements)| elements.plan());
    plan.is_some_and(|plan| {
        let effort = target.aim.effort as f64;
        plan.entries * target.count as f64 <= ENTRIES * effort
            && plan.multiplications <= MULTIPLICATIONS * effort
            && taken + plan.bytes() <= memory::allowed()
    })
}

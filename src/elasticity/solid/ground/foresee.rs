//! What a part's elements will come to: the first ones are solved, from which the others are extrapolated.

use glam::DVec3;

use super::SolidGround;
use super::foreseen::{Foreseen, ModelCost, is_quick};
use super::graded::{Grids, ORDER, STRAIN_ORDER};
use super::solved::{SAFETY, SolvedModel};
use crate::budget::Watch;
use crate::elasticity::error::ElasticError;
use crate::elasticity::estimate::AccuracyTarget;
use crate::elasticity::grade::{PLACES, sample, subsample};
use crate::elasticity::load::Touch;
use crate::elasticity::solid::immersed::Fineness;
use crate::elasticity::solid::orders::FIRST;
use crate::elasticity::solid::plan;
use crate::elasticity::solid::sizing::{self, LEAST_GRIDS};
use crate::memory;

/// Cells of one size after the other.
struct ForeseenCells<'a> {
    ground: &'a SolidGround,
    touches: Vec<Touch>,
    places: Vec<DVec3>,
    grids: Grids,
    taken: Vec<ModelCost>,
    foreseen: Foreseen,
}

impl ForeseenCells<'_> {
    /// Looks at cells of the next size (m): solves them where they are among the first or quick.
    fn go_on(&mut self, size: f64, watch: Watch) -> Result<(), ElasticError> {
        let taken = self.extrapolated(size);
        let all_solved = self.grids.len() == self.taken.len();
        let taken = match taken.filter(|t| !all_solved || !is_quick(t.multiplications)) {
            Some(taken) => taken,
            None => self.solve(size, watch)?,
        };
        self.taken.push(taken);
        let next = &mut self.foreseen;
        next.go_on(&taken);
        next.size = size;
        next.boxes += self.ground.measures().area / self.ground.fineness(size).least.powi(2);
        let left = self.ground.left(&self.grids, &self.touches, &self.places);
        let finer = size / self.grids.size();
        next.estimate = left.scaled(finer.powf(ORDER), finer.powf(STRAIN_ORDER));
        Ok(())
    }

    /// What cells of a size (m) take, from two that were solved.
    fn extrapolated(&self, size: f64) -> Option<ModelCost> {
        let [.., before, last] = &self.taken[..] else {
            return None;
        };
        let shape = self.ground.measures();
        let more = shape.unknowns(size) / shape.unknowns(self.foreseen.size);
        let taken = last.beyond(before, last.unknowns * more);
        // Of a pattern that does not fit into memory nothing is known.
        taken.entries.is_finite().then_some(taken)
    }

    /// Whether cells of a size (m) fit into memory, as far as that can be foreseen.
    fn fits(&self, size: f64) -> bool {
        let taken = self.extrapolated(size);
        taken.is_none_or(|taken| taken.bytes <= memory::allowed())
    }

    fn solve(&mut self, size: f64, watch: Watch) -> Result<ModelCost, ElasticError> {
        /// The surface is found less closely: that takes most of the time, and what it leaves is the same on all grids.
        const LOOSELY: f64 = 2.0;
        // The factor before goes first: memory is asked for one of them.
        self.grids.forget_last();
        let ground = self.ground;
        let closely = ground.fineness(size);
        let fineness = Fineness {
            least: LOOSELY * closely.least,
            ..closely
        };
        let cells = ground.immersed.cells(&fineness, watch)?;
        let taken = ModelCost::by(&cells, plan(&cells).ok().as_ref());
        let model = (ground.immersed).on_cells(&ground.whole, cells, &fineness, watch)?;
        let solved = SolvedModel::of(fineness, model, &self.touches, &self.places, watch)?;
        self.grids.push(solved);
        Ok(taken)
    }
}

impl SolidGround {
    /// What [`Self::grade`] would come to for as many touches like these as the target counts.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn foresee(&self, target: &AccuracyTarget, watch: Watch) -> Result<Foreseen, ElasticError> {
        if let Some(first) = self.own_at(FIRST) {
            return self.foresee_raised(first, target, watch);
        }
        let (shape, aim) = (self.measures(), target.aim);
        let least = shape.least(aim, target.count);
        let touches = sample(target.touches);
        let (tip, away) = self.nearest(&touches);
        let mut size = shape.first(tip, away, least);
        let mut look = ForeseenCells {
            ground: self,
            touches,
            places: subsample(target.places, PLACES),
            grids: Grids::default(),
            taken: Vec::new(),
            foreseen: Foreseen::new(size),
        };
        loop {
            look.go_on(size, watch)?;
            let is_known = look.taken.len() >= LEAST_GRIDS as usize;
            let goes_on = !is_known || look.foreseen.estimate.excess(aim) > SAFETY;
            match sizing::next(size, least) {
                Some(next) if goes_on && (!is_known || look.fits(next)) => size = next,
                _ => return Ok(look.foreseen),
            }
        }
    }
}

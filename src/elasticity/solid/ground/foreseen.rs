//! What a part's elements will come to, before they are computed: the first ones are solved, from which the others are
//! told.

use glam::DVec3;

use super::SolidGround;
use super::graded::{Grids, ORDER, STRAIN_ORDER};
use super::solved::{SAFETY, Solved};
use crate::budget::{Elements as Aim, Watch};
use crate::elasticity::error::ElasticError;
use crate::elasticity::estimate::{self, Discretization};
use crate::elasticity::grade::{PLACES, sample, subsample};
use crate::elasticity::load::Touch;
use crate::elasticity::solid::immersed::Fineness;
use crate::elasticity::solid::orders::FIRST;
use crate::elasticity::solid::sizing::{self, LEAST_GRIDS};
use crate::elasticity::solid::tetrahedra::Tetrahedra;
use crate::elasticity::solid::{Elements, plan};
use crate::elasticity::solver::Plan;

/// What the elements of a part will be, and what they take.
#[derive(Clone, Copy, Debug)]
pub struct Foreseen {
    /// Order of the shape functions.
    pub order: usize,
    /// Side of the cells, or mean distance between the corners of the part's own tetrahedra (m).
    pub size: f64,
    /// Degrees of freedom of the last model.
    pub unknowns: f64,
    /// Entries of its factor.
    pub entries: f64,
    /// Memory of its factor and matrix (bytes).
    pub bytes: f64,
    /// The same of the order before, which displacements are carried on from.
    pub before: f64,
    /// Entries of the elements' matrices, of all models on the way.
    pub assembled: f64,
    /// Multiplications of all factorizations on the way.
    pub multiplications: f64,
    /// Boxes that the surface is found with in all cells that it cuts, about.
    pub boxes: f64,
    /// What is left on the last.
    pub estimate: Discretization,
}

impl Foreseen {
    pub(super) fn new(size: f64) -> Self {
        Self {
            order: FIRST,
            size,
            unknowns: 0.0,
            entries: 0.0,
            bytes: 0.0,
            before: 0.0,
            assembled: 0.0,
            multiplications: 0.0,
            boxes: 0.0,
            estimate: estimate::unknown(0, 0),
        }
    }

    /// The next order of the part's own tetrahedra, which takes the place of the last.
    pub(super) fn raise(&mut self, order: usize, elements: &Tetrahedra) {
        self.order = order;
        self.before = self.bytes;
        self.go_on(&Taken::by(elements, elements.plan()));
    }

    /// The next model, which takes the place of the last.
    fn go_on(&mut self, next: &Taken) {
        self.unknowns = next.unknowns;
        self.entries = next.entries;
        self.bytes = next.bytes;
        self.assembled += next.assembled;
        self.multiplications += next.multiplications;
    }
}

/// What one model takes.
#[derive(Clone, Copy, Debug, Default)]
struct Taken {
    unknowns: f64,
    entries: f64,
    bytes: f64,
    assembled: f64,
    multiplications: f64,
}

impl Taken {
    /// By elements with this factor, where it is known.
    fn by(elements: &dyn Elements, plan: Option<&Plan>) -> Self {
        let assembled = elements.entries();
        plan.map_or_else(Self::default, |plan| Self {
            unknowns: 3.0 * plan.order.len() as f64,
            entries: plan.entries,
            bytes: plan.bytes(),
            assembled,
            multiplications: plan.multiplications,
        })
    }

    /// With so many unknowns, as all grew from another model to this one.
    fn beyond(&self, before: &Self, unknowns: f64) -> Self {
        let steps = (unknowns / self.unknowns).ln() / (self.unknowns / before.unknowns).ln();
        let grown = |of: fn(&Self) -> f64| of(self) * (of(self) / of(before)).powf(steps);
        Self {
            unknowns,
            entries: grown(|t| t.entries),
            bytes: grown(|t| t.bytes),
            assembled: grown(|t| t.assembled),
            multiplications: grown(|t| t.multiplications),
        }
    }
}

/// Whether a factorization of so many multiplications is a matter of seconds.
pub(super) fn is_quick(multiplications: f64) -> bool {
    const QUICK: f64 = 2e10;
    multiplications < QUICK
}

/// Cells of one size after the other.
struct Look<'a> {
    ground: &'a SolidGround,
    touches: Vec<Touch>,
    places: Vec<DVec3>,
    grids: Grids,
    taken: Vec<Taken>,
    foreseen: Foreseen,
}

impl Look<'_> {
    /// Looks at cells of the next size (m): solves them where they are among the first or quick.
    fn go_on(&mut self, size: f64, watch: Watch) -> Result<(), ElasticError> {
        let told = self.told(size);
        let all_solved = self.grids.len() == self.taken.len();
        let taken = match told.filter(|t| !all_solved || !is_quick(t.multiplications)) {
            Some(told) => told,
            None => self.solve(size, watch)?,
        };
        self.taken.push(taken);
        let next = &mut self.foreseen;
        next.go_on(&taken);
        next.size = size;
        next.boxes += self.ground.shape().area / self.ground.fineness(size).least.powi(2);
        let left = self.ground.left(&self.grids, &self.touches, &self.places);
        let finer = size / self.grids.size();
        next.estimate = left.scaled(finer.powf(ORDER), finer.powf(STRAIN_ORDER));
        Ok(())
    }

    /// What cells of a size (m) take, from two that were solved.
    fn told(&self, size: f64) -> Option<Taken> {
        let [.., before, last] = &self.taken[..] else {
            return None;
        };
        let shape = self.ground.shape();
        let more = shape.unknowns(size) / shape.unknowns(self.foreseen.size);
        Some(last.beyond(before, last.unknowns * more))
    }

    fn solve(&mut self, size: f64, watch: Watch) -> Result<Taken, ElasticError> {
        /// The surface is found less closely: that takes most of the time, and what it leaves is the same on all grids.
        const LOOSELY: f64 = 2.0;
        let ground = self.ground;
        let closely = ground.fineness(size);
        let fineness = Fineness {
            least: LOOSELY * closely.least,
            ..closely
        };
        let cells = ground.immersed.cells(&fineness, watch)?;
        let taken = Taken::by(&cells, plan(&cells).ok().as_ref());
        let model = (ground.immersed).on_cells(&ground.whole, cells, &fineness, watch)?;
        let solved = Solved::of(fineness, model, &self.touches, &self.places, watch)?;
        self.grids.push(solved);
        Ok(taken)
    }
}

impl SolidGround {
    /// What [`Self::grade`] would come to for `count` touches like these; `places` (m) are where strains matter.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn foresee(
        &self,
        touches: &[Touch],
        places: &[DVec3],
        count: usize,
        aim: &Aim,
        watch: Watch,
    ) -> Result<Foreseen, ElasticError> {
        if self.immersed.own().is_some() {
            return self.foresee_raised(touches, places, count, aim, watch);
        }
        let shape = self.shape();
        let least = shape.least(aim, count);
        let touches = sample(touches);
        let (tip, away) = self.nearest(&touches);
        let mut size = shape.first(tip, away, least);
        let mut look = Look {
            ground: self,
            touches,
            places: subsample(places, PLACES),
            grids: Grids::default(),
            taken: Vec::new(),
            foreseen: Foreseen::new(size),
        };
        loop {
            look.go_on(size, watch)?;
            let is_known = look.taken.len() >= LEAST_GRIDS as usize;
            let is_enough = is_known && look.foreseen.estimate.excess(aim) <= SAFETY;
            match sizing::next(size, least) {
                Some(next) if !is_enough => size = next,
                _ => return Ok(look.foreseen),
            }
        }
    }
}

//! What the elements of a part take, before they are computed.

use crate::elasticity::estimate::{self, Discretization};
use crate::elasticity::solid::Elements;
use crate::elasticity::solid::orders::FIRST;
use crate::elasticity::solid::tetrahedra::OrderedTetrahedra;
use crate::elasticity::solver::FactorPlan;

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
    pub(super) fn raise(&mut self, order: usize, elements: &OrderedTetrahedra) {
        self.order = order;
        self.before = self.bytes;
        self.go_on(&ModelCost::by(elements, elements.plan()));
    }

    /// The next model, which takes the place of the last.
    pub(super) fn go_on(&mut self, next: &ModelCost) {
        self.unknowns = next.unknowns;
        self.entries = next.entries;
        self.bytes = next.bytes;
        self.assembled += next.assembled;
        self.multiplications += next.multiplications;
    }
}

/// What one model takes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ModelCost {
    pub unknowns: f64,
    pub entries: f64,
    pub bytes: f64,
    assembled: f64,
    pub multiplications: f64,
}

impl ModelCost {
    /// By elements with this factor, where it is known.
    pub fn by(elements: &dyn Elements, plan: Option<&FactorPlan>) -> Self {
        let assembled = elements.entries();
        plan.map_or_else(Self::default, |plan| Self {
            unknowns: plan.unknowns,
            entries: plan.entries,
            bytes: plan.bytes(),
            assembled,
            multiplications: plan.multiplications,
        })
    }

    /// With so many unknowns, as all grew from another model to this one.
    pub fn beyond(&self, before: &Self, unknowns: f64) -> Self {
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

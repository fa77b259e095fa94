//! Cells made smaller until the error is small enough; tetrahedra of the user's own are raised in their order instead.

use glam::DVec3;

use super::SolidGround;
use super::solved::{SAFETY, SolidGraded, SolvedModel};
use crate::budget::{ElementBudget, Watch};
use crate::elasticity::error::ElasticError;
use crate::elasticity::estimate::{self, AccuracyTarget, Discretization, ModelSample};
use crate::elasticity::grade::{PLACES, sample, subsample};
use crate::elasticity::load::Touch;
use crate::elasticity::solid::orders::FIRST;
use crate::elasticity::solid::series::GridSeries;
use crate::elasticity::solid::sizing::{self, LEAST_GRIDS, PartMeasures};
use crate::elasticity::solid::tip;

/// Orders at which errors of displacements and of strains on the surface fall: of displacements between 2, where all
/// is smooth, and 1.5 at edges that turn inward (`benches/solid.md`).
pub(super) const ORDER: f64 = 1.75;
pub(super) const STRAIN_ORDER: f64 = 1.5;

/// Models on finer and finer grids: of all but the last only what was read.
#[derive(Default)]
pub(super) struct Grids {
    sizes: Vec<f64>,
    samples: Vec<ModelSample>,
    last: Option<SolvedModel>,
}

impl Grids {
    /// Solves on a grid of the next size (m). Where memory does not hold it, but grids enough to say how far they are
    /// off are there, the one before stays the last: false.
    fn go_on(
        &mut self,
        size: f64,
        solve: impl Fn(f64) -> Result<SolvedModel, ElasticError>,
    ) -> Result<bool, ElasticError> {
        // The factor before goes first: memory is asked for one of them.
        self.last = None;
        match (solve(size), self.sizes.last()) {
            (Err(error), Some(&fits))
                if error.is_memory() && self.sizes.len() >= LEAST_GRIDS as usize =>
            {
                self.last = Some(solve(fits)?);
                Ok(false)
            }
            (solved, _) => {
                self.push(solved?);
                Ok(true)
            }
        }
    }

    /// Lets the last model go: what was read of it stays.
    pub(super) fn forget_last(&mut self) {
        self.last = None;
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.sizes.len()
    }

    /// Size of the last cells (m).
    pub(super) fn size(&self) -> f64 {
        self.sizes.last().copied().unwrap_or(f64::INFINITY)
    }

    pub(super) fn push(&mut self, mut solved: SolvedModel) {
        self.sizes.push(solved.fineness.size);
        self.samples.push(std::mem::take(&mut solved.sample));
        self.last = Some(solved);
    }
}

impl SolidGround {
    /// Makes cells smaller until the error under these touches is small enough or the most unknowns are
    /// spent.
    ///
    /// # Errors
    /// [`ElasticError`] for what cannot be computed.
    pub fn grade(
        &self,
        target: &AccuracyTarget,
        watch: Watch,
    ) -> Result<SolidGraded, ElasticError> {
        if let Some(first) = self.own_at(FIRST) {
            return self.raise(first, target, watch);
        }
        let (shape, aim) = (self.measures(), target.aim);
        let least = shape.least(aim, target.count);
        let touches = sample(target.touches);
        let places: Vec<DVec3> = subsample(target.places, PLACES);
        let (tip, away) = self.nearest(&touches);
        let mut grids = Grids::default();
        let mut size = shape.first(tip, away, least);
        let solve = |size: f64| self.solve(size, &touches, &places, watch);
        let mut is_short = false;
        let estimate = loop {
            if !grids.go_on(size, solve)? {
                is_short = true;
                break self.left(&grids, &touches, &places);
            }
            let next = sizing::next(size, least);
            if let Some(finer) = next
                && grids.sizes.len() < LEAST_GRIDS as usize
            {
                size = finer;
                continue;
            }
            let left = self.left(&grids, &touches, &places);
            match next {
                Some(finer) if left.excess(aim) > SAFETY => size = finer,
                _ => break left,
            }
        };
        let models = grids.sizes.len() as u64;
        let Some(last) = grids.last else {
            unreachable!("there is a first grid");
        };
        Ok(SolidGraded {
            is_short,
            ..last.graded(&touches, estimate, models)
        })
    }

    /// What the last of several grids is off by; unknown where there is one only.
    pub(super) fn left(
        &self,
        grids: &Grids,
        touches: &[Touch],
        places: &[DVec3],
    ) -> Discretization {
        let Some(fine) = grids.samples.last().filter(|_| grids.sizes.len() > 1) else {
            return estimate::unknown(touches.len(), places.len());
        };
        let size = grids.sizes[grids.sizes.len() - 1];
        let wall = self.wall();
        let (of_displacements, of_strains) = (
            GridSeries::new(&grids.sizes, ORDER),
            GridSeries::new(&grids.sizes, STRAIN_ORDER),
        );
        let under: Vec<f64> = (0..touches.len())
            .map(|load| {
                let off = of_displacements.error(|grid| grids.samples[grid].under[load]);
                let tip = touches[load].tip_radius;
                let unseen = tip::unseen(&self.immersed.material, tip, size, wall);
                off.max(unseen * touches[load].force)
            })
            .collect();
        estimate::of(fine, touches, places, &under, |load, place| {
            // All grids are read on the same surface, in the same frames.
            std::array::from_fn(|k| {
                of_strains.error(|grid| grids.samples[grid].strains[load][place][k])
            })
        })
    }

    /// With cells of a size (m).
    fn solve(
        &self,
        size: f64,
        touches: &[Touch],
        places: &[DVec3],
        watch: Watch,
    ) -> Result<SolvedModel, ElasticError> {
        let fineness = self.fineness(size);
        let model = self.model(&fineness, watch)?;
        Ok(SolvedModel::of(fineness, model, touches, places, watch)?)
    }
}

impl SolidGround {
    /// Sizes of the cells (m), one after the other, that [`Self::grade`] would come to for a part and a tip (m), were
    /// the error as on other parts.
    #[must_use]
    pub fn foreseen(
        shape: &PartMeasures,
        tip: f64,
        aim: &ElementBudget,
        touches: usize,
    ) -> Vec<f64> {
        let least = shape.least(aim, touches);
        let mut sizes = vec![shape.first(tip, f64::INFINITY, least)];
        while let Some(&size) = sizes.last()
            && (sizes.len() < LEAST_GRIDS as usize
                || Self::error_percent(size, shape.wall.min(tip))
                    > SAFETY * aim.displacement_percent)
            && let Some(next) = sizing::next(size, least)
        {
            sizes.push(next);
        }
        sizes
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::budget::unwatched;
    use crate::elasticity::support::HeldRegion;
    use crate::elasticity::{DofSet, Material, Support};
    use crate::mesh::TriMesh;
    use crate::mesh::oriented_box::OrientedBox;

    /// A cube of 20 mm that is held at its foot.
    fn cube() -> SolidGround {
        let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2].map(|x| 0.02 * f64::from(x));
        let positions = (0..8).map(|i| DVec3::from_array(corner(i))).collect();
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
        let part = TriMesh::from_checked(positions, quads.into_iter().flat_map(halves).collect());
        let foot = Support {
            region: HeldRegion::Box(OrientedBox::of_file(
                DVec3::NEG_ONE,
                DVec3::new(1.0, 1.0, 1e-6),
            )),
            held: DofSet::ALL,
            bedding: None,
        };
        let material = Material {
            youngs_modulus: 2e9,
            poissons_ratio: 0.3,
        };
        SolidGround::new(&Arc::new(part), material, &[foot], &|_| None, &unwatched).unwrap()
    }

    #[test]
    fn what_memory_does_not_hold_leaves_the_grid_before() {
        const WANTING: f64 = 4e-3;
        let ground = cube();
        let touch = Touch {
            position: DVec3::new(0.01, 0.01, 0.02),
            normal: DVec3::Z,
            force: 1.0,
            tip_radius: 3e-3,
        };
        let solve = |size: f64| {
            if size < WANTING {
                return Err(ElasticError::OutOfMemory);
            }
            ground.solve(size, &[touch], &[DVec3::ZERO], &unwatched)
        };
        let mut grids = Grids::default();
        for size in [9e-3, 7e-3, 5e-3] {
            assert!(grids.go_on(size, solve).unwrap());
        }
        assert!(!grids.go_on(3e-3, solve).unwrap());
        assert_eq!(grids.sizes, [9e-3, 7e-3, 5e-3]);
        assert_eq!(grids.last.as_ref().unwrap().fineness.size, 5e-3);
        let left = ground.left(&grids, &[touch], &[DVec3::ZERO]);
        assert!(left.displacement_percent.is_finite());
        // Of fewer grids nothing is known: that is refused.
        let mut few = Grids::default();
        few.go_on(9e-3, solve).unwrap();
        assert!(few.go_on(3e-3, solve).is_err());
    }
}

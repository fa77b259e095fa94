//! Which gauges the arm of a jig gets to, where a project asks for that.

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::{InnerFace, Inputs, Simulated};
use crate::budget::unwatched;
use crate::dataset::Site;
use crate::gauge::Gauge;
use crate::jig::{FILM, RodReach, Wall};
use crate::project::PartModel;

/// The jig that sites are filtered by.
pub(super) struct JigFilter {
    reach: RodReach,
    face: InnerFace,
}

impl JigFilter {
    /// Nothing where it is not asked for.
    pub(super) fn of(inputs: &Inputs, simulated: &Simulated) -> Option<Self> {
        let project = &inputs.project;
        if !project.feasible.jig {
            return None;
        }
        let inner = InnerFace::of(&project.part);
        let face = match project.part.model {
            PartModel::Solid => Arc::clone(&simulated.mesh),
            PartModel::Shell => Arc::new(inner.mesh(&simulated.mesh)),
        };
        let wall = Wall {
            part: match project.part.model {
                PartModel::Solid => Arc::clone(&inputs.part),
                PartModel::Shell => Arc::clone(&face),
            },
            face,
            stance: inputs.stance(),
        };
        let grid = DVec2::new(project.gauge.grid_length_mm, project.gauge.grid_width_mm);
        let sites = &simulated.dataset.sites[..simulated.lattice];
        let places: Vec<Gauge> = sites.iter().map(|s| inner.gauge(&s.gauge)).collect();
        let reach = RodReach::new(wall, &places, grid / 2.0 + FILM, &unwatched).ok()?;
        Some(Self { reach, face: inner })
    }

    /// One value a gauge.
    pub(super) fn gets_to(&self, sites: &[Site]) -> Vec<bool> {
        let gets = |site: &Site| self.reach.gets_to(&self.face.gauge(&site.gauge));
        sites.par_iter().map(gets).collect()
    }
}

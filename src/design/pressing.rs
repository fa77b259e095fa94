//! Which gauges the arm of a jig gets to, where a project asks for that.

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::{Inputs, Simulated};
use crate::budget::unwatched;
use crate::dataset::Site;
use crate::jig::{FILM, PressedGauge, RodReach, Wall};
use crate::project::PartModel;

/// The jig that sites are filtered by.
pub(super) struct Pressing {
    reach: RodReach,
    /// Whether normals of sites look inwards.
    looks_in: bool,
    /// From a site to the inner face (m).
    depth: f64,
}

impl Pressing {
    /// Nothing where it is not asked for.
    pub(super) fn of(inputs: &Inputs, simulated: &Simulated) -> Option<Self> {
        let project = &inputs.project;
        if !project.feasible.jig {
            return None;
        }
        let (looks_in, depth) = match project.part.model {
            PartModel::Solid => (true, 0.0),
            PartModel::Shell => (false, 0.5e-3 * project.part.thickness_mm),
        };
        let face = match project.part.model {
            PartModel::Solid => Arc::clone(&simulated.mesh),
            PartModel::Shell => Arc::new(simulated.mesh.offset(-depth)),
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
        let places: Vec<PressedGauge> = sites.iter().map(|s| pressed(s, looks_in, depth)).collect();
        let reach = RodReach::new(wall, &places, grid / 2.0 + FILM, &unwatched).ok()?;
        Some(Self {
            reach,
            looks_in,
            depth,
        })
    }

    /// One value a gauge.
    pub(super) fn gets_to(&self, gauges: &[Site]) -> Vec<bool> {
        let gets = |s: &Site| self.reach.gets_to(&pressed(s, self.looks_in, self.depth));
        gauges.par_iter().map(gets).collect()
    }
}

fn pressed(site: &Site, looks_in: bool, depth: f64) -> PressedGauge {
    let out = if looks_in { -site.normal } else { site.normal };
    PressedGauge {
        number: 0,
        place: site.position - out * depth,
        out,
        direction: site.direction,
    }
}

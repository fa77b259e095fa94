//! The jig for the gauges of a project or a design.

use std::sync::Arc;

use glam::DVec2;

use super::inner::Inner;
use crate::budget::{Cancelled, Watch};
use crate::design::Inputs;
use crate::jig::{FILM, Jig, Wall, plan};
use crate::project::PartModel;

/// Of gauges on an inner face. Of a shell that face is in the way, of a solid all of its surface.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn jig_of(inputs: &Inputs, inner: &Inner, watch: Watch) -> Result<Jig, Cancelled> {
    let face = Arc::new(inner.mesh.clone());
    let keys = &inputs.project.gauge;
    let grid = DVec2::new(keys.grid_length_mm, keys.grid_width_mm);
    let wall = Wall {
        part: match inputs.project.part.model {
            PartModel::Solid => Arc::clone(&inputs.part),
            PartModel::Shell => Arc::clone(&face),
        },
        face,
        stance: inner.stance,
    };
    plan(wall, &inner.pressed(), grid / 2.0 + FILM, watch)
}

//! How far two points of the part are apart, straight and over the surface.

use std::sync::Arc;

use super::jobs::Task;
use super::slot::{Slot, current};
use super::state::Session;
use super::state::measure::{Distance, Ends};
use crate::job::Reporter;
use crate::mesh::{TriMesh, geodesic};

impl Session {
    /// Measures over the surface in the background.
    pub fn measure(&mut self, ends: Ends) {
        let part = Arc::clone(&self.document.part);
        let work = move |_: &Reporter| Ok(over_surface(&part, ends));
        self.jobs
            .start(Task::Measure, ends, work, |s, inputs, value| {
                s.caches.distance = Some(Slot { inputs, value });
            });
    }

    /// What is known of how far two points are apart.
    #[must_use]
    pub fn distance(&self, ends: &Ends) -> Distance {
        let part = &self.document.part;
        Distance {
            straight: part.point(ends.from).distance(part.point(ends.to)),
            over_surface: current(self.caches.distance.as_ref(), ends).copied(),
        }
    }
}

fn over_surface(part: &TriMesh, Ends { from, to }: Ends) -> f64 {
    let distances = geodesic::from_point(part, from, f64::INFINITY);
    let corners = part.triangles()[to.triangle as usize];
    let end = part.point(to);
    let reach = |&v: &u32| distances[v as usize] + part.positions()[v as usize].distance(end);
    let around = corners.iter().map(reach).fold(f64::INFINITY, f64::min);
    let within = part.interpolate(&distances, to);
    let straight = part.point(from).distance(end);
    // Within one triangle the straight line is the way.
    if from.triangle == to.triangle {
        straight
    } else {
        within.min(around).max(straight)
    }
}

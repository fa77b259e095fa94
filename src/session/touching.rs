//! A click presses the limb.

use super::latest::Latest;
use super::slot::Slot;
use super::state::Session;
use super::state::touching::{BROKEN, TouchRequest, serve};
use crate::elasticity::Touch;
use crate::mesh::SurfacePoint;

impl Session {
    /// Presses the part with the project's force; the answer comes later.
    pub fn press(&mut self, at: SurfacePoint) {
        let project = &self.document.state.project;
        let (force, tip_radius) = project.tip();
        let request = TouchRequest {
            model: self.document.model_inputs(),
            inputs: self.document.inputs(),
            touch: Touch {
                position: self.document.part.point(at),
                normal: self.document.part.normal(at),
                force,
                tip_radius,
            },
        };
        let touching = &mut self.caches.touching;
        let worker = touching
            .worker
            .get_or_insert_with(|| Latest::start(&self.wake, BROKEN, serve));
        touching.waiting |= worker.ask(request);
    }

    /// Shows no touch any more.
    pub fn let_go(&mut self) {
        self.caches.touching.show(None);
    }

    /// Takes in what the worker has answered.
    pub(super) fn collect_touches(&mut self) {
        let touching = &mut self.caches.touching;
        let answers: Vec<_> = touching.worker.iter().flat_map(Latest::answers).collect();
        for answer in answers {
            touching.waiting = false;
            match answer {
                Ok(touched) => touching.show(Some(touched)),
                Err(message) => self.news.complain(message),
            }
        }
        // What was computed for another support or material no longer shows this part.
        let stale = |slot: &Slot<_, _>| !slot.holds_for(&self.document.model_inputs());
        if touching.result.as_ref().is_some_and(stale) {
            touching.show(None);
        }
    }
}

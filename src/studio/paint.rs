//! What is painted with: a look at everything that is shown, and text that is readable over anything.

use std::sync::Arc;

use egui::{Align2, Color32, FontId, Galley, Painter, Pos2, Rect, Ui, vec2};
use glam::DVec3;

use super::scene::PartScene;
use super::view::{Pane, Tool, ViewState};
use crate::project::Project;
use crate::session::{ExpectedOf, Session};

/// All that a picture of the limb is made of.
#[derive(Clone, Copy)]
pub struct LimbLook<'a> {
    pub session: &'a Session,
    pub view: &'a ViewState,
    pub scene: &'a PartScene,
}

impl<'a> LimbLook<'a> {
    #[must_use]
    pub fn project(&self) -> &'a Project {
        &self.session.document.state.project
    }

    /// Where a point of the limb appears in a view, in points.
    #[must_use]
    pub fn place_in(&self, pane: Pane, p: DVec3) -> Option<Pos2> {
        self.scene.place_in(self.view, pane, p)
    }

    /// How much the deformation is exaggerated; nothing without a touch, nor with other tools: they work on the limb at
    /// rest.
    #[must_use]
    pub fn exaggeration(&self) -> Option<f64> {
        exaggeration(self.session, self.view)
    }

    /// What is expected of the gauges: as they are, or while one moves, as they just were.
    #[must_use]
    pub fn expected(&self) -> Option<&'a ExpectedOf> {
        self.view.expected(self.session)
    }
}

/// As [`LimbLook::exaggeration`].
#[must_use]
pub fn exaggeration(session: &Session, view: &ViewState) -> Option<f64> {
    let touched = session.caches.touching.result()?;
    touched.exaggeration.filter(|_| view.tool == Tool::Touch)
}

/// Text on a dark plate, readable over anything.
pub fn label(painter: &Painter, at: Pos2, align: Align2, text: &str, colour: Color32) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.5), colour);
    plate(painter, at, align, galley);
}

/// A dark plate under a text; where it is.
pub fn plate(painter: &Painter, at: Pos2, align: Align2, galley: Arc<Galley>) -> Rect {
    let rect = align.anchor_size(at, galley.size());
    let board = rect.expand2(vec2(7.0, 4.0));
    painter.rect_filled(board, 5.0, Color32::from_black_alpha(150));
    painter.galley(rect.min, galley, Color32::WHITE);
    board
}

/// What is said where there is nothing to show.
pub fn empty(ui: &mut Ui, text: &str) {
    ui.add_space(12.0);
    ui.vertical_centered(|ui| ui.weak(text));
}

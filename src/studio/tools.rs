//! What the pointer does on the limb, in space or unrolled.

use egui::{PointerButton, Pos2, Response, Ui};
use glam::DVec2;
use rayon::prelude::*;

use super::Studio;
use super::fields::Field;
use super::viewport::{Pane, Viewport};
use crate::document::Brush;
use crate::mesh::{SurfacePoint, TriMesh};

/// What the pointer does on the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    #[default]
    Touch,
    Gauges,
    Paint,
    Erase,
    Box,
    Lasso,
    Measure,
}

impl Tool {
    pub const ALL: [Self; 7] = [
        Self::Touch,
        Self::Gauges,
        Self::Paint,
        Self::Erase,
        Self::Box,
        Self::Lasso,
        Self::Measure,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Touch => "Touch",
            Self::Gauges => "Gauges",
            Self::Paint => "Paint",
            Self::Erase => "Erase",
            Self::Box => "Box",
            Self::Lasso => "Lasso",
            Self::Measure => "Measure",
        }
    }

    /// Whether it changes what is painted.
    #[must_use]
    pub fn paints(self) -> bool {
        matches!(self, Self::Paint | Self::Erase | Self::Box | Self::Lasso)
    }

    /// Whether it has a radius.
    #[must_use]
    pub fn is_brush(self) -> bool {
        matches!(self, Self::Paint | Self::Erase)
    }

    /// Whether a drag with the left button is its own and not a look around.
    fn drags(self) -> bool {
        self.paints() || self == Self::Gauges
    }
}

/// A click that moves less than this (points) is no drag.
const TREMBLE: f32 = 4.0;

/// What is under way between pressing and letting go.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Gesture {
    #[default]
    None,
    /// A stroke, and where its last dab was.
    Stroke(Pane, Pos2),
    /// The outline drawn so far.
    Outline(Pane, Vec<Pos2>),
    /// A gauge that is moved, by its number from zero, and where it was taken.
    Gauge(Pane, usize, Pos2),
}

impl Studio {
    /// Orbit with the right button (or the left one where the tool has no use for it), pan with the middle
    /// one or with Shift, zoom with the wheel; with Shift the wheel sets the brush.
    pub(super) fn navigate(&mut self, ui: &Ui, response: &Response, pane: Pane) {
        let drag = response.drag_delta();
        let shift = ui.input(|i| i.modifiers.shift);
        let left = response.dragged_by(PointerButton::Primary);
        let free = !self.view.tool.drags() || self.view.gesture == Gesture::None;
        let turning = response.dragged_by(PointerButton::Secondary) || left && free;
        let panning = response.dragged_by(PointerButton::Middle) || turning && shift;
        let moved = DVec2::new(f64::from(drag.x), f64::from(drag.y));
        match pane {
            Pane::Unrolled if panning || turning => self.view.pan_flat(drag),
            Pane::Limb if panning => {
                let height = f64::from(self.view.rect.height());
                self.view.camera.pan(moved, height);
            }
            Pane::Limb if turning => self.view.camera.orbit(moved),
            _ => {}
        }
        if !response.hovered() {
            return;
        }
        let wheel = ui.input(|i| {
            // With Shift a wheel scrolls sideways.
            let scroll = i.smooth_scroll_delta();
            scroll.x + scroll.y + 400.0 * (i.zoom_delta() - 1.0)
        });
        if wheel == 0.0 {
            return;
        }
        let factor = (-0.0022 * f64::from(wheel)).exp();
        match (pane, response.hover_pos()) {
            _ if shift && self.view.tool.is_brush() => self.view.brush /= factor,
            (Pane::Limb, _) => self.view.camera.zoom(factor),
            (Pane::Unrolled, Some(at)) => self.view.zoom_flat(at, factor),
            _ => {}
        }
    }

    pub(super) fn use_tool(&mut self, ui: &Ui, response: &Response, pane: Pane) {
        let covered = self.view.covered;
        let free = |at: &Pos2| !covered.contains(*at);
        if let Some(at) = response.hover_pos().filter(free) {
            self.view.hover = self.view.pick(pane, at);
        }
        let at = response.interact_pointer_pos().or(response.hover_pos());
        let clicked = response.clicked() && at.as_ref().is_none_or(free);
        match self.view.tool {
            Tool::Touch if clicked => {
                self.press(pane, response.interact_pointer_pos());
            }
            Tool::Measure if clicked => {
                let place = at.and_then(|at| self.view.pick(pane, at));
                self.view.measure.take(place);
                if let Some(ends) = self.view.measure.ends() {
                    self.session.measure(ends);
                }
            }
            _ => {}
        }
        let from = pressed_at(ui).filter(free);
        if let Some(from) = from.filter(|_| response.contains_pointer()) {
            self.begin(ui, pane, from);
        }
        // In the same frame too: where frames are slow, a hand has pressed and moved on in one.
        if let Some(at) = at {
            self.go_on(ui, pane, at);
        }
        if !ui.input(|i| i.pointer.primary_down()) {
            self.let_go(ui, pane);
        }
    }

    /// The left button goes down.
    fn begin(&mut self, ui: &Ui, pane: Pane, from: Pos2) {
        match self.view.tool {
            Tool::Gauges => self.grab(ui, pane, from),
            Tool::Paint | Tool::Erase if self.view.pick(pane, from).is_some() => {
                self.view.gesture = Gesture::Stroke(pane, from);
                self.stroke(ui, pane, from);
            }
            Tool::Box | Tool::Lasso => {
                self.view.gesture = Gesture::Outline(pane, vec![from]);
            }
            _ => {}
        }
    }

    /// The pointer moves while something is under way in this view.
    fn go_on(&mut self, ui: &Ui, pane: Pane, at: Pos2) {
        match &mut self.view.gesture {
            Gesture::Stroke(own, _) if *own == pane => self.stroke(ui, pane, at),
            Gesture::Outline(own, outline) if *own == pane => match self.view.tool {
                Tool::Box => outline.splice(1.., [at]).for_each(drop),
                _ if outline.last().is_some_and(|last| last.distance(at) > 3.0) => outline.push(at),
                _ => {}
            },
            Gesture::Gauge(own, number, from) if *own == pane && from.distance(at) > TREMBLE => {
                // From here on it follows however little the pointer moves.
                *from = Pos2::new(f32::MAX, 0.0);
                let number = *number;
                self.drag_gauge(pane, number, at);
            }
            _ => {}
        }
    }

    fn let_go(&mut self, ui: &Ui, pane: Pane) {
        let own = match &self.view.gesture {
            Gesture::None => return,
            Gesture::Stroke(own, _) | Gesture::Outline(own, _) | Gesture::Gauge(own, ..) => *own,
        };
        if own != pane {
            return;
        }
        match std::mem::take(&mut self.view.gesture) {
            Gesture::Outline(_, outline) => self.paint_inside(ui, pane, outline),
            // What the move does to the error is found out when the window is next drawn.
            Gesture::Gauge(..) => ui.ctx().request_repaint(),
            _ => {}
        }
        self.session.document.settle();
    }

    fn press(&mut self, pane: Pane, at: Option<Pos2>) {
        match at.and_then(|at| self.pick_shown(pane, at)) {
            Some(place) => {
                self.session.press(place);
                if !matches!(self.view.field, Field::Strain | Field::Displacement) {
                    self.view.field = Field::Strain;
                }
            }
            None => self.session.let_go(),
        }
    }

    /// The point of the limb under a place of the window, on the shape that is shown there.
    fn pick_shown(&self, pane: Pane, at: Pos2) -> Option<SurfacePoint> {
        match self.session.caches.touching.result() {
            Some(touched) if pane == Pane::Limb && self.exaggeration().is_some() => {
                self.view.pick_on(&touched.index, at)
            }
            _ => self.view.pick(pane, at),
        }
    }

    /// What a brush or outline does now: Control turns it around, as elsewhere.
    fn brush(&self, ui: &Ui) -> Brush {
        let erases = self.view.tool == Tool::Erase;
        if erases == ui.input(|i| i.modifiers.ctrl) {
            Brush::Paint
        } else {
            Brush::Erase
        }
    }

    /// Dabs along the way from the last pointer sample, so that a fast stroke has no gaps: half a radius
    /// apart, nearer where that is less than a few points of the window.
    fn stroke(&mut self, ui: &Ui, pane: Pane, to: Pos2) {
        const MOST: f32 = 256.0;
        let brush = self.brush(ui);
        let Gesture::Stroke(_, from) = self.view.gesture else {
            return;
        };
        let step = self.dab_step(pane, to).max(4.0);
        let steps = ((to - from).length() / step).ceil().clamp(1.0, MOST) as usize;
        let radius = self.view.brush;
        for k in 1..=steps {
            let at = from.lerp(to, k as f32 / steps as f32);
            let Some(place) = self.view.pick(pane, at) else {
                continue;
            };
            self.session
                .document
                .dab(self.view.layer, brush, place, radius);
            if let Some(image) = self.view.image(self.session.document.part.point(place)) {
                let (image, off) = self.view.index.nearest(image);
                // A part that is not its own mirror image has nothing there.
                if off < radius {
                    self.session
                        .document
                        .dab(self.view.layer, brush, image, radius);
                }
            }
        }
        self.view.gesture = Gesture::Stroke(pane, to);
    }

    /// Half the brush's radius in points of the window.
    fn dab_step(&self, pane: Pane, at: Pos2) -> f32 {
        match pane {
            Pane::Unrolled => (0.5 * self.view.brush / self.view.flat_view().1) as f32,
            Pane::Limb => {
                let Some(place) = self.view.pick(pane, at) else {
                    return 0.0;
                };
                let p = self.session.document.part.point(place);
                let side = self.view.camera.side() * self.view.brush * 0.5;
                let ends = [self.view.place(p), self.view.place(p + side)];
                match ends {
                    [Some(a), Some(b)] => a.distance(b),
                    _ => 0.0,
                }
            }
        }
    }

    /// Paints the vertices inside an outline: those that can be seen, or all where walls are see-through.
    fn paint_inside(&mut self, ui: &Ui, pane: Pane, mut outline: Vec<Pos2>) {
        if let (Tool::Box, [a, b]) = (self.view.tool, &outline[..]) {
            outline = vec![*a, Pos2::new(b.x, a.y), *b, Pos2::new(a.x, b.y)];
        }
        if outline.len() < 3 {
            return;
        }
        let brush = self.brush(ui);
        let part = std::sync::Arc::clone(&self.session.document.part);
        let bounds = egui::Rect::from_points(&outline);
        let place = self.view.placing(pane);
        let inside: Vec<u32> = (0..part.positions().len() as u32)
            .filter(|&v| {
                let at = place(part.positions()[v as usize]);
                at.is_some_and(|at| bounds.contains(at) && encloses(&outline, at))
            })
            .collect();
        let through = pane == Pane::Unrolled || self.view.see_through;
        let inside: Vec<u32> = (inside.into_par_iter())
            .filter(|&v| through || is_seen(&self.view, &part, v))
            .collect();
        self.session.document.mark(self.view.layer, brush, inside);
    }
}

/// Whether nothing of the part lies between the eye and one of its vertices.
fn is_seen(view: &Viewport, part: &TriMesh, vertex: u32) -> bool {
    let p = part.positions()[vertex as usize];
    let Some(at) = view.place(p) else {
        return false;
    };
    let near = 1e-3 * view.camera.distance + part.mean_edge();
    let hit = view.pick(Pane::Limb, at);
    hit.is_none_or(|hit| part.point(hit).distance(p) < near)
}

/// Where the left button went down in this frame.
fn pressed_at(ui: &Ui) -> Option<Pos2> {
    let down = |event: &egui::Event| match event {
        egui::Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed: true,
            ..
        } => Some(*pos),
        _ => None,
    };
    ui.input(|i| i.events.iter().find_map(down))
}

/// Whether a point lies inside a polygon (even-odd rule).
fn encloses(outline: &[Pos2], at: Pos2) -> bool {
    let mut inside = false;
    for (k, a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        if (a.y > at.y) != (b.y > at.y) {
            let x = a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x);
            inside ^= at.x < x;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_may_bend_inwards() {
        let outline = [
            (0.0, 0.0),
            (10.0, 0.0),
            (10.0, 10.0),
            (5.0, 2.0),
            (0.0, 10.0),
        ]
        .map(|(x, y)| Pos2::new(x, y));
        assert!(encloses(&outline, Pos2::new(1.0, 5.0)));
        assert!(!encloses(&outline, Pos2::new(5.0, 5.0)));
        assert!(!encloses(&outline, Pos2::new(-1.0, 1.0)));
    }
}

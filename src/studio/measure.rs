//! The measure: two points of the part, and how far they are apart.

use egui::{Align2, Color32, Painter, Stroke};
use glam::DVec3;

use super::Studio;
use super::overlay::label;
use super::viewport::Pane;
use crate::mesh::SurfacePoint;
use crate::session::Ends;

/// The points that were clicked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    pub from: Option<SurfacePoint>,
    pub to: Option<SurfacePoint>,
}

impl Measure {
    /// Both of them.
    #[must_use]
    pub fn ends(&self) -> Option<Ends> {
        Some(Ends {
            from: self.from?,
            to: self.to?,
        })
    }

    /// Takes the next point: the first, the second, or the first of a new measurement.
    pub fn take(&mut self, place: Option<SurfacePoint>) {
        if self.from.is_some() && self.to.is_none() && place.is_some() {
            self.to = place;
        } else {
            (self.from, self.to) = (place, None);
        }
    }
}

impl Studio {
    pub(super) fn paint_measure(&self, painter: &Painter, pane: Pane) {
        if self.view.tool != super::Tool::Measure {
            return;
        }
        let part = &self.session.document.part;
        let measure = &self.view.measure;
        let place = |p: DVec3| self.view.place_in(pane, p);
        let [from, to] = [measure.from, measure.to].map(|at| at.map(|at| part.point(at)));
        let ink = Color32::from_rgb(250, 220, 120);
        for at in [from, to].into_iter().flatten().filter_map(place) {
            painter.circle(at, 4.0, ink, Stroke::new(1.0, Color32::BLACK));
        }
        let (Some(from), Some(to)) = (from, to) else {
            return;
        };
        let (Some(a), Some(b)) = (place(from), place(to)) else {
            return;
        };
        painter.line_segment([a, b], Stroke::new(1.5, ink));
        let straight = format!("{:.2} mm straight", from.distance(to) * 1000.0);
        let over = measure
            .ends()
            .and_then(|ends| self.session.distance(&ends).over_surface);
        let text = match over {
            None => format!("{straight}, … over the surface"),
            Some(d) if d.is_infinite() => format!("{straight}, no way over the surface"),
            Some(d) => format!("{straight}, {:.2} mm over the surface", d * 1000.0),
        };
        let middle = a.lerp(b, 0.5) - egui::vec2(0.0, 12.0);
        label(painter, middle, Align2::CENTER_BOTTOM, &text, ink);
    }
}

//! The measure over the limb: two points, and how far they are apart.

use egui::{Align2, Color32, Painter, Stroke};
use glam::DVec3;

use super::paint::{LimbLook, label};
use super::view::{Pane, Tool};

/// Both points, and what lies between them.
pub fn paint_measure(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    if look.view.tool != Tool::Measure {
        return;
    }
    let part = &look.session.document.part;
    let measure = &look.view.measure;
    let place = |p: DVec3| look.place_in(pane, p);
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
        .and_then(|ends| look.session.distance(&ends).over_surface);
    let text = match over {
        None => format!("{straight}, … over the surface"),
        Some(d) if d.is_infinite() => format!("{straight}, no way over the surface"),
        Some(d) => format!("{straight}, {:.2} mm over the surface", d * 1000.0),
    };
    let middle = a.lerp(b, 0.5) - egui::vec2(0.0, 12.0);
    label(painter, middle, Align2::CENTER_BOTTOM, &text, ink);
}

//! The measure: how far two points of the part are apart, straight and over the surface.

use egui::{Align2, Color32, Context, Painter, Stroke};
use glam::DVec3;

use super::Studio;
use super::drive::Finished;
use super::jobs::Task;
use super::overlay::label;
use super::viewport::Pane;
use crate::mesh::{SurfacePoint, geodesic};

/// The points that were clicked, and what lies between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measure {
    pub from: Option<SurfacePoint>,
    pub to: Option<SurfacePoint>,
    /// Over the surface (m); infinite where no way leads from one to the other.
    pub over_surface: Option<f64>,
    asked: u64,
}

impl Studio {
    /// Takes the next point: the first, the second, or the first of a new measurement.
    pub(super) fn measure_to(&mut self, ctx: &Context, place: Option<SurfacePoint>) {
        let measure = &mut self.view.measure;
        let asked = measure.asked + 1;
        let (Some(from), None, Some(to)) = (measure.from, measure.to, place) else {
            *measure = Measure {
                from: place,
                asked,
                ..Measure::default()
            };
            return;
        };
        (measure.to, measure.asked) = (Some(to), asked);
        let part = std::sync::Arc::clone(&self.document.part);
        let key = asked.to_string();
        self.jobs.start(ctx, Task::Measure, key, move |_| {
            let distances = geodesic::from_point(&part, from, f64::INFINITY);
            let corners = part.triangles()[to.triangle as usize];
            let end = part.point(to);
            let reach =
                |&v: &u32| distances[v as usize] + part.positions()[v as usize].distance(end);
            let around = corners.iter().map(reach).fold(f64::INFINITY, f64::min);
            let within = part.interpolate(&distances, to);
            let straight = part.point(from).distance(end);
            // Within one triangle the straight line is the way.
            let over = if from.triangle == to.triangle {
                straight
            } else {
                within.min(around).max(straight)
            };
            Ok(Finished::Measured(over))
        });
    }

    pub(super) fn measured(&mut self, key: &str, over: f64) {
        if key == self.view.measure.asked.to_string() {
            self.view.measure.over_surface = Some(over);
        }
    }

    pub(super) fn paint_measure(&self, painter: &Painter, pane: Pane) {
        if self.view.tool != super::Tool::Measure {
            return;
        }
        let part = &self.document.part;
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
        let text = match measure.over_surface {
            None => format!("{straight}, … over the surface"),
            Some(d) if d.is_infinite() => format!("{straight}, no way over the surface"),
            Some(d) => format!("{straight}, {:.2} mm over the surface", d * 1000.0),
        };
        let middle = a.lerp(b, 0.5) - egui::vec2(0.0, 12.0);
        label(painter, middle, Align2::CENTER_BOTTOM, &text, ink);
    }
}

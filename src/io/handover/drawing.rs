//! Pictures of the limb on paper.

use glam::{DMat3, DVec2, DVec3};

use super::marks::small;
use super::source::HandoverSource;
use crate::io::report::{feasible_tint, markers};
use crate::io::svg::{Paint, ViewSide, bounds, from_behind, standard_views};
use crate::mesh::flatten::Flat;
use crate::mesh::stretch::KEPT;
use crate::paper::{Align, Flow, Sheet, SheetLine};

/// Of a picture of a side (mm).
const HEIGHT: f64 = 88.0;

/// The limb from four sides, and unrolled as seen from outside.
pub(super) fn all(flow: &mut Flow, source: &HandoverSource<'_>) {
    /// Between two pictures (mm).
    const GAP: f64 = 4.0;
    flow.need(2.0 * HEIGHT);
    flow.heading("Where the gauges go");
    flow.text("Green: feasible for a gauge. Each bar shows a gauge's direction; hollow ones are on the far wall. All are glued to the inside.");
    let tint = feasible_tint(source.design);
    let width = (flow.width() - GAP) / 2.0;
    let views = standard_views(source.inner.stance);
    for pair in views.chunks(2) {
        let (sheet, corner) = flow.room(HEIGHT + 7.0);
        for (k, view) in pair.iter().enumerate() {
            let corner = corner + DVec2::new(k as f64 * (width + GAP), 0.0);
            side(
                sheet,
                source,
                &tint,
                view,
                corner,
                DVec2::new(width, HEIGHT),
            );
            let below = corner + DVec2::new(width / 2.0, HEIGHT + 4.0);
            sheet.say(below, view.name, 3.0, Align::Middle);
        }
    }
    unrolled(flow, source, &tint);
}

/// A box that a picture is fitted into: its corner (mm) and its scale (mm a metre); up is up.
struct PictureFit {
    corner: DVec2,
    lower: DVec2,
    height: f64,
    scale: f64,
}

impl PictureFit {
    fn new(lower: DVec2, upper: DVec2, corner: DVec2, room: DVec2) -> Self {
        let size = (upper - lower).max(DVec2::splat(1e-9));
        let scale = (room / size).min_element();
        let spare = room - size * scale;
        Self {
            corner: corner + spare / 2.0,
            lower,
            height: size.y * scale,
            scale,
        }
    }

    fn place(&self, p: DVec2) -> DVec2 {
        let q = (p - self.lower) * self.scale;
        self.corner + DVec2::new(q.x, self.height - q.y)
    }
}

fn side(
    sheet: &mut Sheet,
    source: &HandoverSource<'_>,
    tint: &[f64],
    view: &ViewSide,
    corner: DVec2,
    room: DVec2,
) {
    let mesh = &source.design.simulated.mesh;
    let right = view.up.cross(view.toward).normalize();
    let frame = DMat3::from_cols(right, view.toward.cross(right), view.toward).transpose();
    let seen: Vec<DVec3> = mesh.positions().iter().map(|&p| frame * p).collect();
    let (lower, upper) = bounds(seen.iter().map(|p| p.truncate()));
    let fit = PictureFit::new(lower, upper, corner, room);
    for t in from_behind(mesh.triangles(), &seen) {
        let tri = mesh.triangles()[t];
        let facing = mesh.facet_normal(t as u32).dot(view.toward);
        let corners = tri.map(|v| fit.place(seen[v as usize].truncate()));
        facet(sheet, corners, Paint::Tint(tint).ink(tri, facing));
    }
    for marker in markers(source.inputs, source.design) {
        let at = fit.place((frame * marker.gauge.position).truncate());
        let along = (frame * marker.gauge.direction).truncate();
        let near = marker.gauge.normal.dot(view.toward) > 0.0;
        small(
            sheet,
            at,
            DVec2::new(along.x, -along.y),
            marker.number,
            near,
        );
    }
}

/// A hairline of the same colour closes what would shine through between facets.
fn facet(sheet: &mut Sheet, corners: [DVec2; 3], ink: [u8; 3]) {
    sheet.shape(corners, Some(ink), Some(SheetLine::new(ink, 0.05)));
}

fn unrolled(flow: &mut Flow, source: &HandoverSource<'_>, tint: &[f64]) {
    let mesh = &source.design.simulated.mesh;
    let flat = Flat::of(mesh, source.inner.stance);
    let size = flat.upper - flat.lower;
    let width = flow.width();
    let height = (width * size.y / size.x.max(1e-9)).min(150.0);
    let words = format!(
        "Unrolled, seen from outside. {}.",
        flat.stretch.words().replace("Hatched", "Shaded")
    );
    let (sheet, corner) = flow.room(height + 3.0);
    let fit = PictureFit::new(flat.lower, flat.upper, corner, DVec2::new(width, height));
    for t in from_behind(&flat.triangles, &flat.positions) {
        let tri = flat.triangles[t];
        let corners = tri.map(|v| fit.place(flat.positions[v as usize].truncate()));
        let of_part = tri.map(|v| flat.vertices[v as usize]);
        let ink = Paint::Tint(tint).ink(of_part, 0.85);
        let shaded = flat.stretch.facets[t] > KEPT;
        let ink = if shaded { ink.map(|c| c - c / 4) } else { ink };
        facet(sheet, corners, ink);
    }
    for marker in markers(source.inputs, source.design) {
        let at = fit.place(flat.place(marker.gauge.position));
        let along = flat
            .turn(marker.gauge.position, marker.gauge.direction)
            .normalize_or_zero();
        small(
            sheet,
            at,
            DVec2::new(along.x, -along.y),
            marker.number,
            true,
        );
    }
    flow.note(&format!(
        "{words} {:.0} mm across, {:.0} mm up.",
        size.x * 1e3,
        size.y * 1e3
    ));
}

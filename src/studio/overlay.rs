//! What is drawn over the limb: the touch, the gauges, the brush, the legend and hints.

use std::sync::Arc;

use eframe::egui_wgpu;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};
use glam::{DVec3, Mat4};

use super::paint::{Look, label, plate};
use super::view::{Field, Gesture, Pane, Tool};
use super::{labels, theme};
use crate::colormap::ColorMap;
use crate::document::Layer;
use crate::mesh::stretch::KEPT;
use crate::project::ChosenSite;
use crate::render::gpu::{Frame3d, Slot, Uniforms};

/// How much a wall covers what is behind it when it can be seen through.
const GHOST: f32 = 0.22;
/// What stands for the stripes of blind places in a key.
const BLIND_KEY: Color32 = Color32::from_gray(150);
/// Of a gauge's number (points).
const MARK: f32 = 9.0;

pub fn paint_limb(look: Look<'_>, ui: &Ui, rect: Rect, transparent: bool) {
    let Some(built) = &look.scene.built else {
        return;
    };
    let camera = &look.view.camera;
    let eye = camera.toward_eye().as_vec3();
    let target = camera.target.as_vec3();
    let section = look.view.section.map_or([0.0, 0.0, 0.0, -1.0], |section| {
        let (n, d) = section.plane();
        let w = (n.dot(camera.target) - d) / camera.distance;
        [n.x as f32, n.y as f32, n.z as f32, w as f32]
    });
    let uniforms = Uniforms {
        matrix: camera.matrix(rect.aspect_ratio()).to_cols_array_2d(),
        eye: [eye.x, eye.y, eye.z, 0.0],
        target_scale: [target.x, target.y, target.z, (1.0 / camera.distance) as f32],
        deform: deform_flags(look, look.exaggeration().unwrap_or(0.0) as f32),
        section,
        look: cover(look, if look.view.see_through { GHOST } else { 1.0 }),
        up: camera.stance.up().as_vec3().extend(0.0).to_array(),
    };
    let back = if transparent {
        Color32::TRANSPARENT
    } else {
        theme::backdrop(ui.ctx().theme())
    };
    let frame = Frame3d {
        slot: Slot::Limb,
        solid: Arc::clone(&look.scene.solid),
        shown: Arc::clone(&built.shown),
        map: built.legend.as_ref().map_or(ColorMap::Viridis, |l| l.map),
        uniforms,
        background: back.to_array().map(|c| f64::from(c) / 255.0),
        size: pixels(ui, rect),
    };
    ui.painter()
        .add(egui_wgpu::Callback::new_paint_callback(rect, frame));
}

/// Exaggeration, and whether a field or the regions colour the limb.
fn deform_flags(look: Look<'_>, exaggeration: f32) -> [f32; 4] {
    let flag = |on: bool| f32::from(u8::from(on));
    let field = look
        .scene
        .built
        .as_ref()
        .is_some_and(|b| b.legend.is_some());
    let region = look.view.field == Field::Region;
    [exaggeration, flag(field), flag(region), 0.0]
}

/// How much walls cover what is behind them, and whether blind places are marked.
fn cover(look: Look<'_>, share: f32) -> [f32; 4] {
    let marked = look.view.field == Field::Expected && look.scene.shows_field();
    [share, f32::from(u8::from(marked)), 0.0, 0.0]
}

pub fn paint_unrolled(look: Look<'_>, ui: &Ui, rect: Rect) {
    let Some((built, flat)) =
        (look.scene.built.as_ref()).and_then(|built| Some((built, built.flat.as_ref()?)))
    else {
        return;
    };
    let (middle, per_point) = look.view.flat;
    // Half the view is high as one unit; outer walls lie nearer to the eye.
    let unit = (per_point * f64::from(rect.height()) / 2.0).max(f64::MIN_POSITIVE);
    let depth =
        0.25 * unit / (look.scene.unrolled.flat.upper - look.scene.unrolled.flat.lower).length();
    let matrix = Mat4::from_cols_array_2d(&[
        [1.0 / rect.aspect_ratio(), 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, -depth as f32, 0.0],
        [0.0, 0.0, 0.5, 1.0],
    ]);
    let uniforms = Uniforms {
        matrix: matrix.to_cols_array_2d(),
        // So far above that it looks straight down everywhere.
        eye: [0.0, 0.0, 1e4, 0.0],
        target_scale: [middle.x as f32, middle.y as f32, 0.0, (1.0 / unit) as f32],
        deform: deform_flags(look, 0.0),
        section: [0.0, 0.0, 0.0, -1.0],
        look: cover(look, 1.0),
        up: [0.0, 0.0, 1.0, KEPT as f32],
    };
    let back = theme::backdrop(ui.ctx().theme());
    let frame = Frame3d {
        slot: Slot::Unrolled,
        solid: Arc::clone(&look.scene.unrolled.solid),
        shown: Arc::clone(&flat.shown),
        map: built.legend.as_ref().map_or(ColorMap::Viridis, |l| l.map),
        uniforms,
        background: back.to_array().map(|c| f64::from(c) / 255.0),
        size: pixels(ui, rect),
    };
    ui.painter()
        .add(egui_wgpu::Callback::new_paint_callback(rect, frame));
}

/// Under the unrolled view: what became of lengths there.
pub fn paint_stretch(look: Look<'_>, painter: &Painter, rect: Rect) {
    let words = look.scene.unrolled.flat.stretch.words();
    let room = rect.width() - 40.0;
    let font = FontId::proportional(12.5);
    let galley = painter.layout(words, font, Color32::WHITE, room.max(80.0));
    let at = rect.center_bottom() - vec2(0.0, 14.0);
    plate(painter, at, Align2::CENTER_BOTTOM, galley);
}

pub fn paint_touch(look: Look<'_>, painter: &Painter, pane: Pane) {
    let shown = look.view.tool == Tool::Touch;
    let Some(touched) = look.session.caches.touching.result().filter(|_| shown) else {
        return;
    };
    let touch = touched.touch;
    let text = format!("{} N · {:.2} mm", touch.force, touched.largest * 1000.0);
    let Some(tip) = look.place_in(pane, touch.position) else {
        return;
    };
    if pane == Pane::Unrolled {
        painter.circle(tip, 6.0, theme::TOUCHED, Stroke::new(1.5, Color32::WHITE));
        return;
    }
    let length = 0.16 * look.view.camera.distance;
    if let Some(tail) = look.view.place(touch.position + touch.normal * length) {
        painter.arrow(tail, tip - tail, Stroke::new(3.0, theme::TOUCHED));
        label(painter, tail, Align2::CENTER_BOTTOM, &text, theme::TOUCHED);
    }
}

/// How far a point of the limb is drawn from where it is at rest.
fn shift_at(look: Look<'_>, position: DVec3) -> DVec3 {
    let deformation = look.exaggeration().unwrap_or(0.0);
    let Some(touched) = look
        .session
        .caches
        .touching
        .result()
        .filter(|_| deformation > 0.0)
    else {
        return DVec3::ZERO;
    };
    let (at, _) = look.scene.index.nearest(position);
    let corners = look.session.document.part.triangles()[at.triangle as usize];
    let moved = |(v, w): (u32, f64)| touched.displacement[v as usize] * w;
    let shift: DVec3 = corners.into_iter().zip(at.barycentric).map(moved).sum();
    shift * deformation
}

pub fn paint_gauges(look: Look<'_>, painter: &Painter, pane: Pane) {
    let sites = look.session.gauges();
    let rect = look.view.rect_of(pane);
    let marks: Vec<Mark> = (0..)
        .zip(&sites)
        .filter_map(|(number, site)| mark(look, pane, number, site))
        .filter(|mark| rect.expand(20.0).contains(mark.at))
        .collect();
    let anchors: Vec<Pos2> = marks.iter().map(|m| m.at).collect();
    for (mark, place) in marks.iter().zip(labels::spread(&anchors, MARK + 0.5)) {
        mark.paint(painter, place);
    }
}

/// How a gauge is drawn in a view.
fn mark(look: Look<'_>, pane: Pane, number: usize, site: &ChosenSite) -> Option<Mark> {
    let position = DVec3::from_array(site.position_mm) / 1000.0;
    let direction = DVec3::from_array(site.direction);
    let half = look.project().gauge.grid_length_mm * 0.5e-3;
    let (ends, at, near) = match pane {
        Pane::Unrolled => {
            let at = look.scene.flat_place(look.view, position)?;
            let turned = look.scene.unrolled.flat.turn(position, direction);
            let along = (turned * half / look.view.flat.1).as_vec2();
            let along = vec2(along.x, -along.y);
            ([at - along, at + along], at, true)
        }
        Pane::Limb => {
            if look.view.is_cut(position) {
                return None;
            }
            let (on, _) = look.scene.index.nearest(position);
            let normal = look.session.document.part.normal(on);
            let centre = position + shift_at(look, position);
            let ends = [-half, half].map(|h| look.view.place(centre + direction * h));
            let [Some(a), Some(b)] = ends else {
                return None;
            };
            let near = normal.dot(look.view.camera.toward_eye()) > 0.0;
            ([a, b], look.view.place(centre)?, near)
        }
    };
    Some(Mark {
        number: number + 1,
        ends,
        at,
        near,
        picked: look.view.picked.contains(&number),
        pinned: look.session.pin_of(number).is_some(),
    })
}

pub fn paint_brush(look: Look<'_>, painter: &Painter, pane: Pane) {
    let Some(at) = look.view.hover else {
        return;
    };
    let centre = look.session.document.part.point(at);
    if !look.view.tool.is_brush() {
        // What is pointed at in one view shows in the other.
        let other = !look
            .view
            .rect_of(pane)
            .contains(painter.ctx().pointer_latest_pos().unwrap_or_default());
        if let Some(at) = look.place_in(pane, centre).filter(|_| other) {
            painter.circle_stroke(at, 5.0, Stroke::new(1.5, Color32::WHITE));
        }
        return;
    }
    let mut centres = vec![centre];
    if let Some(image) = look.scene.image(look.view, centre) {
        let (image, _) = look.scene.index.nearest(image);
        centres.push(look.session.document.part.point(image));
    }
    let colour = if look.view.tool == Tool::Paint {
        Color32::WHITE
    } else {
        theme::ERROR
    };
    for (k, centre) in centres.into_iter().enumerate() {
        let ring = ring(look, pane, centre);
        let alpha = if k == 0 { 1.0 } else { 0.5 };
        painter.line(ring, Stroke::new(1.5, colour.gamma_multiply(alpha)));
    }
}

/// The brush around a point of the part, as a line in a view.
fn ring(look: Look<'_>, pane: Pane, centre: DVec3) -> Vec<Pos2> {
    let (at, _) = look.scene.index.nearest(centre);
    let normal = look.session.document.part.normal(at);
    let frame = crate::elasticity::observe::tangent_frame(normal);
    let around = (0..=48).map(|k| {
        let a = f64::from(k) / 48.0 * std::f64::consts::TAU;
        (frame.x_axis * a.cos() + frame.y_axis * a.sin()) * look.view.brush
    });
    match pane {
        Pane::Limb => around
            .filter_map(|off| look.view.place(centre + off))
            .collect(),
        Pane::Unrolled => {
            let Some(middle) = look.scene.flat_place(look.view, centre) else {
                return Vec::new();
            };
            let per_point = look.view.flat.1;
            let turn = |off| {
                let flat = look.scene.unrolled.flat.turn(centre, off) / per_point;
                middle + vec2(flat.x as f32, -flat.y as f32)
            };
            around.map(turn).collect()
        }
    }
}

/// What a box or lasso has gone around so far.
pub fn paint_outline(look: Look<'_>, painter: &Painter, pane: Pane) {
    let Gesture::Outline(own, outline) = &look.view.gesture else {
        return;
    };
    if *own != pane {
        return;
    }
    let stroke = Stroke::new(1.5, Color32::WHITE);
    if let (Tool::Box, [a, b]) = (look.view.tool, &outline[..]) {
        let rect = Rect::from_two_pos(*a, *b);
        painter.rect_filled(rect, 0.0, Color32::from_white_alpha(18));
        painter.rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Middle);
    } else {
        let closed = outline.iter().chain(outline.first()).copied();
        painter.line(closed.collect(), stroke);
    }
}

pub fn paint_legend(look: Look<'_>, painter: &Painter, rect: Rect) {
    let mut bottom = rect.bottom() - 16.0;
    if let Some(scale) = look.exaggeration() {
        let text = format!("Deformation × {scale}");
        label(
            painter,
            pos2(rect.right() - 16.0, bottom),
            Align2::RIGHT_BOTTOM,
            &text,
            Color32::WHITE,
        );
        bottom -= 26.0;
    }
    let Some(legend) = look.scene.built.as_ref().and_then(|b| b.legend.clone()) else {
        return;
    };
    if look.view.field == Field::Faces {
        return; // they have a key of their own
    }
    let bar = Rect::from_min_max(
        pos2(rect.right() - 34.0, bottom - 210.0),
        pos2(rect.right() - 16.0, bottom),
    );
    let font = FontId::proportional(11.5);
    let title = painter.layout_no_wrap(legend.title.clone(), font, Color32::WHITE);
    let left = (bar.left() - 86.0).min(bar.right() - title.size().x - 8.0);
    let board = Rect::from_min_max(pos2(left, bar.top() - 30.0), bar.max + vec2(8.0, 8.0));
    painter.rect_filled(board, 6.0, Color32::from_black_alpha(150));
    let strips = 64;
    for k in 0..strips {
        let t = f64::from(k) / f64::from(strips);
        let [r, g, b] = legend
            .map
            .at(t + 0.5 / f64::from(strips))
            .map(|c| (c * 255.0) as u8);
        let y = bar.bottom() - bar.height() * t as f32;
        let strip = Rect::from_min_max(
            pos2(bar.left(), y - bar.height() / strips as f32 - 0.5),
            pos2(bar.right(), y),
        );
        painter.rect_filled(strip, 0.0, Color32::from_rgb(r, g, b));
    }
    for k in 0..=4 {
        let t = f64::from(k) / 4.0;
        let y = bar.bottom() - bar.height() * t as f32;
        let text = tidy(legend.low + (legend.high - legend.low) * t);
        painter.text(
            pos2(bar.left() - 6.0, y),
            Align2::RIGHT_CENTER,
            text,
            FontId::proportional(11.5),
            Color32::WHITE,
        );
    }
    let corner = board.right_top() + vec2(-8.0 - title.size().x, 6.0);
    painter.galley(corner, title, Color32::WHITE);
}

pub fn paint_hint(look: Look<'_>, painter: &Painter, rect: Rect) {
    let text = match look.view.tool {
        _ if look.session.caches.touching.is_waiting() => "Computing the touch …",
        Tool::Paint => {
            "Drag over the limb: paint   ·   Ctrl: erase   ·   [ ]: radius   ·   right-drag: look around"
        }
        Tool::Erase => {
            "Drag over the limb: erase   ·   Ctrl: paint   ·   [ ]: radius   ·   right-drag: look around"
        }
        Tool::Box | Tool::Lasso => {
            "Drag around what is to be painted   ·   Ctrl: erase   ·   walls behind only when see-through"
        }
        Tool::Gauges => {
            "Click a gauge to pick it, drag it to another place   ·   Shift: pick several   ·   right-drag: look around"
        }
        Tool::Measure => "Click two points of the limb",
        Tool::Touch => field_hint(look),
    };
    // Beside what the other corner says.
    let corner = if look.exaggeration().is_some() {
        150.0
    } else {
        28.0
    };
    let room = (rect.width() - corner).max(60.0);
    let ink = Color32::from_gray(215);
    let galley = painter.layout(text.to_owned(), FontId::proportional(12.5), ink, room);
    plate(
        painter,
        rect.left_bottom() + vec2(14.0, -14.0),
        Align2::LEFT_BOTTOM,
        galley,
    );
}

/// What the colours of the regions mean, of those that are there.
pub fn paint_region_key(look: Look<'_>, painter: &Painter, rect: Rect) {
    if look.view.field == Field::Faces && look.scene.shows_field() {
        return face_key(painter, rect);
    }
    if look.view.field == Field::Expected && look.scene.shows_field() {
        let force = look.project().touch.force_n;
        let blind = format!("Blind at {force} N");
        return colour_key(painter, rect, std::iter::once((&*blind, BLIND_KEY)));
    }
    if look.view.field != Field::Region {
        return;
    }
    let verdicts = look.session.results.feasibility.is_some()
        || look.session.document.layer(Layer::Feasible).is_some();
    let rows = [
        (verdicts, "Gauges may go", Color32::from_rgb(107, 191, 173)),
        (
            look.session.document.layer(Layer::KeepOut).is_some(),
            "Keep out",
            Color32::from_rgb(219, 115, 92),
        ),
        (
            !look.project().supports.is_empty(),
            "Held",
            Color32::from_rgb(219, 189, 87),
        ),
        (
            look.session.document.layer(Layer::Touch).is_some(),
            "Touches come",
            Color32::from_rgb(128, 153, 230),
        ),
    ];
    let there = rows.into_iter().filter(|r| r.0);
    colour_key(painter, rect, there.map(|(_, name, colour)| (name, colour)));
}

/// What is missing before a field can be seen, or how to look around.
fn field_hint(look: Look<'_>) -> &'static str {
    match look.view.field {
        Field::Strain | Field::Displacement if look.session.caches.touching.result().is_none() => {
            "Click on the limb to press it and see this field"
        }
        Field::SignalToNoise if look.session.results.simulation.is_none() => {
            "Press “Simulate” to see the signal at each site"
        }
        Field::Error if look.session.results.design.is_none() => {
            "Press “Select gauges” to see where touches are found well and where not"
        }
        Field::Expected if look.session.simulation_holds() != Some(true) => {
            "Press “Simulate” to see where touches are expected to be found well and where not"
        }
        Field::Expected
            if look
                .session
                .document
                .state
                .project
                .selection
                .sites
                .is_empty() =>
        {
            "Put gauges to see what is expected of them: tool “Gauges”, Ctrl-click"
        }
        Field::Expected if look.expected().is_some() => {
            "Point at the limb: what a touch there is taken for   ·   drag gauges with the tool “Gauges”"
        }
        Field::Expected => "Preparing the expected error …",
        Field::Uncertainty if look.session.results.design.is_none() => {
            "Press “Select gauges” to see what the gauges leave uncertain"
        }
        Field::Faces | Field::Thickness if look.session.caches.walls.is_some() => {
            if look
                .scene
                .built
                .as_ref()
                .is_some_and(|b| b.legend.is_some())
            {
                "Paint the layer “Inside face” or “Outside face” where this is wrong"
            } else {
                "The part encloses nothing: it has no inside of its own"
            }
        }
        Field::Faces | Field::Thickness => "Measuring the walls …",
        Field::Error | Field::Uncertainty
            if look.scene.built.as_ref().is_none_or(|b| b.legend.is_none()) =>
        {
            "Computing the field …"
        }
        _ => {
            "Click: press the limb   ·   drag: look around   ·   Shift-drag: shift   ·   wheel: zoom"
        }
    }
}

/// What the colours of the faces of a solid mean.
fn face_key(painter: &Painter, rect: Rect) {
    let colour = |side: f64| {
        let t = f64::midpoint(side / super::fields::FACE_RANGE, 1.0);
        let [r, g, b] = ColorMap::BlueOrange.at(t).map(|c| (c * 255.0) as u8);
        Color32::from_rgb(r, g, b)
    };
    let rows = [
        ("Outside: touches land", colour(-1.0)),
        ("Inside: gauges go", colour(1.0)),
        ("Ends of walls", colour(0.0)),
    ];
    colour_key(painter, rect, rows.into_iter());
}

/// Names with squares of their colours, in the upper right corner.
fn colour_key<'n>(painter: &Painter, rect: Rect, rows: impl Iterator<Item = (&'n str, Color32)>) {
    let mut at = rect.right_top() + vec2(-16.0, 12.0);
    for (name, colour) in rows {
        let font = FontId::proportional(11.5);
        let galley = painter.layout_no_wrap(name.to_owned(), font, Color32::WHITE);
        let height = galley.size().y;
        let board = plate(painter, at, Align2::RIGHT_TOP, galley);
        let middle = pos2(board.left() - 10.0, board.center().y);
        let square = Rect::from_center_size(middle, vec2(11.0, 11.0));
        painter.rect_filled(square, 2.0, colour);
        at.y += height + 10.0;
    }
}

/// The size of a view in pixels.
fn pixels(ui: &Ui, rect: Rect) -> [u32; 2] {
    let size = rect.size() * ui.pixels_per_point();
    [size.x, size.y].map(|s| s.round().max(1.0) as u32)
}

/// A gauge as it is drawn: a bar along its direction with its number; hollow on the far wall.
struct Mark {
    number: usize,
    ends: [Pos2; 2],
    at: Pos2,
    near: bool,
    picked: bool,
    pinned: bool,
}

impl Mark {
    /// With its number at `place`, and a line to it where that is elsewhere.
    fn paint(&self, painter: &Painter, place: Pos2) {
        let [a, b] = self.ends;
        let along = (b - a).normalized();
        let half = ((b - a).length() / 2.0).max(12.0);
        let alpha = if self.near { 1.0 } else { 0.55 };
        let colour = theme::CHOSEN.gamma_multiply(alpha);
        painter.line_segment(
            [self.at - along * half, self.at + along * half],
            Stroke::new(4.0, colour),
        );
        if place != self.at {
            painter.line_segment([self.at, place], Stroke::new(1.0, colour));
            painter.circle_filled(self.at, 2.5, colour);
        }
        if self.picked {
            painter.circle_stroke(place, MARK + 3.5, Stroke::new(2.0, Color32::WHITE));
        }
        if self.near {
            painter.circle_filled(place, MARK, colour);
        } else {
            let fill = Color32::from_rgb(40, 44, 50);
            painter.circle(place, MARK, fill, Stroke::new(1.5, colour));
        }
        if self.pinned {
            painter.circle_filled(place + vec2(7.0, -7.0), 3.5, Color32::WHITE);
        }
        let ink = if self.near { Color32::WHITE } else { colour };
        painter.text(
            place,
            Align2::CENTER_CENTER,
            self.number,
            FontId::proportional(11.0),
            ink,
        );
    }
}

fn tidy(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".into()
    } else if (0.01..1e5).contains(&size) {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.1e}")
    }
}

//! What is drawn over the limb: the touch, the gauges, the brush and outlines.

use std::sync::Arc;

use egui::{Align2, Color32, FontId, Id, Painter, Pos2, Rect, Shape, Stroke, Ui, Vec2, vec2};
use glam::{DVec3, Mat4};

use super::paint::{LimbLook, label};
use super::view::{Backdrop, Field, Floor, Gesture, Pane, Tool};
use super::{labels, theme};
use crate::colormap::ColorMap;
use crate::mesh::stretch::KEPT;
use crate::project::ChosenSite;
use crate::render::gpu::{Frame3d, PictureSlot, ShadeUniforms, Shading, Uniforms};
use eframe::egui_wgpu;

/// How much a wall covers what is behind it when it can be seen through.
const GHOST: f32 = 0.22;
/// How much an edge of the part covers.
const EDGES: f32 = 0.6;
/// Of a gauge's number (points).
const MARK: f32 = 9.0;

/// How soon the next picture has to come.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum PicturePace {
    /// What is seen moves, or is about to.
    Moving,
    Standing,
    /// It is looked at for long, and closely.
    Kept,
}

impl PicturePace {
    /// How many places around a pixel are looked at for what takes light from it.
    fn taps(self) -> f32 {
        match self {
            Self::Moving | Self::Standing => 10.0,
            Self::Kept => 32.0,
        }
    }
}

/// Whether the camera moves, or a hand is about to move something. Where it was the camera, one more frame is asked for, in
/// which it stands.
pub fn pace(look: LimbLook<'_>, ui: &Ui) -> PicturePace {
    let camera = &look.view.camera;
    let camera = (
        camera.matrix(1.0).to_cols_array(),
        camera.target.to_array(),
        camera.distance,
    );
    let before = ui.data_mut(|d| {
        let kept: &mut Option<([f32; 16], [f64; 3], f64)> =
            d.get_temp_mut_or_default(Id::unique("camera before"));
        kept.replace(camera)
    });
    let moves = before != Some(camera);
    if moves {
        ui.ctx().request_repaint();
    }
    if moves || ui.input(|i| i.pointer.any_down()) {
        PicturePace::Moving
    } else {
        PicturePace::Standing
    }
}

/// The limb itself, as the adapter draws it.
pub fn paint_limb(look: LimbLook<'_>, ui: &Ui, rect: Rect, backdrop: Backdrop, pace: PicturePace) {
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
    let back = theme::backdrop(backdrop, ui.ctx().theme());
    let frame = Frame3d {
        slot: PictureSlot::Limb,
        solid: Arc::clone(&look.scene.solid),
        shown: Arc::clone(&built.shown),
        map: built.legend.as_ref().map_or(ColorMap::Viridis, |l| l.map),
        uniforms,
        shading: shading(look, pixels(ui, rect), back, pace.taps()),
        hurried: pace == PicturePace::Moving,
        background: back.to_array().map(|c| f64::from(c) / 255.0),
        size: pixels(ui, rect),
    };
    ui.painter()
        .add(egui_wgpu::Callback::new_paint_callback(rect, frame));
}

/// How light falls: less of it into corners, and a shadow on the floor.
fn shading(look: LimbLook<'_>, [width, height]: [u32; 2], back: Color32, taps: f32) -> Shading {
    /// How far off walls take light, over the part's size.
    const REACH: f64 = 0.07;
    /// Of the picture's height: so far is looked over at most, however near the limb is.
    const WIDEST: f32 = 0.1;
    /// Of white.
    const FLOOR_LIGHT: f32 = 0.1;
    let (camera, floor) = (&look.view.camera, &look.scene.floor);
    let aspect = width as f32 / height as f32;
    let relative = |v: DVec3| (v / camera.distance).as_vec3();
    let (lower, upper) = look.session.document.part.bounds();
    let reach = REACH * (upper - lower).length() / camera.distance;
    // Where walls can be seen through, corners are of those behind.
    let ambient = f32::from(u8::from(!look.view.see_through));
    let dark = f32::from(u8::from(look.view.floor == Floor::Shadow));
    // On a dark floor no shadow is seen.
    let is_dark = back.is_opaque() && back.intensity() < 0.3;
    let light = if is_dark { FLOOR_LIGHT } else { 0.0 };
    let along = |axis: DVec3| axis.as_vec3() * (camera.distance / floor.half) as f32;
    Shading {
        uniforms: ShadeUniforms {
            inverse: camera.matrix(aspect).inverse().to_cols_array_2d(),
            eye: camera
                .toward_eye()
                .as_vec3()
                .extend(camera.scale(height))
                .to_array(),
            ambient: [reach as f32, ambient, light, WIDEST * height as f32],
            background: back.to_array().map(|c| f32::from(c) / 255.0),
            floor_middle: relative(floor.middle - camera.target)
                .extend(dark)
                .to_array(),
            floor_right: along(floor.stance.right()).extend(0.0).to_array(),
            floor_front: along(floor.stance.front()).extend(taps).to_array(),
            up: floor.stance.up().as_vec3().extend(0.0).to_array(),
        },
        floor: Arc::clone(floor),
    }
}

/// A flat picture has neither corners nor a floor.
fn unshaded(look: LimbLook<'_>) -> Shading {
    Shading {
        uniforms: bytemuck::Zeroable::zeroed(),
        floor: Arc::clone(&look.scene.floor),
    }
}

/// Exaggeration, and whether a field or the regions colour the limb.
fn deform_flags(look: LimbLook<'_>, exaggeration: f32) -> [f32; 4] {
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
fn cover(look: LimbLook<'_>, share: f32) -> [f32; 4] {
    let marked = look.view.field == Field::Expected && look.scene.shows_field();
    [share, f32::from(u8::from(marked)), EDGES, 0.0]
}

/// The same laid flat.
pub fn paint_unrolled(look: LimbLook<'_>, ui: &Ui, rect: Rect) {
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
    let back = theme::backdrop(Backdrop::Window, ui.ctx().theme());
    let frame = Frame3d {
        slot: PictureSlot::Unrolled,
        solid: Arc::clone(&look.scene.unrolled.solid),
        shown: Arc::clone(&flat.shown),
        map: built.legend.as_ref().map_or(ColorMap::Viridis, |l| l.map),
        uniforms,
        shading: unshaded(look),
        hurried: false,
        background: back.to_array().map(|c| f64::from(c) / 255.0),
        size: pixels(ui, rect),
    };
    ui.painter()
        .add(egui_wgpu::Callback::new_paint_callback(rect, frame));
}

/// The touch, as an arrow.
pub fn paint_touch(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
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
fn shift_at(look: LimbLook<'_>, position: DVec3) -> DVec3 {
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

/// The gauges with their numbers.
pub fn paint_gauges(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    let sites = look.session.gauges();
    let rect = look.view.rect_of(pane);
    let marks: Vec<Mark> = (0..)
        .zip(&sites)
        .filter_map(|(number, site)| mark(look, pane, number, site))
        .filter(|mark| rect.expand(20.0).contains(mark.at))
        .collect();
    let anchors: Vec<Pos2> = marks.iter().map(|m| m.at).collect();
    for (mark, place) in marks.iter().zip(labels::places_apart(&anchors, MARK + 0.5)) {
        mark.paint(painter, place);
    }
}

/// How a gauge is drawn in a view.
fn mark(look: LimbLook<'_>, pane: Pane, number: usize, site: &ChosenSite) -> Option<Mark> {
    let position = DVec3::from_array(site.position_mm) / 1000.0;
    let direction = DVec3::from_array(site.direction);
    let half = look.project().gauge.grid_length_mm * 0.5e-3;
    let side = look.project().gauge.grid_width_mm * 0.5e-3;
    let (ends, across, at, near) = match pane {
        Pane::Unrolled => {
            let at = look.scene.flat_place(look.view, position)?;
            let turned = look.scene.unrolled.flat.turn(position, direction);
            let along = (turned * half / look.view.flat.1).as_vec2();
            let along = vec2(along.x, -along.y);
            let across = along.rot90() * (side / half) as f32;
            ([at - along, at + along], across, at, true)
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
            let at = look.view.place(centre)?;
            let beside = look.view.place(centre + normal.cross(direction) * side)?;
            ([a, b], beside - at, at, near)
        }
    };
    Some(Mark {
        number: number + 1,
        ends,
        across,
        at,
        near,
        picked: look.view.picked.contains(&number),
        pinned: look.session.pin_of(number).is_some(),
    })
}

/// What the brush would reach.
pub fn paint_brush(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
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
fn ring(look: LimbLook<'_>, pane: Pane, centre: DVec3) -> Vec<Pos2> {
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
pub fn paint_outline(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
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

/// The size of a view in pixels.
fn pixels(ui: &Ui, rect: Rect) -> [u32; 2] {
    let size = rect.size() * ui.pixels_per_point();
    [size.x, size.y].map(|s| s.round().max(1.0) as u32)
}

/// A gauge as it is drawn: its grid's outline and a bar along its direction, with its number; hollow on the far wall.
struct Mark {
    number: usize,
    ends: [Pos2; 2],
    /// To a side of the grid.
    across: Vec2,
    at: Pos2,
    near: bool,
    picked: bool,
    pinned: bool,
}

impl Mark {
    /// The grid as large as it is, where that is more than the bar.
    fn paint_grid(&self, painter: &Painter, colour: Color32) {
        /// Half of its width (points).
        const WIDER: f32 = 4.0;
        let ([a, b], across) = (self.ends, self.across);
        if across.length() < WIDER {
            return;
        }
        let corners = vec![a - across, b - across, b + across, a + across];
        let fill = colour.gamma_multiply(0.35);
        let edge = Stroke::new(1.5, colour);
        painter.add(Shape::convex_polygon(corners, fill, edge));
    }

    /// With its number at `place`, and a line to it where that is elsewhere.
    fn paint(&self, painter: &Painter, place: Pos2) {
        let [a, b] = self.ends;
        let along = (b - a).normalized();
        let half = ((b - a).length() / 2.0).max(12.0);
        let alpha = if self.near { 1.0 } else { 0.55 };
        let colour = theme::CHOSEN.gamma_multiply(alpha);
        self.paint_grid(painter, colour);
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

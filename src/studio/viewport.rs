//! The views: the limb in space and, beside it, laid flat; what is where in them.

use std::sync::Arc;

use egui::{Pos2, Rect, Role, Sense, Ui, Vec2, WidgetInfo, vec2};
use glam::{DVec2, DVec3};

use super::Studio;
use super::fields::{Built, Field, Ranges};
use super::measure::Measure;
use super::tools::{Gesture, Tool};
use crate::document::{Document, Layer};
use crate::mesh::SurfacePoint;
use crate::mesh::flatten::Flat;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::stance::{Direction, Stance};
use crate::project::PartAxis;
use crate::render::camera::Camera;
use crate::render::gpu::{Solid, Vertex};
use crate::session::Shape;

/// One of the views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pane {
    Limb,
    Unrolled,
}

/// What is cut away so that the inside can be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// The side of the part that is cut away.
    pub side: Direction,
    /// That way, of unit length, and from where on (m).
    pub normal: DVec3,
    pub offset: f64,
    /// Cut away the other side instead.
    pub flip: bool,
}

impl Section {
    /// One half of a part, of which the box around it is given.
    #[must_use]
    pub fn halving(part: &OrientedBox, side: Direction, flip: bool) -> Self {
        Self {
            side,
            normal: part.stance.direction(side),
            offset: part.middle(side),
            flip,
        }
    }

    /// Normal n and d: what has n·p > d is cut away.
    #[must_use]
    pub fn plane(&self) -> (DVec3, f64) {
        let sign = if self.flip { -1.0 } else { 1.0 };
        (self.normal * sign, self.offset * sign)
    }

    #[must_use]
    pub fn cuts(&self, p: DVec3) -> bool {
        let (normal, d) = self.plane();
        normal.dot(p) > d
    }
}

/// The part laid flat, as it is drawn and picked.
pub(super) struct Unrolled {
    pub flat: Arc<Flat>,
    pub solid: Arc<Solid>,
    stance: Stance,
}

impl Unrolled {
    fn of(flat: Arc<Flat>, stance: Stance) -> Self {
        let up = [0.0, 0.0, 1.0];
        let stretch = flat.stretch_at_vertices();
        let vertices = flat.positions.iter().zip(stretch).map(|(p, off)| Vertex {
            position: p.as_vec3().to_array(),
            normal: up,
            stretch: off as f32,
        });
        let solid = Solid {
            vertices: vertices.collect(),
            triangles: flat.triangles.clone(),
        };
        Self {
            solid: Arc::new(solid),
            flat,
            stance,
        }
    }

    fn centre(&self) -> DVec2 {
        (self.flat.lower + self.flat.upper) / 2.0
    }
}

/// State of the views; none of it belongs to the project.
pub struct Viewport {
    pub camera: Camera,
    /// The key that the camera stands by, and the box around the part as it stands so.
    axis: PartAxis,
    pub(super) around: OrientedBox,
    pub tool: Tool,
    pub layer: Layer,
    pub field: Field,
    /// Brush radius (m).
    pub brush: f64,
    /// Strokes are repeated on the other side of the part's middle, across this direction.
    pub mirror: Option<Direction>,
    pub section: Option<Section>,
    pub see_through: bool,
    pub unrolled_shown: bool,
    pub(super) ranges: Ranges,
    pub(super) index: Arc<SurfaceIndex>,
    pub(super) solid: Arc<Solid>,
    pub(super) unrolled: Unrolled,
    /// Middle of the flat view (m) and metres a point of the window.
    flat_view: (DVec2, f64),
    pub(super) built: Option<Built>,
    pub(super) gesture: Gesture,
    /// The point of the part under the pointer, in whichever view.
    pub(super) hover: Option<SurfacePoint>,
    pub(super) measure: Measure,
    /// Where the view was last shown, in points: what a place on it means.
    pub rect: Rect,
    pub flat_rect: Rect,
    /// What lies over the view, as last shown: it is not the limb that is pressed there.
    pub(super) covered: Rect,
}

impl Viewport {
    #[must_use]
    pub fn new(document: &Document, shape: &Shape) -> Self {
        let (lower, upper) = document.part.bounds();
        let axis = document.state.project.part.axis;
        let stance = axis.stance(&document.part);
        let unrolled = Unrolled::of(Arc::clone(&shape.flat), stance);
        Self {
            camera: Camera::framing(lower, upper, stance),
            axis,
            around: OrientedBox::around(&document.part, stance),
            tool: Tool::Touch,
            layer: Layer::Feasible,
            field: Field::Region,
            brush: 6e-3_f64.min((upper - lower).length() / 8.0),
            mirror: None,
            section: None,
            see_through: false,
            unrolled_shown: false,
            ranges: Ranges::default(),
            index: Arc::clone(&shape.index),
            solid: Arc::new(Solid::of(&document.part)),
            flat_view: (unrolled.centre(), 0.0),
            unrolled,
            built: None,
            gesture: Gesture::None,
            hover: None,
            measure: Measure::default(),
            rect: Rect::NOTHING,
            flat_rect: Rect::NOTHING,
            covered: Rect::NOTHING,
        }
    }

    /// Where a stroke at a point of the part (m) is repeated.
    #[must_use]
    pub fn image(&self, p: DVec3) -> Option<DVec3> {
        Some(self.around.mirrored(p, self.mirror?))
    }

    /// Cuts one side of the part away, or nothing any more.
    pub(super) fn toggle_section(&mut self) {
        self.section = match self.section {
            Some(_) => None,
            None => Some(Section::halving(&self.around, Direction::Front, false)),
        };
    }

    pub fn frame(&mut self, document: &Document) {
        let (lower, upper) = document.part.bounds();
        let framed = Camera::framing(lower, upper, self.camera.stance);
        self.camera.target = framed.target;
        self.camera.distance = framed.distance;
        self.flat_view.1 = 0.0;
    }

    /// Comes near to some points (m).
    pub fn frame_points(&mut self, points: &[DVec3], document: &Document) {
        let Some(&first) = points.first() else {
            return;
        };
        let (part_lower, part_upper) = document.part.bounds();
        let around = DVec3::splat(0.08 * (part_upper - part_lower).length());
        let lower = points.iter().fold(first, |l, &p| l.min(p)) - around;
        let upper = points.iter().fold(first, |u, &p| u.max(p)) + around;
        let framed = Camera::framing(lower, upper, self.camera.stance);
        self.camera.target = framed.target;
        self.camera.distance = framed.distance;
        let flat = points.iter().map(|&p| self.unrolled.flat.place(p));
        let sum: DVec2 = flat.sum();
        self.flat_view.0 = sum / points.len() as f64;
    }

    /// Takes a tool in hand; a brush shows what it paints.
    pub fn take(&mut self, tool: Tool) {
        self.tool = tool;
        self.gesture = Gesture::None;
        if tool.paints() {
            self.show_layer();
        }
    }

    /// Shows what the brush changes.
    pub(super) fn show_layer(&mut self) {
        self.field = if self.layer.is_face() {
            Field::Faces
        } else {
            Field::Region
        };
    }

    pub(super) fn drop_gesture(&mut self) {
        self.gesture = Gesture::None;
    }

    /// Whether no hand is at work in the views.
    pub(super) fn is_idle(&self) -> bool {
        self.gesture == Gesture::None
    }

    /// The gauge that follows the pointer, by its number from zero.
    pub(super) fn moved_gauge(&self) -> Option<usize> {
        match self.gesture {
            Gesture::Gauge(_, number, _) => Some(number),
            _ => None,
        }
    }

    #[must_use]
    pub fn is_stroking(&self) -> bool {
        matches!(self.gesture, Gesture::Stroke(..))
    }

    /// Where a point of the limb appears in the window, in points.
    #[must_use]
    pub fn place(&self, p: DVec3) -> Option<Pos2> {
        let (at, _) = self.camera.project(p, self.rect.aspect_ratio())?;
        Some(self.rect.lerp_inside(vec2(at.x as f32, at.y as f32)))
    }

    /// Where a point of the limb appears in the unrolled view, in points.
    #[must_use]
    pub fn flat_place(&self, p: DVec3) -> Option<Pos2> {
        let (middle, per_point) = self.flat_view;
        if per_point == 0.0 {
            return None;
        }
        let off = (self.unrolled.flat.place(p) - middle) / per_point;
        Some(self.flat_rect.center() + vec2(off.x as f32, -off.y as f32))
    }

    pub(super) fn place_in(&self, pane: Pane, p: DVec3) -> Option<Pos2> {
        match pane {
            Pane::Limb => self.place(p).filter(|_| !self.is_cut(p)),
            Pane::Unrolled => self.flat_place(p),
        }
    }

    /// As [`Self::place_in`], for many points.
    pub(super) fn placing(&self, pane: Pane) -> impl Fn(DVec3) -> Option<Pos2> + '_ {
        let projection = self.camera.projection(self.rect.aspect_ratio());
        move |p| match pane {
            Pane::Limb => {
                let (at, _) = projection.place(p).filter(|_| !self.is_cut(p))?;
                Some(self.rect.lerp_inside(vec2(at.x as f32, at.y as f32)))
            }
            Pane::Unrolled => self.flat_place(p),
        }
    }

    pub(super) fn rect_of(&self, pane: Pane) -> Rect {
        match pane {
            Pane::Limb => self.rect,
            Pane::Unrolled => self.flat_rect,
        }
    }

    /// Whether the section cuts a point away.
    pub(super) fn is_cut(&self, p: DVec3) -> bool {
        self.section.is_some_and(|section| section.cuts(p))
    }

    /// The point of the limb under a place of the window.
    pub(super) fn pick(&self, pane: Pane, at: Pos2) -> Option<SurfacePoint> {
        match pane {
            Pane::Limb => self.pick_on(&self.index, at),
            Pane::Unrolled => {
                let off = at - self.flat_rect.center();
                let off = DVec2::new(f64::from(off.x), -f64::from(off.y)) * self.flat_view.1;
                self.unrolled.flat.lift(self.flat_view.0 + off)
            }
        }
    }

    pub(super) fn pick_on(&self, index: &SurfaceIndex, at: Pos2) -> Option<SurfacePoint> {
        let u = (at - self.rect.min) / self.rect.size();
        let place = DVec2::new(f64::from(u.x), f64::from(u.y));
        let (origin, direction) = self.camera.ray(place, self.rect.aspect_ratio());
        let Some(section) = self.section else {
            return index.ray(origin, direction).map(|hit| hit.0);
        };
        let (normal, d) = section.plane();
        let (height, rise) = (normal.dot(origin) - d, normal.dot(direction));
        if height > 0.0 {
            // From what is cut away into what is left, if ever.
            let enter = origin + direction * (height / -rise);
            return (rise < 0.0)
                .then(|| index.ray(enter, direction))
                .flatten()
                .map(|hit| hit.0);
        }
        let (hit, distance) = index.ray(origin, direction)?;
        (rise <= 0.0 || distance < -height / rise).then_some(hit)
    }

    fn show_all_flat(&mut self) {
        let size = self.unrolled.flat.upper - self.unrolled.flat.lower;
        let room = self.flat_rect.size().max(Vec2::splat(1.0));
        let fit = (size.x / f64::from(room.x)).max(size.y / f64::from(room.y));
        self.flat_view = (self.unrolled.centre(), fit / 0.9);
    }

    pub(super) fn pan_flat(&mut self, drag: Vec2) {
        let drag = DVec2::new(f64::from(drag.x), -f64::from(drag.y));
        self.flat_view.0 -= drag * self.flat_view.1;
    }

    /// Zooms around a place of the window, which stays where it is.
    pub(super) fn zoom_flat(&mut self, at: Pos2, factor: f64) {
        let off = at - self.flat_rect.center();
        let off = DVec2::new(f64::from(off.x), -f64::from(off.y));
        let before = self.flat_view.1;
        self.flat_view.1 = (before * factor).clamp(1e-9, 1e3);
        self.flat_view.0 += off * (before - self.flat_view.1);
    }

    /// Middle (m) and metres a point of the unrolled view.
    pub(super) fn flat_view(&self) -> (DVec2, f64) {
        self.flat_view
    }
}

impl Studio {
    pub(super) fn viewport(&mut self, ui: &mut Ui) {
        // The views cover everything below the bar: nothing is painted behind them.
        ui.spacing_mut().item_spacing.y = 0.0;
        self.toolbar(ui);
        ui.reset_style();
        self.view.hover = None;
        self.stand_upright();
        let all = ui.available_rect_before_wrap();
        let beside = if self.view.unrolled_shown { 0.42 } else { 0.0 };
        let split = all.right() - beside * all.width();
        let limb = Rect::from_min_max(all.min, Pos2::new(split, all.bottom()));
        let shown = self.pane(ui, Pane::Limb, limb);
        let mut panes = vec![(Pane::Limb, shown)];
        if self.view.unrolled_shown {
            let flat = Rect::from_min_max(Pos2::new(split, all.top()), all.max);
            let shown = self.pane(ui, Pane::Unrolled, flat);
            panes.push((Pane::Unrolled, shown));
        }
        ui.advance_cursor_after_rect(all);
        self.build_field();
        // Drawn after all that happened in either: what is hovered in one shows in the other.
        for (pane, rect) in panes {
            self.draw(ui, pane, rect);
        }
        if self.view.unrolled_shown {
            let line = ui.visuals().widgets.noninteractive.bg_stroke;
            ui.painter().vline(split, all.y_range(), line);
        }
        self.options(ui, limb);
    }

    /// Has the views follow the part's axis where that has changed.
    fn stand_upright(&mut self) {
        let axis = self.session.document.state.project.part.axis;
        if self.view.axis != axis {
            let stance = axis.stance(&self.session.document.part);
            self.view.axis = axis;
            self.view.camera.stance = stance;
            self.view.around = OrientedBox::around(&self.session.document.part, stance);
            let around = &self.view.around;
            self.view.section =
                (self.view.section).map(|cut| Section::halving(around, cut.side, cut.flip));
        }
        let stance = self.view.camera.stance;
        if self.view.unrolled_shown && self.view.unrolled.stance != stance {
            self.view.unrolled = Unrolled::of(
                Arc::new(Flat::of(&self.session.document.part, stance)),
                stance,
            );
            self.view.flat_view.1 = 0.0;
            self.view.built = None;
        }
    }

    /// Takes in what the pointer does in a view.
    fn pane(&mut self, ui: &mut Ui, pane: Pane, rect: Rect) -> Rect {
        let name = match pane {
            Pane::Limb => "3D view",
            Pane::Unrolled => "Unrolled view",
        };
        let response = ui.interact(rect, ui.scope_id().with(name), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, name));
        match pane {
            Pane::Limb => self.view.rect = rect,
            Pane::Unrolled => {
                self.view.flat_rect = rect;
                if self.view.flat_view.1 == 0.0 {
                    self.view.show_all_flat();
                }
            }
        }
        self.navigate(ui, &response, pane);
        self.use_tool(ui, &response, pane);
        rect
    }

    fn draw(&mut self, ui: &Ui, pane: Pane, rect: Rect) {
        match pane {
            Pane::Limb => self.paint_limb(ui, rect, false),
            Pane::Unrolled => self.paint_unrolled(ui, rect),
        }
        let painter = ui.painter_at(rect);
        self.paint_kept(&painter, pane);
        self.paint_confusions(&painter, pane);
        self.paint_gauges(&painter, pane);
        self.paint_touch(&painter, pane);
        self.paint_live(&painter, pane);
        self.paint_measure(&painter, pane);
        self.paint_brush(&painter, pane);
        self.paint_outline(&painter, pane);
        if pane == Pane::Unrolled {
            self.paint_stretch(&painter, rect);
        } else {
            self.paint_legend(&painter, rect);
            self.paint_region_key(&painter, rect);
            self.paint_hint(&painter, rect);
        }
    }
}

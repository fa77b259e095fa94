//! The part as it is drawn and pointed at: what the views need of it, made ready for the adapter.

use std::sync::Arc;

use egui::{Pos2, Vec2, vec2};
use glam::{DVec2, DVec3};

use super::fields::BuiltField;
use super::view::{Pane, SectionPlane, ViewState};
use crate::document::Document;
use crate::mesh::SurfacePoint;
use crate::mesh::flatten::Flat;
use crate::mesh::locate::SurfaceIndex;
use crate::mesh::oriented_box::OrientedBox;
use crate::mesh::stance::{Direction, Stance};
use crate::project::PartAxis;
use crate::render::camera::Camera;
use crate::render::floor::FloorShadow;
use crate::render::gpu::{GpuVertex, Solid};
use crate::session::{PartShape, Session};

/// The part laid flat, as it is drawn and picked.
pub struct Unrolled {
    pub flat: Arc<Flat>,
    pub solid: Arc<Solid>,
    stance: Stance,
}

impl Unrolled {
    fn of(flat: Arc<Flat>, stance: Stance) -> Self {
        let up = [0.0, 0.0, 1.0];
        let stretch = flat.stretch_at_vertices();
        let vertices = flat
            .positions
            .iter()
            .zip(stretch)
            .map(|(p, off)| GpuVertex {
                position: p.as_vec3().to_array(),
                normal: up,
                stretch: off as f32,
            });
        let solid = Solid {
            vertices: vertices.collect(),
            triangles: flat.triangles.clone(),
            edges: Vec::new(),
            again: Vec::new(),
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

/// The part and what colours it.
pub struct PartScene {
    /// The key that the part stands by, and the box around it as it stands so.
    axis: PartAxis,
    pub around: OrientedBox,
    pub index: Arc<SurfaceIndex>,
    pub solid: Arc<Solid>,
    pub floor: Arc<FloorShadow>,
    pub unrolled: Unrolled,
    pub built: Option<BuiltField>,
}

impl PartScene {
    #[must_use]
    pub fn of(document: &Document, shape: &PartShape) -> Self {
        let axis = document.state.project.part.axis;
        let stance = axis.stance(&document.part);
        Self {
            axis,
            around: OrientedBox::around(&document.part, stance),
            index: Arc::clone(&shape.index),
            solid: Arc::new(Solid::of(&document.part)),
            floor: Arc::new(FloorShadow::of(&document.part, stance)),
            unrolled: Unrolled::of(Arc::clone(&shape.flat), stance),
            built: None,
        }
    }

    /// Has part and views follow the part's axis where that has changed.
    pub fn stand_upright(&mut self, session: &Session, view: &mut ViewState) {
        let document = &session.document;
        let axis = document.state.project.part.axis;
        if self.axis != axis {
            let stance = axis.stance(&document.part);
            self.axis = axis;
            self.around = OrientedBox::around(&document.part, stance);
            self.floor = Arc::new(FloorShadow::of(&document.part, stance));
            view.camera.stance = stance;
            let around = &self.around;
            view.section =
                (view.section).map(|cut| SectionPlane::halving(around, cut.side, cut.flip));
        }
        let stance = view.camera.stance;
        if view.unrolled_shown && self.unrolled.stance != stance {
            let flat = Flat::of(&document.part, stance);
            self.unrolled = Unrolled::of(Arc::new(flat), stance);
            view.flat.1 = 0.0;
            self.built = None;
        }
    }

    /// Where a stroke at a point of the part (m) is repeated.
    #[must_use]
    pub fn image(&self, view: &ViewState, p: DVec3) -> Option<DVec3> {
        Some(self.around.mirrored(p, view.mirror?))
    }

    /// Cuts one side of the part away, or nothing any more.
    pub fn toggle_section(&self, view: &mut ViewState) {
        view.section = match view.section {
            Some(_) => None,
            None => Some(SectionPlane::halving(&self.around, Direction::Front, false)),
        };
    }

    /// Comes near to some points (m).
    pub fn frame_points(&self, view: &mut ViewState, points: &[DVec3], document: &Document) {
        let Some(&first) = points.first() else {
            return;
        };
        let (part_lower, part_upper) = document.part.bounds();
        let around = DVec3::splat(0.08 * (part_upper - part_lower).length());
        let lower = points.iter().fold(first, |l, &p| l.min(p)) - around;
        let upper = points.iter().fold(first, |u, &p| u.max(p)) + around;
        let framed = Camera::framing(lower, upper, view.camera.stance);
        view.camera.target = framed.target;
        view.camera.distance = framed.distance;
        let flat = points.iter().map(|&p| self.unrolled.flat.place(p));
        let sum: DVec2 = flat.sum();
        view.flat.0 = sum / points.len() as f64;
    }

    /// Where a point of the limb appears in the unrolled view, in points.
    #[must_use]
    pub fn flat_place(&self, view: &ViewState, p: DVec3) -> Option<Pos2> {
        let (middle, per_point) = view.flat;
        if per_point == 0.0 {
            return None;
        }
        let off = (self.unrolled.flat.place(p) - middle) / per_point;
        Some(view.flat_rect.center() + vec2(off.x as f32, -off.y as f32))
    }

    /// Where a point of the limb appears in a view, in points.
    #[must_use]
    pub fn place_in(&self, view: &ViewState, pane: Pane, p: DVec3) -> Option<Pos2> {
        match pane {
            Pane::Limb => view.place(p).filter(|_| !view.is_cut(p)),
            Pane::Unrolled => self.flat_place(view, p),
        }
    }

    /// As [`Self::place_in`], for many points.
    pub fn placing<'s>(
        &'s self,
        view: &'s ViewState,
        pane: Pane,
    ) -> impl Fn(DVec3) -> Option<Pos2> + 's {
        let projection = view.camera.projection(view.rect.aspect_ratio());
        move |p| match pane {
            Pane::Limb => {
                let (at, _) = projection.place(p).filter(|_| !view.is_cut(p))?;
                Some(view.rect.lerp_inside(vec2(at.x as f32, at.y as f32)))
            }
            Pane::Unrolled => self.flat_place(view, p),
        }
    }

    /// The point of the limb under a place of the window.
    #[must_use]
    pub fn pick(&self, view: &ViewState, pane: Pane, at: Pos2) -> Option<SurfacePoint> {
        match pane {
            Pane::Limb => pick_on(view, &self.index, at),
            Pane::Unrolled => {
                let off = at - view.flat_rect.center();
                let off = DVec2::new(f64::from(off.x), -f64::from(off.y)) * view.flat.1;
                self.unrolled.flat.lift(view.flat.0 + off)
            }
        }
    }

    /// Shows all of the unrolled part.
    pub fn show_all_flat(&self, view: &mut ViewState) {
        let size = self.unrolled.flat.upper - self.unrolled.flat.lower;
        let room = view.flat_rect.size().max(Vec2::splat(1.0));
        let fit = (size.x / f64::from(room.x)).max(size.y / f64::from(room.y));
        view.flat = (self.unrolled.centre(), fit / 0.9);
    }

    /// Colours the part anew where what is shown has changed.
    pub fn build(&mut self, session: &Session, view: &ViewState) {
        let built = BuiltField::of(self.built.take(), &self.unrolled.flat, session, view);
        self.built = Some(built);
    }

    /// Whether colours with a legend are shown.
    #[must_use]
    pub fn shows_field(&self) -> bool {
        self.built.as_ref().is_some_and(|b| b.legend.is_some())
    }
}

/// The point of a surface under a place of the window.
#[must_use]
pub fn pick_on(view: &ViewState, index: &SurfaceIndex, at: Pos2) -> Option<SurfacePoint> {
    let u = (at - view.rect.min) / view.rect.size();
    let place = DVec2::new(f64::from(u.x), f64::from(u.y));
    let (origin, direction) = view.camera.ray(place, view.rect.aspect_ratio());
    let Some(section) = view.section else {
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

//! How a session is looked at: a plain value, of which nothing belongs to the project.

mod choices;

use std::collections::BTreeSet;

use egui::{Pos2, Rect, Vec2, vec2};
use glam::{DVec2, DVec3};

use crate::document::{Document, Layer};
use crate::mesh::SurfacePoint;
use crate::mesh::stance::Direction;
use crate::project::{KeptSelection, PartAxis, Project};
use crate::render::camera::Camera;
use crate::session::{ExpectedOf, Session};

pub use crate::session::Stage;
pub use choices::{
    Backdrop, Field, Floor, Gesture, Measure, Pane, Picture, Ranges, ScreenWay, SectionPlane, Tab,
    Tool,
};

/// What is shown, picked and chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewState {
    /// The stage whose settings are shown.
    pub stage: Stage,
    /// What is shown below the views.
    pub tab: Tab,
    /// Numbers of the gauges that are picked, from zero.
    pub picked: Vec<usize>,
    /// Names of the kept selections that are shown.
    pub shown_kept: BTreeSet<String>,
    /// The confusion that was clicked.
    pub looked_at: Option<usize>,
    /// The known touch that the pointer is on, by its number.
    pub known_hover: Option<usize>,
    pub camera: Camera,
    pub tool: Tool,
    pub layer: Layer,
    pub field: Field,
    pub ranges: Ranges,
    /// Brush radius (m).
    pub brush: f64,
    /// Strokes are repeated on the other side of the part's middle, across this direction.
    pub mirror: Option<Direction>,
    pub section: Option<SectionPlane>,
    pub see_through: bool,
    pub floor: Floor,
    pub unrolled_shown: bool,
    /// Whether the jig is drawn.
    pub jig_shown: bool,
    /// Middle of the flat view (m) and metres a point of the window; 0 until it was first shown.
    pub flat: (DVec2, f64),
    /// What is under way between pressing and letting go.
    pub gesture: Gesture,
    /// The point of the part under the pointer, in whichever view.
    pub hover: Option<SurfacePoint>,
    pub measure: Measure,
    /// Where the views were last shown, in points: what a place on them means.
    pub rect: Rect,
    pub flat_rect: Rect,
    /// What lies over the view, as last shown: it is not the limb that is pressed there.
    pub covered: Rect,
}

impl ViewState {
    /// The first look at a project.
    #[must_use]
    pub fn of(document: &Document) -> Self {
        let (lower, upper) = document.part.bounds();
        let axis: PartAxis = document.state.project.part.axis;
        Self {
            stage: Stage::default(),
            tab: Tab::default(),
            picked: Vec::new(),
            shown_kept: BTreeSet::new(),
            looked_at: None,
            known_hover: None,
            camera: Camera::framing(lower, upper, axis.stance(&document.part)),
            tool: Tool::Touch,
            layer: Layer::Feasible,
            field: Field::Region,
            ranges: Ranges::default(),
            brush: 6e-3_f64.min((upper - lower).length() / 8.0),
            mirror: None,
            section: None,
            see_through: false,
            floor: Floor::default(),
            unrolled_shown: false,
            jig_shown: false,
            flat: (DVec2::ZERO, 0.0),
            gesture: Gesture::None,
            hover: None,
            measure: Measure::default(),
            rect: Rect::NOTHING,
            flat_rect: Rect::NOTHING,
            covered: Rect::NOTHING,
        }
    }

    /// Kept selections that are shown, with their numbers.
    pub fn compared<'s>(
        &self,
        project: &'s Project,
    ) -> impl Iterator<Item = (usize, &'s KeptSelection)> {
        let kept = project.kept.iter().enumerate();
        kept.filter(|(_, kept)| self.shown_kept.contains(&kept.name))
    }

    /// Shows the whole part.
    pub fn frame(&mut self, document: &Document) {
        let (lower, upper) = document.part.bounds();
        let framed = Camera::framing(lower, upper, self.camera.stance);
        self.camera.target = framed.target;
        self.camera.distance = framed.distance;
        self.flat.1 = 0.0;
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
    pub fn show_layer(&mut self) {
        self.field = if self.layer.is_face() {
            Field::Faces
        } else {
            Field::Region
        };
    }

    /// Whether no hand is at work in the views.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.gesture == Gesture::None
    }

    /// The gauge that follows the pointer, by its number from zero.
    #[must_use]
    pub fn moved_gauge(&self) -> Option<usize> {
        match self.gesture {
            Gesture::Gauge(_, number, _) => Some(number),
            _ => None,
        }
    }

    /// What is expected of the gauges: as they are, or while one moves, as they just were.
    #[must_use]
    pub fn expected<'s>(&self, session: &'s Session) -> Option<&'s ExpectedOf> {
        session.expected(self.moved_gauge().is_some())
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

    #[must_use]
    pub fn rect_of(&self, pane: Pane) -> Rect {
        match pane {
            Pane::Limb => self.rect,
            Pane::Unrolled => self.flat_rect,
        }
    }

    /// Whether the section cuts a point away.
    #[must_use]
    pub fn is_cut(&self, p: DVec3) -> bool {
        self.section.is_some_and(|section| section.cuts(p))
    }

    pub fn pan_flat(&mut self, drag: Vec2) {
        let drag = DVec2::new(f64::from(drag.x), -f64::from(drag.y));
        self.flat.0 -= drag * self.flat.1;
    }

    /// Zooms around a place of the window, which stays where it is.
    pub fn zoom_flat(&mut self, at: Pos2, factor: f64) {
        let off = at - self.flat_rect.center();
        let off = DVec2::new(f64::from(off.x), -f64::from(off.y));
        let before = self.flat.1;
        self.flat.1 = (before * factor).clamp(1e-9, 1e3);
        self.flat.0 += off * (before - self.flat.1);
    }
}

//! The 3D view: the limb, its fields, the gauges on it, and the tools that work on it.

use std::sync::Arc;

use egui::{PointerButton, Pos2, Rect, Role, Sense, Ui, WidgetInfo, vec2};
use glam::{DVec2, DVec3};

use super::fields::{Built, Field};
use super::{Command, Studio};
use crate::document::{Brush, Document};
use crate::mesh::SurfacePoint;
use crate::mesh::locate::SurfaceIndex;
use crate::render::camera::{Camera, Preset};

/// What the pointer does on the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    #[default]
    Touch,
    Paint,
    Erase,
}

impl Tool {
    pub const ALL: [Self; 3] = [Self::Touch, Self::Paint, Self::Erase];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Touch => "Touch",
            Self::Paint => "Paint",
            Self::Erase => "Erase",
        }
    }
}

/// State of the view; none of it belongs to the project.
pub struct Viewport {
    pub camera: Camera,
    pub tool: Tool,
    pub field: Field,
    /// Brush radius (m).
    pub brush: f64,
    pub(super) index: Arc<SurfaceIndex>,
    pub(super) built: Option<Built>,
    last_dab: Option<Pos2>,
    pub(super) hover: Option<DVec3>,
    /// Where the view was last shown, in points: what a place on it means.
    pub rect: Rect,
}

impl Viewport {
    #[must_use]
    pub fn new(document: &Document) -> Self {
        let (lower, upper) = document.part.bounds();
        Self {
            camera: Camera::framing(lower, upper),
            tool: Tool::Touch,
            field: Field::Region,
            brush: 6e-3_f64.min((upper - lower).length() / 8.0),
            index: Arc::new(SurfaceIndex::new(&document.part)),
            built: None,
            last_dab: None,
            hover: None,
            rect: Rect::NOTHING,
        }
    }

    pub fn frame(&mut self, document: &Document) {
        let (lower, upper) = document.part.bounds();
        let framed = Camera::framing(lower, upper);
        self.camera.target = framed.target;
        self.camera.distance = framed.distance;
    }

    /// Takes a tool in hand; a brush shows what it paints.
    pub fn take(&mut self, tool: Tool) {
        self.tool = tool;
        self.last_dab = None;
        if tool != Tool::Touch {
            self.field = Field::Region;
        }
    }

    #[must_use]
    pub fn is_stroking(&self) -> bool {
        self.last_dab.is_some()
    }

    /// Where a point of the limb appears in the window, in points.
    #[must_use]
    pub fn place(&self, p: DVec3) -> Option<Pos2> {
        let (at, _) = self.camera.project(p, self.rect.aspect_ratio())?;
        Some(self.rect.lerp_inside(vec2(at.x as f32, at.y as f32)))
    }

    /// The point of the limb under a place of the window.
    fn pick(&self, at: Pos2) -> Option<SurfacePoint> {
        self.pick_on(&self.index, at)
    }

    fn pick_on(&self, index: &SurfaceIndex, at: Pos2) -> Option<SurfacePoint> {
        let u = (at - self.rect.min) / self.rect.size();
        let place = DVec2::new(f64::from(u.x), f64::from(u.y));
        let (origin, direction) = self.camera.ray(place, self.rect.aspect_ratio());
        index.ray(origin, direction).map(|hit| hit.0)
    }
}

impl Studio {
    pub(super) fn viewport(&mut self, ui: &mut Ui) {
        self.toolbar(ui);
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, "3D view"));
        self.view.rect = rect;
        self.navigate(ui, &response);
        self.use_tool(ui, &response);
        self.build_field();
        self.paint_limb(ui, rect, false);
        let painter = ui.painter_at(rect);
        self.paint_touch(&painter);
        self.paint_gauges(&painter);
        self.paint_brush(&painter);
        self.paint_legend(&painter, rect);
        self.paint_hint(&painter, rect);
    }

    fn toolbar(&mut self, ui: &mut Ui) {
        egui::Frame::new()
            .inner_margin(egui::Margin::symmetric(8, 5))
            .show(ui, |ui| {
                ui.horizontal_wrapped(|ui| {
                    for tool in Tool::ALL {
                        let chosen = self.view.tool == tool;
                        let button = ui.add(egui::Button::selectable(chosen, tool.name()));
                        if button
                            .on_hover_text(Command::Tool(tool).tooltip())
                            .clicked()
                        {
                            self.view.take(tool);
                        }
                    }
                    if self.view.tool != Tool::Touch {
                        let mut mm = self.view.brush * 1000.0;
                        ui.add(
                            egui::DragValue::new(&mut mm)
                                .range(0.5..=500.0)
                                .speed(0.1)
                                .fixed_decimals(1)
                                .prefix("Radius ")
                                .suffix(" mm"),
                        )
                        .on_hover_text("Radius of the brush over the surface");
                        self.view.brush = mm / 1000.0;
                    }
                    ui.separator();
                    egui::ComboBox::new("field", "")
                        .selected_text(self.view.field.name())
                        .width(128.0)
                        .show_ui(ui, |ui| {
                            for field in Field::ALL {
                                ui.selectable_value(&mut self.view.field, field, field.name());
                            }
                        })
                        .response
                        .on_hover_text("What colours the limb")
                        .accessible_name("Field");
                    ui.separator();
                    for preset in Preset::ALL {
                        if ui
                            .button(preset.name())
                            .on_hover_text(Command::Look(preset).tooltip())
                            .clicked()
                        {
                            self.view.camera.look_from(preset);
                        }
                    }
                    if ui
                        .button("Frame")
                        .on_hover_text(Command::Frame.tooltip())
                        .clicked()
                    {
                        self.view.frame(&self.document);
                    }
                });
            });
    }

    /// Orbit with the right button (or the left one beside the limb and with the touch tool), pan with
    /// the middle one or with Shift, zoom with the wheel.
    fn navigate(&mut self, ui: &Ui, response: &egui::Response) {
        let drag = response.drag_delta();
        let drag = DVec2::new(f64::from(drag.x), f64::from(drag.y));
        let shift = ui.input(|i| i.modifiers.shift);
        let left = response.dragged_by(PointerButton::Primary);
        let turning = response.dragged_by(PointerButton::Secondary)
            || left && (self.view.tool == Tool::Touch || !self.view.is_stroking());
        if response.dragged_by(PointerButton::Middle) || turning && shift {
            self.view
                .camera
                .pan(drag, f64::from(self.view.rect.height()));
        } else if turning {
            self.view.camera.orbit(drag);
        }
        if response.hovered() {
            let wheel = ui.input(|i| i.smooth_scroll_delta().y + 400.0 * (i.zoom_delta() - 1.0));
            if wheel != 0.0 {
                self.view.camera.zoom((-0.0022 * f64::from(wheel)).exp());
            }
        }
    }

    fn use_tool(&mut self, ui: &Ui, response: &egui::Response) {
        self.view.hover = None;
        let brush = match self.view.tool {
            Tool::Touch => {
                if response.clicked() {
                    self.press(ui, response.interact_pointer_pos());
                }
                return;
            }
            // Control turns the brush around, as elsewhere.
            Tool::Paint if !ui.input(|i| i.modifiers.ctrl) => Brush::Paint,
            Tool::Erase if ui.input(|i| i.modifiers.ctrl) => Brush::Paint,
            Tool::Paint | Tool::Erase => Brush::Erase,
        };
        if let Some(at) = response.hover_pos() {
            self.view.hover = self.view.pick(at).map(|p| self.document.part.point(p));
        }
        let began = ui.input(|i| i.pointer.primary_pressed()) && response.contains_pointer();
        let down = ui.input(|i| i.pointer.primary_down());
        match response.interact_pointer_pos().or(response.hover_pos()) {
            Some(at) if began && self.view.pick(at).is_some() => self.stroke(brush, at),
            Some(at) if down && self.view.is_stroking() => self.stroke(brush, at),
            _ => {}
        }
        if !down && self.view.last_dab.take().is_some() {
            self.document.settle();
        }
    }

    fn press(&mut self, ui: &Ui, at: Option<Pos2>) {
        match at.and_then(|at| self.pick_shown(at)) {
            Some(place) => {
                self.touching.apply(ui.ctx(), &self.document, place);
                if !matches!(self.view.field, Field::Strain | Field::Displacement) {
                    self.view.field = Field::Strain;
                }
            }
            None => self.touching.clear(),
        }
    }

    /// The point of the limb under a place of the window, on the shape that is shown there.
    fn pick_shown(&self, at: Pos2) -> Option<SurfacePoint> {
        let (Some(scale), Some(touched)) = (self.exaggeration(), self.touching.result()) else {
            return self.view.pick(at);
        };
        let part = &self.document.part;
        let moved = part.positions().iter().zip(&touched.displacement);
        let index = SurfaceIndex::of(
            moved.map(|(p, u)| *p + *u * scale).collect(),
            part.triangles(),
        );
        self.view.pick_on(&index, at)
    }

    /// Dabs along the way from the last pointer sample, so that a fast stroke has no gaps.
    fn stroke(&mut self, brush: Brush, to: Pos2) {
        const STEP: f32 = 6.0;
        let from = self.view.last_dab.unwrap_or(to);
        let steps = ((to - from).length() / STEP).ceil().clamp(1.0, 64.0) as usize;
        for k in 1..=steps {
            let at = from.lerp(to, k as f32 / steps as f32);
            if let Some(place) = self.view.pick(at) {
                self.document.dab(brush, place, self.view.brush);
            }
        }
        self.view.last_dab = Some(to);
    }
}

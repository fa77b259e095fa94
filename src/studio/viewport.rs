//! The 3D view: the limb, its fields, the gauges on it, and the tools that work on it.

use std::sync::Arc;

use eframe::egui_wgpu;
use egui::{
    Align2, Color32, FontId, PointerButton, Pos2, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2,
    vec2,
};
use glam::{DVec2, DVec3};

use super::{Command, Studio, theme};
use crate::document::{Brush, Document};
use crate::mesh::SurfacePoint;
use crate::mesh::locate::SurfaceIndex;
use crate::render::camera::{Camera, Preset};
use crate::render::colormap::ColorMap;
use crate::render::gpu::{Frame3d, Shown, Uniforms};

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

/// What colours the limb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Field {
    #[default]
    Region,
    Strain,
    Displacement,
    SignalToNoise,
}

impl Field {
    pub const ALL: [Self; 4] = [
        Self::Region,
        Self::Strain,
        Self::Displacement,
        Self::SignalToNoise,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Region => "Feasible region",
            Self::Strain => "Strain, inside",
            Self::Displacement => "Displacement",
            Self::SignalToNoise => "Signal to noise",
        }
    }
}

/// A field ready to be shown: one value a vertex, and the legend that goes with it.
struct Built {
    signature: String,
    shown: Arc<Vec<Shown>>,
    legend: Option<Legend>,
}

#[derive(Clone)]
struct Legend {
    title: &'static str,
    low: f64,
    high: f64,
    map: ColorMap,
}

/// State of the view; none of it belongs to the project.
pub struct Viewport {
    pub camera: Camera,
    pub tool: Tool,
    pub field: Field,
    /// Brush radius (m).
    pub brush: f64,
    index: Arc<SurfaceIndex>,
    built: Option<Built>,
    last_dab: Option<Pos2>,
    hover: Option<DVec3>,
    /// Where the view was last shown, in points: what a place on it means.
    pub rect: Rect,
}

/// How large the largest displacement is drawn, as a share of the limb.
const SHOWN_DEFORMATION: f64 = 0.06;

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
        self.paint_limb(ui, rect);
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

    /// Builds what is shown a vertex, when anything it depends on has changed.
    fn build_field(&mut self) {
        let signature = format!(
            "{:?} {} {:?} {:?} {:?}",
            self.view.field,
            self.touching.version,
            self.feasibility
                .as_ref()
                .filter(|f| !self.view.is_stroking() && f.0 == self.document.feasible_key())
                .map(|f| Arc::as_ptr(&f.1)),
            self.simulation.as_ref().map(|s| Arc::as_ptr(&s.simulated)),
            self.document.state.painted.as_ref().map(|m| {
                use std::hash::{DefaultHasher, Hash, Hasher};
                let mut hasher = DefaultHasher::new();
                m.hash(&mut hasher);
                hasher.finish()
            }),
        );
        if self
            .view
            .built
            .as_ref()
            .is_some_and(|b| b.signature == signature)
        {
            return;
        }
        let (values, legend) = self.field_values();
        let region = self.region_values();
        let shown = (0..self.document.part.positions().len())
            .map(|v| Shown {
                displacement: self
                    .touching
                    .result()
                    .map_or([0.0; 3], |t| t.displacement[v].as_vec3().to_array()),
                value: values.as_ref().map_or(0.0, |x| x[v] as f32),
                region: region[v] as f32,
            })
            .collect();
        self.view.built = Some(Built {
            signature,
            shown: Arc::new(shown),
            legend,
        });
    }

    /// The chosen field over the legend's range (0–1 a vertex).
    fn field_values(&self) -> (Option<Vec<f64>>, Option<Legend>) {
        match self.view.field {
            Field::Region => (None, None),
            Field::Strain => self.touching.result().map_or((None, None), |t| {
                let micro: Vec<f64> = t.strain.iter().map(|e| e * 1e6).collect();
                let top = robust_top(&micro);
                let values = micro.iter().map(|e| 0.5 + 0.5 * e / top).collect();
                (
                    Some(values),
                    Some(Legend {
                        title: "strain (microstrain)",
                        low: -top,
                        high: top,
                        map: ColorMap::BlueOrange,
                    }),
                )
            }),
            Field::Displacement => self.touching.result().map_or((None, None), |t| {
                let top = round_up(t.largest * 1000.0);
                let values = t
                    .displacement
                    .iter()
                    .map(|d| d.length() * 1000.0 / top)
                    .collect();
                (
                    Some(values),
                    Some(Legend {
                        title: "displacement (mm)",
                        low: 0.0,
                        high: top,
                        map: ColorMap::Viridis,
                    }),
                )
            }),
            Field::SignalToNoise => {
                let noise = self.document.state.project.gauge.noise_microstrain * 1e-6;
                let Some(simulation) = self.simulation.as_ref().filter(|_| noise > 0.0) else {
                    return (None, None);
                };
                let rms: Vec<f64> = simulation
                    .simulated
                    .dataset
                    .sites
                    .iter()
                    .map(|s| s.rms_strain / noise)
                    .collect();
                let ratio = self.carried_from_sites(&rms);
                let top = robust_top(&ratio);
                let values = ratio.iter().map(|r| r / top).collect();
                (
                    Some(values),
                    Some(Legend {
                        title: "signal to noise (rms)",
                        low: 0.0,
                        high: top,
                        map: ColorMap::Viridis,
                    }),
                )
            }
        }
    }

    /// 1 where gauges may go: the filters' verdicts where they are known, else what was painted.
    fn region_values(&self) -> Vec<f64> {
        let current = self
            .feasibility
            .as_ref()
            .filter(|f| !self.view.is_stroking() && f.0 == self.document.feasible_key());
        if let Some((_, verdicts)) = current {
            let passed: Vec<f64> = verdicts
                .verdicts
                .iter()
                .map(|v| f64::from(u8::from(v.is_none())))
                .collect();
            return self.carried_from_sites(&passed);
        }
        match &self.document.state.painted {
            Some(mask) => mask.iter().map(|&m| f64::from(u8::from(m))).collect(),
            None => vec![0.0; self.document.part.positions().len()],
        }
    }

    /// Carries values of sites to the part's vertices, by the sites' places in their triangles.
    fn carried_from_sites(&self, values: &[f64]) -> Vec<f64> {
        let vertices = self.document.part.positions().len();
        let Some(simulation) = self.simulation.as_ref() else {
            return vec![0.0; vertices];
        };
        // A refined model keeps the part's vertices as its first ones, but not its triangles.
        let mesh = &simulation.simulated.mesh;
        let (mut sum, mut weight) = (
            vec![0.0; mesh.positions().len()],
            vec![0.0; mesh.positions().len()],
        );
        for (at, value) in simulation.simulated.points.iter().zip(values) {
            for (v, w) in mesh.triangles()[at.triangle as usize]
                .into_iter()
                .zip(at.barycentric)
            {
                sum[v as usize] += w * value;
                weight[v as usize] += w;
            }
        }
        // On a mesh finer than the sites some vertices have none beside them: take the neighbours'.
        for _ in 0..4 {
            let (old_sum, old_weight) = (sum.clone(), weight.clone());
            for edge in mesh.edges() {
                for (a, b) in [(edge.a, edge.b), (edge.b, edge.a)] {
                    if old_weight[a as usize] == 0.0 && old_weight[b as usize] > 0.0 {
                        sum[a as usize] += old_sum[b as usize] / old_weight[b as usize];
                        weight[a as usize] += 1.0;
                    }
                }
            }
        }
        (0..vertices)
            .map(|v| {
                if weight[v] > 0.0 {
                    sum[v] / weight[v]
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// How much the deformation is exaggerated; nothing without a touch, nor while painting: the brush
    /// works on the limb at rest.
    #[must_use]
    pub fn exaggeration(&self) -> Option<f64> {
        let touched = self
            .touching
            .result()
            .filter(|t| self.view.tool == Tool::Touch && t.largest > 0.0)?;
        let (lower, upper) = self.document.part.bounds();
        let wanted =
            SHOWN_DEFORMATION * (upper - lower).length() / touched.largest.max(f64::MIN_POSITIVE);
        let power = 10f64.powf(wanted.log10().floor());
        [5.0, 2.0, 1.0]
            .map(|m| m * power)
            .into_iter()
            .find(|s| *s <= wanted)
    }

    fn paint_limb(&self, ui: &Ui, rect: Rect) {
        let Some(built) = &self.view.built else {
            return;
        };
        let camera = &self.view.camera;
        let eye = camera.toward_eye().as_vec3();
        let target = camera.target.as_vec3();
        let flag = |on: bool| f32::from(u8::from(on));
        let region = self.view.field == Field::Region
            && (self.feasibility.is_some() || self.document.state.painted.is_some());
        let uniforms = Uniforms {
            matrix: camera.matrix(rect.aspect_ratio()).to_cols_array_2d(),
            eye: [eye.x, eye.y, eye.z, 0.0],
            target_scale: [target.x, target.y, target.z, (1.0 / camera.distance) as f32],
            deform: [
                self.exaggeration().unwrap_or(0.0) as f32,
                flag(built.legend.is_some()),
                flag(region),
                0.0,
            ],
        };
        let pixels = rect.size() * ui.pixels_per_point();
        let back = theme::backdrop(ui.ctx().theme());
        let frame = Frame3d {
            mesh: Arc::clone(&self.document.part),
            shown: Arc::clone(&built.shown),
            map: built.legend.as_ref().map_or(ColorMap::Viridis, |l| l.map),
            uniforms,
            background: [back.r(), back.g(), back.b()].map(|c| f64::from(c) / 255.0),
            size: [
                pixels.x.round().max(1.0) as u32,
                pixels.y.round().max(1.0) as u32,
            ],
        };
        ui.painter()
            .add(egui_wgpu::Callback::new_paint_callback(rect, frame));
    }

    fn paint_touch(&self, painter: &egui::Painter) {
        let shown = self.view.tool == Tool::Touch;
        let Some(touched) = self.touching.result().filter(|_| shown) else {
            return;
        };
        let touch = touched.touch;
        let length = 0.16 * self.view.camera.distance;
        let (Some(tip), Some(tail)) = (
            self.view.place(touch.position),
            self.view.place(touch.position + touch.normal * length),
        ) else {
            return;
        };
        painter.arrow(tail, tip - tail, Stroke::new(3.0, theme::TOUCHED));
        let text = format!("{} N · {:.2} mm", touch.force, touched.largest * 1000.0);
        label(painter, tail, Align2::CENTER_BOTTOM, &text, theme::TOUCHED);
    }

    fn paint_gauges(&self, painter: &egui::Painter) {
        let toward = self.view.camera.toward_eye();
        let deformation = self.exaggeration().unwrap_or(0.0);
        for (number, site) in (1..).zip(&self.document.state.project.selection.sites) {
            let position = DVec3::from_array(site.position_mm) / 1000.0;
            let direction = DVec3::from_array(site.direction);
            let (at, _) = self.view.index.nearest(position);
            let normal = self.document.part.normal(at);
            let shift =
                self.touching
                    .result()
                    .filter(|_| deformation > 0.0)
                    .map_or(DVec3::ZERO, |t| {
                        let tri = self.document.part.triangles()[at.triangle as usize];
                        (0..3)
                            .map(|k| t.displacement[tri[k] as usize] * at.barycentric[k])
                            .sum::<DVec3>()
                            * deformation
                    });
            let centre = position + shift;
            let half = self.document.state.project.gauge.grid_length_mm * 0.5e-3;
            let ends = [-half, half].map(|h| self.view.place(centre + direction * h));
            if let ([Some(a), Some(b)], Some(middle)) = (ends, self.view.place(centre)) {
                marker(painter, (a, b), middle, number, normal.dot(toward) > 0.0);
            }
        }
    }

    fn paint_brush(&self, painter: &egui::Painter) {
        let Some(centre) = self.view.hover else {
            return;
        };
        let (at, _) = self.view.index.nearest(centre);
        let normal = self.document.part.normal(at);
        let frame = crate::elasticity::observe::tangent_frame(normal);
        let ring: Vec<Pos2> = (0..=48)
            .filter_map(|k| {
                let a = f64::from(k) / 48.0 * std::f64::consts::TAU;
                let offset = (frame.x_axis * a.cos() + frame.y_axis * a.sin()) * self.view.brush;
                self.view.place(centre + offset)
            })
            .collect();
        let colour = if self.view.tool == Tool::Paint {
            Color32::WHITE
        } else {
            theme::ERROR
        };
        painter.line(ring, Stroke::new(1.5, colour));
    }

    fn paint_legend(&self, painter: &egui::Painter, rect: Rect) {
        let mut bottom = rect.bottom() - 16.0;
        if let Some(scale) = self.exaggeration() {
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
        let Some(legend) = self.view.built.as_ref().and_then(|b| b.legend.clone()) else {
            return;
        };
        let bar = Rect::from_min_max(
            pos2(rect.right() - 34.0, bottom - 210.0),
            pos2(rect.right() - 16.0, bottom),
        );
        let board = Rect::from_min_max(bar.min - vec2(86.0, 30.0), bar.max + vec2(8.0, 8.0));
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
        painter.text(
            board.right_top() + vec2(-8.0, 6.0),
            Align2::RIGHT_TOP,
            legend.title,
            FontId::proportional(11.5),
            Color32::WHITE,
        );
    }

    fn paint_hint(&self, painter: &egui::Painter, rect: Rect) {
        let text = match self.view.tool {
            _ if self.touching.is_waiting() => "Computing the touch …",
            Tool::Touch
                if matches!(self.view.field, Field::Strain | Field::Displacement)
                    && self.touching.result().is_none() =>
            {
                "Click on the limb to press it and see this field"
            }
            Tool::Touch if self.view.field == Field::SignalToNoise && self.simulation.is_none() => {
                "Press “Simulate” to see the signal at each site"
            }
            Tool::Touch => {
                "Click: press the limb   ·   drag: look around   ·   Shift-drag: shift   ·   wheel: zoom"
            }
            Tool::Paint => {
                "Drag over the limb: paint where gauges may go   ·   Ctrl: erase   ·   right-drag: look around"
            }
            Tool::Erase => {
                "Drag over the limb: keep gauges away   ·   Ctrl: paint   ·   right-drag: look around"
            }
        };
        label(
            painter,
            pos2(rect.left() + 14.0, rect.bottom() - 14.0),
            Align2::LEFT_BOTTOM,
            text,
            Color32::from_gray(215),
        );
    }
}

/// A numbered gauge: a bar along its direction; hollow on the far wall.
fn marker(painter: &egui::Painter, (a, b): (Pos2, Pos2), middle: Pos2, number: usize, near: bool) {
    let along = (b - a).normalized();
    let half = ((b - a).length() / 2.0).max(12.0);
    let alpha = if near { 1.0 } else { 0.55 };
    let colour = theme::CHOSEN.gamma_multiply(alpha);
    painter.line_segment(
        [middle - along * half, middle + along * half],
        Stroke::new(4.0, colour),
    );
    if near {
        painter.circle_filled(middle, 9.0, colour);
    } else {
        painter.circle(
            middle,
            9.0,
            Color32::from_rgb(40, 44, 50),
            Stroke::new(1.5, colour),
        );
    }
    let ink = if near { Color32::WHITE } else { colour };
    painter.text(
        middle,
        Align2::CENTER_CENTER,
        number,
        FontId::proportional(11.0),
        ink,
    );
}

/// Text on a dark plate, readable over anything.
fn label(painter: &egui::Painter, at: Pos2, align: Align2, text: &str, colour: Color32) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.5), colour);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(
        rect.expand2(vec2(7.0, 4.0)),
        5.0,
        Color32::from_black_alpha(150),
    );
    painter.galley(rect.min, galley, colour);
}

/// A round number not below most of the values (99.5 % of them): single peaks do not wash the map out.
fn robust_top(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values
        .iter()
        .map(|v| v.abs())
        .filter(|v| v.is_finite())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let last = sizes.len().saturating_sub(1);
    round_up(sizes.get(last * 995 / 1000).copied().unwrap_or(1.0))
}

fn round_up(top: f64) -> f64 {
    if !(top > 0.0 && top.is_finite()) {
        return 1.0;
    }
    let power = 10f64.powf(top.log10().floor());
    [1.0, 2.0, 4.0, 5.0, 8.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= top)
        .unwrap_or(top)
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

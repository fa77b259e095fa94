//! What is drawn over the limb: the touch, the gauges, the brush, the legend and hints.

use std::sync::Arc;

use eframe::egui_wgpu;
use egui::{Align2, Color32, FontId, Pos2, Rect, Stroke, Ui, pos2, vec2};
use glam::DVec3;

use super::fields::Field;
use super::viewport::Tool;
use super::{Studio, theme};
use crate::colormap::ColorMap;
use crate::render::gpu::{Frame3d, Uniforms};

impl Studio {
    /// The limb with all that belongs to it, for a picture.
    pub(super) fn scene(&mut self, ui: &Ui, rect: Rect, transparent: bool) {
        self.view.rect = rect;
        self.build_field();
        self.paint_limb(ui, rect, transparent);
        let painter = ui.painter_at(rect);
        self.paint_gauges(&painter);
        self.paint_legend(&painter, rect);
    }

    pub(super) fn paint_limb(&self, ui: &Ui, rect: Rect, transparent: bool) {
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
        let back = if transparent {
            Color32::TRANSPARENT
        } else {
            theme::backdrop(ui.ctx().theme())
        };
        let frame = Frame3d {
            mesh: Arc::clone(&self.document.part),
            shown: Arc::clone(&built.shown),
            map: built.legend.as_ref().map_or(ColorMap::Viridis, |l| l.map),
            uniforms,
            background: back.to_array().map(|c| f64::from(c) / 255.0),
            size: [
                pixels.x.round().max(1.0) as u32,
                pixels.y.round().max(1.0) as u32,
            ],
        };
        ui.painter()
            .add(egui_wgpu::Callback::new_paint_callback(rect, frame));
    }

    pub(super) fn paint_touch(&self, painter: &egui::Painter) {
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

    pub(super) fn paint_gauges(&self, painter: &egui::Painter) {
        let toward = self.view.camera.toward_eye();
        let deformation = self.exaggeration().unwrap_or(0.0);
        for (number, site) in (1..).zip(self.gauges()) {
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

    pub(super) fn paint_brush(&self, painter: &egui::Painter) {
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

    pub(super) fn paint_legend(&self, painter: &egui::Painter, rect: Rect) {
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

    pub(super) fn paint_hint(&self, painter: &egui::Painter, rect: Rect) {
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
            Tool::Touch if self.view.field == Field::Error && self.design.is_none() => {
                "Press “Select gauges” to see where touches are found well and where not"
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

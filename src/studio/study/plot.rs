//! All designs by two of their figures.

use std::sync::Arc;

use egui::{ComboBox, Pos2, Rect, Role, TextureHandle, Ui, Vec2, WidgetInfo, vec2};
use egui_plot::{Plot, PlotImage, PlotPoint, PlotPoints, PlotResponse, Points};

use super::super::theme::still;
use super::chosen::{FRONT, KEPT, REST, StudyView, key};
use super::raster::{PixelCanvas, pixels};
use crate::session::{Column, OpenStudy};

/// How near (points) the pointer must be to what it picks.
const NEAR: f32 = 14.0;

/// A range of two columns of a study, and where units lie in it: shares from the upper left.
#[derive(Clone)]
struct PlotFrame {
    study: Arc<OpenStudy>,
    across: [usize; 2],
    ranges: [[f64; 2]; 2],
}

impl PlotFrame {
    fn columns(&self) -> [&Column; 2] {
        self.across.map(|k| &self.study.columns[k])
    }

    fn share(&self, unit: usize) -> Option<Vec2> {
        let columns = self.columns();
        let part = |k: usize| {
            let [low, high] = self.ranges[k];
            ((columns[k].values[unit] - low) / (high - low)) as f32
        };
        let at = vec2(part(0), 1.0 - part(1));
        (at.x.is_finite() && at.y.is_finite()).then_some(at)
    }

    fn marks(&self, units: impl Iterator<Item = usize>) -> PlotPoints<'static> {
        let at = |unit: usize| self.columns().map(|c| c.values[unit]);
        units.map(at).collect()
    }

    /// Draws all designs; what is kept lies over what is not.
    fn draw(&self, canvas: &mut PixelCanvas, kept: &[bool]) {
        let room = canvas.size();
        for over in [false, true] {
            for unit in (0..kept.len()).filter(|&unit| kept[unit] == over) {
                let colour = match (over, self.study.collected.rows[unit].allowed) {
                    (true, true) => KEPT,
                    (true, false) => REST,
                    (false, _) => REST.gamma_multiply(0.25),
                };
                if let Some(at) = self.share(unit) {
                    canvas.dot(at * room, 3.0, colour);
                }
            }
        }
    }
}

/// The plot; the unit under the pointer. A click picks it.
pub fn scatter(
    view: &mut StudyView,
    study: &Arc<OpenStudy>,
    kept: &Arc<[bool]>,
    ui: &mut Ui,
) -> Option<usize> {
    choices(view, study, ui);
    let columns = view.across.map(|k| &study.columns[k]);
    let [Some(across), Some(up)] = columns.map(|c| c.range.map(wider)) else {
        ui.weak("No design has both figures yet");
        return None;
    };
    let frame = PlotFrame {
        study: Arc::clone(study),
        across: view.across,
        ranges: [across, up],
    };
    let shown = plot(view, &frame, kept, ui);
    let [x, y] = columns;
    let name = format!("All designs: {} against {}", y.name, x.name);
    shown
        .response
        .widget_info(|| WidgetInfo::labeled(Role::Figure, true, &name));
    let found = shown.response.hover_pos().and_then(|pointer| {
        let units = (0..kept.len()).filter(|&unit| kept[unit]);
        nearest(pointer, *shown.transform.frame(), units, |unit| {
            frame.share(unit)
        })
    });
    if shown.response.clicked() {
        view.picked = found;
    }
    found
}

/// The designs as a picture, and over it those that stand out.
fn plot(
    view: &mut StudyView,
    frame: &PlotFrame,
    kept: &Arc<[bool]>,
    ui: &mut Ui,
) -> PlotResponse<()> {
    let size = ui.available_size() - vec2(0.0, 4.0);
    let key = key(view, pixels(ui.ctx(), size), &view.across, ui);
    let (of, over) = (frame.clone(), Arc::clone(kept));
    let draw = move |canvas: &mut PixelCanvas| of.draw(canvas, &over);
    let picture = (view.dots.of(key, ui.ctx(), kept.len(), draw)).map(TextureHandle::id);
    let [across, up] = frame.ranges;
    let middle = PlotPoint::new(
        f64::midpoint(across[0], across[1]),
        f64::midpoint(up[0], up[1]),
    );
    let room = vec2((across[1] - across[0]) as f32, (up[1] - up[0]) as f32);
    let strong = ui.visuals().strong_text_color();
    still(Plot::new("study"))
        .height(size.y)
        .x_axis_label(frame.columns()[0].name.clone())
        .y_axis_label(frame.columns()[1].name.clone())
        .show_x(false)
        .show_y(false)
        .label_formatter(|_| None)
        .show(ui, |plot| {
            plot.set_plot_bounds_x(across[0]..=across[1]);
            plot.set_plot_bounds_y(up[0]..=up[1]);
            if let Some(picture) = picture {
                plot.image(PlotImage::new("designs", picture, middle, room));
            }
            let front =
                (0..kept.len()).filter(|&u| kept[u] && frame.study.collected.rows[u].on_front);
            plot.points(
                Points::new("front", frame.marks(front))
                    .color(FRONT)
                    .radius(4.0),
            );
            for (unit, radius) in [(view.picked, 9.0), (view.hovered, 7.0)] {
                let ring = Points::new("looked at", frame.marks(unit.into_iter()));
                plot.points(ring.color(strong).radius(radius).filled(false));
            }
        })
}

/// Which figures are across and up.
fn choices(view: &mut StudyView, study: &OpenStudy, ui: &mut Ui) {
    // Two names and their labels.
    let width = ((ui.available_width() - 110.0) / 2.0).max(40.0);
    ui.horizontal(|ui| {
        for (k, label) in ["Across", "Up"].into_iter().enumerate() {
            let name = ui.label(label);
            let chosen = &mut view.across[k];
            ComboBox::from_id_salt(label)
                .selected_text(&study.columns[*chosen].name)
                .width(width)
                .truncate()
                .show_ui(ui, |ui| {
                    for (column, of) in study.columns.iter().enumerate() {
                        ui.selectable_value(chosen, column, &of.name);
                    }
                })
                .response
                .labelled_by(name.id);
        }
    });
}

/// A range with room around.
fn wider([low, high]: [f64; 2]) -> [f64; 2] {
    let room = (0.05 * (high - low)).max(1e-6 * high.abs()).max(1e-9);
    [low - room, high + room]
}

/// The unit whose place (a share of the frame) is nearest to the pointer, where it is near.
fn nearest(
    pointer: Pos2,
    frame: Rect,
    units: impl Iterator<Item = usize>,
    share: impl Fn(usize) -> Option<Vec2>,
) -> Option<usize> {
    let away = |unit: usize| {
        let at = frame.min + share(unit)? * frame.size();
        Some((at.distance(pointer), unit))
    };
    let found = units.filter_map(away).min_by(|a, b| a.0.total_cmp(&b.0))?;
    (found.0 < NEAR).then_some(found.1)
}

//! All designs by two of their figures.

use egui::{Color32, ComboBox, Pos2, Rect, Role, Ui, Vec2, WidgetInfo, vec2};
use egui_plot::{Plot, PlotImage, PlotPoint, PlotPoints, Points};

use super::super::theme;
use super::StudyView;
use super::raster::{Key, pixels};
use crate::session::OpenStudy;

pub const KEPT: Color32 = Color32::from_rgb(86, 180, 233);
pub const FRONT: Color32 = Color32::from_rgb(230, 159, 0);
pub const REST: Color32 = Color32::from_rgb(125, 133, 143);
/// How near (points) the pointer must be to what it picks.
const NEAR: f32 = 14.0;

/// The plot; the unit under the pointer. A click picks it.
pub fn scatter(
    view: &mut StudyView,
    study: &OpenStudy,
    kept: &[bool],
    ui: &mut Ui,
) -> Option<usize> {
    choices(view, study, ui);
    let [x, y] = view.across.map(|k| &study.columns[k]);
    let (Some(across), Some(up)) = (x.range().map(wider), y.range().map(wider)) else {
        ui.weak("No design has both figures yet");
        return None;
    };
    let size = ui.available_size() - vec2(0.0, 4.0);
    let key = key(view, study, pixels(ui.ctx(), size), &view.across, ui);
    let share = |unit: usize| {
        let part = |v: f64, [low, high]: [f64; 2]| ((v - low) / (high - low)) as f32;
        let at = vec2(part(x.values[unit], across), 1.0 - part(y.values[unit], up));
        (at.x.is_finite() && at.y.is_finite()).then_some(at)
    };
    let picture = view.dots.of(key, ui.ctx(), |canvas| {
        let room = canvas.size();
        // What is kept lies over what is not.
        for over in [false, true] {
            for unit in (0..kept.len()).filter(|&unit| kept[unit] == over) {
                let allowed = study.collected.rows[unit].allowed;
                let colour = match (over, allowed) {
                    (true, true) => KEPT,
                    (true, false) => REST,
                    (false, _) => REST.gamma_multiply(0.25),
                };
                if let Some(at) = share(unit) {
                    canvas.dot(at * room, 3.0, colour);
                }
            }
        }
    });
    let centre = PlotPoint::new(
        f64::midpoint(across[0], across[1]),
        f64::midpoint(up[0], up[1]),
    );
    let image = PlotImage::new(
        "designs",
        picture.id(),
        centre,
        Vec2::new((across[1] - across[0]) as f32, (up[1] - up[0]) as f32),
    );
    let marks = |units: &mut dyn Iterator<Item = usize>| -> PlotPoints<'static> {
        units.map(|unit| [x.values[unit], y.values[unit]]).collect()
    };
    let front =
        marks(&mut (0..kept.len()).filter(|&u| kept[u] && study.collected.rows[u].on_front));
    let shown = Plot::new("study")
        .height(size.y)
        .x_axis_label(x.name.clone())
        .y_axis_label(y.name.clone())
        .default_x_bounds(across[0], across[1])
        .default_y_bounds(up[0], up[1])
        .show_x(false)
        .show_y(false)
        .label_formatter(|_| None)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show(ui, |plot| {
            plot.set_plot_bounds_x(across[0]..=across[1]);
            plot.set_plot_bounds_y(up[0]..=up[1]);
            plot.image(image);
            plot.points(Points::new("front", front).color(FRONT).radius(4.0));
            for (unit, radius) in [(view.picked, 9.0), (view.hovered, 7.0)] {
                if let Some(unit) = unit {
                    let here = marks(&mut std::iter::once(unit));
                    let ring = Points::new("looked at", here).color(theme::CHOSEN);
                    plot.points(ring.radius(radius).filled(false));
                }
            }
        });
    let name = format!("All designs: {} against {}", y.name, x.name);
    shown
        .response
        .widget_info(|| WidgetInfo::labeled(Role::Figure, true, &name));
    let frame = *shown.transform.frame();
    let found = shown
        .response
        .hover_pos()
        .and_then(|pointer| nearest(pointer, frame, (0..kept.len()).filter(|&u| kept[u]), share));
    if shown.response.clicked() {
        view.picked = found;
    }
    found
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

/// What a picture of these columns is of.
pub fn key(
    view: &StudyView,
    study: &OpenStudy,
    size: [usize; 2],
    columns: &[usize],
    ui: &Ui,
) -> Key {
    let ranges = view
        .ranges
        .iter()
        .map(|(k, range)| (*k, range.map(f64::to_bits)));
    let of = std::ptr::from_ref(study) as usize;
    (
        of,
        size,
        ranges.collect(),
        columns.to_vec(),
        ui.visuals().dark_mode,
    )
}

/// The unit whose place (a share of the frame) is nearest to the pointer, where it is near.
pub fn nearest(
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

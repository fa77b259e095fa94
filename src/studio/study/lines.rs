//! All designs as lines over all that they have: parallel coordinates (Inselberg 1985), with a range on each axis.

use std::sync::Arc;

use egui::{Align2, Color32, FontId, Rect, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};

use super::super::theme;
use super::chosen::{FRONT, KEPT, REST, StudyView, key};
use super::raster::{PixelCanvas, pixels, show};
use crate::session::{Column, OpenStudy};

/// Lines that are drawn of those that are kept, and of the others.
const MOST: [usize; 2] = [4000, 2000];
/// Over and under the axes, for names and numbers.
const ABOVE: f32 = 48.0;
const BELOW: f32 = 18.0;
const BESIDE: f32 = 34.0;
/// Half of what an axis is taken hold of by (points).
const HOLD: f32 = 9.0;

/// The lines; a drag along an axis keeps that range, a click lets all of it in again.
pub fn parallel(
    view: &mut StudyView,
    study: &Arc<OpenStudy>,
    kept: &Arc<[bool]>,
    ui: &mut Ui,
) -> Option<usize> {
    let count = kept.iter().filter(|k| **k).count();
    ui.horizontal(|ui| {
        ui.weak(in_words(count, kept.len()));
        let any = !view.ranges.is_empty();
        let button = ui.add_enabled(any, egui::Button::new("All designs"));
        let help = "Drag along an axis to keep a range of it";
        if button.on_disabled_hover_text(help).clicked() {
            view.ranges.clear();
        }
    });
    let (area, _) = ui.allocate_exact_size(ui.available_size() - vec2(0.0, 4.0), Sense::hover());
    let inner = Rect::from_min_max(
        area.min + vec2(BESIDE, ABOVE),
        area.max - vec2(BESIDE, BELOW),
    );
    if view.shown.is_empty() || inner.width() < 40.0 || inner.height() < 20.0 {
        return None;
    }
    let key = key(view, pixels(ui.ctx(), inner.size()), &view.shown, ui);
    let (of, over, columns) = (Arc::clone(study), Arc::clone(kept), view.shown.clone());
    let draw = move |canvas: &mut PixelCanvas| draw(canvas, &of, &over, &columns);
    if let Some(picture) = view.lines.of(key, ui.ctx(), kept.len(), draw) {
        show(ui.painter(), picture, inner);
    }
    if let Some(unit) = view.looked_at() {
        let corners = path(inner.size(), &heights(study, &view.shown, unit));
        let places = corners.into_iter().map(|at| inner.min + at).collect();
        let line = Stroke::new(2.5, ui.visuals().strong_text_color());
        ui.painter().add(egui::Shape::line(places, line));
    }
    let shown = view.shown.clone();
    let (names, axes) = (stagger(shown.len()), shown.len());
    for ((k, column), name_at) in shown.into_iter().enumerate().zip(names) {
        axis(
            view,
            (study, column),
            inner,
            across(inner, k, axes),
            name_at,
            ui,
        );
    }
    None
}

fn in_words(count: usize, all: usize) -> String {
    if count == all {
        format!("{all} designs")
    } else {
        format!("{count} of {all} designs")
    }
}

fn across(inner: Rect, k: usize, axes: usize) -> f32 {
    inner.left() + inner.width() * k as f32 / (axes - 1).max(1) as f32
}

/// Names of neighbours stand at three heights, so that they keep apart.
fn stagger(count: usize) -> impl Iterator<Item = f32> {
    (0..count).map(|k| [-34.0, -20.0, -6.0][k % 3])
}

/// The last word of a key: what it belongs to would leave no room.
fn short(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// How far up an axis a value stands, as a share.
fn height(column: &Column, value: f64) -> Option<f32> {
    let [low, high] = column.range?;
    let share = (value - low) / (high - low).max(f64::MIN_POSITIVE);
    value.is_finite().then_some(share as f32)
}

/// How far up each of these columns a unit stands.
fn heights(study: &OpenStudy, columns: &[usize], unit: usize) -> Vec<Option<f32>> {
    let of = |&k: &usize| height(&study.columns[k], study.columns[k].values[unit]);
    columns.iter().map(of).collect()
}

/// The corners of a line in a room of this size; what has no value is passed over.
fn path(room: Vec2, heights: &[Option<f32>]) -> Vec<Vec2> {
    let step = room.x / (heights.len() - 1).max(1) as f32;
    let corner =
        |(k, h): (usize, &Option<f32>)| Some(vec2(step * k as f32, room.y * (1.0 - (*h)?)));
    heights.iter().enumerate().filter_map(corner).collect()
}

fn draw(canvas: &mut PixelCanvas, study: &OpenStudy, kept: &[bool], columns: &[usize]) {
    let room = canvas.size() - vec2(1.0, 1.0);
    let mut line = |unit: usize, wider: i64, colour: Color32| {
        let corners = path(room, &heights(study, columns, unit));
        for pair in corners.windows(2) {
            canvas.line(pair[0], pair[1], wider, colour);
        }
    };
    let rows = &study.collected.rows;
    for (over, most) in [(false, MOST[1]), (true, MOST[0])] {
        let units: Vec<usize> = (0..kept.len())
            .filter(|&unit| kept[unit] == over && rows[unit].state() == "done")
            .collect();
        // Evenly, where there are more than can be told apart.
        let step = units.len().div_ceil(most).max(1);
        let drawn = units.len().div_ceil(step).max(1) as f32;
        let cover = (60.0 / drawn).clamp(0.06, 0.6);
        let colour = if over { KEPT } else { REST.gamma_multiply(0.5) };
        for &unit in units.iter().step_by(step) {
            line(unit, 0, colour.gamma_multiply(cover));
        }
    }
    for unit in (0..kept.len()).filter(|&unit| kept[unit] && rows[unit].on_front) {
        line(unit, 1, FRONT.gamma_multiply(0.9));
    }
}

/// One axis with its name, its ends and its range.
fn axis(
    view: &mut StudyView,
    (study, column): (&OpenStudy, usize),
    inner: Rect,
    x: f32,
    name_at: f32,
    ui: &mut Ui,
) {
    let of = &study.columns[column];
    let Some([low, high]) = of.range else {
        return;
    };
    let hold = Rect::from_x_y_ranges(x - HOLD..=x + HOLD, inner.y_range());
    let response = ui.interact(
        hold,
        ui.scope_id().with(("axis", column)),
        Sense::click_and_drag(),
    );
    response
        .widget_info(|| WidgetInfo::labeled(Role::Slider, true, format!("Range of {}", of.name)));
    let value = |y: f32| {
        let share = f64::from((inner.bottom() - y) / inner.height()).clamp(0.0, 1.0);
        low + share * (high - low)
    };
    if let (true, Some(from), Some(to)) = (
        response.dragged(),
        ui.input(|i| i.pointer.press_origin()),
        response.interact_pointer_pos(),
    ) {
        let (a, b) = (value(from.y), value(to.y));
        view.ranges.insert(column, [a.min(b), a.max(b)]);
    } else if response.clicked() {
        view.ranges.remove(&column);
    }
    let hovered = response.hovered();
    response.on_hover_text("Drag along it to keep a range, click to let all in");
    let range = view.ranges.get(&column).copied();
    paint_axis(of, range, (inner, x, name_at), hovered, ui);
}

fn paint_axis(
    of: &Column,
    range: Option<[f64; 2]>,
    (inner, x, name_at): (Rect, f32, f32),
    hovered: bool,
    ui: &Ui,
) {
    let Some([low, high]) = of.range else {
        return;
    };
    let painter = ui.painter();
    let visuals = ui.visuals();
    let strong = visuals.text_color();
    let width = if hovered { 2.0 } else { 1.0 };
    painter.vline(x, inner.y_range(), Stroke::new(width, strong));
    if let Some([from, to]) = range {
        let y = |v: f64| inner.bottom() - ((v - low) / (high - low)) as f32 * inner.height();
        let range = Rect::from_x_y_ranges(x - 5.0..=x + 5.0, y(to)..=y(from));
        painter.rect(
            range,
            2.0,
            theme::CHOSEN.gamma_multiply(0.35),
            Stroke::new(1.5, theme::CHOSEN),
            egui::StrokeKind::Middle,
        );
    }
    let text = |at: egui::Pos2, align: Align2, text: String, size: f32| {
        painter.text(at, align, text, FontId::proportional(size), strong)
    };
    text(
        pos2(x, inner.top() + name_at),
        Align2::CENTER_BOTTOM,
        short(&of.name).to_owned(),
        11.0,
    );
    let end = |v: f64| {
        of.words
            .get(v as usize)
            .cloned()
            .unwrap_or_else(|| crate::plain::digits(v))
    };
    text(
        pos2(x, inner.bottom() + 3.0),
        Align2::CENTER_TOP,
        end(low),
        10.5,
    );
    text(
        pos2(x + 4.0, inner.top()),
        Align2::LEFT_TOP,
        end(high),
        10.5,
    );
}

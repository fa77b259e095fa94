//! The tab “Trade”: the front as a plot that is clicked in, the dial, and the front as a table.

use egui::{Color32, DragValue, RichText, Role, Ui, WidgetInfo};
use egui_plot::{GridMark, Line, Plot, PlotPoint, PlotPoints, PlotTransform, Points};

use super::action::ProjectChange;
use super::ask::Ask;
use super::commands::UiCommand;
use super::paint::empty;
use super::theme;
use crate::session::{Promise, Task};
use crate::trade::{TradeConstraint, TradeSetting, knobs};

const FRONT: Color32 = Color32::from_rgb(86, 180, 233);
const OTHER: Color32 = Color32::from_rgb(125, 133, 143);
/// How near (points) the pointer must be to what it picks.
const NEAR: f32 = 16.0;
const SIDE: f32 = 430.0;

/// The dial, as it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Dial {
    asked_s: f64,
    asked_mm: f64,
    /// Settings to have measured in the end.
    pub count: usize,
}

impl Default for Dial {
    fn default() -> Self {
        Self {
            asked_s: 10.0,
            asked_mm: 1.0,
            count: 40,
        }
    }
}

/// A measured point as it is drawn: seconds by the clock here, and mean error (mm).
struct DrawnPoint {
    at: [f64; 2],
    setting: TradeSetting,
    on_front: bool,
    words: String,
}

/// The tab.
pub fn trade_tab(ask: &mut Ask<'_>, dial: &mut Dial, ui: &mut Ui) {
    let drawn = drawn_points(ask);
    ui.horizontal_top(|ui| {
        let width = (ui.available_width() - SIDE).max(220.0);
        let height = ui.available_height();
        ui.allocate_ui(egui::vec2(width, height), |ui| {
            if drawn.is_empty() {
                empty(
                    ui,
                    "Nothing is measured of this project yet. “Measure the trade” runs it at many settings and judges each by one model finer than all of them",
                );
            } else if let Some(setting) = trade_plot(ask, ui, &drawn) {
                ask.act(ProjectChange::ApplySetting(Box::new(setting)));
            }
        });
        ui.separator();
        egui::ScrollArea::vertical()
            .id_salt("trade")
            .auto_shrink(false)
            .show(ui, |ui| ui.vertical(|ui| trade_side(ask, dial, ui, &drawn)));
    });
}

fn drawn_points(ask: &Ask<'_>) -> Vec<DrawnPoint> {
    let project = ask.project();
    let points = ask.session.measured_points();
    let best = crate::trade::front(project, &points);
    let clock = ask.session.trade_clock();
    let drawn = points.iter().filter(|p| p.setting.answers(project));
    drawn
        .filter_map(|p| {
            let m = p.measured()?;
            let seconds = m.cpu_seconds * clock;
            (seconds > 0.0 && m.error_mm > 0.0).then(|| DrawnPoint {
                at: [seconds, m.error_mm],
                setting: p.setting,
                on_front: best.iter().any(|b| std::ptr::eq(*b, p)),
                words: format!(
                    "{:.2} mm mean, {:.2} mm median, {seconds:.1} s\n{}",
                    m.error_mm,
                    m.median_mm,
                    p.setting.in_words()
                ),
            })
        })
        .collect()
}

/// The plot; the setting that was clicked on.
fn trade_plot(ask: &Ask<'_>, ui: &mut Ui, drawn: &[DrawnPoint]) -> Option<TradeSetting> {
    let project = ask.project();
    let marks = |on: bool| -> PlotPoints<'static> {
        let some = drawn.iter().filter(|d| d.on_front == on);
        some.map(|d| d.at.map(f64::log10)).collect()
    };
    let mut front: Vec<[f64; 2]> = (drawn.iter().filter(|d| d.on_front))
        .map(|d| d.at.map(f64::log10))
        .collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let now = drawn.iter().find(|d| d.setting.is_of(project));
    let shown = theme::still(Plot::new("trade"))
        .height(ui.available_height() - 4.0)
        .x_axis_label("seconds to the judged answer")
        .y_axis_label("mean error (mm)")
        .x_axis_formatter(|mark, _| round(mark.value))
        .y_axis_formatter(|mark, _| round(mark.value))
        .x_grid_spacer(|input| decades(input.bounds))
        .y_grid_spacer(|input| decades(input.bounds))
        .show_x(false)
        .show_y(false)
        .label_formatter(|_| None)
        .show(ui, |plot| {
            plot.points(
                Points::new("measured", marks(false))
                    .color(OTHER)
                    .radius(3.5),
            );
            plot.line(
                Line::new("front line", PlotPoints::from(front))
                    .color(FRONT)
                    .width(2.0),
            );
            plot.points(Points::new("front", marks(true)).color(FRONT).radius(5.0));
            if let Some(now) = now {
                let here: PlotPoints = vec![now.at.map(f64::log10)].into();
                let ring = Points::new("now", here).color(theme::CHOSEN).radius(9.0);
                plot.points(ring.filled(false));
            }
        });
    shown.response.widget_info(|| {
        WidgetInfo::labeled(
            Role::Figure,
            true,
            "Error against time of all measured settings",
        )
    });
    let pointer = shown.response.hover_pos()?;
    let near = nearest(drawn, &shown.transform, pointer)?;
    let clicked = shown.response.clicked();
    let ctx = ui.ctx().clone();
    ctx.set_cursor_icon(egui::CursorIcon::PointingHand);
    shown
        .response
        .on_hover_text_at_pointer(format!("{}\nClick to set the project to this", near.words));
    clicked.then_some(near.setting)
}

fn trade_side(ask: &mut Ask<'_>, dial: &mut Dial, ui: &mut Ui, drawn: &[DrawnPoint]) {
    let running = ask.session.jobs.runs(Task::Trade);
    ui.horizontal(|ui| {
        let button = ui.add_enabled(!running, egui::Button::new("Measure the trade"));
        let button = button.on_hover_text("Runs this project at many settings on this machine, in the background; ended on the way, it keeps what it has");
        if button.clicked() {
            ask.command(UiCommand::MeasureTrade);
        }
        let name = ui.label("settings");
        ui.add(DragValue::new(&mut dial.count).range(8..=400))
            .labelled_by(name.id);
    });
    ui.weak(ask.session.trade_in_words());
    if let Some(line) = ask.session.promise_line() {
        let broken = ask.session.promise().is_some_and(Promise::is_broken);
        let text = RichText::new(format!("Last run: {line}"));
        ui.add(
            egui::Label::new(if broken {
                text.color(theme::STALE)
            } else {
                text
            })
            .wrap(),
        );
    }
    if drawn.is_empty() {
        return;
    }
    ui.add_space(4.0);
    dial_rows(ask, dial, ui);
    ui.add_space(4.0);
    front_table(ask, ui, drawn);
    knob_table(ask, ui);
}

fn dial_rows(ask: &mut Ask<'_>, dial: &mut Dial, ui: &mut Ui) {
    let mut asked = None;
    egui::Grid::new("dial").num_columns(3).show(ui, |ui| {
        let name = ui.label("An answer within");
        let seconds = &mut dial.asked_s;
        ui.add(
            DragValue::new(seconds)
                .range(0.1..=1e5)
                .speed(0.5)
                .suffix(" s"),
        )
        .labelled_by(name.id);
        if ui.button("Answer in time").clicked() {
            asked = Some(TradeConstraint::Within(dial.asked_s));
        }
        ui.end_row();
        let name = ui.label("Of the best within");
        let mm = &mut dial.asked_mm;
        ui.add(
            DragValue::new(mm)
                .range(0.0..=1e3)
                .speed(0.05)
                .suffix(" mm"),
        )
        .labelled_by(name.id);
        if ui.button("Answer as good").clicked() {
            asked = Some(TradeConstraint::OfTheBest(dial.asked_mm));
        }
        ui.end_row();
    });
    if let Some(asked) = asked {
        ask.act(ProjectChange::AskFor(asked));
    }
}

/// The front as rows, for those who do not point.
fn front_table(ask: &mut Ask<'_>, ui: &mut Ui, drawn: &[DrawnPoint]) {
    let mut rows: Vec<&DrawnPoint> = drawn.iter().filter(|d| d.on_front).collect();
    rows.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
    let mut chosen = None;
    egui::Grid::new("front")
        .num_columns(3)
        .striped(true)
        .show(ui, |ui| {
            ui.strong("time");
            ui.strong("mean error");
            ui.end_row();
            for row in rows {
                ui.monospace(format!("{:6.1} s", row.at[0]));
                ui.monospace(format!("{:6.2} mm", row.at[1]));
                let now = row.setting.is_of(ask.project());
                let button =
                    ui.add_enabled(!now, egui::Button::new(if now { "In use" } else { "Use" }));
                let name = format!("Use {:.1} s, {:.2} mm", row.at[0], row.at[1]);
                if button
                    .on_hover_text(&row.words)
                    .accessible_name(name)
                    .clicked()
                {
                    chosen = Some(row.setting);
                }
                ui.end_row();
            }
        });
    if let Some(setting) = chosen {
        ask.act(ProjectChange::ApplySetting(Box::new(setting)));
    }
}

/// What a step of each knob brings.
fn knob_table(ask: &Ask<'_>, ui: &mut Ui) {
    egui::CollapsingHeader::new("What each knob buys").show(ui, |ui| {
        let (reports, spread) = knobs(&ask.session.measured_points());
        ui.weak(format!(
            "One step each; with another seed alone the error moves by {spread:.0} %"
        ));
        egui::Grid::new("knobs")
            .num_columns(3)
            .striped(true)
            .show(ui, |ui| {
                for r in reports {
                    ui.label(r.knob.name());
                    ui.monospace(format!("time {:+.0} %", r.cpu_percent));
                    ui.monospace(format!("error {:+.0} %", r.error_percent));
                    ui.end_row();
                }
            });
    });
}

/// What is nearest to the pointer, where it is near.
fn nearest<'a>(
    drawn: &'a [DrawnPoint],
    transform: &PlotTransform,
    pointer: egui::Pos2,
) -> Option<&'a DrawnPoint> {
    let away = |d: &DrawnPoint| {
        let [x, y] = d.at.map(f64::log10);
        transform
            .position_from_point(&PlotPoint::new(x, y))
            .distance(pointer)
    };
    let found = drawn.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
    (away(found) < NEAR).then_some(found)
}

/// A power of ten as it is read.
fn round(log: f64) -> String {
    let value = 10f64.powf(log);
    if value < 0.95 {
        format!("{value:.2}")
    } else if value < 9.5 {
        format!("{value:.1}").trim_end_matches(".0").to_owned()
    } else {
        format!("{value:.0}")
    }
}

/// Grid lines at 1, 2 and 5 of every decade.
fn decades((low, high): (f64, f64)) -> Vec<GridMark> {
    (-3..7)
        .flat_map(|decade| [1.0, 2.0, 5.0].map(|r: f64| r.log10() + f64::from(decade)))
        .filter(|v| (low..=high).contains(v))
        .map(|value| GridMark {
            value,
            // Every one of them has room for its label.
            step_size: 10.0,
        })
        .collect()
}

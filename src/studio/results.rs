//! The lower side: error against number of gauges, with failed gauges, the chosen sites, the reduction.

use egui::{Color32, Response, RichText, Role, Ui, WidgetInfo};
use egui_plot::{Corner, HLine, Legend, Line, LineStyle, Plot, PlotPoints, PlotUi, Points};

use super::action::ProjectChange;
use super::ask::Ask;
use super::by_force::{force_table, has_forces};
use super::commands::UiCommand;
use super::paint::empty;
use super::theme::{kept_colour, still};
use super::view::{Tab, Tool};
use crate::design::curves::{curve, failure_curve, failure_ways};
use crate::evaluation::EstimatorKind;
use crate::io::artifacts::{range, signal_to_noise, signal_unit};
use crate::placement::SensorSet;
use crate::placement::expected_error::ASSUMES;
use crate::session::{NOBODY_REDUCES, Session};

/// One for each selector; told apart by colour-blind eyes too (Okabe and Ito).
const COLOURS: [Color32; 5] = [
    Color32::from_rgb(86, 180, 233),
    Color32::from_rgb(230, 159, 0),
    Color32::from_rgb(0, 158, 115),
    Color32::from_rgb(204, 121, 167),
    Color32::from_rgb(240, 228, 66),
];

/// A plot that stays as it is: nothing is dragged or zoomed in it.
fn plot(
    id: impl std::hash::Hash + std::fmt::Debug,
    height: f32,
    corner: Corner,
    x: &str,
    y: &str,
) -> Plot<'static> {
    still(Plot::new(id))
        .height(height)
        .legend(Legend::default().position(corner))
        .x_axis_label(x.to_owned())
        .x_grid_spacer(egui_plot::uniform_grid_spacer(|_| [10.0, 5.0, 1.0]))
        .y_axis_label(y.to_owned())
        .include_y(0.0)
}

/// One curve with its points.
fn draw(plot: &mut PlotUi<'_>, name: &str, points: &[(f64, f64)], colour: Color32, dashed: bool) {
    let points: Vec<[f64; 2]> = points.iter().map(|&(x, y)| [x, y]).collect();
    let mut line = Line::new(name, PlotPoints::from(points.clone()))
        .color(colour)
        .width(2.0);
    if dashed {
        line = line.style(LineStyle::dashed_dense());
    }
    plot.line(line);
    plot.points(Points::new(name, points).color(colour).radius(3.0));
}

fn figure(response: &Response, label: &str) {
    response.widget_info(|| WidgetInfo::labeled(Role::Figure, true, label));
}

/// The names of the tabs, and what holds for all that a design found; whether there is anything to show below.
pub fn header(ask: &mut Ask<'_>, ui: &mut Ui) -> bool {
    // A resizable panel that is not filled shrinks a little every frame.
    ui.set_min_height(ui.available_height());
    ui.add_space(4.0);
    let beside = ui.horizontal(|ui| {
        for tab in Tab::ALL {
            ui.selectable_value(&mut ask.view.tab, tab, tab.name());
        }
        let is_roomy = ui.available_width() >= ROOM_BESIDE_TABS;
        if is_roomy {
            labels(ask, ui);
        }
        is_roomy
    });
    if !beside.inner && (ask.session.results.design.is_some() || is_by_hand(ask)) {
        ui.horizontal(|ui| labels(ask, ui));
    }
    ui.separator();
    let any = ask.session.results.design.is_some()
        || ask.view.compared(ask.project()).next().is_some()
        || !ask.view.tab.is_of_design();
    if !any {
        empty(ui, &nothing_judged(ask.session));
    }
    any
}

/// Why there are no figures yet.
fn nothing_judged(session: &Session) -> String {
    let mut running = session.jobs.running().iter();
    if session.drive.selects() && running.any(|job| job.task.is_of_pipeline()) {
        return "Gauges are being selected, then judged on unseen touches".into();
    }
    let press = "Press “Select gauges” to choose the sites and judge them on unseen touches";
    session.gauges_before_selection().map_or_else(
        || format!("Nothing selected yet. {press}"),
        |shown| format!("{shown}, and not judged yet. {press}"),
    )
}

/// Width in which what holds for all that a design found is beside the names of the tabs; below it is under them.
const ROOM_BESIDE_TABS: f32 = 300.0;

/// What holds for all that a design found.
fn labels(ask: &Ask<'_>, ui: &mut Ui) {
    if ask.session.design_holds() == Some(false) && ask.view.tab.is_of_design() {
        ui.colored_label(super::theme::STALE, "of settings that have changed since");
    }
    // What matters most comes first: what follows is cut where there is no room.
    by_hand_label(ask, ui);
    doubt_label(ask, ui);
    certificate_label(ask, ui);
}

/// Beside every figure of a design that cannot be trusted: that it cannot, and why.
fn doubt_label(ask: &Ask<'_>, ui: &mut Ui) {
    let doubts = ask
        .session
        .results
        .design
        .as_ref()
        .map_or_else(Vec::new, |d| d.value.design.doubts());
    if doubts.is_empty() || !ask.view.tab.is_of_design() {
        return;
    }
    let numbers: Vec<&str> = doubts.iter().map(|d| d.number).collect();
    let words: Vec<&str> = doubts.iter().map(|d| d.words.as_str()).collect();
    let text = format!("not to be trusted: {}", numbers.join(", "));
    ui.add(cut(RichText::new(text).color(super::theme::ERROR)))
        .on_hover_text(words.join("\n"));
}

/// How far the selected gauges are at most from the best ones, while they stand as they were selected.
fn certificate_label(ask: &Ask<'_>, ui: &mut Ui) {
    let set = ask
        .session
        .results
        .design
        .as_ref()
        .and_then(|d| d.value.design.chosen_set());
    let words = set.and_then(SensorSet::certified);
    if let Some(words) = words.filter(|_| ask.view.tab.is_of_design() && ask.session.as_designed())
    {
        divide(ui);
        // Beside the tabs there is room for the figure.
        let brief = words
            .split_once(" possible (")
            .map_or(&*words, |(brief, _)| brief);
        ui.add(cut(brief))
            .on_hover_text(format!("{words}. {ASSUMES}"));
    }
}

/// Whether the gauges are where a hand has put them, and it is known what that does.
fn is_by_hand(ask: &Ask<'_>) -> bool {
    let sites = &ask.project().selection.sites;
    ask.session.knows_hand() && !sites.is_empty() && !ask.session.as_designed()
}

/// A line between two labels of a row.
fn divide(ui: &mut Ui) {
    if ui.min_rect().width() > 0.0 {
        ui.separator();
    }
}

/// What gauges that were moved by hand do to the error.
fn by_hand_label(ask: &Ask<'_>, ui: &mut Ui) {
    if !is_by_hand(ask) {
        return;
    }
    let text = match ask.session.by_hand_error() {
        (Some(expected), Some(judged)) => format!(
            "by hand: {expected:.2} mm {}; {judged:.2} mm judged on unseen touches",
            expected_of(ask)
        ),
        (None, Some(judged)) => format!("by hand: {judged:.2} mm judged on unseen touches"),
        (Some(mm), None) => format!("by hand: {mm:.2} mm {}, judging …", expected_of(ask)),
        (None, None) => "by hand: …".into(),
    };
    let result = ask.session.results.design.as_ref();
    let chosen = result.and_then(|d| d.value.design.chosen_row());
    let beside = chosen.map_or(String::new(), |r| {
        format!("; as selected judged {:.2} mm", r.error_mm)
    });
    divide(ui);
    // What is expected is the same while the hand moves and after.
    let brief = text.split([';', ',']).next().unwrap_or(&text).to_owned();
    ui.add(cut(RichText::new(brief).color(super::theme::TOUCHED)))
        .on_hover_text(text + &beside);
}

/// A label that is cut rather than make the panel wider than the window; the pointer on it shows all of it.
fn cut(words: impl Into<egui::WidgetText>) -> egui::Label {
    egui::Label::new(words).truncate()
}

/// What an estimate of gauges put by hand is of: not what a judge says, which is as drawn and at one force.
fn expected_of(ask: &Ask<'_>) -> String {
    if !ask.session.is_matched() {
        return "estimated".into();
    }
    let [lightest, hardest] = ask.project().touch.forces_n;
    format!("expected as built over {lightest} to {hardest} N")
}

fn regions(ask: &Ask<'_>) -> Vec<String> {
    let designed = ask
        .session
        .results
        .design
        .iter()
        .flat_map(|d| &d.value.design.evaluation.rows);
    let kept = ask
        .view
        .compared(ask.project())
        .flat_map(|(_, k)| &k.errors);
    let mut regions: Vec<String> = Vec::new();
    for region in designed.map(|r| &r.region).chain(kept.map(|e| &e.region)) {
        if !regions.contains(region) {
            regions.push(region.clone());
        }
    }
    regions
}

/// The tab: error against number of gauges, a plot for each region, and what the chosen ones do at each force.
pub fn error_plots(ask: &Ask<'_>, ui: &mut Ui) {
    let regions = regions(ask);
    let height = ui.available_height() - 26.0;
    let design = (ask.session.results.design.as_ref()).map(|d| &d.value.design);
    let design = design.filter(|d| has_forces(d));
    let beside = if design.is_some() {
        FORCE_TABLE.min(0.5 * ui.available_width())
    } else {
        0.0
    };
    let plots = egui::vec2(ui.available_width() - beside, ui.available_height());
    ui.horizontal_top(|ui| {
        ui.allocate_ui_with_layout(plots, egui::Layout::top_down(egui::Align::Min), |ui| {
            region_plots(ask, ui, &regions, height);
        });
        if let Some(design) = design {
            let is_moved = !ask.session.as_designed();
            ui.vertical(|ui| force_table(design, is_moved, ui));
        }
    });
}

/// Width of what the chosen gauges do at each force, with all its columns.
const FORCE_TABLE: f32 = 370.0;

fn region_plots(ask: &Ask<'_>, ui: &mut Ui, regions: &[String], height: f32) {
    ui.columns(regions.len().max(1), |columns| {
        for (ui, region) in columns.iter_mut().zip(regions) {
            ui.label(RichText::new(region).strong());
            let id = ("error", region);
            let shown = plot(id, height, Corner::RightTop, "gauges", "mean error (mm)")
                .show(ui, |plot| error_curves(ask, plot, region));
            let label = format!("Error against number of gauges, {region}");
            figure(&shown.response, &label);
        }
    });
}

fn error_curves(ask: &Ask<'_>, plot: &mut PlotUi<'_>, region: &str) {
    if let Some(design) = ask.session.results.design.as_ref().map(|d| &d.value.design) {
        for (k, selection) in design.selections.iter().enumerate() {
            let points = curve(design, selection.selector, region);
            let colour = COLOURS[k % COLOURS.len()];
            draw(plot, selection.selector.title(), &points, colour, false);
        }
        if let Some(row) = design.evaluation.baseline(region) {
            let name = format!("all {} candidates", row.set.sensors);
            plot.hline(HLine::new(name, row.error_mm).color(Color32::GRAY));
        }
    }
    for (k, kept) in ask.view.compared(ask.project()) {
        let rows = kept.errors.iter().filter(|e| e.region == *region);
        let points: Vec<(f64, f64)> = rows.map(|e| (e.sensors as f64, e.mean_mm)).collect();
        draw(plot, &kept.name, &points, kept_colour(k), true);
    }
}

/// The tab: error against number of failed gauges.
pub fn failure_plots(ask: &Ask<'_>, ui: &mut Ui) {
    let height = ui.available_height() - 26.0;
    let design = ask.session.results.design.as_ref().map(|d| &d.value.design);
    let by = design.map_or(EstimatorKind::Svr, |d| d.evaluation.judging.estimator());
    let ways = failure_ways(by);
    ui.columns(ways.len(), |columns| {
        for (ui, &(retrained, title)) in columns.iter_mut().zip(ways) {
            ui.label(RichText::new(title).strong());
            let id = ("failures", retrained);
            let shown = plot(
                id,
                height,
                Corner::LeftTop,
                "failed gauges",
                "mean error (mm)",
            )
            .show(ui, |plot| failure_curves(ask, plot, retrained));
            figure(&shown.response, title);
        }
    });
}

fn failure_curves(ask: &Ask<'_>, plot: &mut PlotUi<'_>, retrained: bool) {
    let sets = ask
        .session
        .results
        .design
        .iter()
        .flat_map(|d| &d.value.design.evaluation.failures);
    for (k, set) in sets.enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        draw(
            plot,
            set.set.chooser.title(),
            &failure_curve(set, retrained),
            colour,
            false,
        );
    }
    for (k, kept) in ask.view.compared(ask.project()) {
        let rows = kept
            .failures
            .iter()
            .filter(|f| f.retrained == retrained || f.failed == 0);
        let points: Vec<(f64, f64)> = rows.map(|f| (f.failed as f64, f.mean_mm)).collect();
        draw(plot, &kept.name, &points, kept_colour(k), true);
    }
}

/// The tab: what is left unexplained by so many sites.
pub fn reduction_plot(ask: &Ask<'_>, ui: &mut Ui) {
    let Some(result) = &ask.session.results.design else {
        return;
    };
    let Some(candidates) = &result.value.design.candidates else {
        let feasible = result.value.design.reduced.feasible.len();
        empty(
            ui,
            &format!("All {feasible} feasible sites are candidates. {NOBODY_REDUCES}"),
        );
        return;
    };
    let points: Vec<(f64, f64)> = (candidates.curve.iter())
        .map(|p| (p.sites as f64, 100.0 * p.unexplained))
        .collect();
    let height = ui.available_height() - 4.0;
    let target = 100.0 * result.value.snapshot.project.candidates.unexplained;
    let shown = still(Plot::new("reduction"))
        .height(height)
        .legend(Legend::default().position(Corner::RightTop))
        .x_axis_label("sites kept")
        .y_axis_label("held-out variance unexplained (%)")
        .include_y(0.0)
        .show(ui, |plot| {
            draw(plot, "PCA-QR", &points, COLOURS[0], false);
            plot.hline(HLine::new("asked for", target).color(Color32::GRAY));
        });
    figure(&shown.response, "Unexplained variance against sites kept");
}

/// The project's gauges; with a design also what they will report.
pub fn gauge_table(ask: &mut Ask<'_>, ui: &mut Ui) {
    let sites = ask.project().selection.sites.clone();
    if sites.is_empty() {
        empty(
            ui,
            "No gauges chosen yet. Press “Select gauges”, or put some with the tool “Gauges” and Ctrl-click",
        );
        return;
    }
    let designed = ask.session.as_designed();
    let mut asked = None;
    egui::ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        egui::Grid::new("gauges")
            .num_columns(11)
            .striped(true)
            .spacing([18.0, 3.0])
            .show(ui, |ui| {
                for title in ["Gauge", "Pinned", "x (mm)", "y (mm)", "z (mm)", "Direction"] {
                    ui.strong(title);
                }
                if let Some(d) = ask.session.results.design.as_ref().filter(|_| designed) {
                    let unit = signal_unit(d.value.design.simulated.dataset.signal);
                    ui.strong(format!("Signal, from – to ({unit})"));
                    ui.strong("Rms strain (µε)");
                    ui.strong("Signal to noise");
                }
                ui.end_row();
                for (k, site) in sites.iter().enumerate() {
                    if let Some(what) = gauge_row(ask, ui, k, site) {
                        asked = Some((k, what));
                    }
                    if designed {
                        report_cells(ask, ui, k);
                    }
                    ui.end_row();
                }
            });
    });
    match asked {
        None => {}
        Some((k, RowPressed::Pick)) => {
            ask.view.picked = vec![k];
            ask.view.take(Tool::Gauges);
        }
        Some((k, RowPressed::Add)) => ask.view.picked.push(k),
        Some((k, RowPressed::Frame)) => {
            ask.view.picked = vec![k];
            ask.command(UiCommand::FramePicked);
        }
        Some((k, RowPressed::Pin)) => {
            ask.view.picked = vec![k];
            ask.act(ProjectChange::PinGauges(vec![k]));
        }
    }
}

/// Number, pin, place and direction of a gauge, and what was pressed.
fn gauge_row(
    ask: &Ask<'_>,
    ui: &mut Ui,
    k: usize,
    site: &crate::project::ChosenSite,
) -> Option<RowPressed> {
    let picked = ask.view.picked.contains(&k);
    let number = RichText::new(format!("{:>3}", k + 1)).monospace();
    let button = ui
        .add(egui::Button::selectable(picked, number))
        .on_hover_text("Pick it; double-click comes near to it")
        .accessible_name(format!("Gauge {}", k + 1));
    let shift = ui.input(|i| i.modifiers.shift);
    let mut asked = match (button.double_clicked(), button.clicked()) {
        (true, _) => Some(RowPressed::Frame),
        (_, true) if shift && !picked => Some(RowPressed::Add),
        (_, true) => Some(RowPressed::Pick),
        _ => None,
    };
    let mut pinned = ask.session.pin_of(k).is_some();
    let tick = ui
        .checkbox(&mut pinned, "")
        .on_hover_text("Selections must have a gauge here");
    if tick
        .accessible_name(format!("Pin gauge {}", k + 1))
        .changed()
    {
        asked = Some(RowPressed::Pin);
    }
    for x in site.position_mm {
        ui.monospace(format!("{x:8.2}"));
    }
    let [x, y, z] = site.direction;
    ui.monospace(format!("{x:+.3} {y:+.3} {z:+.3}"));
    asked
}

/// What a gauge of the design will report.
fn report_cells(ask: &Ask<'_>, ui: &mut Ui, k: usize) {
    let Some(d) = &ask.session.results.design else {
        return;
    };
    let dataset = &d.value.design.simulated.dataset;
    let index = d.value.design.chosen()[k];
    let (low, high) = range(dataset, index);
    let rms = dataset.sites[index].rms_strain;
    let decimals = if signal_unit(dataset.signal) == "mm" {
        3
    } else {
        0
    };
    ui.monospace(format!("{low:8.decimals$} – {high:8.decimals$}"));
    ui.monospace(format!("{:7.0}", rms * 1e6));
    ui.monospace(
        signal_to_noise(&d.value.snapshot, rms).map_or("–".into(), |r| format!("{r:7.0}")),
    );
}

/// What was pressed in a row of the table.
enum RowPressed {
    Pick,
    Add,
    Frame,
    Pin,
}

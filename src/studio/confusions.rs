//! Which touches the gauges take for each other, over the limb and as a table.

use egui::{Align2, Color32, Painter, Stroke, Ui};
use glam::DVec3;

use super::action::WindowAction;
use super::ask::Ask;
use super::paint::{LimbLook, empty, label};
use super::view::{Field, Pane, Tab};
use crate::placement::expected_error::MistakenPair;
use crate::session::TakenFor;

/// The worst pairs as lines, and what the place that is pointed at is taken for.
pub fn paint_confusions(look: LimbLook<'_>, painter: &Painter, pane: Pane) {
    if look.view.field != Field::Expected && look.view.tab != Tab::Confusions {
        return;
    }
    let pairs = look.session.worst_confusions();
    for (k, pair) in pairs.iter().flat_map(|pairs| pairs.iter()).enumerate() {
        let looked_at = look.view.looked_at == Some(k);
        paint_pair(look, painter, pane, pair, looked_at);
    }
    let pointed = look
        .view
        .hover
        .filter(|_| look.view.field == Field::Expected);
    if let Some(taken) = pointed.and_then(|at| look.session.taken_for(at)) {
        paint_mistaken(look, painter, pane, taken);
    }
}

fn paint_pair(
    look: LimbLook<'_>,
    painter: &Painter,
    pane: Pane,
    pair: &MistakenPair,
    looked_at: bool,
) {
    let place = |mm: DVec3| look.place_in(pane, mm / 1000.0);
    let (Some(from), Some(to)) = (place(pair.from_mm), place(pair.taken.place_mm)) else {
        return;
    };
    let (width, ink) = if looked_at {
        (2.5, Color32::WHITE)
    } else {
        (1.0, Color32::from_white_alpha(130))
    };
    painter.line_segment([from, to], Stroke::new(width, ink));
    for end in [from, to] {
        painter.circle(end, 3.5, ink, Stroke::new(1.0, Color32::BLACK));
    }
}

fn paint_mistaken(look: LimbLook<'_>, painter: &Painter, pane: Pane, answer: &TakenFor) {
    let Some(here) = look.place_in(pane, answer.place) else {
        return;
    };
    painter.circle_stroke(here, 7.0, Stroke::new(2.0, Color32::WHITE));
    for taken in &answer.taken {
        let Some(there) = look.place_in(pane, taken.place_mm / 1000.0) else {
            continue;
        };
        let alpha = (90.0 + 165.0 * taken.share).min(255.0) as u8;
        let ink = Color32::from_white_alpha(alpha);
        painter.circle(there, 5.0, ink, Stroke::new(1.0, Color32::BLACK));
        let text = format!("{:.0} %", 100.0 * taken.share);
        let above = there - egui::vec2(0.0, 9.0);
        label(painter, above, Align2::CENTER_BOTTOM, &text, Color32::WHITE);
    }
}

/// The tab: the worst confusions, and a way to each.
pub fn confusions_tab(ask: &mut Ask<'_>, ui: &mut Ui) {
    let Some(pairs) = ask.session.worst_confusions() else {
        let text = match (
            ask.session.simulation_holds(),
            ask.session.gauge_places().is_empty(),
        ) {
            (_, true) => "No gauges yet: their confusions are listed here",
            (Some(true), _) => "Looking for touches that are taken for each other …",
            _ => "Press “Simulate” to see which touches the gauges take for each other",
        };
        return empty(ui, text);
    };
    let force = ask.project().touch.force_n;
    if pairs.is_empty() {
        let text = format!("At {force} N no touch is taken for one elsewhere");
        return empty(ui, &text);
    }
    ui.weak(format!(
        "Touches of {force} N that are taken for others, the costliest first"
    ));
    if let Some(k) = confusion_table(ask, ui, &pairs) {
        ask.view.looked_at = Some(k);
        let ends = [pairs[k].from_mm, pairs[k].taken.place_mm].map(|mm| mm / 1000.0);
        ask.act(WindowAction::Look(ends.to_vec()));
    }
}

/// All of them; which was clicked.
fn confusion_table(ask: &Ask<'_>, ui: &mut Ui, pairs: &[MistakenPair]) -> Option<usize> {
    const TITLES: [&str; 5] = [
        "Number",
        "Apart (mm)",
        "Probability",
        "Touched (mm)",
        "Taken for (mm)",
    ];
    let mut clicked = None;
    let table = |ui: &mut Ui| {
        for title in TITLES {
            ui.strong(title);
        }
        ui.end_row();
        for (k, pair) in pairs.iter().enumerate() {
            if confusion_row(ask, ui, k, pair) {
                clicked = Some(k);
            }
        }
    };
    egui::ScrollArea::vertical()
        .auto_shrink(false)
        .show(ui, |ui| {
            egui::Grid::new("confusions")
                .num_columns(TITLES.len())
                .striped(true)
                .spacing([18.0, 3.0])
                .show(ui, table);
        });
    clicked
}

/// One confusion; whether it was clicked.
fn confusion_row(ask: &Ask<'_>, ui: &mut Ui, k: usize, pair: &MistakenPair) -> bool {
    let chosen = ask.view.looked_at == Some(k);
    let button = ui
        .add(egui::Button::selectable(chosen, format!("{}", k + 1)))
        .on_hover_text("Look there")
        .accessible_name(format!("Confusion {}", k + 1));
    ui.monospace(format!("{:8.1}", pair.taken.apart_mm));
    ui.monospace(format!("{:6.0} %", 100.0 * pair.taken.share));
    for place in [pair.from_mm, pair.taken.place_mm] {
        ui.monospace(format!("{:7.1} {:7.1} {:7.1}", place.x, place.y, place.z));
    }
    ui.end_row();
    button.clicked()
}

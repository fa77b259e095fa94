//! Known touches at the live stage: taken, looked at, left out, deleted, and what gauges are calibrated with.

use egui::{Grid, RichText, Role, Ui, WidgetInfo};

use super::super::action::BoardAction;
use super::super::ask::Ask;
use super::super::form::{number, quantity, rows};
use super::super::theme;
use crate::project::CalibrationKeys;
use crate::session::{Awaited, KnownTouch, LEAST_KNOWN, WANTED_KNOWN};

/// Known touches: the next one, those that were taken, and what they showed.
pub fn known_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    ui.add(egui::Label::new("Press where the limb shows a cross, as hard as it says here, and take it. The gauges then show how they are really glued.").wrap());
    next_touch(ask, ui);
    known_buttons(ask, ui);
    known_list(ask, ui);
    if ask.session.live.simulated_board().is_some() {
        calibrate_from_board(ask, ui);
    }
    what_was_calibrated(ask, ui);
}

/// How the next known touch is pressed, and how well.
fn next_touch(ask: &mut Ask<'_>, ui: &mut Ui) {
    rows(ui, "Next touch", |ui| {
        ask.edit_desk(|desk| {
            quantity(
                ui,
                "Force",
                &mut desk.known_force_n,
                0.1..=100.0,
                (0.1, "N"),
                "That the next known touch is pressed with",
            );
        });
        ask.edit(|project| pressing(ui, &mut project.calibration));
    });
    let help =
        "The next known touch is pressed where the limb is clicked, not where one is proposed";
    ask.edit_desk(|desk| {
        let by_click = ui.checkbox(&mut desk.known_by_click, "Click on the limb says where");
        by_click.on_hover_text(help);
    });
}

/// Every known touch: how hard, whether it fits the others, and whether it is used.
fn known_list(ask: &mut Ask<'_>, ui: &mut Ui) {
    let touches: Vec<(usize, KnownTouch)> = (ask.session.known_list())
        .map(|(number, touch)| (number, touch.clone()))
        .collect();
    ask.view.known_hover = None;
    if touches.is_empty() {
        return;
    }
    Grid::new("known touches")
        .num_columns(4)
        .striped(true)
        .show(ui, |ui| {
            for (title, help) in KNOWN_COLUMNS {
                ui.strong(title).on_hover_text(help);
            }
            ui.end_row();
            for (shown, (number, touch)) in (1..).zip(touches) {
                known_row(ask, ui, shown, (number, &touch));
                ui.end_row();
            }
        });
}

const KNOWN_COLUMNS: [(&str, &str); 4] = [
    ("Use", "Whether the gauges are calibrated with it"),
    ("Force", "As hard as it was asked for"),
    (
        "Misfit",
        "How far off it is from what the others foresee, in weighted squares a channel: about one where it fits",
    ),
    ("", ""),
];

fn known_row(ask: &mut Ask<'_>, ui: &mut Ui, shown: usize, (number, touch): (usize, &KnownTouch)) {
    let mut used = touch.used;
    let name = format!("Known touch {shown}");
    let use_it = ui.checkbox(&mut used, shown.to_string());
    use_it.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, used, &name));
    if use_it.changed() {
        ask.act(BoardAction::UseKnown(number, used));
    }
    let force = ui.label(format!("{:.1} N", touch.press.force));
    let misfit = touch.misfit.map_or("…".to_owned(), |m| format!("{m:.1}"));
    let misfit = if touch.is_misfit() {
        RichText::new(misfit).color(theme::STALE)
    } else {
        RichText::new(misfit)
    };
    let mut misfit = ui.label(misfit);
    if touch.is_misfit() {
        misfit = misfit.on_hover_text(
            "It does not fit the others: it was pressed elsewhere or otherwise than it says. Leave it out, or press it again",
        );
    }
    let delete = ui.small_button("Delete");
    delete.widget_info(|| {
        WidgetInfo::labeled(Role::Button, true, format!("Delete known touch {shown}"))
    });
    if delete.clicked() {
        ask.act(BoardAction::DeleteKnown(number));
    }
    let all = [use_it, force, misfit, delete];
    if all.iter().any(egui::Response::hovered) {
        ask.view.known_hover = Some(number);
    }
}

fn pressing(ui: &mut Ui, hand: &mut CalibrationKeys) {
    number(
        ui,
        "Place off",
        &mut hand.place_mm,
        CalibrationKeys::place_mm(),
        0.01,
    );
    number(
        ui,
        "Force off",
        &mut hand.force_percent,
        CalibrationKeys::force_percent(),
        0.05,
    );
    number(
        ui,
        "Aside",
        &mut hand.friction_percent,
        CalibrationKeys::friction_percent(),
        0.5,
    );
}

/// To take a known touch, and to make use of all of them.
fn known_buttons(ask: &mut Ask<'_>, ui: &mut Ui) {
    let (count, connected) = (ask.session.known_touches(), ask.session.live.is_connected());
    let used = ask.session.known_used();
    let left_out = match count - used {
        0 => String::new(),
        some => format!(", {some} left out"),
    };
    ui.label(format!("{count} known touches of {WANTED_KNOWN}{left_out}"));
    ui.horizontal(|ui| {
        let idle = ask.session.live.awaited() == Awaited::Nothing;
        if ui
            .add_enabled(connected && idle, egui::Button::new("Take this press"))
            .clicked()
        {
            ask.act(BoardAction::TakeKnown);
        }
        if ui
            .add_enabled(
                connected && used >= LEAST_KNOWN,
                egui::Button::new("Calibrate"),
            )
            .clicked()
        {
            ask.act(BoardAction::Calibrate);
        }
    });
}

fn calibrate_from_board(ask: &mut Ask<'_>, ui: &mut Ui) {
    if ask.session.live.awaited() == Awaited::Board {
        let help = "Those that were taken are kept";
        if ui
            .button("Stop taking touches")
            .on_hover_text(help)
            .clicked()
        {
            ask.act(BoardAction::StopTakingKnown);
        }
        return;
    }
    let help = "The next touches of the simulated board, whose places and forces are known";
    if ui
        .button("Calibrate from the simulated board")
        .on_hover_text(help)
        .clicked()
    {
        ask.act(BoardAction::CalibrateFromBoard);
    }
}

fn what_was_calibrated(ask: &mut Ask<'_>, ui: &mut Ui) {
    ask.edit(|project| {
        let live = &mut project.live;
        if live.glued.is_empty() {
            return;
        }
        ui.label(format!(
            "Calibrated: still off by about {:.1} %",
            100.0 * live.model_error
        ));
        if ui.button("Forget the calibration").clicked() {
            live.forget();
        }
    });
}

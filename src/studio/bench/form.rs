//! What is pressed and by what, and how that goes.

use egui::{Color32, DragValue, RichText, TextEdit, Ui};

use super::super::ask::Ask;
use super::super::commands::UiCommand;
use super::super::form::{choice, counted, quantity, rows};
use super::super::learned::estimator_shown;
use super::super::theme;
use super::hand::hand_form;
use crate::plain;
use crate::session::{BenchDesk, PressState, PressingPlan};
use crate::test_bed::{BenchRequest, Flaws, HARDEST_N};

/// Failed presses that are named.
const NAMED: usize = 5;

/// What goes through the plan.
#[derive(Clone, Copy, PartialEq)]
enum WhoPresses {
    Simulated,
    Machine,
    Hand,
}

impl WhoPresses {
    const ALL: [Self; 3] = [Self::Simulated, Self::Machine, Self::Hand];

    fn of(asked: &BenchRequest) -> Self {
        match (asked.by_hand, &asked.simulated) {
            (true, _) => Self::Hand,
            (false, Some(_)) => Self::Simulated,
            (false, None) => Self::Machine,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Simulated => "A simulated bench",
            Self::Machine => "A machine",
            Self::Hand => "Somebody's hand",
        }
    }

    fn put(self, asked: &mut BenchRequest) {
        let usual = |asked: &BenchRequest| BenchRequest::usual_force(asked.by_hand);
        let as_usual = (asked.force_n - usual(asked)).abs() < 1e-9;
        asked.by_hand = self == Self::Hand;
        if as_usual {
            asked.force_n = usual(asked);
        }
        asked.simulated = (self == Self::Simulated).then(Flaws::default);
    }
}

/// The settings, the orders, and what came of them.
pub fn bench_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    let goes_on = ask.session.bench.goes_on();
    ui.add_enabled_ui(!goes_on, |ui| {
        ask.edit_desk(|desk| {
            let baud = &mut desk.baud;
            let desk = &mut desk.bench;
            presser_rows(ui, desk, baud);
            press_rows(ui, &mut desk.asked);
            file_rows(ui, desk);
        });
    });
    let folder = ask.session.bench_folder();
    ui.weak(format!("Into {}", folder.display()));
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        ask.button(ui, UiCommand::PlanPresses);
        ask.button(ui, UiCommand::PressPlan);
    });
    order_buttons(ask, ui);
    ui.add_space(6.0);
    if ask.session.bench.look(|plan| progress(ui, plan)).is_none() {
        ui.weak("Nothing is planned yet. “Plan presses” shows on the limb where will be pressed; nothing moves before “Press the plan”");
    } else if !ask.session.plan_holds() && !goes_on {
        let text = "The plan is of other settings or gauges: plan anew";
        ui.colored_label(theme::STALE, text);
    }
    ui.add_space(6.0);
    ask.button(ui, UiCommand::LearnPresses);
    if let Some(learnt) = ask.session.learnt() {
        estimator_shown(ui, learnt);
    }
}

/// What a run that goes on is told.
fn order_buttons(ask: &mut Ask<'_>, ui: &mut Ui) {
    if WhoPresses::of(&ask.session.desk.bench.asked) == WhoPresses::Hand {
        hand_form(ask, ui);
        ask.button(ui, UiCommand::StopPresses);
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ask.button(ui, UiCommand::PausePresses);
        ask.button(ui, UiCommand::StopPresses);
    });
    halt_button(ask, ui);
}

/// The emergency stop, which must be found without looking for it.
fn halt_button(ask: &mut Ask<'_>, ui: &mut Ui) {
    let command = UiCommand::HaltMachine;
    let enabled = ask.enabled(command);
    let mut text = RichText::new(command.name()).strong();
    if enabled {
        text = text.color(Color32::WHITE);
    }
    let mut button = egui::Button::new(text).min_size(egui::vec2(ui.available_width(), 30.0));
    if enabled {
        button = button.fill(Color32::from_rgb(176, 42, 48));
    }
    if let Some(shortcut) = command.shortcut() {
        button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut));
    }
    let button = ui
        .add_enabled(enabled, button)
        .on_hover_text(command.tooltip())
        .on_disabled_hover_text(command.tooltip());
    if button.clicked() {
        ask.command(command);
    }
}

fn presser_rows(ui: &mut Ui, desk: &mut BenchDesk, baud: &mut u32) {
    rows(ui, "Pressed by", |ui| {
        let mut presser = WhoPresses::of(&desk.asked);
        let help = "Printer, limb as a workshop builds it and board may all be computed, as fast as that goes; or a printer presses; or you do, where the limb shows it";
        choice(
            ui,
            "Who presses",
            &mut presser,
            &WhoPresses::ALL,
            WhoPresses::name,
            help,
        );
        if presser != WhoPresses::of(&desk.asked) {
            presser.put(&mut desk.asked);
        }
        if presser == WhoPresses::Hand {
            text_row(ui, "Force sensor", &mut desk.machine, "none: a scale tells");
        } else {
            text_row(ui, "Machine file", &mut desk.machine, "the paper's bench");
        }
        if presser == WhoPresses::Machine {
            text_row(ui, "Printer", &mut desk.printer, "port or host:port");
            baud_row(ui, "Printer's baud", &mut desk.printer_baud);
        }
        if presser != WhoPresses::Simulated {
            text_row(ui, "Board", &mut desk.board, "port or host:port");
            baud_row(ui, "Board's baud", baud);
        }
    });
}

fn baud_row(ui: &mut Ui, label: &str, baud: &mut u32) {
    let name = ui.label(label);
    ui.add(DragValue::new(baud).range(300..=4_000_000).speed(100.0))
        .labelled_by(name.id)
        .on_hover_text("Native USB does not care");
    ui.end_row();
}

fn text_row(ui: &mut Ui, label: &str, text: &mut String, hint: &str) {
    let name = ui.label(label);
    let field = TextEdit::singleline(text)
        .desired_width(150.0)
        .hint_text(hint);
    ui.add(field).labelled_by(name.id);
    ui.end_row();
}

fn press_rows(ui: &mut Ui, asked: &mut BenchRequest) {
    rows(ui, "Presses", |ui| {
        counted(
            ui,
            "Places",
            &mut asked.places,
            1..=100_000,
            "Evenly over what touches get to",
        );
        if asked.by_hand {
            force_row(ui, "About", &mut asked.force_n, "How hard is meant");
        } else {
            machine_press_rows(ui, asked);
        }
    });
}

fn force_row(ui: &mut Ui, label: &str, value: &mut f64, help: &str) {
    quantity(ui, label, value, 0.1..=HARDEST_N, (0.5, "N"), help);
}

fn machine_press_rows(ui: &mut Ui, asked: &mut BenchRequest) {
    let mut length = |label, value: &mut f64, range, help| {
        quantity(ui, label, value, range, (0.01, "mm"), help);
    };
    length(
        "Step",
        &mut asked.step_mm,
        0.01..=5.0,
        "Between two readings",
    );
    length(
        "Depth",
        &mut asked.depth_mm,
        0.01..=50.0,
        "From where a place is first felt",
    );
    force_row(ui, "Enough", &mut asked.force_n, "The force that is enough");
    force_row(
        ui,
        "At most",
        &mut asked.most_force_n,
        "The force at which the machine stops and takes its tip back",
    );
    counted(
        ui,
        "Check after",
        &mut asked.check,
        0..=100_000,
        "Presses between two of one place that is pressed again and again, so that lost steps are noticed; 0 for never",
    );
}

fn file_rows(ui: &mut Ui, desk: &mut BenchDesk) {
    rows(ui, "Files", |ui| {
        text_row(ui, "Places from", &mut desk.points, "even ones (or a .csv)");
        text_row(ui, "Folder", &mut desk.folder, "presses");
    });
}

/// What is planned, how far it has come, and what was said of it.
fn progress(ui: &mut Ui, plan: &PressingPlan) {
    let [made, failed] = plan.made_and_failed();
    let all = plan.states.len();
    let share = (made + failed) as f32 / all.max(1) as f32;
    let words = if plan.checking {
        format!("{made} of {all} presses · checking")
    } else {
        format!("{made} of {all} presses")
    };
    ui.add(egui::ProgressBar::new(share).text(words));
    let wrapped = |ui: &mut Ui, text: String| {
        ui.add(egui::Label::new(RichText::new(text).size(11.5).weak()).wrap());
    };
    for line in plan.run.in_words() {
        wrapped(ui, line);
    }
    for line in &plan.said {
        ui.add(egui::Label::new(line).wrap());
    }
    let why = plan
        .states
        .iter()
        .enumerate()
        .filter_map(|(k, state)| match state {
            PressState::Failed(why) => Some((k, why)),
            _ => None,
        });
    for (k, why) in why.take(NAMED) {
        ui.colored_label(theme::ERROR, format!("Press {}: {why}", k + 1));
    }
    if failed > NAMED {
        let more = plain::either(failed - NAMED, "more press", "more presses");
        ui.colored_label(theme::ERROR, format!("{more} failed"));
    }
}

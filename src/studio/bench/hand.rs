//! Pressing by hand: what is to be done next, and how hard the last press was.

use std::cell::Cell;

use egui::{DragValue, Frame, Key, RichText, Ui};

use super::super::ask::Ask;
use super::super::commands::UiCommand;
use super::super::theme;
use crate::session::HandStep;
use crate::test_bed::HARDEST_N;

/// What whoever presses is to do, as long as a run by hand goes on.
pub fn hand_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    let Some(step) = ask.session.bench.step() else {
        return;
    };
    Frame::group(ui.style()).show(ui, |ui| {
        ui.set_width(ui.available_width());
        let meant = ask.session.desk.bench.asked.force_n;
        let (heading, colour, more) = match step {
            HandStep::Wait => (
                "Leave the limb alone".to_owned(),
                theme::STALE,
                "The board's rest is taken",
            ),
            HandStep::Press => (
                format!("Press with about {meant} N"),
                theme::TOUCHED,
                "At the mark, and hold it for a second; click on the limb where you press elsewhere",
            ),
            HandStep::LetGo => (
                "Let go".to_owned(),
                theme::STALE,
                "It was read",
            ),
            HandStep::TellForce => (
                "How hard was it?".to_owned(),
                theme::TOUCHED,
                "As the scale said; click on the limb if it was elsewhere",
            ),
        };
        ui.label(RichText::new(heading).size(18.0).strong().color(colour));
        ui.add(egui::Label::new(RichText::new(more).weak()).wrap());
        ui.add_space(4.0);
        if step == HandStep::TellForce {
            force_row(ask, ui);
        }
        ask.button(ui, UiCommand::SkipPress);
    });
}

/// The force that a scale said, and the order that takes the press with it.
fn force_row(ask: &mut Ask<'_>, ui: &mut Ui) {
    let mut entered = false;
    // What is typed last: nothing is taken for a word that is no number.
    let typed = Cell::new(true);
    let parsed = |text: &str| {
        let text = text.trim().trim_end_matches('N').trim_end();
        let force = text.replace(',', ".").parse().ok();
        typed.set(force.is_some());
        force
    };
    ui.horizontal(|ui| {
        ask.edit_desk(|desk| {
            let name = ui.label("Force");
            let force = DragValue::new(&mut desk.bench.typed_n)
                .range(0.1..=HARDEST_N)
                .speed(0.1)
                .max_decimals(3)
                .custom_parser(parsed)
                .suffix(" N");
            let force = ui.add(force).labelled_by(name.id);
            entered = force.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        });
        ask.button(ui, UiCommand::TakePress);
    });
    if entered && typed.get() {
        ask.command(UiCommand::TakePress);
    }
}

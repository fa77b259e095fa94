//! The right side: the settings of a stage, in the units of the project's file.

mod corners;
mod evaluation;
mod feasible;
mod part;
mod selection;
mod simulation;
mod supports;

use egui::Ui;

use super::ask::Ask;
use super::commands::UiCommand;
use super::view::Stage;
use evaluation::evaluation_form;
use feasible::feasible_form;
use part::part_form;
use selection::{candidates_form, selection_form};
use simulation::simulation_form;
use supports::supports_form;

/// What a stage is, and what for.
pub fn heading(stage: Stage, ui: &mut Ui) {
    ui.add_space(6.0);
    ui.heading(stage.name());
    ui.add(egui::Label::new(purpose(stage)).wrap());
    ui.add_space(4.0);
}

/// The settings of the stage that is looked at.
pub fn settings(ask: &mut Ask<'_>, ui: &mut Ui) {
    match ask.view.stage {
        Stage::Part => part_form(ask, ui),
        Stage::Supports => supports_form(ask, ui),
        Stage::Simulation => simulation_form(ask, ui),
        Stage::Feasible => feasible_form(ask, ui),
        Stage::Candidates => candidates_form(ask, ui),
        Stage::Selection => selection_form(ask, ui),
        Stage::Evaluation => evaluation_form(ask, ui),
        Stage::Report => ask.button(ui, UiCommand::Export),
        // They have panels of their own.
        Stage::Bench | Stage::Live => {}
    }
}

/// What a stage is for, in a sentence.
fn purpose(stage: Stage) -> &'static str {
    match stage {
        Stage::Part => "The part that gauges go into",
        Stage::Supports => "What the part is made of and where it is held",
        Stage::Simulation => "How the part deforms under every touch",
        Stage::Feasible => "Where a gauge can physically go",
        Stage::Candidates => "The few places that tell what all others would",
        Stage::Selection => "Which of the candidates get a gauge",
        Stage::Evaluation => "How well touches that nobody trained on are found",
        Stage::Report => "What a workshop needs to build it",
        Stage::Bench => {
            "The limb is pressed at many places, and what the gauges read is written down"
        }
        Stage::Live => "Where and how hard the part is touched, now",
    }
}

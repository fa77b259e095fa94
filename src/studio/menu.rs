//! The menus, over everything.

use egui::Ui;

use super::ask::Ask;
use super::commands::UiCommand;
use super::recent::Recent;
use super::view::{ScreenWay, Tool};
use crate::document::Layer;
use crate::io::examples::Example;
use crate::render::camera::Preset;

fn run_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [
        UiCommand::Simulate,
        UiCommand::Select,
        UiCommand::Keep,
        UiCommand::Cancel,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    for command in [
        UiCommand::PlanPresses,
        UiCommand::PressPlan,
        UiCommand::LearnPresses,
        UiCommand::SimulatedBoard,
        UiCommand::Tare,
        UiCommand::Record,
        UiCommand::Disconnect,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    ask.button(ui, UiCommand::Follow);
}

fn gauges_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [
        UiCommand::Pin,
        UiCommand::RemoveGauges,
        UiCommand::AddHelpful,
        UiCommand::FindSpare,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    for way in ScreenWay::ALL {
        ask.button(ui, UiCommand::Nudge(way));
    }
}

fn file_menu(ask: &mut Ask<'_>, recent: &Recent, ui: &mut Ui) {
    ask.button(ui, UiCommand::Open);
    recent.menu(ui, ask);
    ui.menu_button("Examples", |ui| {
        for example in Example::ALL {
            ask.button(ui, UiCommand::Example(example));
        }
    });
    ui.separator();
    for command in [UiCommand::Save, UiCommand::SaveAs] {
        ask.button(ui, command);
    }
    ui.separator();
    ask.button(ui, UiCommand::Export);
    ask.button(ui, UiCommand::SavePicture);
    ui.separator();
    ask.button(ui, UiCommand::Quit);
}

fn edit_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [UiCommand::Undo, UiCommand::Redo] {
        ask.button(ui, command);
    }
    ui.separator();
    for tool in Tool::ALL {
        ask.button(ui, UiCommand::Tool(tool));
    }
    ui.separator();
    ui.menu_button("Painted layer", |ui| {
        for layer in Layer::ALL {
            ask.button(ui, UiCommand::Paint(layer));
        }
        ui.separator();
        for command in [
            UiCommand::FillPaint,
            UiCommand::InvertPaint,
            UiCommand::GrowPaint,
            UiCommand::ShrinkPaint,
            UiCommand::ClearPaint,
        ] {
            ask.button(ui, command);
        }
    });
    ui.menu_button("Gauges", |ui| gauges_menu(ask, ui));
    ui.separator();
    ask.button(ui, UiCommand::Palette);
}

fn view_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [UiCommand::Frame, UiCommand::FramePicked] {
        ask.button(ui, command);
    }
    ui.separator();
    for command in [
        UiCommand::SeeThrough,
        UiCommand::Section,
        UiCommand::Unrolled,
        UiCommand::Jig,
        UiCommand::Floor,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    for preset in Preset::ALL {
        ask.button(ui, UiCommand::Look(preset));
    }
    ui.separator();
    for command in [
        UiCommand::DarkLight,
        UiCommand::LargerText,
        UiCommand::SmallerText,
    ] {
        ask.button(ui, command);
    }
}

/// What is open, and whether it is saved.
fn open_project(ask: &Ask<'_>, ui: &mut Ui) {
    let state = if ask.session.document.is_dirty() {
        "not saved"
    } else {
        "saved"
    };
    ui.weak(format!("{} · {state}", ask.session.document.name()));
}

/// The bar at the top.
pub fn menu(ask: &mut Ask<'_>, recent: &Recent, ui: &mut Ui) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file_menu(ask, recent, ui));
        ui.menu_button("Edit", |ui| edit_menu(ask, ui));
        ui.menu_button("View", |ui| view_menu(ask, ui));
        ui.menu_button("Run", |ui| run_menu(ask, ui));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            open_project(ask, ui);
        });
    });
}

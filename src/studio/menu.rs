//! The menus, over everything.

use egui::Ui;

use super::ask::Ask;
use super::commands::Command;
use super::recent::Recent;
use super::view::{Tool, Way};
use crate::document::Layer;
use crate::io::examples::Example;
use crate::render::camera::Preset;

fn run_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [
        Command::Simulate,
        Command::Select,
        Command::Keep,
        Command::Cancel,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    for command in [
        Command::PlanPresses,
        Command::PressPlan,
        Command::LearnPresses,
        Command::SimulatedBoard,
        Command::Tare,
        Command::Record,
        Command::Disconnect,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    ask.button(ui, Command::Follow);
}

fn gauges_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [
        Command::Pin,
        Command::RemoveGauges,
        Command::AddHelpful,
        Command::FindSpare,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    for way in Way::ALL {
        ask.button(ui, Command::Nudge(way));
    }
}

fn file_menu(ask: &mut Ask<'_>, recent: &Recent, ui: &mut Ui) {
    ask.button(ui, Command::Open);
    recent.menu(ui, ask);
    ui.menu_button("Examples", |ui| {
        for example in Example::ALL {
            ask.button(ui, Command::Example(example));
        }
    });
    ui.separator();
    for command in [Command::Save, Command::SaveAs] {
        ask.button(ui, command);
    }
    ui.separator();
    ask.button(ui, Command::Export);
    ask.button(ui, Command::SavePicture);
    ui.separator();
    ask.button(ui, Command::Quit);
}

fn edit_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [Command::Undo, Command::Redo] {
        ask.button(ui, command);
    }
    ui.separator();
    for tool in Tool::ALL {
        ask.button(ui, Command::Tool(tool));
    }
    ui.separator();
    ui.menu_button("Painted layer", |ui| {
        for layer in Layer::ALL {
            ask.button(ui, Command::Paint(layer));
        }
        ui.separator();
        for command in [
            Command::FillPaint,
            Command::InvertPaint,
            Command::GrowPaint,
            Command::ShrinkPaint,
            Command::ClearPaint,
        ] {
            ask.button(ui, command);
        }
    });
    ui.menu_button("Gauges", |ui| gauges_menu(ask, ui));
    ui.separator();
    ask.button(ui, Command::Palette);
}

fn view_menu(ask: &mut Ask<'_>, ui: &mut Ui) {
    for command in [Command::Frame, Command::FramePicked] {
        ask.button(ui, command);
    }
    ui.separator();
    for command in [
        Command::SeeThrough,
        Command::Section,
        Command::Unrolled,
        Command::Jig,
    ] {
        ask.button(ui, command);
    }
    ui.separator();
    for preset in Preset::ALL {
        ask.button(ui, Command::Look(preset));
    }
    ui.separator();
    for command in [
        Command::DarkLight,
        Command::LargerText,
        Command::SmallerText,
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

//! Commands by their keys.

use egui::{Context, Modifiers, Popup};

use super::ask::Ask;
use super::commands::UiCommand;

/// Gives the commands whose keys were pressed.
pub fn shortcuts(ctx: &Context, ask: &mut Ask<'_>) {
    let typing = ctx.egui_wants_keyboard_input();
    // Escape closes what has opened, or ends what is under way, before it ends jobs.
    let closing = Popup::is_any_open(ctx) || !ask.view.is_idle();
    for command in UiCommand::all() {
        let Some(shortcut) = command.shortcut() else {
            continue;
        };
        // Single keys belong to a text field while it has the focus.
        let single = shortcut.modifiers == Modifiers::NONE;
        if !ask.enabled(command) || command == UiCommand::Cancel && closing {
            continue;
        }
        if !(typing && single) && ctx.input_mut(|i| i.consume_shortcut(&shortcut)) {
            ask.command(command);
        }
    }
}

/// Gives the emergency stop, where its key was pressed.
pub fn halt(ctx: &Context, ask: &mut Ask<'_>) {
    let command = UiCommand::HaltMachine;
    if let Some(shortcut) = command.shortcut()
        && ask.enabled(command)
        && ctx.input_mut(|i| i.consume_shortcut(&shortcut))
    {
        ask.command(command);
    }
}

//! The palette: every command by a few letters of its name.

use egui::{Align2, Context, Id, Key, Modal, RichText, ScrollArea, TextEdit, Ui};

use super::ask::Ask;
use super::commands::{UiCommand, why_not};

/// The open palette.
#[derive(Default)]
pub struct Palette {
    query: String,
    /// Which of those found is taken by Enter.
    marked: usize,
}

/// Whether all letters of a query appear in a name in their order; words of the query in any case.
fn matches(query: &str, name: &str) -> bool {
    let mut letters = name.chars().flat_map(char::to_lowercase);
    query
        .chars()
        .filter(|c| !c.is_whitespace())
        .flat_map(char::to_lowercase)
        .all(|q| letters.any(|l| l == q))
}

/// Commands that a query finds: those that begin with it first, of those the shortest.
fn found(query: &str) -> Vec<UiCommand> {
    let wanted = query.trim().to_lowercase();
    let rank = |c: &UiCommand| {
        let name = c.name().to_lowercase();
        let length = if wanted.is_empty() { 0 } else { name.len() };
        (!name.starts_with(&wanted), length)
    };
    let mut all: Vec<UiCommand> = UiCommand::all()
        .into_iter()
        .filter(|c| *c != UiCommand::Palette && matches(query, c.name()))
        .collect();
    all.sort_by_key(rank);
    all
}

/// The palette while it is open; whether it stays open.
pub fn show(palette: &mut Palette, ctx: &Context, ask: &mut Ask<'_>) -> bool {
    let mut chosen = None;
    let modal = Modal::new(Id::unique("palette")).show(ctx, |ui| {
        ui.set_width(420.0);
        chosen = rows(ask, ui, palette);
    });
    if let Some(command) = chosen {
        ask.command(command);
        return false;
    }
    !modal.should_close()
}

fn rows(ask: &Ask<'_>, ui: &mut Ui, palette: &mut Palette) -> Option<UiCommand> {
    let input = ui.add(
        TextEdit::singleline(&mut palette.query)
            .hint_text("A command")
            .desired_width(f32::INFINITY),
    );
    let input = input.accessible_name("Find a command");
    input.request_focus();
    if input.changed() {
        palette.marked = 0;
    }
    let mut all = found(&palette.query);
    all.sort_by_key(|c| !ask.enabled(*c));
    let (down, up, enter) = ui.input(|i| {
        (
            i.key_pressed(Key::ArrowDown),
            i.key_pressed(Key::ArrowUp),
            i.key_pressed(Key::Enter),
        )
    });
    if down {
        palette.marked += 1;
    }
    if up {
        palette.marked = palette.marked.saturating_sub(1);
    }
    palette.marked = palette.marked.min(all.len().saturating_sub(1));
    let mut chosen = all.get(palette.marked).copied().filter(|_| enter);
    ui.separator();
    if all.is_empty() {
        ui.weak("No command has these letters");
    }
    ScrollArea::vertical().max_height(360.0).show(ui, |ui| {
        for (k, &command) in all.iter().enumerate() {
            if row(ask, ui, command, k == palette.marked, down || up) {
                chosen = Some(command);
            }
        }
    });
    chosen
}

/// One command with its key and what it does; whether it was clicked.
fn row(ask: &Ask<'_>, ui: &mut Ui, command: UiCommand, marked: bool, moved: bool) -> bool {
    let mut button = egui::Button::selectable(marked, command.name())
        .min_size(egui::vec2(ui.available_width(), 0.0));
    if let Some(shortcut) = command.shortcut() {
        button = button.shortcut_text(RichText::new(ui.ctx().format_shortcut(&shortcut)).weak());
    }
    let response = ui
        .add_enabled(ask.enabled(command), button)
        .accessible_name(format!("Palette: {}", command.name()))
        .on_hover_text(command.tooltip())
        .on_disabled_hover_text(why_not(ask.session, command));
    if marked && moved {
        response.scroll_to_me(Some(Align2::CENTER_CENTER.y()));
    }
    response.clicked()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_letters_find_a_command() {
        assert!(matches("slg", "Select gauges") && matches("SEL G", "Select gauges"));
        assert!(!matches("gs", "Select"));
        assert_eq!(found("save")[0], UiCommand::Save);
        assert_eq!(found("inv")[0], UiCommand::InvertPaint);
        assert_eq!(found("").len(), UiCommand::all().len() - 1);
        assert!(found("xyzzy").is_empty());
    }
}

//! What a panel sees, and where it leaves what it asks for: the session to read, the view to change, actions for the rest.

use egui::{Button, Ui};

use super::action::{Action, WindowAction};
use super::commands::{UiCommand, enabled, is_on, why_not};
use super::view::ViewState;
use crate::project::Project;
use crate::session::{Desk, Session};

/// A panel's side of the window.
pub struct Ask<'a> {
    pub session: &'a Session,
    pub view: &'a mut ViewState,
    actions: Vec<Action>,
}

impl<'a> Ask<'a> {
    /// A side on which nothing is asked for yet.
    pub fn new(session: &'a Session, view: &'a mut ViewState) -> Self {
        Self {
            session,
            view,
            actions: Vec::new(),
        }
    }

    /// What was asked for, in its order.
    #[must_use]
    pub fn into_actions(self) -> Vec<Action> {
        self.actions
    }

    /// Asks for something.
    pub fn act(&mut self, action: impl Into<Action>) {
        self.actions.push(action.into());
    }

    /// Gives a command.
    pub fn command(&mut self, command: UiCommand) {
        self.act(WindowAction::Command(command));
    }

    /// The project, to read.
    #[must_use]
    pub fn project(&self) -> &'a Project {
        &self.session.document.state.project
    }

    /// Shows a form on the project; what it changes is asked for.
    pub fn edit<T>(&mut self, form: impl FnOnce(&mut Project) -> T) -> T {
        let pending = self.actions.iter().rev().find_map(|a| match a {
            Action::Edit(project) => Some(&**project),
            _ => None,
        });
        let before = pending.unwrap_or(self.project());
        let mut project = before.clone();
        let answer = form(&mut project);
        if project != *before {
            self.act(Action::Edit(Box::new(project)));
        }
        answer
    }

    /// Shows a form on what belongs to the desk; what it changes is asked for.
    pub fn edit_desk<T>(&mut self, form: impl FnOnce(&mut Desk) -> T) -> T {
        let pending = self.actions.iter().rev().find_map(|a| match a {
            Action::Desk(desk) => Some(&**desk),
            _ => None,
        });
        let before = pending.unwrap_or(&self.session.desk);
        let mut desk = before.clone();
        let answer = form(&mut desk);
        if desk != *before {
            self.act(Action::Desk(Box::new(desk)));
        }
        answer
    }

    /// Whether a command can be given now.
    #[must_use]
    pub fn enabled(&self, command: UiCommand) -> bool {
        enabled(self.session, self.view, command)
    }

    /// A button or menu entry for a command.
    pub fn button(&mut self, ui: &mut Ui, command: UiCommand) {
        let on = is_on(self.session, self.view, command);
        let mut button = Button::new(command.name()).selected(on);
        if let Some(shortcut) = command.shortcut() {
            button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut));
        }
        let response = ui
            .add_enabled(self.enabled(command), button)
            .accessible_name(command.name())
            .on_hover_text(command.tooltip())
            .on_disabled_hover_text(why_not(self.session, command));
        if response.clicked() {
            self.command(command);
        }
    }

    /// A small button for a command, pressed in while it is on.
    pub fn toggle(&mut self, ui: &mut Ui, command: UiCommand) {
        let on = is_on(self.session, self.view, command);
        let button = ui.add_enabled(
            self.enabled(command),
            Button::selectable(on, command.short_name()),
        );
        let mut help = command.tooltip().to_owned();
        if let Some(shortcut) = command.shortcut() {
            help = format!("{help} ({})", ui.ctx().format_shortcut(&shortcut));
        }
        let button = button
            .on_hover_text(help)
            .on_disabled_hover_text(why_not(self.session, command));
        if button.clicked() {
            self.command(command);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::io::opening::bundled;
    use crate::session::Wake;

    #[test]
    fn forms_of_one_frame_add_up_and_one_that_changes_nothing_asks_for_nothing() {
        let document = Document::new(bundled().unwrap(), None);
        let mut session = Session::new(document, Wake::default());
        let mut view = ViewState::of(&session.document);
        let mut ask = Ask::new(&session, &mut view);
        ask.edit(|_| ());
        ask.edit_desk(|desk| desk.baud += 0);
        assert!(ask.into_actions().is_empty());

        let (force, baud) = (
            session.document.state.project.touch.force_n,
            session.desk.baud,
        );
        let mut ask = Ask::new(&session, &mut view);
        ask.edit(|project| project.touch.force_n += 1.0);
        ask.edit_desk(|desk| desk.compare = !desk.compare);
        ask.edit(|project| project.selection.sensors += 1);
        ask.edit_desk(|desk| desk.baud += 1);
        let sensors = ask.project().selection.sensors;
        for action in ask.into_actions() {
            assert!(action.apply(&mut session).is_none());
        }
        let project = &session.document.state.project;
        assert!((project.touch.force_n - force - 1.0).abs() < 1e-12);
        assert_eq!(project.selection.sensors, sensors + 1);
        assert!(session.desk.compare && session.desk.baud == baud + 1);
    }
}

//! Where a study's folder is typed.

use std::path::PathBuf;

use egui::{TextEdit, Ui};

use super::super::action::{Compute, FileAction};
use super::super::ask::Ask;
use super::chosen::StudyView;
use crate::session::Task;

/// The field and its button.
pub fn open_row(ask: &mut Ask<'_>, view: &mut StudyView, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let name = ui.label("Study");
        let field = TextEdit::singleline(&mut view.folder)
            .desired_width(200.0)
            .hint_text("folder of hapdef study plan");
        let field = ui.add(field).labelled_by(name.id);
        let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let ready = !view.folder.trim().is_empty() && !ask.session.jobs.runs(Task::OpenStudy);
        let button = ui.add_enabled(ready, egui::Button::new("Open study"));
        if ready && (entered || button.clicked()) {
            ask.act(FileAction::OpenStudy(PathBuf::from(view.folder.trim())));
        }
        if ask.session.jobs.runs(Task::OpenStudy) {
            ui.spinner();
            if ui.button("Stop reading").clicked() {
                ask.act(Compute::End(Task::OpenStudy));
            }
        }
    });
}

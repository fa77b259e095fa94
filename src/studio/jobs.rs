//! What runs, with its progress, and how those before ended.

use std::time::Duration;

use egui::{RichText, Ui};

use super::{Studio, theme};

impl Studio {
    /// One line for each running job.
    pub(super) fn running_jobs(&mut self, ui: &mut Ui) {
        let mut cancel = None;
        for r in self
            .session
            .jobs
            .running()
            .iter()
            .filter(|r| !r.task.is_quiet())
        {
            ui.horizontal(|ui| {
                let width = (ui.available_width() - 110.0).max(80.0);
                ui.add_sized(
                    [170.0, ui.spacing().interact_size.y],
                    egui::Label::new(r.name()).truncate(),
                );
                let bar = egui::ProgressBar::new(r.progress().1)
                    .text(r.in_words())
                    .desired_width((width - 180.0).max(60.0));
                ui.add(bar);
                let name = format!("Cancel: {}", r.name());
                let button = ui.add_enabled(!r.task.writes(), egui::Button::new("Cancel"));
                let button = button.on_disabled_hover_text("A file is being written");
                if button.accessible_name(name).clicked() {
                    cancel = Some(r.task);
                }
            });
            ui.ctx().request_repaint_after(Duration::from_millis(100));
        }
        if let Some(task) = cancel {
            self.session.end_jobs(|t| t == task);
        }
    }

    /// The tab: what runs, and how those before ended.
    pub(super) fn jobs_tab(&mut self, ui: &mut Ui) {
        let idle = self
            .session
            .jobs
            .running()
            .iter()
            .all(|r| r.task.is_quiet());
        if idle && self.session.jobs.ended().is_empty() {
            super::results::empty(
                ui,
                "Nothing was computed yet. Press “Simulate” or “Select gauges”",
            );
            return;
        }
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                self.running_jobs(ui);
                egui::Grid::new("ended jobs")
                    .num_columns(3)
                    .striped(true)
                    .spacing([18.0, 3.0])
                    .show(ui, |ui| {
                        for ended in self.session.jobs.ended().iter().rev() {
                            ui.label(&ended.name);
                            ui.monospace(format!("{:7.1} s", ended.took.as_secs_f64()));
                            let text = RichText::new(&ended.how);
                            ui.label(if ended.failed {
                                text.color(theme::ERROR)
                            } else {
                                text.weak()
                            });
                            ui.end_row();
                        }
                    });
            });
    }
}

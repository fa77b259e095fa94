//! What runs, with its progress, and how those before ended.

use std::time::Duration;

use egui::{RichText, Ui};

use super::action::{Action, Compute};
use super::ask::Ask;
use super::paint::empty;
use super::theme;

/// One line for each running job.
pub fn running_jobs(ask: &mut Ask<'_>, ui: &mut Ui) {
    let mut cancel = None;
    for r in ask
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
            let button = ui.add_enabled(!r.task.is_not_ended(), egui::Button::new("Cancel"));
            let button = button.on_disabled_hover_text("A file is being written");
            if button.accessible_name(name).clicked() {
                cancel = Some(r.task);
            }
        });
        ui.ctx().request_repaint_after(Duration::from_millis(100));
    }
    if let Some(task) = cancel {
        ask.act(Compute::End(task));
    }
}

/// The tab: what runs, and how those before ended.
pub fn jobs_tab(ask: &mut Ask<'_>, ui: &mut Ui) {
    let idle = ask.session.jobs.running().iter().all(|r| r.task.is_quiet());
    if idle && ask.session.jobs.ended().is_empty() {
        empty(
            ui,
            "Nothing was computed yet. Press “Simulate” or “Select gauges”",
        );
        return;
    }
    egui::ScrollArea::vertical()
        .auto_shrink(false)
        .show(ui, |ui| {
            running_jobs(ask, ui);
            egui::Grid::new("ended jobs")
                .num_columns(3)
                .striped(true)
                .spacing([18.0, 3.0])
                .show(ui, |ui| {
                    for ended in ask.session.jobs.ended().iter().rev() {
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

/// The bar at the bottom: running jobs, and messages until they are read.
pub fn status(ask: &mut Ask<'_>, ui: &mut Ui) {
    // As tall with a job as without one: nothing above it jumps.
    ui.set_min_height(ui.spacing().interact_size.y + 6.0);
    running_jobs(ask, ui);
    let mut read = None;
    for (k, message) in ask.session.news.messages.iter().enumerate().rev().take(4) {
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let name = format!("Dismiss message {}", k + 1);
                if ui.button("Dismiss").accessible_name(name).clicked() {
                    read = Some(k);
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    let text = RichText::new(&message.text);
                    let text = if message.error {
                        text.color(theme::ERROR)
                    } else {
                        text
                    };
                    ui.add(egui::Label::new(text).wrap());
                });
            });
        });
    }
    if let Some(k) = read {
        ask.act(Action::Dismiss(k));
    }
    if ask.session.jobs.running().is_empty() && ask.session.news.messages.is_empty() {
        ui.weak("Ready");
    }
}

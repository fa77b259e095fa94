//! The left side: the stages of the road, what each last achieved, and what to press next.

use egui::{RichText, Ui};

use super::{Command, Studio, theme};
use crate::design::Simulated;

/// How a stage stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Standing {
    Current,
    Stale,
    Running,
    Open,
}

impl Standing {
    fn mark(self) -> (&'static str, egui::Color32) {
        match self {
            Self::Current => ("✔", egui::Color32::from_rgb(110, 190, 130)),
            Self::Stale => ("~", theme::STALE),
            Self::Running => ("…", theme::TOUCHED),
            Self::Open => ("○", egui::Color32::from_gray(130)),
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Current => "current",
            Self::Stale => "stale",
            Self::Running => "running",
            Self::Open => "not done",
        }
    }
}

impl Studio {
    pub(super) fn stages(&mut self, ui: &mut Ui) {
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                ui.add_space(6.0);
                self.part_stage(ui);
                self.simulate_stage(ui);
                self.feasible_stage(ui);
                self.select_stage(ui);
                self.report_stage(ui);
            });
    }

    fn part_stage(&mut self, ui: &mut Ui) {
        let part = &self.document.part;
        let (lower, upper) = part.bounds();
        let size = (upper - lower) * 1000.0;
        let lines = vec![
            format!(
                "{} vertices, {} triangles",
                part.positions().len(),
                part.triangles().len()
            ),
            format!("{:.1} × {:.1} × {:.1} mm", size.x, size.y, size.z),
            format!("mean element {:.2} mm", part.mean_edge() * 1000.0),
            format!("{} supports", self.document.state.project.supports.len()),
        ];
        let standing = if self.document.state.project.supports.is_empty() {
            Standing::Open
        } else {
            Standing::Current
        };
        stage(ui, "Part and supports", standing, &lines);
    }

    fn simulate_stage(&mut self, ui: &mut Ui) {
        let key = self.document.simulation_key();
        let running = self.job.as_ref().is_some_and(|j| j.name == "Simulate");
        let standing = standing(self.simulation.as_ref().map(|s| s.key == key), running);
        let expected = || {
            let budget = self.document.state.project.budget.quality.budget();
            let (sites, touches, gigabytes) =
                crate::design::expected_size(&self.document.inputs(), &budget);
            vec![format!(
                "about {sites} sites × {touches} touches, {gigabytes:.2} GB"
            )]
        };
        let lines = self.simulation.as_ref().map_or_else(expected, |s| {
            let dataset = &s.simulated.dataset;
            let mut lines = vec![
                format!(
                    "{} sites × {} touches",
                    dataset.sites.len(),
                    dataset.touches.len()
                ),
                format!("{} unknowns, {:.1} s", s.simulated.unknowns, s.seconds),
            ];
            lines.extend(trust(&s.simulated));
            lines
        });
        stage(ui, "Simulate", standing, &lines);
        self.button(ui, Command::Simulate);
        ui.add_space(6.0);
    }

    fn feasible_stage(&mut self, ui: &mut Ui) {
        let key = self.document.feasible_key();
        let standing = standing(self.feasibility.as_ref().map(|f| f.0 == key), false);
        let lines = self.feasibility.as_ref().map_or_else(Vec::new, |(_, f)| {
            let mut lines = vec![format!("{} of {} sites", f.sites().len(), f.verdicts.len())];
            let taken = f.taken().into_iter().filter(|(_, n)| *n > 0);
            lines.extend(
                taken.map(|(filter, n)| format!("− {n}  {}", filter.label().to_lowercase())),
            );
            lines
        });
        stage(ui, "Feasible region", standing, &lines);
    }

    fn select_stage(&mut self, ui: &mut Ui) {
        let key = self.document.selection_key();
        let running = self.job.as_ref().is_some_and(|j| j.name == "Select gauges");
        let standing = standing(self.design.as_ref().map(|d| d.key == key), running);
        let lines = self.design.as_ref().map_or_else(Vec::new, |d| {
            let chosen = d.design.chosen().len();
            let first = d.design.selections.first().map(|s| s.selector.name());
            let rows = d.design.evaluation.rows.iter();
            let mut lines = vec![
                format!("{} candidates", d.design.reduced.sites.len()),
                format!("{chosen} gauges, {:.1} s", d.seconds),
            ];
            lines.extend(
                rows.filter(|r| r.sensors == chosen && Some(r.selector.as_str()) == first)
                    .map(|r| format!("{:.2} mm, {}", r.error_mm, r.region)),
            );
            lines
        });
        stage(ui, "Select and evaluate", standing, &lines);
        if let Some(d) = &self.design {
            // What the model says of itself stands under “Simulate” already.
            let known = &d.design.simulated.achieved.notes;
            let notes: Vec<String> = d.design.notes();
            let notes: Vec<&String> = notes.iter().filter(|n| !known.contains(n)).collect();
            if !notes.is_empty() {
                egui::CollapsingHeader::new(format!("{} notes", notes.len()))
                    .id_salt("selection notes")
                    .show(ui, |ui| {
                        for note in notes {
                            ui.label(RichText::new(note).small());
                        }
                    });
            }
        }
        self.button(ui, Command::Select);
        ui.add_space(6.0);
    }

    fn report_stage(&mut self, ui: &mut Ui) {
        let key = self.document.selection_key();
        let standing = standing(self.design.as_ref().map(|d| d.key == key), false);
        stage(ui, "Report", standing, &[]);
        self.button(ui, Command::Export);
    }

    /// The bar at the bottom: the running job, and messages until they are read.
    pub(super) fn status(&mut self, ui: &mut Ui) {
        // As tall with a job as without one: nothing above it jumps.
        ui.set_min_height(ui.spacing().interact_size.y + 6.0);
        if let Some(job) = &self.job {
            let progress = job.progress();
            let (stage, share) = progress.map_or(("Starting", 0.0), |p| {
                (p.stage, p.done as f32 / p.total.max(1) as f32)
            });
            let elapsed = job.elapsed().as_secs();
            let mut cancel = false;
            ui.horizontal(|ui| {
                let text = if job.is_cancelling() {
                    "Cancelling …".to_owned()
                } else {
                    format!("{stage}  {:.0} %  ·  {elapsed} s", 100.0 * share)
                };
                ui.add(
                    egui::ProgressBar::new(share)
                        .text(text)
                        .desired_width((ui.available_width() - 110.0).max(80.0)),
                );
                cancel = ui
                    .add_enabled(!job.is_cancelling(), egui::Button::new("Cancel job"))
                    .clicked();
            });
            if cancel {
                self.cancel();
            }
            ui.ctx()
                .request_repaint_after(std::time::Duration::from_millis(100));
        }
        let mut read = None;
        for (k, message) in self.messages.iter().enumerate().rev().take(4) {
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
            self.messages.remove(k);
        }
        if self.job.is_none() && self.messages.is_empty() {
            ui.weak("Ready");
        }
    }
}

/// What the elastic model says of its own error, and what must be known before it is believed.
fn trust(simulated: &Simulated) -> Vec<String> {
    let d = &simulated.discretization;
    let l = &simulated.linearity;
    let mut lines = vec![
        format!(
            "mesh: about {:.1} % ({:.3} mm) under a touch, strain {:.1} %",
            d.displacement_percent, d.displacement_mm, d.strain_percent
        ),
        format!(
            "linearity: up to {:.1} % at {:.1} N",
            l.largest_percent.abs(),
            l.force_n
        ),
    ];
    lines.extend(simulated.achieved.notes.iter().cloned());
    lines
}

/// `current` says whether there is a result and whether it still holds.
fn standing(current: Option<bool>, running: bool) -> Standing {
    match current {
        _ if running => Standing::Running,
        Some(true) => Standing::Current,
        Some(false) => Standing::Stale,
        None => Standing::Open,
    }
}

fn stage(ui: &mut Ui, title: &str, standing: Standing, lines: &[String]) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let (mark, colour) = standing.mark();
        ui.label(RichText::new(mark).color(colour).monospace())
            .on_hover_text(standing.word());
        ui.label(RichText::new(title).strong());
        if standing == Standing::Stale {
            ui.weak("stale");
        }
    });
    for line in lines {
        ui.add(egui::Label::new(RichText::new(line).size(11.5).weak()).wrap());
    }
}

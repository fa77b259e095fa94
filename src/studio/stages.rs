//! The left side: the stages of the road, how each stands, what it last achieved, and what to press next.

use egui::{RichText, Ui};

use super::{Command, Studio, theme};
use crate::design::{Design, Simulated, Step};
use crate::session::Task;

/// The stages, in the order of the road.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    Part,
    Supports,
    #[default]
    Simulation,
    Feasible,
    Candidates,
    Selection,
    Evaluation,
    Report,
    Live,
}

impl Stage {
    pub const ALL: [Self; 9] = [
        Self::Part,
        Self::Supports,
        Self::Simulation,
        Self::Feasible,
        Self::Candidates,
        Self::Selection,
        Self::Evaluation,
        Self::Report,
        Self::Live,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Part => "Part",
            Self::Supports => "Supports and material",
            Self::Simulation => "Simulation",
            Self::Feasible => "Feasible region",
            Self::Candidates => "Candidates",
            Self::Selection => "Selection",
            Self::Evaluation => "Evaluation",
            Self::Report => "Report",
            Self::Live => "Live",
        }
    }
}

/// How a stage stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    Open,
    Running,
    Current,
    /// Holds, and a finer one is asked for.
    Draft,
    Stale,
    Failed(String),
}

impl Standing {
    fn mark(&self) -> (&'static str, egui::Color32) {
        match self {
            Self::Current => ("✔", egui::Color32::from_rgb(110, 190, 130)),
            Self::Draft => ("◐", egui::Color32::from_rgb(110, 190, 130)),
            Self::Stale => ("~", theme::STALE),
            Self::Running => ("…", theme::TOUCHED),
            Self::Open => ("○", egui::Color32::from_gray(130)),
            Self::Failed(_) => ("✖", theme::ERROR),
        }
    }

    fn word(&self) -> &'static str {
        match self {
            Self::Current => "current",
            Self::Draft => "draft",
            Self::Stale => "stale",
            Self::Running => "running",
            Self::Open => "not done",
            Self::Failed(_) => "failed",
        }
    }
}

impl Studio {
    pub(super) fn stages(&mut self, ui: &mut Ui) {
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                ui.add_space(6.0);
                for stage in Stage::ALL {
                    self.stage_row(ui, stage);
                }
                ui.add_space(8.0);
                ui.checkbox(&mut self.session.desk.follow, Command::Follow.name())
                    .on_hover_text(Command::Follow.tooltip());
            });
    }

    fn stage_row(&mut self, ui: &mut Ui, stage: Stage) {
        let standing = self.standing(stage);
        ui.add_space(2.0);
        let (mark, colour) = standing.mark();
        ui.horizontal(|ui| {
            ui.add_sized(
                [14.0, ui.spacing().interact_size.y],
                egui::Label::new(RichText::new(mark).color(colour).monospace()),
            )
            .on_hover_text(standing.word());
            let title = RichText::new(stage.name()).strong();
            let chosen = self.stage == stage;
            let button = ui
                .add(egui::Button::selectable(chosen, title))
                .on_hover_text("Show the settings of this stage")
                .accessible_name(format!("Stage: {}, {}", stage.name(), standing.word()));
            if button.clicked() {
                self.stage = stage;
            }
            if !matches!(standing, Standing::Current | Standing::Open) {
                ui.label(RichText::new(standing.word()).small().color(colour));
            }
        });
        let lines = self.achieved(stage);
        let next = next_commands(stage);
        let failed = matches!(standing, Standing::Failed(_));
        if lines.is_empty() && next.is_empty() && !failed {
            return;
        }
        ui.indent(stage.name(), |ui| {
            if let Standing::Failed(message) = &standing {
                let text = RichText::new(message).size(11.5).color(theme::ERROR);
                ui.add(egui::Label::new(text).wrap());
            }
            for line in lines {
                ui.add(egui::Label::new(RichText::new(line).size(11.5).weak()).wrap());
            }
            self.doubts_of(ui, stage);
            self.notes_of(ui, stage);
            for &command in next {
                self.button(ui, command);
            }
        });
    }

    /// How a stage stands.
    #[must_use]
    pub fn standing(&self, stage: Stage) -> Standing {
        match stage {
            Stage::Part => self.part_standing(),
            Stage::Supports if self.session.document.state.project.supports.is_empty() => {
                Standing::Open
            }
            Stage::Supports => Standing::Current,
            Stage::Simulation => {
                let held = (self.session.results.simulation.as_ref()).map(|s| s.value.quality);
                self.standing_of(&Task::Simulate, self.session.simulation_holds(), held, None)
            }
            Stage::Feasible => self.feasible_standing(),
            Stage::Candidates => self.design_standing(Step::Reduce),
            Stage::Selection => self.design_standing(Step::Select),
            Stage::Evaluation => self.design_standing(Step::Evaluate),
            Stage::Live => self.live_standing(),
            Stage::Report if self.session.results.design.is_none() => Standing::Open,
            Stage::Report => match self.design_standing(Step::Evaluate) {
                Standing::Failed(_) | Standing::Running => Standing::Stale,
                other => other,
            },
        }
    }

    fn part_standing(&self) -> Standing {
        match self.session.document.misshapen() {
            _ if self.session.document.asks_for_another_part() => Standing::Stale,
            Some(why) => Standing::Failed(why.to_owned()),
            None => Standing::Current,
        }
    }

    fn live_standing(&self) -> Standing {
        use crate::link::State;
        match self.session.live.state() {
            _ if [Task::Sense, Task::Board]
                .iter()
                .any(|t| self.session.jobs.runs(*t)) =>
            {
                Standing::Running
            }
            Some(State::Live | State::Ended) => Standing::Current,
            Some(State::Waiting) => Standing::Running,
            Some(State::Silent) => Standing::Failed("the board has fallen silent".into()),
            Some(State::Gone) => Standing::Failed("unplugged".into()),
            None => Standing::Open,
        }
    }

    fn feasible_standing(&self) -> Standing {
        let shown = self.session.results.simulation.as_ref();
        if self.session.jobs.runs(Task::Filter) {
            Standing::Running
        } else if self.session.results.feasibility.is_none() {
            Standing::Open
        } else if self.session.current_verdicts().is_none() {
            Standing::Stale
        } else if shown.is_some_and(|s| s.value.quality < self.session.quality()) {
            Standing::Draft
        } else {
            Standing::Current
        }
    }

    fn design_standing(&self, step: Step) -> Standing {
        let held = self
            .session
            .results
            .design
            .as_ref()
            .map(|d| d.value.quality);
        self.standing_of(&Task::Design, self.session.design_holds(), held, Some(step))
    }

    /// `holds` says whether there is a result and whether it is of the project as it is; `step` which step
    /// of the job is meant.
    fn standing_of(
        &self,
        task: &dyn Fn(crate::budget::Quality) -> Task,
        holds: Option<bool>,
        held: Option<crate::budget::Quality>,
        step: Option<Step>,
    ) -> Standing {
        let qualities = crate::budget::Quality::ALL;
        let running = qualities.iter().any(|&q| self.session.jobs.runs(task(q)));
        let at = self.session.drive.step();
        if running && (step.is_none() || step == at) {
            return Standing::Running;
        }
        let failed = (qualities.iter()).find_map(|&q| self.session.pipeline_failure(task(q)));
        if let Some(message) = failed.filter(|_| step.is_none() || step == at) {
            return Standing::Failed(message.to_owned());
        }
        match holds {
            None => Standing::Open,
            Some(false) => Standing::Stale,
            Some(true) if held < Some(self.session.quality()) => Standing::Draft,
            Some(true) => Standing::Current,
        }
    }

    /// What a stage last achieved.
    fn achieved(&self, stage: Stage) -> Vec<String> {
        match stage {
            Stage::Part => self.part_lines(),
            Stage::Supports => {
                let project = &self.session.document.state.project;
                vec![
                    match project.supports.len() {
                        0 => "nothing is held yet".into(),
                        1 => "1 support".into(),
                        n => format!("{n} supports"),
                    },
                    if self.session.document.is_solid() {
                        format!("solid, {} GPa", project.material.youngs_modulus_gpa)
                    } else {
                        format!(
                            "{} mm thick, {} GPa",
                            project.part.thickness_mm, project.material.youngs_modulus_gpa
                        )
                    },
                ]
            }
            Stage::Simulation => self.simulation_lines(),
            Stage::Feasible => {
                self.session
                    .results
                    .feasibility
                    .as_ref()
                    .map_or_else(Vec::new, |f| {
                        let f = &f.value;
                        let taken = f.taken().into_iter().filter(|(_, n)| *n > 0);
                        std::iter::once(format!(
                            "{} of {} sites",
                            f.sites().len(),
                            f.verdicts.len()
                        ))
                        .chain(taken.map(|(by, n)| format!("− {n}  {}", by.label().to_lowercase())))
                        .collect()
                    })
            }
            Stage::Candidates => {
                let design = self.session.results.design.as_ref();
                design.map_or_else(Vec::new, |d| self.candidate_lines(&d.value.design))
            }
            Stage::Selection => self.selection_lines(),
            Stage::Evaluation => self.evaluation_lines(),
            Stage::Report => Vec::new(),
            Stage::Live if self.live_standing() != Standing::Current => Vec::new(),
            Stage::Live => vec![self.live_in_words().0],
        }
    }

    fn part_lines(&self) -> Vec<String> {
        let part = &self.session.document.part;
        let (lower, upper) = part.bounds();
        let size = (upper - lower) * 1000.0;
        vec![
            format!("{} triangles", part.triangles().len()),
            format!("{:.1} × {:.1} × {:.1} mm", size.x, size.y, size.z),
        ]
    }

    fn simulation_lines(&self) -> Vec<String> {
        let Some(s) = self.session.results.simulation.as_ref().map(|s| &s.value) else {
            if self.session.document.misshapen().is_some() {
                // What will be refused has no size to foresee.
                return Vec::new();
            }
            let budget = self.session.budget();
            let (sites, touches, gigabytes) =
                crate::design::expected_size(&self.session.document.inputs(), &budget);
            return vec![format!(
                "about {sites} sites × {touches} touches, {}",
                memory(gigabytes)
            )];
        };
        let dataset = &s.simulated.dataset;
        let quality = s.quality.title();
        let mut lines = vec![
            format!(
                "{} sites × {} touches",
                s.simulated.lattice,
                dataset.touches.len()
            ),
            format!(
                "{quality}: {} unknowns, {:.1} s",
                s.simulated.unknowns, s.seconds
            ),
        ];
        lines.extend(trust(&s.simulated));
        lines
    }

    fn selection_lines(&self) -> Vec<String> {
        let Some(d) = &self.session.results.design else {
            return self.session.gauges_before_selection().into_iter().collect();
        };
        let seconds: f64 = (d.value.design.seconds.iter())
            .filter(|s| s.stage.starts_with("select"))
            .map(|s| s.seconds)
            .sum();
        let mut lines = vec![format!(
            "{}: {} gauges by {}, {seconds:.1} s{}",
            d.value.quality.title(),
            d.value.design.chosen().len(),
            d.value.design.lead.title(),
            if d.value.design.selections.len() > 1 {
                " for all"
            } else {
                ""
            }
        )];
        if !self.session.drive.take && self.session.design_holds() == Some(true) {
            lines.push("Gauges were moved by hand".into());
        }
        lines
    }

    fn evaluation_lines(&self) -> Vec<String> {
        let Some(d) = &self.session.results.design else {
            return Vec::new();
        };
        let (lead, chosen) = (d.value.design.lead.name(), d.value.design.chosen().len());
        let rows = d.value.design.evaluation.rows.iter();
        let mut lines: Vec<String> = rows
            .filter(|r| r.sensors == chosen && r.selector == lead)
            .map(|r| format!("{:.2} mm, {}", r.error_mm, r.region))
            .collect();
        let judging = &d.value.design.evaluation.judging;
        lines.push(format!(
            "{} unseen touches{}{}",
            d.value.design.truth.touches.len(),
            judging
                .middle_n()
                .map_or(String::new(), |f| format!(" of {f} N, matched")),
            self.took("evaluate")
        ));
        lines.extend(self.session.promise_line());
        lines
    }

    fn candidate_lines(&self, design: &Design) -> Vec<String> {
        let feasible = design.reduced.feasible.len();
        let Some(candidates) = &design.candidates else {
            return vec![format!("all {feasible} feasible sites")];
        };
        let kept = format!(
            "{} of {feasible} sites{}",
            candidates.rows.len(),
            self.took("reduce")
        );
        let left = candidates.unexplained;
        let left = left.map(|u| format!("{:.2} % of the variance unexplained", 100.0 * u));
        std::iter::once(kept).chain(left).collect()
    }

    /// ", 1.2 s" of a stage of the last design, where it was run for it.
    fn took(&self, stage: &str) -> String {
        let stages = self
            .session
            .results
            .design
            .iter()
            .flat_map(|d| &d.value.design.seconds);
        let found = { stages }.find(|s| s.stage == stage);
        found.map_or_else(String::new, |s| format!(", {:.1} s", s.seconds))
    }

    /// What cannot be trusted, in the open.
    fn doubts_of(&self, ui: &mut Ui, stage: Stage) {
        let doubts = match (
            stage,
            &self.session.results.simulation,
            &self.session.results.design,
        ) {
            (Stage::Simulation, Some(s), _) => s.value.simulated.doubts(),
            (Stage::Evaluation, _, Some(d)) => {
                let of_model = d.value.design.simulated.doubts();
                let doubts = d.value.design.doubts().into_iter();
                doubts.filter(|d| !of_model.contains(d)).collect()
            }
            _ => return,
        };
        for doubt in doubts {
            let text = RichText::new(format!("Not to be trusted: {}", doubt.words));
            ui.add(egui::Label::new(text.size(11.5).color(theme::ERROR)).wrap());
        }
    }

    /// What a reader must know before a result is believed, folded up.
    fn notes_of(&self, ui: &mut Ui, stage: Stage) {
        let of_model: Vec<String> = (self.session.results.simulation.as_ref())
            .map(|s| s.value.simulated.achieved.words().cloned().collect())
            .unwrap_or_default();
        let notes: Vec<String> = match (stage, &self.session.results.design) {
            (Stage::Simulation, _) => of_model,
            (Stage::Evaluation, Some(d)) => {
                let notes = [d.value.design.cautions(), d.value.design.notes()]
                    .concat()
                    .into_iter();
                notes.filter(|n| !of_model.contains(n)).collect()
            }
            _ => return,
        };
        if notes.is_empty() {
            return;
        }
        let title = match notes.len() {
            1 => "1 note".to_owned(),
            n => format!("{n} notes"),
        };
        egui::CollapsingHeader::new(RichText::new(title).size(11.5))
            .id_salt((stage.name(), "notes"))
            .show(ui, |ui| {
                for note in notes {
                    ui.add(egui::Label::new(RichText::new(note).size(11.5)).wrap());
                }
            });
    }

    /// The bar at the bottom: running jobs, and messages until they are read.
    pub(super) fn status(&mut self, ui: &mut Ui) {
        // As tall with a job as without one: nothing above it jumps.
        ui.set_min_height(ui.spacing().interact_size.y + 6.0);
        self.running_jobs(ui);
        let mut read = None;
        for (k, message) in self.session.news.messages.iter().enumerate().rev().take(4) {
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
            self.session.news.messages.remove(k);
        }
        if self.session.jobs.running().is_empty() && self.session.news.messages.is_empty() {
            ui.weak("Ready");
        }
    }
}

/// What to press at a stage.
fn next_commands(stage: Stage) -> &'static [Command] {
    match stage {
        Stage::Simulation => &[Command::Simulate],
        Stage::Selection => &[Command::Select, Command::Keep],
        Stage::Report => &[Command::Export],
        _ => &[],
    }
}

/// What the elastic model says of its own error.
fn trust(simulated: &Simulated) -> Vec<String> {
    let d = &simulated.discretization;
    let mut lines = vec![format!(
        "mesh: about {:.1} % ({:.3} mm) under a touch, strain {:.1} %",
        d.displacement_percent, d.displacement_mm, d.strain_percent
    )];
    if let Some(l) = &simulated.linearity {
        lines.push(format!(
            "linearity: up to {:.1} % at {:.1} N",
            l.largest_percent.abs(),
            l.force_n
        ));
    }
    lines
}

/// Memory in the unit that it is read in.
fn memory(gigabytes: f64) -> String {
    if gigabytes < 0.1 {
        format!("{:.0} MB", (gigabytes * 1e3).max(1.0))
    } else {
        format!("{gigabytes:.1} GB")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::design;
    use crate::document::Document;
    use crate::io::opening;
    use crate::mesh::TriMesh;
    use crate::session::{Session, Wake};

    #[test]
    fn a_vertex_far_away_is_named_at_the_part_and_nothing_is_foreseen() {
        let usual = opening::bundled().unwrap();
        let mut loaded = opening::bundled().unwrap();
        let mut positions = loaded.inputs.part.positions().to_vec();
        positions[0].x = 1e4;
        let triangles = loaded.inputs.part.triangles();
        let (part, _) = TriMesh::new(&positions, triangles, 0).unwrap();
        loaded.inputs.part = Arc::new(part);
        let refused = design::check_shape(&loaded.inputs.part).unwrap_err();

        let studio = Studio::around(Session::new(Document::new(loaded, None), Wake::default()));
        let said = refused.to_string();
        assert!(said.contains("one vertex of the part"), "{said}");
        assert_eq!(studio.standing(Stage::Part), Standing::Failed(said));
        assert_eq!(studio.simulation_lines(), Vec::<String>::new());

        let studio = Studio::around(Session::new(Document::new(usual, None), Wake::default()));
        assert_eq!(studio.standing(Stage::Part), Standing::Current);
        assert!(studio.simulation_lines()[0].contains("sites"));
    }
}

//! The left side: the stages of the pipeline, how each stands, what it last achieved, and what to press next.

use egui::{RichText, Ui};

use super::ask::Ask;
use super::commands::UiCommand;
use super::theme;
use super::view::Stage;
use super::words::live_in_words;
use crate::design::{Design, Simulated};
use crate::session::{Session, Standing};
use crate::units;

/// The mark of a standing, and its colour.
fn mark(standing: &Standing) -> (&'static str, egui::Color32) {
    match standing {
        Standing::Current => ("✔", egui::Color32::from_rgb(110, 190, 130)),
        Standing::Draft => ("◐", egui::Color32::from_rgb(110, 190, 130)),
        Standing::Stale => ("~", theme::STALE),
        Standing::Running => ("…", theme::TOUCHED),
        Standing::Open => ("○", egui::Color32::from_gray(130)),
        Standing::Failed(_) => ("✖", theme::ERROR),
    }
}

/// In a word.
fn word(standing: &Standing) -> &'static str {
    match standing {
        Standing::Current => "current",
        Standing::Draft => "draft",
        Standing::Stale => "stale",
        Standing::Running => "running",
        Standing::Open => "not done",
        Standing::Failed(_) => "failed",
    }
}

/// All stages, and whether changes are followed.
pub fn stages(ask: &mut Ask<'_>, ui: &mut Ui) {
    egui::ScrollArea::vertical()
        .auto_shrink(false)
        .show(ui, |ui| {
            ui.add_space(6.0);
            for stage in Stage::ALL {
                stage_row(ask, ui, stage);
            }
            ui.add_space(8.0);
            ask.edit_desk(|desk| {
                ui.checkbox(&mut desk.follow, UiCommand::Follow.name())
                    .on_hover_text(UiCommand::Follow.tooltip());
            });
        });
}

fn stage_row(ask: &mut Ask<'_>, ui: &mut Ui, stage: Stage) {
    let standing = ask.session.standing(stage);
    ui.add_space(2.0);
    let (mark, colour) = mark(&standing);
    ui.horizontal(|ui| {
        ui.add_sized(
            [14.0, ui.spacing().interact_size.y],
            egui::Label::new(RichText::new(mark).color(colour).monospace()),
        )
        .on_hover_text(word(&standing));
        let title = RichText::new(stage.name()).strong();
        let chosen = ask.view.stage == stage;
        let button = ui
            .add(egui::Button::selectable(chosen, title))
            .on_hover_text("Show the settings of this stage")
            .accessible_name(format!("Stage: {}, {}", stage.name(), word(&standing)));
        if button.clicked() {
            ask.view.stage = stage;
        }
        if !matches!(standing, Standing::Current | Standing::Open) {
            ui.label(RichText::new(word(&standing)).small().color(colour));
        }
    });
    let lines = achieved(ask.session, stage);
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
        doubts_of(ask.session, ui, stage);
        notes_of(ask.session, ui, stage);
        for &command in next {
            ask.button(ui, command);
        }
    });
}

/// What a stage last achieved.
fn achieved(session: &Session, stage: Stage) -> Vec<String> {
    match stage {
        Stage::Part => part_lines(session),
        Stage::Supports => {
            let project = &session.document.state.project;
            vec![
                match project.supports.len() {
                    0 => "nothing is held yet".into(),
                    1 => "1 support".into(),
                    n => format!("{n} supports"),
                },
                if session.document.is_solid() {
                    format!("solid, {} GPa", project.material.youngs_modulus_gpa)
                } else {
                    format!(
                        "{} mm thick, {} GPa",
                        project.part.thickness_mm, project.material.youngs_modulus_gpa
                    )
                },
            ]
        }
        Stage::Simulation => simulation_lines(session),
        Stage::Feasible => session
            .results
            .feasibility
            .as_ref()
            .map_or_else(Vec::new, |f| {
                let f = &f.value;
                let taken = f.taken().into_iter().filter(|(_, n)| *n > 0);
                std::iter::once(format!("{} of {} sites", f.sites().len(), f.verdicts.len()))
                    .chain(taken.map(|(by, n)| format!("− {n}  {}", by.label().to_lowercase())))
                    .collect()
            }),
        Stage::Candidates => {
            let design = session.results.design.as_ref();
            design.map_or_else(Vec::new, |d| candidate_lines(session, &d.value.design))
        }
        Stage::Selection => selection_lines(session),
        Stage::Evaluation => evaluation_lines(session),
        Stage::Report => Vec::new(),
        Stage::Bench => bench_lines(session),
        Stage::Live if session.standing(Stage::Live) != Standing::Current => Vec::new(),
        Stage::Live => vec![live_in_words(session).0],
    }
}

fn bench_lines(session: &Session) -> Vec<String> {
    let counted = session.bench.look(|p| {
        let [made, failed] = p.made_and_failed();
        let made = format!("{made} of {} presses", p.states.len());
        std::iter::once(made)
            .chain((failed > 0).then(|| format!("{failed} failed")))
            .collect()
    });
    counted.unwrap_or_default()
}

fn part_lines(session: &Session) -> Vec<String> {
    let part = &session.document.part;
    let (lower, upper) = part.bounds();
    let size = (upper - lower) * 1000.0;
    vec![
        format!("{} triangles", part.as_given().triangles().len()),
        format!("{:.1} × {:.1} × {:.1} mm", size.x, size.y, size.z),
    ]
}

fn simulation_lines(session: &Session) -> Vec<String> {
    let Some(s) = session.results.simulation.as_ref().map(|s| &s.value) else {
        if session.document.misshapen().is_some() {
            // What will be refused has no size to foresee.
            return Vec::new();
        }
        let budget = session.budget();
        let (sites, touches, bytes) =
            crate::design::expected_size(&session.document.inputs(), &budget);
        return vec![format!(
            "about {sites} sites × {touches} touches, {}",
            memory(units::gigabytes(bytes))
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

fn selection_lines(session: &Session) -> Vec<String> {
    let Some(d) = &session.results.design else {
        return session.gauges_before_selection().into_iter().collect();
    };
    let seconds: f64 = (d.value.design.seconds.iter())
        .filter(|s| s.stage.starts_with("select"))
        .map(|s| s.seconds)
        .sum();
    let mut lines = vec![format!(
        "{}: {} gauges by {}, {seconds:.1} s{}",
        d.value.quality.title(),
        d.value.design.chosen().len(),
        d.value.design.chosen_by.title(),
        if d.value.design.selections.len() > 1 {
            " for all"
        } else {
            ""
        }
    )];
    if !session.drive.take && session.design_holds() == Some(true) {
        lines.push("Gauges were moved by hand".into());
    }
    lines
}

fn evaluation_lines(session: &Session) -> Vec<String> {
    let Some(d) = &session.results.design else {
        return Vec::new();
    };
    let rows = d.value.design.evaluation.of(d.value.design.chosen_id());
    let mut lines: Vec<String> = rows
        .map(|r| format!("{:.2} mm, {}", r.error_mm, r.region))
        .collect();
    let judging = &d.value.design.evaluation.judging;
    lines.push(format!(
        "{} unseen touches{}{}",
        d.value.design.reference.touches.len(),
        judging
            .middle_n()
            .map_or(String::new(), |f| format!(" of {f} N, matched")),
        took(session, "evaluate")
    ));
    lines.extend(session.promise_line());
    lines
}

fn candidate_lines(session: &Session, design: &Design) -> Vec<String> {
    let feasible = design.reduced.feasible.len();
    let Some(candidates) = &design.candidates else {
        return vec![format!("all {feasible} feasible sites")];
    };
    let kept = format!(
        "{} of {feasible} sites{}",
        candidates.rows.len(),
        took(session, "reduce")
    );
    let left = candidates.unexplained;
    let left = left.map(|u| format!("{:.2} % of the variance unexplained", 100.0 * u));
    std::iter::once(kept).chain(left).collect()
}

/// ", 1.2 s" of a stage of the last design, where it was run for it.
fn took(session: &Session, stage: &str) -> String {
    let stages = session
        .results
        .design
        .iter()
        .flat_map(|d| &d.value.design.seconds);
    let found = { stages }.find(|s| s.stage == stage);
    found.map_or_else(String::new, |s| format!(", {:.1} s", s.seconds))
}

/// What cannot be trusted, in the open.
fn doubts_of(session: &Session, ui: &mut Ui, stage: Stage) {
    let doubts = match (stage, &session.results.simulation, &session.results.design) {
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
fn notes_of(session: &Session, ui: &mut Ui, stage: Stage) {
    let of_model: Vec<String> = (session.results.simulation.as_ref())
        .map(|s| s.value.simulated.achieved.words().cloned().collect())
        .unwrap_or_default();
    let notes: Vec<String> = match (stage, &session.results.design) {
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

/// What to press at a stage.
fn next_commands(stage: Stage) -> &'static [UiCommand] {
    match stage {
        Stage::Simulation => &[UiCommand::Simulate],
        Stage::Selection => &[UiCommand::Select, UiCommand::Keep],
        Stage::Report => &[UiCommand::Export],
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
    use crate::session::Wake;

    #[test]
    fn what_is_foreseen_is_said_in_the_unit_that_it_has() {
        let loaded = opening::bundled().unwrap();
        let inputs = loaded.inputs.clone();
        let session = Session::new(Document::new(loaded, None), Wake::default());
        let (_, _, bytes) = design::expected_size(&inputs, &session.budget());
        let lines = simulation_lines(&session);
        let (value, unit) = match bytes {
            ..1e8 => (bytes / 1e6, "MB"),
            _ => (bytes / 1e9, "GB"),
        };
        let said = lines[0]
            .rsplit(", ")
            .next()
            .and_then(|s| s.split_once(' '))
            .unwrap();
        let number: f64 = said.0.parse().unwrap();
        assert_eq!(said.1, unit);
        assert!((number - value).abs() <= 0.5, "{lines:?}: {bytes}");
    }

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

        let session = Session::new(Document::new(loaded, None), Wake::default());
        let said = refused.to_string();
        assert!(said.contains("one vertex of the part"), "{said}");
        assert_eq!(session.standing(Stage::Part), Standing::Failed(said));
        assert_eq!(simulation_lines(&session), Vec::<String>::new());

        let session = Session::new(Document::new(usual, None), Wake::default());
        assert_eq!(session.standing(Stage::Part), Standing::Current);
        assert!(simulation_lines(&session)[0].contains("sites"));
    }
}

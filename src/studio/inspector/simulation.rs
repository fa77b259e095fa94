//! Quality, touches, and where signals are read.

use egui::{RichText, Ui};

use super::super::ask::Ask;
use super::super::form::{choice, count, number, rows};
use super::super::view::Tab;
use crate::budget::{Limits, Quality};
use crate::dataset::Signal;
use crate::project::{FORCES, FRICTION, Lattice, PartModel, Project, TIP_OFF, TOUCHES};

/// The settings of the simulation.
pub fn simulation_form(ask: &mut Ask<'_>, ui: &mut Ui) {
    ask.edit(|project| quality(ui, project));
    quality_promises(ask, ui);
    ask.edit(|project| {
        rows(ui, "Touch", |ui| touch(ui, project));
        rows(ui, "Signal and sites", |ui| sites(ui, project));
    });
}

fn quality(ui: &mut Ui, project: &mut Project) {
    ui.horizontal(|ui| {
        ui.label("Quality");
        for quality in Quality::ALL {
            ui.selectable_value(&mut project.budget.quality, quality, quality.title());
        }
    })
    .response
    .on_hover_text("How much time may be spent for accuracy");
    if !project.budget.limits.are_none() {
        ui.horizontal(|ui| {
            ui.label("Limits of its own hold")
                .on_hover_text("budget.limits in the project's file");
            if ui.button("Lift limits").clicked() {
                project.budget.limits = Limits::default();
            }
        });
    }
    ui.add_space(4.0);
}

/// What each quality was measured to cost and achieve.
fn quality_promises(ask: &mut Ask<'_>, ui: &mut Ui) {
    for quality in Quality::ALL {
        let chosen = quality == ask.session.quality();
        let text = RichText::new(ask.session.prediction_in_words(quality)).size(11.5);
        ui.add(egui::Label::new(if chosen { text } else { text.weak() }).wrap());
    }
    if ui.button("Speed against accuracy…").clicked() {
        ask.view.tab = Tab::Trade;
    }
}

fn touch(ui: &mut Ui, project: &mut Project) {
    let solid = project.part.model == PartModel::Solid;
    let touch = &mut project.touch;
    number(
        ui,
        "Force",
        &mut touch.force_n,
        1e-9..=1e9,
        0.1,
        " N",
        "Pressed along the inward normal",
    );
    let [lightest, hardest] = &mut touch.forces_n;
    let (least, most) = (*lightest, *hardest);
    number(
        ui,
        "Lightest touch",
        lightest,
        *FORCES.start()..=most,
        0.1,
        " N",
        "How hard touches come: from here to the hardest, evenly over the logarithm",
    );
    number(
        ui,
        "Hardest touch",
        hardest,
        least..=*FORCES.end(),
        0.1,
        " N",
        "How hard touches come: from the lightest to here, evenly over the logarithm",
    );
    number(
        ui,
        "Tip radius",
        &mut touch.tip_radius_mm,
        1e-3..=1e3,
        0.1,
        " mm",
        "The tip spreads the force smoothly over this radius",
    );
    number(
        ui,
        "Tip radius off",
        &mut touch.tip_tolerance_mm,
        TIP_OFF,
        0.01,
        " mm",
        "How much larger or smaller tips are that touch (standard deviation)",
    );
    number(
        ui,
        "Friction",
        &mut touch.friction_percent,
        FRICTION,
        0.5,
        " %",
        "How much of a touch's force drags along the surface, beside what presses (rms, in any direction)",
    );
    count(
        ui,
        "Touches",
        &mut touch.count,
        TOUCHES,
        "Simulated touches; lower qualities take fewer",
    );
    number(
        ui,
        "Edge margin",
        &mut touch.edge_margin_mm,
        0.0..=1e3,
        0.1,
        " mm",
        "Least distance of a touch from a free edge",
    );
    if solid {
        number(
            ui,
            "Fingertip",
            &mut touch.reach_mm,
            0.0..=1e3,
            0.5,
            " mm",
            "Radius of the ball that comes from outside: touches lie only where it gets to, not on what stands behind windows it does not fit through. The field “Faces” shows where",
        );
    }
}

fn sites(ui: &mut Ui, project: &mut Project) {
    let gauge = &mut project.gauge;
    choice(
        ui,
        "Signal",
        &mut gauge.signal,
        &Signal::ALL,
        signal_name,
        "What a site reports: strain is what a gauge measures, displacement what the paper used",
    );
    if gauge.signal == Signal::Strain {
        count(
            ui,
            "Directions",
            &mut gauge.directions,
            1..=4,
            "That a gauge may have at one place: 1 along the largest strain, 2 also across it",
        );
    } else {
        gauge.directions = 1;
    }
    number(
        ui,
        "Site spacing",
        &mut project.sites.spacing_mm,
        0.01..=1e4,
        0.05,
        " mm",
        "Of the possible gauge positions on the inside",
    );
    let name = |l| match l {
        Lattice::Even => "Even",
        Lattice::Unrolled => "Rows and columns",
    };
    choice(
        ui,
        "Lattice",
        &mut project.sites.lattice,
        &[Lattice::Even, Lattice::Unrolled],
        name,
        "Even suits any surface; rows and columns suit tubes",
    );
    let mut seed = project.budget.seed as usize;
    let before = seed;
    count(
        ui,
        "Seed",
        &mut seed,
        0..=usize::MAX >> 12,
        "Of every random draw: the same seed gives the same design",
    );
    if seed != before {
        project.budget.seed = seed as u64;
    }
}

fn signal_name(signal: Signal) -> &'static str {
    match signal {
        Signal::Displacement => "Displacement",
        Signal::NormalDisplacement => "Normal displacement",
        Signal::Strain => "Strain",
    }
}

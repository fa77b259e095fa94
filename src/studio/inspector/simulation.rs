//! Quality, touches, and where signals are read.

use egui::{RichText, Ui};

use super::super::ask::Ask;
use super::super::form::{choice, count, counted, number, quantity, rows};
use super::super::view::Tab;
use crate::budget::{BudgetLimits, Quality};
use crate::dataset::Signal;
use crate::project::{BudgetKeys, GaugeKeys, PartModel, Project, SiteKeys, SiteLattice, TouchKeys};

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
    .on_hover_text(BudgetKeys::quality().sentence());
    if !project.budget.limits.are_none() {
        ui.horizontal(|ui| {
            ui.label("Limits of its own hold")
                .on_hover_text("budget.limits in the project's file");
            if ui.button("Lift limits").clicked() {
                project.budget.limits = BudgetLimits::default();
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
    number(ui, "Force", &mut touch.force_n, TouchKeys::force_n(), 0.1);
    let [lightest, hardest] = &mut touch.forces_n;
    let (least, most) = (*lightest, *hardest);
    let forces = TouchKeys::forces_n().numbers();
    quantity(
        ui,
        "Lightest touch",
        lightest,
        *forces.start()..=most,
        (0.1, "N"),
        "How hard touches come: from here to the hardest, evenly over the logarithm",
    );
    quantity(
        ui,
        "Hardest touch",
        hardest,
        least..=*forces.end(),
        (0.1, "N"),
        "How hard touches come: from the lightest to here, evenly over the logarithm",
    );
    number(
        ui,
        "Tip radius",
        &mut touch.tip_radius_mm,
        TouchKeys::tip_radius_mm(),
        0.1,
    );
    number(
        ui,
        "Tip radius off",
        &mut touch.tip_tolerance_mm,
        TouchKeys::tip_tolerance_mm(),
        0.01,
    );
    number(
        ui,
        "Friction",
        &mut touch.friction_percent,
        TouchKeys::friction_percent(),
        0.5,
    );
    count(ui, "Touches", &mut touch.count, TouchKeys::count());
    number(
        ui,
        "Edge margin",
        &mut touch.edge_margin_mm,
        TouchKeys::edge_margin_mm(),
        0.1,
    );
    if solid {
        number(
            ui,
            "Fingertip",
            &mut touch.reach_mm,
            TouchKeys::reach_mm(),
            0.5,
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
        &GaugeKeys::signal().sentence(),
    );
    if gauge.signal == Signal::Strain {
        count(
            ui,
            "Directions",
            &mut gauge.directions,
            GaugeKeys::directions(),
        );
    } else {
        gauge.directions = 1;
    }
    number(
        ui,
        "Site spacing",
        &mut project.sites.spacing_mm,
        SiteKeys::spacing_mm(),
        0.05,
    );
    let name = |l| match l {
        SiteLattice::Even => "Even",
        SiteLattice::Unrolled => "Rows and columns",
    };
    choice(
        ui,
        "Lattice",
        &mut project.sites.lattice,
        &[SiteLattice::Even, SiteLattice::Unrolled],
        name,
        &SiteKeys::lattice().sentence(),
    );
    let mut seed = project.budget.seed as usize;
    let before = seed;
    counted(
        ui,
        "Seed",
        &mut seed,
        BudgetKeys::seed().counts(),
        &BudgetKeys::seed().sentence(),
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

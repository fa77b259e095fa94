//! The right side: the project's settings, in the units of its file.

use egui::{CollapsingHeader, ComboBox, DragValue, Grid, Ui};

use super::{Studio, quality_name};
use crate::budget::Quality;
use crate::dataset::Signal;
use crate::limb::BoxMm;
use crate::mesh::unroll::Axis;
use crate::placement::SelectorKind;
use crate::project::{Lattice, Project, SupportKeys, SupportKind};

impl Studio {
    pub(super) fn inspector(&mut self, ui: &mut Ui) {
        let bounds = self.document.part.bounds();
        let bounds = [bounds.0, bounds.1].map(|p| (p * 1000.0).to_array());
        let from_file = !self.document.bundled;
        let bodies = self.document.repairs.bodies;
        let again = from_file && self.document.asks_for_another_part();
        let mask = self.document.state.painted.as_ref();
        let painted = mask.is_some_and(|m| m.iter().any(|&set| set));
        let mut asked = Asked::default();
        let project = &mut self.document.state.project;
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                ui.add_space(6.0);
                quality(ui, project);
                section(ui, "Part and material", true, |ui| {
                    part(ui, project);
                    if from_file {
                        asked.take_in_again = taking_in(ui, project, bodies, again);
                    }
                });
                section(ui, "Supports", false, |ui| {
                    asked.hold_painted = supports(ui, project, bounds, painted);
                });
                section(ui, "Touch", true, |ui| touch(ui, project));
                section(ui, "Gauge", true, |ui| gauge(ui, project));
                section(ui, "Feasible region and sites", false, |ui| {
                    feasible(ui, project);
                });
                section(ui, "Selection", true, |ui| selection(ui, project));
            });
        if asked.hold_painted {
            self.document.hold_painted();
        }
        if asked.take_in_again {
            self.take_in_again();
        }
    }
}

/// What was pressed that concerns more than the settings.
#[derive(Default)]
struct Asked {
    hold_painted: bool,
    take_in_again: bool,
}

/// How the mesh file is taken in; whether it is to be read again.
fn taking_in(ui: &mut Ui, project: &mut Project, bodies: usize, again: bool) -> bool {
    if bodies > 1 {
        count(
            ui,
            "Body",
            &mut project.part.body,
            0..=bodies - 1,
            "Which connected body of the file, 0 being the one with the largest surface",
        );
    }
    number(
        ui,
        "Weld",
        &mut project.part.weld_mm,
        0.0..=1e3,
        0.001,
        " mm",
        "Vertices nearer to each other than this are joined; 0 joins equal ones only",
    );
    number(
        ui,
        "Fill holes",
        &mut project.part.fill_holes_mm,
        0.0..=1e4,
        0.1,
        " mm",
        "Holes up to this far across are filled",
    );
    if !again {
        return false;
    }
    ui.label("");
    let pressed = ui
        .button("Read the mesh again")
        .on_hover_text(
            "With this body and these repairs. What was painted on other vertices is lost",
        )
        .clicked();
    ui.end_row();
    pressed
}

fn section(ui: &mut Ui, title: &str, open: bool, content: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(title)
        .default_open(open)
        .show(ui, |ui| {
            Grid::new(title)
                .num_columns(2)
                .spacing([10.0, 5.0])
                .min_col_width(96.0)
                .show(ui, content);
        });
}

/// One row: a label and a number.
fn number(
    ui: &mut Ui,
    label: &str,
    value: &mut f64,
    range: std::ops::RangeInclusive<f64>,
    speed: f64,
    suffix: &str,
    help: &str,
) {
    let name = ui.label(label);
    ui.add(
        DragValue::new(value)
            .range(range)
            .clamp_existing_to_range(false)
            .speed(speed)
            .max_decimals(4)
            .suffix(suffix),
    )
    .labelled_by(name.id)
    .on_hover_text(help);
    ui.end_row();
}

/// One row: a label and a share, shown in percent.
fn percentage(
    ui: &mut Ui,
    label: &str,
    share: &mut f64,
    range: std::ops::RangeInclusive<f64>,
    help: &str,
) {
    let mut percent = 100.0 * *share;
    number(ui, label, &mut percent, range, 0.05, " %", help);
    // Not every frame: a hundredfold and back is not always the same number.
    if (percent - 100.0 * *share).abs() > 0.0 {
        *share = percent / 100.0;
    }
}

/// One row: a label and a count.
fn count(
    ui: &mut Ui,
    label: &str,
    value: &mut usize,
    range: std::ops::RangeInclusive<usize>,
    help: &str,
) {
    let name = ui.label(label);
    ui.add(
        DragValue::new(value)
            .range(range)
            .clamp_existing_to_range(false)
            .speed(1.0),
    )
    .labelled_by(name.id)
    .on_hover_text(help);
    ui.end_row();
}

/// One row: a label and a choice.
fn choice<T: PartialEq + Copy>(
    ui: &mut Ui,
    label: &str,
    value: &mut T,
    all: &[T],
    name: impl Fn(T) -> &'static str,
    help: &str,
) {
    ui.label(label);
    ComboBox::new(label, "")
        .selected_text(name(*value))
        .width(120.0)
        .show_ui(ui, |ui| {
            for &option in all {
                ui.selectable_value(value, option, name(option));
            }
        })
        .response
        .accessible_name(label)
        .on_hover_text(help);
    ui.end_row();
}

fn quality(ui: &mut Ui, project: &mut Project) {
    ui.horizontal(|ui| {
        ui.label("Quality");
        for quality in Quality::ALL {
            ui.selectable_value(&mut project.budget.quality, quality, quality_name(quality));
        }
    })
    .response
    .on_hover_text("How much time may be spent for accuracy");
    ui.add_space(4.0);
}

fn axis_name(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
        Axis::Z => "z",
    }
}

const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

fn part(ui: &mut Ui, project: &mut Project) {
    number(
        ui,
        "Thickness",
        &mut project.part.thickness_mm,
        1e-4..=1e4,
        0.01,
        " mm",
        "Of the shell; the mesh is its mid-surface",
    );
    number(
        ui,
        "Young's modulus",
        &mut project.material.youngs_modulus_gpa,
        1e-6..=1e4,
        0.01,
        " GPa",
        "Printed nylon: 1.7 GPa",
    );
    number(
        ui,
        "Poisson's ratio",
        &mut project.material.poissons_ratio,
        -0.99..=0.499,
        0.005,
        "",
        "Printed nylon: 0.35",
    );
    choice(
        ui,
        "Axis",
        &mut project.part.axis,
        &AXES,
        axis_name,
        "The axis the part is unrolled about",
    );
}

/// Whether what is painted is to be held.
fn supports(ui: &mut Ui, project: &mut Project, bounds: BoxMm, painted: bool) -> bool {
    let mut removed = None;
    for (k, support) in project.supports.iter_mut().enumerate() {
        let number = k + 1;
        let kinds = [
            SupportKind::Clamped,
            SupportKind::Pinned,
            SupportKind::Symmetry,
        ];
        let label = format!("Support {number}");
        choice(
            ui,
            &label,
            &mut support.kind,
            &kinds,
            kind_name,
            "Clamped: no displacement, no rotation. Pinned: no displacement. Symmetry: a mirror plane",
        );
        if let Some(name) = &support.vertices {
            ui.label("Vertices");
            ui.label(name);
            ui.end_row();
        }
        let corners = support.box_mm.iter_mut().flatten();
        for (end, corner) in ["from", "to"].into_iter().zip(corners) {
            ui.label(format!("{end} (mm)"));
            ui.horizontal(|ui| {
                for (axis, value) in ["x", "y", "z"].into_iter().zip(corner) {
                    ui.add(DragValue::new(value).speed(0.1).max_decimals(2))
                        .accessible_name(format!("Support {number} {end} {axis}"));
                }
            });
            ui.end_row();
        }
        ui.label("");
        if ui
            .button("Remove")
            .accessible_name(format!("Remove support {number}"))
            .clicked()
        {
            removed = Some(k);
        }
        ui.end_row();
    }
    if let Some(k) = removed {
        project.supports.remove(k);
    }
    if ui
        .button("Add support")
        .on_hover_text("Everything inside a box is held")
        .clicked()
    {
        // A slice at the lower end: a start that holds something on any part.
        let [low, mut high] = bounds;
        high[2] = low[2] + 0.05 * (high[2] - low[2]);
        project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: Some([low.map(|x| x - 0.01), high.map(|x| x + 0.01)]),
            vertices: None,
            normal: Axis::Z,
        });
    }
    let pressed = ui
        .add_enabled(painted, egui::Button::new("Hold what is painted"))
        .on_hover_text("A support on the painted vertices; the painted region itself is free again")
        .on_disabled_hover_text("Paint a region first (B)")
        .clicked();
    ui.end_row();
    pressed
}

fn kind_name(kind: SupportKind) -> &'static str {
    match kind {
        SupportKind::Clamped => "Clamped",
        SupportKind::Pinned => "Pinned",
        SupportKind::Symmetry => "Symmetry",
    }
}

fn touch(ui: &mut Ui, project: &mut Project) {
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
    number(
        ui,
        "Tip radius",
        &mut touch.tip_radius_mm,
        1e-3..=1e3,
        0.1,
        " mm",
        "The tip spreads the force smoothly over this radius",
    );
    count(
        ui,
        "Touches",
        &mut touch.count,
        3..=100_000,
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
}

fn gauge(ui: &mut Ui, project: &mut Project) {
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
        "Noise",
        &mut gauge.noise_microstrain,
        0.0..=1e5,
        0.1,
        " µε",
        "Standard deviation of a reading, in microstrain",
    );
    number(
        ui,
        "Range",
        &mut gauge.range_microstrain,
        1.0..=1e6,
        100.0,
        " µε",
        "Largest strain that gauge and amplifier can take, in microstrain",
    );
    number(
        ui,
        "Least signal to noise",
        &mut gauge.least_signal_to_noise,
        0.0..=1e6,
        0.1,
        "",
        "Rms strain over noise that a site must reach",
    );
    number(
        ui,
        "Grid length",
        &mut gauge.grid_length_mm,
        0.01..=1e3,
        0.1,
        " mm",
        "Of the measuring grid, along the gauge",
    );
    number(
        ui,
        "Grid width",
        &mut gauge.grid_width_mm,
        0.01..=1e3,
        0.1,
        " mm",
        "Across the gauge",
    );
    number(
        ui,
        "Flatness",
        &mut gauge.flatness_mm,
        0.0..=1e3,
        0.01,
        " mm",
        "Largest height of the surface over the gauge's plane",
    );
}

fn signal_name(signal: Signal) -> &'static str {
    match signal {
        Signal::Displacement => "Displacement",
        Signal::NormalDisplacement => "Normal displacement",
        Signal::Strain => "Strain",
    }
}

fn feasible(ui: &mut Ui, project: &mut Project) {
    number(
        ui,
        "Support clearance",
        &mut project.feasible.support_clearance_mm,
        0.0..=1e4,
        0.1,
        " mm",
        "Least distance over the surface from anything held",
    );
    count(
        ui,
        "Edge neighbours",
        &mut project.feasible.edge_neighbours,
        0..=200,
        "k of the centre-of-mass filter",
    );
    number(
        ui,
        "Edge radius",
        &mut project.feasible.edge_radius_mm,
        0.0..=1e4,
        0.05,
        " mm",
        "How far the centre of mass of the neighbours may lie from a site",
    );
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
}

fn selection(ui: &mut Ui, project: &mut Project) {
    choice(
        ui,
        "Selector",
        &mut project.selection.selector,
        &SelectorKind::ALL,
        SelectorKind::title,
        "Whose sites are shown and reported; all are evaluated",
    );
    count(
        ui,
        "Gauges",
        &mut project.selection.sensors,
        1..=200,
        "How many gauges to place",
    );
    number(
        ui,
        "Least spacing",
        &mut project.selection.spacing_mm,
        0.0..=1e4,
        0.1,
        " mm",
        "Between any two gauges",
    );
    percentage(
        ui,
        "Chance of failure",
        &mut project.selection.failure,
        0.0..=100.0,
        "That one gauge has failed when it is needed: greedy SVR then chooses sites that can do without each other",
    );
    let name = ui.label("With noise");
    ui.checkbox(&mut project.selection.with_noise, "")
        .on_hover_text("Choose from signals with the gauge's noise added")
        .labelled_by(name.id)
        .accessible_name("With noise");
    ui.end_row();
    percentage(
        ui,
        "Unexplained",
        &mut project.candidates.unexplained,
        0.01..=99.0,
        "Share of the held-out variance that the candidates may leave unexplained",
    );
    number(
        ui,
        "C",
        &mut project.selection.c_mm,
        1e-3..=1e9,
        1.0,
        " mm",
        "Of greedy SVR's regression: larger follows the touches more closely",
    );
    number(
        ui,
        "ε",
        &mut project.selection.epsilon_mm,
        0.0..=1e3,
        0.01,
        " mm",
        "Errors below this cost nothing",
    );
    number(
        ui,
        "γ",
        &mut project.selection.gamma,
        1e-9..=1e6,
        0.005,
        "",
        "Of the Gaussian kernel on standardized signals",
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

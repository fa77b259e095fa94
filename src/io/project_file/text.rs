//! A project as the text of its file, with a comment at every key.

use std::fmt::Write as _;

use crate::budget::Limits;
use crate::project::{Kept, Project, SelectionKeys};

/// The commented text of a project.
#[must_use]
pub fn to_text(project: &Project) -> String {
    let mut t = Text::default();
    t.line("# A HapDef project. Lengths in millimetres, forces in newtons; paths are relative to this file.");
    t.key("format", project.format, "version of this file's format");
    part(&mut t, project);
    touch(&mut t, project);
    gauge(&mut t, project);
    feasible(&mut t, project);
    selection(&mut t, project);
    evaluation(&mut t, project);
    live(&mut t, project);
    for selection in &project.kept {
        kept(&mut t, selection);
    }
    t.0
}

fn part(t: &mut Text, project: &Project) {
    t.table("part");
    let part = &project.part;
    t.key(
        "mesh",
        quoted(&part.mesh),
        "glTF/GLB, OBJ, STL, PLY, Gmsh, Abaqus or Ansys",
    );
    t.maybe(
        "unit",
        part.unit.map(|u| quoted(u.name())),
        "unit of the mesh file: \"mm\", \"cm\", \"m\" or \"in\"; glTF is in metres and needs none, Ansys may say its own",
    );
    t.key(
        "body",
        part.body,
        "which connected body, 0 being the largest",
    );
    t.key(
        "weld_mm",
        float(part.weld_mm),
        "vertices nearer than this are joined; 0 joins equal ones only",
    );
    t.key(
        "fill_holes_mm",
        float(part.fill_holes_mm),
        "holes up to this far across are filled",
    );
    t.key(
        "straighten_mm",
        float(part.straighten_mm),
        "a bent edge that turns a tetrahedron inside out is straightened where its node moves no farther",
    );
    t.key(
        "elements",
        serialized(&part.elements),
        "\"graded\": computed on a mesh of its own, finer where the strain changes; \"as-given\": on the file's triangles",
    );
    t.key(
        "model",
        serialized(&part.model),
        "\"shell\": the mesh is the mid-surface; \"solid\": it encloses a part with walls",
    );
    t.key("thickness_mm", float(part.thickness_mm), "of the shell");
    let entries = [
        (
            "inside",
            &part.inside,
            "mask of vertices where gauges can go, in place of what is found by itself (solids)",
        ),
        (
            "outside",
            &part.outside,
            "mask of vertices where touches land, likewise",
        ),
    ];
    for (key, name, comment) in entries {
        if let Some(name) = name {
            t.key(key, quoted(name), comment);
        }
    }
    t.key(
        "axis",
        serialized(&part.axis),
        "which way is up for views, unrolling and new boxes: \"auto\" (by the part's shape), \"x\", \"y\", \"z\" or a direction [x, y, z]",
    );
    t.table("material");
    t.key(
        "youngs_modulus_gpa",
        float(project.material.youngs_modulus_gpa),
        "",
    );
    t.key(
        "poissons_ratio",
        float(project.material.poissons_ratio),
        "above -1 and below 0.5",
    );
    supports(t, project);
}

/// Written where a box does not lie along the file's axes.
fn box_axis(t: &mut Text, axis: Option<&[f64; 3]>) {
    if let Some(axis) = axis {
        t.key(
            "box_axis",
            numbers(axis),
            "the box stands along this direction: its corners are along the front, the right and the up of a part of that axis",
        );
    }
}

fn supports(t: &mut Text, project: &Project) {
    for support in &project.supports {
        t.list("support");
        t.key("kind", serialized(&support.kind), "\"clamped\" (no displacement, no rotation), \"pinned\" (no displacement) or \"symmetry\"");
        t.maybe(
            "box_mm",
            support.box_mm.as_ref().map(corners),
            "every point of the part inside it is held",
        );
        box_axis(t, support.box_axis.as_ref());
        t.maybe(
            "vertices",
            support.vertices.as_deref().map(quoted),
            "instead of a box: a mask in the NPZ file beside this one, or a group of the mesh file",
        );
        t.key(
            "normal",
            serialized(&support.normal),
            "of a symmetry plane; unused otherwise",
        );
    }
}

fn touch(t: &mut Text, project: &Project) {
    t.table("touch");
    t.key(
        "force_n",
        float(project.touch.force_n),
        "pressed along the inward normal",
    );
    t.key(
        "forces_n",
        numbers(&project.touch.forces_n),
        "how hard touches come, the lightest and the hardest: evenly over the logarithm between",
    );
    t.key(
        "tip_radius_mm",
        float(project.touch.tip_radius_mm),
        "the tip spreads the force as (1 - r²/a²)²",
    );
    t.key(
        "tip_tolerance_mm",
        float(project.touch.tip_tolerance_mm),
        "how far off that is (standard deviation): larger tips and smaller ones touch too",
    );
    t.key(
        "friction_percent",
        float(project.touch.friction_percent),
        "how much of the force drags along the surface, beside what presses (rms, any direction)",
    );
    t.key(
        "count",
        project.touch.count,
        "touches simulated; lower qualities take fewer",
    );
    t.key(
        "edge_margin_mm",
        float(project.touch.edge_margin_mm),
        "least distance of a touch from a free edge",
    );
    t.key(
        "reach_mm",
        float(project.touch.reach_mm),
        "radius of the fingertip that comes from outside: touches lie only where it gets to",
    );
    t.maybe(
        "region",
        project.touch.region.as_deref().map(quoted),
        "touches come only here: a mask in the NPZ file beside this one, or a group of the mesh file",
    );
    t.table("sites");
    t.key(
        "spacing_mm",
        float(project.sites.spacing_mm),
        "of the possible gauge positions on the inside",
    );
    t.key(
        "lattice",
        serialized(&project.sites.lattice),
        "\"even\" (any surface) or \"unrolled\" (rows and columns about the axis)",
    );
}

fn feasible(t: &mut Text, project: &Project) {
    t.table("feasible");
    t.key(
        "support_clearance_mm",
        float(project.feasible.support_clearance_mm),
        "least distance over the surface from anything held",
    );
    t.key(
        "edge_neighbours",
        project.feasible.edge_neighbours,
        "k of the centre-of-mass filter …",
    );
    t.key(
        "edge_radius_mm",
        float(project.feasible.edge_radius_mm),
        "… and its radius",
    );
    t.maybe(
        "painted",
        project.feasible.painted.as_deref().map(quoted),
        "painted region, an array in the NPZ file beside this one",
    );
    t.maybe(
        "keep_out",
        project.feasible.keep_out.as_deref().map(quoted),
        "no gauge goes here: a mask in the NPZ file beside this one, or a group of the mesh file",
    );
    t.table("candidates");
    t.key(
        "unexplained",
        float(project.candidates.unexplained),
        "share of the held-out variance the candidates may leave unexplained",
    );
    t.maybe(
        "count",
        project.candidates.count,
        "a fixed number of candidates instead",
    );
}

fn evaluation(t: &mut Text, project: &Project) {
    t.table("evaluation");
    t.key(
        "estimator",
        quoted(project.evaluation.estimator.name()),
        "what finds the touches that sets are judged by: \"matching\" (as live touch; strain only) or \"svr\" (the paper's)",
    );
    t.key(
        "forces_n",
        floats(&project.evaluation.forces_n),
        "how hard these touches are, by matching",
    );
    for region in &project.evaluation.regions {
        t.list("evaluation.region");
        t.key(
            "name",
            quoted(&region.name),
            "errors are quoted for it, beside all touches",
        );
        t.key("box_mm", corners(&region.box_mm), "");
        box_axis(t, region.box_axis.as_ref());
    }
    t.table("budget");
    t.key(
        "quality",
        quoted(project.budget.quality.name()),
        "\"draft\", \"standard\" or \"reference\"",
    );
    t.key("seed", project.budget.seed, "of every random draw");
    limits(t, &project.budget.limits);
}

/// Written where one is given: they are for those who measured what they buy.
fn limits(t: &mut Text, limits: &Limits) {
    if limits.are_none() {
        return;
    }
    t.table("budget.limits");
    t.maybe(
        "elements_percent",
        limits.elements_percent.map(float),
        "estimated error of displacements at which no elements are added",
    );
    t.maybe(
        "vertices",
        limits.vertices,
        "most vertices of the elastic model",
    );
    t.maybe(
        "touches",
        limits.touches,
        "most touches that the model is asked for",
    );
    t.maybe(
        "candidates",
        limits.candidates,
        "most candidates that the reduction keeps",
    );
    t.maybe(
        "expected_places",
        limits.expected_places,
        "most places that a choice by expected error compares readings with",
    );
    t.maybe(
        "expected_presses",
        limits.expected_presses,
        "most presses that it is tried on",
    );
    t.maybe(
        "selection_touches",
        limits.selection_touches,
        "most touches that greedy SVR scores on",
    );
    t.maybe(
        "selection_candidates",
        limits.selection_candidates,
        "most candidates that it scores",
    );
    t.maybe(
        "tuning_touches",
        limits.tuning_touches,
        "most touches that hyper-parameters are searched on",
    );
}

fn gauge(t: &mut Text, project: &Project) {
    let gauge = &project.gauge;
    t.table("gauge");
    t.key(
        "signal",
        quoted(gauge.signal.name()),
        "\"strain\", \"displacement\" or \"normal-displacement\"",
    );
    t.key(
        "directions",
        gauge.directions,
        "a place may take a gauge in: 1 along the largest strain, 2 also across, up to 4",
    );
    t.key(
        "noise_microstrain",
        float(gauge.noise_microstrain),
        "standard deviation of a reading",
    );
    t.key(
        "drift_microstrain",
        float(gauge.drift_microstrain),
        "standard deviation of what all channels drift by together while a touch lasts",
    );
    t.key(
        "range_microstrain",
        float(gauge.range_microstrain),
        "largest strain gauge and amplifier can take",
    );
    t.key(
        "least_signal_to_noise",
        float(gauge.least_signal_to_noise),
        "rms strain over noise that a site must reach",
    );
    t.key(
        "grid_length_mm",
        float(gauge.grid_length_mm),
        "of the measuring grid, along the gauge",
    );
    t.key("grid_width_mm", float(gauge.grid_width_mm), "across it");
    t.key(
        "flatness_mm",
        float(gauge.flatness_mm),
        "largest height of the surface over the gauge's plane",
    );
    t.table("gauge.tolerance");
    t.key(
        "place_mm",
        float(gauge.tolerance.place_mm),
        "how far off gauges are glued, in any direction (standard deviations)",
    );
    t.key(
        "angle_deg",
        float(gauge.tolerance.angle_deg),
        "from their direction",
    );
    t.key(
        "gain_percent",
        float(gauge.tolerance.gain_percent),
        "of the reading",
    );
    let hand = &project.calibration;
    t.table("calibration");
    t.key(
        "place_mm",
        float(hand.place_mm),
        "how far off known presses are made, in any direction (standard deviations)",
    );
    t.key("force_percent", float(hand.force_percent), "of the force");
    t.key(
        "friction_percent",
        float(hand.friction_percent),
        "of the force along the surface, over what presses",
    );
}

fn selection(t: &mut Text, project: &Project) {
    let selection = &project.selection;
    t.table("selection");
    t.key(
        "selector",
        quoted(selection.selector.name()),
        "\"expected-error\" (by matching, as live touch), or the paper's: \"greedy-svr\", \"pca-qr\", \"entropy\", \"mutual-information\"",
    );
    t.key("sensors", selection.sensors, "gauges to place");
    t.key(
        "c_mm",
        float(selection.c_mm),
        "C of greedy SVR's regression (targets in mm, features standardized)",
    );
    t.key("epsilon_mm", float(selection.epsilon_mm), "its ε");
    t.key("gamma", float(selection.gamma), "its γ");
    t.key(
        "spacing_mm",
        float(selection.spacing_mm),
        "least distance between two gauges",
    );
    let required: Vec<String> = selection.required_mm.iter().map(numbers).collect();
    t.maybe(
        "required_mm",
        (!required.is_empty()).then(|| format!("[{}]", required.join(", "))),
        "places of gauges that must be there, [[x, y, z], …]; the nearest site is taken",
    );
    t.maybe(
        "target_mm",
        selection.target_mm.map(float),
        "error at which greedy SVR and expected error add no more gauges",
    );
    t.maybe(
        "cost_budget",
        selection.cost_budget.map(float),
        "what all gauges together may cost: 1 each, or as in [[selection.cost]]",
    );
    t.key(
        "compare",
        selection.compare,
        "whether the other selectors choose too (minutes)",
    );
    t.key(
        "with_noise",
        selection.with_noise,
        "choose from signals with the gauge's noise added",
    );
    t.key(
        "failure",
        float(selection.failure),
        "probability that gauges are lost when they are needed (expected error, greedy SVR)",
    );
    t.key(
        "lost",
        selection.lost,
        "how many together, any of them (greedy SVR: 1)",
    );
    t.key(
        "lost_by",
        quoted(selection.lost_by.name()),
        "\"expected\": the mean over which ones are lost counts, or the \"worst\"",
    );
    beyond_greedy(t, selection);
    let process = &selection.gaussian_process;
    t.table("selection.gaussian_process");
    t.maybe(
        "length_mm",
        process.length_mm.map(float),
        "length of the kernel of entropy and mutual information; searched when left out",
    );
    t.maybe(
        "power",
        process.power.map(float),
        "its power, up to 2; searched when left out",
    );
    t.key(
        "noise",
        float(process.noise),
        "variance of a measurement's noise over the field's",
    );
    for cost in &selection.costs {
        t.list("selection.cost");
        t.key("box_mm", corners(&cost.box_mm), "a gauge in here costs");
        box_axis(t, cost.box_axis.as_ref());
        t.key("cost", float(cost.cost), "");
    }
    for site in &selection.sites {
        t.list("selection.site");
        t.key("position_mm", numbers(&site.position_mm), "");
        t.key("direction", numbers(&site.direction), "");
    }
}

/// How far a choice goes beyond gauge after gauge.
fn beyond_greedy(t: &mut Text, selection: &SelectionKeys) {
    t.key(
        "exchange",
        selection.exchange,
        "exchange gauges after all are chosen (greedy SVR, entropy, mutual information; expected error always does)",
    );
    t.key(
        "starts",
        selection.starts,
        "first gauges that a set is begun from; the best set is kept",
    );
    t.key(
        "refine",
        selection.refine,
        "move the chosen gauges off the sites to where they serve best (expected error on strain)",
    );
}

fn live(t: &mut Text, project: &Project) {
    t.table("live");
    let live = &project.live;
    t.maybe(
        "channels",
        (!live.channels.is_empty()).then(|| format!("{:?}", live.channels)),
        "the board's channel (from 0) of each gauge, [0, 1, …]; in their order when left out",
    );
    t.key(
        "gauge_factor",
        float(live.gauge_factor),
        "change of resistance over strain",
    );
    t.key(
        "active_arms",
        live.active_arms,
        "of each bridge; a gauge with a dummy is 1",
    );
    t.key(
        "model_error",
        float(live.model_error),
        "what the model is off by beside gluing, as a share of the reading, where its elements leave less; a calibration finds it",
    );
    t.key(
        "stiffness_percent",
        float(live.stiffness_percent),
        "how far off the part's stiffness is (standard deviation): forces are off by it, no places",
    );
    t.key(
        "friction_percent",
        float(live.friction_percent),
        "how much of the force may push aside (rms, any direction): found with place and force; 0: touches press straight in",
    );
    t.key(
        "largest_force_n",
        float(live.largest_force_n),
        "nobody presses harder",
    );
    t.key(
        "drift_s",
        float(live.drift_s),
        "seconds in which the rest follows a drift; 0: never",
    );
    for glued in &live.glued {
        t.list("live.glued");
        t.key(
            "gain",
            float(glued.gain),
            "a gauge as known touches found it to be glued",
        );
        t.key("along_mm", float(glued.along_mm), "");
        t.key("across_mm", float(glued.across_mm), "");
        t.key("turned_degrees", float(glued.turned_degrees), "");
        t.maybe(
            "covariance",
            glued.covariance.map(|c| floats(&c)),
            "of these four, what is not known: its upper triangle",
        );
        t.maybe(
            "site",
            glued.site.map(|s| floats(&s)),
            "where its gauge was chosen to be (mm), and its direction: of one elsewhere this says nothing",
        );
    }
}

fn kept(t: &mut Text, kept: &Kept) {
    t.list("kept");
    t.key(
        "name",
        quoted(&kept.name),
        "a selection kept to be compared",
    );
    t.key("selector", quoted(&kept.selector), "");
    t.key("quality", quoted(kept.quality.name()), "");
    t.key("cost", float(kept.cost), "of all its gauges");
    t.key("seconds", float(kept.seconds), "that choosing it took");
    for site in &kept.sites {
        t.list("kept.site");
        t.key("position_mm", numbers(&site.position_mm), "");
        t.key("direction", numbers(&site.direction), "");
    }
    for error in &kept.errors {
        t.list("kept.error");
        t.key("region", quoted(&error.region), "");
        t.key("sensors", error.sensors, "");
        t.key("mean_mm", float(error.mean_mm), "");
        t.key("median_mm", float(error.median_mm), "");
        t.key("p95_mm", float(error.p95_mm), "");
    }
    for failure in &kept.failures {
        t.list("kept.failure");
        t.key("failed", failure.failed, "");
        t.key("retrained", failure.retrained, "");
        t.key("mean_mm", float(failure.mean_mm), "");
    }
}

#[derive(Default)]
struct Text(String);

impl Text {
    fn line(&mut self, line: &str) {
        self.0.push_str(line);
        self.0.push('\n');
    }
    fn table(&mut self, name: &str) {
        self.line(&format!("\n[{name}]"));
    }
    fn list(&mut self, name: &str) {
        self.line(&format!("\n[[{name}]]"));
    }
    fn key(&mut self, key: &str, value: impl std::fmt::Display, comment: &str) {
        let mut line = format!("{key} = {value}");
        if !comment.is_empty() {
            let _ = write!(line, "  # {comment}");
        }
        self.line(&line);
    }
    fn maybe(&mut self, key: &str, value: Option<impl std::fmt::Display>, comment: &str) {
        match value {
            Some(value) => self.key(key, value, comment),
            None => self.line(&format!("# {key}: {comment}")),
        }
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A float with its point, in the shortest form that reads back the same.
fn float(value: f64) -> String {
    format!("{value:?}")
}

fn numbers<const N: usize>(values: &[f64; N]) -> String {
    floats(values)
}

fn floats(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().copied().map(float).collect();
    format!("[{}]", values.join(", "))
}

fn corners(values: &[[f64; 3]; 2]) -> String {
    format!("[{}]", values.each_ref().map(numbers).join(", "))
}

/// An enum as its file name.
fn serialized(value: &impl serde::Serialize) -> String {
    toml::Value::try_from(value).map_or_else(|_| String::new(), |v| v.to_string())
}

//! `report.pdf`.

use super::source::HandoverSource;
use super::{cards, drawing, jig_pages};
use crate::design::curves::failure_ways;
use crate::design::{BLIND, Design};
use crate::io::report::{compared_n, part, settings};
use crate::paper::{Flow, Sheet};

/// How gauges are glued with a rod, rings and pads, as the paper's authors do.
const ASSEMBLY: [&str; 8] = [
    "Print the templates at 100 % and check the bar of 100 mm with a ruler. Cut out the patch of each gauge along its circle.",
    "Clean the inner face with the adhesive's cleaner. Lay each patch into the limb, printed side towards you, so that its blue lines lie on the edges of the wall, what hangs over folded around them, and prick its cross through or mark it with a pencil.",
    "Solder the cables to the gauges, number the plugs as in the table of the wiring, and measure each gauge's resistance.",
    "Put the jig together, if there is one (below). Lay separating film on each pad, wool on it, and tape the gauge on top, its face towards the wall and its line along the pad or the marks.",
    "Mix the adhesive (M-Bond AE-10: 10 : 1.5 by weight), coat wall and gauges thinly.",
    "Bring the pads in, by the jig or by hand, the far gauges first, press them against the wall and tighten them; check each gauge against its marks.",
    "Let it cure as the adhesive's maker says, take the pads out, and measure the resistances again.",
    "Trim each bridge to the middle of the converter's range, connect the board, and press near each gauge: its channel alone must move most.",
];

/// All sheets.
pub(super) fn sheets(source: &HandoverSource<'_>) -> Vec<Sheet> {
    let mut flow = Flow::new(source.format);
    flow.title(&format!("Gauge placement for {}", source.name));
    promise(&mut flow, source);
    drawing::all(&mut flow, source);
    cards::all(&mut flow, source);
    wiring(&mut flow, source);
    flow.heading("Assembly");
    for (k, step) in (1..).zip(ASSEMBLY) {
        flow.point(&format!("{k}."), step);
    }
    jig_pages::all(&mut flow, source);
    flow.heading("The part");
    for line in part::lines(source.inputs, source.design, source.provenance) {
        flow.point("•", &line);
    }
    flow.heading("Settings and what was achieved");
    let rows = settings::rows(source.inputs, source.design, source.provenance);
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(a, b)| vec![a, b]).collect();
    flow.table(&["Setting", "Value"], &rows);
    flow.sheets(&format!(
        "HapDef {} · {}",
        source.provenance.version, source.name
    ))
}

fn promise(flow: &mut Flow, source: &HandoverSource<'_>) {
    let design = source.design;
    let chosen = design.chosen().len();
    let selector = source.inputs.project.selection.selector;
    let by = design
        .chosen_selection()
        .map_or(selector.title(), |s| s.selector.title());
    flow.text(&format!(
        "{chosen} strain gauges, chosen by {by} on {}, to find where a touch of {} N lands.",
        design.simulated.dataset.signal.name(),
        compared_n(source.inputs, design)
    ));
    flow.heading("What is promised");
    by_force(flow, design);
    let regions = design.evaluation.of(design.chosen_id()).map(|r| {
        vec![
            r.region.clone(),
            format!("{:.2}", r.error_mm),
            format!("{:.2}", r.median_mm),
            format!("{:.2}", r.p95_mm),
        ]
    });
    let regions: Vec<Vec<String>> = regions.collect();
    if !regions.is_empty() {
        flow.table(
            &["Region", "Mean error (mm)", "Median (mm)", "95 % (mm)"],
            &regions,
        );
    }
    failures(flow, design);
    let doubts = design.doubts();
    if !doubts.is_empty() {
        flow.text("Numbers here that cannot be trusted:");
        for doubt in doubts {
            flow.point("!", &doubt.words);
        }
    }
    for note in design.words().open {
        flow.point("•", &note);
    }
}

/// What the chosen gauges do at every force.
fn by_force(flow: &mut Flow, design: &Design) {
    let cell = |mm: Option<f64>| mm.map_or("–".into(), |mm| format!("{mm:.2}"));
    let rows: Vec<Vec<String>> = design
        .evaluation
        .by_force(design.chosen_id())
        .map(|r| {
            vec![
                format!("{} N", r.force_n),
                format!("{:.2}", r.error_mm),
                format!("{:.2}", r.median_mm),
                format!("{:.2}", r.p95_mm),
                format!("{:.2}", r.as_built_mm),
                cell(r.calibrated_mm),
                format!("{:.1} %", 100.0 * r.blind),
            ]
        })
        .collect();
    if rows.is_empty() {
        return;
    }
    let names = [
        "Touches of",
        "Mean error (mm)",
        "Median (mm)",
        "95 % (mm)",
        "As built (mm)",
        "Calibrated (mm)",
        "Blind",
    ];
    flow.table(&names, &rows);
    flow.note(&format!(
        "As built: every gauge {}. Calibrated: the same after known presses. Blind: touches that move no gauge by more than {BLIND} times its noise.",
        design.reference.off.gluing.in_words()
    ));
}

/// What lost gauges cost.
fn failures(flow: &mut Flow, design: &Design) {
    let Some(set) = design.evaluation.failures_of(design.chosen_by) else {
        return;
    };
    let retrained = failure_ways(design.evaluation.judging.estimator()).len() > 1;
    let rows: Vec<Vec<String>> = (set.rows.iter())
        .filter(|r| !r.retrained || r.failed == 0)
        .map(|r| {
            vec![
                r.failed.to_string(),
                format!("{:.2}", r.error_mm),
                format!("{:.2}", r.worst_mm),
                format!("{} of {}", r.subsets, r.of),
            ]
        })
        .collect();
    flow.text(&format!(
        "When gauges of the set by {} fail{}:",
        set.set.chooser.title(),
        if retrained {
            ", as trained with all"
        } else {
            " and are left out"
        }
    ));
    flow.table(
        &["Failed gauges", "Mean (mm)", "Worst (mm)", "Subsets judged"],
        &rows,
    );
}

fn wiring(flow: &mut Flow, source: &HandoverSource<'_>) {
    flow.heading("Wiring");
    for words in source.wiring.words() {
        flow.point("•", &words);
    }
    let rows: Vec<Vec<String>> = (source.wiring.channels.iter())
        .map(|c| {
            let range = |[low, high]: [f64; 2]| format!("{low:.0} to {high:+.0}");
            vec![
                c.gauge.to_string(),
                c.pin.clone(),
                c.channel.to_string(),
                range(c.microstrain),
                range(c.counts),
                format!("{:.0}", c.cable * 1e3),
            ]
        })
        .collect();
    let microstrain = format!("Microstrain under {} N", source.wiring.force_n);
    let names = [
        "Gauge",
        "Pin",
        "Channel",
        microstrain.as_str(),
        "Counts",
        "Cable (mm)",
    ];
    flow.table(&names, &rows);
    flow.text("hapd_config.h beside this report goes into the sketch's folder: pins, board number, gain and supply are then those of this table.");
    let bill = source.bill();
    let rows: Vec<Vec<String>> = bill.into_iter().map(Vec::from).collect();
    flow.table(&["To be bought", "Quantity", "About"], &rows);
}

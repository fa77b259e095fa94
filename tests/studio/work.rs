//! Only what is asked: what each kind of change computes, sends and draws, counted.
//!
//! The tally is of the whole process, so this is one test in a process of its own: other tests run beside it.
#![cfg(feature = "studio")]

use crate::window;

use std::process::Command;
use std::time::{Duration, Instant};

use egui_kittest::kittest::Queryable as _;
use hapdef::dataset::Signal;
use hapdef::document::Layer;
use hapdef::placement::SelectorKind;
use hapdef::project::Project;
use hapdef::studio::{Stage, Standing};
use hapdef::tally::{self, Tally};
use window::Window;

/// Changes the project as a control would.
fn change(w: &mut Window, how: impl FnOnce(&mut Project)) {
    let document = &mut w.session_mut().document;
    how(&mut document.state.project);
    document.settle();
}

/// What is done until the design stands again.
fn until_it_stands(w: &mut Window) -> Tally {
    let before = tally::now();
    let start = Instant::now();
    let stands = |w: &Window| {
        let s = w.harness.state();
        !s.busy() && s.standing(Stage::Evaluation) == Standing::Current
    };
    // What settles by itself begins after a moment of rest.
    let mut quiet = 0;
    while quiet < 120 {
        assert!(
            start.elapsed().as_secs() < 300,
            "timed out: {:?}",
            w.session().news.messages
        );
        w.harness.step();
        std::thread::sleep(Duration::from_millis(5));
        quiet = if stands(w) { quiet + 1 } else { 0 };
    }
    tally::now().since(before)
}

/// Matching learns nothing from touches.
fn none_trained(t: Tally) -> bool {
    t.kernel_evaluations + t.fits == 0
}

fn none_computed(t: Tally) -> bool {
    t.factorizations + t.solves == 0 && none_trained(t)
}

/// Set in the process that counts.
const ALONE: &str = "HAPDEF_COUNTS_ALONE";

#[test]
fn a_change_costs_only_what_depends_on_it() {
    if std::env::var_os(ALONE).is_some() {
        return count();
    }
    let own = std::env::current_exe().unwrap();
    let done = Command::new(own)
        .args(["work::a_change_costs_only_what_depends_on_it", "--exact"])
        .arg("--nocapture")
        .env(ALONE, "")
        .output()
        .unwrap();
    let said = [done.stdout, done.stderr].map(|s| String::from_utf8_lossy(&s).into_owned());
    assert!(said[0].contains("1 passed"), "{}\n{}", said[0], said[1]);
}

fn count() {
    let mut w = Window::open();
    change(&mut w, |p| {
        p.touch.count = 200;
        p.selection.sensors = 4;
        p.selection.compare = false;
    });
    // Nothing is computed before anybody asks.
    let before = tally::now();
    w.harness.run_ok();
    assert!(none_computed(tally::now().since(before)));
    w.press("Select gauges");
    let whole = until_it_stands(&mut w);
    // Elements laid, laid anew and halved; twice, for few touches allow finer ones; then the truth, and the design's own
    // elements once more, for what the chosen gauges read of touches anywhere: nobody keeps a factored model while gauges
    // are chosen, for it may be large, and is soon had again.
    assert_eq!(whole.factorizations, 7, "{whole:?}");
    assert!(whole.solves > 200 && none_trained(whole), "{whole:?}");

    // At rest nothing is drawn, and nothing is sent.
    w.harness.render().unwrap();
    let before = tally::now();
    for _ in 0..10 {
        w.harness.step();
        w.harness.render().unwrap();
    }
    let rest = tally::now().since(before);
    assert_eq!(rest, Tally::default(), "at rest");

    // The view: drawn, from what is on the adapter.
    let before = tally::now();
    for view in ["Front", "Right"] {
        w.press(view);
        w.harness.render().unwrap();
    }
    let view = tally::now().since(before);
    assert!(none_computed(view), "the view: {view:?}");
    assert_eq!(view.uploads, 0, "the view: {view:?}");
    assert!((1..=60).contains(&view.redraws), "the view: {view:?}");

    // The painted region: what it leaves is chosen from and judged anew, on the truth and with the model's readings of
    // the new gauges; elements are not laid.
    w.session_mut().document.fill(Layer::Feasible);
    change(&mut w, |p| p.feasible.support_clearance_mm += 1.0);
    let painted = until_it_stands(&mut w);
    // On the truth only where that takes one of the gauges.
    let factored = painted.factorizations;
    assert!((1..=2).contains(&factored), "the region: {painted:?}");
    // Gauges are solved for: on the truth as drawn, as built and as pressed, on the model as drawn and moved six ways;
    // those of sets of one to four, which need not lie within one another.
    assert!(
        (1..200).contains(&painted.solves),
        "the region: {painted:?}"
    );
    assert!(none_trained(painted), "the region: {painted:?}");

    // The number of gauges: the same.
    change(&mut w, |p| p.selection.sensors = 3);
    let number = until_it_stands(&mut w);
    assert!(number.factorizations <= 2, "the number: {number:?}");
    assert!(number.solves < 200, "the number: {number:?}");
    assert!(none_trained(number), "the number: {number:?}");

    // What gauges report: read from the elements that are there. Displacements are judged by regression, on the truth
    // alone: a solve for each touch of both, and one below the cut for each axis of each gauge of the truth, as it is drawn
    // and as each of eight workshops glues it.
    change(&mut w, |p| p.gauge.signal = Signal::Displacement);
    let signal = until_it_stands(&mut w);
    assert_eq!(signal.factorizations, 2, "the signal: {signal:?}");
    let most = {
        let result = w.session().results.design.as_ref().unwrap();
        let design = &result.value.design;
        let (dataset, truth) = (&design.simulated.dataset, &design.reference);
        let gauges = 3 * (1 + 8) * truth.sites.len();
        (dataset.touches.len() + truth.touches.len() + gauges) as u64
    };
    assert!(signal.solves <= most, "the signal: {signal:?}");
    assert!(signal.fits > 0, "the signal: {signal:?}");

    // Back: elements are all there, and matching needs no fits.
    change(&mut w, |p| p.gauge.signal = Signal::Strain);
    let back = until_it_stands(&mut w);
    assert!(back.factorizations <= 3, "back: {back:?}");
    assert!(none_trained(back), "back: {back:?}");

    // The thickness: everything, once; elements may take another round (two more) to be fine enough.
    change(&mut w, |p| p.part.thickness_mm *= 1.1);
    let thickness = until_it_stands(&mut w);
    assert!(
        [7, 9].contains(&thickness.factorizations),
        "the thickness: {thickness:?}"
    );

    // A region that errors are quoted for: nothing but sums.
    change(&mut w, |p| {
        let half = hapdef::project::RegionKeys {
            name: "upper half".into(),
            box_mm: [[-100.0, -100.0, 60.0], [100.0, 100.0, 200.0]],
            box_axis: None,
        };
        p.evaluation.regions.push(half);
    });
    let region = until_it_stands(&mut w);
    assert!(none_computed(region), "a region: {region:?}");

    // Another selector alone: neither model nor truth of what is known.
    change(&mut w, |p| p.selection.selector = SelectorKind::PcaQr);
    let other = until_it_stands(&mut w);
    assert!(other.factorizations <= 2, "the selector: {other:?}");
    assert!(none_trained(other), "the selector: {other:?}");

    // Looking at what is there computes nothing.
    let before = tally::now();
    for tab in ["Failures", "Gauge table", "Reduction", "Error"] {
        w.click_label(tab);
    }
    let tabs = tally::now().since(before);
    assert!(none_computed(tabs), "tabs: {tabs:?}");
    assert!(w.harness.query_by_label("Trade").is_some());
}

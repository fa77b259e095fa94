//! The judge that does what runs live: the design's model matched to what a finer one reads.

use crate::coarse;

use std::sync::{Arc, OnceLock};

use coarse::limb;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::dataset::Signal;
use hapdef::design::{self, Design, Inputs};
use hapdef::evaluation::{Chooser, EVERYWHERE, EstimatorKind, MatchedRow, SetId};
use hapdef::io::artifacts;
use hapdef::placement::SelectorKind;
use hapdef::project::RegionKeys;

const KINDS: [SelectorKind; 1] = [SelectorKind::ExpectedError];
const GAUGES: usize = 6;

/// Four gauges whose noise counts at the lightest force.
fn inputs(estimator: EstimatorKind) -> Inputs {
    let mut inputs = limb();
    let project = &mut inputs.project;
    project.evaluation.estimator = estimator;
    project.selection.selector = KINDS[0];
    project.selection.sensors = GAUGES;
    project.gauge.noise_microstrain = 5.0;
    project.gauge.least_signal_to_noise = 1.0;
    project.evaluation.regions.clear();
    inputs
}

fn budget() -> Budget {
    Budget {
        test_touches: 120,
        failure_subsets: 6,
        ..Quality::Draft.budget()
    }
}

fn run(inputs: &Inputs, threads: usize) -> Design {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        design::run(
            &design::DesignRequest {
                inputs,
                kinds: &KINDS,
                budget: &budget(),
            },
            &|| 0.0,
            &unwatched,
        )
    })
    .unwrap()
}

/// By matching, on two threads.
fn matched() -> &'static Design {
    static DESIGN: OnceLock<Design> = OnceLock::new();
    DESIGN.get_or_init(|| run(&inputs(EstimatorKind::Matching), 2))
}

fn of_so_many(sensors: usize) -> SetId {
    Chooser::from(KINDS[0]).set(sensors)
}

fn by_force(design: &Design) -> Vec<&MatchedRow> {
    let all = design.evaluation.by_force(of_so_many(GAUGES));
    all.collect()
}

#[test]
fn the_largest_set_is_judged_at_all_forces_and_the_others_at_one() {
    let design = matched();
    let rows = by_force(design);
    let forces: Vec<f64> = rows.iter().map(|r| r.force_n).collect();
    assert_eq!(forces, [3.0, 10.0, 25.0]);
    assert!(rows.iter().all(|r| r.touches == 120));
    assert!(rows.iter().all(|r| r.calibrated_mm.is_some()));
    for sensors in 1..GAUGES {
        let mut fewer = design.evaluation.by_force(of_so_many(sensors));
        let only = fewer.next().unwrap();
        assert_eq!((only.force_n, only.calibrated_mm), (10.0, None));
        assert!(fewer.next().is_none());
    }
    // What has no force of its own is of the one in the middle.
    let chosen = design.chosen_row().unwrap();
    assert_eq!(chosen.error_mm, rows[1].error_mm);
    assert_eq!(chosen.workshop_mm, rows[1].as_built_mm);
    assert!(chosen.hyper.is_none() && chosen.converged.is_none());
    let errors = design.touch_errors(KINDS[0], GAUGES).unwrap();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!((mean - chosen.error_mm).abs() < 1e-12);
    assert!(
        design
            .doubts()
            .iter()
            .all(|d| !d.number.contains("regress"))
    );
}

#[test]
fn errors_fall_with_force_and_gluing_costs() {
    let rows = by_force(matched());
    let [light, middle, hard] = [rows[0], rows[1], rows[2]];
    // Once the elements count for more than the noise, a harder press gains little.
    assert!(light.error_mm > middle.error_mm, "{rows:?}");
    assert!(light.error_mm > hard.error_mm, "{rows:?}");
    assert!(light.blind >= middle.blind && middle.blind >= hard.blind);
    assert!(hard.as_built_mm > hard.error_mm, "{hard:?}");
    // Presses by hand are off themselves, and that is known: little may be learned from them, but nothing is lost.
    let sum = |of: &dyn Fn(&MatchedRow) -> f64| rows.iter().map(|r| of(r)).sum::<f64>();
    let calibrated = sum(&|r| r.calibrated_mm.unwrap());
    let as_built = sum(&|r| r.as_built_mm);
    assert!(calibrated < 1.05 * as_built, "{rows:?}");
    for row in &matched().evaluation.matched {
        let figures = [row.error_mm, row.median_mm, row.p95_mm, row.as_built_mm];
        assert!(figures.iter().all(|v| v.is_finite()), "{row:?}");
        assert!((0.0..=1.0).contains(&row.blind), "{row:?}");
    }
}

#[test]
fn the_more_gauges_are_lost_the_worse_it_gets() {
    let design = matched();
    let failures = &design.evaluation.failures;
    assert_eq!(failures.len(), 1);
    let rows = &failures[0].rows;
    let failed: Vec<usize> = rows.iter().map(|r| r.failed).collect();
    assert_eq!(failed, [0, 1, 2, 3, 4, 5]);
    assert!((rows[0].error_mm - design.chosen_row().unwrap().error_mm).abs() < 1e-9);
    for pair in rows.windows(2) {
        assert!(pair[0].error_mm < pair[1].error_mm, "{rows:?}");
    }
    let sound = |r: &hapdef::evaluation::failures::FailureRow| {
        !r.retrained && r.worst_mm.is_finite() && r.worst_mm >= r.error_mm
    };
    assert!(rows.iter().all(sound), "{rows:?}");
}

#[test]
fn the_same_on_one_thread_and_on_two() {
    let two = matched();
    let one = run(&inputs(EstimatorKind::Matching), 1);
    assert_eq!(one.evaluation.matched, two.evaluation.matched);
    assert_eq!(one.evaluation.found, two.evaluation.found);
    assert_eq!(one.evaluation.failures, two.evaluation.failures);
    assert_eq!(one.reference.pressed, two.reference.pressed);
}

#[test]
fn files_say_which_estimator_and_which_force() {
    let (asked, design) = (inputs(EstimatorKind::Matching), matched());
    let summary = artifacts::summary(&asked, design);
    let rows = summary["evaluation"].as_array().unwrap();
    assert_eq!(rows.len(), GAUGES - 1 + 3);
    for row in rows {
        assert_eq!(row["estimator"], "matching");
        assert_eq!(row["region"], EVERYWHERE);
        for key in ["force_n", "error_mm", "median_mm", "p95_mm", "as_built_mm"] {
            assert!(row[key].is_f64(), "{key}: {row}");
        }
    }
    assert!(rows[GAUGES]["calibrated_mm"].is_f64());
    assert_eq!(summary["failures"][0]["rows"].as_array().unwrap().len(), 6);
    let provenance = artifacts::Provenance {
        mesh_path: std::path::Path::new("limb.glb"),
        version: "test",
        taken_in: None,
    };
    let page = hapdef::io::report::html(&asked, design, &provenance);
    for said in [
        "25 N",
        "Calibrated",
        " known presses",
        "Blind",
        "left out",
        "The part",
        "Shell, ",
        "mean error as drawn",
        "gauges as built",
    ] {
        assert!(page.contains(said), "{said}");
    }
    assert!(!page.contains("NaN") && !page.contains("trained anew"));
}

#[test]
fn another_region_is_quoted_from_what_was_found() {
    let mut asked = inputs(EstimatorKind::Matching);
    let first = matched();
    asked.project.evaluation.regions = vec![RegionKeys {
        name: "upper half".into(),
        box_mm: [[-100.0, -100.0, 60.0], [100.0, 100.0, 200.0]],
        box_axis: None,
    }];
    let again = |asked: &Inputs| {
        let hooks = design::Hooks {
            clock: &|| 0.0,
            watch: &unwatched,
            found: &|_, _, _| (),
            entered: &|_| (),
        };
        let known = design::KnownStages {
            reduced: Some((Arc::clone(&first.feasibility), Arc::clone(&first.reduced))),
            selections: Some(Arc::clone(&first.selections)),
            reference: Some(Arc::clone(&first.reference)),
            evaluation: Some(Arc::clone(&first.evaluation)),
        };
        let simulated = Arc::clone(&first.simulated);
        design::run_step_by_step(
            &design::DesignRequest {
                inputs: asked,
                kinds: &KINDS,
                budget: &budget(),
            },
            simulated,
            known,
            &hooks,
        )
        .unwrap()
    };
    let quoted = again(&asked);
    assert_eq!(
        quoted.evaluation.matched.len(),
        2 * first.evaluation.matched.len()
    );
    assert_eq!(quoted.evaluation.found, first.evaluation.found);
    // Other forces are another judgement.
    asked.project.evaluation.forces_n = vec![5.0];
    let other = again(&asked);
    assert!(other.evaluation.matched.iter().all(|r| r.force_n == 5.0));
    assert_eq!(by_force(&other).len(), 1);
}

#[test]
fn a_set_put_by_hand_is_judged_by_the_same_estimator() {
    let (asked, design) = (inputs(EstimatorKind::Matching), matched());
    let mut sites = design.chosen().to_vec();
    let free = (design.reduced.feasible.iter()).find(|s| !sites.contains(s));
    sites[0] = *free.unwrap();
    let judged = design::judge_set(&asked, design, &sites, &unwatched).unwrap();
    assert_eq!(judged.matched.len(), 3);
    let hand = design.with_hand(sites, &judged);
    let rows = by_force(&hand);
    let errors: Vec<f64> = rows.iter().map(|r| r.error_mm).collect();
    let own: Vec<f64> = judged.matched.iter().map(|r| r.error_mm).collect();
    assert_eq!(errors, own);
    assert_eq!(
        hand.evaluation.matched.len(),
        design.evaluation.matched.len()
    );
    assert_eq!(hand.evaluation.failures[0].rows, judged.failures[0].rows);
}

#[test]
fn displacements_are_judged_by_regression_and_it_is_said() {
    let mut asked = inputs(EstimatorKind::Matching);
    asked.project.gauge.signal = Signal::Displacement;
    asked.project.selection.sensors = 2;
    assert_eq!(asked.project.judging().estimator(), EstimatorKind::Svr);
    let budget = Budget {
        touches: 100,
        test_touches: 40,
        failure_subsets: 0,
        ..Quality::Draft.budget()
    };
    let design = design::run(
        &design::DesignRequest {
            inputs: &asked,
            kinds: &KINDS,
            budget: &budget,
        },
        &|| 0.0,
        &unwatched,
    )
    .unwrap();
    assert!(design.evaluation.matched.is_empty() && !design.evaluation.rows.is_empty());
    let notes = design.cautions().join("\n");
    assert!(notes.contains("evaluation.estimator"), "{notes}");
    let summary = artifacts::summary(&asked, &design);
    let row = &summary["evaluation"][0];
    assert_eq!(row["estimator"], "svr");
    assert_eq!(row["force_n"], 10.0);
}

#[test]
fn a_report_shows_the_near_wall_as_near_and_no_limit_as_none() {
    use hapdef::io::report::markers;
    use hapdef::project::PartModel;

    let (mut asked, design) = (inputs(EstimatorKind::Matching), matched());
    let of_shell = markers(&asked, design);
    asked.project.part.model = PartModel::Solid;
    // A solid's gauges are on a face that looks inward; what faces the reader is the other side of that wall.
    for (solid, shell) in markers(&asked, design).iter().zip(of_shell) {
        assert_eq!(solid.gauge.normal, -shell.gauge.normal);
    }
    let written = serde_json::to_value(Quality::Standard.budget()).unwrap();
    assert!(written["candidates"].is_null() && written["touches"].is_null());
    assert!(written["folds"].is_u64());
}

//! Regions that were painted: where touches come, where no gauge goes, what is held.

use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::cli;
use hapdef::design::{self, DesignError, Inputs};
use hapdef::feasible::Filter;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{SupportKeys, SupportKind};

/// A mask of the part's vertices by their places (m).
fn mask(inputs: &Inputs, set: impl Fn(DVec3) -> bool) -> Arc<Vec<bool>> {
    Arc::new(inputs.part.positions().iter().map(|&p| set(p)).collect())
}

fn limb() -> Inputs {
    let mut inputs = cli::bundled().unwrap().inputs;
    inputs.project.budget.quality = Quality::Draft;
    inputs.project.touch.count = 200;
    inputs
}

#[test]
fn touches_come_only_where_they_are_painted_and_gauges_only_where_they_are_not_kept_out() {
    let mut inputs = limb();
    let budget = Quality::Draft.budget();
    let upper = mask(&inputs, |p| p.z > 0.06);
    let side = mask(&inputs, |p| p.y > 0.0);
    inputs.masks.insert("grip".into(), upper);
    inputs.masks.insert("cable".into(), side);
    inputs.project.touch.region = Some("grip".into());
    inputs.project.feasible.keep_out = Some("cable".into());
    let simulated = design::simulate(&inputs, &budget, &unwatched).unwrap();
    let touches = &simulated.dataset.touches;
    assert_eq!(touches.len(), 200);
    // A mask ends between vertices 2.7 mm apart.
    assert!(touches.iter().all(|t| t.position.z > 0.057));
    let feasible = design::filter(&inputs, &simulated);
    let sites = &simulated.dataset.sites;
    assert!(
        feasible
            .sites()
            .iter()
            .all(|&s| sites[s].gauge.position.y < 2e-3)
    );
    let taken = feasible.taken();
    let kept_out = taken.iter().find(|(f, _)| *f == Filter::KeptOut).unwrap().1;
    assert!(kept_out > 500, "{kept_out}");
    // The judge touches the same region.
    let reference = design::reference(
        &inputs,
        &simulated,
        &feasible.sites()[..4],
        &budget,
        &unwatched,
    )
    .unwrap();
    assert!(reference.touches.iter().all(|t| t.position.z > 0.057));
    assert!(reference.touches.len() > 200);
}

#[test]
fn touches_come_more_often_where_that_is_painted() {
    let mut inputs = limb();
    inputs.project.touch.count = 800;
    let budget = Quality::Draft.budget();
    let upper = |p: DVec3| p.z > 0.06;
    inputs.masks.insert("handle".into(), mask(&inputs, upper));
    let share = |inputs: &Inputs| {
        let simulated = design::simulate(inputs, &budget, &unwatched).unwrap();
        let touches = &simulated.dataset.touches;
        assert_eq!(touches.len(), 800);
        // The judge's too, and any stretch of them.
        let judged = design::reference(inputs, &simulated, &[0, 9], &budget, &unwatched).unwrap();
        let above = |touches: &[hapdef::elasticity::Touch]| {
            let above = touches.iter().filter(|t| upper(t.position)).count();
            above as f64 / touches.len() as f64
        };
        // Whoever takes some of them strides over them.
        let of: Vec<_> = touches.iter().copied().step_by(4).collect();
        let judged_of: Vec<_> = judged.touches.iter().copied().step_by(2).collect();
        [
            above(touches),
            above(&of),
            above(&judged.touches),
            above(&judged_of),
        ]
    };
    let [even, _, judged_evenly, _] = share(&inputs);
    inputs.project.touch.often = Some("handle".into());
    inputs.project.touch.often_times = 3.0;
    let wanted = |even: f64| 3.0 * even / (3.0 * even + 1.0 - even);
    let expected = [even, even, judged_evenly, judged_evenly].map(wanted);
    for (share, wanted) in share(&inputs).into_iter().zip(expected) {
        assert!((share - wanted).abs() < 0.07, "{share} {wanted}");
    }
    // Three times as often in a spot of a per cent.
    let spot = |p: DVec3| p.distance(DVec3::new(0.0318, 0.0, 0.06)) < 8e-3;
    inputs.masks.insert("spot".into(), mask(&inputs, spot));
    let within = |inputs: &Inputs| {
        let simulated = design::simulate(inputs, &budget, &unwatched).unwrap();
        (simulated.dataset.touches.iter())
            .filter(|t| spot(t.position))
            .count()
    };
    inputs.project.touch.often = None;
    let evenly = within(&inputs) as f64;
    inputs.project.touch.often = Some("spot".into());
    inputs.project.touch.often_times = 10.0;
    let often = within(&inputs) as f64;
    assert!((5.0..15.0).contains(&(often / evenly)), "{evenly} {often}");
    // Nobody touches what is painted there.
    inputs
        .masks
        .insert("nothing".into(), mask(&inputs, |_| false));
    inputs.project.touch.often = Some("nothing".into());
    let error = design::simulate(&inputs, &budget, &unwatched).err();
    assert!(matches!(error, Some(DesignError::Value(bad)) if bad.key == "touch.often"));
    inputs.project.touch.often = Some("nowhere".into());
    let error = design::simulate(&inputs, &budget, &unwatched).err();
    assert!(matches!(error, Some(DesignError::Value(bad)) if bad.key == "touch.often"));
}

#[test]
fn a_painted_support_holds_like_the_box_it_covers() {
    let budget = Quality::Draft.budget();
    let boxed = limb();
    let mut painted = limb();
    painted.project.supports.clear();
    for (k, support) in boxed.project.supports.iter().enumerate() {
        let [a, b] = support
            .box_mm
            .unwrap()
            .map(|c| DVec3::from_array(c) / 1000.0);
        let (lower, upper) = (a.min(b) - 1e-9, a.max(b) + 1e-9);
        let name = format!("support-{k}");
        let held = mask(&painted, |p| p.cmpge(lower).all() && p.cmple(upper).all());
        assert!(held.contains(&true));
        painted.masks.insert(name.clone(), held);
        painted.project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: None,
            box_axis: None,
            vertices: Some(name),
            normal: Axis::Z,
            bedding_n_per_mm3: None,
        });
    }
    let stiffness = |inputs: &Inputs| {
        let simulated = design::simulate(inputs, &budget, &unwatched).unwrap();
        let rms: Vec<f64> = simulated
            .dataset
            .sites
            .iter()
            .map(|s| s.rms_strain)
            .collect();
        rms.iter().sum::<f64>() / rms.len() as f64
    };
    let (a, b) = (stiffness(&boxed), stiffness(&painted));
    // The mask ends at the last vertices inside: it holds a little less.
    assert!((b / a - 1.0).abs() < 0.06, "{a} {b}");
}

#[test]
fn a_single_spot_takes_all_touches_without_a_long_search() {
    let mut inputs = limb();
    inputs.project.touch.count = 4000;
    // About half a percent of the part.
    let spot = mask(&inputs, |p| {
        p.distance(DVec3::new(0.0318, 0.0, 0.06)) < 6e-3
    });
    inputs.masks.insert("spot".into(), spot);
    inputs.project.touch.region = Some("spot".into());
    let budget = Quality::Draft.budget();
    let simulated = design::simulate(&inputs, &budget, &unwatched).unwrap();
    let touches = &simulated.dataset.touches;
    assert_eq!(touches.len(), 800);
    let centre = DVec3::new(0.0318, 0.0, 0.06);
    assert!(touches.iter().all(|t| t.position.distance(centre) < 9e-3));
}

#[test]
fn a_region_that_is_not_there_is_named() {
    let mut inputs = limb();
    inputs.project.touch.region = Some("grip".into());
    let error = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched).err();
    let Some(DesignError::Value(bad)) = error else {
        panic!("it cannot be simulated")
    };
    assert_eq!(bad.key, "touch.region");
    assert!(bad.to_string().contains("grip"), "{bad}");
    inputs.project.feasible.keep_out = inputs.project.touch.region.replace("touch".into());
    inputs.masks.insert("touch".into(), mask(&inputs, |_| true));
    let error = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched).err();
    assert!(matches!(error, Some(DesignError::Value(bad)) if bad.key == "feasible.keep_out"));
    inputs.project.feasible.keep_out = None;
    inputs.project.touch.region = Some("grip".into());
    // And one without a vertex leaves no touch.
    let none = mask(&inputs, |_| false);
    inputs.masks.insert("grip".into(), none);
    let error = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched).err();
    assert!(matches!(error, Some(DesignError::NoTouches { .. })));
}

#[test]
fn other_regions_are_quoted_from_the_same_errors() {
    use hapdef::design::{Hooks, KnownStages};
    use hapdef::placement::SelectorKind;
    use hapdef::project::RegionKeys;
    let mut inputs = limb();
    inputs.project.selection.sensors = 3;
    let budget = Quality::Draft.budget();
    let kinds = [SelectorKind::PcaQr];
    inputs.project.selection.selector = SelectorKind::PcaQr;
    let hooks = Hooks {
        clock: &|| 0.0,
        watch: &unwatched,
        found: &|_, _, _| (),
        entered: &|_| (),
    };
    let simulated = Arc::new(design::simulate(&inputs, &budget, &unwatched).unwrap());
    let run = |inputs: &Inputs, known: KnownStages| {
        let simulated = Arc::clone(&simulated);
        design::run_step_by_step(
            &design::DesignRequest {
                inputs,
                kinds: &kinds,
                budget: &budget,
            },
            simulated,
            known,
            &hooks,
        )
        .unwrap()
    };
    let first = run(&inputs, KnownStages::default());
    inputs.project.evaluation.regions = vec![RegionKeys {
        name: "upper half".into(),
        box_mm: [[-100.0, -100.0, 60.0], [100.0, 100.0, 200.0]],
        box_axis: None,
    }];
    let known = KnownStages {
        reduced: Some((Arc::clone(&first.feasibility), Arc::clone(&first.reduced))),
        selections: Some(Arc::clone(&first.selections)),
        reference: Some(Arc::clone(&first.reference)),
        evaluation: Some(Arc::clone(&first.evaluation)),
    };
    let (quoted, anew) = (run(&inputs, known), run(&inputs, KnownStages::default()));
    assert_eq!(quoted.evaluation.rows, anew.evaluation.rows);
    assert!(
        quoted
            .evaluation
            .rows
            .iter()
            .any(|r| r.region == "upper half")
    );
    assert_eq!(quoted.evaluation.sets, anew.evaluation.sets);
}

#[test]
fn gauges_put_by_hand_are_what_the_report_shows() {
    use hapdef::evaluation::Chooser;
    use hapdef::io::artifacts;
    use hapdef::placement::SelectorKind;
    let mut inputs = limb();
    inputs.project.selection.sensors = 3;
    inputs.project.selection.selector = SelectorKind::PcaQr;
    let budget = Quality::Draft.budget();
    let kinds = [SelectorKind::PcaQr, SelectorKind::Entropy];
    let design = design::run(
        &design::DesignRequest {
            inputs: &inputs,
            kinds: &kinds,
            budget: &budget,
        },
        &|| 0.0,
        &unwatched,
    )
    .unwrap();
    let row = |design: &design::Design, sensors: usize| {
        let set = Chooser::from(SelectorKind::PcaQr).set(sensors);
        design.evaluation.over_all(set).map(|r| r.error_mm)
    };
    // One moved; one more; and one less, in the place of the selector's own set of as many.
    let free: Vec<usize> = (design.reduced.feasible.iter().copied())
        .filter(|s| !design.chosen().contains(s))
        .collect();
    for count in [3, 4, 2] {
        let mut sites = design.chosen().to_vec();
        sites[1] = free[free.len() / 2];
        sites.extend(&free[..count.max(3) - 3]);
        sites.truncate(count);
        let judged = design::judge_set(&inputs, &design, &sites, &unwatched).unwrap();
        let hand = design.with_hand(sites.clone(), &judged);
        assert_eq!(hand.chosen(), sites);
        assert_eq!(row(&hand, sites.len()), Some(judged.rows[0].error_mm));
        assert_eq!(row(&hand, 1), row(&design, 1));
        let sizes: Vec<usize> = (hand.chosen_selection().unwrap().sets.iter())
            .map(|set| set.sites.len())
            .collect();
        assert!(
            sizes.is_sorted() && sizes.last() == Some(&count),
            "{sizes:?}"
        );
        let own = Chooser::from(SelectorKind::PcaQr);
        let judged_sizes: Vec<usize> = (hand.evaluation.sets.iter())
            .filter(|set| set.set.chooser == own)
            .map(|set| set.set.sensors)
            .collect();
        assert_eq!(judged_sizes, sizes);
        let of_regions = judged.rows.len();
        assert_eq!(hand.evaluation.of(own.set(count)).count(), of_regions);
        let table = artifacts::sites_csv(&inputs, &hand);
        assert_eq!(table.lines().count(), 1 + sites.len());
        assert!(table.contains(&format!(",{},2,", sites[1])), "{table}");
        assert!(hand.cautions().iter().any(|n| n.contains("by hand")));
        assert!(design.cautions().iter().all(|n| !n.contains("by hand")));
        let summary = artifacts::summary(&inputs, &hand);
        assert_eq!(summary["sites"].as_array().unwrap().len(), sites.len());
        // What the selector said of its own choice is not said of this one.
        let sets = summary["selections"][0]["sets"].as_array().unwrap();
        let set = sets.last().unwrap();
        assert_eq!(set["sites"], serde_json::json!(sites));
        for figure in ["criterion", "criterion_mm", "gap", "lead", "bound_mm"] {
            assert!(set[figure].is_null(), "{figure}: {set}");
        }
        assert_eq!(summary["by_hand"], true);
        let own = artifacts::summary(&inputs, &design);
        assert_eq!(own["by_hand"], false);
        assert!(own["selections"][0]["sets"][2]["criterion"].is_f64());
        assert_ne!(summary["run"], own["run"], "other gauges are another run");
        assert!(hand.error_map(&hand.simulated.mesh).is_some());
        let folder = tempfile::tempdir().unwrap();
        let provenance = artifacts::Provenance {
            mesh_path: std::path::Path::new("limb.glb"),
            version: "test",
            taken_in: None,
        };
        artifacts::write_all(folder.path(), &inputs, &hand, &provenance).unwrap();
        let report = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert!(report.contains("moved by hand"));
    }
}

/// Touches on a support tell nobody anything, and that is said.
#[test]
fn touches_on_a_wide_support_are_named() {
    let mut inputs = limb();
    let budget = Quality::Draft.budget();
    let says = |inputs: &Inputs| {
        let simulated = design::simulate(inputs, &budget, &unwatched).unwrap();
        let mut words = simulated.achieved.words();
        words.any(|w| w.contains("press on what a support holds"))
    };
    assert!(!says(&inputs), "its bosses are small");
    let lower_third = mask(&inputs, |p| p.z < 0.04);
    inputs.masks.insert("flange".into(), lower_third);
    inputs.project.supports.truncate(1);
    inputs.project.supports[0].box_mm = None;
    inputs.project.supports[0].vertices = Some("flange".into());
    assert!(says(&inputs));
    // Pressed elsewhere only, there is nothing to say.
    let upper = mask(&inputs, |p| p.z > 0.06);
    inputs.masks.insert("grip".into(), upper);
    inputs.project.touch.region = Some("grip".into());
    assert!(!says(&inputs));
}

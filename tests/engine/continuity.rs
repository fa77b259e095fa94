//! Next to no change of the input makes next to no change of the result, and what may fall either way is called a
//! tie.

use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::design::{self, Inputs, Simulated};
use hapdef::mesh::TriMesh;
use hapdef::placement::{Selection, SelectorKind, greedy_svr, margin};
use hapdef::project::ElementKind;

const CHANGE: f64 = 1e-6;

fn budget() -> Budget {
    Budget {
        touches: 300,
        candidates: 60,
        locations: 300,
        selection_touches: 150,
        selection_candidates: 30,
        svr_tolerance_mm: 1e-4,
        svr_steps: 10_000_000,
        ..Quality::Draft.budget()
    }
}

fn limb() -> Inputs {
    let mut inputs = hapdef::cli::bundled().unwrap().inputs;
    inputs.project.selection.sensors = 6;
    inputs
}

/// Every vertex moved by up to a millionth of its distance from the origin.
fn nudged(mesh: &TriMesh) -> TriMesh {
    let moved = |(k, p): (usize, &DVec3)| {
        let turn = k as f64;
        let by = DVec3::new(
            (12.9 * turn).sin(),
            (78.2 * turn).sin(),
            (37.7 * turn).sin(),
        );
        *p + by * (CHANGE * p.length() / 3f64.sqrt())
    };
    let positions: Vec<DVec3> = mesh.positions().iter().enumerate().map(moved).collect();
    TriMesh::new(&positions, mesh.triangles(), 0).unwrap().0
}

fn selected(inputs: &Inputs) -> (Simulated, Vec<Selection>) {
    let budget = budget();
    let simulated = design::simulate(inputs, &budget, &unwatched).unwrap();
    let feasibility = design::filter(inputs, &simulated);
    let reduced = design::reduce_sites(inputs, &simulated, &feasibility, &budget).unwrap();
    let select = |kind| {
        design::Choosing {
            inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget: &budget,
            watch: &unwatched,
        }
        .select(kind)
        .unwrap()
    };
    // Expected error is judged on a sample of presses, whose own scatter is more than elements leave open.
    let selections = SelectorKind::PAPER.map(select).to_vec();
    (simulated, selections)
}

/// What a selector's criterion is good to.
fn tolerance(kind: SelectorKind) -> f64 {
    match kind {
        SelectorKind::GreedySvr => greedy_svr::TOLERANCE,
        _ => margin::TOLERANCE,
    }
}

/// Largest change of a signal, over the largest signal.
fn moved(a: &Simulated, b: &Simulated) -> f64 {
    let (x, y) = (a.dataset.x.values(), b.dataset.x.values());
    assert_eq!(x.len(), y.len());
    let largest = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let apart = x
        .iter()
        .zip(y)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    apart / largest
}

/// Sets agree until the first tie, which is said; how many picks were compared. `open` is what elements leave open.
fn agree(what: &str, open: f64, before: &[Selection], after: &[Selection]) -> usize {
    let mut compared = 0;
    for (a, b) in before.iter().zip(after) {
        let name = a.selector.title();
        let own = tolerance(a.selector);
        let says = |start: &str| a.achieved.notes.iter().any(|n| n.starts_with(start));
        for (x, y) in a.sets.iter().zip(&b.sets) {
            let within = |tolerance: f64| x.margin.is_some_and(|margin| margin <= 2.0 * tolerance);
            if within(own) || (open > 0.0 && within(open)) {
                assert!(
                    !within(own) || says("Ties with"),
                    "{what}: a tie of {name} is not said"
                );
                assert!(
                    open == 0.0 || !within(open) || says("The elements leave"),
                    "{what}: {name}"
                );
                // Later picks depend on this one, but where each set is chosen for itself.
                if a.selector == SelectorKind::PcaQr {
                    continue;
                }
                break;
            }
            assert_eq!(x.sites, y.sites, "{what}: {name}, lead {:?}", x.margin);
            compared += 1;
        }
    }
    compared
}

fn cases(base: &Inputs) -> Vec<(&'static str, Inputs)> {
    let change = |how: fn(&mut Inputs)| {
        let mut inputs = base.clone();
        how(&mut inputs);
        inputs
    };
    vec![
        ("force", change(|i| i.project.touch.force_n *= 1.0 + CHANGE)),
        (
            "stiffness",
            change(|i| i.project.material.youngs_modulus_gpa *= 1.0 + CHANGE),
        ),
        (
            "Poisson's ratio",
            change(|i| i.project.material.poissons_ratio *= 1.0 + CHANGE),
        ),
        (
            "thickness",
            change(|i| i.project.part.thickness_mm *= 1.0 + CHANGE),
        ),
        ("vertices", change(|i| i.part = Arc::new(nudged(&i.part)))),
    ]
}

/// On the part's own triangles everything moves as little as the input.
#[test]
fn a_millionth_changes_no_pick_that_leads() {
    let mut base = limb();
    base.project.part.elements = ElementKind::AsGiven;
    let (simulated, selections) = selected(&base);
    assert_eq!(design::model_tolerance(&base, &simulated), 0.0);
    for (what, inputs) in cases(&base) {
        let (again, others) = selected(&inputs);
        let apart = moved(&simulated, &again);
        assert!(apart < 1e-3, "{what}: signals moved by {apart:.1e}");
        let compared = agree(what, 0.0, &selections, &others);
        assert!(compared >= 8, "{what}: only {compared} picks lead");
        eprintln!("{what}: signals moved by {apart:.1e}, {compared} picks the same");
    }
    // The limb is its own mirror image: what is chosen by its shape alone has real ties.
    let by_shape = selections
        .iter()
        .find(|s| s.selector == SelectorKind::Entropy)
        .unwrap();
    assert!(by_shape.sets.iter().any(|s| s.margin == Some(0.0)));
    assert!(
        by_shape
            .achieved
            .notes
            .iter()
            .any(|n| n.starts_with("Ties with"))
    );
}

/// Elements that are laid for the part may be laid otherwise for another by a hair: what that can change is said.
#[test]
fn elements_laid_anew_change_no_pick_that_leads_by_more_than_they_leave_open() {
    let base = limb();
    let (simulated, selections) = selected(&base);
    let open = design::model_tolerance(&base, &simulated);
    assert!(open > 0.0 && open < 0.2, "{open}");
    for (what, inputs) in cases(&base) {
        let (again, others) = selected(&inputs);
        let apart = moved(&simulated, &again);
        // Only vertices decide where elements are laid.
        let open = if what == "vertices" { open } else { 0.0 };
        let compared = agree(what, open, &selections, &others);
        assert!(
            open > 0.0 || compared >= 8,
            "{what}: only {compared} picks lead"
        );
        eprintln!("{what}: signals moved by {apart:.1e}, {compared} picks the same");
    }
}

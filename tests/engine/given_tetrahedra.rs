//! What is foreseen of a part with tetrahedra of its own, against what the pipeline then does with them.

use crate::bench;

use bench::hexes::Bricks;
use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::design::{self, Inputs};
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, PartModel, Project, SupportKeys, SupportKind, Unit};

/// A channel 60 × 20 × 20 mm with walls of 0.8 mm, one tetrahedron of 8 mm thick.
fn thin() -> Inputs {
    let bricks = Bricks {
        axes: [
            vec![0.0, 0.0008, 0.0192, 0.02],
            vec![0.0, 0.0008, 0.02],
            vec![0.0, 0.004, 0.06],
        ],
        keep: |p| p.y < 0.0008 || p.x < 0.0008 || p.x > 0.0192,
        place: |p| p,
    };
    let mut project = Project::around("channel.inp", Some(Unit::Metre));
    project.part.model = PartModel::Solid;
    project.touch.count = 60;
    project.sites.spacing_mm = 4.0;
    Inputs {
        project,
        part: bricks.filled(DVec3::splat(8e-3)),
        painted: None,
        masks: Masks::new(),
    }
}

fn clamped() -> Inputs {
    let mut inputs = thin();
    inputs.project.supports.push(SupportKeys {
        kind: SupportKind::Clamped,
        box_mm: Some([[-1.0, -1.0, -1.0], [21.0, 21.0, 4.0]]),
        box_axis: None,
        vertices: None,
        normal: Axis::Z,
        bedding_n_per_mm3: None,
    });
    inputs
}

#[test]
fn advice_is_of_the_tetrahedra_that_are_used() {
    let inputs = clamped();
    let advice = design::advise(&inputs, &unwatched).unwrap();
    let cost = advice.costs[1];
    println!("{:?}", advice.words);
    assert_eq!(advice.fits, PartModel::Solid);
    assert!(cost.order.is_some_and(|order| order > 2));
    assert!(advice.words[1].contains("the file's tetrahedra"));
    let simulated = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched).unwrap();
    let standard = Quality::Standard.budget();
    let simulated_well = design::simulate(&inputs, &standard, &unwatched).unwrap();
    let found = simulated_well.discretization;
    println!(
        "{} unknowns, {:.2} %; at draft {:.2} %",
        simulated_well.unknowns,
        found.displacement_percent,
        simulated.discretization.displacement_percent
    );
    let unknowns = cost.unknowns / simulated_well.unknowns as f64;
    assert!((0.5..2.0).contains(&unknowns), "{unknowns}");
    // Errors below this (%) are as good as none.
    let small = |percent: f64| percent.max(1.0);
    let error = small(cost.error_percent) / small(found.displacement_percent);
    assert!((0.5..2.0).contains(&error), "{error}");
    // Whatever the effort, the error is judged.
    let draft = simulated.discretization;
    assert!(draft.displacement_percent.is_finite() && draft.strain_percent.is_finite());
}

#[test]
fn what_nothing_holds_yet_is_priced_and_says_why_it_has_no_error() {
    let advice = design::advise(&thin(), &unwatched).unwrap();
    let cost = advice.costs[1];
    assert!(cost.error_percent.is_nan() && cost.unknowns > 1000.0 && cost.seconds > 0.0);
    let last = advice.words.last().unwrap();
    assert!(last.contains("could not be computed yet"), "{last}");
}

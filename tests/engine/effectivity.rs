//! What the program says of its own error on solids, against the error it has: an independent solution of
//! tetrahedra on the very same parts.

use crate::bench;

use bench::hexes::{Bricks, ends};
use bench::solids::clamp;
use glam::DVec3;
use hapdef::budget::{ElementBudget, Quality, unwatched};
use hapdef::elasticity::estimate::{self, AccuracyTarget, ModelSample};
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::respond::{self, Quantity, gives_way, respond_from};
use hapdef::elasticity::solid::ground::{SolidGraded, SolidGround};
use hapdef::elasticity::{Material, Model, Support, Touch};
use hapdef::mesh::walls::WallSide;

const MATERIAL: Material = Material {
    youngs_modulus: 1.7e9,
    poissons_ratio: 0.35,
};

/// A part with what tetrahedra say of it.
struct Case {
    name: &'static str,
    bricks: Bricks,
    support: Support,
    touches: Vec<Touch>,
    places: Vec<DVec3>,
    /// Sides of the bricks that the tetrahedra of the truth are made of (m; of the tube m, sixteenths of the round
    /// and m), and the displacement under each touch that they gave (m): `truths_are_what_tetrahedra_say` makes
    /// them again.
    sides: DVec3,
    truth: Vec<f64>,
}

fn touch(position: [f64; 3], normal: [f64; 3], tip_mm: f64) -> Touch {
    Touch {
        position: DVec3::from_array(position) * 1e-3,
        normal: DVec3::from_array(normal).normalize(),
        force: 10.0,
        tip_radius: tip_mm * 1e-3,
    }
}

fn mm(points: &[[f64; 3]]) -> Vec<DVec3> {
    points
        .iter()
        .map(|&p| DVec3::from_array(p) * 1e-3)
        .collect()
}

fn cube() -> Case {
    Case {
        name: "cube 20 mm",
        bricks: Bricks {
            axes: [ends(0.0, 0.02), ends(0.0, 0.02), vec![0.0, 0.002, 0.02]],
            keep: |_| true,
            place: |p| p,
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.002)),
        touches: vec![
            touch([10.0, 10.0, 20.0], [0.0, 0.0, 1.0], 3.0),
            touch([20.0, 10.0, 12.0], [1.0, 0.0, 0.0], 3.0),
            touch([5.0, 0.0, 16.0], [0.0, -1.0, 0.0], 3.0),
        ],
        places: mm(&[
            [0.0, 10.0, 10.0],
            [10.0, 20.0, 10.0],
            [20.0, 10.0, 5.0],
            [10.0, 0.0, 5.0],
        ]),
        // Bricks of 1.6, 1.15 and 0.9 mm give 1.2482, 1.2604 and 1.2650 µm under the first touch: carried on to none.
        sides: DVec3::splat(0.9e-3),
        truth: vec![1.2723e-6, 1.6406e-6, 2.3863e-6],
    }
}

/// A channel 80 × 30 × 30 mm with walls of 3 mm.
fn channel() -> Case {
    Case {
        name: "channel",
        bricks: Bricks {
            axes: [
                vec![0.0, 0.003, 0.027, 0.03],
                vec![0.0, 0.003, 0.03],
                vec![0.0, 0.004, 0.08],
            ],
            keep: |p| p.y < 0.003 || p.x < 0.003 || p.x > 0.027,
            place: |p| p,
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.004)),
        touches: vec![
            touch([0.0, 20.0, 60.0], [-1.0, 0.0, 0.0], 4.0),
            touch([15.0, 0.0, 40.0], [0.0, -1.0, 0.0], 4.0),
            touch([30.0, 10.0, 20.0], [1.0, 0.0, 0.0], 4.0),
            touch([15.0, 0.0, 70.0], [0.0, -1.0, 0.0], 4.0),
        ],
        places: mm(&[
            [3.0, 15.0, 30.0],
            [15.0, 3.0, 30.0],
            [27.0, 15.0, 50.0],
            [15.0, 3.0, 12.0],
        ]),
        sides: DVec3::new(0.75, 0.75, 1.6) * 1e-3,
        truth: vec![
            2.9237006338985e-4,
            2.8353134496771716e-5,
            1.8048867356054595e-5,
            6.152436455237203e-5,
        ],
    }
}

/// A thick tube of 16 flat sides.
fn tube() -> Case {
    let round: Vec<f64> = (0..=16).map(f64::from).collect();
    Case {
        name: "thick tube",
        bricks: Bricks {
            axes: [vec![0.012, 0.020], round, vec![0.0, 0.005, 0.06]],
            keep: |_| true,
            place: |c| {
                let angle = c.y / 16.0 * std::f64::consts::TAU;
                DVec3::new(c.x * angle.cos(), c.x * angle.sin(), c.z)
            },
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.005)),
        touches: vec![
            touch([19.6, 3.9, 40.0], [0.98, 0.195, 0.0], 4.0),
            touch([-19.6, 3.9, 25.0], [-0.98, 0.195, 0.0], 4.0),
            touch([3.9, 19.6, 55.0], [0.195, 0.98, 0.0], 4.0),
        ],
        places: mm(&[
            [12.0, 0.0, 30.0],
            [0.0, 12.0, 20.0],
            [-12.0, 0.0, 40.0],
            [0.0, -12.0, 12.0],
        ]),
        // Bricks of 1.4 times the size give 0.4 % less: carried on to none.
        sides: DVec3::new(0.0015, 0.34, 0.0016),
        truth: vec![3.517e-6, 2.204e-6, 6.435e-6],
    }
}

/// An L of 12 mm, thick beside the span.
fn bracket() -> Case {
    Case {
        name: "bracket",
        bricks: Bricks {
            axes: [
                vec![0.0, 0.012, 0.05],
                ends(0.0, 0.02),
                vec![0.0, 0.005, 0.038, 0.05],
            ],
            keep: |p| p.x < 0.012 || p.z > 0.038,
            place: |p| p,
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.005)),
        touches: vec![
            touch([40.0, 10.0, 50.0], [0.0, 0.0, 1.0], 4.0),
            touch([0.0, 10.0, 25.0], [-1.0, 0.0, 0.0], 4.0),
            touch([20.0, 10.0, 50.0], [0.0, 0.0, 1.0], 4.0),
        ],
        places: mm(&[
            [12.0, 10.0, 20.0],
            [25.0, 10.0, 38.0],
            [12.0, 10.0, 30.0],
            [40.0, 10.0, 38.0],
        ]),
        sides: DVec3::splat(1.35e-3),
        truth: vec![
            1.1064420055068781e-4,
            7.256012392191728e-6,
            1.7357245800047837e-5,
        ],
    }
}

/// Displacement under each touch (m).
fn under(model: &dyn Model, touches: &[Touch]) -> Vec<f64> {
    gives_way(model, touches)
}

/// Rms of what some displacements are off by (%).
fn off(found: &[f64], right: &[f64]) -> f64 {
    let squares = found.iter().zip(right).map(|(f, r)| (f / r - 1.0).powi(2));
    100.0 * (squares.sum::<f64>() / right.len() as f64).sqrt()
}

/// Error over estimate is within a factor of two; errors below this (%) are the tetrahedra's own.
const OWN: f64 = 0.5;

fn honest(what: &str, error: f64, said: f64) {
    assert!(
        said < 2.0 * error.max(OWN) && said > 0.5 * (error - OWN),
        "{what}: off by {error:.2} %, and {said:.2} % were said"
    );
}

#[test]
fn estimates_of_solids_are_of_the_size_of_the_error() {
    for case in [cube(), channel(), tube(), bracket()] {
        let part = case.bricks.surface();
        let supports = std::slice::from_ref(&case.support);
        let told = |_: DVec3| None::<WallSide>;
        let ground = SolidGround::new(&part, MATERIAL, supports, &told, &unwatched).unwrap();
        for quality in [Quality::Draft, Quality::Standard] {
            let aim = quality.budget().elements;
            if case.name == "thick tube" && quality == Quality::Standard {
                continue; // twenty seconds, for an error below that of its tetrahedra
            }
            let target = AccuracyTarget::new(&case.touches, &case.places, &aim);
            let graded = ground.grade(&target, &unwatched).unwrap();
            let error = off(&under(&graded.model, &case.touches), &case.truth);
            let said = graded.estimate.displacement_percent;
            println!(
                "{}, {}: cells {:.2} mm, {} unknowns, {} grids: off {error:.2} %, said {said:.2} %",
                case.name,
                quality.name(),
                graded.fineness.size * 1e3,
                graded.model.system().dimension(),
                graded.models,
            );
            assert!(error < 1.5 * aim.displacement_percent, "{}", case.name);
            honest(case.name, error, said);
            are_foreseen(&case, &ground, &aim, &graded);
        }
    }
}

/// What cells come to is told from the first of them: how large they are, what they take and how far off they are.
fn are_foreseen(case: &Case, ground: &SolidGround, aim: &ElementBudget, graded: &SolidGraded) {
    let target = AccuracyTarget::new(&case.touches, &case.places, aim);
    let foreseen = ground.foresee(&target, &unwatched);
    let foreseen = foreseen.unwrap();
    let system = graded.model.system();
    let close = |percent: f64| percent.max(OWN);
    let ratios = [
        ("size", foreseen.size / graded.fineness.size),
        ("unknowns", foreseen.unknowns / system.dimension() as f64),
        ("memory", foreseen.bytes / system.bytes()),
        (
            "error",
            close(foreseen.estimate.displacement_percent)
                / close(graded.estimate.displacement_percent),
        ),
    ];
    println!("foreseen: {ratios:.2?} of what they are");
    for (what, ratio) in ratios {
        assert!((0.5..2.0).contains(&ratio), "{}: {what} {ratio}", case.name);
    }
}

/// The figures of the cases from tetrahedra: all of them take gigabytes and minutes, so that here only one is
/// computed, on coarser ones.
#[test]
fn truths_are_what_tetrahedra_say() {
    let all = std::env::var_os("HAPDEF_TRUTHS").is_some();
    for case in [cube(), channel(), tube(), bracket()] {
        let sides = if all { case.sides } else { 1.7 * case.sides };
        if !all && case.name != "bracket" {
            continue;
        }
        let supports = std::slice::from_ref(&case.support);
        let found = under(&case.bricks.model(sides, MATERIAL, supports), &case.touches);
        println!("{}: {found:?}", case.name);
        assert!(off(&found, &case.truth) < 1.0, "{found:?}");
    }
}

#[test]
fn the_slotted_tube_is_as_far_off_as_it_says() {
    for quality in Quality::ALL {
        let (off, said) = bench::solids::slotted_graded(&quality.budget().elements);
        println!(
            "slotted {}: {} unknowns, off {:.2} % said {:.2} %; strain {:.2} % said {:.2} %",
            quality.name(),
            off.unknowns,
            off.displacement,
            said.displacement_percent,
            off.strain,
            said.strain_percent
        );
        honest(quality.name(), off.displacement, said.displacement_percent);
        honest(quality.name(), off.strain, said.strain_percent);
    }
}

/// The case on tetrahedra of its own, few and long.
fn own(case: &Case, side_mm: f64) -> SolidGround {
    let part = case.bricks.filled(DVec3::splat(side_mm * 1e-3));
    let supports = std::slice::from_ref(&case.support);
    let told = |_: DVec3| None::<WallSide>;
    SolidGround::new(&part, MATERIAL, supports, &told, &unwatched).unwrap()
}

/// As good a displacement as asked for (%).
fn asking(percent: f64) -> ElementBudget {
    ElementBudget {
        displacement_percent: percent,
        strain_percent: f64::INFINITY,
        ..Quality::Draft.budget().elements
    }
}

fn read(graded: &SolidGraded, case: &Case) -> ModelSample {
    ModelSample::read(&graded.model, &case.touches, &case.places, &unwatched).unwrap()
}

#[test]
fn given_tetrahedra_are_as_far_off_as_they_say() {
    for (case, side_mm) in [(cube(), 5.0), (channel(), 12.0), (bracket(), 12.0)] {
        let ground = own(&case, side_mm);
        let (touches, places) = (&case.touches, &case.places);
        let mut order = 1;
        let mut first = None;
        for asked in [50.0, 8.0, 1.0] {
            let aim = asking(asked);
            let target = AccuracyTarget::new(touches, places, &aim);
            let graded = ground.grade(&target, &unwatched).unwrap();
            let error = off(&under(&graded.model, &case.touches), &case.truth);
            let said = graded.estimate;
            println!(
                "{}, asked {asked} %: order {}, {} unknowns: off {error:.2} %, said {:.2} %",
                case.name,
                graded.fineness.order,
                graded.model.system().dimension(),
                said.displacement_percent
            );
            assert!(graded.fineness.order > order && graded.fineness.halvings == 0);
            carries_on(&case, &graded, error);
            assert!(error < 1.5 * asked, "{}: {error}", case.name);
            honest(case.name, error, said.displacement_percent);
            order = graded.fineness.order;
            // What was foreseen of it: its factor and matrix from the pattern of its nodes alone.
            let foreseen = ground.foresee(&target, &unwatched);
            let foreseen = foreseen.unwrap();
            let system = graded.model.system();
            assert_eq!(foreseen.order, order, "{}", case.name);
            let memory = foreseen.bytes / system.bytes();
            let unknowns = foreseen.unknowns / system.dimension() as f64;
            println!("foreseen: memory {memory:.2}, unknowns {unknowns:.2} of what they are");
            assert!((0.6..1.8).contains(&memory), "{}: {memory}", case.name);
            assert!((0.99..1.6).contains(&unknowns), "{}: {unknowns}", case.name);
            // Strains against those of the highest order.
            let sample = read(&graded, &case);
            let Some((given, strain)) = &first else {
                first = Some((sample, said.strain_percent));
                continue;
            };
            if asked == 1.0 {
                let apart = estimate::left(given, &sample, touches, places, 1.0);
                let ratio = strain / apart.strain_percent;
                println!("{}: strain {ratio:.2} of what it was", case.name);
                assert!((0.4..2.5).contains(&ratio), "{}: {ratio}", case.name);
            }
        }
    }
}

/// Displacements are carried on from one order to the next, wherever they are read, and are nearer to the truth for it.
fn carries_on(case: &Case, graded: &SolidGraded, error: f64) {
    let model: &dyn Model = &graded.model;
    let touches = &case.touches;
    let Some(coarser) = model.coarser() else {
        assert_eq!(
            graded.fineness.order, 2,
            "the first order has none before it"
        );
        return;
    };
    assert_eq!(coarser.share, graded.fineness.carried_on);
    let carried = under(model, touches);
    let plain: Vec<f64> = (carried.iter().zip(under(coarser.model, touches)))
        .map(|(u, before)| (u + coarser.share * before) / (1.0 + coarser.share))
        .collect();
    let before = off(&plain, &case.truth);
    println!(
        "{}, order {}: {before:.2} % off as it is, {error:.2} % carried on",
        case.name, graded.fineness.order
    );
    assert!(
        error < 0.8 * before.max(OWN),
        "{}: {before} {error}",
        case.name
    );
    // A point of the surface moves as its vertex does, by whatever way it is read.
    let touch = &touches[0];
    let vertex = 7;
    let all = model.moved(&[*touch]).swap_remove(0);
    let moved = all[vertex];
    let (at, _) = model.index().nearest(model.mesh().positions()[vertex]);
    let observer = model.observer(&[at], Face::Inside);
    for side in [
        respond::SolvedSide::Loads,
        respond::SolvedSide::Outputs,
        respond::SolvedSide::LoadsAbove,
        respond::SolvedSide::OutputsAbove,
    ] {
        let read = respond_from(
            side,
            model,
            touches,
            &observer,
            Quantity::StrainAndDisplacement,
            &unwatched,
        );
        let read = read.unwrap();
        let mut row = vec![0.0; touches.len()];
        let found = DVec3::from_array(std::array::from_fn(|axis| {
            read.row_into(3 + axis, &mut row);
            row[0]
        }));
        let largest = all.iter().map(|u| u.length()).fold(0.0, f64::max);
        assert!(
            found.distance(moved) < 1e-9 * largest,
            "{side:?}: {found} {moved}"
        );
    }
}

/// Where there is no room for another order, pieces of the part are judged.
#[test]
fn given_tetrahedra_are_judged_whatever_the_memory() {
    let case = channel();
    let (touches, places) = (&case.touches, &case.places);
    let ground = own(&case, 4.0);
    let aim = asking(1e6);
    let graded = ground.grade(&AccuracyTarget::new(touches, places, &aim), &unwatched);
    let whole = graded.unwrap().estimate.displacement_percent;
    let said = ground.judge_by_pieces(touches, places, &unwatched);
    let said = said.unwrap().displacement_percent;
    println!("whole {whole:.2} %, pieces {said:.2} %");
    assert!((0.4..2.5).contains(&(said / whole)), "{said} {whole}");
}

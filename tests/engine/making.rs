//! Touches that are made otherwise than they are said to be: by other tips, and dragging along the surface. Whoever
//! matches readings, calibrates or chooses knows of it, and is better for it.

use std::sync::{Arc, OnceLock};

use crate::gauges;
use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::dataset::{self, Signal};
use hapdef::design::{self, Inputs, Sensing, Simulated};
use hapdef::elasticity::{Push, Touch};
use hapdef::inference::{Matching, ReadingErrors};
use hapdef::placement::SelectorKind;
use hapdef::project::ChosenSite;
use hapdef::uncertainty::{Gluing, Making, Uncertainty};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::agreement::normal;
use crate::coarse;

const GAUGES: usize = 6;
/// What touches press with.
const FORCE_N: f64 = 10.0;

/// A limb that is touched by fingers that drag a third of what they press, with gauges that are glued just so.
fn dragged() -> Inputs {
    let mut inputs = coarse::limb();
    let project = &mut inputs.project;
    project.selection.sensors = GAUGES;
    project.touch.friction_percent = 33.0;
    let tolerance = &mut project.gauge.tolerance;
    (
        tolerance.place_mm,
        tolerance.angle_deg,
        tolerance.gain_percent,
    ) = (0.0, 0.0, 0.0);
    inputs
}

/// The same, by whoever was not told.
fn unaware() -> Inputs {
    let mut inputs = dragged();
    inputs.project.touch.friction_percent = 0.0;
    inputs.project.live.friction_percent = 0.0;
    inputs
}

fn budget() -> Budget {
    Budget {
        touches: 200,
        ..Quality::Draft.budget()
    }
}

fn simulated() -> &'static Arc<Simulated> {
    static SIMULATED: OnceLock<Arc<Simulated>> = OnceLock::new();
    let simulate = || design::simulate(&dragged(), &budget(), &unwatched).unwrap();
    SIMULATED.get_or_init(|| Arc::new(simulate()))
}

/// What is chosen by whoever takes that for off which the inputs say.
fn chosen(inputs: &Inputs) -> Vec<usize> {
    let (simulated, budget) = (simulated(), budget());
    let feasibility = design::filter(inputs, simulated);
    let reduced = design::reduce_sites(inputs, simulated, &feasibility, &budget).unwrap();
    let kind = SelectorKind::ExpectedError;
    let selection = design::Choosing {
        inputs,
        simulated,
        reduced: &reduced,
        budget: &budget,
        watch: &unwatched,
    }
    .select(kind);
    selection.unwrap().sets.pop().unwrap().sites
}

#[test]
fn variances_are_those_of_touches_that_are_made_so() {
    let all = &simulated().dataset;
    let (slopes, made) = (all.slopes.as_ref().unwrap(), all.making.as_ref().unwrap());
    let touches: Vec<Touch> = slopes
        .columns()
        .touches()
        .iter()
        .map(|&t| all.touches[t])
        .collect();
    let model = simulated().model().unwrap();
    let friction = 0.2;
    // Four ways round, each as likely: their mean is what any way has.
    let mut squares = vec![0.0; touches.len()];
    for way in 0..4 {
        let drag = |touch: &Touch| {
            let along = touch.normal.any_orthonormal_vector();
            let across = touch.normal.cross(along);
            let (sin, cos) = (0.3 + std::f64::consts::FRAC_PI_2 * f64::from(way)).sin_cos();
            let straight = Push::from(touch);
            Push {
                force: straight.force + (along * cos + across * sin) * (friction * touch.force),
                ..straight
            }
        };
        let pushes: Vec<Push> = touches.iter().map(drag).collect();
        let gauges = [all.sites[17].gauge];
        let read = dataset::measure(&*model, &pushes, &gauges, Signal::Strain, &unwatched).unwrap();
        let columns = slopes.columns().touches().iter().zip(read.0.row(0));
        for (square, (&t, read)) in squares.iter_mut().zip(columns) {
            *square += (read - all.x.row(17)[t]).powi(2) / 4.0;
        }
    }
    let making = Making {
        friction,
        ..Making::EXACT
    };
    for (column, square) in squares.into_iter().enumerate() {
        let slope = made.of_touch(17, column);
        let variance = making.variance(slope.tip, slope.shear[0].hypot(slope.shear[1]));
        assert!(
            (variance - square).abs() < 1e-3 * square + 1e-18,
            "{variance:e} {square:e}"
        );
        // Nobody asked for other tips.
        assert_eq!(slope.tip, 0.0);
    }
}

#[test]
fn gauges_are_chosen_for_touches_that_drag() {
    let [knows, other] = [dragged(), unaware()].map(|inputs| chosen(&inputs));
    assert_ne!(knows, other);
    let expected = |inputs: &Inputs| {
        let sets = [knows.clone(), other.clone()];
        design::expected_errors(inputs, simulated(), &sets, &unwatched).unwrap()
    };
    let (of_dragged, of_straight) = (expected(&dragged()), expected(&unaware()));
    println!("dragged {of_dragged:?}, straight {of_straight:?} mm");
    assert!(of_dragged[0] < of_dragged[1], "{of_dragged:?}");
    assert!(of_straight[1] < of_dragged[1], "{of_straight:?}");
}

#[test]
fn what_is_off_is_expected_to_cost_what_it_costs() {
    let set = chosen(&unaware());
    let with = |change: &dyn Fn(&mut hapdef::project::Project)| {
        let mut inputs = unaware();
        change(&mut inputs.project);
        let errors =
            design::expected_errors(&inputs, simulated(), std::slice::from_ref(&set), &unwatched);
        errors.unwrap()[0]
    };
    let plain = with(&|_| ());
    let noisy = with(&|p| p.gauge.noise_microstrain = 20.0);
    let drifting = with(&|p| p.gauge.drift_microstrain = 20.0);
    let counted = with(&|p| p.gauge.resolution_microstrain = 20.0);
    // A finger that may push aside, although none does.
    let allowed = with(&|p| p.live.friction_percent = 33.0);
    let dragged = with(&|p| p.touch.friction_percent = 33.0);
    println!(
        "{plain} noise {noisy} drift {drifting} counts {counted} allowed {allowed} dragged {dragged}"
    );
    // A drift that all channels share is told from touches.
    assert!(plain < drifting && drifting < 0.8 * noisy);
    assert!(plain < counted && counted < noisy);
    assert!(plain < allowed && allowed < dragged);
}

#[test]
fn whoever_knows_of_friction_finds_touches_better() {
    const TOUCHES: usize = 200;
    let mut inputs = dragged();
    let sites = &simulated().dataset.sites;
    inputs.project.selection.sites = (chosen(&inputs).into_iter())
        .map(|s| ChosenSite {
            position_mm: (sites[s].gauge.position * 1e3).to_array(),
            direction: sites[s].gauge.direction.to_array(),
        })
        .collect();
    let sensing = design::sensing(&inputs, &budget(), &unwatched).unwrap();
    let touches = sensing.touches(&inputs, TOUCHES, 5, false).unwrap();
    let friction = sensing.off.making.friction;
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut drag = |touch: &Touch| {
        let way = std::f64::consts::TAU * rng.random::<f64>();
        let along = touch.normal.any_orthonormal_vector();
        let aside: DVec3 = along * way.cos() + touch.normal.cross(along) * way.sin();
        let straight = Push::from(touch);
        Push {
            force: straight.force + aside * (friction * touch.force),
            ..straight
        }
    };
    let pushes: Vec<Push> = touches.iter().map(&mut drag).collect();
    let error = |off: Uncertainty| {
        let deviations = sensing.drawn.deviations(&off);
        let errors = ReadingErrors::known(&off, GAUGES, Some(deviations));
        let mut matching = Matching::new(Arc::clone(&sensing.drawn.map), errors, 60.0);
        let pairs = touches.iter().zip(&pushes);
        let away = pairs.map(|(touch, push)| {
            let found = matching.find(&sensing.sensitivity.read_push(push));
            found.position.distance(touch.position) * 1e3
        });
        away.sum::<f64>() / TOUCHES as f64
    };
    let unaware = Uncertainty {
        making: Making::EXACT,
        allowed: 0.0,
        ..sensing.off
    };
    let [told, unaware] = [sensing.off, unaware].map(error);
    println!("told of friction {told:.2} mm, unaware {unaware:.2} mm");
    assert!(told < 0.95 * unaware, "{told} {unaware}");
}

/// What is found of touches that are pushed aside by so much of their force, each in a direction of its own: the mean
/// error of place (mm) and of the force along the surface (N), and how many lie in the region of 90 %.
fn found_of(sensing: &Sensing, touches: &[Touch], aside: f64, off: &Uncertainty) -> [f64; 3] {
    let errors = ReadingErrors::known(
        off,
        sensing.gauges.len(),
        Some(sensing.drawn.deviations(off)),
    );
    let mut matching = Matching::new(Arc::clone(&sensing.drawn.map), errors, 60.0);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut sums, mut within) = ([0.0; 2], 0.0);
    for touch in touches {
        let way = std::f64::consts::TAU * rng.random::<f64>();
        let along = touch.normal.any_orthonormal_vector();
        let way = along * way.cos() + touch.normal.cross(along) * way.sin();
        let drag = way * (aside * touch.force);
        let straight = Push::from(touch);
        let push = Push {
            force: straight.force + drag,
            ..straight
        };
        let mut reading = sensing.sensitivity.read_push(&push);
        for x in &mut reading {
            *x += off.of_channel() * normal(&mut rng);
        }
        let found = matching.find(&reading);
        sums[0] += found.position.distance(touch.position) * 1e3;
        sums[1] += found.drag.distance(drag);
        within += f64::from(u8::from(found.region.holds(found.position, touch.position)));
    }
    [sums[0], sums[1], within].map(|sum| sum / touches.len() as f64)
}

#[test]
fn a_finger_that_pushes_aside_is_found_with_its_direction() {
    let mut inputs = coarse::limb();
    inputs.project.selection.sites = gauges::sites();
    let sensing = design::sensing(&inputs, &budget(), &unwatched).unwrap();
    let touches = sensing.touches(&inputs, 1200, 5, false).unwrap();
    let off = Uncertainty {
        gluing: Gluing::EXACT,
        elements: 0.0,
        ..sensing.off
    };
    let unaware = Uncertainty {
        allowed: 0.0,
        ..off
    };
    let mut straight = 0.0;
    for degrees in [0.0_f64, 10.0, 20.0] {
        let aside = degrees.to_radians().tan();
        let [told, drag_n, held] = found_of(&sensing, &touches, aside, &off);
        let [other, _, held_by_other] = found_of(&sensing, &touches, aside, &unaware);
        println!(
            "{degrees}°: {told:.2} mm, {drag_n:.2} N along the surface, {held:.2} held; by whoever takes it for straight {other:.2} mm, {held_by_other:.2} held"
        );
        assert!((0.84..0.96).contains(&held), "{held}");
        if degrees == 0.0 {
            straight = told;
            assert!(told < 1.15 * other, "{told} {other}");
        } else {
            assert!(
                told < 1.2 * straight && told < 0.5 * other,
                "{told} {other}"
            );
            assert!(drag_n < 0.5 * aside * FORCE_N, "{drag_n}");
        }
    }
}

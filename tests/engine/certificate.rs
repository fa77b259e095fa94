//! The bound beside a choice by expected error: below the best of all sets, and near enough to it to say something.

use crate::coarse;

use std::ops::ControlFlow;

use hapdef::budget::{Budget, Cancelled, Progress, Quality, unwatched};
use hapdef::dataset::SignalMatrix;
use hapdef::design;
use hapdef::placement::expected_error::{
    Certificate, Detail, ExpectedError, ROUNDS, SceneForces, SignalKnowledge, TouchScene, certify,
    local,
};
use hapdef::placement::{Constraints, Pool, SelectionRequest, Selector, SelectorKind, SensorSet};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Sites of a pool small enough for all sets to be tried.
const SITES: usize = 12;
const TOUCHES: usize = 49;

/// Sites and touches strewn over a square of 60 mm; each site feels touches near it, unevenly.
struct Patch {
    x: SignalMatrix,
    targets: Vec<[f64; 3]>,
    /// Of each touch (N).
    forces: Vec<f64>,
    /// Whether forces are to be found too.
    loose: bool,
}

impl Patch {
    fn new(seed: u64, sites: usize, loose: bool) -> Self {
        const SIDE: f64 = 60.0;
        const FORCE: f64 = 10.0;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut place = || [0, 1].map(|_| SIDE * rng.random::<f64>());
        let touched: Vec<[f64; 2]> = (0..TOUCHES).map(|_| place()).collect();
        let glued: Vec<[f64; 2]> = (0..sites).map(|_| place()).collect();
        let felt = |[a, b]: [f64; 2], [x, y]: [f64; 2]| {
            let away = ((x - a).powi(2) + (y - b).powi(2)) / (SIDE / 2.0).powi(2);
            FORCE * (-away).exp() * (1.0 + 0.5 * (0.1 * x + a).sin())
        };
        let values = (glued.iter())
            .flat_map(|&site| touched.iter().map(move |&touch| felt(site, touch)))
            .collect();
        Self {
            x: SignalMatrix::new(TOUCHES, values),
            targets: touched.iter().map(|&[x, y]| [x, y, 0.0]).collect(),
            forces: vec![FORCE; TOUCHES],
            loose,
        }
    }

    fn known(&self) -> SignalKnowledge<'_> {
        SignalKnowledge {
            noise: 1.0,
            variance: None,
            shared: None,
            density: None,
            among: None,
            forces: self.loose.then_some(SceneForces {
                touches: &self.forces,
                coming: [3.0, 25.0],
                possible: 40.0,
            }),
            seed: 1,
        }
    }

    fn scene(&self) -> TouchScene {
        let known = self.known();
        TouchScene::new(&self.x, &self.targets, &known, detail(), &unwatched).unwrap()
    }

    fn chosen(&self, constraints: &Constraints) -> SensorSet {
        let sites: Vec<usize> = (0..self.x.rows()).collect();
        let pool = Pool {
            x: &self.x,
            targets: &self.targets,
            sites: &sites,
            positions: &[],
        };
        let request = SelectionRequest {
            constraints,
            watch: &unwatched,
            found: &|_| {},
        };
        let selector = ExpectedError {
            known: self.known(),
            detail: detail(),
            rounds: ROUNDS,
        };
        let mut selection = selector.select(&pool, &request).unwrap();
        let before = &selection.sets[..selection.sets.len() - 1];
        assert!(before.iter().all(|set| set.certificate.is_none()));
        selection.sets.pop().unwrap()
    }
}

fn detail() -> Detail {
    Detail {
        places: 30,
        presses: 30,
    }
}

fn certified(scene: &TouchScene, required: &[usize], chosen: &[usize]) -> Certificate {
    let all: Vec<usize> = (0..scene.sites()).collect();
    let certificate = certify(scene, &all, required, chosen, &unwatched);
    certificate.unwrap().unwrap()
}

/// All sets of three with the error (mm) of each where one place is meant.
fn sets_of_three(scene: &TouchScene) -> Vec<([usize; 3], f64)> {
    let mut sets = Vec::new();
    for a in 0..SITES {
        for b in a + 1..SITES {
            sets.extend((b + 1..SITES).map(|c| [a, b, c]));
        }
    }
    let with_error = |set: [usize; 3]| (set, local(scene, &set));
    sets.into_iter().map(with_error).collect()
}

fn least(sets: &[([usize; 3], f64)]) -> f64 {
    sets.iter().map(|set| set.1).fold(f64::INFINITY, f64::min)
}

#[test]
fn no_set_of_all_is_below_the_bound_and_the_best_is_near() {
    // Three gauges for two unknowns, and for three: fractions of gauges are worth more there.
    for (loose, near) in [(false, 1.6), (true, 3.0)] {
        for seed in 0..6 {
            let scene = Patch::new(seed, SITES, loose).scene();
            let sets = sets_of_three(&scene);
            let best = least(&sets);
            let found = certified(&scene, &[], &sets[7].0);
            assert!((found.local_mm / sets[7].1 - 1.0).abs() < 1e-4);
            let ratio = best / found.bound_mm;
            println!("seed {seed}, forces {loose}: {ratio:.3}");
            assert!((1.0..near).contains(&ratio), "seed {seed}: {ratio}");
            // Those with a gauge that must be there are fewer, and the bound is theirs.
            let with: Vec<_> = sets.iter().filter(|s| s.0.contains(&5)).copied().collect();
            let required = certified(&scene, &[5], &with[0].0).bound_mm;
            assert!(required <= least(&with));
            assert!(required > 0.99 * found.bound_mm);
        }
    }
}

#[test]
fn more_gauges_have_a_lower_bound_and_all_of_them_their_own_error() {
    let scene = Patch::new(3, SITES, true).scene();
    let all: Vec<usize> = (0..SITES).collect();
    let bounds: Vec<f64> = (1..=SITES)
        .map(|count| certified(&scene, &[], &all[..count]).bound_mm)
        .collect();
    for pair in bounds.windows(2) {
        assert!(pair[1] < pair[0], "{bounds:?}");
    }
    for required in [Vec::new(), all.clone()] {
        let whole = certified(&scene, &required, &all);
        let excess = whole.excess(0.0);
        assert!((-1e-12..6e-3).contains(&excess), "{whole:?}");
    }
}

#[test]
fn a_choice_says_how_far_from_the_best_it_can_be() {
    for loose in [false, true] {
        let patch = Patch::new(11, 40, loose);
        for gauges in [3, 6] {
            let set = patch.chosen(&Constraints::count(gauges));
            let certificate = set.certificate.unwrap();
            assert!(certificate.bound_mm > 0.0);
            assert!(certificate.bound_mm <= certificate.local_mm, "{set:?}");
            let bound = (certificate.bound_mm * 100.0).floor() / 100.0;
            let words = set.certified().unwrap();
            assert!(
                words.ends_with(&format!("(bound {bound:.2} mm)")),
                "{words}"
            );
            let json = serde_json::to_value(&set).unwrap();
            assert_eq!(json["bound_mm"], certificate.bound_mm);
        }
    }
}

#[test]
fn gauges_that_must_be_there_are_in_the_bound() {
    let patch = Patch::new(11, 40, true);
    let bound = |required: &[usize]| {
        let constraints = Constraints {
            required: required.to_vec(),
            ..Constraints::count(4)
        };
        patch.chosen(&constraints).certificate.unwrap()
    };
    let (free, bound_to) = (bound(&[]), bound(&[0, 1, 2]));
    assert!(bound_to.bound_mm > free.bound_mm, "{free:?} {bound_to:?}");
}

#[test]
fn a_bound_can_be_stopped_and_asks_for_touches_and_known_sites() {
    let patch = Patch::new(2, SITES, false);
    let scene = patch.scene();
    let all: Vec<usize> = (0..SITES).collect();
    let stop = |_: Progress| ControlFlow::Break(());
    assert_eq!(certify(&scene, &all, &[], &[0, 1], &stop), Err(Cancelled));
    // A gauge that is none of the sites that a set may have.
    let other = certify(&scene, &all[..4], &[], &[0, 7], &unwatched);
    assert_eq!(other, Ok(None));
    // Touches all at one place leave nothing to find out.
    let x = SignalMatrix::new(4, (0..48).map(|k| f64::from(k).sin()).collect());
    let known = patch.known();
    let known = SignalKnowledge {
        forces: None,
        ..known
    };
    let one = TouchScene::new(&x, &[[1.3; 3]; 4], &known, detail(), &unwatched).unwrap();
    assert_eq!(certify(&one, &all, &[], &[0, 1], &unwatched), Ok(None));
}

#[test]
fn one_thread_or_two_bound_the_same_to_the_byte() {
    let patch = Patch::new(5, 60, true);
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| patch.chosen(&Constraints::count(5)))
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn the_chosen_gauges_of_a_limb_carry_their_bound() {
    let inputs = coarse::limb();
    let budget = Budget {
        touches: 120,
        ..Quality::Draft.budget()
    };
    let simulated = design::simulate(&inputs, &budget, &unwatched).unwrap();
    let feasibility = design::filter(&inputs, &simulated);
    let reduced = design::reduce_sites(&inputs, &simulated, &feasibility, &budget).unwrap();
    for kind in [SelectorKind::ExpectedError, SelectorKind::PcaQr] {
        let selection = design::Choosing {
            inputs: &inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget: &budget,
            watch: &unwatched,
        }
        .select(kind)
        .unwrap();
        let set = selection.sets.last().unwrap();
        println!("{kind:?}: {:?}, {:?}", set.certified(), set.criterion_mm);
        if kind == SelectorKind::ExpectedError {
            let (certificate, error) = (set.certificate.unwrap(), set.criterion_mm.unwrap());
            assert!((0.0..=error).contains(&certificate.bound_mm), "{set:?}");
            assert!(certificate.bound_mm <= certificate.local_mm, "{set:?}");
        } else {
            assert_eq!(set.certified(), None);
        }
    }
}

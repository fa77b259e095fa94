//! What the choice by expected error promises is what matching then does.

use crate::agreement;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use agreement::{FORCES_N, Touched, Trial};
use hapdef::budget::{Progress, unwatched};
use hapdef::dataset::SignalMatrix;
use hapdef::gaussian_process::{Covariance, Distances, GpKernel};
use hapdef::placement::constraints::{Loss, LostBy, Thorough};
use hapdef::placement::entropy::Entropy;
use hapdef::placement::expected_error::{Detail, ExpectedError, ROUNDS, SignalKnowledge};
use hapdef::placement::greedy_svr::{GreedySvr, TOLERANCE};
use hapdef::placement::information::Geometry;
use hapdef::placement::mutual_information::MutualInformation;
use hapdef::placement::{Constraints, PlacementError, Pool, Selection, SelectionRequest, Selector};
use hapdef::regression::tune::Effort;
use hapdef::regression::{Grouping, Hyper};

/// That matching is tried on, a force and set.
const TOUCHES: usize = 700;
/// Of the noise that the promise is made with: a few presses that nobody can tell apart rule the mean of one.
const DRAWS: u64 = 3;

#[test]
fn what_is_promised_is_what_matching_does() {
    let trial = Trial::new([2, 1]);
    println!("{:?}", trial.selection.achieved.notes);
    // More gauges are never worse.
    for pair in trial.selection.sets.windows(2) {
        assert!(pair[1].criterion < pair[0].criterion, "{pair:?}");
    }
    for force in FORCES_N {
        let promised = trial.promised(force, DRAWS);
        let done = trial.done(force, Touched::HeldOut(TOUCHES));
        let ratios: Vec<f64> = promised.iter().zip(&done).map(|(p, d)| p / d).collect();
        for ((set, promised), (done, ratio)) in
            (trial.sets.iter().zip(&promised)).zip(done.iter().zip(&ratios))
        {
            println!(
                "{force} N, {}: promised {promised:.2} mm, done {done:.2} mm, ratio {ratio:.2}",
                set.name
            );
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((0.9..1.12).contains(&mean), "{force} N: {mean:.3}");
        // Few touches that nobody can tell apart rule the mean of a single set.
        assert!(
            ratios.iter().all(|r| (0.65..1.6).contains(r)),
            "{ratios:.2?}"
        );
        // Chosen ones are the best of ten, by the estimator itself.
        assert!(
            done[2..].iter().all(|other| done[0] < 0.8 * other),
            "{done:.2?}"
        );
    }
}

/// Touches on a square of 60 mm, and sites that hear them.
struct Square {
    x: SignalMatrix,
    targets: Vec<[f64; 3]>,
    sites: Vec<usize>,
    positions: Vec<glam::DVec3>,
}

impl Square {
    fn new(side: u32, signals: &[&dyn Fn(f64, f64) -> f64]) -> Self {
        let step = 57.0 / f64::from(side - 1);
        let at = |t: u32| [step * f64::from(t % side), step * f64::from(t / side), 0.0];
        let targets: Vec<[f64; 3]> = (0..side * side).map(at).collect();
        let values = (signals.iter())
            .flat_map(|signal| targets.iter().map(move |&[x, y, _]| signal(x, y)))
            .collect();
        let place = |k: usize| glam::DVec3::new((0.9 * k as f64).sin(), 0.3 * k as f64, 0.0) * 0.02;
        Self {
            x: SignalMatrix::new(targets.len(), values),
            sites: (0..signals.len()).collect(),
            positions: (0..signals.len()).map(place).collect(),
            targets,
        }
    }

    /// Two sites that tell x very well, one that tells y, and one that tells a little of both.
    fn of_four() -> Self {
        let x = |x: f64, _: f64| 10.0 * x;
        let again = |x: f64, _: f64| 9.0 * x;
        let y = |_: f64, y: f64| 10.0 * y;
        let both = |x: f64, y: f64| 3.0 * (x + y);
        Self::new(20, &[&x, &again, &y, &both])
    }

    /// Twelve sites, each near something else.
    fn of_twelve() -> Self {
        let near = |k: u32| {
            let (a, b) = (f64::from(17 * k % 60), f64::from(23 * k % 60));
            move |x: f64, y: f64| 30.0 * (-((x - a).powi(2) + (y - b).powi(2)) / 900.0).exp()
        };
        let signals: Vec<_> = (1..=12).map(near).collect();
        let signals: Vec<&dyn Fn(f64, f64) -> f64> = (signals.iter())
            .map(|s| s as &dyn Fn(f64, f64) -> f64)
            .collect();
        Self::new(12, &signals)
    }

    fn chosen_by(
        &self,
        selector: &dyn Selector,
        constraints: &Constraints,
    ) -> Result<Selection, PlacementError> {
        let pool = Pool {
            x: &self.x,
            targets: &self.targets,
            sites: &self.sites,
            positions: &self.positions,
        };
        let request = SelectionRequest {
            constraints,
            watch: &unwatched,
            found: &|_| (),
        };
        selector.select(&pool, &request)
    }

    fn chosen(&self, constraints: &Constraints, rounds: usize) -> Selection {
        self.chosen_by(&expected_error(rounds), constraints)
            .unwrap()
    }
}

fn expected_error(rounds: usize) -> ExpectedError<'static> {
    ExpectedError {
        known: SignalKnowledge {
            noise: 1.0,
            variance: None,
            shared: None,
            density: None,
            among: None,
            forces: None,
            seed: 5,
        },
        detail: Detail {
            places: 200,
            presses: 100,
        },
        rounds,
    }
}

fn last(selection: &Selection) -> (Vec<usize>, f64) {
    let set = selection.sets.last().unwrap();
    let mut sites = set.sites.clone();
    sites.sort_unstable();
    (sites, set.criterion.unwrap())
}

fn failing(failure: f64, gauges: usize, by: LostBy) -> Constraints {
    Constraints {
        failure,
        loss: Loss { gauges, by },
        ..Constraints::count(3)
    }
}

#[test]
fn a_gauge_that_may_be_lost_is_not_relied_upon() {
    let square = Square::of_four();
    let (without, error) = last(&square.chosen(&Constraints::count(3), ROUNDS));
    assert_eq!(without, [0, 1, 2]);
    for by in LostBy::ALL {
        // Only one site tells y for itself; the one that tells both can stand in for any of the others.
        let selection = square.chosen(&failing(0.3, 1, by), ROUNDS);
        let (with, expected) = last(&selection);
        assert_eq!(with, [0, 2, 3], "{by:?}");
        assert!(expected > error, "{by:?}: {expected} {error}");
        let notes = &selection.achieved.notes;
        assert!(notes.iter().any(|n| n.contains("lost")), "{notes:?}");
    }
    let (_, two) = last(&square.chosen(&failing(0.3, 2, LostBy::Expected), ROUNDS));
    let (_, one) = last(&square.chosen(&failing(0.3, 1, LostBy::Expected), ROUNDS));
    assert!(two > one, "{two} {one}");
}

#[test]
fn losses_and_starts_give_the_same_bytes_on_any_number_of_threads() {
    let square = Square::of_twelve();
    let constraints = Constraints {
        failure: 0.2,
        loss: Loss {
            gauges: 2,
            by: LostBy::Expected,
        },
        thorough: Thorough {
            exchange: true,
            starts: 3,
        },
        ..Constraints::count(4)
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| square.chosen(&constraints, ROUNDS))
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn a_choice_with_losses_can_be_stopped() {
    let square = Square::of_twelve();
    let pool = Pool {
        x: &square.x,
        targets: &square.targets,
        sites: &square.sites,
        positions: &[],
    };
    let asked = AtomicUsize::new(0);
    let watch = |_: Progress| {
        if asked.fetch_add(1, Ordering::Relaxed) > 15 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let request = SelectionRequest {
        constraints: &failing(0.3, 1, LostBy::Worst),
        watch: &watch,
        found: &|_| (),
    };
    let stopped = expected_error(ROUNDS).select(&pool, &request);
    assert!(matches!(stopped, Err(PlacementError::Cancelled(_))));
}

#[test]
fn exchange_and_starts_make_no_criterion_worse() {
    /// What a criterion may move by from one fit to the next.
    const FITTED: f64 = 0.01;
    let square = Square::of_twelve();
    let lengths: Vec<f64> = (square.positions.iter())
        .flat_map(|a| square.positions.iter().map(move |b| a.distance(*b)))
        .collect();
    let distances = Distances::new(square.positions.len(), "straight", &lengths);
    let kernel = GpKernel::default();
    let geometry = Geometry {
        covariance: Covariance::new(&distances, &kernel, &unwatched).unwrap(),
        kernel,
        distance: distances.kind,
        coinciding: 0,
        map: Vec::new(),
    };
    let (geometry, expected) = (&geometry, expected_error(ROUNDS));
    let svr = GreedySvr {
        hyper: Hyper {
            c: 200.0,
            epsilon: 0.1,
            gamma: 0.3,
        },
        folds: 3,
        seed: 7,
        grouping: Grouping::Touch,
        effort: Effort {
            tolerance: 0.01,
            max_steps: 1_000_000,
        },
        tolerance: TOLERANCE,
        landmarks: 1.0,
    };
    // More is better of the last two.
    let selectors: [(&dyn Selector, f64); 4] = [
        (&expected, 1.0),
        (&svr, 1.0),
        (&Entropy { geometry }, -1.0),
        (&MutualInformation { geometry }, -1.0),
    ];
    for (selector, sign) in selectors {
        let name = selector.kind().name();
        let with = |exchange: bool, starts: usize| {
            let constraints = Constraints {
                required: vec![7],
                spacing: 0.003,
                thorough: Thorough { exchange, starts },
                ..Constraints::count(4)
            };
            let selection = square.chosen_by(selector, &constraints).unwrap();
            let set = selection.sets.last().unwrap();
            assert_eq!((set.sites.len(), set.sites[0]), (4, 7), "{name}");
            sign * set.criterion.unwrap()
        };
        let plain = with(false, 1);
        let slack = FITTED * plain.abs();
        let exchanged = with(true, 1);
        let begun = with(true, 3);
        assert!(exchanged <= plain + slack, "{name}: {exchanged} {plain}");
        assert!(begun <= exchanged + slack, "{name}: {begun} {exchanged}");
    }
}

#[test]
fn greedy_svr_weighs_the_loss_of_one_gauge_only() {
    let square = Square::of_four();
    let svr = GreedySvr {
        hyper: Hyper::default(),
        folds: 3,
        seed: 7,
        grouping: Grouping::Touch,
        effort: Effort {
            tolerance: 0.1,
            max_steps: 1_000_000,
        },
        tolerance: TOLERANCE,
        landmarks: 1.0,
    };
    let refused = square.chosen_by(&svr, &failing(0.3, 2, LostBy::Expected));
    let said = refused.unwrap_err().to_string();
    assert!(said.contains("expected error"), "{said}");
}

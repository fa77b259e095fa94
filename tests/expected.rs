//! What the choice by expected error promises is what matching then does.

mod agreement;

use agreement::{FORCES_N, Touched, Trial};

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

//! A touch stands for a while and goes; nothing drifts.

use super::*;
use crate::inference::TouchKind;
use crate::statistics::chi_squared_bound;

const CHANNELS: usize = 10;
const NOISE: f64 = 0.5e-6;
const STEP_S: f64 = 0.004;
/// What a touch reads at its hardest (strain).
const READS: f64 = 600e-6;

/// What is left of a touch that goes as a hand moves, so many seconds after it began to and before it has gone: with the least
/// jerk (T. Flash and N. Hogan, J. Neuroscience 5, 1985).
fn left([after_s, goes_s]: [f64; 2]) -> f64 {
    let x = (after_s / goes_s).min(1.0);
    1.0 - x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x)
}

/// The weighted squares, at most, of what is read once a touch has gone that is felt until this is left of it (strain).
fn squares_after(felt: f64, goes_s: f64) -> f64 {
    let (noise, used) = ([NOISE; CHANNELS], [true; CHANNELS]);
    let mut drift = Drift::new(&noise, &[], 5.0, STEP_S.recip());
    let mut turn: f64 = 0.0;
    let mut read = |size: f64| -> Vec<f64> {
        turn += 1.0;
        let of = |c: usize| (1.7 * c as f64).sin();
        let noise = |c: usize| 1.4 * NOISE * (12.9 * turn + 7.3 * c as f64 * turn.sqrt()).sin();
        (0..CHANNELS).map(|c| size * of(c) + noise(c)).collect()
    };
    for _ in 0..500 {
        drift.pass(STEP_S);
        drift.rested(&read(0.0), &noise, &used);
    }
    let touches = SeveralTouches {
        kind: TouchKind::Unclear,
        probability: 1.0,
        contacts: Vec::new(),
        unexplained: 0.0,
        shares: [0.0; 5],
    };
    let mut most: f64 = 0.0;
    for step in -5000_i32..200 {
        drift.pass(STEP_S);
        let size = READS * left([STEP_S * f64::from(step.max(0)), goes_s]);
        let strain = read(size);
        if size > felt {
            let reading = strain.clone();
            drift.touched(&touches, [&strain, &reading], &noise, &used, Vec::new);
            continue;
        }
        let rest: Vec<f64> = drift.rest().collect();
        let off: Vec<f64> = strain.iter().zip(rest).map(|(x, b)| x - b).collect();
        if size == 0.0 {
            most = most.max(drift.squares(&off, &noise, &used)[0]);
        }
        drift.rested(&strain, &noise, &used);
    }
    most
}

#[test]
fn the_end_of_a_touch_is_no_rest() {
    for felt in [4.0, 8.0, 16.0, 32.0] {
        for goes_s in [0.06, 0.1, 0.2, 0.4] {
            let squares = squares_after(felt * NOISE, goes_s);
            // A touch would end.
            let noise = chi_squared_bound(CHANNELS as f64, 4.0);
            assert!(squares < noise, "{felt} {goes_s} {squares}");
        }
    }
}

/// Beside what is held a touch may be thought to read a thousand times as much as is read: that loads nothing.
#[test]
fn what_loads_the_channels_is_no_more_than_is_read() {
    let read = [20e-6, -5e-6, 1e-6];
    let near = [18e-6, -5e-6, 2e-6];
    assert_eq!(load_of(&near, &read), near);
    // Of what is read this leaves more than it explains.
    assert_eq!(load_of(&[20e-3, -5e-3, 1e-3], &read), read);
    assert_eq!(load_of(&[-18e-6, 5e-6, -2e-6], &read), read);
}

/// What a touch reads beside its model for a minute is not left behind as a rest.
#[test]
fn what_the_model_is_off_by_goes_with_the_touch() {
    let (noise, used) = ([NOISE; CHANNELS], [true; CHANNELS]);
    let mut drift = Drift::new(&noise, &[], 5.0, STEP_S.recip());
    let touches = SeveralTouches {
        kind: TouchKind::Unclear,
        probability: 1.0,
        contacts: Vec::new(),
        unexplained: 0.0,
        shares: [0.0; 5],
    };
    // A twentieth of it, either way.
    let reading: Vec<f64> = (0..CHANNELS)
        .map(|c| 100e-6 * (1.7 * c as f64).sin())
        .collect();
    let beside = |c: usize| 1.0 + 0.05 * (2.9 * c as f64).cos();
    let strain: Vec<f64> = (0..CHANNELS).map(|c| beside(c) * reading[c]).collect();
    for step in 0..15_500 {
        drift.pass(STEP_S);
        if step < 500 {
            drift.rested(&[0.0; CHANNELS], &noise, &used);
        } else {
            drift.touched(&touches, [&strain, &reading], &noise, &used, Vec::new);
        }
    }
    let left: Vec<f64> = drift.rest().map(|b| -b).collect();
    let squares = drift.squares(&left, &noise, &used)[0];
    println!("{squares:.1} squares are left");
    // Far less than the noise of a sample has; taken for noise it would leave 14.
    assert!(squares < 0.5 * CHANNELS as f64, "{squares}");
}

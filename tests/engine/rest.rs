//! The rest that readings are held against: taken under a touch it is none, and that shows.

use hapdef::board::{Faults, PressScript, RandomPresses};
use hapdef::live::LiveNews;
use hapdef::uncertainty::Making;

use crate::inference::{Bench, press};

/// A board that is connected while somebody presses, who lets go a second and a half later and presses elsewhere.
#[test]
fn a_rest_that_was_taken_under_a_press_is_taken_again() {
    const PRESSES: usize = 10;
    let (mut releases, mut ghosts, mut found) = (0, 0, Vec::new());
    for k in 0..PRESSES {
        let begins = [-1.0, -0.2][k % 2];
        let presses = vec![
            press(k, 8.0, begins, 1.5 - begins),
            press(k + PRESSES, 8.0, 3.0, 1.0),
        ];
        let mut bench = Bench::new(PressScript::Given(presses), Faults::default(), 0.1e-6);
        let mut off = Vec::new();
        bench.run(4_500, |pipeline, update, truth| {
            releases += usize::from(pipeline.news().contains(&LiveNews::Released));
            match (truth.touch, update.contact) {
                (None, Some(_)) if truth.time_us > 1_800_000 => ghosts += 1,
                (Some(touch), Some(contact)) if truth.time_us > 3_200_000 => {
                    off.push(contact.position.distance(touch.position) * 1e3);
                }
                _ => {}
            }
        });
        assert!(off.len() > 500, "press {k}: {} samples", off.len());
        found.push(off.iter().sum::<f64>() / off.len() as f64);
    }
    let mean = found.iter().sum::<f64>() / PRESSES as f64;
    println!(
        "{releases} releases, {ghosts} samples of ghosts, then {mean:.2} mm off ({found:.2?})"
    );
    // Letting go takes a moment.
    assert!(ghosts < 10 * PRESSES, "{ghosts}");
    assert!(releases >= PRESSES && mean < 1.5, "{releases} {found:?}");
}

/// Random presses leave a listener alone while it takes its rest, whenever it comes.
#[test]
fn a_simulated_board_is_left_alone_at_first() {
    use glam::DVec3;
    use hapdef::elasticity::Touch;

    let place = Touch {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        force: 1.0,
        tip_radius: 5e-3,
    };
    for seed in 0..20_u32 {
        let mut script = PressScript::random(
            vec![place; 3],
            RandomPresses::usual([2.0, 15.0], Making::EXACT),
            u64::from(seed),
        );
        // Nobody has listened so far.
        let from = 3.0 + 0.137 * f64::from(seed);
        assert!(
            (0..30).any(|k| !script.at(from - 3.0 + 0.1 * f64::from(k)).is_empty()) || seed < 3
        );
        script.leave_alone(from + 2.0);
        for k in 0..200 {
            let now = from + 0.01 * f64::from(k);
            assert!(script.at(now).is_empty(), "{seed}: pressed at {now}");
        }
        assert!((0..300).any(|k| !script.at(from + 2.0 + 0.01 * f64::from(k)).is_empty()));
    }
}

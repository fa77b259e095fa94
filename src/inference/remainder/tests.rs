use glam::DVec2;

use super::*;
use crate::budget::unwatched;
use crate::inference::plate::plate;

const SIDE: u32 = 30;
const CHANNELS: usize = 3;
/// Between vertices (m).
const STEP: f64 = 2e-3;

/// A plate of 58 mm, and what three gauges read on it of a newton: as far as the model knows, and in truth.
fn of_plate(truth: bool) -> ResponseMap {
    plate(SIDE, STEP, |p| read(p.truncate(), truth))
}

fn read(p: DVec2, truth: bool) -> [f64; CHANNELS] {
    [0.01, 0.03, 0.05].map(|at| {
        let model = 8e-6 * (-(p - DVec2::new(at, 0.02)).length_squared() / 8e-4).exp() + 1e-6;
        let off = 0.15 * (p.x / 0.02 + 40.0 * at).sin() * (p.y / 0.025).cos();
        model * if truth { 1.0 + off } else { 1.0 }
    })
}

/// Presses of `truth`, in no order, at so many places.
fn presses(truth: &ResponseMap, count: usize) -> Vec<KnownPress> {
    (0..count)
        .map(|k| {
            let at = [0.618_034, 0.754_878].map(|by| (by * (k + 1) as f64).fract());
            let place = DVec3::new(at[0], at[1], 0.0) * f64::from(SIDE - 1) * STEP;
            let at = truth.mesh.index().nearest(place).0;
            let force = 5.0 + 10.0 * (0.3 * k as f64).fract();
            KnownPress {
                at,
                force,
                reading: truth.at(at).iter().map(|g| force * g).collect(),
            }
        })
        .collect()
}

/// Root of the mean square of what a map is off by, in microstrain a newton, and of that over what it says.
fn off(map: &ResponseMap, deviation: &ResponseMap, truth: &ResponseMap) -> [f64; 2] {
    let pairs = map.values().iter().zip(truth.values());
    let (mut squares, mut said) = (0.0, 0.0);
    for ((m, t), d) in pairs.zip(deviation.values()) {
        squares += (m - t).powi(2);
        said += ((m - t) / d).powi(2);
    }
    [squares, said].map(|s| (s / map.values().len() as f64).sqrt())
}

fn learned(known: &[KnownPress]) -> ([ResponseMap; 2], RemainderSettings) {
    let model = of_plate(false);
    let nothing = vec![0.0; model.values().len()];
    let none = ResponseMap::of(Arc::clone(&model.mesh), CHANNELS, nothing);
    let remainder = Remainder::learn(&model, known, &[1e-7; CHANNELS], &unwatched)
        .unwrap()
        .unwrap();
    let added = remainder.add_to(&model, &none, &unwatched).unwrap();
    (added, remainder.settings)
}

#[test]
fn the_more_presses_the_nearer_the_map_is_to_what_was_pressed_and_it_says_how_near() {
    let (model, truth) = (of_plate(false), of_plate(true));
    let same = ResponseMap::of(
        Arc::clone(&model.mesh),
        CHANNELS,
        vec![1.0; model.values().len()],
    );
    let before = off(&model, &same, &truth)[0];
    let mut last = before;
    for (count, of_before) in [(20, 0.8), (80, 0.25), (400, 0.06)] {
        let ([map, deviation], settings) = learned(&presses(&truth, count));
        let [left, over] = off(&map, &deviation, &truth);
        assert!(
            left < of_before * before && left < last,
            "{count}: {left} of {before}"
        );
        assert!((0.2..2.0).contains(&over), "{count}: {over} {settings:?}");
        last = left;
    }
}

#[test]
fn a_model_that_is_right_stays_as_it_is() {
    let model = of_plate(false);
    let ([map, deviation], settings) = learned(&presses(&model, 100));
    let [left, _] = off(&map, &deviation, &model);
    assert!(
        left < 0.02e-6 && settings.share < 0.02,
        "{left} {settings:?}"
    );
}

#[test]
fn a_channel_that_was_not_read_says_nothing_and_the_others_what_they_said() {
    let truth = of_plate(true);
    let all = presses(&truth, 80);
    let mut without = all.clone();
    for press in &mut without {
        press.reading[1] = f64::NAN;
    }
    let ([map, deviation], _) = learned(&without);
    let model = of_plate(false);
    let column = |m: &ResponseMap, c: usize| -> Vec<f64> {
        m.values()
            .iter()
            .skip(c)
            .step_by(CHANNELS)
            .copied()
            .collect()
    };
    assert_eq!(column(&map, 1), column(&model, 1));
    assert!(column(&deviation, 1).iter().all(|d| *d > 0.0));
    let off = |c: usize| -> f64 {
        let pairs = column(&map, c).into_iter().zip(column(&truth, c));
        pairs.map(|(m, t)| (m - t).powi(2)).sum()
    };
    assert!(off(0) < 0.1 * off(1) && off(2) < 0.1 * off(1));
    let unread: Vec<KnownPress> = (all.into_iter())
        .map(|k| KnownPress {
            reading: vec![f64::NAN; CHANNELS],
            ..k
        })
        .collect();
    let none = Remainder::learn(&model, &unread[..0], &[1e-7; CHANNELS], &unwatched);
    assert!(none.unwrap().is_none());
    let ([map, _], _) = learned(&unread);
    assert_eq!(map.values(), model.values());
}

#[test]
fn many_depths_at_a_place_are_one_press_of_them_all() {
    let truth = of_plate(true);
    let once = presses(&truth, 60);
    let twice: Vec<KnownPress> = (once.iter())
        .flat_map(|k| {
            let half = KnownPress {
                force: k.force / 2.0,
                reading: k.reading.iter().map(|x| x / 2.0).collect(),
                ..k.clone()
            };
            [k.clone(), half]
        })
        .collect();
    let map = |known: &[KnownPress]| learned(known).0[0].values().to_vec();
    for (a, b) in map(&once).into_iter().zip(map(&twice)) {
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let truth = of_plate(true);
    let known = presses(&truth, 50);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let ([map, deviation], settings) = learned(&known);
            (map.values().to_vec(), deviation.values().to_vec(), settings)
        })
    };
    assert!(on(1) == on(3));
}

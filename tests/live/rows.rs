//! What broke live touch when it was first tried on a real limb, row by row, through the real programs: a board whose
//! part is of finer elements than the listener's model is pressed and disturbed (`hapdef board --simulate --record`), and
//! `hapdef listen` says what it feels.
//!
//! The bundled limb at Draft with its ten gauges, or with other ten (`HAPDEF_TEN`), or another limb with its own
//! (`HAPDEF_LIMB`), or a listener of finer elements (`HAPDEF_QUALITY`); what the gauges are off by is said at each test.

mod bench;
mod limb;

use std::path::PathBuf;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use self::bench::{
    BOARD, Bench, Heard, Press, hold, in_turn, listen, listen_with, places, places_on, with_more,
};
use self::limb::other_limb;
use super::promise::{hapdef, text};

#[test]
fn a_board_that_is_connected_under_a_press_is_no_ghost_for_ever() {
    let places = places(6);
    let mut presses = in_turn(8.0, 2.0, 1.2, &places[1..], 8.0);
    let under = Press {
        ramp_ms: 0.1,
        ..Press::new(0.0, 2.5, places[0], 8.0)
    };
    presses.insert(0, under);
    let bench = Bench::of(presses);
    let (heard, said) = listen(&bench.record(&BOARD), &bench.exact("0.0"));
    assert!(said.contains("it is taken again"), "{said}");
    let later = Bench::of(bench.presses[1..].to_vec());
    let (felt, (off, _)) = (later.felt(&heard), later.off(&heard));
    let ghosts = bench.ghosts(&heard, 2.8);
    println!("{ghosts} ghosts, {felt:.3} felt, {off:.2} mm off");
    hold(
        ghosts == 0 && felt > 0.99 && off < 0.6,
        "0.6 mm and no ghosts",
    );
}

#[test]
fn steep_taps_lose_no_gauge() {
    let mut presses = in_turn(3.0, 0.5, 0.12, &places(40), 8.0);
    for (k, press) in presses.iter_mut().enumerate() {
        press.ramp_ms = [2.0, 5.0, 10.0][k % 3];
    }
    let bench = Bench::of(presses);
    for (bits, noise) in [("24", "0.1"), ("16", "1"), ("16", "8")] {
        let board = ["--rate", "1000", "--bits", bits, "--noise", noise];
        let recording = bench.record(&[&board[..], &["--workshop", "exact"]].concat());
        let (heard, _) = listen(&recording, &bench.exact("0.0"));
        let heard: Vec<Heard> = heard.into_iter().filter(|h| h.time_s > 3.0).collect();
        let least = heard.iter().map(|h| h.channels_ok).min();
        let ghosts = bench.ghosts(&heard, 3.0);
        let (unfelt, (off, _)) = (bench.unfelt(&heard), bench.off(&heard));
        println!(
            "{noise} microstrain: {least:?} gauges, {unfelt:?} not felt, {off:.2} mm, {ghosts} ghosts"
        );
        hold(least == Some(10) && ghosts == 0, "ten gauges and no ghosts");
        hold(unfelt.is_empty() && off < 1.1, "1.1 mm");
        std::fs::remove_file(recording).unwrap();
    }
}

#[test]
fn a_finger_that_pushes_aside_is_found() {
    for (tilt, friction, most) in [(10.0, "25.0", 0.6), (20.0, "40.0", 0.7)] {
        let mut presses = in_turn(3.0, 1.2, 0.8, &places(24), 10.0);
        for (k, press) in presses.iter_mut().enumerate() {
            (press.tilt_deg, press.towards_deg) = (tilt, f64::from(47 * k as u32 % 360));
        }
        let bench = Bench::of(presses);
        let (recording, project) = (bench.record(&BOARD), bench.exact(friction));
        for (quality, most) in [("draft", 0.9), ("standard", most)] {
            let (heard, _) = listen_with(&recording, &project, &["--quality", quality]);
            let (felt, (off, held)) = (bench.felt(&heard), bench.off(&heard));
            println!("{tilt} degrees, {quality}: {felt:.3} felt, {off:.2} mm off, {held:.2} held");
            hold(
                felt > 0.99 && off < most && held > 0.7,
                "what it is to reach",
            );
        }
    }
}

#[test]
fn two_fingers_are_two_and_the_next_one_is_one() {
    const PAIRS: usize = 30;
    let (places, mut rng) = (places(80), ChaCha8Rng::seed_from_u64(3));
    let mut drawn = || places[rng.random_range(0..places.len())];
    let mut forces = ChaCha8Rng::seed_from_u64(4);
    let mut force = || forces.random_range(5.0..30.0);
    let (mut presses, mut start) = (Vec::new(), 3.0);
    for pair in 0..PAIRS {
        let [one, other] = loop {
            let two = [drawn(), drawn()];
            if two[0].distance(two[1]) >= 25.0 {
                break two;
            }
        };
        // Some stay for long.
        let stay = if pair % 10 == 9 { 10.0 } else { 1.0 };
        presses.push(Press::new(start, stay + 0.1, one, force()));
        presses.push(Press::new(start + 0.1, stay, other, force()));
        presses.push(Press::new(start + stay + 1.0, 0.8, drawn(), 8.0));
        start += stay + 2.4;
    }
    let bench = Bench::of(presses);
    let (heard, _) = listen(&bench.record(&BOARD), &bench.exact("0.0"));
    let (mut right, mut all, mut off, mut wrong) = (0, 0, Vec::new(), Vec::new());
    for two in bench.presses.chunks(3) {
        let full = two[1].full_s().start + 0.1..two[0].full_s().end;
        for h in heard.iter().filter(|h| full.contains(&h.time_s)) {
            all += 1;
            let [first, second] = h.touches[..] else {
                continue;
            };
            right += 1;
            let both = |a: &Press, b: &Press| {
                let of = |p: &Press, t: (DVec3, f64, f64)| {
                    (p.place.distance(t.0), (p.force - t.1).abs())
                };
                let (a, b) = (of(a, first), of(b, second));
                (f64::midpoint(a.0, b.0), f64::midpoint(a.1, b.1))
            };
            let either = [both(&two[0], &two[1]), both(&two[1], &two[0])];
            let nearest = either
                .into_iter()
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap();
            off.push(nearest.0);
            wrong.push(nearest.1);
        }
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let share = f64::from(right) / f64::from(all);
    let (off, wrong) = (mean(&off), mean(&wrong));
    println!("{share:.3} are two, {off:.2} mm and {wrong:.2} N off");
    hold(
        share > 0.95 && off < 1.0 && wrong < 0.8,
        "two, 1 mm and 0.8 N",
    );
    let after = Bench::of(bench.presses.iter().skip(2).step_by(3).copied().collect());
    let one = after
        .full(&heard)
        .filter(|(_, h)| h.touches.len() == 1)
        .count();
    let share = one as f64 / after.full(&heard).count() as f64;
    let ((off, _), ghosts) = (after.off(&heard), bench.ghosts(&heard, 0.0));
    println!("then {share:.3} are one, {off:.2} mm off, {ghosts} ghosts");
    hold(
        share > 0.97 && off < 1.0 && ghosts == 0,
        "one, 1 mm and no ghosts",
    );
}

/// Where elements leave much of what one gauge reads a second touch would explain it.
#[test]
fn one_finger_is_never_two() {
    let of_force = |places: &[DVec3]| {
        let mut presses = in_turn(3.0, 1.2, 0.6, places, 8.0);
        for (k, press) in presses.iter_mut().enumerate() {
            press.force = [2.0, 8.0, 20.0, 30.0][k % 4];
        }
        presses
    };
    let mut benches = vec![Bench::of(of_force(&places(40)))];
    if other_limb().is_none() {
        let places = places_on("barrel", 40);
        benches.push(Bench::on_bundled("barrel", of_force(&places)));
    }
    for bench in benches {
        let (heard, _) = listen(&bench.record(&BOARD), &bench.exact("0.0"));
        let is_one = |h: &Heard| h.kind.as_deref() == Some("points") && h.touches.len() == 1;
        let all = bench.full(&heard).count() as f64;
        let one = bench.full(&heard).filter(|(_, h)| is_one(h)).count() as f64;
        let ((off, _), ghosts) = (bench.off(&heard), bench.ghosts(&heard, 0.0));
        let share = one / all;
        println!("{share:.3} are one, {off:.2} mm off, {ghosts} ghosts");
        hold(share > 0.99 && ghosts == 0, "one in 99 %, and no ghosts");
    }
}

#[test]
fn a_standing_touch_outlives_a_drift_and_light_ones_are_felt_under_it() {
    let places = places(20);
    let mut presses = vec![Press::new(3.0, 120.0, places[3], 1.0)];
    presses.extend(in_turn(125.0, 2.0, 1.0, &places, 1.5));
    let bench = Bench::of(presses);
    let recording = bench.record(&with_more(&["--warming", "2"]));
    let (heard, _) = listen(&recording, &bench.exact("0.0"));
    let (felt, ghosts) = (bench.felt(&heard), bench.ghosts(&heard, 0.0));
    println!("2 microstrain a second: {felt:.3} felt, {ghosts} ghosts");
    hold(felt > 0.99 && ghosts == 0, "felt and no ghosts");

    let bench = Bench::of(in_turn(3.0, 2.0, 1.0, &places, 1.5));
    let recording = bench.record(&with_more(&["--warming", "5"]));
    let (heard, _) = listen(&recording, &bench.exact("0.0"));
    let (felt, ghosts) = (bench.felt(&heard), bench.ghosts(&heard, 0.0));
    println!("5 microstrain a second: {felt:.3} felt, {ghosts} ghosts");
    hold(felt > 0.95 && ghosts == 0, "felt and no ghosts");
}

/// Glued as a workshop does it, so that nobody knows of how unevenly gauges feel what all of them feel.
#[test]
fn a_light_touch_stands_for_ten_minutes() {
    stands_for_ten_minutes("ten minutes", Bench::of);
}

fn stands_for_ten_minutes(name: &str, bench: impl Fn(Vec<Press>) -> Bench) {
    let place = places(20)[3];
    let standing = Press::new(20.0, 600.0, place, 1.0);
    let bench = bench(vec![standing, Press::new(640.0, 3.0, place, 10.0)]);
    let glued = ["--rate", "100", "--bits", "16", "--warming", "2"];
    let (heard, _) = listen(&bench.record(&glued), &bench.project(&[]));
    let (unfelt, ghosts) = (bench.unfelt(&heard), bench.ghosts(&heard, 0.0));
    let last = |h: &&Heard| (560.0..619.0).contains(&h.time_s);
    let forces: Vec<f64> = (heard.iter().filter(last))
        .flat_map(|h| h.touches.iter().map(|t| t.1))
        .collect();
    let force = forces.iter().sum::<f64>() / forces.len() as f64;
    println!("{name}: {unfelt:?} not felt, {force:.2} N in the last, {ghosts} ghosts");
    hold(
        unfelt.is_empty() && ghosts == 0 && (force - 1.0).abs() < 0.25,
        "felt, 1 N and no ghosts",
    );
}

/// Four minutes of one that rolls by two millimetres to and fro: what it reads beside its model stays, and is not the rest.
#[test]
fn a_finger_that_rolls_leaves_nothing_behind() {
    const HALF_S: f64 = 8.0;
    let place = places(20)[5];
    let aside = DVec3::new(-place.y, place.x, 0.0).normalize();
    // One press hands over to the next.
    let rolled = |k: u32| Press {
        ramp_ms: 500.0 * HALF_S,
        ..Press::new(
            10.0 + HALF_S * f64::from(k),
            1.5 * HALF_S,
            place + 2.0 * f64::from(k % 2) * aside,
            3.0,
        )
    };
    let mut presses: Vec<Press> = (0..30).map(rolled).collect();
    presses.push(Press::new(274.0, 3.0, place, 10.0));
    let bench = Bench::of(presses);
    let glued = ["--rate", "100", "--bits", "16", "--warming", "1"];
    let (heard, _) = listen(&bench.record(&glued), &bench.project(&[]));
    let ghosts = bench.ghosts(&heard, 0.0);
    let stands = |h: &&Heard| (15.0..250.0).contains(&h.time_s);
    let all = heard.iter().filter(stands);
    let (one, of) = (all.clone().filter(|h| h.touches.len() == 1), all.count());
    let one = one.count() as f64 / of as f64;
    println!("rolls: {one:.3} are one, {ghosts} ghosts");
    hold(one > 0.99 && ghosts == 0, "one and no ghosts");
}

/// The ten gauges of the bundled limb are kind to us: with these others a standing touch was lost after a minute and a half
/// or eight, or left ghosts, and a tap did so where noise is least.
#[test]
fn other_gauges_do_so_too() {
    // They are of the bundled limb.
    if other_limb().is_some() {
        return;
    }
    // There the model lacks just so much that a pull did better once in a thousand looks.
    stands_for_ten_minutes("library-0, ten minutes", |p| {
        Bench::with_ten("library-0", p)
    });
    let places = places(40);
    // It goes on for a while after the standing touch.
    let standing = || {
        let mut presses = vec![Press::new(3.0, 120.0, places[6], 1.0)];
        presses.extend(in_turn(126.0, 2.0, 1.0, &places[..2], 1.5));
        presses
    };
    for ten in ["library-0", "library-4"] {
        let bench = Bench::with_ten(ten, standing());
        let recording = bench.record(&with_more(&["--warming", "2"]));
        let (heard, _) = listen(&recording, &bench.exact("0.0"));
        let (felt, ghosts) = (bench.felt(&heard), bench.ghosts(&heard, 0.0));
        println!("{ten}, 2 microstrain a second: {felt:.3} felt, {ghosts} ghosts");
        hold(felt > 0.99 && ghosts == 0, ten);
    }
    let mut taps = in_turn(3.0, 0.5, 0.12, &places, 8.0);
    for (k, press) in taps.iter_mut().enumerate() {
        press.ramp_ms = [2.0, 5.0, 10.0][k % 3];
    }
    let bench = Bench::with_ten("library-4", taps);
    let quiet = ["--rate", "1000", "--bits", "24", "--noise", "0.1"];
    let recording = bench.record(&[&quiet[..], &["--workshop", "exact"]].concat());
    let (heard, _) = listen(&recording, &bench.exact("0.0"));
    let (unfelt, ghosts) = (bench.unfelt(&heard), bench.ghosts(&heard, 3.0));
    println!("taps: {unfelt:?} not felt, {ghosts} ghosts");
    hold(unfelt.is_empty() && ghosts == 0, "all felt and no ghosts");
}

/// The bundled limb is kind to us too, thin and held at both ends. On a solid a standing touch wandered away with the drift, or
/// was lost; and a quarter of all second fingers were searched for in the wrong place, where readings change fast near a gauge.
#[test]
fn a_solid_does_so_too_and_two_fingers_on_it_are_two() {
    let places = places_on("barrel", 20);
    let mut presses = vec![Press::new(3.0, 120.0, places[3], 1.0)];
    presses.extend(in_turn(126.0, 2.0, 1.0, &places[..4], 1.5));
    let apart = |k: &usize| places[*k].distance(places[(*k + 7) % 20]) >= 25.0;
    for (pair, k) in (0..20).filter(apart).enumerate() {
        let start = 136.0 + 2.2 * pair as f64;
        let force = |of: usize| 8.0 + 12.0 * (0.37 * of as f64).fract();
        presses.push(Press::new(start, 1.1, places[k], force(k)));
        presses.push(Press::new(
            start + 0.1,
            1.0,
            places[(k + 7) % 20],
            force(k + 7),
        ));
    }
    let bench = Bench::on_bundled("barrel", presses);
    let recording = bench.record(&with_more(&["--warming", "2"]));
    let (heard, _) = listen(&recording, &bench.exact("0.0"));
    let single = Bench::on_bundled("barrel", bench.presses[..5].to_vec());
    let (felt, ghosts) = (single.felt(&heard), bench.ghosts(&heard, 0.0));
    let live = heard.iter().filter(|h| h.time_s > 3.0);
    let gauges = live.map(|h| h.channels_ok).min();
    let standing = Bench::on_bundled("barrel", bench.presses[..1].to_vec());
    let (off, _) = standing.off(&heard);
    println!("barrel: {felt:.3} felt, {ghosts} ghosts, {off:.2} mm off, {gauges:?} gauges");
    hold(
        felt > 0.99 && ghosts == 0 && off < 4.0 && gauges == Some(10),
        "felt, 4 mm, ten gauges and no ghosts",
    );
    let (mut two, mut all) = (0, 0);
    for pair in bench.presses[5..].chunks(2) {
        let full = pair[1].full_s().start + 0.1..pair[0].full_s().end;
        for h in heard.iter().filter(|h| full.contains(&h.time_s)) {
            all += 1;
            two += i32::from(h.touches.len() == 2);
        }
    }
    let share = f64::from(two) / f64::from(all);
    println!("barrel: {share:.3} of {all} are two");
    hold(share > 0.97, "two in 97 %");
}

#[test]
fn mains_hum_is_no_touch() {
    let bench = Bench::of(in_turn(12.0, 2.0, 1.0, &places(6), 8.0));
    for hum in ["5@50.03", "20@49.95", "20@60.02"] {
        let recording = bench.record(&with_more(&["--hum", hum]));
        let (heard, _) = listen(&recording, &bench.exact("0.0"));
        let (felt, ghosts) = (bench.felt(&heard), bench.ghosts(&heard, 0.0));
        println!("{hum}: {felt:.3} felt, {ghosts} ghosts");
        hold(felt > 0.99 && ghosts == 0, "felt and no ghosts");
        std::fs::remove_file(recording).unwrap();
    }
}

#[test]
fn a_palm_is_an_area() {
    let mut presses = in_turn(3.0, 2.0, 1.2, &places(20), 25.0);
    for press in &mut presses {
        press.radius_mm = 30.0;
    }
    let bench = Bench::of(presses);
    let (heard, _) = listen(&bench.record(&BOARD), &bench.exact("0.0"));
    let is_area = |h: &Heard| h.kind.as_deref() == Some("area");
    let all = bench.full(&heard).count() as f64;
    let areas: Vec<_> = bench.full(&heard).filter(|(_, h)| is_area(h)).collect();
    let share = areas.len() as f64 / all;
    let wrong = |(press, h): &(&Press, &Heard)| (press.force - h.touches[0].1).abs();
    let wrong = areas.iter().map(wrong).sum::<f64>() / areas.len() as f64;
    println!("{share:.3} are areas, their forces {wrong:.2} N off");
    hold(share > 0.75 && wrong < 1.5, "areas");
}

/// Of exact gauges and touches that press straight the map is all that is off: a finer one finds them nearer.
#[test]
fn a_finer_map_finds_touches_nearer() {
    let bench = Bench::of(in_turn(3.0, 1.5, 0.6, &places(12), 10.0));
    let recording = bench.record_at("standard", &BOARD);
    let project = bench.project(&[
        ("place_mm", "0.0"),
        ("angle_deg", "0.0"),
        ("gain_percent", "0.0"),
        ("friction_percent", "0.0"),
        ("model_error", "0.03"),
    ]);
    let found = ["draft", "reference"].map(|quality| {
        let (heard, _) = listen_with(&recording, &project, &["--quality", quality]);
        let mut off: Vec<f64> = (bench.full(&heard))
            .filter_map(|(press, h)| Some(h.touches.first()?.0.distance(press.place)))
            .collect();
        off.sort_by(f64::total_cmp);
        // At the edge of a window a tip has nothing under its other half: a few places are off by that on any map.
        let median = off[off.len() / 2];
        println!(
            "{quality}: {median:.2} mm, on the mean {:.2}",
            bench.off(&heard).0
        );
        assert!(bench.felt(&heard) > 0.99);
        median
    });
    let [draft, reference] = found;
    hold(reference < 0.35 && reference < 0.6 * draft, "0.35 mm");
}

/// Regressions that are trained on touches of the model find the place where they are asked for; how many touch, matching says
/// in any case.
#[test]
fn the_estimator_that_is_asked_for_finds_the_place() {
    let bench = Bench::of(in_turn(3.0, 1.5, 0.6, &places(8), 10.0));
    let recording = bench.record(&BOARD);
    let project = bench.exact("0.0");
    let found = ["matching", "svr", "normalized"].map(|estimator| {
        let more = ["--quality", "draft", "--estimator", estimator];
        let (heard, _) = listen_with(&recording, &project, &more);
        let off: Vec<f64> = (bench.full(&heard))
            .filter_map(|(press, h)| Some(h.place?.distance(press.place)))
            .collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let by_matching = bench.off(&heard).0;
        println!("{estimator}: {mean:.2} mm, matching beside it {by_matching:.2} mm");
        assert!(bench.felt(&heard) > 0.99 && off.len() == bench.full(&heard).count());
        [mean, by_matching]
    });
    let [matching, svr, normalized] = found;
    hold(
        matching[0] == matching[1] && matching[0] < 1.0,
        "1 mm by matching",
    );
    for [mean, by_matching] in [svr, normalized] {
        assert!(by_matching == matching[1], "{found:?}");
        hold(
            mean > matching[0] && mean < 12.0,
            "matching before regressions",
        );
    }
    assert!(svr[0] != normalized[0], "{found:?}");
}

/// Twelve presses by hand: places are told up to 1 mm off along every axis (1 mm rms in all), forces up to 5 % (3 % rms), and
/// the finger pushes 6° aside. Also the bench on which they were made, and what was found.
fn pressed_by_hand(seed: u64) -> (Bench, PathBuf) {
    let mut presses = in_turn(3.0, 1.6, 1.1, &places(12), 10.0);
    for (k, press) in presses.iter_mut().enumerate() {
        (press.tilt_deg, press.towards_deg) = (6.0, f64::from(101 * k as u32 % 360));
    }
    let known = Bench::of(presses).of_workshop(seed);
    let recording = known.record(&WORKSHOP_BOARD);
    let told = known.at("told.csv");
    std::fs::write(&told, known.script(1.0)).unwrap();
    let found = known.at("found.hapdef.toml");
    hapdef(&[
        "calibrate",
        "--project",
        text(&known.project(&[])),
        "--recording",
        text(&recording),
        "--presses",
        text(&told),
        "--quality",
        "draft",
        "--out",
        text(&found),
    ]);
    (known, found)
}

/// As many workshops as `HAPDEF_HANDS` says.
#[test]
fn twelve_presses_by_hand_are_enough_even_with_everything_at_once() {
    let told = std::env::var("HAPDEF_HANDS").map(|n| n.parse().expect("a number"));
    for workshop in 0..told.unwrap_or(1) {
        by_hand(4 + workshop);
    }
}

const WORKSHOP_BOARD: [&str; 4] = ["--rate", "200", "--bits", "16"];

fn by_hand(seed: u64) {
    let (known, found) = pressed_by_hand(seed);
    let others = Bench::of(in_turn(3.0, 1.2, 0.8, &places(31), 8.0)).of_workshop(seed);
    let recording = others.record(&WORKSHOP_BOARD);
    let (before, _) = listen(&recording, &known.project(&[]));
    let (before, (off, held)) = (others.off(&before).0, {
        let (heard, _) = listen(&recording, &found);
        others.off(&heard)
    });
    println!("workshop {seed}, by hand: {before:.2} mm before, {off:.2} after, {held:.2} held");
    // One workshop is held to it; of many the table says how they do.
    let hold = |holds: bool, what: &str| match seed {
        4 => hold(holds, what),
        _ if !holds => println!("workshop {seed} does not hold {what}"),
        _ => {}
    };
    hold(
        off < 0.8 && off < 0.5 * before && held > 0.8,
        "0.8 mm by hand",
    );
    std::fs::remove_file(recording).unwrap();

    let mut presses = others.presses;
    for (k, press) in presses.iter_mut().enumerate() {
        press.ramp_ms = [5.0, 20.0, 80.0][k % 3];
        (press.tilt_deg, press.towards_deg) = (15.0, f64::from(47 * k as u32 % 360));
    }
    let all = Bench::of(presses).of_workshop(seed);
    let disturbed = [
        "--hum",
        "5@50.03",
        "--warming",
        "0.5",
        "--creep",
        "1",
        "--crosstalk",
        "0.5",
    ];
    let recording = all.record(&[&WORKSHOP_BOARD[..], &disturbed].concat());
    let (heard, _) = listen(&recording, &found);
    let (felt, (off, held), ghosts) = (all.felt(&heard), all.off(&heard), all.ghosts(&heard, 0.0));
    println!(
        "everything at once: {felt:.3} felt, {off:.2} mm off, {held:.2} held, {ghosts} ghosts"
    );
    hold(
        felt > 0.98 && off < 1.0 && held > 0.65 && ghosts == 0,
        "1 mm with everything at once",
    );
}

//! A touch whose model lacks something stands; another comes to it.

use std::sync::Arc;

use super::*;
use crate::inference::plate::{CHANNELS, gauged_plate, read_touches};
use crate::inference::{ReadingErrors, ResponseMap};

const FIRST: (usize, f64) = (370, 12.0);
const SECOND: (usize, f64) = (612, 9.0);

/// What the model lacks of the first at each gauge, over what it reads in the mean.
fn lacking(map: &ResponseMap, force: f64) -> Vec<f64> {
    let alone = read_touches(map, &[(FIRST.0, force)]);
    let root = (alone.iter().map(|x| x * x).sum::<f64>() / CHANNELS as f64).sqrt();
    let off = |c: usize| 0.06 * root * (2.3 * c as f64 + 0.7).sin();
    (0..CHANNELS).map(off).collect()
}

/// A reading of some touches, with what the model lacks of the first where that is as hard as this (N).
fn read(map: &ResponseMap, touches: &[(usize, f64)], force: f64) -> Vec<f64> {
    let all = read_touches(map, touches);
    let pairs = all.iter().zip(lacking(map, force));
    pairs.map(|(x, off)| x + off).collect()
}

struct Bench {
    matching: Matching,
    several: Several,
    before: TouchesBefore,
}

impl Bench {
    /// On which the first touch stands.
    fn pressed() -> Self {
        let map = Arc::new(gauged_plate());
        let errors = ReadingErrors {
            relative: 0.05,
            ..ReadingErrors::of_noise(0.5e-6, CHANNELS)
        };
        let mut matching = Matching::new(map, errors, 60.0);
        let several = Several::new(&matching);
        let reading = read(&matching.map, &[FIRST], FIRST.1);
        let one = SeveralTouches::one(matching.find(&reading), 1.0);
        let before = matching.before(&one, &reading).unwrap();
        Self {
            matching,
            several,
            before,
        }
    }

    fn seen(&mut self, reading: &[f64]) -> (SeveralTouches, Option<TouchesBeside>) {
        let one = self.matching.find(reading);
        let before = [&self.before];
        (self.matching).count_after(&self.several, reading, &one, &before)
    }

    /// How far the nearest touch is from a node (m), and how far its force is from that (N).
    fn off(&self, seen: &SeveralTouches, (node, force): (usize, f64)) -> (f64, f64) {
        let place = self.matching.map.places[node];
        let away = |c: &&Contact| c.position.distance(place);
        let nearest = (seen.contacts.iter()).min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map_or((1.0, 60.0), |c| (away(&c), (c.force - force).abs()))
    }
}

#[test]
fn another_that_comes_is_told_by_itself() {
    let mut bench = Bench::pressed();
    let reading = read(&bench.matching.map, &[FIRST, SECOND], FIRST.1);
    let (seen, beside) = bench.seen(&reading);
    assert_eq!(seen.count(), Some(2), "{seen:?}");
    assert!(beside.is_some() && seen.probability > 0.95, "{seen:?}");
    let one = bench.matching.find(&reading);
    let anew = bench.matching.count(&bench.several, &reading, &one);
    let [here, there] = [&seen, &anew].map(|seen| bench.off(seen, SECOND));
    let said = format!("{here:?} {there:?} {seen:?} {anew:?}");
    assert!(here.0 < 1.5e-3 && here.1 < 0.6, "{said}");
    assert!(here.0 < 0.5 * there.0, "{said}");
}

#[test]
fn those_that_were_there_may_press_otherwise_meanwhile() {
    let mut bench = Bench::pressed();
    for times in [0.6, 1.5] {
        let first = (FIRST.0, times * FIRST.1);
        let reading = read(&bench.matching.map, &[first, SECOND], first.1);
        let (seen, _) = bench.seen(&reading);
        let offs = [first, SECOND].map(|touch| bench.off(&seen, touch));
        let said = format!("{times} {offs:?} {seen:?}");
        assert_eq!(seen.count(), Some(2), "{said}");
        let near = |(far, force): &(f64, f64)| *far < 2.5e-3 && *force < 1.0;
        assert!(offs.iter().all(near), "{said}");
    }
}

#[test]
fn one_that_moves_or_presses_harder_is_one() {
    let mut bench = Bench::pressed();
    for (node, force) in [
        (FIRST.0, 20.0),
        (FIRST.0, 4.0),
        (FIRST.0 + 1, 12.0),
        (FIRST.0 + 62, 13.0),
        (FIRST.0 + 6, 12.0),
        (FIRST.0 + 150, 15.0),
    ] {
        let reading = read(&bench.matching.map, &[(node, force)], force);
        let (seen, _) = bench.seen(&reading);
        let said = format!("{node} {force} {seen:?}");
        assert_eq!(seen.count(), Some(1), "{said}");
    }
}

#[test]
fn a_third_comes_to_two_and_all_are_followed() {
    let mut bench = Bench::pressed();
    let third = (772, 9.0);
    let two = read(&bench.matching.map, &[FIRST, SECOND], FIRST.1);
    let (seen, beside) = bench.seen(&two);
    let before = bench.matching.before(&seen, &two).unwrap();
    let three = read(&bench.matching.map, &[FIRST, SECOND, third], FIRST.1);
    let one = bench.matching.find(&three);
    let all = [beside.as_ref().unwrap().before(), &before];
    let (seen, beside) = (bench.matching).count_after(&bench.several, &three, &one, &all);
    assert_eq!(seen.count(), Some(3), "{seen:?}");
    assert!(bench.off(&seen, third).0 < 2e-3, "{seen:?}");
    // It goes three millimetres aside, and becomes harder.
    let mut beside = beside.unwrap();
    let mut told = seen;
    for force in [9.5, 10.0, 10.5] {
        let moved = [FIRST, SECOND, (third.0 + 1, force)];
        let reading = read(&bench.matching.map, &moved, FIRST.1);
        let last = SeveralTouches {
            unexplained: 100.0,
            ..told
        };
        told = (bench.matching)
            .track_beside(&reading, &mut beside, &last)
            .unwrap();
        let off = bench.off(&told, moved[2]);
        assert!(off.0 < 2e-3 && off.1 < 0.7, "{force} {off:?} {told:?}");
    }
}

#[test]
fn what_is_no_few_points_is_nothing_that_another_comes_to() {
    let bench = Bench::pressed();
    let one = SeveralTouches::one(bench.before.contacts[0], 1.0);
    let reading = bench.before.reading.clone();
    let before = |touches: &SeveralTouches| bench.matching.before(touches, &reading);
    assert!(before(&one).is_some());
    let area = SeveralTouches {
        kind: TouchKind::Area(0.01),
        ..one.clone()
    };
    let three = SeveralTouches {
        contacts: vec![one.contacts[0]; 3],
        ..one
    };
    assert!([area, three].iter().all(|t| before(t).is_none()));
}

#[test]
fn where_the_first_may_be_elsewhere_too_its_region_holds_that() {
    let mut bench = Bench::pressed();
    let reading = read(&bench.matching.map, &[FIRST, SECOND], FIRST.1);
    let (_, beside) = bench.seen(&reading);
    let spots = beside.unwrap().spots;
    let matching = &bench.matching;
    let sizes = Some(bench.before.sizes(&reading, 1.0));
    let observed = Observation::sized(&reading, sizes, &matching.errors, &matching.used);
    let known = Some(&bench.before.known);
    let best = matching
        .joined_with(&observed, known, &spots, None)
        .unwrap();
    let mut other = best.clone();
    let place = matching.map.mesh.point(best.spots[0].at);
    let away = place + 12e-3 * DVec3::X;
    other.spots[0].at = matching.map.mesh.index().nearest(away).0;
    let region = |answers: &[Joint]| {
        let found = matching.touches_beside(&observed, &bench.before, answers, 0.0);
        let first = found.contacts.iter().find(|c| c.position == place);
        first.unwrap().region
    };
    assert!(!region(std::slice::from_ref(&best)).holds(place, away));
    assert!(region(&[best, other]).holds(place, away));
}

//! How many touches there are: two fingers, three, a palm, on gauges that are glued a little off.

use std::sync::Arc;

use glam::DVec3;
use hapdef::elasticity::Touch;
use hapdef::inference::{Matching, ReadingErrors, Several, SeveralTouches, TouchKind};
use hapdef::mesh::sample::even;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drift::{CALM, Press, run};
use crate::inference::{lab, normal, touches};

const NOISE: f64 = 1e-6;
/// What readings are off by, over themselves: of model and gains.
const OFF: f64 = 0.02;

fn estimator() -> (Matching, Several) {
    let sensing = &lab().sensing;
    let errors = ReadingErrors {
        relative: OFF,
        ..ReadingErrors::of_noise(NOISE, sensing.gauges.len())
    };
    let matching = Matching::new(Arc::clone(&sensing.drawn.map), errors, 60.0);
    let several = Several::new(&matching);
    (matching, several)
}

/// What is read of some touches together.
fn read(touches: &[Touch], rng: &mut ChaCha8Rng) -> Vec<f64> {
    let sensing = &lab().sensing;
    let mut sum = vec![0.0; sensing.gauges.len()];
    for touch in touches {
        for (s, x) in sum.iter_mut().zip(sensing.sensitivity.read(touch)) {
            *s += x;
        }
    }
    let mean = sum.iter().map(|x| x * x).sum::<f64>() / sum.len() as f64;
    for x in &mut sum {
        *x += NOISE * normal(rng) + OFF * f64::midpoint(*x * *x, mean).sqrt() * normal(rng);
    }
    sum
}

fn count(matching: &mut Matching, several: &Several, reading: &[f64]) -> SeveralTouches {
    let one = matching.find(reading);
    matching.count(several, reading, &one)
}

/// So many sets of touches that are so far apart (m), with forces between.
fn sets(of: usize, many: usize, apart: f64, forces: [f64; 2], seed: u64) -> Vec<Vec<Touch>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let all = touches(300, 21, 1.0);
    let mut sets = Vec::new();
    while sets.len() < many {
        let mut set: Vec<Touch> = Vec::new();
        while set.len() < of {
            let touch = all[rng.random_range(0..all.len())];
            let force = forces[0] + (forces[1] - forces[0]) * rng.random::<f64>();
            if set
                .iter()
                .all(|t| t.position.distance(touch.position) > apart)
            {
                set.push(Touch { force, ..touch });
            }
        }
        sets.push(set);
    }
    sets
}

/// Mean distance (mm) and difference of force (N) of touches that were found, each to another of those that are.
fn off(found: &SeveralTouches, real: &[Touch]) -> (f64, f64) {
    let away = |p: DVec3, t: &Touch| p.distance(t.position) * 1e3;
    let orders: Vec<Vec<usize>> = match real.len() {
        2 => vec![vec![0, 1], vec![1, 0]],
        _ => vec![vec![0]],
    };
    let of_order = |order: &Vec<usize>| {
        let pairs = || order.iter().zip(&found.contacts);
        let count = real.len() as f64;
        let far: f64 = pairs().map(|(&k, c)| away(c.position, &real[k])).sum();
        let force: f64 = pairs().map(|(&k, c)| (c.force - real[k].force).abs()).sum();
        (far / count, force / count)
    };
    let all = orders.iter().map(of_order);
    all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

#[test]
fn two_fingers_are_two_touches() {
    let (mut matching, several) = estimator();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut right, mut far, mut force) = (0, 0.0, 0.0);
    let sets = sets(2, 200, 25e-3, [5.0, 30.0], 7);
    for set in &sets {
        let found = count(&mut matching, &several, &read(set, &mut rng));
        if found.kind == TouchKind::Points && found.contacts.len() == 2 {
            let (mm, n) = off(&found, set);
            right += 1;
            far += mm;
            force += n;
        } else {
            println!(
                "{:?} {:?} of {:?}",
                found.kind,
                found.count(),
                found.probability
            );
        }
    }
    let count = f64::from(right);
    println!(
        "{right} of {}, {:.2} mm, {:.2} N",
        sets.len(),
        far / count,
        force / count
    );
    assert!(right >= 190 && far / count < 2.0 && force / count < 1.0);
}

#[test]
fn one_finger_is_one_touch() {
    let (mut matching, several) = estimator();
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut more = 0;
    let sets = sets(1, 1000, 0.0, [1.0, 30.0], 8);
    for set in &sets {
        let found = count(&mut matching, &several, &read(set, &mut rng));
        if found.count() != Some(1) || found.kind != TouchKind::Points {
            println!(
                "{:?} {:?} {} at {} N",
                found.kind,
                found.count(),
                found.probability,
                set[0].force
            );
            more += 1;
        }
    }
    println!("{more} of {}", sets.len());
    assert!(more <= 10);
}

/// Three are told where they are far apart, and never taken for a palm.
#[test]
fn three_fingers_are_more_than_one() {
    let (mut matching, several) = estimator();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let (mut right, mut fewer, mut one) = (0, 0, 0);
    let sets = sets(3, 60, 35e-3, [10.0, 30.0], 10);
    for set in &sets {
        let found = count(&mut matching, &several, &read(set, &mut rng));
        right += usize::from(found.count() == Some(3));
        fewer += usize::from(found.count() == Some(2));
        one += usize::from(found.count() == Some(1));
    }
    println!(
        "{right} of {} are three, {fewer} two, {one} one",
        sets.len()
    );
    assert!(right >= 30 && one <= 3);
}

/// What a palm of a radius (m) around a place reads, with a total force (N): H. Hertz's pressure, point by point, and so much
/// more on one side, over it, as there is less on the other.
fn read_palm(
    centre: DVec3,
    (radius, leans): (f64, f64),
    force: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<f64> {
    let mesh = &lab().sensing.drawn.map.mesh;
    let (at, _) = mesh.index().nearest(centre);
    let (centre, facing) = (mesh.point(at), mesh.normal(at));
    let side = facing.any_orthonormal_vector();
    let of = |at| {
        let off = (mesh.point(at) - centre) / radius;
        Touch {
            position: mesh.point(at),
            normal: mesh.normal(at),
            force: (1.0 - off.length_squared()).sqrt() * (1.0 + leans * off.dot(side)),
            tip_radius: 2e-3,
        }
    };
    let inside = |at| mesh.point(at).distance(centre) < radius && mesh.normal(at).dot(facing) > 0.0;
    let parts: Vec<Touch> = even(mesh, 200, 3, inside).into_iter().map(of).collect();
    let total: f64 = parts.iter().map(|t| t.force * t.normal.dot(facing)).sum();
    let parts: Vec<Touch> = (parts.into_iter())
        .map(|t| Touch {
            force: t.force * force / total,
            ..t
        })
        .collect();
    read(&parts, rng)
}

#[test]
fn a_palm_is_an_area() {
    let (mut matching, several) = estimator();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut all = Vec::new();
    for (radius, leans) in [(15e-3, 0.0), (25e-3, 0.0), (25e-3, 0.7)] {
        let (mut seen, mut points, mut far, mut off) = (0, 0, 0.0, 0.0);
        let places = touches(40, 31, 1.0);
        for touch in &places {
            let reading = read_palm(touch.position, (radius, leans), 25.0, &mut rng);
            let found = count(&mut matching, &several, &reading);
            if let (TouchKind::Area(_), [contact]) = (found.kind, &found.contacts[..]) {
                seen += 1;
                far += contact.position.distance(touch.position) * 1e3;
                off += (contact.force - 25.0).abs();
            } else {
                println!(
                    "{:?} {:?} {:.3}",
                    found.kind,
                    found.count(),
                    found.probability
                );
            }
            points += usize::from(found.count() == Some(1) && found.kind == TouchKind::Points);
        }
        let count = f64::from(seen);
        println!(
            "radius {radius}, leans {leans}: {seen} of {} are areas, {points} points; {:.2} mm, {:.2} N off",
            places.len(),
            far / count,
            off / count
        );
        // Its force is that much beside its middle, or less.
        let beside = 1e3 * radius * leans / 5.0;
        all.push((seen, points, far / count - beside, off / count));
    }
    for (seen, points, far, off) in all {
        assert!(seen >= 30 && points <= 8 && far < 3.0 && off < 1.5);
    }
}

/// A second finger comes to one that stands, and goes again.
#[test]
fn fingers_come_and_go() {
    let sets = sets(2, 12, 25e-3, [5.0, 20.0], 12);
    let (mut right, mut all, mut left, mut ghosts) = (0.0, 0.0, 0.0, 0);
    for set in &sets {
        let press = |touch: Touch, from: f64, lasts: f64| Press {
            touch,
            from,
            lasts,
            ramp: 0.08,
        };
        let presses = [press(set[0], 3.0, 6.0), press(set[1], 5.0, 2.0)];
        run(CALM, &presses, 11.0, |now, update, _| {
            let count = update
                .touches
                .as_ref()
                .map_or(Some(0), SeveralTouches::count);
            let expected = match now {
                t if (3.4..5.0).contains(&t) || (7.4..8.9).contains(&t) => 1,
                t if (5.4..6.9).contains(&t) => 2,
                t if t > 9.4 => 0,
                _ => return,
            };
            if expected == 0 {
                ghosts += usize::from(count != Some(0));
                return;
            }
            all += 1.0;
            right += f64::from(u8::from(count == Some(expected)));
            left += f64::from(u8::from(count.is_none() || count == Some(0)));
        });
    }
    println!(
        "{:.4} right, {:.4} nothing or unclear, {ghosts} ghosts",
        right / all,
        left / all
    );
    assert!(right / all > 0.95 && ghosts == 0);
}

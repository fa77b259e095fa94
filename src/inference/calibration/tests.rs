use std::sync::Arc;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::draw::normal;
use crate::inference::ResponseMap;
use crate::mesh::TriMesh;
use crate::uncertainty::{Gluing, HandPressing, Making};

const CHANNELS: usize = 5;
const NOISE: [f64; CHANNELS] = [1e-6; CHANNELS];
const FORCE: f64 = 10.0;

/// Gauges on one triangle of six centimetres: some microstrain a newton, and a few per cent of it a millimetre or a
/// degree that they are off.
fn drawn() -> AsDrawn {
    let corners = [DVec3::ZERO, DVec3::X * 0.06, DVec3::Y * 0.06];
    let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
    let mesh = Arc::new(mesh);
    let map = |size: f64, by: f64| {
        let value = |k: usize| size * (by * (k + 1) as f64).sin();
        let values = (0..6 * CHANNELS).map(value).collect();
        ResponseMap::of(Arc::clone(&mesh), CHANNELS, values)
    };
    AsDrawn {
        map: Arc::new(map(10e-6, 1.7)),
        changes: [map(1e-6, 2.3), map(0.8e-6, 0.7), map(0.5e-6, 3.1)],
        tip: None,
        axes: None,
    }
}

fn off() -> Uncertainty {
    Uncertainty {
        elements: 0.01,
        ..Uncertainty::default()
    }
}

fn somewhere(rng: &mut ChaCha8Rng) -> SurfacePoint {
    let mut share = || 0.15 + rng.random::<f64>();
    let all = [share(), share(), share()];
    let sum: f64 = all.iter().sum();
    SurfacePoint {
        triangle: 0,
        barycentric: all.map(|v| v / sum),
    }
}

/// Gauges as a workshop glues them.
fn built(gluing: &Gluing, rng: &mut ChaCha8Rng) -> Vec<AsGlued> {
    let place = gluing.place * 1e3 / 2.0_f64.sqrt();
    let gauge = |_| AsGlued {
        gain: 1.0 + gluing.gain * normal(rng),
        along_mm: place * normal(rng),
        across_mm: place * normal(rng),
        turned_degrees: gluing.angle.to_degrees() * normal(rng),
    };
    (0..CHANNELS).map(gauge).collect()
}

/// A press of gauges as built, as it is taken to be.
fn press(real: &ResponseMap, pressing: &HandPressing, rng: &mut ChaCha8Rng) -> KnownPress {
    let at = somewhere(rng);
    let beside = pressing.place / 2.0_f64.sqrt();
    let moved = DVec3::X * (beside * normal(rng)) + DVec3::Y * (beside * normal(rng));
    let there = real.mesh.index().nearest(real.mesh.point(at) + moved).0;
    let force = FORCE * (1.0 + pressing.force * normal(rng));
    let noise = noise_of_mean(&NOISE)[0];
    let read = |g: f64| force * g + noise * normal(rng);
    KnownPress {
        at,
        force: FORCE,
        reading: real.at(there).into_iter().map(read).collect(),
    }
}

#[test]
fn what_is_integrated_out_is_what_would_be_solved_for() {
    let (drawn, off) = (drawn(), off());
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let real = drawn.glued(&built(&off.gluing, &mut rng));
    let known: Vec<KnownPress> = (0..3)
        .map(|_| press(&real, &off.pressing, &mut rng))
        .collect();
    let glued = [AsGlued::DRAWN; CHANNELS];
    let presses: Vec<ComparedPress> = (known.iter())
        .map(|k| ComparedPress::new(&drawn, k, &glued, &off))
        .collect();
    let least = Least {
        presses: &presses,
        noise: &NOISE,
        off: &off,
    };
    let fit = least.fit(0.0).unwrap();
    // The same with three unknowns more a press, in units of their deviations, and readings that are off each for
    // itself.
    let own = PER_GAUGE * CHANNELS + 1;
    let all = own + 3 * presses.len();
    let mut equations = DMatrix::<f64>::identity(all, all);
    for (k, sure) in least.prior().iter().enumerate() {
        equations[(k, k)] = *sure;
    }
    let mut right = DVector::<f64>::zeros(all);
    for (p, press) in presses.iter().enumerate() {
        for c in 0..CHANNELS {
            let mut row = DVector::<f64>::zeros(all);
            for (k, by) in press.unknowns(c) {
                row[k] = by / NOISE[c];
            }
            for k in 0..3 {
                row[own + 3 * p + k] = press.moved[(c, k)] / NOISE[c];
            }
            let left = (press.reading[c] - press.expected()[c]) / NOISE[c];
            equations += &row * row.transpose();
            right += row * left;
        }
    }
    let solved = equations.cholesky().unwrap().solve(&right);
    for k in 0..own {
        assert!((solved[k] - fit.found[k]).abs() < 1e-6, "{k}");
    }
}

#[test]
fn no_presses_leave_everything_as_it_was() {
    let (drawn, off) = (drawn(), off());
    let found = calibrate(&drawn, &[], &NOISE, &off);
    assert_eq!(found.glued, [AsGlued::DRAWN; CHANNELS]);
    assert!((found.relative - off.elements).abs() < 1e-6);
    let before = drawn.deviations(&off).all;
    let after = drawn.deviations_of(&found.doubts, &off).all;
    for node in 0..6 {
        for (a, b) in before.node(node).iter().zip(after.node(node)) {
            assert!((a - b).abs() < 1e-6 * a, "{a} {b}");
        }
    }
    // Nor does one that reads no numbers.
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut odd = press(&drawn.map, &off.pressing, &mut rng);
    odd.reading.fill(f64::NAN);
    assert_eq!(calibrate(&drawn, &[odd], &NOISE, &off), found);
}

#[test]
fn presses_by_hand_never_make_it_worse() {
    const WORLDS: u64 = 20;
    let (drawn, off) = (drawn(), off());
    for count in [1, 2, 4, 12] {
        let (mut before, mut after) = (0.0, 0.0);
        for seed in 0..WORLDS {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let real = drawn.glued(&built(&off.gluing, &mut rng));
            let known: Vec<KnownPress> = (0..count)
                .map(|_| press(&real, &off.pressing, &mut rng))
                .collect();
            let found = calibrate(&drawn, &known, &NOISE, &off);
            let prior = gluing_covariance(&off.gluing);
            for doubts in &found.doubts {
                for k in [0, 4, 7, 9] {
                    assert!((0.0..=1.000_001 * prior[k]).contains(&doubts[k]));
                }
            }
            let fitted = drawn.calibrated(&found);
            for _ in 0..8 {
                let at = somewhere(&mut rng);
                let truth = real.at(at);
                let apart = |map: &ResponseMap| -> f64 {
                    let pairs = map.at(at).into_iter().zip(&truth);
                    pairs.map(|(a, b)| (a - b).powi(2)).sum()
                };
                before += apart(&drawn.map);
                after += apart(&fitted);
            }
        }
        assert!(after < 1.02 * before, "{count}: {after:e} {before:e}");
        // Many of them tell a good part of it.
        assert!(count < 12 || after < 0.5 * before, "{after:e} {before:e}");
    }
}

#[test]
fn a_machine_finds_a_part_that_is_softer() {
    let drawn = drawn();
    let off = Uncertainty {
        stiffness: 0.1,
        pressing: HandPressing::EXACT,
        ..off()
    };
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let softer = [AsGlued {
        gain: 1.1,
        ..AsGlued::DRAWN
    }; CHANNELS];
    let real = drawn.glued(&softer);
    let known: Vec<KnownPress> = (0..12)
        .map(|_| press(&real, &off.pressing, &mut rng))
        .collect();
    let found = calibrate(&drawn, &known, &NOISE, &off);
    // Part of what the part is softer by may be stated as gauges that lie elsewhere: what counts is what is read.
    let gain = found.glued.iter().map(|g| g.gain).sum::<f64>() / CHANNELS as f64;
    assert!((gain - 1.1).abs() < 0.03, "{:?}", found.glued);
    let fitted = drawn.calibrated(&found);
    let apart = |map: &ResponseMap, at| -> f64 {
        let pairs = map.at(at).into_iter().zip(real.at(at));
        pairs.map(|(a, b)| (a - b).powi(2)).sum()
    };
    let places: Vec<_> = (0..8).map(|_| somewhere(&mut rng)).collect();
    let [before, after] =
        [&drawn.map, &fitted].map(|map| places.iter().map(|&at| apart(map, at)).sum::<f64>());
    assert!(after < 0.1 * before, "{after:e} {before:e}");
}

#[test]
fn what_all_gauges_feel_of_a_tip_is_not_taken_for_gluing() {
    const WORLDS: u64 = 20;
    let tip = 1e-3;
    let larger = drawn().changes.into_iter().nth(1).unwrap();
    // A metre of the tip's radius, in strain: a few per cent of a reading for a millimetre.
    let rise: Vec<Vec<(usize, f64)>> = (0..CHANNELS).map(|c| vec![(c, 2.0 / tip)]).collect();
    let drawn = AsDrawn {
        tip: Some(Arc::new(larger.mixed(&rise))),
        ..drawn()
    };
    let stated = Uncertainty {
        making: Making {
            tip,
            ..Making::EXACT
        },
        pressing: HandPressing::EXACT,
        ..off()
    };
    let unstated = Uncertainty {
        making: Making::EXACT,
        ..stated
    };
    let mut apart = [0.0; 2];
    for seed in 0..WORLDS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let real = drawn.glued(&built(&stated.gluing, &mut rng));
        let mut known = Vec::new();
        for _ in 0..12 {
            let mut press = press(&real, &stated.pressing, &mut rng);
            let off = tip * normal(&mut rng) * FORCE;
            let felt = drawn.tip.as_ref().unwrap().at(press.at);
            for (x, felt) in press.reading.iter_mut().zip(felt) {
                *x += off * felt;
            }
            known.push(press);
        }
        for (apart, off) in apart.iter_mut().zip([&stated, &unstated]) {
            let fitted = drawn.calibrated(&calibrate(&drawn, &known, &NOISE, off));
            for node in 0..6 {
                let pairs = fitted.node(node).iter().zip(real.node(node));
                *apart += pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            }
        }
    }
    assert!(apart[0] < 0.8 * apart[1], "{apart:?}");
}

/// The factor that all gauges share is found as well as it says; and gauges that no workshop glues so are less likely than those that were
/// pressed.
#[test]
fn presses_speak_for_the_part_that_was_pressed() {
    let drawn = drawn();
    let off = Uncertainty {
        stiffness: 0.5,
        pressing: HandPressing::EXACT,
        ..off()
    };
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let built: Vec<AsGlued> = (built(&off.gluing, &mut rng).into_iter())
        .map(|of| of.times(1.3))
        .collect();
    let real = drawn.glued(&built);
    let known: Vec<KnownPress> = (0..12)
        .map(|_| press(&real, &off.pressing, &mut rng))
        .collect();
    let right = part::of_part(&drawn, &known, &NOISE, &off).unwrap();
    let [factor, deviation] = right.factor;
    assert!(
        deviation < 0.1 && (factor - 1.3).abs() < 3.0 * deviation,
        "{right:?}"
    );
    let channels: Vec<Vec<(usize, f64)>> = (0..CHANNELS)
        .map(|c| vec![(c, if c % 2 == 0 { 1.5 } else { 0.7 })])
        .collect();
    let wrong = part::of_part(&drawn.mixed(&channels), &known, &NOISE, &off).unwrap();
    assert!(right.evidence > wrong.evidence + 3.0, "{right:?} {wrong:?}");
}

/// A gauge that was dead while somebody pressed stays as it was drawn, with all doubt, and takes nothing from the others.
#[test]
fn a_channel_that_was_not_read_learns_nothing() {
    let (drawn, off) = (drawn(), off());
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let real = drawn.glued(&built(&off.gluing, &mut rng));
    let mut known: Vec<KnownPress> = (0..12)
        .map(|_| press(&real, &off.pressing, &mut rng))
        .collect();
    let all = calibrate(&drawn, &known, &NOISE, &off);
    for k in &mut known {
        k.reading[1] = f64::NAN;
    }
    let found = calibrate(&drawn, &known, &NOISE, &off);
    assert_eq!(found.touches, 12);
    let of = found.glued[1];
    let moved = (of.along_mm).hypot(of.across_mm).hypot(of.turned_degrees);
    assert!((of.gain - 1.0).abs() < 0.02 && moved < 0.02);
    let prior = gluing_covariance(&off.gluing);
    assert!((found.doubts[1][0] / prior[0] - 1.0).abs() < 0.05);
    for c in (0..CHANNELS).filter(|c| *c != 1) {
        let doubt = found.doubts[c][0].sqrt();
        assert!(
            (found.glued[c].gain - all.glued[c].gain).abs() < 2.0 * doubt,
            "{c}"
        );
        assert!(found.doubts[c][0] < 1.5 * all.doubts[c][0], "{c}");
    }
}

use nalgebra::SMatrix;

use super::*;
use crate::budget::unwatched;
use crate::dataset::SignalMatrix;
use crate::placement::expected_error::{
    Detail, NUISANCES, SceneForces, SharedUnknowns, SignalKnowledge, certify,
};

const SIDE: usize = 9;
const SITES: usize = 5;

/// Five sites that feel touches on a plane of 64 mm, a force along it as `felt` says, and a drift.
fn scene(felt: f64, nuisances: [Option<f64>; NUISANCES], drift: f64) -> TouchScene {
    let at = |t: usize| [(t % SIDE) as f64 * 8.0, (t / SIDE) as f64 * 8.0, 0.0];
    let targets: Vec<[f64; 3]> = (0..SIDE * SIDE).map(at).collect();
    let near = |site: usize, [x, y, _]: [f64; 3]| {
        let (a, b) = ((19 * site % 64) as f64, (37 * site % 64) as f64);
        8.0 * (-((x - a).powi(2) + (y - b).powi(2)) / 900.0).exp()
    };
    let values = (0..SITES).flat_map(|site| targets.iter().map(move |&at| near(site, at)));
    let x = SignalMatrix::new(targets.len(), values.collect());
    let forces = vec![1.0; targets.len()];
    let pushed = |site: usize, touch: usize| {
        let [x, y, _] = at(touch);
        let way = 0.11 * (x + y) + 1.7 * site as f64;
        [0.0, felt * way.sin(), felt * way.cos()]
    };
    let shared = SharedUnknowns {
        felt: &pushed,
        nuisances,
        drift,
    };
    let known = SignalKnowledge {
        noise: 1.0,
        variance: None,
        shared: Some(&shared),
        density: None,
        among: None,
        forces: Some(SceneForces {
            touches: &forces,
            coming: [3.0, 12.0],
            possible: 20.0,
        }),
        seed: 3,
    };
    let detail = Detail {
        places: 60,
        presses: 30,
    };
    TouchScene::new(&x, &targets, &known, detail, &unwatched).unwrap()
}

/// What a site reads of a press as the gauge of a turn.
fn reading(scene: &TouchScene, (site, turn): (usize, usize), press: usize, force: f64) -> f64 {
    let report = scene.at_presses.of(site);
    let (row, variance) = row(scene, &report, press, force);
    let made = |k: usize| row[PLAIN + k] * f64::from(scene.made()[k * scene.presses.len() + press]);
    let made: f64 = (0..scene.unknowns.len()).map(made).sum();
    let off = made + f64::from(scene.draws(turn)[press]);
    force * f64::from(report.value[press]) + variance.sqrt() * off
}

/// How far off the linear estimator of the bank's own prior is at a press (mm²), where the unknowns really have other
/// variances: C (Σ r rᵀ + P⁻¹ S P⁻¹) C, with C = (P⁻¹ + Σ r rᵀ)⁻¹.
fn by_algebra(scene: &TouchScene, level: usize, press: usize) -> [f64; 3] {
    let known = prior(scene, &scene.around[press]);
    let used = PLAIN + scene.unknowns.len();
    let invert = |v: f64| if v > 0.0 { v.powi(-2) } else { 0.0 };
    let before = SMatrix::<f64, MOST, MOST>::from_diagonal(&known.map(invert));
    let mut really = known;
    for (k, unknown) in scene.unknowns.iter().enumerate() {
        really[PLAIN + k] *= unknown.made();
    }
    let really = SMatrix::<f64, MOST, MOST>::from_diagonal(&really.component_mul(&really));
    let mut read = SMatrix::<f64, MOST, MOST>::zeros();
    for site in 0..SITES {
        let report = scene.at_presses.of(site);
        let (r, _) = row(scene, &report, press, scene.levels[level].force);
        read += r * r.transpose();
    }
    let mut information = before + read;
    for k in used..MOST {
        information[(k, k)] = 1.0;
    }
    let covariance = information.try_inverse().unwrap();
    let off = covariance * (read + before * really * before) * covariance;
    [off[(0, 0)], off[(0, 1)], off[(1, 1)]]
}

#[test]
fn whoever_allows_for_more_than_comes_is_as_far_off_as_algebra_says() {
    for made in [None, Some(0.0), Some(0.4), Some(1.0)] {
        let scene = scene(2.0, [None, made, made], 3.0);
        let bank = Bank::of(&scene, &[0, 1, 2, 3, 4]);
        for (level, of) in scene.levels.iter().enumerate() {
            for press in of.presses.clone() {
                let off = bank.truth.off_by(&scene, press);
                let wanted = by_algebra(&scene, level, press);
                for (a, b) in off.iter().zip(wanted) {
                    let size = wanted[0] + wanted[2];
                    assert!((a - b).abs() < 1e-6 * size, "{made:?} {off:?} {wanted:?}");
                }
            }
        }
    }
}

#[test]
fn what_all_share_hides_less_than_what_each_has_for_itself() {
    let set = [0, 1, 2, 3, 4];
    let error = |scene: &TouchScene| Bank::of(scene, &set).error();
    let [without, drifting] = [0.0, 6.0].map(|drift| error(&scene(0.0, [None; NUISANCES], drift)));
    // Of each for itself: as if readings were in units of as much more noise.
    let mut alone = scene(0.0, [None; NUISANCES], 0.0);
    for reports in [&mut alone.at_places, &mut alone.at_presses] {
        for site in 0..SITES {
            let row = reports.of_mut(site);
            let count = row.len() / 4;
            for value in &mut row[..3 * count] {
                *value /= 1.0_f32.hypot(6.0);
            }
        }
    }
    let alone = error(&alone);
    assert!(
        without < drifting && drifting < 0.8 * alone,
        "{without} {drifting} {alone}"
    );
}

#[test]
fn no_three_of_five_gauges_are_better_than_the_bound() {
    for made in [0.0, 0.4, 1.0] {
        let scene = scene(2.0, [Some(made), Some(made), Some(made)], 3.0);
        let certificate = certify(&scene, &[0, 1, 2, 3, 4], &[], &[0, 1, 2], &unwatched);
        let certificate = certificate.unwrap().unwrap();
        let all = (0..SITES).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| [a, b, c])));
        let best = all
            .map(|set| Bank::of(&scene, &set).local())
            .fold(f64::INFINITY, f64::min);
        let own = Bank::of(&scene, &[0, 1, 2]).local();
        assert!(
            certificate.bound_mm <= best && best <= own,
            "{made} {certificate:?} {best}"
        );
        assert!((certificate.local_mm - own).abs() < 1e-12);
        // It is near, where no more is allowed for than comes.
        assert!(
            made < 1.0 || certificate.bound_mm > 0.6 * best,
            "{certificate:?} {best}"
        );
    }
}

#[test]
fn what_places_think_in_lanes_is_what_one_filter_thinks() {
    for nuisances in [
        [None; NUISANCES],
        [None, Some(0.5), Some(0.5)],
        [Some(1.0); NUISANCES],
    ] {
        for drift in [0.0, 3.0] {
            let scene = scene(2.0, nuisances, drift);
            let set = [0, 1, 2, 3, 4];
            let bank = Bank::of(&scene, &set);
            let unknowns = PLAIN + scene.unknowns.len();
            let press = scene.levels[0].presses.start;
            let force = scene.levels[0].force;
            let mut looked_at = 0;
            for (k, place) in scene.places.iter().enumerate() {
                let known = &bank.presses[press];
                // What stands for the press itself, or is too unlikely, is not looked at.
                let open = known.blocks.contains(&((k / LANES) as u32));
                if known.costs.as_flattened()[k] > 1e20 || !open {
                    continue;
                }
                looked_at += 1;
                let mut one = Single::at_rest(&scene, place);
                for (turn, &site) in set.iter().enumerate() {
                    let reading = reading(&scene, (site, turn), press, force);
                    let here = scene.at_places.of(site);
                    one.correct(&scene, (&here, k), (force, reading));
                }
                let off =
                    |a: f32, b: f64, size: f64| (f64::from(a) - b).abs() < 2e-2 * size.max(1.0);
                assert!(
                    off(known.costs.as_flattened()[k], one.cost, one.cost.abs()),
                    "{} {}",
                    known.costs.as_flattened()[k],
                    one.cost
                );
                for i in 0..PLAIN + scene.unknowns.len() {
                    let thought = known.estimates[k / LANES * unknowns + i][k % LANES];
                    let size = one.estimate.abs().max();
                    assert!(
                        off(thought, one.estimate[i], size),
                        "{i}: {thought} {}",
                        one.estimate[i]
                    );
                }
            }
            assert!(looked_at > 5, "{looked_at}");
        }
    }
}

#[test]
fn a_gauge_tried_is_the_gauge_added() {
    let scene = scene(2.0, [Some(1.0), Some(0.5), Some(0.5)], 3.0);
    for site in 0..SITES {
        let set: Vec<usize> = (0..SITES).filter(|s| *s != site).collect();
        let mut bank = Bank::of(&scene, &set);
        let tried = bank.with(&[site], &mut bank.rows())[0];
        bank.add(site);
        let added = bank.error();
        assert!((tried / added - 1.0).abs() < 1e-3, "{tried} {added}");
    }
}

#[test]
fn presses_side_by_side_are_what_one_filter_says() {
    for made in [None, Some(0.4)] {
        let scene = scene(2.0, [None, made, made], 3.0);
        let set = [3, 0, 4, 1];
        let bank = Bank::of(&scene, &set);
        let mut read = SiteReading::default();
        bank.truth.read(&scene, (2, set.len()), &mut read);
        for level in &scene.levels {
            for press in level.presses.clone() {
                let around = &scene.around[press];
                let place = ScenePlace {
                    position: scene.presses[press].position,
                    reach: around.reach,
                    mass: around.own_mass,
                };
                let mut one = Single::at_rest(&scene, &place);
                let tell = |one: &mut Single, turn: usize, site: usize| {
                    let reading = reading(&scene, (site, turn), press, level.force);
                    let there = scene.at_presses.of(site);
                    one.correct(&scene, (&there, press), (level.force, reading));
                    reading
                };
                for (turn, &site) in set.iter().enumerate() {
                    tell(&mut one, turn, site);
                }
                assert!((bank.truth.cost(press) - one.cost).abs() < 1e-9 * one.cost.abs().max(1.0));
                let found = tell(&mut one, set.len(), 2);
                let near = |a: f32, b: f64| (f64::from(a) - b).abs() < 1e-6 * b.abs().max(1.0);
                assert!(near(read.readings[press], found), "{found}");
                assert!(near(read.costs[press], one.cost), "{}", one.cost);
                let mut off = [(0, 0), (0, 1), (1, 1)].map(|at| one.covariance[at]);
                for (k, unknown) in scene.unknowns.iter().enumerate() {
                    let less = 1.0 - unknown.made().powi(2);
                    let [a, b] = [0, 1].map(|i| one.covariance[(i, PLAIN + k)]);
                    for (off, by) in off.iter_mut().zip([a * a, a * b, b * b]) {
                        *off -= less * by;
                    }
                }
                let length = mean_length(off[0], off[1], off[2]);
                assert!(
                    (read.lengths[press] / length - 1.0).abs() < 1e-9,
                    "{length}"
                );
            }
        }
    }
}

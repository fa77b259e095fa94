//! What the choice by expected error promises is what matching then does.

use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::design::{self, Inputs, Sensing, Simulated};
use hapdef::inference::{Errors, Matching};
use hapdef::mesh::sample;
use hapdef::placement::SelectorKind;
use hapdef::project::ChosenSite;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// Mean error (mm) of matching, with gauges of a set glued anew for every touch, and noise.
fn matched(inputs: &Inputs, sensing: &Sensing, force: f64, touches: usize) -> f64 {
    let project = &inputs.project;
    let (gluing, noise) = (project.gluing(), project.gauge.noise_microstrain * 1e-6);
    let drawn = &sensing.drawn;
    let errors = Errors {
        spread: Some(Arc::clone(&sensing.spread)),
        ..Errors::of_noise(noise, sensing.gauges.len())
    };
    let mut matching = Matching::new(Arc::clone(&drawn.map), errors, 60.0);
    let mut rng = ChaCha8Rng::seed_from_u64(force.to_bits());
    let places = sample::random(&drawn.map.mesh, touches, 17, |_| true);
    let mut sum = 0.0;
    for &at in &places {
        let glued: Vec<[f64; 4]> = (0..sensing.gauges.len())
            .map(|_| {
                let place = gluing.place * 1e3 / 2f64.sqrt();
                [
                    1.0 + gluing.gain * normal(&mut rng),
                    place * normal(&mut rng),
                    place * normal(&mut rng),
                    gluing.angle.to_degrees() * normal(&mut rng),
                ]
            })
            .collect();
        let map = drawn.map.at(at);
        let changes = drawn.changes.each_ref().map(|m| m.at(at));
        let reading: Vec<f64> = (0..glued.len())
            .map(|c| {
                let [gain, s, t, turn] = glued[c];
                let x = gain * map[c] + s * changes[0][c] + t * changes[1][c] + turn * changes[2][c];
                force * x + noise * normal(&mut rng)
            })
            .collect();
        let found = matching.find(&reading);
        sum += found.position.distance(drawn.map.mesh.point(at)) * 1e3;
    }
    sum / places.len() as f64
}

/// The project with these sites (as numbered in the dataset) as its gauges, that read at a point.
fn with_gauges(inputs: &Inputs, simulated: &Simulated, set: &[usize]) -> Inputs {
    let mut inputs = inputs.clone();
    let chosen = |&s: &usize| {
        let site = &simulated.dataset.sites[s];
        ChosenSite {
            position_mm: (site.position * 1e3).to_array(),
            direction: site.direction.to_array(),
        }
    };
    inputs.project.selection.sites = set.iter().map(chosen).collect();
    inputs.project.gauge.grid_length_mm = 0.01;
    inputs.project.gauge.grid_width_mm = 0.01;
    inputs
}

fn budget() -> Budget {
    if std::env::var("STD").is_ok() { Quality::Standard.budget() } else { Quality::Draft.budget() }
}

#[test]
fn what_is_promised_is_what_matching_does() {
    let mut inputs = hapdef::cli::bundled().unwrap().inputs;
    inputs.project.selection.sites.clear();
    inputs.project.touch.edge_margin_mm = 0.0;
    let simulated = design::simulate(&inputs, &budget(), &unwatched).unwrap();
    let feasibility = design::filter(&inputs, &simulated);
    let reduced =
        design::reduce_sites(&inputs, &simulated, &feasibility, &budget(), &unwatched).unwrap();
    let selection = design::select(
        &inputs,
        &simulated,
        &reduced,
        SelectorKind::ExpectedError,
        &budget(),
        &unwatched,
    )
    .unwrap();
    for set in &selection.sets {
        println!("{} {:.3?} {:?}", set.sites.len(), set.criterion, set.sites);
    }
    println!("{:?}", selection.achieved.notes);
    let feasible = feasibility.sites();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut random = |n: usize| -> Vec<usize> {
        (0..n).map(|_| feasible[rng.random_range(0..feasible.len())]).collect()
    };
    // All near one place: bad.
    let centre = simulated.dataset.sites[feasible[0]].position;
    let away = |s: &usize| simulated.dataset.sites[*s].position.distance(centre);
    let mut near = feasible.clone();
    near.sort_by(|a, b| away(a).total_cmp(&away(b)));
    let sets = [
        ("chosen, 10", selection.sets[9].sites.clone()),
        ("chosen, 5", selection.sets[4].sites.clone()),
        ("random, 10", random(10)),
        ("random, 10", random(10)),
        ("random, 6", random(6)),
        ("beside each other, 10", near.iter().step_by(6).take(10).copied().collect()),
    ];
    let _ = DVec3::ZERO;
    let lists: Vec<Vec<usize>> = sets.iter().map(|s| s.1.clone()).collect();
    for force in [3.0, 10.0, 25.0] {
        inputs.project.touch.forces_n = [force, force];
        let promised =
            design::expected_errors(&inputs, &simulated, &lists, &unwatched).unwrap();
        for ((name, set), promised) in sets.iter().zip(promised) {
            let glued = with_gauges(&inputs, &simulated, set);
            let sensing = design::sense(&glued, &budget(), &unwatched).unwrap();
            let done = matched(&inputs, &sensing, force, 400);
            println!("{force} N, {name}: promised {promised:.2} mm, done {done:.2} mm, ratio {:.2}", promised / done);
        }
    }
}

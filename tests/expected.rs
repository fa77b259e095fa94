//! What the choice by expected error promises is what matching then does.

use std::sync::Arc;

use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::design::{self, Inputs, Sensing, Simulated};
use hapdef::inference::{Errors, Matching};
use hapdef::mesh::sample;
use hapdef::placement::SelectorKind;
use hapdef::project::ChosenSite;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// That matching is tried on, a force and set.
const TOUCHES: usize = 700;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// Mean error (mm) of matching, with gauges of a set glued anew for every touch, noise, and a share of the readings that
/// the elements leave.
fn matched(inputs: &Inputs, sensing: &Sensing, share: f64, force: f64, touches: usize) -> f64 {
    let project = &inputs.project;
    let (gluing, noise) = (project.gluing(), project.gauge.noise_microstrain * 1e-6);
    let drawn = &sensing.drawn;
    let errors = Errors {
        relative: share,
        spread: Some(Arc::clone(&sensing.spread)),
        ..Errors::of_noise(noise, sensing.gauges.len())
    };
    let mut matching = Matching::new(Arc::clone(&drawn.map), errors, 60.0);
    let mut rng = ChaCha8Rng::seed_from_u64(force.to_bits());
    let places = sample::random(
        &drawn.map.mesh,
        touches,
        force.to_bits() ^ sensing.gauges.len() as u64,
        |_| true,
    );
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
        let clean: Vec<f64> = (0..glued.len())
            .map(|c| {
                let [gain, s, t, turn] = glued[c];
                let moved = s * changes[0][c] + t * changes[1][c] + turn * changes[2][c];
                force * (gain * map[c] + moved)
            })
            .collect();
        let reading: Vec<f64> = (clean.iter())
            .map(|x| x * (1.0 + share * normal(&mut rng)) + noise * normal(&mut rng))
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
    Quality::Draft.budget()
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
    println!("{:?}", selection.achieved.notes);
    // More gauges are never worse.
    for pair in selection.sets.windows(2) {
        assert!(pair[1].criterion < pair[0].criterion, "{pair:?}");
    }
    let feasible = feasibility.sites();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut random = |n: usize| -> Vec<usize> {
        (0..n)
            .map(|_| feasible[rng.random_range(0..feasible.len())])
            .collect()
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
        (
            "beside each other, 10",
            near.iter().step_by(6).take(10).copied().collect(),
        ),
    ];
    let share = simulated.discretization.strain_percent / 100.0;
    let lists: Vec<Vec<usize>> = sets.iter().map(|s| s.1.clone()).collect();
    let sensing: Vec<Sensing> = (lists.iter())
        .map(|set| {
            let glued = with_gauges(&inputs, &simulated, set);
            design::sense(&glued, &budget(), &unwatched).unwrap()
        })
        .collect();
    for force in [3.0, 10.0, 25.0] {
        inputs.project.touch.forces_n = [force, force];
        let promised = design::expected_errors(&inputs, &simulated, &lists, &unwatched).unwrap();
        let mut ratios = Vec::new();
        let mut done = Vec::new();
        for (((name, _), promised), sensing) in sets.iter().zip(&promised).zip(&sensing) {
            done.push(matched(&inputs, sensing, share, force, TOUCHES));
            ratios.push(promised / done[done.len() - 1]);
            println!(
                "{force} N, {name}: promised {promised:.2} mm, done {:.2} mm, ratio {:.2}",
                done[done.len() - 1],
                ratios[ratios.len() - 1]
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

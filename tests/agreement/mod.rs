//! What the choice by expected error promises, and what matching then does: sets of gauges good, bad and random, on the
//! bundled limb at Draft. For the test and for the figures of `RESULTS.md`.
#![allow(dead_code, reason = "test and benchmark use their own part of it")]

use std::sync::Arc;

use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::design::{self, Inputs, Sensing, Simulated};
use hapdef::inference::{Matching, ReadingErrors};
use hapdef::mesh::{SurfacePoint, sample};
use hapdef::placement::{Selection, SelectorKind};
use hapdef::project::ChosenSite;
use hapdef::regression::folds::evenly;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const FORCES_N: [f64; 3] = [3.0, 10.0, 25.0];

fn budget() -> Budget {
    Quality::Draft.budget()
}

/// Standard normal.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(rand_distr::StandardNormal)
}

/// A set of gauges, as sites of the dataset.
pub struct Set {
    pub name: &'static str,
    pub sites: Vec<usize>,
}

/// Where matching is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touched {
    /// So many places at random, which no choice and no promise has seen.
    HeldOut(usize),
    /// Where the presses are that the promise is made of, at most so many.
    AsPromised(usize),
}

/// The limb, and the sets that are compared on it.
pub struct Trial {
    inputs: Inputs,
    simulated: Simulated,
    pub selection: Selection,
    pub sets: Vec<Set>,
    sensing: Vec<Sensing>,
}

impl Trial {
    /// With the chosen sets of ten and five, so many random ones of ten and of six, and one of gauges beside each
    /// other.
    pub fn new(random: [usize; 2]) -> Self {
        let mut inputs = hapdef::cli::bundled().unwrap().inputs;
        inputs.project.selection.sites.clear();
        inputs.project.touch.edge_margin_mm = 0.0;
        // Touches press straight in, and the choice and matching both know it.
        inputs.project.live.friction_percent = 0.0;
        let simulated = design::simulate(&inputs, &budget(), &unwatched).unwrap();
        let feasibility = design::filter(&inputs, &simulated);
        let reduced = design::reduce_sites(&inputs, &simulated, &feasibility, &budget()).unwrap();
        let kind = SelectorKind::ExpectedError;
        let selection = design::Choosing {
            inputs: &inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget: &budget(),
            watch: &unwatched,
        }
        .select(kind)
        .unwrap();
        let sets = sets(&simulated, &feasibility.sites(), &selection, random);
        let sensing = (sets.iter())
            .map(|set| {
                let glued = with_gauges(&inputs, &simulated, &set.sites);
                design::sensing(&glued, &budget(), &unwatched).unwrap()
            })
            .collect();
        Self {
            inputs,
            simulated,
            selection,
            sets,
            sensing,
        }
    }

    /// Expected errors (mm) of all sets under touches of a force (N), each the mean over some draws of the noise.
    pub fn promised(&self, force: f64, draws: u64) -> Vec<f64> {
        let mut inputs = self.inputs.clone();
        inputs.project.touch.forces_n = [force, force];
        let sites: Vec<Vec<usize>> = self.sets.iter().map(|s| s.sites.clone()).collect();
        let mut means = vec![0.0; sites.len()];
        for draw in 0..draws {
            // Nothing but the noise is drawn anew: the simulation stays.
            inputs.project.budget.seed = self.inputs.project.budget.seed + draw;
            let errors =
                design::expected_errors(&inputs, &self.simulated, &sites, &unwatched).unwrap();
            for (mean, error) in means.iter_mut().zip(errors) {
                *mean += error / draws as f64;
            }
        }
        means
    }

    /// Mean errors (mm) of matching for all sets under touches of a force (N).
    pub fn done(&self, force: f64, touched: Touched) -> Vec<f64> {
        (self.sensing.iter())
            .map(|sensing| self.matched(sensing, force, touched))
            .collect()
    }

    fn places(&self, sensing: &Sensing, force: f64, touched: Touched) -> Vec<SurfacePoint> {
        let map = &sensing.drawn.map;
        match touched {
            Touched::HeldOut(count) => {
                let seed = force.to_bits() ^ sensing.gauges.len() as u64;
                sample::random(&map.mesh, count, seed, |_| true)
            }
            Touched::AsPromised(count) => {
                let dataset = &self.simulated.dataset;
                let all = dataset.slopes.as_ref().unwrap().columns().touches();
                (evenly(all.len(), count).into_iter())
                    .map(|k| map.mesh.index().nearest(dataset.touches[all[k]].position).0)
                    .collect()
            }
        }
    }

    /// Of one set: gauges glued anew for every touch, what the elements leave, which is as if they were glued off, and noise.
    fn matched(&self, sensing: &Sensing, force: f64, touched: Touched) -> f64 {
        let project = &self.inputs.project;
        let noise = project.gauge.noise_microstrain * 1e-6;
        let left = &self.simulated.discretization;
        let length_scale = self.simulated.length_scale;
        let off =
            (project.uncertainty()).with_elements_of_gauges(left.reading_percent, length_scale);
        let gluing = off.of_gauges();
        let drawn = &sensing.drawn;
        let errors = ReadingErrors {
            relative: left.strain_percent / 100.0,
            deviations: Some(sensing.deviations.clone()),
            ..ReadingErrors::of_noise(noise, sensing.gauges.len())
        };
        let mut matching = Matching::new(Arc::clone(&drawn.map), errors, 60.0);
        let mut rng = ChaCha8Rng::seed_from_u64(force.to_bits());
        let places = self.places(sensing, force, touched);
        let mut sum = 0.0;
        for &at in &places {
            let map = drawn.map.at(at);
            let changes = drawn.changes.each_ref().map(|m| m.at(at));
            let reading: Vec<f64> = (0..map.len())
                .map(|c| {
                    let gain = 1.0 + gluing.gain * normal(&mut rng);
                    let place = gluing.place * 1e3 / 2f64.sqrt();
                    let moved = place * normal(&mut rng) * changes[0][c]
                        + place * normal(&mut rng) * changes[1][c]
                        + gluing.angle.to_degrees() * normal(&mut rng) * changes[2][c];
                    force * (gain * map[c] + moved) + noise * normal(&mut rng)
                })
                .collect();
            let found = matching.find(&reading);
            sum += found.position.distance(drawn.map.mesh.point(at)) * 1e3;
        }
        sum / places.len() as f64
    }
}

fn sets(
    simulated: &Simulated,
    feasible: &[usize],
    selection: &Selection,
    random: [usize; 2],
) -> Vec<Set> {
    let chosen = |count: usize| selection.set(count).unwrap().sites.clone();
    let mut sets = vec![
        Set {
            name: "chosen, 10",
            sites: chosen(10),
        },
        Set {
            name: "chosen, 5",
            sites: chosen(5),
        },
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for (name, gauges, count) in [("random, 10", 10, random[0]), ("random, 6", 6, random[1])] {
        for _ in 0..count {
            let site = |_| feasible[rng.random_range(0..feasible.len())];
            let sites = (0..gauges).map(site).collect();
            sets.push(Set { name, sites });
        }
    }
    // All near one place: bad.
    let centre = simulated.dataset.sites[feasible[0]].gauge.position;
    let away = |s: &usize| simulated.dataset.sites[*s].gauge.position.distance(centre);
    let mut near = feasible.to_vec();
    near.sort_by(|a, b| away(a).total_cmp(&away(b)));
    sets.push(Set {
        name: "beside each other, 10",
        sites: near.iter().step_by(6).take(10).copied().collect(),
    });
    sets
}

/// The project with these sites (as numbered in the dataset) as its gauges, that read at a point.
fn with_gauges(inputs: &Inputs, simulated: &Simulated, set: &[usize]) -> Inputs {
    let mut inputs = inputs.clone();
    let chosen = |&s: &usize| {
        let site = &simulated.dataset.sites[s];
        ChosenSite {
            position_mm: (site.gauge.position * 1e3).to_array(),
            direction: site.gauge.direction.to_array(),
        }
    };
    inputs.project.selection.sites = set.iter().map(chosen).collect();
    inputs.project.gauge.grid_length_mm = 0.01;
    inputs.project.gauge.grid_width_mm = 0.01;
    inputs
}

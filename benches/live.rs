//! Live touch: what the three estimators reach on a simulated board, beside the paper and the bound.
use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::dataset::SignalMatrix;
use hapdef::design::{self, Workshop};
use hapdef::inference::*;
use hapdef::regression::Hyper;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use std::time::Instant;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}
fn main() {
    let loaded = hapdef::cli::bundled().unwrap();
    let quality = if std::env::args().any(|a| a == "draft") {
        Quality::Draft
    } else {
        Quality::Standard
    };
    let t = Instant::now();
    let sensing = design::sense(&loaded.inputs, &quality.budget(), &unwatched).unwrap();
    println!(
        "sense {:?} elements {:.2} mm, map nodes {}",
        t.elapsed(),
        sensing.element_mm,
        sensing.drawn.map.mesh.edges().len() + sensing.drawn.map.mesh.positions().len()
    );
    let t = Instant::now();
    let (truth, _) = sensing.truth(Workshop::Exact, 1, &unwatched).unwrap();
    let (all, gains) = sensing.truth(Workshop::All, 1, &unwatched).unwrap();
    println!(
        "truth {:?} vertices {} {}",
        t.elapsed(),
        truth.mesh.positions().len(),
        sensing.sensitivity.mesh.positions().len()
    );
    let noise = 1e-6;
    let m = sensing.gauges.len();
    let touches: Vec<_> = sensing
        .touches(&loaded.inputs, 800, 0xabcd, false)
        .unwrap()
        .into_iter()
        .filter(|t| t.position.z > 12e-3 && t.position.z < 108e-3)
        .take(400)
        .collect();
    // sizes
    let g: Vec<f64> = touches
        .iter()
        .map(|t| {
            let mut t = *t;
            t.force = 1.0;
            sensing
                .sensitivity
                .read(&t)
                .iter()
                .map(|v| v.abs())
                .fold(0.0, f64::max)
                * 1e6
        })
        .collect();
    let mut s = g.clone();
    s.sort_by(f64::total_cmp);
    println!(
        "largest channel, microstrain/N: median {:.1} 5% {:.1} max {:.1}",
        s[200], s[20], s[399]
    );
    // interpolation error
    let mut worst: Vec<f64> = touches
        .iter()
        .map(|t| {
            let mut u = *t;
            u.force = 1.0;
            let a = sensing.sensitivity.read(&u);
            let b = sensing
                .drawn
                .map
                .at(sensing.drawn.map.index.nearest(t.position).0);
            let d: f64 = a
                .iter()
                .zip(&b)
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>()
                .sqrt();
            d / a.iter().map(|a| a * a).sum::<f64>().sqrt()
        })
        .collect();
    worst.sort_by(f64::total_cmp);
    println!(
        "interpolation: median {:.4} 95% {:.4} max {:.4}",
        worst[200], worst[380], worst[399]
    );
    // truth departure
    let mut off: Vec<f64> = touches
        .iter()
        .map(|t| {
            let a = sensing.sensitivity.read(t);
            let b = truth.read(t);
            let d: f64 = a
                .iter()
                .zip(&b)
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>()
                .sqrt();
            d / a.iter().map(|a| a * a).sum::<f64>().sqrt()
        })
        .collect();
    off.sort_by(f64::total_cmp);
    println!(
        "finer truth: median {:.4} 95% {:.4} max {:.4}",
        off[200], off[380], off[399]
    );
    // training
    let lessons = sensing.touches(&loaded.inputs, 3200, 3, true).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let forces: Vec<f64> = lessons
        .iter()
        .map(|_| 0.5 + 33.8 * rng.random::<f64>())
        .collect();
    let mut values = vec![0.0; m * lessons.len()];
    for (t, (touch, f)) in lessons.iter().zip(&forces).enumerate() {
        let mut u = *touch;
        u.force = *f;
        for (c, v) in sensing.sensitivity.read(&u).into_iter().enumerate() {
            values[c * lessons.len() + t] = v;
        }
    }
    let x = SignalMatrix::new(lessons.len(), values);
    let places: Vec<[f64; 3]> = lessons
        .iter()
        .map(|t| (t.position * 1e3).to_array())
        .collect();
    let used = vec![true; m];
    let l = Lessons {
        x: &x,
        places_mm: &places,
        forces: &forces,
        used: &used,
        noise,
        jitter: 0.0,
        seed: 5,
    };
    let t = Instant::now();
    let hyper = Hyper {
        c: 200.0,
        epsilon: 0.1,
        gamma: 0.3,
    };
    let raw = Trained::train(Features::Raw, &l, &hyper);
    println!("raw {:?} sv {}", t.elapsed(), raw.support_vectors());
    let t = Instant::now();
    let jit = Trained::train(Features::Normalized, &Lessons { jitter: 0.03, ..l }, &hyper);
    println!("normalized {:?} sv {}", t.elapsed(), jit.support_vectors());
    let known_at: Vec<_> = sensing.touches(&loaded.inputs, 40, 77, true).unwrap();
    let calibrated = |what: &hapdef::elasticity::sensitivity::Sensitivity, gain: bool, n: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let step = known_at.len() / n;
        let known: Vec<Known> = known_at
            .iter()
            .step_by(step)
            .take(n)
            .map(|t| {
                let mut u = *t;
                u.force = 10.0;
                let reading = what
                    .read(&u)
                    .iter()
                    .enumerate()
                    .map(|(c, v)| {
                        v * if gain { gains[c] } else { 1.0 } + 0.1 * noise * normal(&mut rng)
                    })
                    .collect();
                Known {
                    at: sensing.drawn.map.index.nearest(t.position).0,
                    force: 10.0,
                    reading,
                }
            })
            .collect();
        let c = calibrate(&sensing.drawn, &known, &vec![noise; m]);
        println!(
            "{n} known: relative {:.4} first {:?} true gain {:.3}",
            c.relative, c.glued[0], gains[0]
        );
        c
    };
    let runs: Vec<(
        String,
        Arc<ResponseMap>,
        &hapdef::elasticity::sensitivity::Sensitivity,
        bool,
        f64,
    )> = {
        let drawn = &sensing.drawn.map;
        let mut runs = vec![
            (
                "same".to_string(),
                Arc::clone(drawn),
                &*sensing.sensitivity,
                false,
                0.001,
            ),
            ("finer".into(), Arc::clone(drawn), &truth, false, 0.03),
            ("workshop".into(), Arc::clone(drawn), &all, true, 0.2),
        ];
        for (name, what, gain, n) in [
            ("finer cal", &truth, false, 10),
            ("gain cal", &truth, true, 10),
            ("work cal", &all, true, 5),
            ("work cal", &all, true, 10),
            ("work cal", &all, true, 20),
            ("work cal", &all, true, 40),
        ] {
            let c = calibrated(what, gain, n);
            runs.push((
                format!("{name} {n}"),
                Arc::new(sensing.drawn.calibrated(&c)),
                what,
                gain,
                c.relative,
            ));
        }
        runs
    };
    for (name, map, what, gain, rel) in runs {
        for (low, high) in [(2.0, 4.9), (19.6, 34.3)] {
            let mut rng = ChaCha8Rng::seed_from_u64(7);
            let mut matching = Matching::new(
                Arc::clone(&map),
                Errors {
                    noise: vec![noise; m],
                    relative: rel,
                },
                60.0,
            );
            let mut e = [vec![], vec![], vec![]];
            let mut fe = [vec![], vec![], vec![]];
            let (mut held, mut ratio, mut cost) = (0, vec![], vec![]);
            let mut bounds = vec![];
            let mut spent = std::time::Duration::ZERO;
            let mut spent_svr = std::time::Duration::ZERO;
            for t in &touches {
                let f = low + (high - low) * rng.random::<f64>();
                let mut u = *t;
                u.force = f;
                let clean = what.read(&u);
                let b = cramer_rao(
                    &sensing.drawn.map,
                    sensing.drawn.map.index.nearest(t.position).0,
                    f,
                    &vec![noise; m],
                )
                .0;
                let mut sq = 0.0;
                let reps = 4;
                for r in 0..reps {
                    let x: Vec<f64> = clean
                        .iter()
                        .enumerate()
                        .map(|(c, v)| {
                            v * if gain { gains[c] } else { 1.0 } + noise * normal(&mut rng)
                        })
                        .collect();
                    let now = Instant::now();
                    let c = matching.find(&x);
                    spent += now.elapsed();
                    let d = c.position.distance(t.position);
                    sq += d * d;
                    if r == 0 {
                        let mut push = |k: usize, p: DVec3, force: f64| {
                            e[k].push(p.distance(t.position) * 1e3);
                            fe[k].push((force - f).abs());
                        };
                        push(2, c.position, c.force);
                        let now = Instant::now();
                        let (p, ff) = raw.find(&x);
                        let (q, qq) = jit.find(&x);
                        spent_svr += now.elapsed();
                        push(0, DVec3::from_array(p) * 1e-3, ff);
                        push(1, DVec3::from_array(q) * 1e-3, qq);
                        held += usize::from(c.region.holds(c.position, t.position));
                        cost.push(c.unexplained);
                    }
                }
                ratio.push((sq / f64::from(reps)).sqrt() / b);
                bounds.push(b * 1e3);
            }
            let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            let med = |v: &[f64]| {
                let mut s = v.to_vec();
                s.sort_by(f64::total_cmp);
                s[s.len() / 2]
            };
            println!(
                "{name:>9} {rel:.3} {low:>4}-{high:<4} raw {:.2} N {:.2} | norm {:.2} N {:.2} | match {:.2} (med {:.2}) N {:.2} | bound {:.2}/{:.2} ratio med {:.2} held {:.1}% unexpl {:.1} {:.0} us svr {:.1} us",
                mean(&e[0]),
                mean(&fe[0]),
                mean(&e[1]),
                mean(&fe[1]),
                mean(&e[2]),
                med(&e[2]),
                mean(&fe[2]),
                mean(&bounds),
                med(&bounds),
                med(&ratio),
                100.0 * held as f64 / touches.len() as f64,
                med(&cost),
                spent.as_secs_f64() * 1e6 / (4.0 * touches.len() as f64),
                spent_svr.as_secs_f64() * 0.5e6 / touches.len() as f64
            );
        }
    }
}

//! Remakes `RESULTS.md`: `cargo bench --bench results`. With a word as argument (`draft`) it runs only the
//! Draft designs and prints without writing.

#[path = "../tests/bench/mod.rs"]
mod bench;

use std::fmt::Write as _;

use hapdef::budget::{Quality, unwatched};
use hapdef::dataset::{self, Signal};
use hapdef::design::{self, Design, Inputs};
use hapdef::elasticity::ShellModel;
use hapdef::elasticity::load::Touch;
use hapdef::elasticity::support::held_freedoms;
use hapdef::mesh::TriMesh;
use hapdef::mesh::refine::refine;
use hapdef::placement::SelectorKind;

fn main() {
    let draft_only = std::env::args().any(|a| a == "draft");
    let mut text = String::from(
        "# Results\n\nRemade by `cargo bench --bench results` (about 15 minutes on two cores); the build times by `benches/build-times.sh`. \
Times are processor seconds of the whole process, on a shared and noisy machine: compare them with the reference line, not with a stopwatch. \
Data: the bundled limb (`hapdef limb`), seed 0. Truth: a model of half the element size, touches drawn uniformly at random off its nodes, never seen in training or selection.\n\n",
    );
    let reference = reference_seconds();
    let _ = writeln!(
        text,
        "Reference: a 4000 × 4000 matrix product on one core took {reference:.1} s beside these runs.\n"
    );
    limb(&mut text);
    shell(&mut text);
    let qualities: &[Quality] = if draft_only {
        &[Quality::Draft]
    } else {
        &[Quality::Draft, Quality::Standard]
    };
    let mut designs = Vec::new();
    for &quality in qualities {
        for signal in [Signal::Displacement, Signal::Strain] {
            eprintln!("designing: {} on {}", quality.name(), signal.name());
            designs.push((quality, signal, run(quality, signal)));
        }
    }
    errors(&mut text, &designs);
    reduction(&mut text, &designs);
    times(&mut text, &designs, reference);
    if let Ok(build) = std::fs::read_to_string("benches/build-times.txt") {
        let _ = writeln!(text, "## Build times\n\n{build}");
    }
    println!("{text}");
    if !draft_only {
        std::fs::write("RESULTS.md", text).expect("RESULTS.md can be written");
    }
}

/// Processor seconds of this process so far.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .collect();
    let ticks = |k: usize| {
        fields
            .get(k)
            .and_then(|f| f.parse::<f64>().ok())
            .unwrap_or(0.0)
    };
    (ticks(11) + ticks(12)) / 100.0
}

fn reference_seconds() -> f64 {
    let a = faer::Mat::<f64>::from_fn(4000, 4000, |i, j| ((i * 7 + j * 3) % 11) as f64);
    let before = cpu_seconds();
    let b = &a * &a;
    assert!(b[(3, 4)] > 0.0);
    cpu_seconds() - before
}

fn inputs(signal: Signal) -> Inputs {
    let mut inputs = hapdef::cli::bundled()
        .expect("the bundled limb loads")
        .inputs;
    inputs.project.gauge.signal = signal;
    inputs
}

fn run(quality: Quality, signal: Signal) -> Design {
    design::run(
        &inputs(signal),
        &SelectorKind::ALL,
        &quality.budget(),
        &cpu_seconds,
        &unwatched,
    )
    .expect("the bundled limb designs")
}

fn limb(text: &mut String) {
    let inputs = inputs(Signal::Strain);
    let part = &inputs.part;
    let sites = design::lay_out_sites(part, &inputs.project).expect("sites fit");
    let touches = touches(part, &inputs, 1000);
    let coarse = solve(part, &inputs, &touches);
    let fine = refine(part);
    let finer = solve(&fine, &inputs, &touches);
    let mut forces: Vec<f64> = coarse.0.iter().map(|u| 10.0 * 2e-3 / u).collect();
    forces.sort_by(f64::total_cmp);
    let at = |q: f64| forces[(q * (forces.len() - 1) as f64) as usize];
    let mut stiffness: Vec<f64> = coarse
        .0
        .iter()
        .zip(&finer.0)
        .map(|(c, f)| f / c - 1.0)
        .collect();
    stiffness.sort_by(f64::total_cmp);
    let (mut apart, mut size, mut cosines) = (0.0, 0.0, Vec::new());
    for t in 0..touches.len() {
        let column = |x: &dataset::SignalMatrix| -> Vec<f64> {
            (0..x.rows()).map(|r| x.row(r)[t]).collect()
        };
        let (a, b) = (column(&coarse.1), column(&finer.1));
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        apart += a.iter().zip(&b).map(|(x, y)| (x - y).powi(2)).sum::<f64>();
        size += dot(&b, &b);
        cosines.push(dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt());
    }
    cosines.sort_by(f64::total_cmp);
    let quiet = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched)
        .expect("the limb simulates");
    let filters = design::filter(&inputs, &quiet);
    let taken = filters.taken();
    let paper = sites.len() - taken[0].1 - taken[1].1;
    let _ = writeln!(
        text,
        "## The bundled limb\n\n| what | here | reference (`limb.md`) |\n|---|---|---|"
    );
    let _ = writeln!(
        text,
        "| vertices at h = 2.5 mm | {} | 2724 |",
        part.positions().len()
    );
    let _ = writeln!(
        text,
        "| area of the material | {:.0} mm² | about 13 360 mm² |",
        part.area() * 1e6
    );
    let _ = writeln!(text, "| inside sites at 2.1 mm | {} | 3039 |", sites.len());
    let _ = writeln!(
        text,
        "| after support clearance and centre of mass | {paper} | 2097 |"
    );
    let _ = writeln!(
        text,
        "| feasible after the gauge's own filters (footprint, flatness, noise, range) | {} | – (paper: 2162) |",
        filters.sites().len()
    );
    let _ = writeln!(
        text,
        "| force at 2 mm depth, z 12–108, 5 / 50 / 95 % | {:.0} / {:.0} / {:.0} N | 16 / 23 / 53 N |",
        at(0.05),
        at(0.5),
        at(0.95)
    );
    let _ = writeln!(
        text,
        "| stiffness, h 2.5 against 1.25, median | {:+.1} % | +1.7 % |",
        100.0 * stiffness[stiffness.len() / 2]
    );
    let _ = writeln!(
        text,
        "| strain, h 2.5 against 1.25, rms of the field | {:.1} % | 4.9 % |",
        100.0 * (apart / size).sqrt()
    );
    let _ = writeln!(
        text,
        "| pattern cosine, median | {:.4} | 0.9988 |\n",
        cosines[cosines.len() / 2]
    );
}

fn touches(part: &TriMesh, inputs: &Inputs, count: usize) -> Vec<Touch> {
    let all = dataset::spread_touches(part, count, 77, 2.4e-3, false, inputs.project.tip());
    all.into_iter()
        .filter(|t| (0.012..=0.108).contains(&t.position.z))
        .collect()
}

/// Displacement along the normal under each touch (m), and strain at the feasible sites.
fn solve(mesh: &TriMesh, inputs: &Inputs, touches: &[Touch]) -> (Vec<f64>, dataset::SignalMatrix) {
    let held = held_freedoms(mesh, &inputs.project.supports());
    let model = ShellModel::new(mesh, inputs.project.section(), &held, &unwatched)
        .expect("the limb is held");
    let under = model
        .solve_touches(touches, &unwatched, |first, rows| {
            let width = rows.len() / (6 * mesh.positions().len());
            (first..touches.len().min(first + width))
                .map(|t| {
                    let at = model.index.nearest(touches[t].position).0;
                    let tri = mesh.triangles()[at.triangle as usize];
                    let n = touches[t].normal;
                    -(0..3)
                        .map(|k| {
                            let u = |c: usize| rows[(6 * tri[k] as usize + c) * width + t - first];
                            at.barycentric[k] * (u(0) * n.x + u(1) * n.y + u(2) * n.z)
                        })
                        .sum::<f64>()
                })
                .collect::<Vec<f64>>()
        })
        .expect("nobody cancels")
        .concat();
    let reference =
        design::simulate(inputs, &Quality::Draft.budget(), &unwatched).expect("the limb simulates");
    let feasible = design::filter(inputs, &reference).sites();
    let sites: Vec<_> = feasible
        .iter()
        .map(|&s| reference.dataset.sites[s])
        .collect();
    let x = dataset::measure(&model, touches, &sites, Signal::Strain, &unwatched)
        .expect("nobody cancels");
    (under, x)
}

fn shell(text: &mut String) {
    let _ = writeln!(
        text,
        "## The shell element\n\nComputed over reference on n × n meshes (twisted beam 6n × n), as asserted by `tests/analytic.rs`; in brackets what the same pair of elements is known to reach.\n\n| test | n: ratio |\n|---|---|"
    );
    let mut row = |name: &str, ratio: &dyn Fn(usize) -> f64, known: &[(usize, f64)]| {
        let cells: Vec<String> = known
            .iter()
            .map(|&(n, k)| format!("{n}: {:.3} ({k:.3})", ratio(n)))
            .collect();
        let _ = writeln!(text, "| {name} | {} |", cells.join(", "));
    };
    row(
        "Scordelis–Lo roof",
        &bench::ratio_roof,
        &[(4, 1.086), (8, 1.015), (16, 0.999), (32, 0.995)],
    );
    row(
        "pinched cylinder, end diaphragms",
        &bench::ratio_cylinder,
        &[(4, 0.630), (8, 0.934), (16, 1.020), (32, 1.019)],
    );
    row(
        "clamped square plate",
        &bench::ratio_plate,
        &[(4, 1.020), (8, 1.008), (16, 1.004)],
    );
    row(
        "clamped circular plate",
        &bench::ratio_disc,
        &[(4, 1.003), (8, 1.001)],
    );
    row(
        "twisted beam, first direction",
        &|n| bench::ratio_twisted(n)[0],
        &[(2, 0.995), (4, 0.997)],
    );
    row(
        "twisted beam, second direction",
        &|n| bench::ratio_twisted(n)[1],
        &[(2, 0.995), (4, 0.997)],
    );
    row(
        "Cook's membrane",
        &bench::ratio_cook,
        &[(4, 0.857), (8, 0.937), (16, 0.975)],
    );
    text.push('\n');
}

fn errors(text: &mut String, designs: &[(Quality, Signal, Design)]) {
    let _ = writeln!(
        text,
        "## Localization error on unseen touches\n\nMean / median in mm. Strain carries 1 microstrain of noise in training and test; displacement none, as in the paper. The paper's figures are for its own limb and its model's own data: below 10 mm with 5 and about 2.5 mm with 10 gauges (greedy SVR), 0.6 mm with all candidates.\n\n| quality | signal | selector | gauges | all touches | away from the boundaries | aim or paper |\n|---|---|---|---|---|---|---|"
    );
    for (quality, signal, design) in designs {
        let rows = &design.evaluation.rows;
        let mut line = |selector: &str, sensors: usize| {
            let find = |all: bool| {
                rows.iter()
                    .find(|r| {
                        r.selector == selector
                            && r.sensors == sensors
                            && (r.region == "all touches") == all
                    })
                    .map_or("–".to_owned(), |r| {
                        format!("{:.2} / {:.2}", r.error_mm, r.median_mm)
                    })
            };
            let aim: Option<(f64, &str)> = match (quality, signal, sensors) {
                (Quality::Standard, Signal::Displacement, 5) => Some((6.0, ", paper < 10")),
                (Quality::Standard, Signal::Displacement, 10) => Some((3.0, ", paper 2.5")),
                (Quality::Draft, _, 10) => Some((12.0, "")),
                _ => None,
            };
            let reached = rows
                .iter()
                .find(|r| {
                    r.selector == selector && r.sensors == sensors && r.region == "all touches"
                })
                .map_or(f64::NAN, |r| r.error_mm);
            let aim = aim.map_or(String::new(), |(aim, paper)| {
                let verdict = if reached <= aim { "met" } else { "missed" };
                format!("{aim}{paper}: {verdict}")
            });
            let _ = writeln!(
                text,
                "| {} | {} | {selector} | {sensors} | {} | {} | {aim} |",
                quality.name(),
                signal.name(),
                find(true),
                find(false)
            );
        };
        for selector in ["greedy-svr", "pca-qr"] {
            line(selector, 5);
            line(selector, 10);
        }
        line("all-candidates", design.reduced.sites.len());
    }
    text.push('\n');
}

fn reduction(text: &mut String, designs: &[(Quality, Signal, Design)]) {
    let _ = writeln!(
        text,
        "## Reduction\n\nSites for 1 % unexplained variance (linear reconstruction of all feasible sites, on held-out touches). Paper: 407 of 2162; reference for this limb: about 200 in strain, 50 in displacement.\n\n| quality | signal | feasible | kept | unexplained |\n|---|---|---|---|---|"
    );
    for (quality, signal, d) in designs {
        let share = d
            .reduced
            .candidates
            .unexplained
            .map_or("–".to_owned(), |u| format!("{:.2} %", 100.0 * u));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {share} |",
            quality.name(),
            signal.name(),
            d.reduced.feasible.len(),
            d.reduced.sites.len()
        );
    }
    text.push('\n');
}

fn times(text: &mut String, designs: &[(Quality, Signal, Design)], reference: f64) {
    let _ = writeln!(
        text,
        "## Stage times\n\nProcessor seconds; in brackets as multiples of the reference.\n\n| stage | {} |\n|---|{}|",
        designs
            .iter()
            .map(|(q, s, _)| format!("{}, {}", q.name(), s.name()))
            .collect::<Vec<_>>()
            .join(" | "),
        "---|".repeat(designs.len()).trim_end_matches('|')
    );
    let stages = &designs[0].2.seconds;
    for (k, stage) in stages.iter().enumerate() {
        let cells: Vec<String> = designs
            .iter()
            .map(|d| d.2.seconds[k].seconds)
            .map(|s| format!("{s:.1} ({:.1})", s / reference))
            .collect();
        let _ = writeln!(text, "| {} | {} |", stage.stage, cells.join(" | "));
    }
    let work: Vec<String> = designs
        .iter()
        .map(|d| d.2.work())
        .map(|w| {
            format!(
                "{} / {} / {} / {}",
                w.assemblies, w.factorizations, w.solves, w.fits
            )
        })
        .collect();
    let _ = writeln!(
        text,
        "| assemblies / factorizations / solves / fits | {} |\n",
        work.join(" | ")
    );
}

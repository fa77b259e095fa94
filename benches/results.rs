//! Designs of the bundled limb, measured: `cargo bench --bench results` writes `benches/designs.md`. With `-- draft` it runs
//! only the Draft designs and prints without writing; with `-- assemble` it only puts what all benchmarks have written
//! between the marks of `RESULTS.md`.

mod page;
mod timing;

use std::fmt::Write as _;

use glam::DVec3;

use hapdef::budget::{Quality, unwatched};
use hapdef::dataset::{self, Signal};
use hapdef::design::{self, Design, Inputs};
use hapdef::elasticity::grade::ShellGround;
use hapdef::elasticity::load::Touch;
use hapdef::evaluation::{Chooser, EVERYWHERE};
use hapdef::feasible::Filter;
use hapdef::mesh::TriMesh;
use hapdef::mesh::remesh::Remeshed;
use hapdef::placement::SelectorKind;
use timing::{cpu_seconds, reference_seconds};

/// Where the figures go.
const DESIGNS: &str = "benches/designs.md";

fn main() {
    let asked = |word: &str| std::env::args().any(|a| a == word);
    let draft_only = asked("draft");
    if !asked("assemble") {
        let text = designs(draft_only);
        println!("{text}");
        if draft_only {
            return;
        }
        std::fs::write(DESIGNS, text).expect("the figures can be written");
    }
    page::remake();
}

/// The figures of the designs.
fn designs(draft_only: bool) -> String {
    let mut text = String::from(
        "# Results\n\nRemade by `cargo bench --bench results` (about 25 minutes on two cores); the build times by `benches/build-times.sh`. \
Times are processor seconds of the whole process, on a shared and noisy machine: compare them with the reference line, not with a stopwatch. \
Data: the bundled limb (`hapdef limb`), seed 0. Truth: a model of half the element size, touches drawn uniformly at random off its nodes, never seen in training or selection.\n\n",
    );
    let reference = reference_seconds();
    let _ = writeln!(
        text,
        "Reference: a 4000 × 4000 matrix product on one core took {reference:.1} s beside these runs.\n"
    );
    limb(&mut text);
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
    curves(&mut text, &designs);
    failures(&mut text, &designs);
    reduction(&mut text, &designs);
    times(&mut text, &designs, reference);
    text
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
        &design::DesignRequest {
            inputs: &inputs(signal),
            kinds: &SelectorKind::PAPER,
            budget: &quality.budget(),
        },
        &cpu_seconds,
        &unwatched,
    )
    .expect("the bundled limb designs")
}

fn limb(text: &mut String) {
    let inputs = inputs(Signal::Strain);
    let part = &inputs.part;
    let sites = design::lay_out_sites(part, &inputs).expect("sites fit");
    let touches = touches(part, &inputs, 1000);
    // The generator's own triangles, and those halved: what the reference was measured on.
    let supports = inputs.project.supports(&inputs.masks).expect("boxes");
    let ground = ShellGround::new(part, inputs.project.section(), &supports, true);
    let given = ground.even(0);
    let coarse = solve(&ground, &given, &inputs, &touches);
    let finer = solve(&ground, &ground.halved(&given), &inputs, &touches);
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
    let by_paper = [Filter::SupportClearance, Filter::Edge];
    let own = taken.iter().filter(|(filter, _)| by_paper.contains(filter));
    let paper = sites.len() - own.map(|(_, taken)| taken).sum::<usize>();
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
    let pattern = dataset::TouchPattern {
        count,
        seed: 77,
        margin: 2.4e-3,
        even: false,
        tip: inputs.project.tip(),
    };
    (dataset::distribute_touches(part, &pattern, None).into_iter())
        .filter(|t| (0.012..=0.108).contains(&t.position.z))
        .collect()
}

/// Displacement along the normal under each touch (m), and strain at the feasible sites.
fn solve(
    ground: &ShellGround,
    remeshed: &Remeshed,
    inputs: &Inputs,
    touches: &[Touch],
) -> (Vec<f64>, dataset::SignalMatrix) {
    let model = ground
        .model(remeshed, &unwatched)
        .expect("the limb is held");
    let loads: Vec<_> = touches.iter().map(|t| model.forces(t)).collect();
    let under = touches
        .iter()
        .zip(model.solve_many(&loads))
        .map(|(touch, u)| {
            let at = model.mesh.index().nearest(touch.position).0;
            let tri = model.mesh.triangles()[at.triangle as usize];
            let moved: DVec3 = (0..3)
                .map(|k| DVec3::from_slice(&u[6 * tri[k] as usize..]) * at.barycentric[k])
                .sum();
            -moved.dot(touch.normal)
        })
        .collect();
    let reference =
        design::simulate(inputs, &Quality::Draft.budget(), &unwatched).expect("the limb simulates");
    let feasible = design::filter(inputs, &reference).sites();
    let sites: Vec<_> = feasible
        .iter()
        .map(|&s| reference.dataset.sites[s].gauge)
        .collect();
    let (x, _) = dataset::measure(&model, touches, &sites, Signal::Strain, &unwatched)
        .expect("nobody cancels");
    (under, x)
}

fn errors(text: &mut String, designs: &[(Quality, Signal, Design)]) {
    let _ = writeln!(
        text,
        "## Localization error on unseen touches\n\nMean / median in mm. Strain carries 1 microstrain of noise in training and test; displacement none, as in the paper. The paper's figures are for its own limb and its model's own data: below 10 mm with 5 and about 2.5 mm with 10 gauges (greedy SVR), 0.6 mm with all candidates.\n\n| quality | signal | selector | gauges | all touches | away from the boundaries | aim or paper |\n|---|---|---|---|---|---|---|"
    );
    for (quality, signal, design) in designs {
        let mut line = |chooser: Chooser, sensors: usize| {
            let (set, selector) = (chooser.set(sensors), chooser.name());
            let find = |all: bool| {
                let mut rows = design.evaluation.of(set);
                let row = rows.find(|r| (r.region == EVERYWHERE) == all);
                row.map_or("–".to_owned(), |r| {
                    format!("{:.2} / {:.2}", r.error_mm, r.median_mm)
                })
            };
            let aim: Option<(f64, &str)> = match (quality, signal, sensors) {
                (Quality::Standard, Signal::Displacement, 5) => Some((6.0, ", paper < 10")),
                (Quality::Standard, Signal::Displacement, 10) => Some((3.0, ", paper 2.5")),
                (Quality::Draft, _, 10) => Some((12.0, "")),
                _ => None,
            };
            let reached = design.evaluation.over_all(set);
            let reached = reached.map_or(f64::NAN, |r| r.error_mm);
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
        for selector in SelectorKind::PAPER {
            line(selector.into(), 5);
            line(selector.into(), 10);
        }
        line(Chooser::AllCandidates, design.candidate_count());
    }
    text.push('\n');
}

/// Error against number of gauges, for all selectors: the paper's first figure.
fn curves(text: &mut String, designs: &[(Quality, Signal, Design)]) {
    let kinds = SelectorKind::PAPER;
    for (quality, signal, design) in designs {
        let names: Vec<&str> = kinds.iter().map(|k| k.title()).collect();
        let _ = writeln!(
            text,
            "### Error against number of gauges: {}, {}\n\nAll touches: mean / median / 95th percentile, then the mean as a workshop would build it (each gauge 1 mm and 3° off, gains 3 % off), in mm.\n\n| gauges | {} |\n|---|{}",
            quality.name(),
            signal.name(),
            names.join(" | "),
            "---|".repeat(names.len())
        );
        for sensors in 1..=10 {
            let cells: Vec<String> = kinds
                .iter()
                .map(|kind| {
                    let set = Chooser::from(*kind).set(sensors);
                    let row = design.evaluation.over_all(set);
                    row.map_or("–".into(), |r| {
                        format!(
                            "{:.2} / {:.2} / {:.1}; {:.1}",
                            r.error_mm, r.median_mm, r.p95_mm, r.workshop_mm
                        )
                    })
                })
                .collect();
            let _ = writeln!(text, "| {sensors} | {} |", cells.join(" | "));
        }
        text.push('\n');
    }
}

/// What failed gauges cost: the paper's second figure.
fn failures(text: &mut String, designs: &[(Quality, Signal, Design)]) {
    let _ = writeln!(
        text,
        "## Failed gauges\n\nMean error over subsets of so many failed of ten (all subsets where they are few, a seeded sample otherwise; in brackets the worst), trained anew without them, and not (a failed gauge then reports its mean). The paper reports about 5 mm more with three of ten failed (greedy SVR, trained anew).\n\n| quality | signal | selector | trained anew | 0 | 1 | 2 | 3 | 4 | 5 |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    for (quality, signal, design) in designs {
        for set in &design.evaluation.failures {
            for retrained in [true, false] {
                let cells: Vec<String> = (0..=5)
                    .map(|failed| {
                        let row = (set.rows.iter()).find(|r| {
                            r.failed == failed && (r.retrained == retrained || failed == 0)
                        });
                        row.map_or("–".into(), |r| {
                            format!("{:.1} ({:.1})", r.error_mm, r.worst_mm)
                        })
                    })
                    .collect();
                let _ = writeln!(
                    text,
                    "| {} | {} | {} | {} | {} |",
                    quality.name(),
                    signal.name(),
                    set.set.chooser.name(),
                    if retrained { "yes" } else { "no" },
                    cells.join(" | ")
                );
            }
        }
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
            .candidates
            .as_ref()
            .and_then(|c| c.unexplained)
            .map_or("–".to_owned(), |u| format!("{:.2} %", 100.0 * u));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {share} |",
            quality.name(),
            signal.name(),
            d.reduced.feasible.len(),
            d.candidate_count()
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

//! Gauges for the estimator that reads them, measured: `cargo bench --bench gauges` writes `benches/gauges.md`, which
//! `RESULTS.md` takes in, and `assets/agreement.svg`. With names of sections behind `--` (`limb`, `solid`, `shin`,
//! `agreement`) it makes only those anew; with `quick` everything at Draft, printed and not written.

#[path = "../tests/agreement/mod.rs"]
mod agreement;
mod page;
mod timing;

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use agreement::{FORCES_N, Touched, Trial};
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::design::{self, Design, Inputs, Simulated};
use hapdef::evaluation::{Chooser, EVERYWHERE, EstimatorKind, Evaluation};
use hapdef::io::mesh_file::read_mesh;
use hapdef::io::svg::{self, PlotSeries};
use hapdef::mesh::repair::Repair;
use hapdef::mesh::unroll::Axis;
use hapdef::placement::{Selection, SelectorKind, SensorSet};
use hapdef::project::{Masks, PartModel, Project, SupportKeys, SupportKind, Unit};
use timing::{cpu_seconds, reference_seconds};

const FILE: &str = "benches/gauges.md";
const PICTURE: &str = "assets/agreement.svg";
const SHIN: &str = "../shared/meshes/poppy_humanoid_l_shin_visual.STL";
/// Numbers of gauges.
const SIZES: [usize; 2] = [5, 10];
/// Gauges of the largest set that are lost.
const LOST: usize = 3;

/// A word to ask for it by, its heading, and what it measures, quickly or not.
type Section = (&'static str, &'static str, fn(&mut String, bool));

const SECTIONS: [Section; 4] = [
    ("limb", "The bundled limb", limb),
    ("solid", "The solid limb", solid),
    ("shin", "A Poppy shin", shin),
    (
        "agreement",
        "What is promised and what is done",
        agreement_of,
    ),
];

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let named = |word: &str| asked.iter().any(|a| a == word);
    let (every, quick) = (!SECTIONS.iter().any(|s| named(s.0)), named("quick"));
    let old = std::fs::read_to_string(FILE).unwrap_or_default();
    let mut text = head();
    for (word, heading, measure) in SECTIONS {
        let kept = old.split("\n### ").find(|part| part.starts_with(heading));
        if every || named(word) {
            eprintln!("{word}");
            let _ = write!(text, "### {heading}\n\n");
            measure(&mut text, quick);
        } else if let Some(kept) = kept {
            let _ = write!(text, "### {}\n\n", kept.trim_end());
        }
    }
    println!("{text}");
    if !quick {
        std::fs::write(FILE, &text).expect("the figures can be written");
        page::remake();
    }
}

fn head() -> String {
    let reference = reference_seconds();
    format!(
        "Remade by `cargo bench --bench gauges`. Processor seconds of the whole process; a 4000 × 4000 matrix product on one core took {reference:.1} s beside them. Seed 0, all touches, held ones among them, judged on finer elements.\n\n\
Errors are mean / median / 95 % (mm) as designed. As built: every gauge as far off as `gauge.tolerance` says, of which matching knows no more than that, and the regression nothing. Calibrated: the same gauges after twelve known presses made by hand. Three lost: left out of the matching, nothing is retrained. Blind: touches that move no gauge by three times its noise; they count in every mean. The regression is trained anew for each force, under touches of that force; it cannot be calibrated.\n\n"
    )
}

fn limb(text: &mut String, quick: bool) {
    let inputs = hapdef::cli::bundled().expect("the bundled limb").inputs;
    let quality = if quick {
        Quality::Draft
    } else {
        Quality::Standard
    };
    compare(text, inputs, quality);
}

/// As `hapdef limb --solid` writes it.
fn solid(text: &mut String, _quick: bool) {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("a plain name");
    let made = Command::new(env!("CARGO_BIN_EXE_hapdef"))
        .args(["limb", "--solid", "--no-sites", "--out", out])
        .status()
        .expect("hapdef runs");
    assert!(made.success(), "the solid limb could not be made");
    let project = folder.path().join("limb.hapdef.toml");
    let loaded = hapdef::cli::open(&project, None).expect("the solid limb");
    compare(text, loaded.inputs, Quality::Draft);
}

/// A part that is not in this repository, held at both ends.
fn shin(text: &mut String, _quick: bool) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(SHIN);
    if !path.is_file() {
        let _ = writeln!(text, "Skipped: `{SHIN}` is not here.\n");
        return;
    }
    let loaded = read_mesh(&path, Some(Unit::Metre), 0, Repair::default()).expect("the shin");
    let mut project = Project::around("shin.stl", Some(Unit::Metre));
    project.part.model = PartModel::Solid;
    for y in [[-400.0, -150.0], [-8.0, 400.0]] {
        project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: Some([[-80.0, y[0], -80.0], [80.0, y[1], 80.0]]),
            box_axis: None,
            vertices: None,
            normal: Axis::Z,
            bedding_n_per_mm3: None,
        });
    }
    project.sites.spacing_mm = 4.0;
    let inputs = Inputs {
        project,
        part: Arc::new(loaded.mesh),
        painted: None,
        masks: Masks::new(),
    };
    compare(text, inputs, Quality::Draft);
}

/// A part with all that is needed to judge sets of gauges on it.
struct Part {
    inputs: Inputs,
    budget: Budget,
    design: Design,
    /// For each selector its sets of all sizes, with the processor seconds that choosing them took.
    chosen: Vec<(Selection, f64)>,
}

/// The tables of one part.
fn compare(text: &mut String, mut inputs: Inputs, quality: Quality) {
    let project = &mut inputs.project;
    project.selection.sites.clear();
    project.selection.selector = SelectorKind::ExpectedError;
    project.selection.sensors = SIZES[SIZES.len() - 1];
    project.evaluation.estimator = EstimatorKind::Matching;
    project.evaluation.forces_n = FORCES_N.to_vec();
    project.evaluation.regions.clear();
    let budget = quality.budget();
    let before = cpu_seconds();
    let kinds = [SelectorKind::ExpectedError];
    let design = match design::run(
        &design::DesignRequest {
            inputs: &inputs,
            kinds: &kinds,
            budget: &budget,
        },
        &cpu_seconds,
        &unwatched,
    ) {
        Ok(design) => design,
        Err(error) => {
            let _ = writeln!(text, "No gauges can be chosen: {error}.\n");
            return;
        }
    };
    let whole = cpu_seconds() - before;
    let _ = writeln!(
        text,
        "{} quality: {} feasible sites, {} touches, {:.2} mm elements, judged on {} touches of {:.2} mm elements. The whole design by expected error took {whole:.1} processor seconds: {}.\n",
        quality.name(),
        design.reduced.feasible.len(),
        design.simulated.dataset.touches.len(),
        design.simulated.element_mm,
        design.reference.touches.len(),
        design.reference.element_mm,
        in_words(&design)
    );
    let part = Part {
        chosen: chosen(&inputs, &design, &budget),
        inputs,
        budget,
        design,
    };
    part.certificates(text);
    part.errors(text);
}

fn in_words(design: &Design) -> String {
    let stage = |s: &design::StageTime| format!("{} {:.1}", s.stage, s.seconds);
    design
        .seconds
        .iter()
        .map(stage)
        .collect::<Vec<_>>()
        .join(", ")
}

/// The sets of every selector. One that exchanges gauges chooses for each number of gauges by itself.
fn chosen(inputs: &Inputs, design: &Design, budget: &Budget) -> Vec<(Selection, f64)> {
    let select = |kind: SelectorKind, sensors: usize| {
        let mut inputs = inputs.clone();
        inputs.project.selection.sensors = sensors;
        let (simulated, reduced) = (&design.simulated, &design.reduced);
        design::Choosing {
            inputs: &inputs,
            simulated,
            reduced,
            budget,
            watch: &unwatched,
        }
        .select(kind)
        .expect("gauges can be chosen")
    };
    let most = SIZES[SIZES.len() - 1];
    (SelectorKind::ALL.into_iter())
        .map(|kind| {
            eprintln!("  {}", kind.name());
            let before = cpu_seconds();
            let mut selection = select(kind, most);
            let took = cpu_seconds() - before;
            let set = |&sensors: &usize| {
                let alone = (kind == SelectorKind::ExpectedError && sensors != most)
                    .then(|| select(kind, sensors));
                alone.as_ref().unwrap_or(&selection).set(sensors).cloned()
            };
            let sets = SIZES.iter().filter_map(set).collect();
            selection.sets = sets;
            (selection, took)
        })
        .collect()
}

/// What no set of as many gauges can beat (mm), where the selector has said so. By its name in files: sets that
/// nobody certifies have none.
fn bound_mm(set: &SensorSet) -> Option<f64> {
    serde_json::to_value(set).ok()?.get("bound_mm")?.as_f64()
}

impl Part {
    /// What matching is expected to do with every set over the forces of the project, and how far from the best that
    /// may be.
    fn certificates(&self, text: &mut String) {
        let range = self.inputs.project.touch.forces_n;
        let _ = writeln!(
            text,
            "Expected error of matching over touches of {} to {} N, as built, and its certificate: what no set of as many gauges from these sites can beat.\n\n| selector | gauges | expected (mm) | no set beats (mm) | above it | processor s of choosing |\n|---|---|---|---|---|---|",
            range[0], range[1]
        );
        for (k, sensors) in SIZES.into_iter().enumerate() {
            let sets: Vec<&SensorSet> = (self.chosen.iter())
                .filter_map(|(selection, _)| selection.sets.get(k))
                .collect();
            let sites: Vec<Vec<usize>> = sets.iter().map(|s| s.sites.clone()).collect();
            let simulated = &self.design.simulated;
            let errors = design::expected_errors(&self.inputs, simulated, &sites, &unwatched)
                .expect("nobody stops it");
            // One bound for all: it is of the sites, and not of the set.
            let bound = sets.iter().find_map(|set| bound_mm(set));
            let cell = bound.map_or("–".into(), |b| format!("{b:.2}"));
            for ((selection, took), error) in self.chosen.iter().zip(errors) {
                let above = bound.map_or("–".into(), |b| {
                    format!("{:.0} %", 100.0 * (error / b - 1.0))
                });
                let _ = writeln!(
                    text,
                    "| {} | {sensors} | {error:.2} | {cell} | {above} | {took:.1} |",
                    selection.selector.name()
                );
            }
        }
        text.push('\n');
    }

    /// All sets by both estimators, at all forces and builds.
    fn errors(&self, text: &mut String) {
        text.push_str("| selector | gauges | estimator | force (N) | as designed (mm) | as built (mm) | calibrated (mm) | three lost (mm) | blind |\n|---|---|---|---|---|---|---|---|---|\n");
        for k in 0..SIZES.len() {
            let selections: Vec<Selection> = (self.chosen.iter())
                .map(|(selection, _)| Selection {
                    sets: selection.sets.get(k).cloned().into_iter().collect(),
                    ..selection.clone()
                })
                .collect();
            let simulated = &self.design.simulated;
            eprintln!("  matching, {} gauges", SIZES[k]);
            let matched = self.judged(&self.inputs, simulated, &selections, self.budget);
            by_matching(text, &matched);
            for force in FORCES_N {
                eprintln!("  regression, {} gauges, {force} N", SIZES[k]);
                by_regression(text, &self.regressed(&selections, force), force);
            }
        }
        text.push('\n');
    }

    fn judged(
        &self,
        inputs: &Inputs,
        simulated: &Simulated,
        selections: &[Selection],
        budget: Budget,
    ) -> Evaluation {
        let reduced = &self.design.reduced;
        let sites: Vec<usize> = (selections.iter())
            .flat_map(|s| &s.sets)
            .flat_map(|s| s.sites.iter().copied())
            .collect();
        design::reference(inputs, simulated, &sites, &budget, &unwatched)
            .and_then(|reference| {
                design::Choosing {
                    inputs,
                    simulated,
                    reduced,
                    budget: &budget,
                    watch: &unwatched,
                }
                .evaluate(selections, &reference)
            })
            .expect("sets can be judged")
    }

    /// By regressions that learn from touches of a force (N), and are judged by touches of that force. None is trained
    /// anew without gauges: that is no estimator which goes on working.
    fn regressed(&self, selections: &[Selection], force: f64) -> Evaluation {
        let mut inputs = self.inputs.clone();
        inputs.project.touch.force_n = force;
        inputs.project.evaluation.estimator = EstimatorKind::Svr;
        let budget = Budget {
            failure_subsets: 0,
            ..self.budget
        };
        let simulated =
            design::simulate(&inputs, &budget, &unwatched).expect("the part can be simulated");
        self.judged(&inputs, &simulated, selections, budget)
    }
}

fn by_matching(text: &mut String, found: &Evaluation) {
    for row in found.matched.iter().filter(|r| r.region == EVERYWHERE) {
        let middle = found.judging.middle_n() == Some(row.force_n);
        let lost = (found.failures.iter())
            .filter(|f| middle && f.set.chooser == row.set.chooser)
            .flat_map(|f| &f.rows)
            .find(|f| f.failed == LOST);
        let cell = |mm: Option<f64>| mm.map_or("–".into(), |mm| format!("{mm:.2}"));
        let _ = writeln!(
            text,
            "| {} | {} | matching | {} | {:.2} / {:.2} / {:.2} | {:.2} | {} | {} | {:.0} % |",
            row.set.chooser.name(),
            row.set.sensors,
            row.force_n,
            row.error_mm,
            row.median_mm,
            row.p95_mm,
            row.as_built_mm,
            cell(row.calibrated_mm),
            cell(lost.map(|l| l.error_mm)),
            100.0 * row.blind
        );
    }
}

fn by_regression(text: &mut String, found: &Evaluation, force: f64) {
    let rows = found.rows.iter();
    let of_selectors = rows.filter(|r| matches!(r.set.chooser, Chooser::Selector(_)));
    for row in of_selectors.filter(|r| r.region == EVERYWHERE) {
        let _ = writeln!(
            text,
            "| {} | {} | svr | {force} | {:.2} / {:.2} / {:.2} | {:.2} | – | – | – |",
            row.set.chooser.name(),
            row.set.sensors,
            row.error_mm,
            row.median_mm,
            row.p95_mm,
            row.workshop_mm
        );
    }
}

/// Mean and standard deviation.
fn mean_and_spread(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, (squares / count).sqrt())
}

/// Promised errors against those of matching, at touches held out and at those that the promise is made of.
fn agreement_of(text: &mut String, quick: bool) {
    let (touches, draws, random) = if quick {
        (400, 1, [2, 1])
    } else {
        (3000, 8, [8, 6])
    };
    let trial = Trial::new(random);
    let _ = writeln!(
        text,
        "The bundled limb at Draft, as built and uncalibrated: expected errors, the mean of {draws} draws of the noise, over the mean error of matching, gauges glued anew for each touch: {touches} held-out touches of each force, and the touches that the promise is made of. The first says how far a promise can be trusted, the second what of that is not where touches happen to fall. {} sets: chosen, random, and beside each other.\n\n![Promised and achieved errors]({PICTURE})\n\n| force (N) | sets | promised over done, held-out touches: mean ± spread, least – most | the same touches |\n|---|---|---|---|",
        trial.sets.len()
    );
    let mut series = Vec::new();
    let names = FORCES_N.map(|force| format!("{force} N"));
    for (force, name) in FORCES_N.into_iter().zip(&names) {
        eprintln!("  {force} N");
        let promised = trial.promised(force, draws);
        let held_out = trial.done(force, Touched::HeldOut(touches));
        let same = trial.done(force, Touched::AsPromised(800));
        let cells = [&held_out, &same].map(|done| {
            let ratios: Vec<f64> = promised.iter().zip(done).map(|(p, d)| p / d).collect();
            let (mean, spread) = mean_and_spread(&ratios);
            let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            let most = ratios.iter().copied().fold(0.0, f64::max);
            format!("{mean:.2} ± {spread:.2}, {least:.2} – {most:.2}")
        });
        let _ = writeln!(
            text,
            "| {force} | {} | {} | {} |",
            trial.sets.len(),
            cells[0],
            cells[1]
        );
        let mut points: Vec<(f64, f64)> = held_out.into_iter().zip(promised).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        series.push(PlotSeries { name, points });
    }
    text.push('\n');
    if !quick {
        std::fs::write(PICTURE, picture(series)).expect("the picture can be written");
    }
}

/// Every set at every force, and where promises are kept.
fn picture(mut series: Vec<PlotSeries>) -> String {
    const STYLE: &str = "<style>text{font:12px sans-serif;fill:#222}.t{font-weight:bold}.grid{stroke:#ddd}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>";
    let most = (series.iter())
        .flat_map(|s| &s.points)
        .map(|p| p.0.max(p.1))
        .fold(0.0, f64::max);
    series.push(PlotSeries {
        name: "as promised",
        points: vec![(0.0, 0.0), (most, most)],
    });
    let drawn = svg::plot(
        "Mean error of sets, as promised and as matching makes it",
        "achieved (mm)",
        "promised (mm)",
        &series,
        640.0,
    );
    // A picture of its own has no page to take its style from.
    drawn.replacen("<title>", &format!("{STYLE}<title>"), 1)
}

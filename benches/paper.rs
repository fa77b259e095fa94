//! The paper's task on the limb of its authors: `cargo bench --bench paper` at Draft, and for figures to be quoted
//! `cargo bench --bench paper -- --quality standard`.
//!
//! Their Ansys deck is read as it is from `../shared/paper-limb`, or from the folder that `HAPDEF_PAPER_LIMB` names: it
//! is nobody's to give, and where it is absent nothing is measured. Every stage says on stderr what it took as it
//! ends. The tables, for `RESULTS.md`, go to stdout; they have no times in them and are the same on every run.

#[path = "paper/beside.rs"]
mod beside;
#[path = "paper/displaced.rs"]
mod displaced;
#[path = "paper/kernels.rs"]
mod kernels;
#[path = "paper/matched.rs"]
mod matched;
#[path = "paper/reduction.rs"]
mod reduction;
mod timing;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Parser;
use hapdef::budget::Quality;
use hapdef::cli::{self, QualityArg};
use hapdef::dataset::Signal;
use hapdef::design::Inputs;
use hapdef::evaluation::EstimatorKind;
use hapdef::io::project_file::LoadedProject;

use self::displaced::Displaced;
use self::kernels::Chosen;
use self::reduction::Measured;
use timing::cpu_seconds;

const FOLDER: &str = "HAPDEF_PAPER_LIMB";
const USUAL_FOLDER: &str = "../shared/paper-limb";
const DECK: &str = "ds.dat";

/// What the paper did: touches, candidates after the reduction, and the largest set.
const TOUCHES: usize = 3255;
const CANDIDATES: usize = 407;
const MOST: usize = 30;
/// Numbers of gauges that are judged. Losses are tried on the last set of a selector: ten gauges, as in the paper.
const SIZES: [usize; 9] = [1, 2, 3, 5, 7, 15, 20, 30, 10];
/// Those that the paper quotes.
const FEW: usize = 5;
const MANY: usize = 10;
/// Gauges of `MANY` that are lost.
const LOST: usize = 3;

/// The paper's task on the limb of its authors.
#[derive(Parser, Debug)]
struct Args {
    /// How much to spend: draft or standard.
    #[arg(long, default_value = "draft")]
    quality: QualityArg,
    /// Least distance of touches from free edges (mm); the authors kept theirs 5 mm away.
    #[arg(long, default_value_t = 5.0)]
    margin_mm: f64,
    /// Touches to learn from at most; the paper has 3255, which take greedy SVR hours where elements are fine.
    #[arg(long, default_value_t = TOUCHES)]
    touches: usize,
    /// Cargo says so.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let deck = folder().join(DECK);
    if !deck.is_file() {
        println!(
            "Nothing is measured: the paper's limb is not here ({}). {FOLDER} may name the folder that holds its {DECK}.",
            deck.display()
        );
        return Ok(());
    }
    let quality = Quality::from(args.quality);
    let mut stages = Stages::begin();
    let loaded = cli::open(&deck, None)?;
    stages.end("reading the deck");
    let inputs = task(&loaded.inputs, &args);
    let displaced = Displaced::of(inputs, quality.budget(), &mut stages)?;
    let measured = Measured::of(&displaced.reduced.x)?;
    stages.end("reducing by two measures");
    let theirs = kernels::theirs(&displaced)?;
    stages.end("choosing by their kernel");
    let judged = displaced.judged(&theirs, &mut stages)?;
    let matched = matched::judged(&displaced, &mut stages)?;
    eprintln!("in all: {:.1} processor s", cpu_seconds());

    let mut text = head(&loaded, &displaced, &judged, quality);
    beside::write(&mut text, &judged, &matched);
    reduction::write(&mut text, &displaced.feasibility, &measured);
    displaced::write(&mut text, &judged);
    let ours = kernels::ours(&displaced);
    let kernels: Vec<&Chosen> = ours.iter().chain(&theirs).collect();
    kernels::write(&mut text, &kernels, &judged);
    matched::write(&mut text, &matched);
    println!("{text}");
    Ok(())
}

/// Where the limb of the paper may lie.
fn folder() -> PathBuf {
    let usual = || Path::new(env!("CARGO_MANIFEST_DIR")).join(USUAL_FOLDER);
    std::env::var_os(FOLDER).map_or_else(usual, PathBuf::from)
}

/// The paper's task: touches some way from free edges, displacements, regression.
fn task(part: &Inputs, args: &Args) -> Inputs {
    let mut inputs = part.clone();
    let project = &mut inputs.project;
    project.touch.count = args.touches;
    project.touch.edge_margin_mm = args.margin_mm;
    project.gauge.signal = Signal::Displacement;
    project.candidates.count = Some(CANDIDATES);
    project.selection.sensors = MOST;
    project.evaluation.estimator = EstimatorKind::Svr;
    inputs
}

/// Says on stderr what each stage took, as it ends.
struct Stages {
    last: f64,
}

impl Stages {
    fn begin() -> Self {
        Self {
            last: cpu_seconds(),
        }
    }

    fn end(&mut self, stage: &str) {
        let now = cpu_seconds();
        eprintln!("{stage}: {:.1} processor s", now - self.last);
        self.last = now;
    }
}

/// What was measured, on what, and what is said of both.
fn head(
    loaded: &LoadedProject,
    displaced: &Displaced,
    judged: &displaced::Judged,
    quality: Quality,
) -> String {
    let (project, simulated) = (&displaced.inputs.project, &displaced.simulated);
    let left = &simulated.discretization;
    let fewer = match project.touch.count {
        TOUCHES => String::new(),
        count => format!(" --touches {count}"),
    };
    let mut text = format!(
        "## The paper on its own limb\n\n\
`cargo bench --bench paper -- --quality {}{}` prints this. The authors' Ansys deck as it is, {} GPa and ν {}. {} touches of the paper's {TOUCHES}, at least {} mm from free edges, of {} N; {} unknowns, which leave about {:.1} % error in displacement and {:.1} % in strain. Judged on {} other touches, drawn at random, by a finer model. Seed {}.\n\n",
        quality.name(),
        fewer,
        project.material.youngs_modulus_gpa,
        project.material.poissons_ratio,
        simulated.dataset.touches.len(),
        project.touch.edge_margin_mm,
        project.touch.force_n,
        simulated.unknowns,
        left.displacement_percent,
        left.strain_percent,
        judged.touches,
        project.budget.seed
    );
    let said = (loaded.repairs.notes.iter()).chain(simulated.achieved.words());
    for words in said {
        let _ = writeln!(text, "- {words}");
    }
    text.push('\n');
    text
}

/// Millimetres in a table.
fn cell(mm: Option<f64>) -> String {
    mm.map_or("–".into(), |mm| format!("{mm:.2}"))
}

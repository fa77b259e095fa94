//! The command line: everything the studio computes, without a display.

pub mod advise;
pub mod board;
pub mod data;
pub mod design;
pub mod evaluate;
pub mod limb;
pub mod listen;
pub mod out;
pub mod progress;
pub mod ranges;
pub mod render;
pub mod select;
pub mod simulate;
pub mod spared;
pub mod trade;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::budget::Quality;
use crate::dataset::Signal;
use crate::io::examples::write_bundled_mesh;
use crate::io::project_file::LoadedProject;
use crate::io::source;
use crate::placement::SelectorKind;
use crate::plain;
use crate::project::Unit;

pub use crate::io::examples;
pub use crate::io::opening::{bundled, open};

/// Decides where a handful of strain gauges go inside a flexible robot limb.
///
/// Without a command it opens the studio on the bundled limb, or on a project or mesh.
#[derive(Parser, Debug)]
#[command(name = "hapdef", version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Project (NAME.hapdef.toml) or mesh (cdb, dat, glb, gltf, inp, msh, obj, ply, stl) to open in the studio.
    pub file: Option<PathBuf>,
    /// Unit of a mesh file that does not say its own.
    #[arg(long)]
    pub unit: Option<UnitArg>,
    /// Memory that may be taken (GB); 8, or what the machine has, when left out.
    #[arg(long, global = true, value_parser = memory_gb)]
    pub memory_gb: Option<f64>,
}

#[derive(Subcommand, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is one, parsed once")]
pub enum Command {
    /// The whole road: simulate, filter, reduce, select, evaluate, report.
    Design(design::DesignArgs),
    /// The elastic model only: writes the dataset.
    Simulate(simulate::SimulateArgs),
    /// Shell or solid: what the walls of a part say, and what each model would cost.
    Advise(advise::AdviseArgs),
    /// Speed against accuracy, measured on the part: what each setting costs and how well it does.
    Trade(trade::TradeArgs),
    /// Sites for gauges from a dataset alone.
    Select(select::SelectArgs),
    /// How well given sites find touches, from a dataset alone.
    Evaluate(evaluate::EvaluateArgs),
    /// A picture of the limb with its gauges.
    Render(render::RenderArgs),
    /// A simulated board, at a pseudo-terminal or a socket.
    Board(board::BoardArgs),
    /// Where a board's part is touched, one JSON object a line.
    Listen(listen::ListenArgs),
    /// Writes a bundled limb, or another of its family.
    Limb(limb::LimbArgs),
}

/// What every command understands.
#[derive(Args, Debug, Clone, Default)]
pub struct Common {
    /// Project or mesh; the bundled limb when left out.
    pub project: Option<PathBuf>,
    /// How much to spend: draft, standard or reference.
    #[arg(long)]
    pub quality: Option<QualityArg>,
    /// Seed of every random draw.
    #[arg(long)]
    pub seed: Option<u64>,
    /// Worker threads; all cores when left out. The result does not depend on it.
    #[arg(long, value_parser = threads)]
    pub threads: Option<usize>,
    /// What the sites report.
    #[arg(long)]
    pub signal: Option<SignalArg>,
    /// Unit of a mesh file that does not say its own.
    #[arg(long)]
    pub unit: Option<UnitArg>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

macro_rules! named {
    ($name:ident, $target:ty, $($variant:ident => $value:expr),+) => {
        #[derive(ValueEnum, Debug, Clone, Copy)]
        pub enum $name { $($variant),+ }
        impl From<$name> for $target {
            fn from(value: $name) -> Self { match value { $($name::$variant => $value),+ } }
        }
    };
}
named!(QualityArg, Quality, Draft => Quality::Draft, Standard => Quality::Standard, Reference => Quality::Reference);
named!(SignalArg, Signal, Displacement => Signal::Displacement, NormalDisplacement => Signal::NormalDisplacement, Strain => Signal::Strain);
named!(SelectorArg, SelectorKind, GreedySvr => SelectorKind::GreedySvr, PcaQr => SelectorKind::PcaQr, Entropy => SelectorKind::Entropy, MutualInformation => SelectorKind::MutualInformation, ExpectedError => SelectorKind::ExpectedError);
named!(UnitArg, Unit, Mm => Unit::Millimetre, Cm => Unit::Centimetre, M => Unit::Metre, In => Unit::Inch);

/// Gigabytes that can be meant.
fn memory_gb(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(gb) if (0.1..=1e5).contains(&gb) => Ok(gb),
        _ => Err("a number of gigabytes from 0.1 to 100000".into()),
    }
}

/// Most worker threads. More than a machine has cores bring nothing, the largest have some hundreds, and what
/// idle ones cost in looking for work grows with their square: 20 000 never come to an end.
const MOST_THREADS: usize = 1024;

/// A number of threads that can be meant.
fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MOST_THREADS).contains(&count) => Ok(count),
        _ => Err(format!("a number of threads from 1 to {MOST_THREADS}")),
    }
}

impl Cli {
    /// Says what memory this process may take: what was asked for, or what the machine has.
    pub fn bound_memory(&self) {
        let asked = self.memory_gb.map(|gb| (gb * 1e9) as u64);
        crate::memory::allow(asked.unwrap_or_else(source::machine_memory));
    }
}

impl Common {
    /// The project the command works on, with the flags applied.
    ///
    /// # Errors
    /// As [`open`].
    pub fn load(&self) -> anyhow::Result<LoadedProject> {
        let mut loaded = match &self.project {
            Some(path) => open(path, self.unit.map(Into::into))?,
            None => bundled()?,
        };
        say_repairs(&loaded);
        let project = &mut loaded.inputs.project;
        if let Some(quality) = self.quality {
            project.budget.quality = quality.into();
        }
        if let Some(seed) = self.seed {
            project.budget.seed = seed;
        }
        if let Some(signal) = self.signal {
            project.gauge.signal = signal.into();
        }
        Ok(loaded)
    }

    /// Runs `work` on as many threads as were asked for.
    ///
    /// # Errors
    /// What `work` reports, or that the threads could not be started.
    pub fn in_pool<T: Send>(
        &self,
        work: impl FnOnce() -> anyhow::Result<T> + Send,
    ) -> anyhow::Result<T> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.unwrap_or(0))
            .build()
            .context("the worker threads could not be started; try --threads 1")?;
        pool.install(work)
    }
}

/// What was changed or left out while the mesh was taken in, on stderr.
fn say_repairs(loaded: &LoadedProject) {
    if let Some(said) = loaded.repairs.in_words(loaded.inputs.project.part.body) {
        let mesh = plain::path(&loaded.mesh_path);
        out::say(&plain::message(&format!("{mesh}: {said}")));
    }
}

/// Makes the folder for results before anything is computed, and puts the bundled mesh into it where
/// that is what was computed on.
///
/// # Errors
/// When it cannot be written, or when another mesh of that name is there already.
pub fn prepare_folder(loaded: &mut LoadedProject, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: the folder cannot be created. Choose another",
            folder.display()
        )
    })?;
    if loaded.bundled {
        loaded.mesh_path = write_bundled_mesh(folder, &loaded.mesh_path)?;
    }
    Ok(())
}

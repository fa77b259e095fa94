//! What every command understands, and how a project is loaded for it.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};

use super::out;
use crate::budget::Quality;
use crate::dataset::Signal;
use crate::io::examples::write_bundled_mesh;
use crate::io::mesh_file::urdf;
use crate::io::opening::{bundled, open};
use crate::io::outlet;
use crate::io::project_file::LoadedProject;
use crate::placement::SelectorKind;
use crate::plain;
use crate::project::Unit;

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
    /// Folder in which the packages of a robot's description (robot.urdf#LINK) are looked for; may be given more than once.
    #[arg(long)]
    pub package_path: Vec<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Most worker threads. More than a machine has cores bring nothing, the largest have some hundreds, and what
/// idle ones cost in looking for work grows with their square: 20 000 never come to an end.
const MOST_THREADS: usize = 1024;

/// A number of threads that can be meant.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MOST_THREADS).contains(&count) => Ok(count),
        _ => Err(format!("a number of threads from 1 to {MOST_THREADS}")),
    }
}

impl Common {
    /// The project the command works on, with the flags applied.
    ///
    /// # Errors
    /// As [`open`].
    pub fn load(&self) -> anyhow::Result<LoadedProject> {
        urdf::look_in(self.package_path.clone());
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

/// Makes a folder for results before anything is computed.
///
/// # Errors
/// When it cannot be made or written.
pub fn make_folder(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: the folder cannot be created. Choose another",
            folder.display()
        )
    })?;
    Ok(outlet::folder(folder)?)
}

/// Makes the folder for results before anything is computed, and puts the bundled mesh into it where
/// that is what was computed on.
///
/// # Errors
/// When it cannot be written, or when another mesh of that name is there already.
pub fn prepare_folder(loaded: &mut LoadedProject, folder: &Path) -> anyhow::Result<()> {
    make_folder(folder)?;
    if loaded.bundled {
        loaded.mesh_path = write_bundled_mesh(folder, &loaded.mesh_path)?;
    }
    Ok(())
}

//! The command line: everything the studio computes, without a display.

pub mod advise;
pub mod board;
pub mod calibrate;
pub mod collect;
mod common;
pub mod data;
pub mod dataset;
pub mod design;
pub mod evaluate;
pub mod export;
pub mod export_c;
pub mod keys;
pub mod limb;
pub mod listen;
pub mod out;
pub mod predict;
pub mod progress;
pub mod ranges;
pub mod render;
pub mod select;
pub mod simulate;
pub mod spared;
pub mod study;
pub mod trade;
pub mod train;
mod train_update;

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use crate::io::source;

pub use self::common::{Common, QualityArg, SelectorArg, SignalArg, UnitArg, prepare_folder};
pub use crate::io::examples;
pub use crate::io::opening::{bundled, open};

/// Decides where a handful of strain gauges go inside a flexible robot limb.
///
/// Without a command it opens the studio on the bundled limb, or on a project or mesh.
#[derive(Parser, Debug)]
#[command(
    name = "hapdef",
    version,
    args_conflicts_with_subcommands = true,
    mut_subcommands(signed)
)]
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
    /// The whole pipeline: simulate, filter, reduce, select, evaluate, report.
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
    /// An estimator of place and force, learned from measured touches alone, as a file.
    Train(train::TrainArgs),
    /// What a trained estimator makes of readings, and how far that is off.
    Predict(predict::PredictArgs),
    /// A trained estimator as C source for the board itself.
    ExportC(export_c::ExportCArgs),
    /// A picture of the limb with its gauges.
    Render(render::RenderArgs),
    /// A simulated board, at a pseudo-terminal or a socket.
    Board(board::BoardArgs),
    /// Where a board's part is touched, one JSON object a line.
    Listen(listen::ListenArgs),
    /// How the gauges are really glued, from presses at known places.
    Calibrate(calibrate::CalibrateArgs),
    /// A machine presses the limb at many places, and what its gauges read is written down.
    Collect(collect::CollectArgs),
    /// What a machine pressed, as a dataset to train on.
    Dataset(dataset::DatasetArgs),
    /// The limb with its gauges for colleagues (glTF) and robots (URDF).
    Export(export::ExportArgs),
    /// Writes a bundled limb, or another of its family.
    Limb(limb::LimbArgs),
    /// Many designs beside each other: a base project varied along axes, on one machine or many.
    Study(study::StudyArgs),
    /// What a project file may hold: every key with its unit, range, default and meaning.
    Keys(keys::KeysArgs),
}

/// Takes numbers below zero for values: what is out of range is told with the range, not as an option that there is not.
fn signed(command: clap::Command) -> clap::Command {
    let own = command.mut_args(|arg| {
        if arg.is_positional() || !arg.get_action().takes_values() {
            arg
        } else {
            arg.allow_negative_numbers(true)
        }
    });
    own.mut_subcommands(signed)
}

/// Gigabytes that can be meant.
fn memory_gb(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(gb) if (0.1..=1e5).contains(&gb) => Ok(gb),
        _ => Err("a number of gigabytes from 0.1 to 100000".into()),
    }
}

impl Cli {
    /// Says what memory this process may take: what was asked for, or what the machine has.
    pub fn bound_memory(&self) {
        let asked = self.memory_gb.map(|gb| (gb * 1e9) as u64);
        crate::memory::allow(asked.unwrap_or_else(source::machine_memory));
    }
}

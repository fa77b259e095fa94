//! `hapdef dataset`: what a machine pressed, as a dataset.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::out;
use crate::io::outlet;
use crate::plain;
use crate::test_bed::{CollectedRun, Wanted};

#[derive(Args, Debug, Clone)]
pub struct DatasetArgs {
    /// The folder of `hapdef collect`.
    pub folder: PathBuf,
    /// The dataset (.npz): `X` (strain, gauges × touches), `p_m`, `force_n`, `depth_m`, `groups` (the press of each touch,
    /// never divided between learning and judging), `time_s`, `temperature_c` (where the board says it), and the keys of limb,
    /// board and machine.
    #[arg(long)]
    pub out: PathBuf,
    /// The same as a table (.csv).
    #[arg(long)]
    pub csv: Option<PathBuf>,
    /// Which readings of a place: the deepest, or all.
    #[arg(long, value_enum, default_value_t)]
    pub depths: DepthsArg,
    /// Readings under less than this are left out (N), where the tip has a sensor.
    #[arg(long, default_value_t = 0.5, value_parser = super::ranges::between(0.0, 1e4))]
    pub least_force: f64,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum DepthsArg {
    /// The reading under the largest force, as the paper's.
    #[default]
    Largest,
    /// Every reading.
    All,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &DatasetArgs) -> anyhow::Result<()> {
    for path in std::iter::once(&args.out).chain(&args.csv) {
        outlet::file(path)?;
    }
    let wanted = Wanted {
        all_depths: args.depths == DepthsArg::All,
        least_force: args.least_force,
    };
    let CollectedRun {
        about,
        board,
        presses,
        columns,
    } = CollectedRun::read(&args.folder, wanted)?;
    columns.write_npz(&args.out, &about, &board)?;
    if let Some(path) = &args.csv {
        columns.write_csv(path)?;
    }
    let said = json!({
        "presses": presses,
        "touches": columns.places.len(),
        "gauges": about.channels.len(),
        "largest_force_n": columns.forces.iter().copied().reduce(f64::max),
        "board": board,
        "limb": about.limb,
        "machine": about.machine_key(),
    });
    if args.json {
        return out::line(&said.to_string());
    }
    out::line(&format!(
        "{} of {} with {} in {}",
        plain::either(columns.places.len(), "touch", "touches"),
        plain::either(presses, "press", "presses"),
        plain::either(about.channels.len(), "gauge", "gauges"),
        args.out.display()
    ))
}

//! `hapdef dataset`: what a machine pressed, as a dataset.

use std::path::PathBuf;

use anyhow::{Context as _, ensure};
use clap::{Args, ValueEnum};
use serde_json::json;

use super::out;
use crate::inference::Chain;
use crate::io::bench_folder::{self, About, Columns};
use crate::io::{machine_file, outlet};
use crate::link::{BenchPress, bench_presses};
use crate::plain;

#[derive(Args, Debug, Clone)]
pub struct DatasetArgs {
    /// The folder of `hapdef collect`.
    pub folder: PathBuf,
    /// The dataset (.npz): `X` (strain, gauges × touches), `p_m`, `force_n`, `depth_m`, `groups` (the press of each touch,
    /// never divided between learning and judging), `time_s`, and the keys of limb and board.
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
    let about = About::read(&args.folder)?.with_context(|| {
        format!(
            "{}: nothing was collected there. `hapdef collect --out` names such a folder",
            args.folder.display()
        )
    })?;
    for path in std::iter::once(&args.out).chain(&args.csv) {
        outlet::file(path)?;
    }
    let mut presses = Vec::new();
    for part in bench_folder::parts(&args.folder)? {
        let bytes = std::fs::read(&part).with_context(|| plain::path(&part))?;
        presses.extend(bench_presses(&bytes));
    }
    presses.sort_by_key(|p| p.number);
    presses.dedup_by_key(|p| p.number);
    ensure!(
        !presses.is_empty(),
        "{}: no press was finished there yet",
        args.folder.display()
    );
    let board = one_board(&presses)?;
    let columns = columns(args, &about, &presses)?;
    ensure!(
        !columns.places.is_empty(),
        "no reading is left: all are under less than --least-force {} N",
        args.least_force
    );
    columns.write_npz(&args.out, &about.limb, &board)?;
    if let Some(path) = &args.csv {
        columns.write_csv(path)?;
    }
    let said = json!({
        "presses": presses.len(),
        "touches": columns.places.len(),
        "gauges": about.channels.len(),
        "largest_force_n": columns.forces.iter().copied().reduce(f64::max),
        "board": board,
        "limb": about.limb,
    });
    if args.json {
        return out::line(&said.to_string());
    }
    out::line(&format!(
        "{} of {} with {} in {}",
        plain::either(columns.places.len(), "touch", "touches"),
        plain::either(presses.len(), "press", "presses"),
        plain::either(about.channels.len(), "gauge", "gauges"),
        args.out.display()
    ))
}

/// The board that read all of them, by its number; empty for one that prints lines and has none.
fn one_board(presses: &[BenchPress]) -> anyhow::Result<String> {
    let number = |p: &BenchPress| p.board.as_ref().map(|b| b.board);
    let first = number(&presses[0]);
    let other = presses.iter().find(|p| number(p) != first);
    if let Some(other) = other {
        anyhow::bail!(
            "press {} was read by another board than press {}: one limb has one board",
            other.number,
            presses[0].number
        );
    }
    Ok(first.map_or(String::new(), |n| format!("{n:08x}")))
}

fn columns(args: &DatasetArgs, about: &About, presses: &[BenchPress]) -> anyhow::Result<Columns> {
    let machine = machine_file::parse(&about.machine)
        .map_err(anyhow::Error::msg)?
        .machine;
    let sensor = machine.sensor.map(|mut sensor| {
        if about.simulated {
            sensor.channel = about.channels.len();
        }
        sensor
    });
    let force = |counts: &[f64], rest: &[f64]| -> Option<f64> {
        let s = sensor?;
        Some((counts.get(s.channel)? - rest.get(s.channel)?) * s.newton_per_count)
    };
    let mut columns = Columns::default();
    for press in presses {
        let chain = Chain {
            gauge_factor: about.gauge_factor,
            active_arms: about.active_arms,
            ..Chain::default()
        };
        let chain = press.board.as_ref().map_or(chain, |b| chain.of_board(b));
        let last = press.steps.len().saturating_sub(1);
        for (k, step) in press.steps.iter().enumerate() {
            let force = force(&step.counts, &press.rest);
            let wanted = args.depths == DepthsArg::All || k == last;
            if !wanted || force.is_some_and(|f| f < args.least_force) {
                continue;
            }
            let strain = |&c: &usize| -> Option<f64> {
                Some((step.counts.get(c)? - press.rest.get(c)?) / chain.counts_per_strain())
            };
            let strains: Option<Vec<f64>> = about.channels.iter().map(strain).collect();
            let strains = strains.with_context(|| {
                format!(
                    "press {}: the board has fewer channels than there are gauges",
                    press.number
                )
            })?;
            columns.strains.push(strains);
            columns.places.push(press.at);
            columns.forces.extend(force);
            columns.depths.push(step.below);
            columns.groups.push(press.number as u32);
            columns.seconds.push(step.time_us as f64 * 1e-6);
        }
    }
    Ok(columns)
}

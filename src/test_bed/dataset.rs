//! What a machine has pressed, as a dataset.

use std::path::Path;

use anyhow::{Context as _, ensure};

use crate::dataset::SignalMatrix;
use crate::inference::Chain;
use crate::io::bench_folder::{self, PressedPart, TouchColumns};
use crate::io::machine_file;
use crate::link::{BenchPress, bench_presses};
use crate::plain;
use crate::regression::Grouping;
use crate::study::Data;

/// Which readings are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// All of a place, or the deepest, which is under the largest force: as the paper's.
    pub all_depths: bool,
    /// Readings under less than this are left out (N), where the tip has a sensor.
    pub least_force: f64,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            all_depths: false,
            least_force: 0.5,
        }
    }
}

/// What stands in the folder of a run.
pub struct CollectedRun {
    /// The limb and the machine.
    pub about: PressedPart,
    /// The board that read it, by its number; empty for one that has none.
    pub board: String,
    /// How many presses were finished.
    pub presses: usize,
    /// The readings.
    pub columns: TouchColumns,
}

impl CollectedRun {
    /// Reads a folder.
    ///
    /// # Errors
    /// A message in the user's terms: nothing was pressed there, by one board, or hard enough.
    pub fn read(folder: &Path, wanted: Wanted) -> anyhow::Result<Self> {
        let about = PressedPart::read(folder)?.with_context(|| {
            format!(
                "{}: nothing was collected there. `hapdef collect --out` names such a folder",
                folder.display()
            )
        })?;
        let mut presses = Vec::new();
        for part in bench_folder::parts(folder)? {
            let bytes = std::fs::read(&part).with_context(|| plain::path(&part))?;
            presses.extend(bench_presses(&bytes));
        }
        presses.sort_by_key(|p| p.number);
        presses.dedup_by_key(|p| p.number);
        ensure!(
            !presses.is_empty(),
            "{}: no press was finished there yet",
            folder.display()
        );
        let board = one_board(&presses)?;
        let columns = columns(wanted, &about, &presses)?;
        ensure!(
            !columns.places.is_empty(),
            "{}: no reading is left: all are under less than {} N",
            folder.display(),
            wanted.least_force
        );
        Ok(Self {
            about,
            board,
            presses: presses.len(),
            columns,
        })
    }

    /// As what an estimator learns from, with the place of each touch, numbered from zero without gaps.
    #[must_use]
    pub fn data(&self) -> (Data, Vec<usize>) {
        let columns = &self.columns;
        let gauges = self.about.channels.len();
        let values = (0..gauges).flat_map(|g| columns.strains.iter().map(move |s| s[g]));
        let data = Data {
            x: SignalMatrix::new(columns.places.len(), values.collect()),
            targets: columns
                .places
                .iter()
                .map(|p| (*p * 1e3).to_array())
                .collect(),
            positions: Vec::new(),
            costs: Vec::new(),
            forces: columns.forces.clone(),
        };
        let groups = Grouping::Place.of(&data.targets);
        (data, groups)
    }
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

fn columns(
    wanted: Wanted,
    about: &PressedPart,
    presses: &[BenchPress],
) -> anyhow::Result<TouchColumns> {
    let machine = match &about.machine[..] {
        // Pressed by hand, and how hard was told.
        "" if about.by_hand => None,
        text => Some(
            machine_file::parse(text)
                .map_err(anyhow::Error::msg)?
                .machine,
        ),
    };
    let sensor = machine.and_then(|m| m.sensor).map(|mut sensor| {
        if about.simulated {
            sensor.channel = about.channels.len();
        }
        sensor
    });
    let force = |counts: &[f64], rest: &[f64]| -> Option<f64> {
        let s = sensor?;
        Some((counts.get(s.channel)? - rest.get(s.channel)?) * s.newton_per_count)
    };
    let mut columns = TouchColumns::default();
    for press in presses {
        let chain = Chain {
            gauge_factor: about.gauge_factor,
            active_arms: about.active_arms,
            ..Chain::default()
        };
        let chain = press.board.as_ref().map_or(chain, |b| chain.of_board(b));
        let last = press.steps.len().saturating_sub(1);
        for (k, step) in press.steps.iter().enumerate() {
            let force = press.force.or_else(|| force(&step.counts, &press.rest));
            let read = wanted.all_depths || k == last;
            if !read || force.is_some_and(|f| f < wanted.least_force) {
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
            ensure!(
                force.is_some() || sensor.is_none(),
                "press {}: the board has no channel of the tip's sensor",
                press.number
            );
            columns.forces.extend(force);
            columns.depths.push(step.below);
            columns.groups.push(press.number as u32);
            columns.seconds.push(step.time_us as f64 * 1e-6);
            let temperature = step.temperature.unwrap_or(f64::NAN);
            columns.temperatures.push(temperature);
        }
    }
    Ok(columns)
}

//! `hapdef study run`: units one after another, or several beside each other.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context as _, ensure};
use clap::Args;

use super::shared::StudyUnit;
use super::unit::Workbench;
use crate::cli::out;
use crate::cli::ranges::whole;
use crate::io::study_folder::{StudyFolder, UnitCost};
use crate::parameter_study::Points;
use crate::plain;
use crate::varied::UnitBase;

#[derive(Args, Debug, Clone)]
pub struct RunArgs {
    /// The study's folder, as `hapdef study plan` wrote it.
    pub folder: PathBuf,
    /// One unit, by its number from 0.
    #[arg(long, conflicts_with_all = ["units", "local"])]
    pub unit: Option<usize>,
    /// Units from one number to another, both included: 10-19.
    #[arg(long, value_parser = span, conflicts_with = "local")]
    pub units: Option<(usize, usize)>,
    /// All units that are missing, on this machine.
    #[arg(long)]
    pub local: bool,
    /// Units beside each other.
    #[arg(long, default_value_t = 1, value_parser = whole(1, 256))]
    pub jobs: usize,
    /// Threads of each; the machine's, divided among the jobs, when left out. Results do not depend on them.
    #[arg(long, value_parser = crate::cli::common::threads)]
    pub threads: Option<usize>,
    /// Compute units again that are there already.
    #[arg(long)]
    pub again: bool,
}

/// From one number to another.
fn span(text: &str) -> Result<(usize, usize), String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok((first, last)),
        _ => Err("write FIRST-LAST, as 10-19".into()),
    }
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &RunArgs) -> anyhow::Result<()> {
    let folder = StudyFolder::open(&args.folder)?;
    let units = folder.plan.units;
    let (first, last) = match (args.unit, args.units) {
        (Some(unit), _) => (unit, unit),
        (None, Some(span)) => span,
        (None, None) => {
            ensure!(
                args.local,
                "say which units: --unit K, --units FIRST-LAST, or --local for all of them on this machine"
            );
            (0, units.saturating_sub(1))
        }
    };
    ensure!(
        last < units,
        "unit {last}: the study has {}, counted from 0",
        plain::count(units, "unit")
    );
    let bench = Workbench::new(&folder.study, &folder.home())?;
    ensure!(
        bench.base.fingerprint()? == folder.plan.base,
        "the base of the study has changed since it was planned: plan it anew into another folder"
    );
    let mut wanted = Vec::new();
    for unit in first..=last {
        if args.again || folder.outcome(unit)?.is_none() {
            wanted.push(unit);
        }
    }
    check_meshes(&folder, &bench.base, &wanted)?;
    let there = last + 1 - first - wanted.len();
    if there > 0 {
        out::say(&format!(
            "hapdef: {} there already",
            plain::either(there, "unit is", "units are")
        ));
    }
    Crew::new(args, &folder, wanted).work()?;
    // What a unit that failed, or was killed, has left behind.
    folder.tidy_shared();
    Ok(())
}

/// That the meshes of these units are those that the study was planned with.
fn check_meshes(folder: &StudyFolder, base: &UnitBase, units: &[usize]) -> anyhow::Result<()> {
    if folder.plan.meshes.is_empty() {
        return Ok(());
    }
    let points = Points::of(&folder.study).map_err(anyhow::Error::msg)?;
    let values = units.iter().flat_map(|&unit| points.values(unit));
    let names: BTreeSet<String> = values
        .filter_map(|value| value.as_str().map(String::from))
        .collect();
    base.check_meshes(names.iter().map(String::as_str), &folder.plan.meshes)
}

/// Threads that compute units beside each other.
struct Crew<'a> {
    args: &'a RunArgs,
    folder: &'a StudyFolder,
    wanted: Vec<usize>,
    /// Units that one worker takes at once: neighbours often share a simulation.
    together: usize,
    taken: AtomicUsize,
    stop: AtomicBool,
    failure: Mutex<Option<anyhow::Error>>,
    progress: Mutex<UnitProgress>,
}

#[derive(Default)]
struct UnitProgress {
    done: usize,
    failed: usize,
    shared: usize,
}

/// How many of some units a worker takes at once: neighbours along the fastest axis often share a simulation, and yet
/// all workers are to end at about the same time.
fn together(units: usize, jobs: usize, fastest: usize) -> usize {
    /// Turns of each worker.
    const TURNS: usize = 8;
    /// More of them save next to nothing more.
    const SHARING: usize = 16;
    let fair = units.div_ceil(jobs * TURNS);
    let sharing = fastest.min(units.div_ceil(jobs)).min(SHARING);
    fair.max(sharing).max(1)
}

impl<'a> Crew<'a> {
    fn new(args: &'a RunArgs, folder: &'a StudyFolder, wanted: Vec<usize>) -> Self {
        Self {
            args,
            folder,
            together: together(wanted.len(), args.jobs, folder.study.fastest()),
            wanted,
            taken: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
            failure: Mutex::new(None),
            progress: Mutex::default(),
        }
    }

    fn work(self) -> anyhow::Result<()> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.args.threads.unwrap_or((cores / self.args.jobs).max(1));
        std::thread::scope(|scope| {
            for _ in 0..self.args.jobs.min(self.wanted.len()) {
                scope.spawn(|| {
                    if let Err(error) = self.serve(threads) {
                        self.stop.store(true, Ordering::Relaxed);
                        if let Ok(mut failure) = self.failure.lock() {
                            failure.get_or_insert(error);
                        }
                    }
                });
            }
        });
        if let Some(error) = self.failure.into_inner().ok().flatten() {
            return Err(error);
        }
        let said = self.progress.into_inner().unwrap_or_default();
        out::say(&format!(
            "hapdef: {} computed, {} of them failed by themselves, {} shared a simulation",
            plain::count(said.done, "unit"),
            said.failed,
            said.shared
        ));
        Ok(())
    }

    /// What one worker does.
    fn serve(&self, threads: usize) -> anyhow::Result<()> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.context("the worker threads could not be started; try --threads 1")?;
        let mut bench = Workbench::new(&self.folder.study, &self.folder.home())?;
        // Once: a Latin hypercube draws all of them.
        let points = Points::of(&self.folder.study).map_err(anyhow::Error::msg)?;
        let begun = Instant::now();
        let beside = self.args.jobs.min(self.wanted.len()).max(1);
        loop {
            let from = self.taken.fetch_add(self.together, Ordering::Relaxed);
            let until = (from + self.together).min(self.wanted.len());
            if from >= until {
                return Ok(());
            }
            for at in from..until {
                let unit = self.wanted[at];
                let of_study = StudyUnit {
                    folder: self.folder,
                    points: &points,
                    unit,
                    ahead: &self.wanted[at + 1..until],
                };
                if self.stop.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let watch = |_| {
                    if self.stop.load(Ordering::Relaxed) {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                };
                let found = pool.install(|| bench.compute(of_study, beside, &watch));
                let (outcome, cost) = match found {
                    // Another worker has failed, and has said why.
                    Err(_) if self.stop.load(Ordering::Relaxed) => return Ok(()),
                    found => found.with_context(|| format!("unit {unit}"))?,
                };
                self.folder.write(&outcome, &cost)?;
                bench.tidy(self.folder);
                self.tell(&cost, outcome.error.as_deref(), begun);
            }
        }
    }

    fn tell(&self, cost: &UnitCost, error: Option<&str>, begun: Instant) {
        let Ok(mut progress) = self.progress.lock() else {
            return;
        };
        progress.done += 1;
        progress.failed += usize::from(error.is_some());
        progress.shared += usize::from(cost.shared);
        let left = self.wanted.len() - progress.done;
        let each = begun.elapsed().as_secs_f64() / progress.done as f64;
        let what = match error {
            Some(why) => format!("failed: {}", plain::message(why)),
            None => format!("{:.1} s of processor time", cost.cpu_seconds),
        };
        let rest = if left == 0 {
            String::new()
        } else {
            format!("; {left} to go, about {:.0} s", each * left as f64)
        };
        out::say(&format!("unit {}: {what}{rest}", cost.unit));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_stay_together_and_nobody_waits_for_one() {
        assert_eq!(together(6, 2, 3), 3);
        assert_eq!(together(1000, 4, 1000), 32);
        assert_eq!(together(100, 4, 1000), 16);
        assert_eq!(together(60, 2, 1), 4);
        assert_eq!(together(3, 8, 3), 1);
        assert_eq!(together(0, 1, 0), 1);
    }

    #[test]
    fn units_are_named_from_one_to_another() {
        assert_eq!(span("10-19"), Ok((10, 19)));
        assert_eq!(span("7"), Ok((7, 7)));
        for wrong in ["19-10", "a-b", "", "1-2-3", "-1"] {
            assert!(span(wrong).is_err(), "{wrong}");
        }
    }
}

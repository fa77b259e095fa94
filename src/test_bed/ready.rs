//! What a run presses: the places that its machine gets to, those that are pressed already, and how it is driven.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context as _;
use glam::DVec3;

use super::asked::BenchRequest;
use super::places::{places, reached};
use super::reference::reference;
use super::run::PressingRun;
use crate::bench::{
    CheckPlace, Collector, CollectorNews, Machine, MachineReach, Planned, PressLimits, RunEnd,
    TableMount,
};
use crate::design::{Inputs, Sensing};
use crate::io::bench_folder;
use crate::link::{Address, BenchOrder, Recorder, bench_presses, press_at_ports};
use crate::plain;

/// A run that can be pressed.
pub struct Ready {
    /// What was asked of it.
    pub asked: BenchRequest,
    /// Where it is written.
    pub folder: PathBuf,
    /// What presses.
    pub machine: Machine,
    /// How the limb stands in it.
    pub mount: TableMount,
    /// How far its touched points are from where the limb stands (m).
    pub off: Vec<f64>,
    /// What the machine gets to.
    pub reach: MachineReach,
    /// The number in the folder's plan of each press.
    pub numbers: Vec<usize>,
    /// Presses that are in the folder already.
    pub done: BTreeSet<usize>,
    /// What is pressed again and again.
    pub reference: Option<CheckPlace>,
    pub(super) inputs: Inputs,
    pub(super) sensing: Arc<Sensing>,
}

impl Ready {
    /// Chooses the places, or takes those that the run was begun with, and writes a plan that is new.
    ///
    /// # Errors
    /// A message in the user's terms: a machine that gets nowhere, points of another limb, a folder that cannot be read or
    /// written.
    pub fn new(run: PressingRun, inputs: Inputs, sensing: Arc<Sensing>) -> anyhow::Result<Self> {
        let PressingRun {
            asked,
            folder,
            about,
            file,
            begun,
        } = run;
        let stance = inputs.project.part.axis.stance(&inputs.part);
        let (mount, off) = (file.mount(&inputs.part, &stance)).map_err(anyhow::Error::msg)?;
        let machine = file.machine;
        let places = places(&asked, &folder, &inputs, &sensing, begun)?;
        let reach = reached(&places, &sensing, &machine, &mount)?;
        if !begun {
            about.write(&folder)?;
            let all: Vec<(DVec3, DVec3)> = reach.presses.iter().map(|p| (p.at, p.normal)).collect();
            bench_folder::write_plan(&folder, &all)?;
        }
        // Numbers are the lines of plan.csv, which holds what was in reach when it was written.
        let numbers = if begun {
            reach.asked.clone()
        } else {
            (0..reach.presses.len()).collect()
        };
        let reference = reference(&asked, &folder, &inputs, &sensing, (&machine, &mount))?;
        Ok(Self {
            done: pressed(&folder)?,
            asked,
            folder,
            machine,
            mount,
            off,
            reach,
            numbers,
            reference,
            inputs,
            sensing,
        })
    }

    /// All that it presses, each with its number.
    pub fn planned(&self) -> impl Iterator<Item = (usize, Planned)> {
        let numbers = self.numbers.iter().copied();
        numbers.zip(self.reach.presses.iter().copied())
    }

    /// What is still to be pressed, each with its number.
    pub fn left(&self) -> impl Iterator<Item = (usize, Planned)> {
        self.planned()
            .filter(|(number, _)| !self.done.contains(number))
    }

    /// The longest that it takes the machine (hours).
    #[must_use]
    pub fn hours(&self) -> f64 {
        /// Of a step with its settling and reading, and of a press beside its steps (s).
        const STEP_S: f64 = 0.45;
        const PRESS_S: f64 = 9.0;
        let steps = (self.asked.depth_mm / self.asked.step_mm).ceil() + 14.0;
        self.reach.presses.len() as f64 * (PRESS_S + STEP_S * steps) / 3600.0
    }

    /// Goes through what is left of it.
    #[must_use]
    pub fn collector(&self) -> Collector {
        self.collector_of(&|_| true)
    }

    /// Goes through the presses of a round, and waits for those of the next one.
    #[must_use]
    pub fn collector_of_rounds(&self, first: &BTreeSet<usize>) -> Collector {
        self.collector_of(&|number| first.contains(&number))
            .waiting_for_more()
    }

    /// Goes through what is left of it and `wanted`, by number.
    pub(super) fn collector_of(&self, wanted: &dyn Fn(usize) -> bool) -> Collector {
        let asked = &self.asked;
        let limits = PressLimits {
            step: asked.step_mm * 1e-3,
            depth: asked.depth_mm * 1e-3,
            enough: asked.force_n,
            most_force: asked.most_force_n,
            ..PressLimits::default()
        };
        let collector = Collector::new(
            self.machine.clone(),
            limits,
            self.left().filter(|(number, _)| wanted(*number)),
            self.reach.retreat,
        );
        match self.reference.clone() {
            Some(reference) => collector.checked_at(reference),
            None => collector,
        }
    }

    /// A recording of what is read from now on.
    ///
    /// # Errors
    /// Why it cannot be begun.
    pub fn recorder(&self) -> anyhow::Result<Recorder> {
        let part = bench_folder::next_part(&self.folder)?;
        Recorder::create(&part).map_err(anyhow::Error::msg)
    }

    /// Keeps what the place that is pressed again and again answered at first.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, news: &CollectorNews) -> anyhow::Result<()> {
        match news {
            CollectorNews::Answer(answer) => Ok(bench_folder::write_answer(&self.folder, answer)?),
            _ => Ok(()),
        }
    }

    /// Presses with a printer and a board at their ports.
    ///
    /// # Errors
    /// When a port cannot be opened, or the recording be written.
    pub fn press_at(
        &self,
        collector: &mut Collector,
        ports: (&Address, &Address),
        orders: &mut dyn FnMut() -> Option<BenchOrder>,
        tell: impl FnMut(CollectorNews),
    ) -> anyhow::Result<RunEnd> {
        let recorder = self.recorder()?;
        press_at_ports(collector, ports, recorder, orders, tell).map_err(anyhow::Error::msg)
    }

    /// In a few words, for people: what is pressed and what is left out, a line each.
    #[must_use]
    pub fn in_words(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mm = |m: &f64| format!("{:.2}", m * 1e3);
        if !self.off.is_empty() {
            let each: Vec<String> = self.off.iter().map(mm).collect();
            lines.push(format!(
                "the limb stands as its touched points say; they are {} mm off",
                each.join(", ")
            ));
        }
        let presses = self.reach.presses.len();
        lines.push(format!(
            "{} of up to {:.2} mm or {} N, at most {:.1} hours of the machine's time",
            plain::either(presses, "press", "presses"),
            self.asked.depth_mm,
            self.asked.force_n,
            self.hours()
        ));
        if let Some((_, why)) = self.reach.left_out.first() {
            lines.push(format!(
                "{} left out, the first because {why}",
                plain::either(self.reach.left_out.len(), "place is", "places are"),
            ));
        }
        if !self.done.is_empty() {
            let there = plain::either(self.done.len(), "press", "presses");
            lines.push(format!(
                "{there} of {presses} are there already; places are those that it was begun with, and other ones that are asked for are not looked at"
            ));
        }
        lines
    }

    /// How lost steps are looked for.
    #[must_use]
    pub fn checked_in_words(&self) -> String {
        let Some(reference) = &self.reference else {
            return "steps that a motor loses are not looked for: no place is pressed again and again"
                .into();
        };
        let at = reference.at.at * 1e3;
        format!(
            "({:.1}, {:.1}, {:.1}) mm is pressed at first, after every {} and at the end, to see whether the machine lost steps",
            at.x,
            at.y,
            at.z,
            plain::either(reference.every, "press", "presses")
        )
    }
}

/// Presses that are in a folder's recordings.
///
/// # Errors
/// When one cannot be read.
pub fn pressed(folder: &Path) -> anyhow::Result<BTreeSet<usize>> {
    let mut done = BTreeSet::new();
    for part in bench_folder::parts(folder)? {
        let bytes = std::fs::read(&part).with_context(|| plain::path(&part))?;
        done.extend(bench_presses(&bytes).iter().map(|p| p.number));
    }
    Ok(done)
}

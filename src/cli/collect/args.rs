//! Options of `hapdef collect`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::board::workshop;
use crate::cli::common::Common;
use crate::cli::ranges::{between, whole};
use crate::design::Workshop;
use crate::link::BAUD;
use crate::test_bed::{BenchRequest, Flaws};

#[derive(Args, Debug, Clone)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a switch of the command line"
)]
pub struct CollectArgs {
    #[command(flatten)]
    pub common: Common,
    /// Folder for the plan and the recordings. Where a run was begun in it, it is gone on with.
    #[arg(long)]
    pub out: PathBuf,
    /// The machine (.toml): its axes, tip and commands, and how the limb stands; the paper's bench when left out.
    #[arg(long)]
    pub machine: Option<PathBuf>,
    /// Port of a printer that speaks Marlin's G-code: a serial port or HOST:PORT.
    #[arg(long)]
    pub printer: Option<String>,
    /// Port of the board that reads the gauges.
    #[arg(long)]
    pub board: Option<String>,
    /// Press on a simulated bench instead, as fast as it can be computed: the machine, the limb as a workshop builds it, and
    /// its board.
    #[arg(long, conflicts_with_all = ["printer", "board"])]
    pub simulate: bool,
    /// Somebody presses, one place after another: no machine. Where the board has no force sensor (that of --machine), write how
    /// hard each press was, or nothing where it was as hard as --force.
    #[arg(long, requires = "board", conflicts_with_all = ["printer", "simulate", "until", "plan_only"])]
    pub by_hand: bool,
    /// Places, evenly over what touches get to.
    #[arg(long, default_value_t = 300, value_parser = whole(1, 100_000))]
    pub places: usize,
    /// Places instead of even ones (.csv): `x_mm,y_mm,z_mm`.
    #[arg(long)]
    pub points: Option<PathBuf>,
    /// Between two readings (mm).
    #[arg(long, default_value_t = 0.15, value_parser = between(0.01, 5.0))]
    pub step: f64,
    /// How deep a place is pressed, from where it is first felt (mm).
    #[arg(long, default_value_t = 2.0, value_parser = between(0.01, 50.0))]
    pub depth: f64,
    /// The force that is enough (N): 25 by a machine, 10 by hand.
    #[arg(long, value_parser = between(0.1, 1e4))]
    pub force: Option<f64>,
    /// The force at which the machine stops and takes its tip back (N).
    #[arg(long, default_value_t = 35.0, value_parser = between(0.1, 1e4))]
    pub most_force: f64,
    /// Presses between two of the reference: a place that is pressed again and again, so that steps that a motor lost are noticed,
    /// and what was pressed since then is made again. 0: never.
    #[arg(long, default_value_t = 20, value_parser = whole(0, 100_000))]
    pub check: usize,
    /// Press where it tells most, in rounds, until nine of ten presses that nothing has learned from are found to this (mm),
    /// by matching as the others teach it. The places are what it chooses among.
    #[arg(long, value_name = "MM", value_parser = between(0.001, 1e3))]
    pub until: Option<f64>,
    /// Presses of a round: one in four is never learned from.
    #[arg(long, default_value_t = 16, value_parser = whole(2, 400))]
    pub round: usize,
    /// With --until: take the places in the order of the plan instead, to see what the choice saves.
    #[arg(long, requires = "until")]
    pub in_order: bool,
    /// Only write the plan, and say what of it is in reach and how long it takes.
    #[arg(long)]
    pub plan_only: bool,
    /// Rate of the printer's port (baud).
    #[arg(long, default_value_t = BAUD, value_parser = clap::value_parser!(u32).range(50..=20_000_000))]
    pub printer_baud: u32,
    /// Rate of the board's port (baud).
    #[arg(long, default_value_t = BAUD, value_parser = clap::value_parser!(u32).range(50..=20_000_000))]
    pub board_baud: u32,
    #[command(flatten)]
    pub faults: FaultArgs,
}

/// What is wrong with a simulated bench.
#[derive(Args, Debug, Clone)]
pub struct FaultArgs {
    /// What the simulated gauges are off by: exact, gains, or all (gains, places, directions).
    #[arg(long, default_value = "all", value_parser = workshop)]
    pub workshop: Workshop,
    /// Probability of a line to be lost on its way to the simulated printer, and of an answer to be lost on its way back.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 0.9))]
    pub lose: f64,
    /// Probability of a line or an answer to be damaged.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 0.9))]
    pub garble: f64,
    /// Probability, a line, that the simulated printer begins anew and forgets where it is.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 0.9))]
    pub reset: f64,
    /// Probability, a line, that it loses half of its steps and does not know.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 0.9))]
    pub stall: f64,
    /// How far the limb really stands from where it should (mm, across the table).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 100.0))]
    pub askew: f64,
}

impl CollectArgs {
    /// See [`Self::force`].
    pub(super) fn force_n(&self) -> f64 {
        self.force
            .unwrap_or(BenchRequest::usual_force(self.by_hand))
    }

    /// What is asked of the run.
    pub(super) fn asked(&self) -> BenchRequest {
        let faults = &self.faults;
        let flaws = || Flaws {
            workshop: faults.workshop,
            lose: faults.lose,
            garble: faults.garble,
            reset: faults.reset,
            stall: faults.stall,
            askew_mm: faults.askew,
        };
        BenchRequest {
            machine: self.machine.clone(),
            places: self.places,
            points: self.points.clone(),
            step_mm: self.step,
            depth_mm: self.depth,
            force_n: self.force_n(),
            most_force_n: self.most_force,
            // What only is planned is pressed nowhere.
            check: if self.plan_only { 0 } else { self.check },
            simulated: self.simulate.then(flaws),
            by_hand: self.by_hand,
        }
    }
}

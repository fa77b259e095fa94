//! What is asked of a run.

use std::path::PathBuf;

use crate::bench::PressLimits;
use crate::design::Workshop;

/// Where, how deep and how hard is pressed, and by what.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchRequest {
    /// The machine's file; the paper's bench without one.
    pub machine: Option<PathBuf>,
    /// Places, evenly over what touches get to.
    pub places: usize,
    /// A table of places instead of even ones.
    pub points: Option<PathBuf>,
    /// Between two readings (mm).
    pub step_mm: f64,
    /// How deep, from where it is first felt (mm).
    pub depth_mm: f64,
    /// What is enough (N).
    pub force_n: f64,
    /// What is never exceeded (N).
    pub most_force_n: f64,
    /// Presses between two of the place that is pressed again and again; 0 for never.
    pub check: usize,
    /// A simulated bench in place of a printer and a board, and what is wrong with it.
    pub simulated: Option<Flaws>,
    /// Somebody presses, and no machine: a machine's file only says what feels how hard.
    pub by_hand: bool,
}

impl Default for BenchRequest {
    fn default() -> Self {
        let limits = PressLimits::default();
        Self {
            machine: None,
            places: 300,
            points: None,
            step_mm: limits.step * 1e3,
            depth_mm: limits.depth * 1e3,
            force_n: limits.enough,
            most_force_n: limits.most_force,
            check: 20,
            simulated: None,
            by_hand: false,
        }
    }
}

impl BenchRequest {
    /// What is enough (N) unless something else is asked for: a hand presses less hard than a machine.
    #[must_use]
    pub fn usual_force(by_hand: bool) -> f64 {
        if by_hand {
            10.0
        } else {
            PressLimits::default().enough
        }
    }
}

/// What is wrong with a simulated bench: probabilities a line, but for the last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flaws {
    /// What its gauges are off by.
    pub workshop: Workshop,
    /// To be lost on the way, either way.
    pub lose: f64,
    /// To be damaged.
    pub garble: f64,
    /// That the printer begins anew.
    pub reset: f64,
    /// That it loses steps.
    pub stall: f64,
    /// How far the limb stands from where it should (mm).
    pub askew_mm: f64,
}

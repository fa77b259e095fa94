//! The test-bed: a machine that presses a limb at known places, without any port.
//!
//! A [`Machine`] knows how its axes move a tip about a limb that it turns, a [`TableMount`] how the limb stands in it. The
//! [`Collector`] goes through a plan of presses: it is given what machine and board say and answers what the machine is to be
//! told, so that a real printer, and a simulated one in its own time, are driven by the same code.

mod check;
mod collector;
mod contact;
mod machine;
mod marlin;
mod mount;
mod plan;
mod press;
mod printer;

pub use check::{CheckPlace, CheckedForce};
pub use collector::{Collector, CollectorNews, RunEnd};
pub use contact::ContactLaw;
pub use machine::{Machine, MachineAxis, Pose, TipSensor};
pub use marlin::{MachineReply, Marlin, position_in};
pub use mount::{TableMount, TouchedPoint};
pub use plan::{MachineReach, Planned, plan};
pub use press::{PressLimits, SampleMean};
pub use printer::{PrinterFaults, SimulatedPrinter};

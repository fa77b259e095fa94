//! `HapDef`: where a handful of strain gauges go inside a flexible robot limb.
//!
//! The core (everything but `io`, `job`, `link`, `document`, `render`, `session`, `cli` and `studio`) is pure: no file, no
//! clock, no thread of its own, no global random state. SI units throughout (m, N, Pa, strain as a ratio).

// Every public item of the core says what it is: the compiler holds that. What lies around it is for the program alone.
#![warn(missing_docs)]

pub mod board;
mod bounds;
pub mod budget;
#[allow(missing_docs)]
pub mod cli;
pub mod colormap;
pub mod dataset;
pub mod design;
#[allow(missing_docs)]
pub mod document;
mod draw;
mod eigen;
pub mod elasticity;
pub mod evaluation;
pub mod feasible;
pub mod gaussian_process;
pub mod given;
pub mod inference;
#[allow(missing_docs)]
pub mod io;
#[allow(missing_docs)]
pub mod job;
mod lanes;
pub mod limb;
#[allow(missing_docs)]
pub mod link;
pub mod live;
pub mod memory;
pub mod mesh;
pub mod pca;
pub mod placement;
pub mod plain;
pub mod project;
pub mod regression;
#[allow(missing_docs)]
pub mod render;
#[allow(missing_docs)]
pub mod session;
mod statistics;
#[cfg(feature = "studio")]
#[allow(missing_docs)]
pub mod studio;
pub mod study;
pub mod tally;
pub mod trade;
pub mod uncertainty;
pub mod wire;

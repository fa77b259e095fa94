//! `HapDef`: where a handful of strain gauges go inside a flexible robot limb.
//!
//! The core (everything but `io`, `job`, `link`, `document`, `render`, `session`, `cli` and `studio`) is pure: no file, no
//! clock, no thread of its own, no global random state. SI units throughout (m, N, Pa, strain as a ratio).

pub mod board;
mod bounds;
pub mod budget;
pub mod cli;
pub mod colormap;
pub mod dataset;
pub mod design;
pub mod document;
mod draw;
mod eigen;
pub mod elasticity;
pub mod evaluation;
pub mod feasible;
pub mod gaussian_process;
pub mod given;
pub mod inference;
pub mod io;
pub mod job;
mod lanes;
pub mod limb;
pub mod link;
pub mod live;
pub mod memory;
pub mod mesh;
pub mod pca;
pub mod placement;
pub mod plain;
pub mod project;
pub mod regression;
pub mod render;
pub mod session;
mod statistics;
#[cfg(feature = "studio")]
pub mod studio;
pub mod study;
pub mod tally;
pub mod trade;
pub mod uncertainty;
pub mod wire;

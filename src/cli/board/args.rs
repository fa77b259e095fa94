//! What a simulated board can be asked for.

use std::path::PathBuf;

use clap::Args;

use super::disturbed::{DisturbanceArgs, MOST_MICROSTRAIN};
use crate::board::{Fault, PRESSES};
use crate::cli::common::Common;
use crate::cli::ranges::{between, whole};
use crate::design::Workshop;
use crate::uncertainty::Making;
use crate::wire::MOST_CHANNELS;

#[derive(Args, Debug, Clone)]
pub struct BoardArgs {
    #[command(flatten)]
    pub common: Common,
    /// Simulate one; without it, the ports of this machine are listed, the likeliest board first.
    #[arg(long)]
    pub simulate: bool,
    /// Listen at a socket instead of a pseudo-terminal: HOST:PORT, port 0 for any that is free.
    #[arg(long, num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    pub tcp: Option<String>,
    /// Write what it sends into a recording (.hapdrec) instead, with the truth, without waiting for the time to pass.
    #[arg(long, requires = "simulate", conflicts_with = "tcp")]
    pub record: Option<PathBuf>,
    /// Samples a second, until the studio asks for others.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    pub rate: u16,
    /// Channels; as many as gauges when left out.
    #[arg(long, value_parser = whole(1, MOST_CHANNELS as u64))]
    pub channels: Option<usize>,
    /// Bits of the converter.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u8).range(1..=24))]
    pub bits: u8,
    /// Of the amplifier; as large as the hardest press allows when left out.
    #[arg(long, value_parser = between(1.0, 1e5))]
    pub gain: Option<f64>,
    /// Standard deviation of a reading (microstrain); the project's when left out.
    #[arg(long, value_parser = between(0.0, MOST_MICROSTRAIN))]
    pub noise: Option<f64>,
    /// What readings drift by in a second (microstrain).
    #[arg(long, default_value_t = 0.1, value_parser = between(0.0, MOST_MICROSTRAIN))]
    pub drift: f64,
    /// What the gauges are off by: exact, gains, or all (gains, places, directions); as far as gauge.tolerance says.
    #[arg(long, default_value = "all", value_parser = workshop)]
    pub workshop: Workshop,
    /// Smallest and largest force of random touches (N).
    #[arg(long, num_args = 2, default_values_t = [2.0, 15.0], value_parser = between(*PRESSES.start(), *PRESSES.end()))]
    pub force: Vec<f64>,
    /// Shortest and longest time in which random touches rise and fall (ms).
    #[arg(long, num_args = 2, default_values_t = [80.0, 80.0], value_parser = between(0.1, 1e4))]
    pub ramp: Vec<f64>,
    /// How far random touches may push aside (degrees off the upright, in any direction).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 80.0))]
    pub tilt: f64,
    /// How much of their force random touches push along the surface with (%, rms, in any direction); the project's when
    /// left out.
    #[arg(long, value_parser = between(0.0, 100.0))]
    pub friction: Option<f64>,
    /// How far off the radius of their tips is (mm, standard deviation); the project's when left out.
    #[arg(long, value_parser = between(0.0, 100.0))]
    pub tip_tolerance: Option<f64>,
    #[command(flatten)]
    pub disturbed: DisturbanceArgs,
    /// Touches instead of random ones (.csv): `start_s,duration_s,x_mm,y_mm,z_mm,force_n`, and if wanted
    /// `ramp_ms,tilt_deg,towards_deg,radius_mm`; they may overlap.
    #[arg(long)]
    pub script: Option<PathBuf>,
    /// Where the truth is written (.csv): `t_us,x_mm,y_mm,z_mm,force_n`, empty where nothing touches. Where touches
    /// overlap or push aside, these are of the hardest, and `fx_n,fy_n,fz_n,touches` of all follow.
    #[arg(long)]
    pub truth: Option<PathBuf>,
    /// A channel (from 0) that fails, or an unplug: `dead:7@5`, `stuck:2@3+4`, `saturated:1`, `noisy:0`, `unplug@10+1`.
    #[arg(long)]
    pub fault: Vec<Fault>,
    /// Probability of a byte to have a bit turned over.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub flip: f64,
    /// Probability of a byte to be left out.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub drop: f64,
    /// Probability of a frame to come twice.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub duplicate: f64,
    /// Probability of a frame to be lost.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub lose: f64,
    /// Seconds after which it ends by itself; a recording ends a second after the last touch of a script.
    #[arg(long, value_parser = between(0.0, 1e9))]
    pub seconds: Option<f64>,
}

impl BoardArgs {
    /// How far off random touches are made, where the project says so much.
    #[must_use]
    pub fn making(&self, usual: &Making) -> Making {
        Making {
            tip: self.tip_tolerance.map_or(usual.tip, |mm| mm * 1e-3),
            friction: self
                .friction
                .map_or(usual.friction, |percent| percent / 100.0),
        }
    }
}

/// What the gauges are off by, as it is written.
///
/// # Errors
/// The words that there are.
pub fn workshop(text: &str) -> Result<Workshop, String> {
    match text {
        "exact" => Ok(Workshop::Exact),
        "gains" => Ok(Workshop::Gains),
        "all" => Ok(Workshop::All),
        _ => Err("choose exact, gains or all".into()),
    }
}

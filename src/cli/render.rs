//! `hapdef render`: what is asked of a picture of the limb. The studio draws it.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};

use super::common::{Common, UnitArg};

#[derive(Args, Debug, Clone)]
pub struct RenderArgs {
    /// Project or mesh; the bundled limb when left out.
    pub project: Option<PathBuf>,
    /// The side to look from.
    #[arg(long, value_enum, default_value_t)]
    pub view: ViewArg,
    /// Width and height in pixels, such as 3840x2160.
    #[arg(long, default_value = "1920x1080")]
    pub size: Size,
    /// What is behind the limb.
    #[arg(long, value_enum, default_value_t)]
    pub backdrop: BackdropArg,
    /// Leave the background transparent.
    #[arg(long, conflicts_with = "backdrop")]
    pub transparent: bool,
    /// Leave the limb's shadow on the floor out.
    #[arg(long)]
    pub no_floor: bool,
    /// Unit of a mesh file that does not say its own.
    #[arg(long)]
    pub unit: Option<UnitArg>,
    /// The limb turns once about its axis in so many seconds, such as 4s: an animated PNG.
    #[arg(long, value_parser = seconds)]
    pub turn: Option<f64>,
    /// The picture (.png, or .apng where it turns).
    #[arg(long)]
    pub out: PathBuf,
}

/// Seconds, with or without their unit.
fn seconds(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('s').trim().parse() {
        Ok(seconds) if (0.5..=60.0).contains(&seconds) => Ok(seconds),
        _ => Err("a turn takes 0.5 to 60 seconds, such as 4s".into()),
    }
}

#[derive(ValueEnum, Debug, Clone, Copy, Default)]
pub enum ViewArg {
    /// Three-quarters, from above.
    #[default]
    Oblique,
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
}

#[derive(ValueEnum, Debug, Clone, Copy, Default)]
pub enum BackdropArg {
    /// As the window at night.
    #[default]
    Dark,
    /// A light grey that prints well.
    Neutral,
}

/// Width and height in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size(pub [u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("“{text}” is no size in pixels: give WIDTHxHEIGHT, such as 1920x1080");
        let (width, height) = text.split_once(['x', '×']).ok_or_else(wrong)?;
        let pixels = |side: &str| side.trim().parse().ok().filter(|&p| p > 0);
        match (pixels(width), pixels(height)) {
            (Some(width), Some(height)) => Ok(Self([width, height])),
            _ => Err(wrong()),
        }
    }
}

impl RenderArgs {
    /// What it shares with other commands.
    #[must_use]
    pub fn common(&self) -> Common {
        Common {
            project: self.project.clone(),
            unit: self.unit,
            ..Common::default()
        }
    }
}

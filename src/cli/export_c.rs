//! `hapdef export-c`: a trained estimator as C source for the board.

use std::path::PathBuf;

use anyhow::ensure;
use clap::{Args, ValueEnum};
use serde_json::json;

use super::common::make_folder;
use super::out;
use crate::design::Learned;
use crate::io::touch_file;
use crate::io::touch_source::{AGREES_MM, EstimatorSource, FILES};
use crate::learning::portable::Precision;
use crate::plain;

#[derive(Args, Debug, Clone)]
pub struct ExportCArgs {
    /// The estimator (.hapdtouch), as `hapdef train` writes it.
    #[arg(long)]
    pub model: PathBuf,
    /// Folder for touch.h, touch.c and `touch_test.c`.
    #[arg(long)]
    pub out: PathBuf,
    /// Numbers on the board: single precision where its answers agree with the program's to half a hundredth of a
    /// millimetre, else double.
    #[arg(long, value_enum, default_value_t)]
    pub precision: PrecisionArg,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PrecisionArg {
    #[default]
    Auto,
    Single,
    Double,
}

impl PrecisionArg {
    fn asked(self) -> Option<Precision> {
        match self {
            Self::Auto => None,
            Self::Single => Some(Precision::Single),
            Self::Double => Some(Precision::Double),
        }
    }
}

/// Touches that a 16-bit number counts.
const MOST_TOUCHES: usize = 65_535;

/// Flash of the authors' board (bytes).
const DUE: usize = 512 * 1024;

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &ExportCArgs) -> anyhow::Result<()> {
    let file = touch_file::read(&args.model)?;
    let Learned::Regression(estimator) = &file.estimator else {
        anyhow::bail!(
            "{}: matching with a model of the part runs in `hapdef listen`, and on no board yet. Train a regression (hapdef train without --project)",
            args.model.display()
        );
    };
    let touches = estimator.place.points.nrows();
    ensure!(
        touches <= MOST_TOUCHES,
        "the estimator knows {touches} touches, and a board's table at most {MOST_TOUCHES}: train it on fewer (--train-touches)"
    );
    make_folder(&args.out)?;
    let source = EstimatorSource::new(estimator, args.precision.asked());
    let origin = &file.header.origin;
    let about = format!(
        "Touch from readings, by hapdef {}: {}, trained on {} touches of {}, {:.2} mm off on touches of no training.",
        env!("CARGO_PKG_VERSION"),
        origin.estimator.name(),
        origin.train_touches,
        plain::quote(&origin.data),
        origin.test.mean_mm
    );
    // A comment ends with these.
    source.write(&args.out, &about.replace("*/", "* /"))?;
    let needs = source.needs();
    let precision = match source.precision {
        Precision::Single => "single",
        Precision::Double => "double",
    };
    if args.json {
        let said = json!({
            "precision": precision,
            "flash_bytes": needs.flash,
            "stack_bytes": needs.stack,
            "operations": needs.operations,
            "functions": needs.functions,
            "off_mm": source.off_mm,
            "files": FILES.map(|name| args.out.join(name)),
        });
        return out::line(&said.to_string());
    }
    out::line(&format!(
        "{precision} precision: {:.1} kB of flash for tables, about {} bytes of stack, about {} operations and {} exponentials or roots a sample; answers {:.1e} mm off those of the program",
        needs.flash as f64 / 1e3,
        needs.stack,
        needs.operations,
        needs.functions,
        source.off_mm
    ))?;
    if needs.flash > DUE {
        out::say(
            "note: an Arduino Due has 512 kB of flash in all: train on fewer touches (--train-touches)",
        );
    }
    if source.off_mm > AGREES_MM {
        out::say(&format!(
            "note: answers are farther off than {AGREES_MM} mm: take --precision double"
        ));
    }
    for name in FILES {
        out::say(&format!("wrote {}", args.out.join(name).display()));
    }
    Ok(())
}

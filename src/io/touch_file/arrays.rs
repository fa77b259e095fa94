//! The arrays of a trained estimator's file.

use std::path::Path;

use faer::Mat;

use super::header::{MachineEntry, RegressionEntry};
use crate::io::FileError;
use crate::io::npz::{Arrays, NpzFile};
use crate::learning::TouchEstimator;
use crate::learning::doubt::ErrorModel;
use crate::learning::estimator::ForceEstimator;
use crate::learning::inputs::ChannelScales;
use crate::learning::machine::{AnswerRule, Regression};
use crate::regression::Standardizer;

/// Adds what an estimator is made of.
pub fn add(file: &mut NpzFile, estimator: &TouchEstimator) -> std::io::Result<()> {
    let ChannelScales {
        middle,
        spread,
        standard,
    } = &estimator.inputs;
    let channels = [
        ("channel_middle", middle),
        ("channel_spread", spread),
        ("channel_mean", &standard.mean),
        ("channel_deviation", &standard.deviation),
    ];
    for (name, values) in channels {
        file.add(name, &[values.len()], values)?;
    }
    add_machine(file, "place", &estimator.place)?;
    let off = &estimator.doubt.off;
    file.add("place_off", &[off.len()], off)?;
    if let Some(force) = &estimator.force {
        add_machine(file, "force", &force.machine)?;
    }
    Ok(())
}

fn add_machine(file: &mut NpzFile, of: &str, machine: &Regression) -> std::io::Result<()> {
    let name = |what: &str| format!("{of}_{what}");
    let lengths = &machine.lengths;
    file.add(&name("lengths"), &[lengths.len()], lengths)?;
    add_matrix(file, &name("points"), &machine.points)?;
    match &machine.by {
        AnswerRule::Kernel { weights, bias, .. } => {
            add_matrix(file, &name("weights"), weights)?;
            file.add(&name("bias"), &[bias.len()], bias)
        }
        AnswerRule::Nearest { outputs, .. } => add_matrix(file, &name("outputs"), outputs),
    }
}

fn add_matrix(file: &mut NpzFile, name: &str, of: &Mat<f64>) -> std::io::Result<()> {
    let values: Vec<f64> = (of.row_iter())
        .flat_map(|row| row.iter().copied().collect::<Vec<_>>())
        .collect();
    file.add(name, &[of.nrows(), of.ncols()], &values)
}

/// Puts an estimator together again.
pub fn read(
    path: &Path,
    arrays: &mut Arrays,
    channels: usize,
    header: &RegressionEntry,
) -> Result<TouchEstimator, FileError> {
    let mut from = Checked { path, arrays };
    let inputs = ChannelScales {
        middle: from.list("channel_middle", Some(channels))?,
        spread: from.list("channel_spread", Some(channels))?,
        standard: Standardizer {
            mean: from.list("channel_mean", Some(channels))?,
            deviation: from.list("channel_deviation", Some(channels))?,
        },
    };
    let live = inputs.live().len();
    let frame = header.frame();
    let place = from.machine("place", &header.place, live, frame.axes.len())?;
    let doubt = ErrorModel {
        off: from.list("place_off", Some(place.points.nrows()))?,
        usual: header.doubt.usual,
        factor: header.doubt.factor,
    };
    let force = match &header.force {
        None => None,
        Some(entry) => Some(ForceEstimator {
            family: entry.estimator,
            scale: entry.scale(),
            machine: from.machine("force", &entry.machine, live, 1)?,
        }),
    };
    Ok(TouchEstimator {
        inputs,
        frame,
        place,
        doubt,
        force,
    })
}

/// Arrays whose shapes are checked as they are read.
struct Checked<'a> {
    path: &'a Path,
    arrays: &'a mut Arrays,
}

impl Checked<'_> {
    /// Finite numbers, of one dimension, so many where that is known.
    fn list(&mut self, name: &str, wanted: Option<usize>) -> Result<Vec<f64>, FileError> {
        let array = self.arrays.numbers(name)?;
        let fits = array.shape.len() == 1 && wanted.is_none_or(|n| n == array.values.len());
        self.check(name, fits, &array.shape, wanted.as_slice())?;
        self.finite(name, array.values)
    }

    /// Finite numbers by rows, of so many rows (where that is known) and columns.
    fn matrix(
        &mut self,
        name: &str,
        rows: Option<usize>,
        columns: usize,
    ) -> Result<Mat<f64>, FileError> {
        let array = self.arrays.numbers(name)?;
        let fits = matches!(array.shape[..], [r, c] if c == columns && rows.is_none_or(|n| n == r));
        let wanted: Vec<usize> = rows.into_iter().chain([columns]).collect();
        self.check(name, fits, &array.shape, &wanted)?;
        let rows = array.shape[0];
        let values = self.finite(name, array.values)?;
        Ok(Mat::from_fn(rows, columns, |r, c| values[r * columns + c]))
    }

    fn machine(
        &mut self,
        of: &str,
        entry: &MachineEntry,
        features: usize,
        outputs: usize,
    ) -> Result<Regression, FileError> {
        let name = |what: &str| format!("{of}_{what}");
        let lengths = self.list(&name("lengths"), Some(features))?;
        if let Some(length) = lengths.iter().find(|l| **l <= 0.0) {
            return Err(self.broken(&format!("a length of {of} is {length:e}")));
        }
        let points = self.matrix(&name("points"), None, features)?;
        let touches = points.nrows();
        if touches == 0 || features == 0 {
            return Err(self.broken(&format!("{of} knows no touch")));
        }
        let by = match entry {
            MachineEntry::Kernel(kernel) => AnswerRule::Kernel {
                kernel: *kernel,
                weights: self.matrix(&name("weights"), Some(touches), outputs)?,
                bias: self.list(&name("bias"), Some(outputs))?,
            },
            MachineEntry::Nearest(0) => {
                return Err(self.broken(&format!("{of} asks none of the nearest touches")));
            }
            MachineEntry::Nearest(count) => AnswerRule::Nearest {
                outputs: self.matrix(&name("outputs"), Some(touches), outputs)?,
                count: *count,
            },
        };
        Ok(Regression {
            lengths,
            points,
            by,
        })
    }

    fn check(
        &self,
        name: &str,
        fits: bool,
        found: &[usize],
        wanted: &[usize],
    ) -> Result<(), FileError> {
        if fits {
            return Ok(());
        }
        let sizes = |s: &[usize]| {
            let all: Vec<String> = s.iter().map(ToString::to_string).collect();
            all.join(" × ")
        };
        Err(self.broken(&format!(
            "the array {name} has {} values and not {}",
            sizes(found),
            sizes(wanted)
        )))
    }

    fn finite(&self, name: &str, values: Vec<f64>) -> Result<Vec<f64>, FileError> {
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(values),
            Some(at) => Err(self.broken(&format!("value {at} of the array {name} is no number"))),
        }
    }

    fn broken(&self, what: &str) -> FileError {
        FileError::broken(self.path, format!("{what}. Train it again"))
    }
}

//! Trained estimators as files (`.hapdtouch`): an NPZ whose array `header` is JSON, byte by byte.
//!
//! In `NumPy`: `f = np.load("m.hapdtouch"); json.loads(bytes(f["header"]))`. Version 1 holds, in units of their own (see
//! the frame in the header):
//!
//! | array | shape | is |
//! |---|---|---|
//! | `header` | bytes | [`EstimatorHeader`] |
//! | `channel_middle`, `channel_spread` | channels | asinh((reading - middle) / spread); spread 0: left out |
//! | `channel_mean`, `channel_deviation` | channels | what that is standardized by; 0: left out |
//! | `place_lengths` | features | what each feature is divided by |
//! | `place_points` | touches × features | known touches, over the lengths |
//! | `place_weights`, `place_bias` | touches × outputs, outputs | of kernels |
//! | `place_outputs` | touches × outputs | of the nearest |
//! | `place_off` | touches | squared error where the touch was left out |
//! | `force_…` | | the same, with one output |
//!
//! Version 2 is of matching by a map that presses have taught, in metres, newtons and strain:
//!
//! | array | shape | is |
//! |---|---|---|
//! | `header` | bytes | [`EstimatorHeader`] |
//! | `map_positions`, `map_triangles` | × 3 | the surface that readings are known on |
//! | `readings` | maps × nodes × channels | of a newton at the vertices and the middles of the edges: what it reads, how far off that may be, then by the tip's size (1) and along the axes (3) where `asked` has them |
//! | `ratios` | touches | errors over the radius, of touches that nothing was learned from |

mod arrays;
mod header;
mod taught_map;

use std::path::Path;

use super::FileError;
use super::npz::{Arrays, NpzFile};
use crate::design::Learned;

use self::header::EstimatorSection;
pub use self::header::{EstimatorHeader, TrainingOrigin, UpdateSection, fingerprint};

/// An estimator with what is known of it.
#[derive(Clone, Debug)]
pub struct TouchFile {
    /// Where it comes from and how well it does.
    pub header: EstimatorHeader,
    /// What answers.
    pub estimator: Learned,
}

/// Writes an estimator.
///
/// # Errors
/// [`FileError`] naming the file.
pub fn write(path: &Path, origin: TrainingOrigin, estimator: &Learned) -> Result<(), FileError> {
    let header = EstimatorHeader::new(origin, estimator);
    let text = serde_json::to_string(&header)
        .map_err(|e| FileError::broken(path, format!("the header cannot be written: {e}")))?;
    let build = || -> std::io::Result<NpzFile> {
        let mut file = NpzFile::default();
        file.add("header", &[text.len()], text.as_bytes())?;
        match estimator {
            Learned::Regression(estimator) => arrays::add(&mut file, estimator)?,
            Learned::Matching(taught) => taught_map::add(&mut file, taught)?,
        }
        Ok(file)
    };
    build().map_err(|e| FileError::of(path, &e))?.save(path)
}

/// Reads an estimator.
///
/// # Errors
/// [`FileError`] naming the file, what is wrong with it and what to do.
pub fn read(path: &Path) -> Result<TouchFile, FileError> {
    let cure = "it may be cut off, or another file. Make one with hapdef train";
    let mut found = Arrays::open_as(path, ("trained estimator", cure))?;
    if !found.holds("header") {
        return Err(FileError::broken(
            path,
            "this is no trained estimator: it has no header. Make one with hapdef train",
        ));
    }
    let header = EstimatorHeader::read(path, &found.numbers("header")?.values)?;
    let estimator = match &header.by {
        EstimatorSection::Regression(entry) => {
            let estimator = arrays::read(path, &mut found, header.channels, entry)?;
            Learned::Regression(Box::new(estimator))
        }
        EstimatorSection::Matching(known) => {
            let taught = taught_map::read(path, &mut found, header.channels, known.matching)?;
            Learned::Matching(Box::new(taught))
        }
    };
    Ok(TouchFile { header, estimator })
}

impl TouchFile {
    /// That it was learned on this limb, as far as it is known.
    ///
    /// # Errors
    /// A message that says so.
    pub fn check_limb(&self, limb: &str) -> Result<(), String> {
        match &self.header.origin.limb {
            Some(own) if own != limb => Err(
                "the estimator was learned on another limb, or with other gauges on it: train one on presses of this limb".into(),
            ),
            _ => Ok(()),
        }
    }

    /// That it was learned with this board, as far as it is known.
    ///
    /// # Errors
    /// A message that says both.
    pub fn check_board(&self, board: &str) -> Result<(), String> {
        match &self.header.origin.board {
            Some(own) if own != board => Err(format!(
                "the estimator was learned with the board {}, and this is {board}: its amplifiers are others. Train one with this board",
                crate::plain::quote(own)
            )),
            _ => Ok(()),
        }
    }

    /// That readings of so many channels are what it learned from.
    ///
    /// # Errors
    /// A message that says both numbers.
    pub fn check_channels(&self, channels: usize) -> Result<(), String> {
        let own = self.estimator.channels();
        if channels == own {
            return Ok(());
        }
        Err(format!(
            "the estimator was trained on {} ({}), and there are {channels} here: train one on this board",
            crate::plain::count(own, "channel"),
            crate::plain::quote(&self.header.origin.data)
        ))
    }
}

#[cfg(test)]
mod tests;

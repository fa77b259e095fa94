//! The arrays of matching by a map that presses have taught.

use std::path::Path;
use std::sync::Arc;

use crate::design::{Taught, TaughtKnowledge};
use crate::io::FileError;
use crate::io::npz::{Arrays, NpzFile};
use crate::io::response_maps::{self, Maps};

/// Adds what matching is made of.
pub fn add(file: &mut NpzFile, taught: &Taught) -> std::io::Result<()> {
    let own = [&*taught.map, &*taught.own];
    file.add("ratios", &[taught.ratios.len()], &taught.ratios)?;
    response_maps::add(file, &own, taught.tip.as_deref(), taught.axes.as_deref())
}

/// Puts it together again.
pub fn read(
    path: &Path,
    arrays: &mut Arrays,
    channels: usize,
    known: TaughtKnowledge,
) -> Result<Taught, FileError> {
    let maps = response_maps::read(arrays, 2, channels);
    let sound = |m: &Maps| m.own[1].values().iter().all(|v| *v >= 0.0);
    let damaged = |what: &str| FileError::broken(path, format!("{what}. Train it again"));
    let Some(Maps { mut own, tip, axes }) = maps.filter(sound) else {
        return Err(damaged(
            "its map of readings is damaged, or of another number of channels",
        ));
    };
    let ratios = arrays.numbers("ratios")?.values;
    if ratios.iter().any(|r| !r.is_finite()) {
        return Err(damaged("a value of the array ratios is no number"));
    }
    let deviation = own.remove(1);
    Ok(Taught {
        map: Arc::new(own.remove(0)),
        own: Arc::new(deviation),
        tip,
        axes,
        known,
        ratios,
    })
}

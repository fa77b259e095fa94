//! A recording as other files: what its counts mean is computed anew.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use super::{Address, Listener, McapLog, Pace, SampleTable, SessionEvent};
use crate::live::Pipeline;

/// Replays a recording as fast as it goes; what is done with an event may end it.
fn replay(
    recording: &Path,
    pipeline: Pipeline,
    mut take: impl FnMut(&SessionEvent) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let address = Address::Recording {
        path: recording.to_owned(),
        pace: Pace::Fast,
    };
    let (_commands, inbox) = channel();
    let stop = AtomicBool::new(false);
    let mut taken: anyhow::Result<()> = Ok(());
    Listener::new(address, pipeline)
        .run(&stop, &inbox, |event| {
            if taken.is_ok() {
                taken = take(&event);
                stop.store(taken.is_err(), Ordering::Relaxed);
            }
        })
        .map_err(anyhow::Error::msg)?;
    taken
}

/// Replays a recording into a table, in place of an older one; the files that it takes, more than one where the number of
/// channels changes.
///
/// # Errors
/// When the one cannot be read or the other not written.
pub fn write_table(
    recording: &Path,
    table: &Path,
    pipeline: Pipeline,
) -> anyhow::Result<Vec<PathBuf>> {
    let mut rows = SampleTable::replace(table)?;
    replay(recording, pipeline, |event| {
        match event {
            SessionEvent::Truth(touch) => rows.truth = *touch,
            SessionEvent::Sample { sample, update, .. } => drop(rows.take(sample, update)?),
            _ => {}
        }
        Ok(())
    })?;
    rows.flush()?;
    Ok(rows.paths)
}

/// Replays a recording into a file of messages.
///
/// # Errors
/// When the one cannot be read or the other not written.
pub fn write_messages(
    recording: &Path,
    mut log: McapLog,
    pipeline: Pipeline,
) -> anyhow::Result<()> {
    replay(recording, pipeline, |event| {
        if let SessionEvent::Sample { update, .. } = event {
            log.sample(update).map_err(anyhow::Error::msg)?;
        }
        Ok(())
    })?;
    log.finish().map_err(anyhow::Error::msg)
}

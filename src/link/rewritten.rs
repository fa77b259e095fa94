//! A recording as other files: what its counts mean is computed anew.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::channel;

use anyhow::Context as _;

use super::{Address, Listener, McapLog, Pace, RecordingExtent, SampleTable, SessionEvent};
use crate::budget::{Watch, report};
use crate::live::Pipeline;

/// Samples between two reports.
const TOLD_EVERY: usize = 200;

/// Replays a recording of so many samples as fast as it goes; what is done with an event may end it, and so may who watches.
fn replay(
    recording: &Path,
    all: usize,
    pipeline: Pipeline,
    watch: Watch,
    mut take: impl FnMut(&SessionEvent) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let address = Address::Recording {
        path: recording.to_owned(),
        pace: Pace::Fast,
    };
    let (_commands, inbox) = channel();
    let stop = AtomicBool::new(false);
    let mut taken: anyhow::Result<()> = Ok(());
    let mut samples = 0;
    let mut go_on = |event: &SessionEvent| {
        if let SessionEvent::Sample { .. } = event {
            samples += 1;
            if samples % TOLD_EVERY == 0 {
                report(watch, "Replay", samples.min(all), all)?;
            }
        }
        take(event)
    };
    Listener::new(address, pipeline)
        .run(&stop, &inbox, |event| {
            if taken.is_ok() {
                taken = go_on(&event);
                stop.store(taken.is_err(), Ordering::Relaxed);
            }
        })
        .map_err(anyhow::Error::msg)?;
    taken?;
    // Nothing is replaced by what somebody has cancelled.
    Ok(report(watch, "Replay", all, all)?)
}

/// A file beside another, for what is not whole yet: nobody else writes one of this name.
fn aside(path: &Path) -> PathBuf {
    static BEGUN: AtomicUsize = AtomicUsize::new(0);
    let number = BEGUN.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}-{number}.part", std::process::id()))
}

fn unwritten(path: &Path) -> String {
    format!(
        "{}: it was not written, and what may have been there stays",
        path.display()
    )
}

/// Replays a recording into a table, in place of an older one; the files that it takes, more than one where the number of
/// channels changes. Until it is whole the older one stays.
///
/// # Errors
/// When the one cannot be read or the other not written; [`crate::budget::Cancelled`].
pub fn write_table(
    recording: &Path,
    table: &Path,
    pipeline: Pipeline,
    watch: Watch,
) -> anyhow::Result<Vec<PathBuf>> {
    let extent = RecordingExtent::of(recording).map_err(anyhow::Error::msg)?;
    let mut rows = SampleTable::replace(&aside(table)).with_context(|| unwritten(table))?;
    let written = replay(recording, extent.samples, pipeline, watch, |event| {
        match event {
            SessionEvent::Truth(touch) => rows.truth = *touch,
            SessionEvent::Sample { sample, update, .. } => drop(rows.take(sample, update)?),
            _ => {}
        }
        Ok(())
    });
    let named = written.and_then(|()| rows.name(table));
    if named.is_err() {
        rows.discard();
    }
    named.with_context(|| unwritten(table))
}

/// Replays a recording into a file of messages (MCAP), in place of an older one; `link` is the frame that places are in. Until
/// it is whole the older one stays.
///
/// # Errors
/// When the one cannot be read or the other not written; [`crate::budget::Cancelled`].
pub fn write_messages(
    recording: &Path,
    (path, link): (&Path, &str),
    pipeline: Pipeline,
    watch: Watch,
) -> anyhow::Result<()> {
    let extent = RecordingExtent::of(recording).map_err(anyhow::Error::msg)?;
    let begun = aside(path);
    let log = McapLog::replace(&begun, link).map_err(anyhow::Error::msg);
    let mut log = log.with_context(|| unwritten(path))?;
    log.began(extent.began_ns);
    let written = replay(recording, extent.samples, pipeline, watch, |event| {
        log.event(event).map_err(anyhow::Error::msg)
    });
    let written = written
        .and_then(|()| log.finish().map_err(anyhow::Error::msg))
        .and_then(|()| Ok(std::fs::rename(&begun, path)?));
    if written.is_err() {
        let _ = std::fs::remove_file(&begun);
    }
    written.with_context(|| unwritten(path))
}

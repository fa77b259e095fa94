//! What bytes come from and go to.

use std::time::Instant;

/// What one look at a port brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Got {
    Bytes(usize),
    /// Not yet.
    Nothing,
    /// The other side is gone: unplugged, or the end of a recording.
    Gone,
}

impl Got {
    /// What a read says: a hang-up reads as nothing for ever, and a wait that was in vain is none.
    pub(super) fn of(read: std::io::Result<usize>) -> Self {
        use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
        match read {
            Ok(0) => Self::Gone,
            Ok(count) => Self::Bytes(count),
            Err(e) if matches!(e.kind(), TimedOut | WouldBlock | Interrupted) => Self::Nothing,
            Err(_) => Self::Gone,
        }
    }
}

/// Somewhere that bytes come from and go to.
pub trait Port: Send {
    /// Waits a few milliseconds at most.
    fn read(&mut self, buffer: &mut [u8]) -> Got;
    /// When what was read last came.
    fn came(&self) -> Instant {
        Instant::now()
    }
    /// Best effort: a port that takes nothing is found out by reading.
    fn write(&mut self, bytes: &[u8]);
}

/// How fast a recording is replayed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// As it was.
    #[default]
    Real,
    /// As fast as it can be read.
    Fast,
}

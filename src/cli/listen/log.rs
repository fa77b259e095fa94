//! Touches as a file of messages, where this build can write one.

#[cfg(feature = "mcap")]
pub(super) use crate::link::McapLog as Log;

/// There is none in this build.
#[cfg(not(feature = "mcap"))]
pub(super) enum Log {}

#[cfg(not(feature = "mcap"))]
impl Log {
    pub fn create(_: &std::path::Path, _: &str) -> Result<Self, String> {
        Err("this build writes no MCAP (feature \"mcap\")".into())
    }

    pub fn sample(&mut self, _: &crate::live::LiveUpdate) -> Result<(), String> {
        match *self {}
    }

    pub fn finish(&mut self) -> Result<(), String> {
        match *self {}
    }
}

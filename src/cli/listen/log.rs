//! Touches as messages: in a file and to whoever looks, where this build has that.

#[cfg(feature = "foxglove")]
pub(super) use crate::link::FoxgloveServer;

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

/// There is none in this build.
#[cfg(not(feature = "foxglove"))]
pub(super) enum FoxgloveServer {}

#[cfg(not(feature = "foxglove"))]
impl FoxgloveServer {
    pub fn open(_: &str, _: &str) -> Result<Self, String> {
        Err("this build does not speak to Foxglove (feature \"foxglove\")".into())
    }

    pub fn address(&self) -> Option<std::net::SocketAddr> {
        match *self {}
    }

    pub fn turn(&mut self) {
        match *self {}
    }

    pub fn sample(&mut self, _: &crate::live::LiveUpdate) {
        match *self {}
    }
}

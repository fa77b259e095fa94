//! What a build was made without: it says so, and costs nothing.

use std::convert::Infallible;
#[cfg(not(feature = "foxglove"))]
use std::net::SocketAddr;
#[cfg(not(feature = "mcap"))]
use std::path::Path;

#[cfg(not(feature = "mcap"))]
use super::SessionEvent;
use crate::live::LiveUpdate;

/// A build without the feature `mcap` writes none.
#[cfg(not(feature = "mcap"))]
pub struct McapLog(Infallible);

#[cfg(not(feature = "mcap"))]
impl McapLog {
    /// # Errors
    /// Always.
    pub fn create(_: &Path, _: &str) -> Result<Self, String> {
        Err("this build writes no MCAP (feature “mcap”)".into())
    }

    /// # Errors
    /// Always.
    pub fn replace(path: &Path, link: &str) -> Result<Self, String> {
        Self::create(path, link)
    }

    pub fn began(&mut self, _: u64) {
        match self.0 {}
    }

    /// # Errors
    /// None: there is none of it.
    pub fn event(&mut self, _: &SessionEvent) -> Result<(), String> {
        match self.0 {}
    }

    /// # Errors
    /// None: there is none of it.
    pub fn sample(&mut self, _: &LiveUpdate) -> Result<(), String> {
        match self.0 {}
    }

    /// # Errors
    /// None: there is none of it.
    pub fn finish(&mut self) -> Result<(), String> {
        match self.0 {}
    }
}

/// A build without the feature `foxglove` serves nobody.
#[cfg(not(feature = "foxglove"))]
pub struct FoxgloveServer(Infallible);

#[cfg(not(feature = "foxglove"))]
impl FoxgloveServer {
    /// # Errors
    /// Always.
    pub fn open(_: &str, _: &str) -> Result<Self, String> {
        Err("this build does not speak to Foxglove (feature “foxglove”)".into())
    }

    #[must_use]
    pub fn address(&self) -> Option<SocketAddr> {
        match self.0 {}
    }

    pub fn sample(&self, _: &LiveUpdate) {
        match self.0 {}
    }

    pub fn let_go(&self) {
        match self.0 {}
    }
}

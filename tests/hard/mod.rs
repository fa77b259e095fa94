//! What tries the readers hard: every reader as one function of bytes, files to begin with, ways to spoil
//! them, and what must hold whatever comes.
//!
//! Shared by `tests/engine/fuzz.rs` (a few thousand files a reader), `benches/hard` (a million) and `fuzz/`
//! (libFuzzer); `CONTRIBUTING.md` says how to run them.
#![allow(dead_code, reason = "each runner uses its own part of these")]

pub mod property;
pub mod reader;
pub mod seeds;
pub mod spoil;

//! How much memory a computation may take: every size is known before it is taken.
//!
//! The edge says once what the machine has, or what the user allows; the core only asks.

use std::sync::atomic::{AtomicU64, Ordering};

/// What is taken at most where nobody has said otherwise, however much the machine has: the same input gives
/// the same elements on any machine that has this much (bytes).
pub const USUAL: u64 = 8_000_000_000;

static ALLOWED: AtomicU64 = AtomicU64::new(USUAL);

/// Sets what may be taken (bytes).
pub fn allow(bytes: u64) {
    ALLOWED.store(bytes, Ordering::Relaxed);
}

/// What may be taken (bytes).
#[must_use]
pub fn allowed() -> f64 {
    ALLOWED.load(Ordering::Relaxed) as f64
}

//! What this process has done since it began, whoever asked for it.
//!
//! Results state the `Work` (`budget.rs`) that they cost; the tally also sees work whose result nobody
//! kept. Tests hold with it that a change computes and draws only what depends on it. It is written only, never
//! read by what it counts, so that nothing computed depends on it.

use std::sync::atomic::{AtomicU64, Ordering};

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// A stiffness put together and factored.
    Factorization,
    /// A right-hand side solved.
    Solve,
    /// An entry of a kernel matrix.
    KernelEvaluation,
    /// A regression fitted, of one coordinate.
    Fit,
    /// Buffers of a scene sent to the graphics adapter.
    Upload,
    /// A scene drawn.
    Redraw,
}

const KINDS: usize = 6;
static COUNTS: [AtomicU64; KINDS] = [const { AtomicU64::new(0) }; KINDS];

/// Counts.
pub fn count(done: Done, number: usize) {
    COUNTS[done as usize].fetch_add(number as u64, Ordering::Relaxed);
}

/// Counts so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Stiffnesses assembled and factored.
    pub factorizations: u64,
    /// Right-hand sides solved.
    pub solves: u64,
    /// Entries of kernels computed.
    pub kernel_evaluations: u64,
    /// Regressions fitted.
    pub fits: u64,
    /// Buffers sent to the graphics adapter.
    pub uploads: u64,
    /// Scenes drawn.
    pub redraws: u64,
}

/// All counts as they are.
#[must_use]
pub fn now() -> Tally {
    let of = |done: Done| COUNTS[done as usize].load(Ordering::Relaxed);
    Tally {
        factorizations: of(Done::Factorization),
        solves: of(Done::Solve),
        kernel_evaluations: of(Done::KernelEvaluation),
        fits: of(Done::Fit),
        uploads: of(Done::Upload),
        redraws: of(Done::Redraw),
    }
}

impl Tally {
    /// What was done since an earlier count.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self {
            factorizations: self.factorizations - before.factorizations,
            solves: self.solves - before.solves,
            kernel_evaluations: self.kernel_evaluations - before.kernel_evaluations,
            fits: self.fits - before.fits,
            uploads: self.uploads - before.uploads,
            redraws: self.redraws - before.redraws,
        }
    }
}

//! CPU time, and something to compare it with.
#![allow(dead_code, reason = "each benchmark uses its own part of these")]

pub use hapdef::io::cpu_seconds;

/// CPU time (s) of this thread so far.
pub fn thread_seconds() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let spent = clock_gettime(ClockId::ThreadCPUTime);
    spent.tv_sec as f64 + spent.tv_nsec as f64 * 1e-9
}

/// CPU time (s) of a 4000 × 4000 matrix product on one core.
pub fn reference_seconds() -> f64 {
    let a = faer::Mat::<f64>::from_fn(4000, 4000, |i, j| ((i * 7 + j * 3) % 11) as f64);
    let before = cpu_seconds();
    let b = &a * &a;
    assert!(b[(3, 4)] > 0.0);
    cpu_seconds() - before
}

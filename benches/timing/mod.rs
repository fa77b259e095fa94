//! Processor time, and something to compare it with.
#![allow(dead_code, reason = "each benchmark uses its own part of these")]

/// Processor seconds of this process so far.
pub fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .collect();
    let ticks = |k: usize| {
        fields
            .get(k)
            .and_then(|f| f.parse::<f64>().ok())
            .unwrap_or(0.0)
    };
    (ticks(11) + ticks(12)) / 100.0
}

pub fn reference_seconds() -> f64 {
    let a = faer::Mat::<f64>::from_fn(4000, 4000, |i, j| ((i * 7 + j * 3) % 11) as f64);
    let before = cpu_seconds();
    let b = &a * &a;
    assert!(b[(3, 4)] > 0.0);
    cpu_seconds() - before
}

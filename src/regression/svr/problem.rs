//! What a regression is fitted to, and where it starts.

use std::ops::Range;

/// Settings of one fit. `c` bounds the coefficients, `epsilon` and `tolerance` are in the target's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SvrParams {
    /// Bound of the coefficients.
    pub c: f64,
    /// Half-width of the tube without loss.
    pub epsilon: f64,
    /// Largest violation of the optimality conditions at which the fit counts as converged.
    pub tolerance: f64,
    /// Most steps.
    pub max_steps: usize,
}

/// Points with a precomputed kernel (n × n by rows, symmetric) and targets; those in `held_out` take no
/// part in the fit, only their residuals are computed.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// n × n values, row by row.
    pub kernel: &'a [f64],
    /// n targets.
    pub y: &'a [f64],
    /// Points that take no part.
    pub held_out: Range<usize>,
}

/// Where a fit starts: coefficients of a similar one, and their f = Kβ - y where it is known.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Coefficients, one a point.
    pub beta: &'a [f64],
    /// Kβ - y.
    pub f: Option<&'a [f64]>,
}

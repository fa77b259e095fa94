//! What known presses say of the part itself: by what factor it gives way more than its model, and how likely a model of it
//! makes them.
//!
//! With everything that is off drawn from its prior, the presses together are normal, and the logarithm of their density is
//!
//! ```text
//! -½ (r² + Σ ln |V| + ln |P + Σ Bᵀ V⁻¹ B| - ln |P|) + const
//! ```
//!
//! with r² the weighted squares that are left (C. E. Rasmussen and C. K. I. Williams 2006, section 2.7: the evidence).
//! Models with other walls are compared by it: each is allowed the gauges that suit it, and pays for them.

use nalgebra::{Cholesky, Dyn};

use super::{
    BEFORE, ComparedPress, Fitted, KnownPress, LEAST, Least, ReadingErrors, fitted, noise_of_mean,
    sound,
};
use crate::inference::drawn::AsDrawn;
use crate::uncertainty::Uncertainty;

/// What is found of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OfPart {
    /// Readings over those of the model, common to all gauges, and its standard deviation.
    pub factor: [f64; 2],
    /// The logarithm of the density of what was read, but for a constant that is the same for all models of a part.
    pub evidence: f64,
}

/// Compares known touches, read with this noise of a sample (strain, a channel each), with a model; `off` is what is known of
/// everything that is off. Nothing where numbers overflow.
#[must_use]
pub fn of_part(
    drawn: &AsDrawn,
    known: &[KnownPress],
    noise: &[f64],
    off: &Uncertainty,
) -> Option<OfPart> {
    let noise = &noise_of_mean(noise);
    let known = sound(known);
    let Fitted {
        glued,
        relative,
        fit,
    } = fitted(drawn, &known, noise, off);
    let fit = fit?;
    let presses: Vec<ComparedPress> = (known.iter())
        .map(|k| ComparedPress::new(drawn, k, &glued, off))
        .collect();
    let least = Least {
        presses: &presses,
        noise,
        off,
    };
    let errors = ReadingErrors {
        relative,
        ..ReadingErrors::of_noises(noise)
    };
    let mut spread = log_determinant(&fit.normal);
    for press in &presses {
        spread += log_determinant(&press.covariance(&errors, off.drift)?);
    }
    spread -= least.prior().iter().map(|p| p.ln()).sum::<f64>();
    let share = off.elements.max(LEAST) / relative;
    let of_share = BEFORE * (share * share - 1.0 - 2.0 * share.ln());
    let common = fit.found.len() - 1;
    let variance = fit.normal.inverse()[(common, common)];
    let found = OfPart {
        factor: [1.0 + fit.found[common], variance.max(0.0).sqrt()],
        evidence: -0.5 * (fit.squares + spread + of_share),
    };
    found.evidence.is_finite().then_some(found)
}

fn log_determinant(of: &Cholesky<f64, Dyn>) -> f64 {
    let l = of.l_dirty();
    2.0 * (0..l.nrows()).map(|i| l[(i, i)].ln()).sum::<f64>()
}

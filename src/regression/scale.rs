//! How large the touched part is, beside the one that settings in millimetres are made for.

/// Spread of the touches of the bundled limb (mm).
pub const USUAL_SPREAD_MM: f64 = 48.7;

/// Root mean square distance of targets from their middle, in their unit.
#[must_use]
pub fn rms_radius(targets: &[[f64; 3]]) -> f64 {
    let n = targets.len().max(1) as f64;
    let variance = |axis: usize| {
        let mean = targets.iter().map(|t| t[axis]).sum::<f64>() / n;
        targets
            .iter()
            .map(|t| (t[axis] - mean).powi(2))
            .sum::<f64>()
            / n
    };
    (variance(0) + variance(1) + variance(2)).sqrt()
}

/// Spread of targets (mm) over the usual one; one where it says nothing.
#[must_use]
pub fn relative(targets: &[[f64; 3]]) -> f64 {
    let ratio = rms_radius(targets) / USUAL_SPREAD_MM;
    if ratio.is_normal() { ratio } else { 1.0 }
}

/// As [`relative`], to the nearest power of ten: for values that are to stay round, and the same for parts of
/// about the same size.
#[must_use]
pub fn decade(targets: &[[f64; 3]]) -> f64 {
    10f64.powi(relative(targets).log10().round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_is_told_without_place_or_unit() {
        let targets = |by: f64| -> Vec<[f64; 3]> {
            let place = |k: f64| [k * by, (k * k % 17.0) * by + 900.0 * by, 5.0 * by];
            (0..40_i32).map(f64::from).map(place).collect()
        };
        assert!((rms_radius(&targets(1.0)) * 100.0 - rms_radius(&targets(100.0))).abs() < 1e-6);
        assert!((relative(&targets(0.5)) / relative(&targets(1.0)) - 0.5).abs() < 1e-12);
        assert_eq!(decade(&targets(4.0)), 1.0);
        assert!((decade(&targets(0.04)) - 0.01).abs() < 1e-15);
        assert_eq!(relative(&[[3.0; 3]; 5]), 1.0);
        assert_eq!(relative(&[]), 1.0);
    }
}

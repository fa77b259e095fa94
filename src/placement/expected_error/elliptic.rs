//! The mean length of a normal vector in the plane.

/// E|e| for a normal e of mean zero and covariance [[a, b], [b, c]]: √(2λ/π)·E(1 − μ/λ), with the larger eigenvalue λ,
/// the smaller μ, and the complete elliptic integral of the second kind E by arithmetic–geometric means.
#[must_use]
pub fn mean_length(a: f64, b: f64, c: f64) -> f64 {
    let (middle, half) = (f64::midpoint(a, c), ((a - c) / 2.0).hypot(b));
    let (large, small) = (middle + half, (middle - half).max(0.0));
    if large <= 0.0 {
        return 0.0;
    }
    (2.0 * large / std::f64::consts::PI).sqrt() * second_kind(1.0 - small / large)
}

/// The complete elliptic integral of the second kind by its parameter m = k² (Abramowitz and Stegun, 17.6.4).
fn second_kind(m: f64) -> f64 {
    /// More than enough for doubles: the difference squares at every step.
    const STEPS: usize = 6;
    let m = m.clamp(0.0, 1.0);
    if m > 1.0 - 1e-14 {
        return 1.0;
    }
    let (mut a, mut g, mut c) = (1.0, (1.0 - m).sqrt(), m.sqrt());
    let (mut sum, mut power) = (c * c / 2.0, 1.0);
    for _ in 0..STEPS {
        c = (a - g) / 2.0;
        (a, g) = (f64::midpoint(a, g), (a * g).sqrt());
        sum += power * c * c;
        power *= 2.0;
    }
    std::f64::consts::FRAC_PI_2 / a * (1.0 - sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_those_of_the_normal_distribution() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        near(
            mean_length(4.0, 0.0, 4.0),
            2.0 * (std::f64::consts::PI / 2.0).sqrt(),
        );
        near(
            mean_length(9.0, 0.0, 0.0),
            3.0 * (2.0 / std::f64::consts::PI).sqrt(),
        );
        // E(3/4) = 1.211056027568459 (Abramowitz and Stegun, table 17.1).
        near(second_kind(0.75), 1.211_056_027_568_459);
        // Turned by any angle the same.
        near(mean_length(2.5, 1.5, 2.5), mean_length(4.0, 0.0, 1.0));
    }
}

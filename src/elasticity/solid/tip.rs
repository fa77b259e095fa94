//! What cells larger than a tip cannot know of the dent under it.
//!
//! A load on a thick body is a sum of waves over its surface; a wave of number k presses a half-space in by
//! 2 (1 - ν²) / (E k) of its pressure (K. L. Johnson, Contact Mechanics, 1985), and a plate of thickness t by 12
//! (1 - ν²) / (E t³ k⁴) where it is long. Cells of a size h know nothing of waves that are shorter than about h,
//! whichever grid they lie in: two coarse grids share this fault, so that they cannot be asked for it.

use crate::elasticity::Material;

/// Wave number that cells still follow, times their size (measured: quadratic cells of half a tip to three tips
/// under a smooth tip on a cube).
const FOLLOWED: f64 = 7.0;
/// Where the sum ends, in wave numbers times the tip's radius: nothing is left of a smooth tip there.
const END: f64 = 40.0;
const STEPS: u32 = 400;

/// Displacement a newton (m/N), the mean under the tip, that cells of a size (m) do not see on a wall (m).
#[must_use]
pub fn unseen(material: &Material, tip: f64, size: f64, wall: f64) -> f64 {
    let plane = (1.0 - material.poissons_ratio.powi(2)) / material.youngs_modulus;
    let from = (FOLLOWED * tip / size).min(END);
    let step = (END - from) / f64::from(STEPS);
    let at = |x: f64| {
        let plate = 1.0 + 6.0 * (tip / (x * wall)).powi(3);
        spectrum(x).powi(2) * plate
    };
    let sum: f64 = (0..STEPS)
        .map(|k| at(from + (f64::from(k) + 0.5) * step))
        .sum();
    plane * sum * step / (std::f64::consts::PI * tip)
}

/// Waves of number x / a in the pressure q ∝ (1 - r²/a²)² of one newton: 48 J₃(x) / x³.
fn spectrum(x: f64) -> f64 {
    // J₃(x) / x³ by its integral, ∫ (1 - t²)^(5/2) cos(x t) dt over 0 to 1, times 2 / (15 π): smooth, so that the
    // midpoint rule in the angle t = sin θ is exact to rounding.
    const ANGLES: u32 = 48;
    let step = std::f64::consts::FRAC_PI_2 / f64::from(ANGLES);
    let sum: f64 = (0..ANGLES)
        .map(|k| {
            let (sin, cos) = ((f64::from(k) + 0.5) * step).sin_cos();
            cos.powi(6) * (x * sin).cos()
        })
        .sum();
    48.0 * sum * step * 2.0 / (15.0 * std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MATERIAL: Material = Material {
        youngs_modulus: 1.7e9,
        poissons_ratio: 0.35,
    };

    #[test]
    fn the_spectrum_is_a_bessel_function() {
        // J₃(1), J₃(3), J₃(10) (M. Abramowitz and I. A. Stegun, table 9.2).
        for (x, bessel) in [
            (1.0f64, 0.019563354),
            (3.0, 0.309062722),
            (10.0, 0.058379379),
        ] {
            let right = 48.0 * bessel / x.powi(3);
            assert!((spectrum(x) - right).abs() < 1e-7, "{x}: {}", spectrum(x));
        }
        assert!((spectrum(1e-9) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn cells_much_larger_than_a_tip_see_nothing_of_its_dent() {
        let a = 3e-3;
        let whole = unseen(&MATERIAL, a, 1e3, 1e3);
        let plane = (1.0 - 0.35f64.powi(2)) / 1.7e9;
        // ∫ (48 J₃(x) / x³)² dx = 2.40817.
        assert!((whole / (plane * 2.40817 / (std::f64::consts::PI * a)) - 1.0).abs() < 1e-3);
        assert!(unseen(&MATERIAL, a, a / 2.0, 1.0) < 1e-3 * whole);
        let half = unseen(&MATERIAL, a, 2.5 * a, 1.0);
        assert!((0.1..0.5).contains(&(half / whole)), "{}", half / whole);
    }
}

//! Inner loops compiled for the widest vectors of the processor that runs them.

/// Defines a function whose body is compiled once for each instruction set and chosen at run time. It
/// must be a function of its own: code passed in as a closure keeps the baseline instructions. Nothing
/// here fuses or reorders arithmetic, so that the bytes do not depend on the processor.
macro_rules! wide {
    ($(#[$meta:meta])* $visibility:vis fn $name:ident<$($life:lifetime),*>($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block) => {
        $(#[$meta])*
        $visibility fn $name<$($life),*>($($arg: $type),*) $(-> $result)? {
            struct Call<$($life),*> {
                $($arg: $type),*
            }
            impl<$($life),*> pulp::NullaryFnOnce for Call<$($life),*> {
                type Output = wide!(@result $($result)?);
                #[inline(always)]
                fn call(self) -> Self::Output {
                    let Self { $($arg),* } = self;
                    $body
                }
            }
            pulp::Arch::new().dispatch(Call { $($arg),* })
        }
    };
    (@result) => { () };
    (@result $result:ty) => { $result };
}

pub(crate) use wide;

/// e to the power of x, for x up to 60: 2 to a whole number by its bits, and a polynomial between (to 3e-6).
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
pub(crate) fn exponential(x: f32) -> f32 {
    /// Added to a number, it leaves the nearest whole one in the lowest bits.
    const WHOLE: f32 = 12_582_912.0;
    let t = (x * std::f32::consts::LOG2_E).max(-126.0);
    let whole = t + WHOLE;
    let y = (t - (whole - WHOLE)) * std::f32::consts::LN_2;
    let p = 1.0 + y * (1.0 + y * (0.5 + y * (0.166_666_6 + y * (0.041_666_2 + y * 0.008_4))));
    f32::from_bits(p.to_bits().wrapping_add(whole.to_bits() << 23))
}

/// The natural logarithm of a number above zero (to 3e-7), by that of its mantissa: 2 artanh((m - 1) / (m + 1)).
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
pub(crate) fn logarithm(x: f32) -> f32 {
    /// Bits of the square root of a half: mantissas lie around one.
    const ROOT: u32 = 0x3f35_04f3;
    let from_root = x.to_bits().wrapping_sub(ROOT);
    let power = (from_root as i32 >> 23) as f32;
    let mantissa = f32::from_bits((from_root & 0x007f_ffff) + ROOT);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let q = s * s;
    let series = 1.0 + q * (0.333_333_3 + q * (0.2 + q * (0.142_857 + q * 0.111_111)));
    power * std::f32::consts::LN_2 + 2.0 * s * series
}

/// The natural logarithm of a normal number above zero, to rounding: as [`logarithm`], with more terms.
#[allow(
    clippy::inline_always,
    reason = "part of loops that are compiled for several instruction sets"
)]
#[inline(always)]
pub(crate) fn logarithm_to_rounding(x: f64) -> f64 {
    /// Bits of the square root of a half: mantissas lie around one.
    const ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
    /// Added, it makes powers of two positive.
    const RAISED: u64 = 1024;
    const MANTISSA: u64 = (1 << 52) - 1;
    /// With a whole number in its lowest bits it is greater by that number.
    const WHOLE: f64 = 4_503_599_627_370_496.0;
    let from_root = (x.to_bits().wrapping_sub(ROOT)).wrapping_add(RAISED << 52);
    let power = f64::from_bits(WHOLE.to_bits() | (from_root >> 52)) - (WHOLE + RAISED as f64);
    let mantissa = f64::from_bits((from_root & MANTISSA) + ROOT);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let q = s * s;
    // Written out: a loop over its terms keeps compilers from making vectors of the loop around it.
    let high = 1.0 / 13.0 + q * (1.0 / 15.0 + q * (1.0 / 17.0 + q * (1.0 / 19.0)));
    let low = 1.0 / 5.0 + q * (1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0 + q * high)));
    let series = 1.0 + q * (1.0 / 3.0 + q * low);
    power * std::f64::consts::LN_2 + 2.0 * s * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_functions_are_near_enough() {
        for k in -400..=400 {
            let x = k as f32 * 0.15;
            let true_value = f64::from(x).exp();
            assert!(
                (f64::from(exponential(x)) / true_value - 1.0).abs() < 2e-5,
                "{x}"
            );
            let y = (k as f32 * 0.15).exp();
            assert!((logarithm(y) - x).abs() < 1e-5 * (1.0 + x.abs()), "{x}");
            let y = (7.0 * f64::from(x)).exp();
            let off = logarithm_to_rounding(y) - y.ln();
            assert!(off.abs() < 4e-15 * (1.0 + y.ln().abs()), "{y}: {off}");
        }
        assert!(exponential(-1e30) < 1e-37);
    }
}

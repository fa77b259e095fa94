//! Units at the edge. Inside, lengths are metres, strains are strains and times are seconds; what people, files, boards
//! and machines say otherwise is turned by these functions, and by no bare power of ten.

use std::ops::Mul;

use serde::Serializer;

/// Metres as millimetres: a length or a point.
#[must_use]
pub fn mm<T: Mul<f64, Output = T>>(metres: T) -> T {
    metres * 1e3
}

/// Millimetres as metres: a length or a point.
#[must_use]
pub fn from_mm<T: Mul<f64, Output = T>>(millimetres: T) -> T {
    millimetres * 1e-3
}

/// Square metres as square millimetres.
#[must_use]
pub fn mm2(area: f64) -> f64 {
    area * 1e6
}

/// Cubic metres as cubic centimetres.
#[must_use]
pub fn cm3(volume: f64) -> f64 {
    volume * 1e6
}

/// Stiffness of a bedding (N/mm³) as pressure over a displacement (Pa/m).
#[must_use]
pub fn from_n_per_mm3(bedding: f64) -> f64 {
    bedding * 1e9
}

/// Strain as microstrain.
#[must_use]
pub fn microstrain(strain: f64) -> f64 {
    strain * 1e6
}

/// Microstrain as strain.
#[must_use]
pub fn from_microstrain(microstrain: f64) -> f64 {
    microstrain * 1e-6
}

/// A variance of strain as square microstrain.
#[must_use]
pub fn microstrain2(variance: f64) -> f64 {
    variance * 1e12
}

/// What is per strain as per microstrain.
#[must_use]
pub fn per_microstrain(per_strain: f64) -> f64 {
    per_strain * 1e-6
}

/// What is per square of strain (one over a variance) as per square microstrain.
#[must_use]
pub fn per_microstrain2(per_strain2: f64) -> f64 {
    per_strain2 * 1e-12
}

/// Microseconds of a clock as seconds.
#[must_use]
pub fn seconds(us: u64) -> f64 {
    us as f64 * 1e-6
}

/// Seconds from one time (µs) to a later one; none where it is not later.
#[must_use]
pub fn seconds_between(from_us: u64, until_us: u64) -> f64 {
    seconds(until_us.saturating_sub(from_us))
}

/// Seconds as microseconds of a clock.
#[must_use]
pub fn microseconds(seconds: f64) -> u64 {
    (seconds * 1e6) as u64
}

/// What is said in thousandths (millivolts, a gain): as it is.
#[must_use]
pub fn from_thousandths(thousandths: impl Into<f64>) -> f64 {
    thousandths.into() * 1e-3
}

/// In whole thousandths, as it is said.
#[must_use]
pub fn thousandths(value: f64) -> f64 {
    (value * 1e3).round()
}

/// With three digits behind the point.
#[must_use]
pub fn to_thousandths(value: f64) -> f64 {
    thousandths(value) / 1e3
}

/// A count in thousands.
#[must_use]
pub fn thousands(count: f64) -> f64 {
    count / 1e3
}

/// Bytes as gigabytes.
#[must_use]
pub fn gigabytes(bytes: f64) -> f64 {
    bytes / 1e9
}

/// In millimetres, without what rounds in metres.
fn written(length: f64) -> f64 {
    /// A picometre.
    const PARTS: f64 = 1e9;
    (mm(length) * PARTS).round() / PARTS
}

/// Writes a length (m) as millimetres: for `#[serde(serialize_with)]`.
///
/// # Errors
/// Those of the serializer.
pub fn as_mm<S: Serializer>(length: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(written(*length))
}

/// Writes lengths (m) as millimetres.
///
/// # Errors
/// Those of the serializer.
pub fn all_as_mm<S: Serializer>(lengths: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(lengths.iter().copied().map(written))
}

/// Writes memory (bytes) as gigabytes.
///
/// # Errors
/// Those of the serializer.
pub fn as_gigabytes<S: Serializer>(bytes: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(gigabytes(*bytes))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn there_and_back() {
        assert_eq!(mm(0.25), 250.0);
        assert_eq!(
            mm(DVec3::new(0.5, 0.0, -0.25)),
            DVec3::new(500.0, 0.0, -250.0)
        );
        assert!((from_mm(mm(0.0123)) - 0.0123).abs() < 1e-15);
        assert_eq!(mm2(0.5), 5e5);
        assert_eq!(cm3(0.25), 250_000.0);
        assert_eq!(from_n_per_mm3(5.0), 5e9);
        assert!((from_microstrain(microstrain(3e-4)) - 3e-4).abs() < 1e-15);
        assert_eq!(microstrain2(4e-12), microstrain(2e-6) * microstrain(2e-6));
        assert_eq!(per_microstrain(3e6), 3.0);
        assert_eq!(per_microstrain2(4e12) * microstrain2(0.25e-12), 1.0);
        assert_eq!(thousands(12_500.0), 12.5);
        assert_eq!(seconds_between(1_500_000, 3_000_000), 1.5);
        assert_eq!(seconds_between(3, 1), 0.0);
        assert_eq!(microseconds(1.5), 1_500_000);
        assert_eq!(thousandths(from_thousandths(1234_u32)), 1234.0);
        assert_eq!(to_thousandths(-1.234_56), -1.235);
        assert_eq!(gigabytes(8e9), 8.0);
        for thickness in [0.9, 1.3, 1.8, 2.6, 4.5] {
            assert_eq!(written(from_mm(thickness)), thickness);
        }
        assert_eq!(written(f64::INFINITY), f64::INFINITY);
    }
}

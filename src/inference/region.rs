//! Where a touch may be: the 90 % region on the surface, as an ellipse in its tangent plane.

use glam::{DMat2, DVec2, DVec3};

use crate::elasticity::observe::tangent_frame;

/// Share of the probability that a region holds.
pub const SHARE: f64 = 0.9;
/// √(-2 ln 0.1): half-axes of an ellipse that holds that share of a normal distribution, in deviations.
pub(super) const DEVIATIONS: f64 = 2.145_966_026_289_347;

/// An ellipse in the tangent plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CredibleRegion {
    /// Half-axes (m), the longer first.
    pub axes: [DVec3; 2],
    /// Radius of a disk that holds as much (m).
    pub radius: f64,
}

impl CredibleRegion {
    /// Of a normal distribution with this covariance (m²) in the plane of two directions.
    #[must_use]
    pub fn of_normal(covariance: DMat2, plane: [DVec3; 2]) -> Self {
        let [(long, first), (short, second)] = principal(covariance);
        let axis =
            |deviation: f64, d: DVec2| (plane[0] * d.x + plane[1] * d.y) * (deviation * DEVIATIONS);
        Self {
            axes: [axis(long, first), axis(short, second)],
            radius: long * disk(short / long),
        }
    }

    /// Of places (m) with weights around a centre: their covariance gives the shape, their weights its size.
    #[must_use]
    pub fn of_places(places: &[(DVec3, f64)], centre: DVec3, normal: DVec3) -> Self {
        let frame = tangent_frame(normal);
        let plane = [frame.x_axis, frame.y_axis];
        let flat = |p: DVec3| DVec2::new((p - centre).dot(plane[0]), (p - centre).dot(plane[1]));
        let total: f64 = places.iter().map(|p| p.1).sum();
        let mut covariance = DMat2::ZERO;
        for &(p, weight) in places {
            let d = flat(p);
            covariance += DMat2::from_cols(d * d.x, d * d.y) * (weight / total);
        }
        let [(long, first), (short, second)] = principal(covariance);
        let away = |p: DVec3| {
            let d = flat(p);
            let (a, b) = (d.dot(first) / long, d.dot(second) / short);
            (a * a + b * b).sqrt()
        };
        let scale = quantile(places.iter().map(|&(p, w)| (away(p), w)), total);
        let axis =
            |deviation: f64, d: DVec2| (plane[0] * d.x + plane[1] * d.y) * (deviation * scale);
        Self {
            axes: [axis(long, first), axis(short, second)],
            radius: quantile(places.iter().map(|&(p, w)| (p.distance(centre), w)), total),
        }
    }

    /// Whether a place (m) lies in the ellipse around a centre.
    #[must_use]
    pub fn holds(&self, centre: DVec3, place: DVec3) -> bool {
        let away = |axis: DVec3| (place - centre).dot(axis) / axis.length_squared();
        away(self.axes[0]).hypot(away(self.axes[1])) <= 1.0
    }
}

/// Deviations along the principal directions, the larger first.
fn principal(covariance: DMat2) -> [(f64, DVec2); 2] {
    /// A deviation is never taken for smaller than a micrometre.
    const LEAST: f64 = 1e-6;
    let (a, b, c) = (
        covariance.x_axis.x,
        covariance.x_axis.y,
        covariance.y_axis.y,
    );
    let (middle, half) = (f64::midpoint(a, c), (a - c) / 2.0);
    let apart = half.hypot(b);
    let angle = 0.5 * b.atan2(half);
    let first = DVec2::from_angle(angle);
    let deviation = |v: f64| v.max(0.0).sqrt().max(LEAST);
    [
        (deviation(middle + apart), first),
        (deviation(middle - apart), first.perp()),
    ]
}

/// The value below which [`SHARE`] of the weight lies, to a two-hundredth of the largest.
fn quantile(values: impl Iterator<Item = (f64, f64)> + Clone, total: f64) -> f64 {
    const BINS: usize = 200;
    let largest = values.clone().fold(f64::MIN_POSITIVE, |m, v| m.max(v.0));
    let mut bins = [0.0; BINS];
    for (value, weight) in values {
        let bin = (value / largest * BINS as f64) as usize;
        bins[bin.min(BINS - 1)] += weight;
    }
    let wanted = SHARE * total;
    let mut sum = 0.0;
    for (k, weight) in bins.into_iter().enumerate() {
        if sum + weight >= wanted && weight > 0.0 {
            return largest * (k as f64 + (wanted - sum) / weight) / BINS as f64;
        }
        sum += weight;
    }
    largest
}

/// Radius of the disk that holds [`SHARE`] of a normal distribution with deviations 1 and `ratio` ≤ 1, by
/// interpolation in a table of the exact values.
fn disk(ratio: f64) -> f64 {
    const TABLE: [f64; 11] = [
        1.64485, 1.64791, 1.65731, 1.67383, 1.69918, 1.73708, 1.79152, 1.86253, 1.94716, 2.04236,
        2.14597,
    ];
    let place = ratio.clamp(0.0, 1.0) * 10.0;
    let k = (place as usize).min(9);
    TABLE[k] + (TABLE[k + 1] - TABLE[k]) * (place - k as f64)
}

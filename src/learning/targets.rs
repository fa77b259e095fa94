//! What is learned, in a frame of its own: centred, along the directions that the values spread in, of size one.

use faer::Mat;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// A direction that places spread in less than this share of the widest says nothing: a flat skin has two.
const FLAT: f64 = 1e-6;

/// The frame of places: the middle, the directions that they spread in, and how far.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetFrame {
    /// mm.
    pub middle: [f64; 3],
    /// One to three directions of length one, at right angles.
    pub axes: Vec<[f64; 3]>,
    /// Root mean square distance from the middle (mm).
    pub size: f64,
}

impl TargetFrame {
    /// Of places (mm); nothing where all are the same.
    #[must_use]
    pub fn of(places: &[[f64; 3]]) -> Option<Self> {
        let n = places.len().max(1) as f64;
        let sum = places
            .iter()
            .copied()
            .map(Vector3::from)
            .sum::<Vector3<f64>>();
        let middle = sum / n;
        let off = places.iter().map(|&p| Vector3::from(p) - middle);
        let scatter = off.map(|d| d * d.transpose()).sum::<Matrix3<f64>>() / n;
        let size = scatter.trace().sqrt();
        if !(size.is_normal() && size > f64::EPSILON * middle.amax()) {
            return None;
        }
        let spectrum = SymmetricEigen::new(scatter / scatter.trace());
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| spectrum.eigenvalues[b].total_cmp(&spectrum.eigenvalues[a]));
        let widest = spectrum.eigenvalues[order[0]];
        let axes = order
            .into_iter()
            .filter(|&k| spectrum.eigenvalues[k] > FLAT * FLAT * widest)
            .map(|k| spectrum.eigenvectors.column(k).into_owned().into())
            .collect();
        Some(Self {
            middle: middle.into(),
            axes,
            size,
        })
    }

    /// Places (mm) in the frame: places × axes.
    #[must_use]
    pub fn apply(&self, places: &[[f64; 3]]) -> Mat<f64> {
        Mat::from_fn(places.len(), self.axes.len(), |t, k| {
            let along = |a: usize| (places[t][a] - self.middle[a]) * self.axes[k][a];
            (along(0) + along(1) + along(2)) / self.size
        })
    }

    /// The places (mm) of values in the frame (places × axes).
    #[must_use]
    pub fn back(&self, values: &Mat<f64>) -> Vec<[f64; 3]> {
        let place = |t: usize| {
            [0, 1, 2].map(|a| {
                let along = |(k, axis): (usize, &[f64; 3])| values[(t, k)] * axis[a];
                let off: f64 = self.axes.iter().enumerate().map(along).sum();
                self.middle[a] + self.size * off
            })
        };
        (0..values.nrows()).map(place).collect()
    }
}

/// The frame of forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// N.
    pub middle: f64,
    /// Standard deviation (N).
    pub size: f64,
}

impl Scale {
    /// Of forces (N); nothing where all are the same.
    #[must_use]
    pub fn of(forces: &[f64]) -> Option<Self> {
        let n = forces.len().max(1) as f64;
        let middle = forces.iter().sum::<f64>() / n;
        let variance = forces.iter().map(|f| (f - middle).powi(2)).sum::<f64>() / n;
        let size = variance.sqrt();
        (size.is_normal() && size > 1e-9 * middle.abs()).then_some(Self { middle, size })
    }

    /// Forces (N) in the frame: a column.
    #[must_use]
    pub fn apply(&self, forces: &[f64]) -> Mat<f64> {
        Mat::from_fn(forces.len(), 1, |t, _| {
            (forces[t] - self.middle) / self.size
        })
    }

    /// The forces (N) of values in the frame. Nothing pulls.
    #[must_use]
    pub fn back(&self, values: &Mat<f64>) -> Vec<f64> {
        let force = |t: usize| (self.middle + self.size * values[(t, 0)]).max(0.0);
        (0..values.nrows()).map(force).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places on a plane that leans in space.
    fn leaning() -> Vec<[f64; 3]> {
        let place = |k: i32| {
            let (u, v) = (f64::from(k % 9), 0.5 * f64::from(k / 9));
            [400.0 + u, 2.0 * u - v, 0.5 * v]
        };
        (0..81).map(place).collect()
    }

    #[test]
    fn a_flat_skin_has_two_directions_however_it_leans() {
        let places = leaning();
        let frame = TargetFrame::of(&places).unwrap();
        assert_eq!(frame.axes.len(), 2);
        let back = frame.back(&frame.apply(&places));
        for (a, b) in back.iter().zip(&places) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-9), "{a:?} {b:?}");
        }
        assert_eq!(TargetFrame::of(&[[1.0, 2.0, 3.0]; 9]), None);
        assert_eq!(TargetFrame::of(&[]), None);
    }

    #[test]
    fn the_unit_of_places_changes_nothing() {
        let plain = leaning();
        let values = TargetFrame::of(&plain).unwrap().apply(&plain);
        for by in [0.01, 100.0] {
            let places: Vec<[f64; 3]> = plain.iter().map(|p| p.map(|v| v * by)).collect();
            let same = TargetFrame::of(&places).unwrap().apply(&places);
            assert!((&values - &same).norm_max() < 1e-9);
        }
    }

    #[test]
    fn a_force_comes_back_and_is_never_below_zero() {
        let scale = Scale::of(&[1.0, 2.0, 6.0]).unwrap();
        let back = scale.back(&scale.apply(&[1.5, 9.0, -3.0]));
        assert!((back[0] - 1.5).abs() < 1e-12 && (back[1] - 9.0).abs() < 1e-12);
        assert_eq!(back[2], 0.0);
        assert_eq!(Scale::of(&[10.0; 40]), None);
    }
}

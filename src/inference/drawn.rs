//! What gauges read as they were drawn, how that changes with the way they are glued, and how far off it may be.

use std::sync::Arc;

use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};

use super::deviation::{Deviations, Nuisances};
use super::map::{ResponseMap, Slope};
use crate::mesh::SurfacePoint;
use crate::uncertainty::{Gluing, Making, Uncertainty};
use crate::units;

/// What gauges read as drawn, and how that changes with the way they are glued.
pub struct AsDrawn {
    /// Readings as drawn.
    pub map: Arc<ResponseMap>,
    /// A millimetre along the gauge, a millimetre across it, and a degree.
    pub changes: [ResponseMap; 3],
    /// A metre more of the tip's radius; absent where the tip is taken to be as large as it is said to be.
    pub tip: Option<Arc<ResponseMap>>,
    /// A newton along x, y and z, whichever way the surface lies; absent where touches press straight in.
    pub axes: Option<Arc<[ResponseMap; 3]>>,
}

/// How a gauge is glued, beside how it was drawn: it reads the gain times what it would as drawn, and so many times what a
/// step along it, one across it (normal × direction) and a turn change of that. In files the four numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 4]", into = "[f64; 4]")]
pub struct AsGlued {
    /// A factor.
    pub gain: f64,
    /// mm.
    pub along_mm: f64,
    /// mm.
    pub across_mm: f64,
    /// From the direction towards the other side of the gauge.
    pub turned_degrees: f64,
}

impl AsGlued {
    /// Exactly as it was drawn.
    pub const DRAWN: Self = Self {
        gain: 1.0,
        along_mm: 0.0,
        across_mm: 0.0,
        turned_degrees: 0.0,
    };

    /// The same gauge where all of the part gives way so many times as much.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        <[f64; 4]>::from(self).map(|value| factor * value).into()
    }
}

impl From<[f64; 4]> for AsGlued {
    fn from([gain, along_mm, across_mm, turned_degrees]: [f64; 4]) -> Self {
        Self {
            gain,
            along_mm,
            across_mm,
            turned_degrees,
        }
    }
}

impl From<AsGlued> for [f64; 4] {
    fn from(of: AsGlued) -> Self {
        [of.gain, of.along_mm, of.across_mm, of.turned_degrees]
    }
}

/// What is not known of one gauge, as far as a covariance of its gain, millimetres along and across, and degrees says
/// it: the upper triangle by rows.
pub type GluingCovariance = [f64; 10];

/// Before anything is known but how a workshop glues.
#[must_use]
pub fn gluing_covariance(gluing: &Gluing) -> GluingCovariance {
    let place = units::mm(gluing.place).powi(2) / 2.0;
    let angle = gluing.angle.to_degrees().powi(2);
    [
        gluing.gain.powi(2),
        0.0,
        0.0,
        0.0,
        place,
        0.0,
        0.0,
        place,
        0.0,
        angle,
    ]
}

/// As a matrix.
pub(super) fn covariance(doubt: &GluingCovariance) -> Matrix4<f64> {
    let [a, b, c, d, e, f, g, h, i, j] = *doubt;
    Matrix4::new(a, b, c, d, b, e, f, g, c, f, h, i, d, g, i, j)
}

/// And back.
pub(super) fn upper_triangle(covariance: &Matrix4<f64>) -> GluingCovariance {
    let m = |i: usize, j: usize| covariance[(i, j)];
    [
        m(0, 0),
        m(0, 1),
        m(0, 2),
        m(0, 3),
        m(1, 1),
        m(1, 2),
        m(1, 3),
        m(2, 2),
        m(2, 3),
        m(3, 3),
    ]
}

impl AsDrawn {
    /// For gauges that are glued like that, a channel each.
    #[must_use]
    pub fn glued(&self, glued: &[AsGlued]) -> ResponseMap {
        let factors: Vec<[f64; 4]> = glued.iter().map(|&of| of.into()).collect();
        self.map.combined(&self.changes, &factors)
    }

    /// How far off readings per newton are by gluing and the way touches are made, everywhere, while nothing is known of
    /// these gauges.
    #[must_use]
    pub fn deviations(&self, off: &Uncertainty) -> Deviations {
        self.deviations_of(
            &vec![gluing_covariance(&off.gluing); self.map.channels()],
            off,
        )
    }

    /// As [`Self::deviations`], by what is still not known of each gauge.
    #[must_use]
    pub fn deviations_of(&self, doubts: &[GluingCovariance], off: &Uncertainty) -> Deviations {
        let mesh = &self.map.mesh;
        let nodes = mesh.positions().len() + mesh.edges().len();
        let doubts: Vec<Matrix4<f64>> = doubts.iter().map(covariance).collect();
        let mut values = Vec::with_capacity(nodes * self.map.channels());
        for node in 0..nodes {
            let rows = self.basis_at_node(node).zip(&doubts);
            // What was inverted may be a little less than nothing.
            values.extend(rows.map(|(row, doubt)| row.dot(&(doubt * row)).max(0.0).sqrt()));
        }
        let own = ResponseMap::of(Arc::clone(mesh), self.map.channels(), values);
        Deviations::new(Arc::new(own), self.nuisances(off.making_allowed()))
    }

    /// What a touch may have about it beside place and force, for gauges as they were drawn: what gluing changes of it is
    /// a small part of a small part.
    #[must_use]
    pub fn nuisances(&self, making: Making) -> Nuisances {
        Nuisances::new(making, self.tip.clone(), self.axes.clone())
    }

    /// Some of the gauges, with factors, as [`ResponseMap::mixed`].
    #[must_use]
    pub fn mixed(&self, channels: &[Vec<(usize, f64)>]) -> Self {
        Self {
            map: Arc::new(self.map.mixed(channels)),
            changes: self.changes.each_ref().map(|m| m.mixed(channels)),
            tip: (self.tip.as_ref()).map(|m| Arc::new(m.mixed(channels))),
            axes: (self.axes.as_ref())
                .map(|axes| Arc::new(axes.each_ref().map(|m| m.mixed(channels)))),
        }
    }

    /// Readings and slopes at one place for gauges that are glued like that.
    pub(super) fn slope(&self, at: SurfacePoint, glued: &[AsGlued]) -> Slope {
        let mut slope = self.map.slope(at);
        let changes = self.changes.each_ref().map(|m| m.slope(at));
        for (c, &of) in glued.iter().enumerate() {
            let factors: [f64; 4] = of.into();
            slope.reading[c] *= factors[0];
            slope.change[c] *= factors[0];
            for (change, factor) in changes.iter().zip(&factors[1..]) {
                slope.reading[c] += factor * change.reading[c];
                slope.change[c] += change.change[c] * *factor;
            }
        }
        slope
    }

    /// What all four say of one newton at a place: readings as drawn and their changes, channel by channel.
    pub(super) fn basis(&self, at: SurfacePoint) -> Vec<Vector4<f64>> {
        let [a, b, c] = self.changes.each_ref().map(|m| m.at(at));
        (self.map.at(at).into_iter().enumerate())
            .map(|(k, g)| Vector4::new(g, a[k], b[k], c[k]))
            .collect()
    }

    /// As [`Self::basis`], at a node of the map.
    fn basis_at_node(&self, node: usize) -> impl Iterator<Item = Vector4<f64>> {
        let [a, b, c] = self.changes.each_ref().map(|m| m.node(node));
        let rows = self.map.node(node).iter().zip(a).zip(b).zip(c);
        rows.map(|(((g, a), b), c)| Vector4::new(*g, *a, *b, *c))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DVec3;

    use super::*;
    use crate::mesh::TriMesh;

    /// Two channels on one triangle, with the same readings per newton at all its six nodes.
    fn map(mesh: &Arc<TriMesh>, readings: [f64; 2]) -> ResponseMap {
        ResponseMap::of(Arc::clone(mesh), 2, readings.repeat(6))
    }

    #[test]
    fn the_spread_is_that_of_gauges_glued_so() {
        const DIRECTIONS: u32 = 8;
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (mesh, _) = TriMesh::new(&corners, &[[0, 1, 2]], 0).unwrap();
        let mesh = Arc::new(mesh);
        let drawn = AsDrawn {
            map: Arc::new(map(&mesh, [2e-6, -1e-6])),
            changes: [[3e-7, 0.0], [-4e-7, 1e-7], [1e-7, 2e-7]].map(|c| map(&mesh, c)),
            tip: Some(Arc::new(map(&mesh, [1e-3, -2e-3]))),
            axes: None,
        };
        let gluing = Gluing::default();
        // Every way of being off as far as a workshop is, each as likely as its opposite.
        let mut squares = [0.0; 2];
        let at = SurfacePoint {
            triangle: 0,
            barycentric: [0.2, 0.3, 0.5],
        };
        for k in 0..4 * DIRECTIONS {
            let (s, c) = (TAU * f64::from(k / 4) / f64::from(DIRECTIONS)).sin_cos();
            let [turn, gain] = [k % 2, k / 2 % 2].map(|bit| 2.0 * f64::from(bit) - 1.0);
            let off = AsGlued {
                gain: 1.0 + gluing.gain * gain,
                along_mm: units::mm(gluing.place) * c,
                across_mm: units::mm(gluing.place) * s,
                turned_degrees: gluing.angle.to_degrees() * turn,
            };
            let built = drawn.glued(&[off, off]).at(at);
            for ((square, built), drawn) in squares.iter_mut().zip(built).zip(drawn.map.at(at)) {
                *square += (built - drawn).powi(2) / f64::from(4 * DIRECTIONS);
            }
        }
        let off = |gluing: Gluing, tip: f64| Uncertainty {
            gluing,
            making: Making {
                tip,
                ..Making::EXACT
            },
            ..Uncertainty::default()
        };
        let deviations = drawn.deviations(&off(gluing, 0.0)).all.at(at);
        for (deviation, square) in deviations.into_iter().zip(squares) {
            assert!(
                (deviation - square.sqrt()).abs() < 1e-9 * deviation,
                "{deviation}"
            );
        }
        let exact = drawn.deviations(&off(Gluing::EXACT, 0.0)).all.at(at);
        assert!(exact.iter().all(|&v| v == 0.0));
        // A tip that may be half a millimetre larger or smaller.
        let sized = drawn.deviations(&off(Gluing::EXACT, 0.5e-3)).all.at(at);
        for (sized, expected) in sized.into_iter().zip([0.5e-6, 1e-6]) {
            assert!((sized - expected).abs() < 1e-12, "{sized}");
        }
    }
}

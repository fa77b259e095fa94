//! Sites for gauges: where they are, what they read, and along which direction they read most.

use std::f64::consts::PI;

use glam::DVec3;

use crate::budget::Watch;
use crate::elasticity::observe::{Face, Observer, SiteFrame};
use crate::elasticity::{Model, Touch};
use crate::gauge::Gauge;
use crate::mesh::SurfacePoint;

/// A possible gauge position on the inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// On the surface that is computed with: of a shell its mid-surface. Where there is one gauge a place, its direction
    /// is that with the largest strain over the touches (rms).
    pub gauge: Gauge,
    /// Rms over the touches of the strain along its direction, inside face.
    pub rms_strain: f64,
    /// Largest principal strain over the touches (absolute), inside face: no direction reads more.
    pub peak_strain: f64,
}

/// Gauges on a model, and the touches of a dataset under which it is asked what changes their readings.
pub(super) struct SlopesAsked<'a> {
    pub(super) model: &'a dyn Model,
    pub(super) gauges: &'a [Gauge],
    /// Those of the dataset, and which of them are meant, rising.
    pub(super) touches: &'a [Touch],
    pub(super) columns: &'a [usize],
    pub(super) watch: Watch<'a>,
}

impl SlopesAsked<'_> {
    /// The touches that are meant.
    pub(super) fn pressed(&self) -> Vec<Touch> {
        self.columns.iter().map(|&t| self.touches[t]).collect()
    }
}

/// What reads the places of gauges on a model's surface, and their angles in its frames.
pub(super) fn gauges_on(model: &dyn Model, gauges: &[Gauge]) -> (Observer, Vec<f64>) {
    let points: Vec<SurfacePoint> = gauges
        .iter()
        .map(|s| model.index().nearest(s.position).0)
        .collect();
    let observer = model.observer(&points, Face::Inside);
    let angles = gauges
        .iter()
        .zip(observer.frames())
        .map(|(s, f)| s.direction.dot(f.y_axis).atan2(s.direction.dot(f.x_axis)))
        .collect();
    (observer, angles)
}

/// Second moments over the touches of the mean strain a, and b, c of a + b cos 2φ + c sin 2φ.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StrainMoments {
    pub(super) aa: f64,
    pub(super) bb: f64,
    pub(super) cc: f64,
    pub(super) ab: f64,
    pub(super) ac: f64,
    pub(super) bc: f64,
    pub(super) peak: f64,
}

impl StrainMoments {
    pub(super) fn of(xx: &[f64], yy: &[f64], xy: &[f64]) -> Self {
        let mut m = Self::default();
        for k in 0..xx.len() {
            let (a, b, c) = (
                f64::midpoint(xx[k], yy[k]),
                (xx[k] - yy[k]) / 2.0,
                xy[k] / 2.0,
            );
            m.aa += a * a;
            m.bb += b * b;
            m.cc += c * c;
            m.ab += a * b;
            m.ac += a * c;
            m.bc += b * c;
            m.peak = m.peak.max(a.abs() + (b * b + c * c).sqrt());
        }
        m
    }

    /// Σ strain² along φ.
    pub(super) fn along(&self, angle: f64) -> f64 {
        let (c, s) = ((2.0 * angle).cos(), (2.0 * angle).sin());
        self.aa
            + self.bb * c * c
            + self.cc * s * s
            + 2.0 * (self.ab * c + self.ac * s + self.bc * c * s)
    }

    /// The angle in [0, π) with the largest sum: a scan, then golden section. The smallest of equals.
    pub(super) fn dominant_angle(&self) -> f64 {
        const SCAN: usize = 90;
        let step = PI / SCAN as f64;
        let mut best = 0;
        for k in 1..SCAN {
            if self.along(k as f64 * step) > self.along(best as f64 * step) * (1.0 + 1e-9) {
                best = k;
            }
        }
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let (mut low, mut high) = ((best as f64 - 1.0) * step, (best as f64 + 1.0) * step);
        for _ in 0..40 {
            let (l, h) = (high - golden * (high - low), low + golden * (high - low));
            if self.along(l) >= self.along(h) {
                high = h;
            } else {
                low = l;
            }
        }
        f64::midpoint(low, high).rem_euclid(PI)
    }

    pub(super) fn site(
        &self,
        position: DVec3,
        frame: SiteFrame,
        angle: f64,
        touches: usize,
    ) -> Site {
        Site {
            gauge: Gauge {
                position,
                direction: frame.x_axis * angle.cos() + frame.y_axis * angle.sin(),
                normal: frame.z_axis,
            },
            rms_strain: (self.along(angle) / touches.max(1) as f64).max(0.0).sqrt(),
            peak_strain: self.peak,
        }
    }
}

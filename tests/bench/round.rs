//! A clamped round plate with a tip in its middle: displacement and strain in closed form.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{ElementBudget, unwatched};
use hapdef::elasticity::estimate::{AccuracyTarget, under_load};
use hapdef::elasticity::grade::{Graded, ShellGround};
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::support::HeldRegion;
use hapdef::elasticity::{DofSet, Model as _, ShellModel, ShellSection, Support, Touch};
use hapdef::mesh::{SurfacePoint, TriMesh};

use super::section;

/// Rms over places of the inner face's strain against a closed form along x and y, over the largest.
pub fn strain_error(
    model: &ShellModel,
    u: &[f64],
    places: &[DVec3],
    exact: impl Fn(DVec3) -> [f64; 3],
) -> f64 {
    let points: Vec<SurfacePoint> = places
        .iter()
        .map(|&p| model.mesh.index().nearest(p).0)
        .collect();
    let observer = model.observer(&points, Face::Inside);
    let (mut sum, mut largest) = (0.0, 0.0f64);
    for ((&p, strain), frame) in places
        .iter()
        .zip(observer.strain_of(model, u))
        .zip(observer.frames())
    {
        // Turn into x and y: the frame lies in the plane.
        let [xx, yy, xy] = strain;
        let component = |d: DVec3, e: DVec3| {
            let (a, b) = (d.dot(frame.x_axis), d.dot(frame.y_axis));
            let (c, f) = (e.dot(frame.x_axis), e.dot(frame.y_axis));
            xx * a * c + yy * b * f + xy / 2.0 * (a * f + b * c)
        };
        let found = [
            component(DVec3::X, DVec3::X),
            component(DVec3::Y, DVec3::Y),
            component(DVec3::X, DVec3::Y),
        ];
        for (f, e) in found.iter().zip(exact(p)) {
            sum += (f - e).powi(2);
            largest = largest.max(e.abs());
        }
    }
    (sum / places.len() as f64).sqrt() / largest
}

/// A disc (radius 50 mm) of rings and spokes, clamped outside 40 mm so that the support has a border of
/// its own to be cut; and a tip in the middle.
pub struct Disc {
    pub part: Arc<TriMesh>,
    pub section: ShellSection,
    pub clear: f64,
    pub touch: Touch,
}

impl Disc {
    pub fn new(spokes: u32, thickness: f64) -> Self {
        // The clear radius is the fourth fifth of the rings.
        let (outer, rings) = (0.05, spokes / 12 * 5 / 2);
        let mut p = vec![DVec3::ZERO];
        for ring in 1..=rings {
            for k in 0..spokes {
                let a = f64::from(k) / f64::from(spokes) * 2.0 * PI;
                let r = outer * f64::from(ring) / f64::from(rings);
                p.push(DVec3::new(a.cos(), a.sin(), 0.0) * r);
            }
        }
        let at = |ring: u32, k: u32| 1 + (ring - 1) * spokes + k % spokes;
        let mut t: Vec<[u32; 3]> = (0..spokes).map(|k| [0, at(1, k), at(1, k + 1)]).collect();
        for ring in 1..rings {
            for k in 0..spokes {
                let [a, b, c, d] = [
                    at(ring, k),
                    at(ring + 1, k),
                    at(ring + 1, k + 1),
                    at(ring, k + 1),
                ];
                t.extend([[a, b, c], [a, c, d]]);
            }
        }
        Self {
            part: Arc::new(TriMesh::new(&p, &t, 0).unwrap().0),
            section: section(2e9, 0.3, thickness),
            clear: 0.04,
            touch: Touch {
                position: DVec3::ZERO,
                normal: DVec3::Z,
                force: 1.0,
                tip_radius: 4e-3,
            },
        }
    }

    /// Everything outside the clear radius, as a mask of the vertices.
    pub fn support(&self) -> Support {
        let edge = self.clear * (1.0 - 1e-9);
        let mask = self.part.positions().iter().map(|p| p.length() > edge);
        Support {
            region: HeldRegion::Vertices(Arc::new(mask.collect())),
            held: DofSet::ALL,
            bedding: None,
        }
    }

    /// w between rings of radius r ≤ s (Timoshenko and Woinowsky-Krieger, art. 19), per newton.
    pub fn ring(&self, r: f64, s: f64) -> f64 {
        let (r, s, big) = (r.min(s), r.max(s), self.clear);
        let log = if s > 0.0 { (s / big).ln() } else { 0.0 };
        ((r * r + s * s) * log + (big * big + r * r) * (big * big - s * s) / (2.0 * big * big))
            / (8.0 * PI * self.section.bending_stiffness())
    }

    /// Mean displacement under the tip along its force (m): bending, and the shear of Reissner's plate.
    pub fn under(&self) -> f64 {
        let (a, n) = (self.touch.tip_radius, 400);
        let weight = |x: f64| 6.0 * x * (1.0 - x * x).powi(2); // ∫ over x in 0..1 is one
        let rings: Vec<(f64, f64)> = (0..n)
            .map(|k| (f64::from(k) + 0.5) / f64::from(n))
            .map(|x| (a * x, weight(x) / f64::from(n)))
            .collect();
        let shear = |r: f64, s: f64| {
            (self.clear / r.max(s)).ln() / (2.0 * PI * self.section.shear_stiffness())
        };
        let mut sum = 0.0;
        for &(r, wr) in &rings {
            for &(s, ws) in &rings {
                sum += wr * ws * (self.ring(r, s) + shear(r, s));
            }
        }
        sum * self.touch.force
    }

    /// Strains (xx, yy, xy) of the inside beyond the tip.
    pub fn strain(&self, p: DVec3) -> [f64; 3] {
        let (r, big) = (p.length(), self.clear);
        // Mean squared radius of the tip's pressure is a²/4.
        let m = self.touch.tip_radius.powi(2) / 4.0;
        let c = self.touch.force / (8.0 * PI * self.section.bending_stiffness());
        let log = (r / big).ln();
        let slope = c * (2.0 * r * log + (r * r + m) / r - (big * big + m) * r / (big * big));
        let bend = c * (2.0 * log + 3.0 - m / (r * r) - (big * big + m) / (big * big));
        // The plate moves down by w; below, at z = -t/2, strains are -z (-w″) = -t/2 w″.
        let half = self.section.thickness / 2.0;
        let (radial, hoop) = (-half * bend, -half * slope / r);
        let (x, y) = (p.x / r, p.y / r);
        [
            radial * x * x + hoop * y * y,
            radial * y * y + hoop * x * x,
            (radial - hoop) * x * y,
        ]
    }

    pub fn places() -> Vec<DVec3> {
        (0..80)
            .map(|k| {
                let (a, r) = (2.4 * f64::from(k), 0.009 + 0.029 * f64::from(k) / 79.0);
                DVec3::new(a.cos(), a.sin(), 0.0) * r
            })
            .collect()
    }

    pub fn graded(&self, aim: &ElementBudget, as_given: bool) -> Graded {
        let ground = ShellGround::new(&self.part, self.section, &[self.support()], as_given);
        let (touches, places) = ([self.touch], Self::places());
        ground
            .grade(&AccuracyTarget::new(&touches, &places, aim), &unwatched)
            .unwrap()
    }

    /// True errors (%) of the displacement under the tip and of the strains.
    pub fn errors(&self, model: &ShellModel) -> [f64; 2] {
        let u = model.solve(&model.forces(&self.touch));
        let under = under_load(&model.load(&self.touch), &self.touch, &u);
        let strain = strain_error(model, &u, &Self::places(), |p| self.strain(p));
        [100.0 * (under / self.under() - 1.0).abs(), 100.0 * strain]
    }
}

pub fn aim(vertices: usize, passes: usize) -> ElementBudget {
    ElementBudget {
        vertices,
        most_vertices: vertices,
        effort: usize::MAX,
        displacement_percent: 1e-9,
        strain_percent: 1e-9,
        passes,
    }
}

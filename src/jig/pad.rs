//! The face of a pad: the wall's, a little before it.

use glam::{DVec2, DVec3};

use super::frame::JigFrame;
use super::sizes::Sizes;
use super::wall::{PressedGauge, Wall};
use crate::units;

/// A pad as it lies at the wall. Its points are `out · distance + along · u + across · v + up`, with u and v over its half sizes.
#[derive(Clone, Debug, PartialEq)]
pub struct Pad {
    /// In which it is pressed, at right angles to the rod.
    pub out: DVec3,
    /// As the gauge's direction lies on it.
    pub along: DVec3,
    /// At right angles to both.
    pub across: DVec3,
    /// The gauge's height along the rod (mm).
    pub height: f64,
    /// Half length and width (mm).
    pub half: DVec2,
    /// Distances from the rod (mm), [`ACROSS`] + 1 rows of [`ALONG`] + 1.
    pub face: Vec<f64>,
    /// Distance of its flat back (mm).
    pub back: f64,
}

/// Cells along a pad and across it.
pub const ALONG: usize = 16;
/// See [`ALONG`].
pub const ACROSS: usize = 10;

impl Pad {
    /// For a gauge with a film of half these sizes (mm). The wall is felt along the way that the pad moves in; where it ends
    /// before the pad does, it goes on as it was at its end.
    #[must_use]
    pub fn new(
        on: &Wall,
        pressed: &PressedGauge,
        frame: &JigFrame,
        film: DVec2,
        sizes: &Sizes,
    ) -> Self {
        let (place, wall) = (
            frame.here(pressed.gauge.position),
            frame.way(pressed.gauge.normal),
        );
        let out = place.with_z(0.0).normalize_or(DVec3::X);
        let line = frame
            .way(pressed.gauge.direction)
            .reject_from_normalized(out);
        let along = line.normalize_or(DVec3::Z);
        let mut pad = Self {
            out,
            along,
            across: out.cross(along),
            height: place.z,
            half: sizes.pad_half(film),
            face: Vec::new(),
            back: 0.0,
        };
        let leans = wall.dot(out).max(0.3);
        let reach = place.dot(out);
        let gap = sizes.gap / leans;
        let straight: Vec<f64> = (pad.grid())
            .map(|at| reach - (pad.along * at.x + pad.across * at.y).dot(wall) / leans)
            .collect();
        let off: Vec<Option<f64>> = (pad.grid().zip(&straight))
            .map(|(at, &straight)| wall_at(on, frame, pad.point(at, straight), out))
            .collect();
        pad.face = (pad.grid().zip(&straight))
            .map(|(at, straight)| straight + pad.nearest(at, &off).unwrap_or(0.0) - gap)
            .collect();
        let nearest = pad.face.iter().copied().fold(f64::INFINITY, f64::min);
        pad.back = nearest - sizes.pad;
        pad
    }

    /// What is known at the nearest place of its grid where anything is.
    fn nearest(&self, at: DVec2, known: &[Option<f64>]) -> Option<f64> {
        let known = self
            .grid()
            .zip(known)
            .filter_map(|(p, off)| off.map(|off| (p, off)));
        known
            .min_by(|a, b| {
                at.distance_squared(a.0)
                    .total_cmp(&at.distance_squared(b.0))
            })
            .map(|(_, off)| off)
    }

    /// Where its face is felt: along first, then across.
    pub fn grid(&self) -> impl Iterator<Item = DVec2> + use<> {
        let half = self.half;
        let share = |k: usize, of: usize| 2.0 * k as f64 / of as f64 - 1.0;
        (0..=ACROSS).flat_map(move |j| {
            (0..=ALONG).map(move |i| half * DVec2::new(share(i, ALONG), share(j, ACROSS)))
        })
    }

    /// A point over a place of it, so far from the rod (mm).
    #[must_use]
    pub fn point(&self, at: DVec2, distance: f64) -> DVec3 {
        let flat = self.along * at.x + self.across * at.y;
        self.out * distance + flat + DVec3::Z * self.height
    }

    /// The points of its face and of its back, drawn back by so much (mm).
    #[must_use]
    pub fn points(&self, drawn_back: f64) -> Vec<DVec3> {
        let face = self.grid().zip(&self.face);
        let face = face.map(|(at, d)| self.point(at, d - drawn_back));
        let back = self.grid().map(|at| self.point(at, self.back - drawn_back));
        face.chain(back).collect()
    }
}

/// How far (mm) beyond a point the wall is, along the way out; nothing where there is none nearby.
fn wall_at(on: &Wall, frame: &JigFrame, point: DVec3, out: DVec3) -> Option<f64> {
    /// How far the wall may be off the straight one (mm).
    const NEAR: f64 = 5.0;
    let start = frame.out_of(point - out * NEAR);
    let way = frame.way_out(out);
    let (_, far) = on.face.index().ray(start, way)?;
    let off = units::mm(far) - NEAR;
    (off < NEAR).then_some(off)
}

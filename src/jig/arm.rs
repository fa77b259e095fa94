//! A ring with its arm, and what keeps it from its gauge.

use glam::{DVec2, DVec3};

use super::convex::{Hull, bar, block};
use super::frame::JigFrame;
use super::pad::Pad;
use super::sizes::Sizes;
use super::wall::{PressedGauge, Wall};
use super::why::Why;

/// Of one gauge.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// The gauge's number.
    pub number: usize,
    /// About the rod from x (radians).
    pub angle: f64,
    /// Height of the ring's middle along the rod (mm).
    pub slot: f64,
    /// How far the pad is drawn back to pass (mm).
    pub travel: f64,
    /// At the wall.
    pub pad: Pad,
}

/// A pad is pressed at least this straight at the wall: cosine of 45°.
const STRAIGHT: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// How far the stem ends before the ring when it is drawn back (mm).
const BEFORE_RING: f64 = 0.5;
/// A pad is drawn back at least so far (mm): gap and glue need it.
pub const LEAST_TRAVEL: f64 = 2.0;
/// How far a ring reaches towards its strut (mm).
pub const TAB: f64 = 1.2;
/// Ring, strut, guide and pad.
pub type Bodies = [Hull; 4];
/// What lies on something does not meet it (mm).
const TOUCHING: f64 = 0.05;
/// How high the eyelet of the cord stands on a guide (mm).
pub const EYELET: f64 = 3.5;

impl Arm {
    /// With as little travel as there may be.
    ///
    /// # Errors
    /// Why an arm on this rod cannot press the gauge.
    pub fn new(
        on: &Wall,
        pressed: &PressedGauge,
        frame: &JigFrame,
        film: DVec2,
        sizes: &Sizes,
    ) -> Result<Self, Why> {
        let (place, wall) = (
            frame.here(pressed.gauge.position),
            frame.way(pressed.gauge.normal),
        );
        let flat = place.truncate();
        let straight = wall.truncate().dot(flat.normalize_or(DVec2::X));
        if straight < STRAIGHT {
            return Err(Why::Leans(straight.clamp(-1.0, 1.0).acos().to_degrees()));
        }
        let arm = Self {
            number: pressed.number,
            angle: flat.to_angle(),
            slot: place.z,
            travel: LEAST_TRAVEL,
            pad: Pad::new(on, pressed, frame, film, sizes),
        };
        if arm.most_travel(sizes) < LEAST_TRAVEL {
            return Err(Why::Near(flat.length()));
        }
        Ok(arm)
    }

    /// How far its pad can be drawn back (mm).
    #[must_use]
    pub fn most_travel(&self, sizes: &Sizes) -> f64 {
        let room = self.pad.back - sizes.ring_radius() - sizes.guide - 2.0 * BEFORE_RING;
        room / 2.0
    }

    /// From and to where the guide reaches from the rod's middle (mm).
    #[must_use]
    pub fn guide(&self, sizes: &Sizes) -> [f64; 2] {
        let to = self.pad.back - self.travel - BEFORE_RING;
        [to - sizes.guide, to]
    }

    /// Length of the stem (mm): it fills its guide with the pad at the wall.
    #[must_use]
    pub fn stem(&self, sizes: &Sizes) -> f64 {
        self.pad.back - self.guide(sizes)[0]
    }

    /// What it takes up, its pad drawn back by so much (mm).
    #[must_use]
    pub fn bodies(&self, sizes: &Sizes, drawn_back: f64) -> Bodies {
        let [from, to] = self.guide(sizes);
        let [low, high] = self.ring(sizes);
        // Rings may lie on each other.
        let (low, high) = (low + TOUCHING, high - TOUCHING);
        let half = sizes.guide_half();
        let turned = |[low, high]: [DVec3; 2]| block(low, high, self.angle);
        let mut ring = bar(sizes.ring_radius(), low, high);
        ring.extend(block(
            DVec3::new(0.0, -sizes.strut_half(), low),
            DVec3::new(sizes.ring_radius() + TAB, sizes.strut_half(), high),
            self.angle,
        ));
        let [root, end] = self.strut(sizes);
        let mut strut = turned(root);
        strut.extend(turned(end));
        let z = self.pad.height;
        let guide = [
            DVec3::new(from, -half, z - half - EYELET),
            DVec3::new(to, half, z + half),
        ];
        [ring, strut, turned(guide), self.pad.points(drawn_back)]
    }

    /// The two boxes that its strut runs between, before it is turned by its angle: corners at the ring and at the guide. It
    /// begins outside the ring's circle, so that the rings beside it have room.
    #[must_use]
    pub fn strut(&self, sizes: &Sizes) -> [[DVec3; 2]; 2] {
        let half = sizes.guide_half();
        let [low, high] = self.ring(sizes);
        let (from, z) = (self.guide(sizes)[0], self.pad.height);
        let (near, slim) = (sizes.ring_radius(), sizes.strut_half());
        let root = [
            DVec3::new(near + TOUCHING * 4.0, -slim, low + TOUCHING),
            DVec3::new(near + TAB, slim, high - TOUCHING),
        ];
        let end = [
            DVec3::new(from - 0.5, -half, z - half),
            DVec3::new(from + 2.0, half, z + half),
        ];
        [root, end]
    }

    /// How far it reaches out of the opening (mm).
    #[must_use]
    pub fn sticks_out(&self, sizes: &Sizes) -> f64 {
        let half = sizes.guide_half() + EYELET;
        let pad = self.pad.points(0.0).into_iter().map(|p| -p.z);
        pad.fold(half - self.pad.height, f64::max).max(0.0)
    }

    /// From and to which height its ring reaches (mm).
    #[must_use]
    pub fn ring(&self, sizes: &Sizes) -> [f64; 2] {
        [-0.5, 0.5].map(|half| self.slot + half * sizes.ring)
    }
}

//! What a tip does to the limb that it is moved into: how hard it presses, where and which way.

use glam::DVec3;

use super::machine::{Machine, Pose};
use super::mount::TableMount;
use crate::elasticity::{Push, Touch};
use crate::mesh::TriMesh;

/// Dry plastic on plastic: what a tip may push aside, over what it presses.
const FRICTION: f64 = 0.3;

/// A tip against a limb that gives way in proportion to the force.
#[derive(Clone, Debug)]
pub struct ContactLaw<'a> {
    /// What the tip can touch.
    pub surface: &'a TriMesh,
    /// How the limb really stands.
    pub mount: TableMount,
    /// The machine that moves the tip.
    pub machine: &'a Machine,
    /// How far tip, sensor and frame of the machine give way under a newton (m/N).
    pub machine_gives: f64,
    /// Places (m) with how far each gives way under a newton (m/N); what lies between is as the nearest.
    pub gives: Vec<(DVec3, f64)>,
}

impl ContactLaw<'_> {
    /// How the tip presses at a pose, if it does.
    #[must_use]
    pub fn push(&self, pose: &Pose) -> Option<Push> {
        /// Cosine of what is still straight behind a face, and how deep a tip may be in the limb, over its radius.
        const STRAIGHT: f64 = 0.7;
        const DEEPEST: f64 = 3.0;
        let middle = self.mount.limb(pose.on_table());
        let (at, far) = self.surface.index().nearest(middle);
        let place = self.surface.point(at);
        let out = (middle - place).normalize_or_zero();
        let normal = self.surface.normal(at);
        // Beyond the surface, the tip's middle itself is inside; off an edge it is not, whatever faces look at.
        let inside = out.dot(normal) < -STRAIGHT && far < DEEPEST * self.machine.tip_radius;
        let height = if inside { -far } else { far };
        let depth = self.machine.tip_radius - height;
        if depth <= 0.0 {
            return None;
        }
        let force = depth / (self.give(place) + self.machine_gives);
        let inward = -self.mount.turn.transpose().mul_vec3(pose.from());
        // The tip pushes the way it moves as long as it does not slip.
        let along = inward.reject_from_normalized(normal);
        let pressing = -inward.dot(normal);
        let slip = if pressing > 0.0 {
            along / pressing
        } else {
            DVec3::ZERO
        };
        let touch = Touch {
            position: place,
            normal,
            force,
            tip_radius: self.machine.tip_radius,
        };
        Some(Push {
            force: (slip.clamp_length_max(FRICTION) - normal) * force,
            touch,
        })
    }

    fn give(&self, place: DVec3) -> f64 {
        /// Where nothing is known (m/N).
        const USUAL: f64 = 1e-4;
        let near = (self.gives.iter()).min_by(|a, b| {
            a.0.distance_squared(place)
                .total_cmp(&b.0.distance_squared(place))
        });
        near.map_or(USUAL, |(_, give)| *give)
    }
}

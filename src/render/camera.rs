//! An orbit camera, upright as the part is.

use glam::camera::rh::proj::directx::perspective;
use glam::camera::rh::view::look_at_mat4;
use glam::{DVec2, DVec3, Mat4, Vec3, Vec4};

use crate::mesh::stance::Stance;

/// Looks at `target` (m) from `distance`, from the part's front around by `yaw` and up by `pitch` (radians).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub stance: Stance,
    pub target: DVec3,
    pub distance: f64,
    pub yaw: f64,
    pub pitch: f64,
}

/// Sides to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
}

impl Preset {
    pub const ALL: [Self; 6] = [
        Self::Front,
        Self::Back,
        Self::Left,
        Self::Right,
        Self::Top,
        Self::Bottom,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "Front",
            Self::Back => "Back",
            Self::Left => "Left",
            Self::Right => "Right",
            Self::Top => "Top",
            Self::Bottom => "Bottom",
        }
    }

    fn angles(self) -> (f64, f64) {
        use std::f64::consts::{FRAC_PI_2, PI};
        match self {
            Self::Front => (0.0, 0.0),
            Self::Back => (PI, 0.0),
            Self::Left => (-FRAC_PI_2, 0.0),
            Self::Right => (FRAC_PI_2, 0.0),
            Self::Top => (0.0, STEEPEST),
            Self::Bottom => (0.0, -STEEPEST),
        }
    }
}

/// Vertical field of view.
const FOV: f64 = 0.5;
/// Just short of straight up, where yaw would lose its meaning.
const STEEPEST: f64 = 1.55;

impl Camera {
    /// Shows all of a box (m).
    #[must_use]
    pub fn framing(lower: DVec3, upper: DVec3, stance: Stance) -> Self {
        let radius = (upper - lower).length() / 2.0;
        Self {
            stance,
            target: (lower + upper) / 2.0,
            distance: 1.12 * radius / (FOV / 2.0).sin(),
            yaw: 0.6,
            pitch: 0.35,
        }
    }

    pub fn look_from(&mut self, preset: Preset) {
        (self.yaw, self.pitch) = preset.angles();
    }

    /// Turns by a drag in points.
    pub fn orbit(&mut self, drag: DVec2) {
        self.yaw -= 0.008 * drag.x;
        self.pitch = (self.pitch + 0.008 * drag.y).clamp(-STEEPEST, STEEPEST);
    }

    /// Shifts by a drag in points over a view so many points high.
    pub fn pan(&mut self, drag: DVec2, height: f64) {
        let per_point = 2.0 * self.distance * (FOV / 2.0).tan() / height.max(1.0);
        let (right, up) = self.plane();
        self.target += (right * -drag.x + up * drag.y) * per_point;
    }

    /// Comes nearer (factor below one) or goes away.
    pub fn zoom(&mut self, factor: f64) {
        self.distance = (self.distance * factor).clamp(1e-7, 1e7);
    }

    /// From the target to the eye, unit length.
    #[must_use]
    pub fn toward_eye(&self) -> DVec3 {
        let (sp, cp) = self.pitch.sin_cos();
        let (sy, cy) = self.yaw.sin_cos();
        let Self { stance, .. } = self;
        stance.front() * (cp * cy) + stance.right() * (cp * sy) + stance.up() * sp
    }

    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.target + self.toward_eye() * self.distance
    }

    /// To the right in the view, unit length.
    #[must_use]
    pub fn side(&self) -> DVec3 {
        self.plane().0
    }

    fn plane(&self) -> (DVec3, DVec3) {
        let toward = self.toward_eye();
        let right = self.stance.up().cross(toward).normalize();
        (right, toward.cross(right))
    }

    /// World (relative to the target, in units of the distance) to clip space. Relative, so that single
    /// precision is enough at any size of the part.
    #[must_use]
    pub fn matrix(&self, aspect: f32) -> Mat4 {
        let eye = self.toward_eye().as_vec3();
        let up = self.stance.up().as_vec3();
        let view = look_at_mat4(eye, Vec3::ZERO, up);
        perspective(FOV as f32, aspect, 0.02, 20.0) * view
    }

    /// Pixels of one unit at the distance one, in a view so many pixels high.
    #[must_use]
    pub fn scale(&self, height: u32) -> f32 {
        (f64::from(height) / 2.0 / (FOV / 2.0).tan()) as f32
    }

    /// Where points appear in a view, for many of them.
    #[must_use]
    pub fn projection(&self, aspect: f32) -> Projection {
        Projection {
            matrix: self.matrix(aspect),
            target: self.target,
            distance: self.distance,
        }
    }

    /// Where a point (m) appears in a view (0–1 from the upper left), and its depth; nothing behind.
    #[must_use]
    pub fn project(&self, p: DVec3, aspect: f32) -> Option<(DVec2, f32)> {
        self.projection(aspect).place(p)
    }

    /// The ray through a place of the view (0–1 from the upper left): origin (m) and direction.
    #[must_use]
    pub fn ray(&self, place: DVec2, aspect: f32) -> (DVec3, DVec3) {
        let half = (FOV / 2.0).tan();
        let (right, up) = self.plane();
        let x = (2.0 * place.x - 1.0) * half * f64::from(aspect);
        let y = (1.0 - 2.0 * place.y) * half;
        let direction = (-self.toward_eye() + right * x + up * y).normalize();
        (self.eye(), direction)
    }
}

/// A camera's look at a view of some shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    matrix: Mat4,
    target: DVec3,
    distance: f64,
}

impl Projection {
    /// As [`Camera::project`].
    #[must_use]
    pub fn place(&self, p: DVec3) -> Option<(DVec2, f32)> {
        let local = ((p - self.target) / self.distance).as_vec3();
        let clip: Vec4 = self.matrix * local.extend(1.0);
        if clip.w <= 0.0 {
            return None;
        }
        let ndc = clip / clip.w;
        Some((
            DVec2::new(f64::from(ndc.x) * 0.5 + 0.5, 0.5 - f64::from(ndc.y) * 0.5),
            ndc.z,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_passes_through_what_is_seen_there() {
        let stance = Stance::about(DVec3::new(0.3, 0.9, -0.2));
        let mut camera = Camera::framing(DVec3::splat(-0.05), DVec3::splat(0.05), stance);
        camera.orbit(DVec2::new(123.0, -45.0));
        camera.pan(DVec2::new(30.0, 20.0), 600.0);
        let p = DVec3::new(0.02, -0.01, 0.03);
        let (place, _) = camera.project(p, 1.5).unwrap();
        let (origin, direction) = camera.ray(place, 1.5);
        let off = (p - origin).cross(direction).length();
        assert!(off < 1e-6, "{off}");
    }

    #[test]
    fn presets_look_along_their_axes() {
        for up in [DVec3::Z, DVec3::Y, DVec3::X, DVec3::new(0.3, 0.9, -0.2)] {
            let stance = Stance::about(up);
            let mut camera = Camera::framing(DVec3::ZERO, DVec3::ONE, stance);
            camera.look_from(Preset::Front);
            assert!(camera.toward_eye().distance(stance.front()) < 1e-12);
            camera.look_from(Preset::Right);
            assert!(camera.toward_eye().distance(stance.right()) < 1e-12);
            let above = camera.target + stance.up() * 0.1;
            let at = |p| camera.project(p, 1.0).unwrap().0;
            assert!(at(above).y < at(camera.target).y - 0.01, "up is up");
            camera.look_from(Preset::Top);
            assert!(camera.toward_eye().dot(stance.up()) > 0.99);
        }
    }
}

//! A barrel with windows and a frame inside, by its sizes.

use std::f64::consts::TAU;

/// Parameters of a barrel with a frame. Lengths in millimetres; the axis is y.
#[derive(Clone, Debug, PartialEq)]
pub struct BarrelSpec {
    /// Of the middle of the wall where the barrel is widest.
    pub radius: f64,
    /// Radius at the ends over the widest.
    pub ends: f64,
    /// From end to end.
    pub height: f64,
    /// Triangles that stand upright in a row around the limb; as many hang between them.
    pub around: usize,
    /// Rows of triangles between the rims.
    pub rows: usize,
    /// Width of the bars between windows.
    pub bar: f64,
    /// Height of the closed rim at either end.
    pub rim: f64,
    /// Radius of the windows' corners; 0 leaves them sharp.
    pub corner_radius: f64,
    /// Thickness of the wall.
    pub wall: f64,
    /// Largest side of an element along the lattice.
    pub element: f64,
    /// The frame inside.
    pub frame: FrameSpec,
}

/// The frame: rods that grow out of both rims and run beside the axis, and braces between neighbours. Lengths in
/// millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSpec {
    /// How many rods there are.
    pub rods: usize,
    /// Radius of a rod.
    pub rod_radius: f64,
    /// Of the rods from the axis.
    pub distance: f64,
    /// Between each two neighbours, evenly over the height.
    pub braces: usize,
    /// Radius of a brace.
    pub brace_radius: f64,
}

impl Default for FrameSpec {
    fn default() -> Self {
        Self {
            rods: 4,
            rod_radius: 3.0,
            distance: 15.0,
            braces: 2,
            brace_radius: 2.5,
        }
    }
}

impl Default for BarrelSpec {
    /// The bundled barrel.
    fn default() -> Self {
        Self {
            radius: 38.0,
            ends: 0.86,
            height: 140.0,
            around: 8,
            rows: 4,
            bar: 9.0,
            rim: 9.0,
            corner_radius: 1.5,
            wall: 1.0,
            element: 5.0,
            frame: FrameSpec::default(),
        }
    }
}

impl BarrelSpec {
    /// Windows of the shell.
    #[must_use]
    pub fn windows(&self) -> usize {
        2 * self.around * self.rows
    }

    /// From one triangle of a row to the next, where the barrel is widest (mm).
    pub(super) fn pitch(&self) -> f64 {
        TAU * self.radius / self.around as f64
    }

    /// Radius of the middle of the wall at a height, and its slope there.
    pub(super) fn profile(&self, y: f64) -> (f64, f64) {
        let x = 2.0 * y / self.height - 1.0;
        let bulge = self.radius * (1.0 - self.ends);
        let slope = -4.0 * bulge * x / self.height;
        (self.radius - bulge * x * x, slope)
    }

    /// Radius at a height, so far outwards from the middle of the wall: the wall is as thick everywhere, and its ends
    /// are flat.
    pub(super) fn radius_at(&self, y: f64, outwards: f64) -> f64 {
        let (radius, slope) = self.profile(y);
        radius + outwards * slope.hypot(1.0)
    }
}

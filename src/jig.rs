//! The jig that presses gauges to the wall while they are glued, as the paper's authors do it: a rod through the limb, on it a
//! ring with one arm for each gauge, and on each arm a pad that carries the wall's shape. Here rings sit on a flattened rod, so
//! that their bores give the angles, and sleeves between them give the heights: nothing has to be measured.
//!
//! A pad slides in its arm. Drawn back, the whole passes through an opening along the rod; a cord draws it out to the wall. Lengths
//! are in mm, in a frame of the rod's own: z points along it from the opening into the part, x where the arrow of the seat points.

mod arm;
mod convex;
mod digits;
mod frame;
mod pad;
mod parts;
mod plan;
mod reach;
mod rod;
mod shapes;
mod sizes;
mod slots;
mod wall;
mod why;

#[cfg(test)]
mod tests;

pub use arm::Arm;
pub use convex::{bar, outline};
pub use frame::{Entry, JigFrame};
pub use parts::{PrintedPart, parts};
pub use plan::{Jig, Stack, plan};
pub use reach::RodReach;
pub use sizes::{FILM, Sizes};
pub use wall::{PressedGauge, Wall};
pub use why::{LeftOutGauge, Why};

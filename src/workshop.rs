//! What whoever builds the limb needs: where each gauge is by callipers, pieces of the wall laid flat, and the wiring.
//!
//! All of it is about the wall's inner face, which gauges are glued to, and all pictures are seen from inside, as whoever glues
//! them sees it.

mod inner;
mod jigged;
mod landmarks;
mod patch;
mod robot;
mod solids;
mod wiring;

pub use inner::{GluedGauge, Inner};
pub use jigged::jig_of;
pub use landmarks::{Landmarks, NearbyGauge, landmarks};
pub use patch::Patch;
pub use robot::{frame, roll_pitch_yaw, turn_of, urdf};
pub use solids::{arrow, plate};
pub use wiring::{Channel, Wiring, bill, header, wiring};

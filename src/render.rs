//! What the window shows of the limb: camera and colour maps (plain arithmetic) and the wgpu pipeline.

pub mod camera;
#[cfg(feature = "studio")]
pub mod floor;
#[cfg(feature = "studio")]
pub mod gpu;
#[cfg(feature = "studio")]
pub mod offscreen;

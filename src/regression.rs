//! Learning a position from a few signals: ε-support-vector regression with a Gaussian kernel.

pub mod features;
pub mod svr;
pub mod tune;

pub use features::Standardizer;
pub use svr::{Fit, SvrParams};
pub use tune::{Hyper, PositionModel};

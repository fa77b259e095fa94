//! Learning a position from a few signals: ε-support-vector regression with a Gaussian kernel.

pub mod admm;
pub mod features;
pub mod folds;
pub mod kernel;
pub mod lowrank;
pub mod places;
pub mod predictor;
pub mod scale;
pub mod svr;
pub mod tune;

pub use features::Standardizer;
pub use places::Grouping;
pub use svr::{SvrFit, SvrParams};
pub use tune::{Hyper, PositionModel};

//! Estimators of place and force learned from measured touches alone, for skins that nobody has a model of.
//!
//! Readings are made comparable channel by channel (`inputs`), places are put into the frame that they span
//! (`targets`), so that neither unit, gain nor pose of either decides anything. The families (`family`) learn on the
//! same training touches and are chosen by the validation touches; the test touches are looked at once, in the end
//! (`train`). How far an answer may be off is learned from touches that were left out (`doubt`).

pub mod distance;
pub mod doubt;
pub mod estimator;
pub mod family;
pub mod gaussian_process;
pub mod inputs;
pub mod kernel;
mod lbfgs;
pub mod left_out;
pub mod lessons;
pub mod machine;
pub mod nearest;
pub mod portable;
pub mod ridge;
pub mod score;
pub mod still;
pub mod svr;
pub mod targets;
pub mod train;
pub mod update;
mod walk;

pub use estimator::{Estimate, TouchEstimator};
pub use family::{ByModel, Family, Method};
pub use lessons::{LearningError, MeasuredTouches};
pub use score::Scores;
pub use still::Still;
pub use train::{TrainedEstimator, TrainingRequest, train};
pub use update::{Updated, update};

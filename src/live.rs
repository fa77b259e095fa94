//! Live touch, without any port: from a board's bytes to a place on the part.

pub mod health;
pub mod pipeline;
pub mod receiver;
pub mod tare;
mod update;

pub use health::Health;
pub use pipeline::Pipeline;
pub use receiver::{Doubt, Input, Receiver, Sample, Traffic};
pub use tare::Rest;
pub use update::{Estimator, GaugeModel, Guess, Settings, Update};

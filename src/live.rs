//! Live touch, without any port: from a board's bytes to a place on the part.

pub mod health;
pub mod pipeline;
pub mod receiver;
pub mod tare;

pub use health::Health;
pub use pipeline::{Estimator, GaugeModel, Guess, Pipeline, Settings, Update};
pub use receiver::{Doubt, Input, Receiver, Sample, Traffic};
pub use tare::Rest;

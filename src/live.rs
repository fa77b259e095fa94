//! Live touch, without any port: from a board's bytes to a place on the part.

mod blind;
mod by_hand;
mod checking;
mod counting;
mod departure;
mod drift;
mod feeling;
mod ground;
pub mod health;
mod hum;
mod jumps;
mod lately;
mod left_out;
mod long_touch;
mod news;
pub mod pipeline;
mod presses;
mod pull;
pub mod receiver;
mod release;
mod standing;
pub mod tare;
mod trained;
mod tremble;
mod update;

pub use blind::LIGHT_N;
pub use by_hand::{HandNews, HandPress, HandPresses};
pub use health::Health;
pub use news::LiveNews;
pub use pipeline::Pipeline;
pub use presses::{FinishedPress, Presses};
pub use receiver::{Input, Receiver, Sample, Traffic, Unusable};
pub use tare::Rest;
pub use update::{GaugeModel, Guess, LiveUpdate, PipelineSettings, ShownEstimator};

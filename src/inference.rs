//! From what gauges read to a touch: where, how hard, and how sure.

pub mod bound;
pub mod calibration;
pub mod chain;
pub mod deviation;
pub mod drawn;
pub mod map;
pub mod matching;
pub mod measured;
#[cfg(test)]
pub(crate) mod plate;
pub mod region;
pub mod remainder;
pub mod several;
pub mod trained;

pub use bound::cramer_rao;
pub use calibration::{Calibration, KnownPress, calibrate};
pub use chain::Chain;
pub use deviation::{Deviations, Nuisances};
pub use drawn::{AsDrawn, AsGlued, GluingCovariance};
pub use map::ResponseMap;
pub use matching::{Contact, Matching, ReadingErrors};
pub use measured::MeasuredMatching;
pub use region::CredibleRegion;
pub use remainder::Remainder;
pub use several::{Several, SeveralTouches, TouchKind, TouchesBefore, TouchesBeside};
pub use trained::{Features, LiveLessons, TrainedLive};

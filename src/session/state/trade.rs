//! What was measured of speed against accuracy, and what was predicted of the last run.

use std::sync::{Arc, Mutex};

use crate::budget::Quality;
use crate::document::TradeInputs;
use crate::io::trade_file::TradeRecord;

/// Beyond this factor a prediction was wrong.
pub(in crate::session) const WRONG: f64 = 2.0;

/// Where a trade was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::session) enum MeasuredOn {
    Here,
    /// With the bundled limb.
    Elsewhere,
}

/// What is known of the open project.
#[derive(Default)]
pub struct Trade {
    pub(in crate::session) record: Option<(Arc<TradeRecord>, MeasuredOn)>,
    /// What it was looked up for.
    pub(in crate::session) inputs: Option<TradeInputs>,
    /// What the measurement that is running, or was ended, has so far.
    pub(in crate::session) coming: Arc<Mutex<Option<TradeRecord>>>,
    /// How the last prediction came out.
    pub(in crate::session) promise: Option<Promise>,
}

/// What was predicted of a run, and what it achieved.
#[derive(Clone, Debug, PartialEq)]
pub struct Promise {
    pub quality: Quality,
    /// By the clock, of the stages that ran anew and were measured.
    pub predicted_s: f64,
    pub achieved_s: f64,
    /// Mean errors (mm) as a design states its own.
    pub predicted_mm: f64,
    pub achieved_mm: f64,
}

impl Promise {
    /// Whether either was off by more than a factor of two.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        let off = |a: f64, b: f64| (a / b).ln().abs() > WRONG.ln();
        off(self.achieved_s, self.predicted_s) || off(self.achieved_mm, self.predicted_mm)
    }

    /// Both figures, predicted and achieved.
    #[must_use]
    pub fn in_words(&self) -> String {
        format!(
            "predicted {:.2} mm in {:.1} s, achieved {:.2} mm in {:.1} s",
            self.predicted_mm, self.predicted_s, self.achieved_mm, self.achieved_s
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prediction_off_by_more_than_two_is_broken() {
        let kept = Promise {
            quality: Quality::Draft,
            predicted_s: 10.0,
            achieved_s: 19.0,
            predicted_mm: 4.0,
            achieved_mm: 2.1,
        };
        assert!(!kept.is_broken());
        let slow = Promise {
            achieved_s: 21.0,
            ..kept.clone()
        };
        let quick = Promise {
            achieved_s: 4.9,
            ..kept.clone()
        };
        let wrong = Promise {
            achieved_mm: 8.1,
            ..kept.clone()
        };
        assert!(slow.is_broken() && quick.is_broken() && wrong.is_broken());
        assert_eq!(
            slow.in_words(),
            "predicted 4.00 mm in 10.0 s, achieved 2.10 mm in 21.0 s"
        );
    }
}

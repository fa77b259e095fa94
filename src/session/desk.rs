//! What belongs to the desk that projects are opened on, and stays when another one is opened.

use std::path::PathBuf;

use super::state::bench::BenchDesk;
use crate::link::BAUD;
use crate::live::ShownEstimator;

/// Settings of whoever works here, none of them a project's.
#[derive(Clone, Debug, PartialEq)]
pub struct Desk {
    /// Whether a change starts what depends on it anew.
    pub follow: bool,
    /// Where measured trades are kept between runs.
    pub trades: Option<PathBuf>,
    /// How much longer things take here than where the bundled trade was measured.
    pub pace: f64,
    /// Of serial ports.
    pub baud: u32,
    /// What of live touch is shown, and whether the others are shown beside it.
    pub estimator: ShownEstimator,
    pub compare: bool,
    /// That known touches are pressed with (N).
    pub known_force_n: f64,
    /// Whether a click on the limb says where the next one is pressed.
    pub known_by_click: bool,
    /// Of the test-bed.
    pub bench: BenchDesk,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            follow: true,
            trades: None,
            pace: 1.0,
            baud: BAUD,
            estimator: ShownEstimator::default(),
            compare: false,
            known_force_n: 10.0,
            known_by_click: false,
            bench: BenchDesk::default(),
        }
    }
}

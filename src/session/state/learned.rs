//! An estimator that was learned from presses.

use std::path::PathBuf;
use std::sync::Arc;

use crate::document::SensingInputs;
use crate::io::touch_file::TouchFile;

/// What live touch goes by, and for which gauges.
pub struct Learnt {
    pub path: PathBuf,
    /// The gauges that it was opened for.
    pub of: SensingInputs,
    pub file: Arc<TouchFile>,
}

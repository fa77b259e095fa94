//! The estimators that learn from touches of the model.

use std::sync::Arc;

use crate::budget::{Quality, Watch, report};
use crate::design::{DesignError, Inputs, Sensing};
use crate::inference::{Features, LiveLessons, TrainedLive};
use crate::regression::Hyper;

/// The trained estimators: normalized, raw.
pub type TrainedPair = [Option<Arc<TrainedLive>>; 2];

/// How many touches they learn from.
#[must_use]
pub fn training_touches(quality: Quality) -> usize {
    if quality == Quality::Draft { 800 } else { 3200 }
}

/// Both trained estimators (normalized, raw) on touches of the model, evenly spread, with forces from half a
/// newton to the hardest of the paper.
///
/// # Errors
/// [`DesignError`] where no touch lands on the part, or the watch asks to end.
pub fn train(
    (sensing, inputs): (&Sensing, &Inputs),
    used: &[bool],
    noise: f64,
    count: usize,
    watch: Watch,
) -> Result<TrainedPair, DesignError> {
    const JITTER: f64 = 0.03;
    report(watch, "Training", 0, 3)?;
    let lesson = sensing.lessons(inputs, count, inputs.project.budget.seed)?;
    let lessons = LiveLessons {
        x: &lesson.x,
        places_mm: &lesson.places_mm,
        forces: &lesson.forces,
        used,
        noise,
        jitter: JITTER,
        seed: inputs.project.budget.seed,
    };
    let keys = &inputs.project.selection;
    let hyper = Hyper {
        c: keys.c_mm,
        epsilon: keys.epsilon_mm,
        gamma: keys.gamma,
    };
    report(watch, "Training", 1, 3)?;
    let normalized = TrainedLive::train(Features::Normalized, &lessons, &hyper);
    report(watch, "Training", 2, 3)?;
    let raw = TrainedLive::train(
        Features::Raw,
        &LiveLessons {
            jitter: 0.0,
            ..lessons
        },
        &hyper,
    );
    Ok([Some(Arc::new(normalized)), Some(Arc::new(raw))])
}

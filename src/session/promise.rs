//! Whether what was predicted of a design came true.

use super::state::Session;
use super::state::trade::Promise;
use crate::budget::Quality;
use crate::design::Design;

/// A stage that took less (s) was known already.
const KNOWN_S: f64 = 1e-4;

impl Session {
    /// How the last prediction came out.
    #[must_use]
    pub fn promise(&self) -> Option<&Promise> {
        self.caches.trade.promise.as_ref()
    }

    /// What a finished design was predicted to be, and is; nothing where it was not measured, or was there already.
    fn promise_of(&self, design: &Design, quality: Quality) -> Option<Promise> {
        let compared = self.document.state.project.selection.compare;
        let m = self.measured_at(quality)?;
        let select = format!("select {}", design.chosen_by.name());
        if design.seconds.iter().all(|s| s.stage != select) {
            // What was there already took no time.
            return None;
        }
        let again = (self.results.simulation.as_ref()).is_some_and(|s| s.value.again);
        let (mut predicted_s, mut achieved_s) = (0.0, 0.0);
        for stage in &m.stages {
            // Where others were compared, more was evaluated than was measured.
            let more = compared && stage.stage == "evaluate";
            // Of what was there already, or was only read again, the time says nothing.
            let more = more || (again && stage.stage == "simulate");
            let ran = design
                .seconds
                .iter()
                .find(|s| s.stage == stage.stage && s.seconds > KNOWN_S);
            if let Some(ran) = ran.filter(|_| !more) {
                predicted_s += stage.seconds;
                achieved_s += ran.seconds;
            }
        }
        // As much of the whole as these stages took when it was measured.
        let share = predicted_s / m.seconds;
        Some(Promise {
            quality,
            predicted_s: share * m.cpu_seconds * self.trade_clock(),
            achieved_s,
            predicted_mm: m.own_error_mm,
            achieved_mm: design.chosen_row().map_or(f64::NAN, |r| r.error_mm),
        })
    }

    /// Holds a finished design against what was predicted of it.
    pub(super) fn hold_to_promise(&mut self, design: &Design, quality: Quality) {
        self.caches.trade.promise = None;
        let Some(promise) = self.promise_of(design, quality) else {
            return;
        };
        let elsewhere = self.is_from_elsewhere();
        // Of another machine's times nothing was promised here before the first run.
        if promise.is_broken() && !(elsewhere && self.desk.pace == 1.0) {
            self.tell(format!(
                "The prediction was off by more than a factor of two: {}. Other work may run on this machine; “Measure the trade” measures it anew",
                promise.in_words()
            ));
        }
        if elsewhere && promise.predicted_s > 0.0 {
            self.desk.pace *= promise.achieved_s / promise.predicted_s;
        }
        self.caches.trade.promise = Some(promise);
    }

    /// What is shown is no longer what was predicted last.
    pub(super) fn forget_promise(&mut self) {
        self.caches.trade.promise = None;
    }

    /// Predicted beside achieved, of the design that is shown.
    #[must_use]
    pub fn promise_line(&self) -> Option<String> {
        let quality = self.results.design.as_ref()?.value.quality;
        let promise = self.promise()?;
        (promise.quality == quality).then(|| promise.in_words())
    }
}

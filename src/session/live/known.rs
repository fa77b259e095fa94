//! Known touches: pressed where and as hard as was asked for, so that the gauges show how they are glued.

use std::sync::Arc;

use glam::DVec3;

use super::gathering::{Awaited, Gathered};
use crate::design::Sensing;
use crate::inference::{Calibration, KnownPress, calibrate};
use crate::job::Reporter;
use crate::session::jobs::Task;
use crate::session::slot::{Slot, current};
use crate::session::state::Session;
use crate::uncertainty::{Pressing, Uncertainty};

/// How many are proposed, and how many a calibration takes at least.
pub const WANTED: usize = crate::design::PROPOSED;
pub const LEAST: usize = 4;

impl Session {
    /// Where the next known touch is proposed (m).
    #[must_use]
    pub fn proposed_touch(&self) -> Option<DVec3> {
        let places = &self.sensing()?.proposed;
        let touch = places.get(self.known_touches() % places.len().max(1))?;
        Some(touch.position)
    }

    /// Reads the press that is on as one at the proposed place.
    pub fn take_known(&mut self) {
        let Some(at) = self.proposed_touch() else {
            return;
        };
        self.live.exact = false;
        let force = self.desk.known_force_n;
        self.live.await_known(Awaited::Press(at, force));
    }

    /// Takes the next touches of a simulated board as known ones, and calibrates with them.
    pub fn calibrate_from_board(&mut self) {
        self.live.known.clear();
        // One that was read meanwhile is not of these.
        drop(self.live.gathered());
        self.live.exact = true;
        self.live.await_known(Awaited::Board);
    }

    /// Reads no more known touches.
    pub fn stop_taking_known(&mut self) {
        self.live.await_known(Awaited::Nothing);
    }

    /// How many known touches there are of these gauges.
    #[must_use]
    pub fn known_touches(&self) -> usize {
        self.known_presses().count()
    }

    /// Those that these gauges have read.
    fn known_presses(&self) -> impl Iterator<Item = &KnownPress> {
        let inputs = self.document.sensing_inputs();
        let all = self.live.known.iter();
        all.filter_map(move |slot| current(Some(slot), &inputs))
    }

    /// Takes in what was read meanwhile.
    pub(super) fn gather_known(&mut self) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        let from_board = self.live.awaited() == Awaited::Board;
        for gathered in self.live.gathered() {
            self.keep_known(&sensing, &gathered);
        }
        if from_board && self.known_touches() >= WANTED {
            self.stop_taking_known();
            self.start_calibration();
        }
    }

    fn keep_known(&mut self, sensing: &Sensing, gathered: &Gathered) {
        // What was not trusted says nothing of how it is glued.
        let used = self.live.look(|f| f.used.clone()).unwrap_or_default();
        let trusted = |c: usize| used.get(c).copied().unwrap_or(true);
        let read = |c: usize| gathered.strain.get(c).copied().filter(|_| trusted(c));
        let reading = (0..sensing.gauges.len()).map(|c| read(c).unwrap_or(f64::NAN));
        let value = KnownPress {
            at: sensing.drawn.map.mesh.index().nearest(gathered.at).0,
            force: gathered.force,
            reading: reading.collect(),
        };
        let inputs = self.document.sensing_inputs();
        self.live.known.push(Slot { inputs, value });
    }

    /// Fits how the gauges are glued.
    pub fn start_calibration(&mut self) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        let known: Vec<KnownPress> = self.known_presses().cloned().collect();
        let noise = self.live.look(|f| f.noise.clone()).unwrap_or_default();
        if known.len() < LEAST || noise.len() != sensing.gauges.len() {
            return self.complain(format!(
                "A calibration takes at least {LEAST} known touches"
            ));
        }
        let mut off = Uncertainty {
            elements: sensing.off.elements,
            ..self.document.state.project.uncertainty()
        };
        if self.live.exact {
            off.pressing = Pressing::EXACT;
        }
        let work = move |_: &Reporter| Ok(calibrate(&sensing.drawn, &known, &noise, &off));
        self.start_sensing(Task::Calibrate, work, |s, _, found| {
            s.take_calibration(&found);
        });
    }

    fn take_calibration(&mut self, found: &Calibration) {
        let project = &mut self.document.state.project;
        project.live.take(found, &project.selection.sites);
        self.tell(format!(
            "Calibrated with {} known touches; what is still off is about {:.1} % of a reading",
            found.touches,
            100.0 * found.relative
        ));
    }
}

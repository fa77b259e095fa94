//! Known touches: pressed where and as hard as was asked for, so that the gauges show how they are glued.

use std::sync::Arc;

use glam::DVec3;

use crate::design::Sensing;
use crate::inference::calibration::SAMPLES;
use crate::inference::{Calibration, Known, calibrate};
use crate::job::Reporter;
use crate::session::jobs::Task;
use crate::session::slot::{Slot, current};
use crate::session::state::Session;
use crate::uncertainty::{Pressing, Uncertainty};

/// How many are proposed, and how many a calibration takes at least.
pub const WANTED: usize = crate::design::PROPOSED;
pub const LEAST: usize = 4;
/// Pictures that are taken of a press: the first may still show the rise.
const FRAMES: usize = 1 + SAMPLES;

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
        self.live.gathering.rows.clear();
        self.live.gathering.exact = false;
        self.live.gathering.at = self.proposed_touch();
    }

    /// Takes the next touches of a simulated board as known ones, and calibrates with them.
    pub fn calibrate_from_board(&mut self) {
        self.live.known.clear();
        self.live.gathering.from_board = true;
        self.live.gathering.exact = true;
        self.live.gathering.rows.clear();
        self.live.gathering.truth = None;
    }

    /// How many known touches there are of these gauges.
    #[must_use]
    pub fn known_touches(&self) -> usize {
        self.known_presses().count()
    }

    /// Those that these gauges have read.
    fn known_presses(&self) -> impl Iterator<Item = &Known> {
        let inputs = self.document.sensing_inputs();
        let all = self.live.known.iter();
        all.filter_map(move |slot| current(Some(slot), &inputs))
    }

    /// Takes in what is read meanwhile.
    pub(super) fn gather_known(&mut self) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        let Some((update, truth)) = self.live.look(|f| (f.update.clone(), f.truth)) else {
            return;
        };
        let Some(update) = update.filter(|u| u.time_us != self.live.gathering.last_us) else {
            return;
        };
        self.live.gathering.last_us = update.time_us;
        let Some(strain) = update.strain else {
            return;
        };
        if let Some(at) = self.live.gathering.at {
            self.live.gathering.rows.push(strain);
            if self.live.gathering.rows.len() >= FRAMES {
                self.live.gathering.at = None;
                let force = self.desk.known_force_n;
                self.keep_known(&sensing, at, force);
            }
        } else if self.live.gathering.from_board {
            self.gather_from_board(&sensing, strain, truth);
        }
    }

    /// A touch whose force stands still is read as long as it does; each once.
    fn gather_from_board(
        &mut self,
        sensing: &Sensing,
        strain: Vec<f64>,
        truth: Option<(DVec3, f64)>,
    ) {
        let gathering = &mut self.live.gathering;
        let same = truth.is_some() && truth == gathering.truth;
        if same {
            if gathering.rows.len() < FRAMES {
                gathering.rows.push(strain);
            }
        } else {
            gathering.rows.clear();
            gathering.truth = truth;
        }
        // The first picture of a plateau may still show the rise.
        let Some((place, force)) = truth.filter(|_| gathering.rows.len() >= FRAMES) else {
            return;
        };
        if gathering.read == Some(place) {
            return;
        }
        gathering.read = Some(place);
        self.keep_known(sensing, place, force);
        if self.known_touches() >= WANTED {
            self.live.gathering.from_board = false;
            self.start_calibration();
        }
    }

    fn keep_known(&mut self, sensing: &Sensing, place: DVec3, force: f64) {
        let rows = std::mem::take(&mut self.live.gathering.rows);
        let mean =
            |c: usize| rows.iter().skip(1).map(|r| r[c]).sum::<f64>() / (rows.len() - 1) as f64;
        // What was not trusted says nothing of how it is glued.
        let used = self.live.look(|f| f.used.clone()).unwrap_or_default();
        let trusted = |c: usize| used.get(c).copied().unwrap_or(true);
        let read = |c: usize| if trusted(c) { mean(c) } else { f64::NAN };
        let reading = (0..sensing.gauges.len()).map(read).collect();
        let at = sensing.drawn.map.mesh.index().nearest(place).0;
        let inputs = self.document.sensing_inputs();
        let value = Known { at, force, reading };
        self.live.known.push(Slot { inputs, value });
    }

    /// Fits how the gauges are glued.
    pub fn start_calibration(&mut self) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        let known: Vec<Known> = self.known_presses().cloned().collect();
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
        if self.live.gathering.exact {
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

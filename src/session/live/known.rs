//! Known touches: pressed where and as hard as was asked for, so that the gauges show how they are glued.

use std::sync::Arc;

use glam::DVec3;

use super::gathering::{Awaited, Gathered};
use crate::design::Sensing;
use crate::inference::calibration::judged::misfits;
use crate::inference::{Calibration, KnownPress, calibrate};
use crate::job::Reporter;
use crate::project::PressKeys;
use crate::session::jobs::Task;
use crate::session::slot::{Slot, current};
use crate::session::state::Session;
use crate::session::state::live::KnownTouch;
use crate::uncertainty::{HandPressing, Uncertainty};

/// How many are proposed, and how many a calibration takes at least.
pub const WANTED: usize = crate::design::PROPOSED;
pub const LEAST: usize = 4;

impl Session {
    /// Where the next known touch is to be pressed (m): where somebody wants to, or as it is proposed.
    #[must_use]
    pub fn proposed_touch(&self) -> Option<DVec3> {
        let sensing = self.sensing()?;
        if self.live.known_at.is_some() {
            return self.live.known_at;
        }
        let places = &sensing.proposed;
        let touch = places.get(self.known_touches() % places.len().max(1))?;
        Some(touch.position)
    }

    /// Has the next known touch pressed at a place of the part (m).
    pub fn ask_known_at(&mut self, at: DVec3) {
        self.live.known_at = Some(at);
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
        self.live.known_recalled = Some((self.board_number(), self.document.sensing_inputs()));
        self.live.known_version += 1;
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
        self.known_list().count()
    }

    /// Those that these gauges and the board that is connected have read, each with the number by which it is left out or deleted.
    pub fn known_list(&self) -> impl Iterator<Item = (usize, &KnownTouch)> {
        let inputs = self.document.sensing_inputs();
        let board = self.board_number();
        let may_be = move |touch: &KnownTouch| match (&touch.board, &board) {
            (Some(own), Some(board)) => own == board,
            _ => true,
        };
        let all = self.live.known.iter().enumerate();
        all.filter_map(move |(number, slot)| Some((number, current(Some(slot), &inputs)?)))
            .filter(move |(_, touch)| may_be(touch))
    }

    /// Where a known touch was asked for (m); nothing where the gauges are others now.
    #[must_use]
    pub fn known_place(&self, touch: &KnownTouch) -> Option<DVec3> {
        Some(self.sensing()?.drawn.map.mesh.point(touch.press.at))
    }

    /// How many of them calibrate.
    #[must_use]
    pub fn known_used(&self) -> usize {
        self.known_list().filter(|(_, touch)| touch.used).count()
    }

    /// Leaves a known touch out, or takes it in again.
    pub fn use_known(&mut self, number: usize, used: bool) {
        if let Some(slot) = self.live.known.get_mut(number) {
            slot.value.used = used;
            self.live.known_version += 1;
        }
    }

    /// Deletes a known touch. It was read from a board, and no undo presses it again: that is said.
    pub fn delete_known(&mut self, number: usize) {
        if number < self.live.known.len() {
            self.live.known.remove(number);
            self.live.known_version += 1;
            self.tell("A known touch was deleted; it can only be pressed again. To keep one without using it, leave it out");
        }
    }

    /// The known touches of these gauges as the project keeps them, with the board that read them.
    fn presses_to_keep(&self) -> Vec<PressKeys> {
        let keep = |touch: &KnownTouch| {
            let at = self.known_place(touch)?;
            Some(PressKeys {
                used: touch.used,
                board: touch.board.clone(),
                ..PressKeys::new(at, touch.press.force, &touch.press.reading)
            })
        };
        let touches = self.known_list().map(|(_, touch)| touch);
        touches.filter_map(keep).collect()
    }

    /// The number of the board that is connected, in hexadecimal.
    fn board_number(&self) -> Option<String> {
        let board = self.live.look(|f| f.hello.as_ref().map(|h| h.board));
        board.flatten().map(|board| format!("{board:08x}"))
    }

    /// Takes the known touches that the project keeps of these gauges and this board: once for either, and not beside others.
    fn recall_known(&mut self, sensing: &Sensing) {
        let asked = Some((self.board_number(), self.document.sensing_inputs()));
        if self.live.known_recalled == asked {
            return;
        }
        self.live.known_recalled = asked;
        if self.known_touches() > 0 {
            return;
        }
        let board = self.board_number().unwrap_or_default();
        let project = &self.document.state.project;
        let kept = project.live.presses_of(&project.selection.sites);
        let inputs = self.document.sensing_inputs();
        let recalled = kept
            .filter(|press| press.may_be_of(&board))
            .map(|press| Slot {
                inputs: inputs.clone(),
                value: KnownTouch {
                    press: KnownPress {
                        at: sensing.drawn.map.mesh.index().nearest(press.position()).0,
                        force: press.force_n,
                        reading: press.reading(),
                    },
                    used: press.used,
                    misfit: None,
                    board: press.board.clone(),
                },
            });
        let recalled: Vec<_> = recalled.collect();
        self.live.known.extend(recalled);
        self.live.known_version += 1;
    }

    /// Takes in what was read meanwhile.
    pub(super) fn gather_known(&mut self) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        self.recall_known(&sensing);
        let from_board = self.live.awaited() == Awaited::Board;
        for gathered in self.live.gathered() {
            self.keep_known(&sensing, &gathered);
        }
        if from_board && self.known_touches() >= WANTED {
            self.stop_taking_known();
            self.start_calibration();
        }
        self.check_known(&sensing);
    }

    /// Looks whether known touches fit each other: each beside all others that are used.
    fn check_known(&mut self, sensing: &Arc<Sensing>) {
        let version = self.live.known_version;
        let noise = self.live.look(|f| f.noise.clone()).unwrap_or_default();
        let ready = noise.len() == sensing.gauges.len() && self.known_used() >= LEAST;
        if !ready
            || self.live.known_checked == version
            || !self.jobs.is_new(Task::CheckKnown, &version)
        {
            return;
        }
        let all: Vec<(usize, KnownTouch)> = (self.known_list())
            .map(|(number, touch)| (number, touch.clone()))
            .collect();
        let (sensing, off) = (Arc::clone(sensing), self.known_off(sensing));
        let work = move |_: &Reporter| {
            let used = all.iter().filter(|(_, touch)| touch.used);
            let used: Vec<KnownPress> = used.map(|(_, touch)| touch.press.clone()).collect();
            let mut of_used = misfits(&sensing.drawn, &used, &noise, &off).into_iter();
            let of_left_out = |touch: &KnownTouch| {
                let beside = [&used[..], std::slice::from_ref(&touch.press)].concat();
                misfits(&sensing.drawn, &beside, &noise, &off).pop()
            };
            let found = all.iter().map(|(number, touch)| {
                let own = if touch.used {
                    of_used.next()
                } else {
                    of_left_out(touch)
                };
                (*number, own)
            });
            Ok(found.collect::<Vec<_>>())
        };
        self.jobs
            .start(Task::CheckKnown, version, work, |s, version, found| {
                if s.live.known_version != version {
                    return;
                }
                s.live.known_checked = version;
                for (number, misfit) in found {
                    if let Some(slot) = s.live.known.get_mut(number) {
                        slot.value.misfit = misfit;
                    }
                }
            });
    }

    /// What is known to be off of known touches.
    fn known_off(&self, sensing: &Sensing) -> Uncertainty {
        let mut off = Uncertainty {
            elements: sensing.off.elements,
            ..self.document.state.project.uncertainty()
        };
        if self.live.exact {
            off.pressing = HandPressing::EXACT;
        }
        off
    }

    fn keep_known(&mut self, sensing: &Sensing, gathered: &Gathered) {
        // What was not trusted says nothing of how it is glued.
        let used = self.live.look(|f| f.used.clone()).unwrap_or_default();
        let trusted = |c: usize| used.get(c).copied().unwrap_or(true);
        let read = |c: usize| gathered.strain.get(c).copied().filter(|_| trusted(c));
        let reading = (0..sensing.gauges.len()).map(|c| read(c).unwrap_or(f64::NAN));
        let press = KnownPress {
            at: sensing.drawn.map.mesh.index().nearest(gathered.at).0,
            force: gathered.force,
            reading: reading.collect(),
        };
        let inputs = self.document.sensing_inputs();
        let value = KnownTouch {
            press,
            used: true,
            misfit: None,
            board: self.board_number(),
        };
        self.live.known.push(Slot { inputs, value });
        self.live.known_version += 1;
        self.live.known_at = None;
    }

    /// Fits how the gauges are glued.
    pub fn start_calibration(&mut self) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return;
        };
        let used = self.known_list().filter(|(_, touch)| touch.used);
        let known: Vec<KnownPress> = used.map(|(_, touch)| touch.press.clone()).collect();
        let noise = self.live.look(|f| f.noise.clone()).unwrap_or_default();
        if known.len() < LEAST || noise.len() != sensing.gauges.len() {
            return self.complain(format!(
                "A calibration takes at least {LEAST} known touches"
            ));
        }
        let off = self.known_off(&sensing);
        let work = move |_: &Reporter| Ok(calibrate(&sensing.drawn, &known, &noise, &off));
        self.start_sensing(Task::Calibrate, work, |s, _, found| {
            s.take_calibration(&found);
        });
    }

    fn take_calibration(&mut self, found: &Calibration) {
        let left = 100.0 * found.relative;
        if !found.explains() {
            return self.complain(format!(
                "Not calibrated: the known touches are of another limb or of other places; of a reading the model leaves {left:.0} %. See that each was pressed where the cross was, with the force that was set, and that every gauge is on its channel"
            ));
        }
        let misfits = (self.known_list())
            .filter(|(_, touch)| touch.used && touch.is_misfit())
            .count();
        let presses = self.presses_to_keep();
        let project = &mut self.document.state.project;
        (project.live).take(found, &project.selection.sites, presses);
        let doubt = match misfits {
            0 => String::new(),
            1 => ". One does not fit the others: leave it out, or press it again".into(),
            some => format!(". {some} do not fit the others: leave them out, or press them again"),
        };
        self.tell(format!(
            "Calibrated with {} known touches; what is still off is about {left:.1} % of a reading{doubt}",
            found.touches
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::inference::AsGlued;
    use crate::io::opening;
    use crate::session::Wake;

    #[test]
    fn presses_of_another_limb_calibrate_nothing() {
        let mut s = Session::new(
            Document::new(opening::bundled().unwrap(), None),
            Wake::default(),
        );
        let before = s.document.state.project.live.clone();
        let mut found = Calibration {
            glued: vec![AsGlued::from([1.0, 0.0, 0.0, 0.0]); 10],
            doubts: vec![[0.0; 10]; 10],
            deviations: vec![0.01; 10],
            relative: 0.7,
            touches: 12,
        };
        s.take_calibration(&found);
        assert_eq!(s.document.state.project.live, before);
        let said = &s.news.messages[0];
        assert!(said.error && said.text.contains("leaves 70 %"), "{said:?}");
        found.relative = 0.02;
        s.take_calibration(&found);
        assert_eq!(s.document.state.project.live.glued.len(), 10);
    }
}

//! What arrives, written down while it arrives.

use std::time::{SystemTime, UNIX_EPOCH};

use super::listener::{Listener, SessionEvent};
use crate::link::Recorder;

impl Listener {
    pub(super) fn record(&mut self, write: impl FnOnce(&mut Recorder)) {
        if let Some(recorder) = &mut self.recorder {
            write(recorder);
        }
    }

    /// A recording can be replayed on its own: it begins with the board and its rest.
    pub(super) fn begin_recording(&mut self) {
        self.pipeline.begin_anew();
        if let Some(mut truths) = self.truths.as_ref().and_then(|t| t.lock().ok()) {
            truths.begin_anew();
        }
        let taring = self.pipeline.is_taring();
        if taring {
            self.pipeline.tare();
        }
        if let (Some(recorder), Some(hello)) = (&mut self.recorder, &self.hello) {
            recorder.hello(hello);
        }
        if let (Some(recorder), Some(rest)) = (&mut self.recorder, self.pipeline.rest()) {
            recorder.rest(rest);
        }
        let dead: Vec<usize> = self.pipeline.dead().collect();
        self.record(|r| {
            if taring {
                r.own("tare");
            }
            for k in dead {
                r.own(&format!("dead {k}"));
            }
        });
    }

    /// When a sample came: what is replayed has a time of its own.
    pub(super) fn record_clock(&mut self, time_us: u64) {
        if !self.address.is_recording() {
            let came = SystemTime::now().checked_sub(self.came.elapsed());
            let since = came.unwrap_or(UNIX_EPOCH).duration_since(UNIX_EPOCH);
            let unix_us = since.map_or(0, |since| since.as_micros() as u64);
            self.record(|r| r.clock(time_us, unix_us));
        }
    }

    /// A recording that can be written no more has ended, and that is said.
    pub(super) fn check_recording(&mut self, tell: &mut impl FnMut(SessionEvent)) {
        if let Some(why) = self.recorder.as_mut().and_then(|r| r.failed.take()) {
            self.recorder = None;
            tell(SessionEvent::Unrecorded(&why));
        }
    }

    pub(super) fn flush_recording(&mut self, tell: &mut impl FnMut(SessionEvent)) {
        if let Some(recorder) = &mut self.recorder {
            recorder.flush();
        }
        self.check_recording(tell);
    }
}

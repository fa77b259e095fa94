//! What a listener is asked to do while it listens.

use super::listener::{Command, Listener, SessionEvent};
use crate::link::{Port, Recorder};
use crate::wire::Message;

impl Listener {
    pub(super) fn turn(&mut self, tell: &mut impl FnMut(SessionEvent)) {
        self.check_recording(tell);
        tell(SessionEvent::Turn {
            traffic: self.receiver.traffic,
            timing: &self.timing,
            pipeline: &self.pipeline,
            recorder: self.recorder.as_ref(),
        });
    }

    pub(super) fn obey(
        &mut self,
        command: Command,
        port: &mut dyn Port,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        match command {
            Command::Tare => {
                self.pipeline.tare();
                self.record(|r| r.own("tare"));
                tell(SessionEvent::Message("the rest is taken again"));
            }
            Command::Rate(hertz) => {
                self.rate = Some(hertz);
                self.say(port, &Message::Rate(hertz));
            }
            Command::Record(path) => match Recorder::create(&path) {
                Ok(recorder) => {
                    self.recorder = Some(recorder);
                    self.begin_recording();
                }
                Err(why) => tell(SessionEvent::Unrecorded(&why)),
            },
            Command::StopRecording => {
                self.flush_recording(tell);
                self.recorder = None;
            }
            Command::Do(work) => {
                work(&mut self.pipeline);
                // The gauges may be on other channels now.
                self.compared = None;
            }
        }
    }
}

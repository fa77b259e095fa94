//! What a listener is asked to do while it listens.

use super::listener::{Listener, ListenerCommand, SessionEvent};
use crate::link::{Port, Recorder};
use crate::wire::WireMessage;

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
        command: ListenerCommand,
        port: &mut dyn Port,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        match command {
            ListenerCommand::Tare => {
                self.pipeline.tare();
                self.record(|r| r.own("tare"));
                tell(SessionEvent::Message("the rest is taken again"));
            }
            ListenerCommand::Rate(hertz) => {
                self.rate = Some(hertz);
                self.say(port, &WireMessage::Rate(hertz));
            }
            ListenerCommand::Record(path) => match Recorder::create(&path) {
                Ok(recorder) => {
                    self.recorder = Some(recorder);
                    self.begin_recording();
                }
                Err(why) => tell(SessionEvent::Unrecorded(&why)),
            },
            ListenerCommand::StopRecording => {
                self.flush_recording(tell);
                self.recorder = None;
            }
            ListenerCommand::Do(work) => {
                work(&mut self.pipeline);
                // The gauges may be on other channels now.
                self.compared = None;
            }
        }
    }
}

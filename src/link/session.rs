//! The thread that listens: opens, asks, reads, understands, records, and finds the board again.

mod connection;
mod listener;
mod notes;
mod orders;
mod reconnect;
mod recording;
mod samples;
mod timing;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver as Inbox;
use std::time::{Duration, Instant};

use super::{Got, HeldConnection, Port, old_note};
use crate::live::{Input, Unusable};
use crate::plain;
use crate::wire::{Hello, WireMessage};

pub use connection::Connection;
pub use listener::{ConnectionState, Listener, ListenerCommand, SessionEvent};
pub use timing::Timing;

/// Asked again so often while nothing is understood; silence that is told.
const ASK: Duration = Duration::from_millis(400);
const SILENCE: Duration = Duration::from_millis(700);
/// How long a board may take to be understood before it is said why it is not.
const PATIENCE: Duration = Duration::from_secs(3);
/// The most reasons that are told of one connection.
const REASONS: usize = 8;

impl Listener {
    /// Listens until it is told to stop, or a recording ends. Unplugged boards are waited for.
    ///
    /// # Errors
    /// When the port cannot be opened at first, or nothing in a recording can be used.
    pub fn run(
        mut self,
        stop: &AtomicBool,
        inbox: &Inbox<ListenerCommand>,
        mut tell: impl FnMut(SessionEvent),
    ) -> Result<(), String> {
        let mut port = match self.held.take().and_then(HeldConnection::port) {
            Some(port) => port,
            None => self.address.open()?,
        };
        self.remember_device();
        if self.recorder.is_some() {
            self.begin_recording();
        }
        loop {
            self.enter(ConnectionState::Waiting, &mut tell);
            self.listen(&mut *port, stop, inbox, &mut tell);
            self.flush_recording(&mut tell);
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            if self.address.is_recording() {
                return self.end(&mut tell);
            }
            self.enter(ConnectionState::Gone, &mut tell);
            match self.find_again(stop, inbox, &mut tell) {
                Some(again) => port = again,
                None => return Ok(()),
            }
        }
    }

    /// The recording is over; whether it was of any use.
    fn end(&mut self, tell: &mut impl FnMut(SessionEvent)) -> Result<(), String> {
        let refused = self.receiver.traffic.refused;
        if self.measured > 0 {
            if refused > 0 {
                tell(SessionEvent::Message(&format!(
                    "frames of the recording that are damaged or not understood, and were left out: {refused}"
                )));
            }
            self.enter(ConnectionState::Ended, tell);
            return Ok(());
        }
        let why = self.receiver.unusable().and_then(Unusable::in_words);
        let why = why.map_or(String::new(), |why| format!(": {why}"));
        Err(format!(
            "{}: there is no reading in this recording that can be used{why}",
            self.address
        ))
    }

    /// Until the port is gone.
    fn listen(
        &mut self,
        port: &mut dyn Port,
        stop: &AtomicBool,
        inbox: &Inbox<ListenerCommand>,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        self.receiver.reset();
        self.explained.clear();
        self.compared = None;
        (self.noted, self.last_arrival) = (false, Instant::now());
        let mut buffer = vec![0; 16 * 1024];
        let mut inputs = Vec::new();
        let mut asked = None::<Instant>;
        while !stop.load(Ordering::Relaxed) {
            while let Ok(command) = inbox.try_recv() {
                self.obey(command, port, tell);
            }
            let live = self.state == ConnectionState::Live;
            if !live && !self.receiver.speaks_lines() && asked.is_none_or(|t| t.elapsed() > ASK) {
                self.say(port, &WireMessage::AskHello);
                asked = Some(Instant::now());
            }
            match port.read(&mut buffer) {
                Got::Gone => return,
                Got::Nothing => {}
                Got::Bytes(count) => {
                    let arrived = Instant::now();
                    self.came = port.came();
                    let since = self.came.saturating_duration_since(self.begun);
                    let now_us = since.as_micros() as u64;
                    self.receiver
                        .push(&buffer[..count], now_us, |input| inputs.push(input));
                    for input in inputs.drain(..) {
                        self.take(input, arrived, port, tell);
                    }
                    let temperature = self.receiver.traffic.temperature();
                    self.record(|r| r.temperature(temperature));
                }
            }
            // Bytes that cannot be used are silence too.
            if self.state == ConnectionState::Live && self.last_arrival.elapsed() > SILENCE {
                self.enter(ConnectionState::Silent, tell);
            }
            self.explain(tell);
            self.turn(tell);
        }
    }

    /// Says why nothing that comes can be used: at once where waiting will not help.
    fn explain(&mut self, tell: &mut impl FnMut(SessionEvent)) {
        let Some(doubt) = self.receiver.unusable() else {
            return;
        };
        let due = doubt.is_lasting() || self.last_arrival.elapsed() > PATIENCE;
        if !due || self.explained.contains(&doubt) || self.explained.len() >= REASONS {
            return;
        }
        self.explained.push(doubt);
        if let Some(words) = doubt.in_words() {
            tell(SessionEvent::Trouble(&words));
        }
    }

    fn take(
        &mut self,
        input: Input,
        arrived: Instant,
        port: &mut dyn Port,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        match input {
            Input::Hello(hello) => self.greet(hello, port, tell),
            Input::Sample(sample) => self.measure(&sample, arrived, tell),
            Input::Log {
                level,
                text,
                time_us,
            } => match old_note(level, &text).filter(|_| self.has_old_notes()) {
                Some(own) => self.replay(own, time_us, arrived, tell),
                None => tell(SessionEvent::Message(&as_said(&text))),
            },
            Input::Note { text, time_us } if self.address.is_recording() => {
                self.noted = true;
                self.replay(&text, time_us, arrived, tell);
            }
            // What a board says is never a command.
            Input::Note { .. } | Input::Pong(_) => {}
        }
    }

    /// Recordings from before there were notes held texts in their place, and no other texts.
    fn has_old_notes(&self) -> bool {
        self.address.is_recording() && !self.noted
    }

    fn greet(&mut self, hello: Hello, port: &mut dyn Port, tell: &mut impl FnMut(SessionEvent)) {
        self.pipeline.hello(&hello);
        self.record(|r| r.hello(&hello));
        tell(SessionEvent::Hello(&Hello {
            name: plain::message(&in_one_line(&hello.name)),
            ..hello.clone()
        }));
        if self.compared.is_none() {
            // It has as long again to send what it is asked for now.
            self.last_arrival = Instant::now();
        }
        self.compare_channels(usize::from(hello.channels), tell);
        if let Some(rate) = self
            .rate
            .filter(|&r| r != hello.rate_hz && self.hello.as_ref() != Some(&hello))
        {
            self.say(port, &WireMessage::Rate(rate));
        }
        self.hello = Some(hello);
        self.say(port, &WireMessage::Start);
    }
}

/// A text of a board cannot be taken for the studio's own words.
fn as_said(text: &str) -> String {
    let text = plain::message(&in_one_line(text)).replace(['“', '”'], "\"");
    format!("the board says: “{text}”")
}

/// A text of a board cannot be taken for several of our own.
fn in_one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

#[cfg(test)]
mod tests;

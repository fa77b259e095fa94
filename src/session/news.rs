//! What a session has to say, and what has happened in it that whoever shows it may want to follow.

use std::path::PathBuf;

/// Something to tell the user that stays until it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct UserMessage {
    pub text: String,
    pub error: bool,
}

/// Something that has happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Happening {
    /// Another project is open; a file that it came from, and whether that was what had been kept aside.
    Opened {
        file: Option<PathBuf>,
        recovered: bool,
    },
    Saved(PathBuf),
    /// The first design of the project is there.
    Designed,
    /// Other gauges have taken the place of those that were there.
    GaugesReplaced,
    /// This gauge was found or added, by its number from zero.
    GaugeFound(usize),
    /// A selection is kept by this name.
    Kept(String),
    /// A board is being listened to.
    Connected,
}

/// Messages until they are read, and events until they are taken.
#[derive(Debug, Default)]
pub struct SessionNews {
    pub messages: Vec<UserMessage>,
    events: Vec<Happening>,
}

impl SessionNews {
    pub fn tell(&mut self, text: impl Into<String>) {
        self.messages.push(UserMessage {
            text: text.into(),
            error: false,
        });
    }

    pub fn complain(&mut self, text: impl Into<String>) {
        self.messages.push(UserMessage {
            text: text.into(),
            error: true,
        });
    }

    /// A message was read.
    pub fn dismiss(&mut self, number: usize) {
        if number < self.messages.len() {
            self.messages.remove(number);
        }
    }

    /// What was told is of something that is not open any more; what went wrong stays until it is read.
    pub(super) fn leave(&mut self) {
        self.messages.retain(|message| message.error);
    }

    pub(super) fn happened(&mut self, event: Happening) {
        self.events.push(event);
    }

    /// What has happened since the last call, in its order.
    pub fn take_events(&mut self) -> Vec<Happening> {
        std::mem::take(&mut self.events)
    }
}

//! What a session has to say, and what has happened in it that whoever shows it may want to follow.

use std::path::PathBuf;

use crate::live::LiveNews;

/// Something to tell the user that stays until it is read, or is so no more.
#[derive(Clone, Debug, PartialEq)]
pub struct UserMessage {
    pub text: String,
    pub error: bool,
    /// What it tells of a board.
    live: Option<LiveNews>,
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
        self.say(text.into(), false, None);
    }

    pub fn complain(&mut self, text: impl Into<String>) {
        self.say(text.into(), true, None);
    }

    /// What a board has to say now takes the place of what it said of the same thing before.
    pub fn report(&mut self, news: LiveNews) {
        let is_over = |m: &UserMessage| m.live.is_some_and(|told| news.follows(told));
        self.messages.retain(|message| !is_over(message));
        self.say(format!("Board: {}", news.in_words()), false, Some(news));
    }

    /// Another board is listened to.
    pub(super) fn forget_board(&mut self) {
        self.messages.retain(|message| message.live.is_none());
    }

    /// What is said again is not said twice.
    fn say(&mut self, text: String, error: bool, live: Option<LiveNews>) {
        let message = UserMessage { text, error, live };
        self.messages.retain(|said| *said != message);
        self.messages.push(message);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::Health;

    fn texts(news: &SessionNews) -> Vec<&str> {
        news.messages.iter().map(|m| &*m.text).collect()
    }

    #[test]
    fn what_is_over_makes_room_for_what_is() {
        let mut news = SessionNews::default();
        news.tell("Saved");
        news.report(LiveNews::Gauge(2, Health::Stuck));
        news.report(LiveNews::Gauge(4, Health::Noisy));
        news.report(LiveNews::Waiting);
        news.report(LiveNews::Gauge(2, Health::Good));
        news.report(LiveNews::Still);
        let said = texts(&news);
        assert_eq!(said[0], "Saved");
        assert!(said[1].starts_with("Board: gauge 5 is left out"));
        assert_eq!(
            said[2..],
            [
                "Board: gauge 3 is trusted again",
                "Board: the gauges are still: the rest is taken"
            ]
        );
        news.forget_board();
        assert_eq!(texts(&news), ["Saved"]);
    }

    #[test]
    fn what_is_said_again_is_not_said_twice() {
        let mut news = SessionNews::default();
        for text in ["a.stl: no such file", "Saved", "a.stl: no such file"] {
            news.complain(text);
        }
        assert_eq!(texts(&news), ["Saved", "a.stl: no such file"]);
    }
}

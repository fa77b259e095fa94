//! States in words, with the colour that they are said in where they are to be noticed.

use super::theme;
use crate::link::State;
use crate::session::Session;

/// How the connection stands.
#[must_use]
pub fn live_in_words(session: &Session) -> (String, Option<egui::Color32>) {
    if session.live.is_preparing() {
        return ("Making the model of the gauges …".into(), None);
    }
    let (state, taring, tared, trouble) = session
        .live
        .look(|f| (f.state.clone(), f.taring, f.tared, f.trouble.clone()))
        .unwrap_or_default();
    if let Some(why) = trouble.filter(|_| matches!(state, Some(State::Waiting | State::Silent))) {
        return (format!("Not understood: {why}"), Some(theme::ERROR));
    }
    match state {
        None => ("Not connected".into(), None),
        Some(State::Waiting) => ("Waiting for the board".into(), None),
        Some(State::Live) if taring => ("Taring: do not touch".into(), Some(theme::TOUCHED)),
        Some(State::Live) if !tared => ("Live, not tared".into(), Some(theme::STALE)),
        Some(State::Live) => ("Live".into(), None),
        Some(State::Silent) => ("The board has fallen silent".into(), Some(theme::ERROR)),
        Some(State::Gone) => (
            "Unplugged: waiting for the board".into(),
            Some(theme::ERROR),
        ),
        Some(State::Ended) => ("The recording is over".into(), None),
    }
}

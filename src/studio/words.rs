//! States in words, with the colour that they are said in where they are to be noticed.

use super::theme;
use crate::link::ConnectionState;
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
    if let Some(why) = trouble.filter(|_| {
        matches!(
            state,
            Some(ConnectionState::Waiting | ConnectionState::Silent)
        )
    }) {
        return (format!("Not understood: {why}"), Some(theme::ERROR));
    }
    match state {
        None => ("Not connected".into(), None),
        Some(ConnectionState::Waiting) => ("Waiting for the board".into(), None),
        Some(ConnectionState::Live) if taring => {
            ("Taring: do not touch".into(), Some(theme::TOUCHED))
        }
        Some(ConnectionState::Live) if !tared => ("Live, not tared".into(), Some(theme::STALE)),
        Some(ConnectionState::Live) => ("Live".into(), None),
        Some(ConnectionState::Silent) => ("The board has fallen silent".into(), Some(theme::ERROR)),
        Some(ConnectionState::Gone) => (
            "Unplugged: waiting for the board".into(),
            Some(theme::ERROR),
        ),
        Some(ConnectionState::Ended) => ("The recording is over".into(), None),
    }
}

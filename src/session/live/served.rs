//! Who looks at touches elsewhere, shared with the listening thread.

use std::sync::{Arc, Mutex, PoisonError};

use crate::link::{ConnectionState, FoxgloveServer, SessionEvent};

/// Who serves touches, shared with the listening thread.
pub type ServerShared = Arc<Mutex<Option<FoxgloveServer>>>;

/// Where touches are served where nobody says otherwise: what Foxglove proposes, on this machine alone.
pub const USUAL_ADDRESS: &str = "127.0.0.1:8765";

/// Serves what happened on the line.
pub fn hear(server: &ServerShared, event: &SessionEvent) {
    let server = server.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(server) = server.as_ref() {
        match event {
            SessionEvent::Sample { update, .. } => server.sample(update),
            SessionEvent::State(state) if **state != ConnectionState::Live => server.let_go(),
            _ => {}
        }
    }
}

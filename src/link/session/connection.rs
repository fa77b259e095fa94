//! Listening on a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};

use super::{Listener, ListenerCommand, SessionEvent};

/// A listener on a thread of its own; it ends when this is dropped.
pub struct Connection {
    commands: Sender<ListenerCommand>,
    stop: Arc<AtomicBool>,
}

impl Connection {
    /// Starts to listen. `tell` is called on the listening thread; `ended` at the end, with why it could not begin.
    ///
    /// # Errors
    /// When no thread can be had.
    pub fn start(
        listener: Listener,
        tell: impl FnMut(SessionEvent) + Send + 'static,
        ended: impl FnOnce(Result<(), String>) + Send + 'static,
    ) -> Result<Self, String> {
        let (commands, inbox) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stop);
        std::thread::Builder::new()
            .name("board".into())
            .spawn(move || ended(listener.run(&stopping, &inbox, tell)))
            .map_err(|e| format!("the port cannot be listened to ({e})"))?;
        Ok(Self { commands, stop })
    }

    pub fn send(&self, command: ListenerCommand) {
        // A listener that has ended hears nothing any more, and has said so.
        let _ = self.commands.send(command);
    }
}

impl Drop for Connection {
    /// Does not wait: a thread that is looking for an unplugged board may take a moment to hear of it.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

//! Touches for others: as they come, and a recording's as messages.

use std::path::Path;
use std::sync::{Arc, PoisonError};

use crate::io::handover;
use crate::io::run::Provenance;
use crate::job::Stop;
use crate::link::{FoxgloveServer, McapLog, write_messages};
use crate::session::Session;
use crate::session::jobs::Task;
use crate::session::live::served::USUAL_ADDRESS;

impl Session {
    /// Serves touches at `HOST:PORT` to Foxglove from now on.
    pub fn serve_touches(&mut self, address: &str) {
        let address = match address.trim() {
            "" => USUAL_ADDRESS,
            address => address,
        };
        // Whoever was served is let go first: it may be the same port.
        self.stop_serving();
        match FoxgloveServer::open(address, &self.link()) {
            Ok(server) => {
                let at = server.address();
                self.live.served_at = at;
                *self
                    .live
                    .server
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner) = Some(server);
                let at = at.map_or_else(|| address.to_owned(), |at| at.to_string());
                self.tell(format!("Foxglove finds touches at ws://{at}"));
            }
            Err(why) => self.complain(format!("{why}. Choose another address")),
        }
    }

    /// Serves nobody any more.
    pub fn stop_serving(&mut self) {
        self.live.served_at = None;
        *self
            .live
            .server
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Replays a recording into a file of messages (MCAP) beside it.
    pub fn write_messages(&mut self, recording: &Path) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return self.complain("Messages are made by the model of the gauges: connect first");
        };
        let (model, settings) = self.gauge_model(&sensing);
        let (recording, link) = (recording.to_owned(), self.link());
        let work = move |_: &_| {
            let pipeline = crate::live::Pipeline::new(model, settings);
            let path = recording.with_extension("mcap");
            // The older one stays until this is whole.
            let begun = recording.with_extension("mcap.part");
            let log = McapLog::replace(&begun, &link).map_err(Stop::Failed)?;
            let written = write_messages(&recording, log, pipeline)
                .and_then(|()| Ok(std::fs::rename(&begun, &path)?));
            written.map_err(|e| {
                let _ = std::fs::remove_file(&begun);
                Stop::Failed(format!("{}: {e:#}", path.display()))
            })?;
            Ok(path)
        };
        // A file that was written is there whatever has changed since.
        self.jobs.start(Task::Messages, (), work, |s, (), path| {
            s.tell(format!("The messages are in {}", path.display()));
        });
    }

    /// The frame that places are in.
    fn link(&self) -> String {
        handover::link(&Provenance {
            mesh_path: &self.document.mesh_path,
            version: env!("CARGO_PKG_VERSION"),
            taken_in: None,
        })
    }
}

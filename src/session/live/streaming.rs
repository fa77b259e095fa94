//! Touches for others: as they come, and a recording's as a table or as messages.

use std::path::Path;
use std::sync::{Arc, PoisonError};

use crate::budget::Cancelled;
use crate::io::handover;
use crate::io::run::Provenance;
use crate::job::{Reporter, Stop};
use crate::link::{FoxgloveServer, write_messages, write_table};
use crate::live::Pipeline;
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
        let (address, link) = (address.to_owned(), self.link());
        // The name of a host may take a while to be looked up.
        let work = move |_: &Reporter| {
            let opened = FoxgloveServer::open(&address, &link);
            let opened = opened.map(|server| (address, server));
            opened.map_err(|why| Stop::Failed(format!("{why}. Choose another address")))
        };
        self.jobs
            .start(Task::Serve, (), work, |s, (), (address, server)| {
                let at = server.address();
                s.live.served_at = at;
                s.put_server(Some(server));
                let at = at.map_or(address, |at| at.to_string());
                s.tell(format!("Foxglove finds touches at ws://{at}"));
            });
    }

    /// Serves nobody any more.
    pub fn stop_serving(&mut self) {
        self.jobs.cancel(|task| task == Task::Serve);
        self.live.served_at = None;
        self.put_server(None);
    }

    fn put_server(&self, server: Option<FoxgloveServer>) {
        let mut served = (self.live.server.lock()).unwrap_or_else(PoisonError::into_inner);
        *served = server;
    }

    /// Replays a recording into a file of messages (MCAP) beside it.
    pub fn write_messages(&mut self, recording: &Path) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return self.complain("Messages are made by the model of the gauges: connect first");
        };
        let (model, settings) = self.gauge_model(&sensing);
        let (recording, link) = (recording.to_owned(), self.link());
        let work = move |reporter: &Reporter| {
            let pipeline = Pipeline::new(model, settings);
            let path = recording.with_extension("mcap");
            let to = (path.as_path(), &link[..]);
            let written = write_messages(&recording, to, pipeline, &|p| reporter.report(p));
            written.map_err(|e| rewriting_ended(&e))?;
            Ok(path)
        };
        // A file that was written is there whatever has changed since.
        self.jobs.start(Task::Messages, (), work, |s, (), path| {
            s.tell(format!("The messages are in {}", path.display()));
        });
    }

    /// Replays a recording into a table beside it.
    pub fn write_table(&mut self, recording: &Path) {
        let Some(sensing) = self.sensing().map(Arc::clone) else {
            return self.complain("The table is made by the model of the gauges: connect first");
        };
        let (model, settings) = self.gauge_model(&sensing);
        let recording = recording.to_owned();
        let work = move |reporter: &Reporter| {
            let pipeline = Pipeline::new(model, settings);
            let table = recording.with_extension("csv");
            let written = write_table(&recording, &table, pipeline, &|p| reporter.report(p));
            written.map_err(|e| rewriting_ended(&e))
        };
        // A file that was written is there whatever has changed since.
        self.jobs.start(Task::Table, (), work, |s, (), paths| {
            let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
            s.tell(format!("The table is in {}", names.join(" and ")));
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

/// Why a recording was not written as another file.
fn rewriting_ended(error: &anyhow::Error) -> Stop {
    if error.is::<Cancelled>() {
        Stop::Cancelled
    } else {
        Stop::Failed(format!("{error:#}"))
    }
}

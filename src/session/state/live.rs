//! A connection to a board, and what is known of the gauges that it reads.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use crate::design::Sensing;
use crate::document::SensingInputs;
use crate::inference::KnownPress;
use crate::inference::calibration::judged::MISFIT;
use crate::link::{Address, Connection, ConnectionState, Hosted, ListenerCommand};
use crate::live::LiveUpdate;
use crate::project::LiveKeys;
use crate::session::live::feed::{Feed, FeedShared};
use crate::session::live::gathering::{Awaited, Gathered};
use crate::session::live::served::ServerShared;
use crate::session::live::training::TrainedPair;
use crate::session::slot::Slot;
use crate::session::state::learned::Learnt;

/// What is to be listened to once the model is there.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::session) enum Target {
    Board(Address),
    Simulated,
}

/// A known touch, as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownTouch {
    /// Where it was asked for, how hard, and what the gauges read.
    pub press: KnownPress,
    /// Whether the gauges are calibrated with it.
    pub used: bool,
    /// How far off it is from what all others foresee: weighted squares a channel, about one where it fits. Absent until that
    /// was looked at.
    pub misfit: Option<f64>,
    /// The number of the board that read it, where it has one.
    pub board: Option<String>,
}

impl KnownTouch {
    /// Whether it was made otherwise than it says, as far as all others tell.
    #[must_use]
    pub fn is_misfit(&self) -> bool {
        self.misfit.is_some_and(|misfit| misfit > MISFIT)
    }
}

/// Trained estimators, and the gauges that they were trained for.
pub(in crate::session) type TrainedFor = (Vec<bool>, TrainedPair);

/// A connection, and what is known of the gauges that it reads.
#[derive(Default)]
pub struct Live {
    /// The model of the gauges.
    pub(in crate::session) sensing: Option<Slot<SensingInputs, Arc<Sensing>>>,
    pub(in crate::session) connection: Option<Connection>,
    /// A simulated board of our own.
    pub(in crate::session) hosted: Option<Hosted>,
    pub(in crate::session) feed: FeedShared,
    pub(in crate::session) target: Option<Target>,
    /// Known touches, with the gauges that read them: of others they say nothing.
    pub(in crate::session) known: Vec<Slot<SensingInputs, KnownTouch>>,
    /// For which board and gauges those that the project keeps were taken in.
    pub(in crate::session) known_recalled: Option<(Option<String>, SensingInputs)>,
    /// Counts what is done to these.
    pub(in crate::session) known_version: u64,
    /// For which of these versions it was looked at whether they fit each other.
    pub(in crate::session) known_checked: u64,
    /// Where somebody wants to press next (m), in place of what is proposed.
    pub(in crate::session) known_at: Option<DVec3>,
    /// Whether all of them were read off a board that tells where it is pressed, and how hard.
    pub(in crate::session) exact: bool,
    pub(in crate::session) trained: Option<Slot<SensingInputs, TrainedFor>>,
    /// For which gauges training was begun.
    pub(in crate::session) training_for: Option<Vec<bool>>,
    /// What was learned from presses, and is gone by.
    pub(in crate::session) learnt: Option<Learnt>,
    /// Who serves touches to others, and where.
    pub(in crate::session) server: ServerShared,
    pub served_at: Option<std::net::SocketAddr>,
    /// The last recording that was begun.
    pub recorded: Option<PathBuf>,
    /// The settings that the pipeline has.
    pub(in crate::session) applied: Option<LiveKeys>,
}

impl Live {
    /// What is heard at the moment.
    pub fn look<T>(&self, at: impl FnOnce(&Feed) -> T) -> Option<T> {
        self.feed.lock().ok().map(|feed| at(&feed))
    }

    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.connection.is_some()
    }

    /// Whether a board is to be listened to once the model of the gauges is there.
    #[must_use]
    pub fn is_preparing(&self) -> bool {
        self.target.is_some()
    }

    /// The simulated board of our own, to make things go wrong.
    #[must_use]
    pub fn simulated_board(&self) -> Option<&Hosted> {
        self.hosted.as_ref()
    }

    /// How the connection stands; nothing where there is none.
    #[must_use]
    pub fn state(&self) -> Option<ConnectionState> {
        self.connection.as_ref()?;
        self.look(|feed| feed.state.clone()).flatten()
    }

    /// What the last sample said.
    #[must_use]
    pub fn update(&self) -> Option<LiveUpdate> {
        self.look(|feed| feed.update.clone()).flatten()
    }

    /// Where a simulated board is really touched (m, N).
    #[must_use]
    pub fn truth(&self) -> Option<(DVec3, f64)> {
        self.look(|feed| feed.truth).flatten()
    }

    /// Which known touches are being read.
    #[must_use]
    pub fn awaited(&self) -> Awaited {
        self.look(|feed| feed.gathering.awaited())
            .unwrap_or_default()
    }

    /// Begins to read known touches, or ends it.
    pub(in crate::session) fn await_known(&self, what: Awaited) {
        if let Ok(mut feed) = self.feed.lock() {
            feed.gathering.begin(what);
        }
    }

    /// The known touches that were read since somebody asked last.
    pub(in crate::session) fn gathered(&self) -> Vec<Gathered> {
        let feed = self.feed.lock();
        feed.map(|mut feed| feed.gathering.take())
            .unwrap_or_default()
    }

    pub(in crate::session) fn send(&self, command: ListenerCommand) {
        if let Some(connection) = &self.connection {
            connection.send(command);
        }
    }
}

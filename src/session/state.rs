//! What a session consists of: an open project, what runs for it, and what is known of it. What is done with that stands
//! in files of its own beside this one, each of which may use those that it builds on.

pub mod bench;
pub mod by_hand;
pub mod confusions;
pub mod drive;
pub mod expected;
pub mod fields;
pub mod learned;
pub mod live;
pub mod measure;
pub mod pressing;
pub mod results;
pub mod study;
pub mod touching;
pub mod trade;

use std::path::PathBuf;
use std::sync::Arc;

use super::desk::Desk;
use super::jobs::Jobs;
use super::news::SessionNews;
use super::shape::PartShape;
use super::slot::Slot;
use super::wake::Wake;
use crate::budget::{Budget, Quality};
use crate::design::Advice;
use crate::document::{Document, JigInputs, WallInputs};
use crate::jig::Jig;
use bench::Bench;
use by_hand::ByHand;
use confusions::Confusions;
use drive::Drive;
use expected::Expecting;
use fields::FieldValues;
use live::Live;
use measure::Ends;
use results::Results;
use study::Study;
use touching::Touching;
use trade::Trade;

/// What can be had again from the project and its results, kept because it takes a while.
#[derive(Default)]
pub struct Caches {
    pub touching: Touching,
    pub by_hand: ByHand,
    pub expected: Expecting,
    pub confusions: Confusions,
    /// What is known of the part's walls.
    pub walls: Option<Slot<WallInputs, Arc<Advice>>>,
    /// The jig for the chosen gauges.
    pub jig: Option<Slot<JigInputs, Arc<Jig>>>,
    pub field: Option<FieldValues>,
    pub distance: Option<Slot<Ends, f64>>,
    pub trade: Trade,
}

/// An open project, what runs for it, and what was computed of it.
pub struct Session {
    pub document: Document,
    /// Of the part.
    pub shape: PartShape,
    pub jobs: Jobs<Session>,
    pub results: Results,
    pub caches: Caches,
    pub live: Live,
    pub bench: Bench,
    /// Beside the project.
    pub study: Study,
    pub drive: Drive,
    /// What stays when another project is opened.
    pub desk: Desk,
    pub news: SessionNews,
    /// Where to save once what is being saved is.
    pub(in crate::session) save_next: Option<PathBuf>,
    pub(in crate::session) wake: Wake,
}

impl Session {
    /// A session with nothing computed of its project yet; `wake` is called when there is something to see.
    #[must_use]
    pub fn new(document: Document, wake: Wake) -> Self {
        let shape = PartShape::of(&document);
        Self::shaped(document, shape, wake)
    }

    pub(super) fn shaped(document: Document, shape: PartShape, wake: Wake) -> Self {
        Self {
            document,
            shape,
            jobs: Jobs::new(wake.clone()),
            results: Results::default(),
            caches: Caches::default(),
            live: Live::default(),
            bench: Bench::default(),
            study: Study::default(),
            drive: Drive::default(),
            desk: Desk::default(),
            news: SessionNews::default(),
            save_next: None,
            wake,
        }
    }

    /// Whether a job is running that somebody waits for.
    #[must_use]
    pub fn busy(&self) -> bool {
        !self.jobs.running().is_empty()
    }

    /// The quality that is asked for.
    #[must_use]
    pub fn quality(&self) -> Quality {
        self.document.state.project.budget.quality
    }

    /// What may be spent.
    #[must_use]
    pub fn budget(&self) -> Budget {
        self.document.state.project.budget.budget()
    }

    /// Says something that stays until it is read.
    pub fn tell(&mut self, text: impl Into<String>) {
        self.news.tell(text);
    }

    /// As [`Self::tell`], of something that went wrong.
    pub fn complain(&mut self, text: impl Into<String>) {
        self.news.complain(text);
    }

    pub(super) fn dropped(&mut self, what: &str) {
        self.tell(format!(
            "The {what} was for settings that have changed since, and was dropped"
        ));
    }
}

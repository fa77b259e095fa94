//! An open project with all that is computed of it: what the window shows and asks for, without a window.
//!
//! A session is driven by commands (`open`, `simulate`, `select`, `undo`, `save_to`, `connect`, …) and by
//! [`Session::advance`], which takes in what jobs and workers have brought and starts what is next. Every result is kept
//! with the inputs that it was computed from ([`Slot`]), and is shown as what the project gives only while these are the
//! project's. Opening another project puts another session in this one's place.

mod attention;
mod confusions;
mod desk;
mod drive;
mod expected;
mod fields;
mod gauges;
mod helping;
mod jobs;
mod kept;
mod latest;
mod live;
mod measure;
mod news;
mod opening;
mod results;
mod saving;
mod shape;
mod slot;
mod standing;
mod touching;
mod trade;
mod wake;
mod walls;

use std::path::PathBuf;

use crate::document::Document;
use crate::job::Outcome;

pub use attention::{Attention, Colours};
pub use confusions::{Confusions, Taken};
pub use desk::Desk;
pub use drive::Drive;
pub use expected::{ExpectedOf, Expecting};
pub use fields::{FieldInputs, FieldKind, FieldValues};
pub use gauges::{ByHand, SAME_MM};
pub use jobs::{Ended, Jobs, Running, Task, duration};
pub use kept::chooser_title;
pub use live::{Feed, LEAST_KNOWN, Live, Recording, STRIPS_S, Strip, WANTED_KNOWN};
pub use measure::{Distance, Ends};
pub use news::{Event, Message, News};
pub use opening::Opened;
pub use results::{DesignMark, DesignResult, Results, SimulationResult};
pub use shape::Shape;
pub use slot::{Slot, current};
pub use standing::{NOBODY_REDUCES, Stage, Standing};
pub use touching::{Touched, Touching};
pub use trade::{Promise, Trade};
pub use wake::Wake;
pub use walls::Walls;

/// What can be had again from the project and its results, kept because it takes a while.
#[derive(Default)]
pub struct Caches {
    pub touching: Touching,
    pub by_hand: ByHand,
    pub expected: Expecting,
    pub confusions: Confusions,
    pub walls: Walls,
    pub field: Option<FieldValues>,
    pub distance: Option<Slot<Ends, f64>>,
    pub trade: Trade,
}

/// An open project, what runs for it, and what was computed of it.
pub struct Session {
    pub document: Document,
    /// Of the part.
    pub shape: Shape,
    pub jobs: Jobs,
    pub results: Results,
    pub caches: Caches,
    pub live: Live,
    pub drive: Drive,
    /// What stays when another project is opened.
    pub desk: Desk,
    pub news: News,
    /// Where to save once what is being saved is.
    save_next: Option<PathBuf>,
    wake: Wake,
}

impl Session {
    /// A session with nothing computed of its project yet; `wake` is called when there is something to see.
    #[must_use]
    pub fn new(document: Document, wake: Wake) -> Self {
        let shape = Shape::of(&document);
        Self::shaped(document, shape, wake)
    }

    fn shaped(document: Document, shape: Shape, wake: Wake) -> Self {
        Self {
            document,
            shape,
            jobs: Jobs::new(wake.clone()),
            results: Results::default(),
            caches: Caches::default(),
            live: Live::default(),
            drive: Drive::default(),
            desk: Desk::default(),
            news: News::default(),
            save_next: None,
            wake,
        }
    }

    /// Puts another project in this one's place. Only what is named here, which belongs to the desk, goes over to it:
    /// whatever else is known or under way was of the one before.
    fn replace(&mut self, document: Document, shape: Shape) {
        let next = Self::shaped(document, shape, self.wake.clone());
        let old = std::mem::replace(self, next);
        self.jobs = old.jobs.for_another_session();
        self.desk = old.desk;
        self.news = old.news;
        self.show_estimator(self.desk.estimator);
    }

    /// Whether a job is running that somebody waits for.
    #[must_use]
    pub fn busy(&self) -> bool {
        !self.jobs.running().is_empty()
    }

    /// Takes in what jobs and workers have brought, and starts what is next.
    pub fn advance(&mut self, attention: &Attention) {
        self.collect_jobs();
        self.save_waiting();
        self.collect_touches();
        self.go_on(attention);
        if !attention.hand {
            self.refresh_feasibility();
        }
        self.refresh_by_hand(attention);
        self.refresh_expected(attention);
        self.refresh_confusions(attention);
        self.refresh_field(attention);
        self.refresh_walls(attention);
        self.refresh_live();
        if !attention.hand {
            self.refresh_trade();
        }
    }

    /// What jobs have brought is done with as they were told when they were started.
    fn collect_jobs(&mut self) {
        for ended in self.jobs.collect() {
            self.wake.now();
            // What was read or computed of a project that is closed is nobody's; what was written is there.
            if ended.session != self.jobs.session() && !ended.task.writes() {
                continue;
            }
            match ended.result {
                Outcome::Done(finish) => finish(self),
                Outcome::Failed(message) => {
                    self.complain(format!("{}: {message}", ended.task.name()));
                    self.jobs.fail(ended.task, ended.inputs, message);
                }
                Outcome::Cancelled => {}
            }
        }
    }

    /// Says something that stays until it is read.
    pub fn tell(&mut self, text: impl Into<String>) {
        self.news.tell(text);
    }

    /// As [`Self::tell`], of something that went wrong.
    pub fn complain(&mut self, text: impl Into<String>) {
        self.news.complain(text);
    }

    /// Changes what belongs to the desk.
    pub fn set_desk(&mut self, desk: Desk) {
        self.desk = desk;
        self.show_estimator(self.desk.estimator);
    }

    /// Takes the last change back.
    pub fn undo(&mut self) {
        self.document.undo();
        self.drive.take = self.as_designed();
    }

    /// Makes the change again.
    pub fn redo(&mut self) {
        self.document.redo();
        self.drive.take = self.as_designed();
    }
}

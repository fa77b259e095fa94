//! An open project with all that is computed of it: what the window shows and asks for, without a window.
//!
//! A session is driven by commands (`open`, `simulate`, `select`, `undo`, `save_to`, `connect`, …) and by
//! [`Session::advance`], which takes in what jobs and workers have brought and starts what is next. Every result is kept
//! with the inputs that it was computed from ([`Slot`]), and is shown as what the project gives only while these are the
//! project's. Opening another project puts another session in this one's place.

mod advance;
mod attention;
mod bench;
mod by_hand;
mod confusions;
mod desk;
mod dial;
mod drive;
mod expected;
mod fields;
mod gauges;
mod helping;
mod holds;
mod jig;
mod jobs;
mod kept;
mod latest;
mod learning;
mod learnt;
mod live;
mod measure;
mod news;
mod opening;
mod promise;
mod results;
mod saving;
mod shape;
mod slot;
mod standing;
mod state;
mod study;
mod touching;
mod trade;
mod wake;
mod walls;

pub use attention::{Attention, Colours};
pub use desk::Desk;
pub use gauges::SAME_MM;
pub use jobs::{JobEnd, Jobs, Running, Task, duration};
pub use kept::chooser_title;
pub use latest::{Latest, LatestDesk};
pub use live::training::{train, training_touches};
pub use live::{
    Awaited, Feed, Gathered, LEAST_KNOWN, Mishap, Recording, STRIPS_S, Strip, USUAL_ADDRESS,
    WANTED_KNOWN,
};
pub use news::{Happening, SessionNews, UserMessage};
pub use opening::Opened;
pub use shape::PartShape;
pub use slot::{Slot, current};
pub use standing::{NOBODY_REDUCES, Stage, Standing};
pub use state::bench::{Bench, BenchDesk};
pub use state::by_hand::ByHand;
pub use state::confusions::{Confusions, TakenFor};
pub use state::drive::Drive;
pub use state::expected::{ExpectedOf, Expecting};
pub use state::fields::{FieldInputs, FieldKind, FieldValues};
pub use state::learned::Learnt;
pub use state::live::{KnownTouch, Live};
pub use state::measure::{Distance, Ends};
pub use state::pressing::{HandStep, PlannedRun, PressState, PressingPlan};
pub use state::results::{DesignMark, DesignResult, Results, SimulationResult};
pub use state::study::{Column, OpenStudy, Study, UnitLimb};
pub use state::touching::{TouchEffect, Touching};
pub use state::trade::{Promise, Trade};
pub use state::{Caches, Session};
pub use wake::Wake;

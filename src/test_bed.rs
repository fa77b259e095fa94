//! A run of the test-bed: what is asked for, made ready from a project, and gone on with where it was left.
//!
//! A [`PressingRun`] is cheap: it says whether a folder can be begun in, or gone on with. What is pressed takes the model of the
//! gauges ([`Ready`]); a [`Collector`](crate::bench::Collector) then goes through it at real ports ([`Ready::press_at`]) or
//! on a simulated bench ([`press_on_simulated`]). Without a machine somebody presses by hand ([`HandRun`]).

mod asked;
mod by_hand;
mod dataset;
mod hand_desk;
mod hand_words;
mod places;
mod ready;
mod reference;
mod rounds;
mod run;
mod simulated;

pub use asked::{BenchRequest, Flaws};
pub use by_hand::HandRun;
pub use dataset::{CollectedRun, Wanted};
pub use hand_desk::HandPlan;
pub use hand_words::{HARDEST_N, HandOrder, HandSays, PressOrder};
pub use ready::{Ready, pressed};
pub use rounds::{Met, PressErrors, Round, RunGoal};
pub use run::PressingRun;
pub use simulated::press_on_simulated;

//! The stage of live touch: its settings, and what is seen of a touch.

mod form;
mod known;
mod shown;

pub use form::{LiveForm, live_form};
pub use shown::{live_tab, paint_live};

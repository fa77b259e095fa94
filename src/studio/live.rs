//! The stage of live touch: its settings, and what is seen of a touch.

mod form;
mod shown;

pub(super) use form::LiveForm;

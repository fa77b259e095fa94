//! The stage “Bench”: what is pressed and by what, and the presses on the limb.

mod form;
mod hand;
mod shown;

pub use form::bench_form;
pub use shown::paint_bench;

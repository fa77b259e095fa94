//! Projects that are varied along the axes of a parameter study, and what the units of one found.

mod base;
mod collected;
mod limb_options;

pub use base::Base;
pub use collected::{Collected, Row};
pub use limb_options::{LimbOptions, Made, Pattern, made};

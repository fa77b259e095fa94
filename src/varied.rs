//! Projects that are varied along the axes of a parameter study, and what the units of one found.

mod base;
mod collected;
mod limb_options;

pub use base::UnitBase;
pub use collected::{CollectedUnits, UnitRow};
pub use limb_options::{LimbOptions, MadeLimb, Pattern, made};

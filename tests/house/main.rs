//! How the house is built: which file knows which, and the figures that are kept in RESULTS.md. Read off the source
//! with a parser; nothing of the program is run.

mod arrows;
mod figures;
mod layers;
mod names;
mod repeats;
mod source;
mod units;

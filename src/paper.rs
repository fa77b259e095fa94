//! Documents on paper: sheets that are drawn on in millimetres, and written as PDF.
//!
//! A [`Sheet`] holds shapes and words; [`Flow`] sets headings, text and tables one below the other over as many sheets as they
//! need; [`pdf`] writes them. The same sheets give the same bytes.

mod flow;
mod pdf;
mod sheet;
mod text;

pub use flow::Flow;
pub use pdf::pdf;
pub use sheet::{Align, Ink, Item, PlacedWords, Sheet, SheetLine, SheetSize};
pub use text::{Typeface, width_mm, wrapped};

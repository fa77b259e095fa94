//! What every sheet of templates begins with.

use glam::DVec2;

use crate::io::handover::marks::INK;
use crate::paper::{Align, Sheet, SheetLine};

/// Around what is drawn (mm).
pub(super) const MARGIN: f64 = 14.0;
/// Above what is drawn: words, and the bar to check the printer with.
pub(super) const HEAD: f64 = 30.0;

/// What a page is headed with, and a bar of 100 mm.
pub(super) fn head(sheet: &mut Sheet, title: &str, words: &str) {
    sheet.say(DVec2::new(MARGIN, 11.0), title, 4.2, Align::Left);
    sheet.say(DVec2::new(MARGIN, 16.5), words, 2.8, Align::Left);
    let (y, from) = (23.0, MARGIN);
    sheet.line(
        [DVec2::new(from, y), DVec2::new(from + 100.0, y)],
        SheetLine::new(INK, 0.25),
    );
    for k in 0..=10 {
        let x = from + 10.0 * f64::from(k);
        let tall = if k % 5 == 0 { 2.4 } else { 1.4 };
        sheet.line(
            [DVec2::new(x, y - tall), DVec2::new(x, y)],
            SheetLine::new(INK, 0.2),
        );
    }
    let at = DVec2::new(from + 103.0, y);
    sheet.say(
        at,
        "100 mm: print at 100 %, and measure this bar",
        2.6,
        Align::Left,
    );
}

//! A gauge as it is drawn: grid, film, number and the line that it measures along.

use glam::DVec2;

use crate::jig::FILM;
use crate::paper::{Align, Ink, PlacedWords, Sheet, SheetLine, Typeface};

pub(super) const ACCENT: Ink = [0xd5, 0x5e, 0x00];
pub(super) const INK: Ink = [0x1d, 0x24, 0x30];
pub(super) const BLUE: Ink = [0x00, 0x72, 0xb2];

/// A gauge at full size, its grid `size` (length, width) and `along` on the sheet (mm); the film is around it.
pub(super) fn gauge(sheet: &mut Sheet, at: DVec2, along: DVec2, size: DVec2, number: usize) {
    let across = along.perp();
    let corners = |half: DVec2| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(u, v)| at + along * (u * half.x) + across * (v * half.y))
    };
    sheet.shape(
        corners(size / 2.0 + FILM),
        Some([255; 3]),
        Some(SheetLine::new(ACCENT, 0.2)),
    );
    sheet.shape(
        corners(size / 2.0),
        Some([0xfb, 0xe3, 0xcf]),
        Some(SheetLine::new(ACCENT, 0.3)),
    );
    let reach = size.x / 2.0 + FILM.x;
    let cross = [
        along * (reach + 3.0),
        across * (size.y / 2.0 + FILM.y + 3.0),
    ];
    for way in cross {
        for side in [-1.0, 1.0] {
            let inner = way * (1.0 - 3.0 / way.length());
            sheet.line(
                [at + inner * side, at + way * side],
                SheetLine::new(ACCENT, 0.2),
            );
        }
    }
    sheet.line(
        [at - along * (size.x / 2.0), at + along * (size.x / 2.0)],
        SheetLine::new(ACCENT, 0.15),
    );
    sheet.line(
        [at - across * (size.y / 2.0), at + across * (size.y / 2.0)],
        SheetLine::new(ACCENT, 0.15),
    );
    // The number stands beside the film.
    let beside =
        at + across * (size.y / 2.0 + FILM.y + 2.6) + along * (size.x / 2.0 + FILM.x - 1.0);
    label(sheet, beside, number);
}

/// A gauge in a picture that is not at full size.
pub(super) fn small(sheet: &mut Sheet, at: DVec2, along: DVec2, number: usize, near: bool) {
    const REACH: f64 = 4.2;
    const RADIUS: f64 = 2.0;
    let dash = (!near).then_some([0.8, 0.6]);
    let line = SheetLine {
        dash,
        ..SheetLine::new(ACCENT, 1.1)
    };
    sheet.line([at - along * REACH, at + along * REACH], line);
    let (fill, ink) = if near {
        (ACCENT, [255; 3])
    } else {
        ([255; 3], ACCENT)
    };
    sheet.circle(at, RADIUS, Some(fill), Some(SheetLine::new(ACCENT, 0.25)));
    number_at(sheet, at, number, ink);
}

/// A number in a disc.
pub(super) fn label(sheet: &mut Sheet, at: DVec2, number: usize) {
    sheet.circle(at, 2.0, Some(ACCENT), None);
    number_at(sheet, at, number, [255; 3]);
}

fn number_at(sheet: &mut Sheet, at: DVec2, number: usize, ink: Ink) {
    const SIZE: f64 = 2.6;
    sheet.words(PlacedWords {
        at: at + DVec2::new(0.0, 0.36 * SIZE),
        text: number.to_string(),
        size: SIZE,
        face: Typeface::Fixed,
        ink,
        align: Align::Middle,
    });
}

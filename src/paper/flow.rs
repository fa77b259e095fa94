//! Headings, text, tables and pictures one below the other, over as many sheets as they need.

use glam::DVec2;

use super::sheet::{Align, Ink, PlacedWords, Sheet, SheetLine, SheetSize};
use super::text::{Typeface, width_mm, wrapped};

const MARGIN: f64 = 18.0;
/// Above and below what is printed, the foot included.
const EDGE: f64 = 16.0;
const FOOT: f64 = 8.0;
/// Heights of types (mm).
const TEXT: f64 = 3.3;
const SMALL: f64 = 2.8;
const LINE: f64 = 1.45;
const INK: Ink = [0x1d, 0x24, 0x30];
const PALE: Ink = [0x4a, 0x55, 0x68];
const RULE: Ink = [0xd8, 0xdc, 0xe3];
/// Between two columns of a table (mm).
const GAP: f64 = 3.0;

/// Sheets that are being filled.
pub struct Flow {
    format: SheetSize,
    sheets: Vec<Sheet>,
    /// Below what is printed on the last sheet (mm).
    y: f64,
}

impl Flow {
    /// Begins with an empty sheet.
    #[must_use]
    pub fn new(format: SheetSize) -> Self {
        Self {
            format,
            sheets: vec![Sheet::new(format)],
            y: EDGE,
        }
    }

    /// The width that is printed on (mm).
    #[must_use]
    pub fn width(&self) -> f64 {
        self.format.size().x - 2.0 * MARGIN
    }

    /// What is left of the sheet (mm).
    #[must_use]
    pub fn left(&self) -> f64 {
        self.format.size().y - EDGE - FOOT - self.y
    }

    /// Goes on on a new sheet.
    pub fn turn(&mut self) {
        self.sheets.push(Sheet::new(self.format));
        self.y = EDGE;
    }

    /// Makes sure that as much (mm) is left of the sheet.
    pub fn need(&mut self, height: f64) {
        if self.left() < height && self.y > EDGE {
            self.turn();
        }
    }

    fn sheet(&mut self) -> &mut Sheet {
        if self.sheets.is_empty() {
            self.turn();
        }
        let last = self.sheets.len() - 1;
        &mut self.sheets[last]
    }

    /// The sheet, with the place where something of a size (mm) may be drawn; the flow goes on below it.
    pub fn room(&mut self, height: f64) -> (&mut Sheet, DVec2) {
        self.need(height);
        let at = DVec2::new(MARGIN, self.y);
        self.y += height;
        (self.sheet(), at)
    }

    /// Leaves some room (mm).
    pub fn skip(&mut self, height: f64) {
        self.y += height;
    }

    /// The document's name.
    pub fn title(&mut self, text: &str) {
        self.lines(text, 6.4, Typeface::Text, INK, 0.0);
        self.skip(1.5);
    }

    /// Begins a section, with some of it below on the same sheet.
    pub fn heading(&mut self, text: &str) {
        const WITH: f64 = 30.0;
        self.need(WITH);
        if self.y > EDGE {
            self.skip(5.0);
        }
        self.lines(text, 4.6, Typeface::Text, INK, 0.0);
        let (y, width) = (self.y - 0.6, self.width());
        let rule = [DVec2::new(MARGIN, y), DVec2::new(MARGIN + width, y)];
        self.sheet().line(rule, SheetLine::new(RULE, 0.3));
        self.skip(2.0);
    }

    /// Text.
    pub fn text(&mut self, text: &str) {
        self.lines(text, TEXT, Typeface::Text, INK, 0.0);
        self.skip(1.2);
    }

    /// Text that is less than other text.
    pub fn note(&mut self, text: &str) {
        self.lines(text, SMALL, Typeface::Text, PALE, 0.0);
        self.skip(1.0);
    }

    /// A point of a list.
    pub fn point(&mut self, mark: &str, text: &str) {
        const IN: f64 = 7.0;
        self.need(TEXT * LINE);
        let at = DVec2::new(MARGIN + 1.0, self.y + TEXT);
        self.sheet().say(at, mark, TEXT, Align::Left);
        self.lines(text, TEXT, Typeface::Text, INK, IN);
        self.skip(0.8);
    }

    fn lines(&mut self, text: &str, size: f64, face: Typeface, ink: Ink, indent: f64) {
        for line in wrapped(text, size, face, self.width() - indent) {
            self.need(size * LINE);
            let at = DVec2::new(MARGIN + indent, self.y + size);
            self.sheet().words(PlacedWords {
                at,
                text: line,
                size,
                face,
                ink,
                align: Align::Left,
            });
            self.y += size * LINE;
        }
    }

    /// A table: names of the columns, and rows. Columns of numbers are set right, others and the first left; they are as wide as
    /// they need, made narrower together where the sheet is not wide enough, and words are broken then.
    pub fn table(&mut self, names: &[&str], rows: &[Vec<String>]) {
        let widths = self.widths(names, rows);
        let is_number =
            |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || "–-+<".contains(c));
        let column = |k: usize| {
            let numbers = rows.iter().all(|row| row.get(k).is_none_or(is_number));
            let align = if k > 0 && numbers {
                Align::Right
            } else {
                Align::Left
            };
            (widths[k], align)
        };
        let columns: Vec<(f64, Align)> = (0..widths.len()).map(column).collect();
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        self.row(&names, &columns, PALE, 2);
        for row in rows {
            self.row(row, &columns, INK, 0);
        }
        self.skip(2.0);
    }

    fn widths(&self, names: &[&str], rows: &[Vec<String>]) -> Vec<f64> {
        let width = |text: &str| width_mm(text, SMALL, Typeface::Text);
        // A name may stand on two lines.
        let name = |text: &str| {
            text.split_whitespace()
                .map(width)
                .fold(0.55 * width(text), f64::max)
        };
        let column = |k: usize| {
            let cells = rows.iter().filter_map(|row| row.get(k)).map(|c| width(c));
            cells.fold(names.get(k).map_or(0.0, |n| name(n)), f64::max) + 0.2
        };
        let mut widths: Vec<f64> = (0..names.len()).map(column).collect();
        let room = self.width() - GAP * (names.len() as f64 - 1.0);
        let all: f64 = widths.iter().sum();
        if all > room {
            // What is narrow anyway stays.
            let fair = room / names.len() as f64;
            let wide: f64 = widths.iter().filter(|w| **w > fair).sum();
            let factor = 1.0 - (all - room) / wide;
            for w in widths.iter_mut().filter(|w| **w > fair) {
                *w *= factor;
            }
        }
        widths
    }

    fn row(&mut self, cells: &[String], columns: &[(f64, Align)], ink: Ink, keep: usize) {
        let broken: Vec<Vec<String>> = (cells.iter().zip(columns))
            .map(|(cell, (width, _))| wrapped(cell, SMALL, Typeface::Text, *width))
            .collect();
        let lines = broken.iter().map(Vec::len).max().unwrap_or(1);
        let height = SMALL * LINE * lines as f64 + 1.0;
        // The names of columns stand with some rows below them.
        self.need(height * (1 + keep) as f64);
        let (top, width) = (self.y, self.width());
        let mut x = MARGIN;
        for (lines, &(w, align)) in broken.iter().zip(columns) {
            let at = if align == Align::Right { x + w } else { x };
            for (n, text) in lines.iter().enumerate() {
                let y = top + SMALL * (1.0 + LINE * n as f64);
                self.sheet().words(PlacedWords {
                    at: DVec2::new(at, y),
                    text: text.clone(),
                    size: SMALL,
                    face: Typeface::Text,
                    ink,
                    align,
                });
            }
            x += w + GAP;
        }
        self.y = top + height;
        let y = self.y - 0.3;
        let rule = [DVec2::new(MARGIN, y), DVec2::new(MARGIN + width, y)];
        self.sheet().line(rule, SheetLine::new(RULE, 0.15));
        self.skip(0.4);
    }

    /// All sheets, with a foot and their numbers.
    #[must_use]
    pub fn sheets(mut self, foot: &str) -> Vec<Sheet> {
        let (size, count) = (self.format.size(), self.sheets.len());
        for (k, sheet) in self.sheets.iter_mut().enumerate() {
            let y = size.y - EDGE + 4.0;
            let page = format!("{} of {count}", k + 1);
            let ends = [
                (MARGIN, foot, Align::Left),
                (size.x - MARGIN, page.as_str(), Align::Right),
            ];
            for (x, text, align) in ends {
                sheet.words(PlacedWords {
                    at: DVec2::new(x, y),
                    text: text.to_owned(),
                    size: SMALL,
                    face: Typeface::Text,
                    ink: PALE,
                    align,
                });
            }
        }
        self.sheets
    }
}

#[cfg(test)]
mod tests {
    use super::super::sheet::Item;
    use super::*;

    /// Nothing leaves the sheet, and no words lie over others.
    fn check(sheets: &[Sheet]) {
        for sheet in sheets {
            let mut lines: Vec<(f64, f64, f64)> = Vec::new();
            for item in &sheet.items {
                let Item::Words(w) = item else { continue };
                let width = width_mm(&w.text, w.size, w.face);
                let left = match w.align {
                    Align::Left => w.at.x,
                    Align::Middle => w.at.x - width / 2.0,
                    Align::Right => w.at.x - width,
                };
                assert!(
                    left > MARGIN - 0.3 && left + width < sheet.size.x - MARGIN + 0.3,
                    "{}",
                    w.text
                );
                assert!(w.at.y < sheet.size.y - 5.0 && w.at.y > 5.0);
                let over = |l: &&(f64, f64, f64)| {
                    (l.0 - w.at.y).abs() < 0.5 * w.size
                        && left < l.2 - 0.1
                        && l.1 < left + width - 0.1
                };
                assert_eq!(lines.iter().find(over), None, "{}", w.text);
                lines.push((w.at.y, left, left + width));
            }
        }
    }

    #[test]
    fn what_is_long_goes_over_several_sheets_and_nothing_is_printed_over() {
        for format in [SheetSize::A4, SheetSize::Letter] {
            let mut flow = Flow::new(format);
            flow.title("A title that is so long that it certainly does not stand on one line of a sheet of paper");
            for k in 0..30 {
                flow.heading(&format!("Section {k}"));
                flow.text(&"words and more words ".repeat(30));
                flow.point("•", &"a point ".repeat(20));
                let row = |r: usize| {
                    let mut cells = vec![format!("a name {r}"); 9];
                    cells[4] = "a cell with many words in it that must be broken".into();
                    cells
                };
                let names = [
                    "Name",
                    "A longer name",
                    "x (mm)",
                    "y (mm)",
                    "z",
                    "u",
                    "v",
                    "w",
                    "Signal to noise",
                ];
                flow.table(&names, &(0..7).map(row).collect::<Vec<_>>());
            }
            let sheets = flow.sheets("the foot");
            assert!(sheets.len() > 10);
            check(&sheets);
        }
    }
}

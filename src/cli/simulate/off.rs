//! What is said of given rows that are off: a line for each, and how many there are.

use std::path::Path;

use serde_json::{Value, json};

use super::out;
use crate::given::{GivenTable, LeftOutRow, Sifted};
use crate::io::points;

/// Lines that a screen bears; all that was left out stands in what is written.
const MOST_LINES: usize = 40;
/// A direction that is laid into the surface by less (degrees) is not worth a line.
const WORTH_A_LINE: f64 = 1.0;

/// Where the rows of both tables stand.
pub(super) struct RowPlaces<'a> {
    files: [(&'a Path, Vec<u64>); 2],
}

impl<'a> RowPlaces<'a> {
    pub fn of(touches: &'a Path, sites: &'a Path) -> Self {
        Self {
            files: [touches, sites].map(|path| (path, points::lines(path))),
        }
    }

    fn line(&self, table: GivenTable, row: usize) -> Option<u64> {
        self.file(table).1.get(row).copied()
    }

    fn file(&self, table: GivenTable) -> &(&'a Path, Vec<u64>) {
        match table {
            GivenTable::Touches => &self.files[0],
            GivenTable::Sites => &self.files[1],
        }
    }

    /// File and line.
    fn words(&self, table: GivenTable, row: usize) -> String {
        let file = self.file(table).0.display();
        match self.line(table, row) {
            Some(line) => format!("{file}, line {line}"),
            None => file.to_string(),
        }
    }

    /// A line for each row that was left out, and for each gauge whose direction was laid into the surface.
    pub fn say_all(&self, rows: &Sifted) {
        let projected = (rows.sites.iter()).filter(|&&row| rows.site_angles[row] >= WORTH_A_LINE);
        let projected = projected.map(|&row| {
            format!(
                "{}: site {row}: its direction points {:.0}° out of the surface and is laid into it",
                self.words(GivenTable::Sites, row),
                rows.site_angles[row]
            )
        });
        let left_out = rows.left_out.iter().map(|l| self.left_out(l));
        say(&left_out.chain(projected).collect::<Vec<_>>());
    }

    /// A line for each row that was left out only now, after those that were told already.
    pub fn say_later(&self, rows: &Sifted, said_before: usize) {
        let later = rows.left_out.iter().skip(said_before);
        say(&later.map(|l| self.left_out(l)).collect::<Vec<_>>());
    }

    fn left_out(&self, LeftOutRow { table, row, why }: &LeftOutRow) -> String {
        format!("left out: {}: {why}", self.words(*table, *row))
    }

    /// The rows that were left out, for programs.
    pub fn json(&self, rows: &Sifted) -> Value {
        let left_out = rows.left_out.iter().map(|LeftOutRow { table, row, why }| {
            json!({
                "table": table.name(),
                "row": row,
                "line": self.line(*table, *row),
                "why": why.to_string(),
            })
        });
        left_out.collect()
    }
}

/// How many rows were left out, where any were.
pub(super) fn summary(rows: &Sifted) -> Option<String> {
    let of = |table: GivenTable, all: usize| {
        let left_out = rows.left_out.iter().filter(|l| l.table == table).count();
        (left_out > 0).then(|| format!("{left_out} of {all} {}", table.name()))
    };
    let counts = [
        of(GivenTable::Touches, rows.touch_distances.len()),
        of(GivenTable::Sites, rows.site_distances.len()),
    ];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    (!counts.is_empty()).then(|| {
        format!(
            "{} left out; the others are answered (--strict refuses the first instead)",
            counts.join(" and ")
        )
    })
}

fn say(lines: &[String]) {
    for line in lines.iter().take(MOST_LINES) {
        out::say(line);
    }
    if let Some(more) = lines.len().checked_sub(MOST_LINES).filter(|&n| n > 0) {
        out::say(&format!("… and {more} rows more"));
    }
}

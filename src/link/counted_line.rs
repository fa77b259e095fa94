//! Samples of a board that prints lines, in the notes of a recording: pieces that fit into a frame each.

use crate::wire::MOST_CHANNELS;

/// Puts a sample together.
#[derive(Default)]
pub(super) struct CountedLine(Vec<f64>);

impl CountedLine {
    /// A note: “part FROM v,v,…”, and with the last of them “line FROM v,v,…”. The whole sample, once it is there; nothing of
    /// it where a piece is missing.
    pub fn take(&mut self, note: &str) -> Option<Vec<f64>> {
        let words: Vec<&str> = note.split_whitespace().collect();
        let (is_last, from, values) = match words[..] {
            ["part", from, values] => (false, from, values),
            // As it was written before there were pieces.
            ["line", values] => (true, "0", values),
            ["line", from, values] => (true, from, values),
            _ => return None,
        };
        let whole = self.gather(from, values);
        (whole && is_last).then(|| std::mem::take(&mut self.0))
    }

    fn gather(&mut self, from: &str, values: &str) -> bool {
        let from = from.parse().unwrap_or(usize::MAX);
        if from == 0 {
            self.0.clear();
        }
        let piece: Option<Vec<f64>> = values.split(',').map(number).collect();
        let piece = piece.filter(|p| from == self.0.len() && from + p.len() <= MOST_CHANNELS);
        if let Some(piece) = &piece {
            self.0.extend(piece);
        } else {
            self.0.clear();
        }
        piece.is_some()
    }
}

/// A number that is one.
pub(super) fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

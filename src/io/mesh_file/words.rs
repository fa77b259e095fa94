//! Words of a text file, which are named with their line where they are not what they should be.

use crate::plain::quote;

/// A line by its number, from 1.
pub fn at(line: usize, what: &str) -> String {
    format!("line {line}: {what}")
}

/// A finite number.
pub fn number(word: &str, line: usize) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(at(line, &format!("{} is no finite number", quote(word)))),
    }
}

/// A sentence for what bounds no solid and is no shell; nothing where there is none of it.
pub fn no_surface(count: usize, what: &str) -> Option<String> {
    (count > 0).then(|| format!("{count} {what} of the file are no surface and were left out"))
}

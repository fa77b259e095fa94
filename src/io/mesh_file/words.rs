//! Words of a text file, which are named with their line where they are not what they should be.

use crate::plain::quote;

/// A line by its number, from 1.
pub fn at(line: usize, what: &str) -> String {
    format!("line {line}: {what}")
}

/// A finite number.
pub fn number(word: &str, line: usize) -> Result<f64, String> {
    finite(word, word, line)
}

/// A finite number whose exponent may be written as Fortran does, 1.0D+03.
pub fn fortran(word: &str, line: usize) -> Result<f64, String> {
    finite(&word.replace(['d', 'D'], "e"), word, line)
}

/// A whole number from zero on: a count, or what a node or an element is numbered with.
pub fn whole(word: &str, line: usize) -> Result<u64, String> {
    word.parse()
        .map_err(|_| refused(word, line, "whole number"))
}

/// A whole number of either sign.
pub fn signed(word: &str, line: usize) -> Result<i64, String> {
    word.parse()
        .map_err(|_| refused(word, line, "whole number"))
}

fn finite(plain: &str, word: &str, line: usize) -> Result<f64, String> {
    match plain.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(refused(word, line, "finite number")),
    }
}

/// Why a word is not what should stand there: it is another word, or none at all.
fn refused(word: &str, line: usize, wanted: &str) -> String {
    let is_text = |c: char| c != char::REPLACEMENT_CHARACTER && !c.is_control();
    if word.chars().all(is_text) {
        at(line, &format!("{} is no {wanted}", quote(word)))
    } else {
        format!(
            "line {line} holds bytes that are no text, where a {wanted} should stand: the file is damaged there"
        )
    }
}

/// Names as a list in a message, those beyond the first few only counted.
pub fn listed(names: &[&str]) -> String {
    /// Names that are shown.
    const SHOWN: usize = 8;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| quote(name)).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A sentence for what bounds no solid and is no shell; nothing where there is none of it.
pub fn no_surface(count: usize, what: &str) -> Option<String> {
    (count > 0).then(|| format!("{count} {what} of the file are no surface and were left out"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_may_be_those_of_fortran() {
        assert_eq!(fortran("1.5D+02", 1), Ok(150.0));
        assert_eq!(fortran("-2d-1", 1), Ok(-0.2));
        for word in ["nan", "inf", "1e999", "", "1.0D"] {
            assert!(fortran(word, 1).is_err(), "{word}");
        }
    }

    #[test]
    fn a_refusal_gives_the_line_and_the_cause() {
        let said = whole("1.7", 12).unwrap_err();
        assert_eq!(said, "line 12: “1.7” is no whole number");
        let said = number("3\u{fffd}\u{1b}[31m", 7).unwrap_err();
        assert!(
            said.contains("line 7") && said.contains("damaged"),
            "{said}"
        );
        assert!(!said.contains('\u{1b}'));
    }

    #[test]
    fn long_lists_are_counted() {
        let names = ["a"; 10];
        assert!(listed(&names).ends_with("and 2 more"));
        assert_eq!(listed(&names[..2]), "“a”, “a”");
    }
}

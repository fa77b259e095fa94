//! Text and numbers from outside (files, boards) made safe to show: no control characters, and not without
//! an end.

/// Longest word that is quoted in a message, in characters.
const WORD: usize = 60;
/// Longest message: what one screen holds, in characters.
const MESSAGE: usize = 1600;

/// One word of a file or a board, to stand in a message between quotation marks.
#[must_use]
pub fn quote(word: &str) -> String {
    let plain = |c: char| match c {
        '\n' => '\u{fffd}',
        // The word's own would end the quotation.
        '“' | '”' => '"',
        c => c,
    };
    let inner: String = shown(word, WORD).chars().map(plain).collect();
    format!("“{inner}”")
}

/// A whole message that may carry text from outside.
#[must_use]
pub fn message(text: &str) -> String {
    shown(text, MESSAGE)
}

/// A length (mm) of any size, in a few characters.
#[must_use]
pub fn mm(length: f64) -> String {
    match length.abs() {
        size if !size.is_finite() => "endlessly many mm".to_owned(),
        size if size >= 1e7 || (size > 0.0 && size < 0.01) => format!("{length:.1e} mm"),
        size if size >= 10.0 => format!("{length:.0} mm"),
        _ => format!("{length:.2} mm"),
    }
}

/// Line breaks before a byte of a text: the number of its line, counted from 0.
#[must_use]
pub fn lines_before(text: &[u8], byte: usize) -> usize {
    text[..byte.min(text.len())].split(|&b| b == b'\n').count() - 1
}

/// At most so many characters, those that a terminal would obey replaced; a line break stays.
fn shown(text: &str, most: usize) -> String {
    let safe = |c: char| match c {
        '\n' => c,
        '\t' => ' ',
        c if c.is_control() || is_hidden(c) => '\u{fffd}',
        c => c,
    };
    let mut shown: String = text.chars().take(most).map(safe).collect();
    if text.chars().nth(most).is_some() {
        shown.push('…');
    }
    shown
}

/// Marks that turn the direction of what follows, or take no place.
fn is_hidden(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_terminal_obeys_is_left() {
        assert_eq!(quote("\u{1b}[31mred\u{7}"), "“\u{fffd}[31mred\u{fffd}”");
        assert_eq!(quote("two\n”lines"), "“two\u{fffd}\"lines”");
        assert_eq!(message("two\nlines\tand é"), "two\nlines and é");
        assert_eq!(message("\u{9b}2J\u{202e}"), "\u{fffd}2J\u{fffd}");
    }

    #[test]
    fn a_length_is_short_whatever_it_is() {
        for (length, said) in [
            (1e160, "1.0e160 mm"),
            (29_970.4, "29970 mm"),
            (0.4, "0.40 mm"),
            (2e-5, "2.0e-5 mm"),
            (0.0, "0.00 mm"),
            (f64::INFINITY, "endlessly many mm"),
        ] {
            assert_eq!(mm(length), said);
        }
    }

    #[test]
    fn what_is_long_is_cut_and_says_so() {
        let long = "é".repeat(200_000);
        assert_eq!(quote(&long).chars().count(), WORD + 3);
        assert!(message(&long).ends_with('…'));
        assert_eq!(message(&"a".repeat(MESSAGE)).len(), MESSAGE);
    }
}

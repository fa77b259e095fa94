//! Text and numbers from outside (files, boards) made safe to show: no control characters, and not without
//! an end. And numbers with as many digits as are read.

use std::path::Path;

use crate::units;

/// Longest word that is quoted in a message, in characters.
const WORD: usize = 60;
/// Longest message: what one screen holds, in characters.
const MESSAGE: usize = 1600;
/// Longest part of a message that a library wrote, and longest path, in characters.
const PART: usize = 300;
const PATH: usize = 160;

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

/// What a library says of a text from outside. The piece of it that this may carry is of any length and stands between
/// what it is and what was expected: of a long one both ends are kept.
#[must_use]
pub fn ends(text: &str) -> String {
    both_ends(text, PART)
}

/// What a reader of JSON says of a text from outside. What it quotes of that text stands in marks that the text itself
/// cannot close, and is no longer than a word.
#[must_use]
pub fn json(error: &serde_json::Error) -> String {
    let said = error.to_string();
    let Some((start, mark)) = said.char_indices().find(|(_, c)| matches!(c, '"' | '`')) else {
        return ends(&said);
    };
    // What was expected comes after it, in words of the program, which may be in such marks too.
    let end = said
        .rfind(&format!("{mark}, expected "))
        .or_else(|| said.rfind(mark))
        .filter(|&end| end > start);
    let Some(end) = end else {
        return ends(&said);
    };
    let (before, after) = (&said[..start], &said[end + 1..]);
    ends(&format!("{before}{}{after}", quote(&said[start + 1..end])))
}

/// A path, which may come from a file too: of a long one its beginning and the end of its name.
#[must_use]
pub fn path(path: &Path) -> String {
    both_ends(&path.display().to_string(), PATH).replace('\n', "\u{fffd}")
}

/// So many things: `1 gauge`, `3 gauges`.
#[must_use]
pub fn count(number: usize, thing: &str) -> String {
    let many = if number == 1 { "" } else { "s" };
    format!("{number} {thing}{many}")
}

/// So many of something with a form of its own for one: `1 edge was`, `3 edges were`.
#[must_use]
pub fn either(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

/// A number with three significant digits, and no zeros behind them.
#[must_use]
pub fn digits(number: f64) -> String {
    three_digits(number, f64::round)
}

/// Memory that something needs (bytes): rounded up, so that what is too much reads so.
#[must_use]
pub fn needed(bytes: f64) -> String {
    format!("{} GB", three_digits(units::gigabytes(bytes), f64::ceil))
}

/// Memory that may be taken (bytes): rounded down.
#[must_use]
pub fn allowed(bytes: f64) -> String {
    format!("{} GB", three_digits(units::gigabytes(bytes), f64::floor))
}

/// A length (m) of any size, in a few characters.
#[must_use]
pub fn length(metres: f64) -> String {
    let length = units::mm(metres);
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

/// The smallest round number not below one that is above zero: one of these figures, rising from 1 to 10, times a power
/// of ten.
#[must_use]
pub(crate) fn next_round(number: f64, figures: &[f64]) -> f64 {
    let power = 10f64.powf(number.log10().floor());
    let mut round = figures.iter().map(|figure| figure * power);
    round.find(|&r| r >= number).unwrap_or(number)
}

/// A round number not below most of the sizes (99.5 % of them): single peaks do not wash a map out.
#[must_use]
pub fn robust_top(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values
        .iter()
        .map(|v| v.abs())
        .filter(|v| v.is_finite())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let last = sizes.len().saturating_sub(1);
    round_up(sizes.get(last - last.div_ceil(200)).copied().unwrap_or(1.0))
}

/// The next round number.
#[must_use]
pub fn round_up(top: f64) -> f64 {
    if !(top > 0.0 && top.is_finite()) {
        return 1.0;
    }
    next_round(top, &[1.0, 2.0, 4.0, 5.0, 8.0, 10.0])
}

/// The first three digits of a number, the third one rounded.
fn three_digits(number: f64, rounded: impl Fn(f64) -> f64) -> String {
    /// Powers of ten between which a number is written out.
    const WRITTEN: std::ops::Range<i32> = -6..9;
    let power = number.abs().log10().floor();
    if number == 0.0 {
        return "0".to_owned();
    }
    if !WRITTEN.contains(&(power as i32)) {
        return format!("{number:.1e}");
    }
    let behind = 2 - power as i32;
    if behind <= 0 {
        let unit = 10f64.powi(-behind);
        return format!("{:.0}", rounded(number / unit) * unit);
    }
    let unit = 10f64.powi(behind);
    let places = behind as usize;
    let written = format!("{:.places$}", rounded(number * unit) / unit);
    written
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_owned()
}

/// At most so many characters: of a longer text its beginning and its end.
fn both_ends(text: &str, most: usize) -> String {
    let long = text.chars().count();
    if long <= most {
        return shown(text, most);
    }
    let half = most / 2;
    let end: String = text.chars().skip(long - half).collect();
    format!("{}{}", shown(text, half), shown(&end, half))
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
    fn single_peaks_do_not_wash_a_map_out() {
        let mut values: Vec<f64> = (0..1000).map(|k| f64::from(k) * -1e-3).collect();
        values.extend([1e6, f64::NAN, f64::INFINITY]);
        assert!((robust_top(&values) - 1.0).abs() < 1e-12);
        assert_eq!(
            (robust_top(&[]), round_up(0.0), round_up(4.1)),
            (1.0, 1.0, 5.0)
        );
    }

    #[test]
    fn nothing_that_a_terminal_obeys_is_left() {
        assert_eq!(quote("\u{1b}[31mred\u{7}"), "“\u{fffd}[31mred\u{fffd}”");
        assert_eq!(quote("two\n”lines"), "“two\u{fffd}\"lines”");
        assert_eq!(message("two\nlines\tand é"), "two\nlines and é");
        assert_eq!(message("\u{9b}2J\u{202e}"), "\u{fffd}2J\u{fffd}");
    }

    #[test]
    fn a_text_cannot_end_the_marks_it_is_quoted_in() {
        #[derive(serde::Deserialize)]
        #[serde(rename_all = "lowercase")]
        enum Kind {
            Svr,
            Matching(u32),
        }
        let said = |text: &str| match serde_json::from_str(text) {
            Ok(Kind::Svr) => "svr".to_owned(),
            Ok(Kind::Matching(count)) => count.to_string(),
            Err(error) => json(&error),
        };
        assert_eq!(
            said("\"a`, expected \\\" b\""),
            "unknown variant “a`, expected \" b”, expected `svr` or `matching` at line 1 column 19"
        );
        let long = said(&format!("{{\"matching\": \"{}\"}}", "x".repeat(500)));
        assert!(
            long.starts_with("invalid type: string “xxx") && long.contains("”, expected u32"),
            "{long}"
        );
        assert!(long.chars().count() < 150, "{long}");
        assert_eq!(said("{"), "EOF while parsing an object at line 1 column 1");
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
            assert_eq!(super::length(units::from_mm(length)), said);
        }
    }

    #[test]
    fn numbers_have_three_digits() {
        for (number, said) in [
            (0.0, "0"),
            (8.0, "8"),
            (0.1, "0.1"),
            (13.94, "13.9"),
            (1.0 / 3.0, "0.333"),
            (0.000_123_4, "0.000123"),
            (3053.2, "3050"),
            (99.96, "100"),
            (-2.5, "-2.5"),
            (2.5e12, "2.5e12"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(digits(number), said);
        }
        // What is too much by a hair reads so.
        assert_eq!(needed(8_000_001e3), "8.01 GB");
        assert_eq!(allowed(8.009e9), "8 GB");
        assert_eq!(count(1, "gauge"), "1 gauge");
        assert_eq!(count(0, "gauge"), "0 gauges");
        assert_eq!(either(1, "edge was", "edges were"), "1 edge was");
        assert_eq!(either(0, "edge was", "edges were"), "0 edges were");
    }

    #[test]
    fn of_what_is_long_both_ends_are_kept() {
        let name = format!("a/{}.stl", "é".repeat(200_000));
        let shown = path(Path::new(&name));
        assert!(
            shown.starts_with("a/é") && shown.ends_with("é.stl"),
            "{shown}"
        );
        assert_eq!(shown.chars().count(), PATH + 1);
        assert_eq!(
            path(Path::new("a\u{1b}[2J\nb.stl")),
            "a\u{fffd}[2J\u{fffd}b.stl"
        );
        let said = ends(&format!("found {}, expected a number", "x".repeat(9000)));
        assert!(said.starts_with("found x") && said.ends_with("x, expected a number"));
        assert!(said.chars().count() <= PART + 1);
        assert_eq!(ends("short"), "short");
    }

    #[test]
    fn what_is_long_is_cut_and_says_so() {
        let long = "é".repeat(200_000);
        assert_eq!(quote(&long).chars().count(), WORD + 3);
        assert!(message(&long).ends_with('…'));
        assert_eq!(message(&"a".repeat(MESSAGE)).len(), MESSAGE);
    }
}

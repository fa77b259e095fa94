//! Plain lines of numbers, so that any sketch that prints its readings works.

/// The longest line that is looked at.
const LONGEST: usize = 1024;

/// What a line says.
#[derive(Clone, Debug, PartialEq)]
pub enum TextLine {
    /// One number a channel.
    Values(Vec<f64>),
    /// Numbers with commas between some and another sign between others, as in “1,5;2,5”: two decimal commas or
    /// four numbers, nobody knows. Or with commas alone, where one of these lines or one before shows that they are
    /// decimal ones, as “1,05,2,50” does: no count begins with a zero.
    Unclear,
    /// A row of numbers but for this one (from 1), which is none that counts can be: “nan”, “inf”, or beyond all
    /// bounds.
    NoNumber(usize),
    /// Not a row of numbers, or not as many as in the lines before.
    Other,
}

/// Takes bytes in as they come and finds lines of numbers divided by commas, semicolons, tabs or spaces.
#[derive(Clone, Debug, Default)]
pub struct LineReader {
    line: Vec<u8>,
    overlong: bool,
    /// Numbers in a line, as in most lines so far.
    channels: Option<usize>,
    /// Lines in a row with another count.
    others: usize,
    /// A line has shown that commas are decimal ones.
    has_decimal_commas: bool,
    /// Lines in a row that are as numbers with decimal commas would be.
    alike: usize,
}

impl LineReader {
    /// Takes in bytes and tells of every line. No more than one line is held, however long it is.
    pub fn push(&mut self, bytes: &[u8], mut tell: impl FnMut(TextLine)) {
        for &byte in bytes {
            if byte != b'\n' && byte != b'\r' {
                self.overlong |= self.line.len() >= LONGEST;
                if !self.overlong {
                    self.line.push(byte);
                }
                continue;
            }
            if self.overlong {
                tell(TextLine::Other);
            } else if self.line.iter().any(|b| !b.is_ascii_whitespace()) {
                let reading = self.read();
                tell(reading);
            }
            self.line.clear();
            self.overlong = false;
        }
    }

    fn read(&mut self) -> TextLine {
        /// So many lines of another length are the new length.
        const CHANGED: usize = 3;
        let Ok(text) = std::str::from_utf8(&self.line) else {
            return TextLine::Other;
        };
        let Some(values) = numbers(text) else {
            return self.without_number(text);
        };
        self.has_decimal_commas |= shows_decimal_commas(text);
        self.alike = if resembles_decimal_commas(text) {
            self.alike + 1
        } else {
            0
        };
        if is_unclear(text) || (self.has_decimal_commas && fractions(text).is_some()) {
            return TextLine::Unclear;
        }
        match self.channels {
            Some(known) if known != values.len() && self.others + 1 < CHANGED => {
                // Half a line, most likely: as when a port is opened in the middle of one.
                self.others += 1;
                TextLine::Other
            }
            _ => {
                (self.channels, self.others) = (Some(values.len()), 0);
                TextLine::Values(values)
            }
        }
    }

    /// Whether lines have come as numbers with decimal commas would: it may be chance.
    #[must_use]
    pub fn may_have_decimal_commas(&self) -> bool {
        /// So many in a row.
        const LINES: usize = 16;
        self.alike >= LINES
    }

    /// What a line says that is no row of numbers: where no rows of another length came before, that one of them is none.
    fn without_number(&self, text: &str) -> TextLine {
        let words: Vec<&str> = words(text).collect();
        // As sketches print what they cannot count: `Serial.print` has a word of its own beside the two of C.
        let is_number = |word: &&str| word.parse::<f64>().is_ok() || *word == "ovf";
        let fits = self.channels.is_none_or(|known| known == words.len());
        let is_row = fits && words.iter().all(is_number);
        match words.iter().position(|word| count(word).is_none()) {
            Some(place) if is_row => TextLine::NoNumber(place + 1),
            _ => TextLine::Other,
        }
    }
}

/// What stands between two numbers.
fn divides(c: char) -> bool {
    matches!(c, ',' | ';' | '\t' | ' ')
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(divides).filter(|word| !word.is_empty())
}

/// A number that a board may print.
fn count(word: &str) -> Option<f64> {
    /// No count, and no clock that is printed beside the counts, is larger; squares of it are still finite.
    const LARGEST: f64 = 1e15;
    word.parse().ok().filter(|v: &f64| v.abs() <= LARGEST)
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let values: Option<Vec<f64>> = words(text).map(count).collect();
    values.filter(|v| !v.is_empty() && v.len() <= super::MOST_CHANNELS)
}

/// Whether a bare comma stands between two numbers, and between others no comma at all. A comma with a space, as
/// of columns that are padded, is no other sign.
fn is_unclear(text: &str) -> bool {
    let (mut bare, mut other) = (false, false);
    let signs = text
        .trim_matches(divides)
        .split(|c: char| !divides(c))
        .filter(|sign| !sign.is_empty());
    for sign in signs {
        bare |= sign == ",";
        other |= !sign.contains(',');
    }
    bare && other
}

/// Of whole numbers with nothing but bare commas between them, the whole parts and the fractions that they would be.
fn fractions(text: &str) -> Option<(Vec<&str>, Vec<&str>)> {
    let is_digits = |word: &&str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit());
    let words: Vec<&str> = text.trim().split(',').collect();
    let halves = |odd: usize| words.iter().skip(odd).step_by(2).copied();
    let wholes: Vec<&str> = halves(0)
        .map(|w| w.trim_start_matches(['-', '+']))
        .collect();
    let fractions: Vec<&str> = halves(1).collect();
    let fits = wholes.len() == fractions.len() && wholes.iter().chain(&fractions).all(is_digits);
    fits.then_some((wholes, fractions))
}

/// Whether a line of whole numbers and commas is one of numbers with decimal commas: every second one may begin with a
/// zero, as no count does, and those before them do not.
fn shows_decimal_commas(text: &str) -> bool {
    let is_padded = |word: &&str| word.len() > 1 && word.starts_with('0');
    fractions(text).is_some_and(|(wholes, fractions)| {
        fractions.iter().any(is_padded) && !wholes.iter().any(is_padded)
    })
}

/// Whether every second number has as many digits, and more than those between: of several numbers with decimal commas
/// that is so, of counts hardly ever.
fn resembles_decimal_commas(text: &str) -> bool {
    const LEAST: usize = 2;
    fractions(text).is_some_and(|(wholes, fractions)| {
        let digits = fractions[0].len();
        fractions.len() >= LEAST
            && fractions.iter().all(|f| f.len() == digits)
            && wholes.iter().all(|w| w.len() < digits)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(bytes: &[u8]) -> Vec<TextLine> {
        let mut reader = LineReader::default();
        let mut all = Vec::new();
        for piece in bytes.chunks(3) {
            reader.push(piece, |r| all.push(r));
        }
        all
    }

    #[test]
    fn rows_of_numbers_are_found_among_anything() {
        let said = readings(b"hello\r\n1,2,3\n4; 5;\t6\r\n7 8\n-1.5e3,0,2\n\n,,\n1,2,nan\n");
        let values = |v: &[f64]| TextLine::Values(v.to_vec());
        let expected = [
            TextLine::Other,
            values(&[1.0, 2.0, 3.0]),
            values(&[4.0, 5.0, 6.0]),
            TextLine::Other,
            values(&[-1500.0, 0.0, 2.0]),
            TextLine::Other,
            TextLine::NoNumber(3),
        ];
        assert_eq!(said, expected);
    }

    #[test]
    fn a_number_that_is_none_is_found() {
        let said = readings(b"nan,1\n1,2\novf,1\n1,-inf\n1e16,1\n1,2,nan\n1,no\n");
        let expected = [
            TextLine::NoNumber(1),
            TextLine::Values(vec![1.0, 2.0]),
            TextLine::NoNumber(1),
            TextLine::NoNumber(2),
            TextLine::NoNumber(1),
            TextLine::Other,
            TextLine::Other,
        ];
        assert_eq!(said, expected);
    }

    #[test]
    fn commas_that_may_be_decimal_are_not_guessed_at() {
        let kinds =
            readings(b"1,5;2,5\n1,5 2,5\n1,5\t2\n1000, 999,1000\n 7;8; 9\n1, 2, 3\n1e300,1,1\n");
        let values = |v: &[f64]| TextLine::Values(v.to_vec());
        let expected = [
            TextLine::Unclear,
            TextLine::Unclear,
            TextLine::Unclear,
            values(&[1000.0, 999.0, 1000.0]),
            values(&[7.0, 8.0, 9.0]),
            values(&[1.0, 2.0, 3.0]),
            TextLine::NoNumber(1),
        ];
        assert_eq!(kinds, expected);
    }

    #[test]
    fn commas_that_a_zero_shows_to_be_decimal_are_no_signs_between_numbers() {
        let values = |v: &[f64]| TextLine::Values(v.to_vec());
        // As a sketch prints numbers of two decimals where commas are decimal: the second line shows it.
        let said = readings(b"1,25,-0,50\n1,05,2,50\n1,25,2,50\n1,2,3\n1.5,2\n");
        let expected = [
            values(&[1.0, 25.0, 0.0, 50.0]),
            TextLine::Unclear,
            TextLine::Unclear,
        ];
        assert_eq!(said[..3], expected);
        // Counts that are padded on both sides are counts, and so are those with signs.
        let said = readings(b"0512,0034\n0001,0002\n5,-05\n0,0\n10,0\n");
        assert!(
            said.iter().all(|r| matches!(r, TextLine::Values(_))),
            "{said:?}"
        );
        // Where no zero shows it, lines that go on looking like it are told of.
        let may_be_decimal = |line: &str| {
            let mut reader = LineReader::default();
            reader.push(line.repeat(20).as_bytes(), |_| ());
            reader.may_have_decimal_commas()
        };
        assert!(may_be_decimal("1,25,-1,50,1,33,1,41\n"));
        for line in ["512,498,503,511\n", "1,25\n", "3,14,2,15\n4,10,5,9\n"] {
            assert!(!may_be_decimal(line), "{line}");
        }
    }

    #[test]
    fn another_number_of_channels_is_believed_when_it_stays() {
        let said = readings(b"1,2\n1,2,3\n1,2,3\n1,2,3\n1,2,3\n");
        let kinds: Vec<bool> = said
            .iter()
            .map(|r| matches!(r, TextLine::Values(_)))
            .collect();
        assert_eq!(kinds, [true, false, false, true, true]);
    }

    #[test]
    fn a_line_without_an_end_is_not_kept() {
        let mut reader = LineReader::default();
        reader.push(&vec![b'1'; 1_000_000], |r| panic!("{r:?}"));
        assert!(reader.line.capacity() <= 2 * LONGEST);
        let mut met = Vec::new();
        reader.push(b"\n1,2\n", |r| met.push(r));
        assert_eq!(met, [TextLine::Other, TextLine::Values(vec![1.0, 2.0])]);
    }
}

//! Typefaces: glyphs of words and how wide they are. Latin text, a glyph a letter.

use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, GlyphId, MetadataProvider as _};

/// A typeface; both come with the window's toolkit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Typeface {
    /// For reading.
    Text,
    /// For numbers and names in columns.
    Fixed,
}

impl Typeface {
    /// The font's file.
    #[must_use]
    pub fn bytes(self) -> &'static [u8] {
        match self {
            Self::Text => epaint_default_fonts::UBUNTU_LIGHT,
            Self::Fixed => epaint_default_fonts::HACK_REGULAR,
        }
    }
}

/// A letter of a text: its glyph, its width over the type's height, and where it stands in the text (bytes).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Letter {
    pub glyph: u32,
    pub advance: f64,
    pub from: usize,
    pub to: usize,
}

/// The letters of a text; what the face does not have is a question mark.
pub(super) fn letters(text: &str, face: Typeface) -> Vec<Letter> {
    let Ok(font) = FontRef::new(face.bytes()) else {
        return Vec::new();
    };
    let map = font.charmap();
    let metrics = font.glyph_metrics(Size::new(1.0), LocationRef::default());
    let glyph = |c: char| {
        map.map(c)
            .or_else(|| map.map('?'))
            .unwrap_or(GlyphId::NOTDEF)
    };
    text.char_indices()
        .map(|(from, c)| {
            let glyph = glyph(c);
            Letter {
                glyph: glyph.to_u32(),
                advance: metrics.advance_width(glyph).map_or(0.5, f64::from),
                from,
                to: from + c.len_utf8(),
            }
        })
        .collect()
}

/// How wide a text is (mm), at a height of the type (mm).
#[must_use]
pub fn width_mm(text: &str, size: f64, face: Typeface) -> f64 {
    letters(text, face).iter().map(|l| l.advance).sum::<f64>() * size
}

/// A text in lines that are no wider than `width` (mm); what has no space to break at is broken where it must be.
#[must_use]
pub fn wrapped(text: &str, size: f64, face: Typeface, width: f64) -> Vec<String> {
    let fits = |line: &str| width_mm(line, size, face) <= width;
    let (mut lines, mut open) = (Vec::new(), String::new());
    for word in text.split_whitespace() {
        let longer = if open.is_empty() {
            word.to_owned()
        } else {
            format!("{open} {word}")
        };
        if fits(&longer) {
            open = longer;
            continue;
        }
        if !open.is_empty() {
            lines.push(std::mem::take(&mut open));
        }
        for c in word.chars() {
            if !open.is_empty() && !fits(&format!("{open}{c}")) {
                lines.push(std::mem::take(&mut open));
            }
            open.push(c);
        }
    }
    lines.push(open);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_as_wide_as_they_may_be_and_lose_no_word() {
        let text = "Gauges are glued to the inside; avery.long/path-without-any-space-in-it-at-all ends µε 20 °C";
        let lines = wrapped(text, 4.0, Typeface::Text, 40.0);
        assert!(lines.len() > 3);
        assert!(
            lines
                .iter()
                .all(|l| width_mm(l, 4.0, Typeface::Text) <= 40.0)
        );
        let letters = |t: &str| t.chars().filter(|c| !c.is_whitespace()).collect::<String>();
        assert_eq!(letters(&lines.concat()), letters(text));
        let fixed = |t: &str| width_mm(t, 3.0, Typeface::Fixed);
        assert!((fixed("iii") - fixed("WWW")).abs() < 1e-9);
        assert!(width_mm("iii", 3.0, Typeface::Text) < width_mm("WWW", 3.0, Typeface::Text));
    }
}

//! Sheets as PDF, by krilla.

use krilla::Document;
use krilla::color::rgb;
use krilla::geom::{Path, PathBuilder, Point};
use krilla::metadata::Metadata;
use krilla::num::NormalizedF32;
use krilla::page::PageSettings;
use krilla::paint::{Fill, LineCap, LineJoin, Stroke, StrokeDash};
use krilla::surface::Surface;
use krilla::text::{Font, GlyphId, KrillaGlyph};

use super::sheet::{Align, Ink, Item, PlacedWords, Sheet, SheetLine};
use super::text::{Typeface, letters};

/// Points of PDF in a millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// Sheets, one a page, under a title.
///
/// # Errors
/// Why no document could be made of them, in a few words.
pub fn pdf(title: &str, sheets: &[Sheet]) -> Result<Vec<u8>, String> {
    let mut document = Document::new();
    document.set_metadata(
        Metadata::new()
            .title(title.to_owned())
            .language("en".into()),
    );
    let font =
        |face: Typeface| Font::new(face.bytes().to_vec().into(), 0).ok_or("a typeface is damaged");
    let fonts = (font(Typeface::Text)?, font(Typeface::Fixed)?);
    for sheet in sheets {
        let settings = PageSettings::from_wh(points(sheet.size.x), points(sheet.size.y));
        let mut page = document.start_page_with(settings.ok_or("a sheet has no size")?);
        let mut surface = page.surface();
        for item in &sheet.items {
            match item {
                Item::Path {
                    points,
                    closed,
                    fill,
                    line,
                } => {
                    if let Some(path) = path(points, *closed) {
                        draw(&mut surface, &path, *fill, *line);
                    }
                }
                Item::Words(words) => {
                    let font = match words.face {
                        Typeface::Text => &fonts.0,
                        Typeface::Fixed => &fonts.1,
                    };
                    write(&mut surface, words, font);
                }
            }
        }
        surface.finish();
        page.finish();
    }
    document.finish().map_err(|e| format!("{e:?}"))
}

fn points(mm: f64) -> f32 {
    (mm * POINTS) as f32
}

fn paint(ink: Ink) -> rgb::Color {
    rgb::Color::new(ink[0], ink[1], ink[2])
}

fn path(corners: &[glam::DVec2], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (k, p) in corners.iter().enumerate() {
        let (x, y) = (points(p.x), points(p.y));
        if k == 0 {
            builder.move_to(x, y);
        } else {
            builder.line_to(x, y);
        }
    }
    if closed {
        builder.close();
    }
    builder.finish()
}

fn draw(surface: &mut Surface<'_>, path: &Path, fill: Option<Ink>, line: Option<SheetLine>) {
    surface.set_fill(fill.map(|ink| Fill {
        paint: paint(ink).into(),
        ..Fill::default()
    }));
    surface.set_stroke(line.map(|line| Stroke {
        paint: paint(line.ink).into(),
        width: points(line.width),
        miter_limit: 4.0,
        line_cap: LineCap::Round,
        line_join: LineJoin::Round,
        opacity: NormalizedF32::ONE,
        dash: line.dash.map(|dash| StrokeDash {
            array: dash.map(points).to_vec(),
            offset: 0.0,
        }),
    }));
    surface.draw_path(path);
}

fn write(surface: &mut Surface<'_>, words: &PlacedWords, font: &Font) {
    let letters = letters(&words.text, words.face);
    let width = letters.iter().map(|l| l.advance).sum::<f64>() * words.size;
    let back = match words.align {
        Align::Left => 0.0,
        Align::Middle => 0.5,
        Align::Right => 1.0,
    };
    let glyph = |l: &super::text::Letter| {
        let advance = l.advance as f32;
        KrillaGlyph::new(
            GlyphId::new(l.glyph),
            advance,
            0.0,
            0.0,
            0.0,
            l.from..l.to,
            None,
        )
    };
    let glyphs: Vec<KrillaGlyph> = letters.iter().map(glyph).collect();
    if glyphs.is_empty() {
        return;
    }
    surface.set_stroke(None);
    surface.set_fill(Some(Fill {
        paint: paint(words.ink).into(),
        ..Fill::default()
    }));
    let start = Point::from_xy(points(words.at.x - back * width), points(words.at.y));
    let size = points(words.size);
    surface.draw_glyphs(start, &glyphs, font.clone(), &words.text, size, false);
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::super::sheet::SheetSize;
    use super::*;

    #[test]
    fn the_same_sheets_are_the_same_bytes() {
        let mut sheet = Sheet::new(SheetSize::A4);
        sheet.circle(
            DVec2::new(50.0, 50.0),
            20.0,
            Some([1, 2, 3]),
            Some(SheetLine::new([0; 3], 0.3)),
        );
        sheet.say(
            DVec2::new(20.0, 20.0),
            "Gauge 1, ± 3 µε",
            4.0,
            Align::Middle,
        );
        let once = pdf("A title", &[sheet.clone(), sheet.clone()]).unwrap();
        assert!(once.starts_with(b"%PDF-"));
        assert_eq!(once, pdf("A title", &[sheet.clone(), sheet]).unwrap());
    }
}

//! STL, text and binary: all solids of a file.

use glam::{DVec3, Vec3};

use super::soup::Soup;
use super::words::{at, number};
use crate::plain::quote;

/// Length of the header of a binary file with the count after it, and of one triangle (bytes).
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads all triangles of a file.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    if is_binary(bytes) {
        return binary(&bytes[HEADER..]);
    }
    // Text holds no zero bytes.
    if is_solid(bytes) && !bytes.contains(&0) {
        return text(&String::from_utf8_lossy(bytes));
    }
    Err(match announced(bytes) {
        Some(count) => format!(
            "the STL file is truncated or damaged: its header announces {count} triangles ({} bytes), and it has {} bytes",
            HEADER + TRIANGLE * count,
            bytes.len()
        ),
        None => "the STL file is truncated: it is shorter than its header".into(),
    })
}

/// Headers lie: a binary file is known by its length, whatever its first word.
pub fn is_binary(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|count| bytes.len() == HEADER + TRIANGLE * count)
}

/// Triangles that the header of a binary file has.
fn announced(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize)
}

fn is_solid(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start().get(..5);
    start.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

fn binary(triangles: &[u8]) -> Result<Soup, String> {
    let mut soup = Soup::default();
    for (t, triangle) in (0u32..).zip(triangles.chunks_exact(TRIANGLE)) {
        let float = |k: usize| {
            let at = 12 + 4 * k;
            f32::from_le_bytes([
                triangle[at],
                triangle[at + 1],
                triangle[at + 2],
                triangle[at + 3],
            ])
        };
        for corner in 0..3 {
            let [x, y, z] = [0, 1, 2].map(|axis| float(3 * corner + axis));
            let place = Vec3::new(x, y, z);
            if !place.is_finite() {
                return Err(format!(
                    "triangle {} has a corner that is not a finite point ({x} {y} {z})",
                    t + 1
                ));
            }
            soup.positions.push(place.as_dvec3());
        }
        soup.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
    }
    Ok(soup)
}

/// What the next line may be.
#[derive(Clone, Copy, PartialEq)]
enum StlState {
    Outside,
    Solid,
    Facet,
    Loop,
    EndOfLoop,
}

impl StlState {
    fn expects(self) -> &'static str {
        match self {
            Self::Outside => "solid",
            Self::Solid => "facet or endsolid",
            Self::Facet => "outer loop",
            Self::Loop => "vertex or endloop",
            Self::EndOfLoop => "endfacet",
        }
    }
}

fn text(text: &str) -> Result<Soup, String> {
    let mut soup = Soup::default();
    let mut place = StlState::Outside;
    // Of the solid that is being read: its name and first triangle.
    let mut solid = (String::new(), 0);
    let mut last = 0;
    for (line, row) in (1..).zip(text.lines()) {
        let mut words = row.split_ascii_whitespace();
        let Some(first) = words.next() else { continue };
        last = line;
        let is = |keyword: &str| first.eq_ignore_ascii_case(keyword);
        place = match place {
            StlState::Outside if is("solid") => {
                let name: Vec<&str> = words.collect();
                solid = (name.join(" "), soup.triangles.len());
                StlState::Solid
            }
            StlState::Solid if is("endsolid") => {
                soup.group(&solid.0, solid.1);
                StlState::Outside
            }
            StlState::Solid if is("facet") => StlState::Facet,
            StlState::Facet if is("outer") => StlState::Loop,
            StlState::Loop if is("vertex") => {
                soup.positions.push(vertex(words, line)?);
                StlState::Loop
            }
            StlState::Loop if is("endloop") => {
                facet(&mut soup, line)?;
                StlState::EndOfLoop
            }
            StlState::EndOfLoop if is("endfacet") => StlState::Solid,
            _ => {
                let said = format!("{} where {} should be", quote(first), place.expects());
                return Err(at(line, &said));
            }
        };
    }
    if place == StlState::Outside {
        return Ok(soup);
    }
    Err(at(
        last,
        "the STL file is truncated here: it has no endsolid",
    ))
}

fn vertex<'w>(mut words: impl Iterator<Item = &'w str>, line: usize) -> Result<DVec3, String> {
    let mut next = || match words.next() {
        Some(word) => number(word, line),
        None => Err(at(line, "a vertex has three coordinates")),
    };
    let place = DVec3::new(next()?, next()?, next()?);
    match words.next() {
        None => Ok(place),
        Some(_) => Err(at(line, "a vertex has three coordinates")),
    }
}

/// The triangle between the last three vertices, which are all that no triangle has yet.
fn facet(soup: &mut Soup, line: usize) -> Result<(), String> {
    let first = 3 * soup.triangles.len();
    let corners = soup.positions.len() - first;
    if corners != 3 {
        return Err(at(
            line,
            &format!("a facet of {corners} corners; it has three"),
        ));
    }
    let first = first as u32;
    soup.triangles.push([first, first + 1, first + 2]);
    Ok(())
}

//! OBJ: polygons are cut into triangles; objects and groups become named groups of vertices.
//!
//! Read here line by line: the vertices stay in the order of the file and in double precision, and what is wrong
//! is named by its line.

use std::borrow::Cow;

use glam::DVec3;

use super::soup::Soup;
use super::words::{at, no_surface, number};
use crate::plain::{self, quote};

/// Reads all polygons of a file.
pub fn read(bytes: &[u8]) -> Result<Soup, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = ObjReader::default();
    let mut rows = (1..).zip(text.lines());
    while let Some((line, row)) = rows.next() {
        let mut whole = Cow::Borrowed(row);
        // A statement may go on in the next line.
        while let Some(begun) = goes_on(&whole) {
            let more = rows.next().map_or("", |(_, row)| row);
            whole = Cow::Owned(format!("{begun} {more}"));
        }
        reader.statement(line, &whole)?;
    }
    reader.finish(text.ends_with('\n'))
}

/// What a line says before the backslash that joins it with the next one. Names may end in one of their own.
fn goes_on(row: &str) -> Option<&str> {
    let numbers = row.trim_start().starts_with(['v', 'f', 'l', 'p']);
    let begun = row.trim_end().strip_suffix('\\');
    begun.filter(|_| numbers)
}

#[derive(Default)]
struct ObjReader {
    soup: Soup,
    /// Name of the group that is being read, and its first triangle.
    group: (String, usize),
    /// The highest number of a vertex that a face names, and the line that it stands in.
    highest: (usize, usize),
    /// The last statement: its line, and whether it is a face.
    last: (usize, bool),
    points_and_lines: usize,
    curved: usize,
    /// Vertices with a weight other than one.
    weighted: usize,
    /// Lines that mean nothing here: how many, the first of them and its first word.
    unknown: Option<(usize, usize, String)>,
}

impl ObjReader {
    fn statement(&mut self, line: usize, row: &str) -> Result<(), String> {
        let mut words = row.split_whitespace();
        let Some(kind) = words.next() else {
            return Ok(());
        };
        self.last = (line, kind == "f");
        let numbers = words.take_while(|w| !w.starts_with('#'));
        match kind {
            "v" => self.vertex(line, numbers)?,
            "f" => self.face(line, numbers)?,
            "o" | "g" => {
                self.end_group();
                let name = row.trim().get(1..).unwrap_or_default().trim();
                self.group = (name.to_owned(), self.soup.triangles.len());
            }
            "p" | "l" => self.points_and_lines += 1,
            "curv" | "curv2" | "surf" => self.curved += 1,
            // Normals, materials, smoothing, and what curves are made of.
            "vn" | "vt" | "vp" | "mtllib" | "usemtl" | "usemap" | "maplib" | "s" | "mg"
            | "cstype" | "deg" | "bmat" | "step" | "parm" | "trim" | "hole" | "scrv" | "sp"
            | "end" | "con" | "bevel" | "c_interp" | "d_interp" | "lod" | "shadow_obj"
            | "trace_obj" | "ctech" | "stech" => {}
            comment if comment.starts_with('#') => {}
            other => {
                let first = (0, line, other.to_owned());
                self.unknown.get_or_insert(first).0 += 1;
            }
        }
        Ok(())
    }

    /// Coordinates, then a colour, or the weight that a curve would give it.
    fn vertex<'w>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'w str>,
    ) -> Result<(), String> {
        let values: Vec<f64> = words.map(|w| number(w, line)).collect::<Result<_, _>>()?;
        let place = match values[..] {
            [x, y, z] | [x, y, z, _, _, _] | [x, y, z, _, _, _, _] => DVec3::new(x, y, z),
            [x, y, z, weight] => {
                self.weighted += usize::from(weight != 1.0);
                DVec3::new(x, y, z)
            }
            _ => return Err(at(line, "a vertex has three coordinates")),
        };
        self.soup.positions.push(place);
        Ok(())
    }

    /// A polygon as a fan round its first corner.
    fn face<'w>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'w str>,
    ) -> Result<(), String> {
        let corners: Vec<u32> = words
            .map(|w| self.corner(line, w))
            .collect::<Result<_, _>>()?;
        let [first, rest @ ..] = &corners[..] else {
            return Err(at(
                line,
                "a face without corners: the file is cut off or damaged",
            ));
        };
        if rest.len() < 2 {
            let count = corners.len();
            return Err(at(
                line,
                &format!(
                    "a face of fewer than three corners ({count}): the file is cut off or damaged"
                ),
            ));
        }
        let fan = rest.windows(2).map(|pair| [*first, pair[0], pair[1]]);
        self.soup.triangles.extend(fan);
        Ok(())
    }

    /// The vertex that a word such as `7/1/3` names: counted from 1, or backward from the last one.
    fn corner(&mut self, line: usize, word: &str) -> Result<u32, String> {
        let vertex = word.split('/').next().unwrap_or_default();
        let count = self.soup.positions.len();
        let index = match vertex.parse::<i64>() {
            Ok(from_one @ 1..) => usize::try_from(from_one - 1).ok(),
            Ok(backward @ ..=-1) => usize::try_from(backward.unsigned_abs())
                .ok()
                .and_then(|back| count.checked_sub(back)),
            _ => None,
        };
        let number = index.and_then(|i| Some((i, u32::try_from(i).ok()?)));
        let Some((index, number)) = number else {
            let said = format!("{} names no vertex; there are {count} so far", quote(word));
            return Err(at(line, &said));
        };
        if index > self.highest.0 || self.highest.1 == 0 {
            self.highest = (index, line);
        }
        Ok(number)
    }

    fn end_group(&mut self) {
        let (name, first) = std::mem::take(&mut self.group);
        self.soup.group(&name, first);
    }

    /// `ended`: the last line has its end.
    fn finish(mut self, ended: bool) -> Result<Soup, String> {
        self.end_group();
        let (highest, line) = self.highest;
        let count = self.soup.positions.len();
        // A face may come before its vertices.
        if line > 0 && highest >= count {
            let said = format!(
                "a face names vertex {}, and the file has {count}",
                highest + 1
            );
            return Err(at(line, &said));
        }
        let left_out = [
            no_surface(self.points_and_lines, "lines and points"),
            no_surface(self.curved, "curves and curved patches"),
        ];
        self.soup.notes.extend(left_out.into_iter().flatten());
        if self.weighted > 0 {
            self.soup.notes.push(format!(
                "{} a weight, which is for curves alone: the coordinates are taken as they stand",
                plain::either(self.weighted, "vertex has", "vertices have")
            ));
        }
        let (last, is_face) = self.last;
        if is_face && !ended {
            self.soup.notes.push(format!(
                "the last line of the file ({last}) is a face and has no end: make sure that nothing was cut off"
            ));
        }
        if let Some((count, line, word)) = self.unknown {
            self.soup.notes.push(format!(
                "left out: {} not known in an OBJ file, the first is line {line} ({})",
                plain::count(count, "line"),
                quote(&word)
            ));
        }
        Ok(self.soup)
    }
}

//! Tetrahedra as they come out of a file, each with the line it stands in.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::Soup;
use crate::mesh::volume::{Tetrahedron, VolumeError, VolumeMesh};

/// Tetrahedra on the nodes of a file, none of them twice.
#[derive(Default)]
pub struct Tetrahedra {
    all: Vec<Tetrahedron>,
    lines: Vec<usize>,
    /// Which of them has these corners, in rising order.
    known: HashMap<[u32; 4], usize>,
    /// How many were there before, and the line of the first of those.
    repeats: usize,
    repeated: usize,
}

impl Tetrahedra {
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Takes one in. One that is there already, on the same nodes, is counted and left out.
    ///
    /// # Errors
    /// A message naming the line of one with the corners of another, but other nodes between them.
    pub fn push(&mut self, tetrahedron: Tetrahedron, line: usize) -> Result<(), String> {
        let mut corners = tetrahedron.corners;
        corners.sort_unstable();
        match self.known.entry(corners) {
            Entry::Vacant(free) => {
                free.insert(self.all.len());
                self.all.push(tetrahedron);
                self.lines.push(line);
            }
            Entry::Occupied(known) => {
                let first = *known.get();
                if middles(&self.all[first]) != middles(&tetrahedron) {
                    return Err(format!(
                        "line {line}: this tetrahedron has the corners of the one in line {}, but other nodes between them",
                        self.lines[first]
                    ));
                }
                if self.repeats == 0 {
                    self.repeated = line;
                }
                self.repeats += 1;
            }
        }
        Ok(())
    }

    /// Triangles of the file with a node that none of these has.
    #[must_use]
    pub fn triangles_apart(&self, soup: &Soup) -> usize {
        let mut used = vec![false; soup.positions.len()];
        for corner in self.all.iter().flat_map(|t| t.corners) {
            used[corner as usize] = true;
        }
        let apart = |triangle: &&[u32; 3]| triangle.iter().any(|&v| !used[v as usize]);
        soup.triangles.iter().filter(apart).count()
    }

    /// Hands them over as the volume of what the file holds.
    ///
    /// # Errors
    /// A message naming the line of one that does not fit its neighbours.
    pub fn hand_to(self, soup: &mut Soup) -> Result<(), String> {
        if self.is_empty() {
            return Ok(());
        }
        if self.repeats > 0 {
            soup.notes.push(format!(
                "{} tetrahedra are there a second time (the first in line {}) and were taken once",
                self.repeats, self.repeated
            ));
        }
        let volume = VolumeMesh::of(soup.positions.clone(), &self.all);
        soup.volume = Some(volume.map_err(|e| in_line(&e, &self.lines))?);
        soup.tetrahedron_lines = self.lines;
        Ok(())
    }
}

/// The nodes between the corners, in rising order.
fn middles(tetrahedron: &Tetrahedron) -> Option<[u32; 6]> {
    let mut middles = tetrahedron.middles?;
    middles.sort_unstable();
    Some(middles)
}

/// What is wrong with a tetrahedron, and the line of the file that it stands in.
#[must_use]
pub fn in_line(error: &VolumeError, lines: &[usize]) -> String {
    match error.element().and_then(|element| lines.get(element)) {
        Some(line) => format!("line {line}: {error}"),
        None => error.to_string(),
    }
}

//! Tetrahedra as they come out of a file, each with where it stands there.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::place::{ElementName, FilePlace};
use super::soup::Soup;
use crate::memory;
use crate::mesh::volume::{Tetrahedron, VolumeError, VolumeMesh};
use crate::plain;

/// Refuses more nodes than a model could be made of, before any is taken in.
///
/// # Errors
/// A message naming the place where so many are announced or reached.
pub fn bounded(nodes: u64, place: FilePlace) -> Result<(), String> {
    /// Bytes that the stiffness of a node takes beside its neighbours, before anything is factored.
    const A_NODE: f64 = 1500.0;
    let most = memory::allowed() / A_NODE;
    if nodes as f64 <= most {
        return Ok(());
    }
    Err(format!(
        "{place}: {nodes} nodes are more than {:.0}, which is what {} of memory bear: mesh the part with larger elements, or allow more with --memory-gb",
        most.floor(),
        plain::allowed(memory::allowed())
    ))
}

/// Tetrahedra on the nodes of a file, none of them twice.
#[derive(Default)]
pub struct FileTetrahedra {
    all: Vec<Tetrahedron>,
    origins: Vec<ElementName>,
    /// Which of them has these corners, in rising order.
    known: HashMap<[u32; 4], usize>,
    /// How many were there before, and the place of the first of those.
    repeats: usize,
    repeated: Option<FilePlace>,
}

impl FileTetrahedra {
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Takes one in. One that is there already, on the same nodes, is counted and left out.
    ///
    /// # Errors
    /// A message naming the place of one with the corners of another, but other nodes between them.
    pub fn push(&mut self, tetrahedron: Tetrahedron, origin: ElementName) -> Result<(), String> {
        let mut corners = tetrahedron.corners;
        corners.sort_unstable();
        match self.known.entry(corners) {
            Entry::Vacant(free) => {
                free.insert(self.all.len());
                self.all.push(tetrahedron);
                self.origins.push(origin);
            }
            Entry::Occupied(known) => {
                let first = *known.get();
                if middles(&self.all[first]) != middles(&tetrahedron) {
                    return Err(format!(
                        "{origin}: this tetrahedron has the corners of the one in {}, but other nodes between them",
                        self.origins[first].place
                    ));
                }
                self.repeated.get_or_insert(origin.place);
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
    /// A message naming the place of one that does not fit its neighbours.
    pub fn hand_to(self, soup: &mut Soup) -> Result<(), String> {
        if self.is_empty() {
            return Ok(());
        }
        if let Some(place) = self.repeated {
            soup.notes.push(format!(
                "{} there a second time (the first in {place}) and taken once",
                plain::either(self.repeats, "tetrahedron is", "tetrahedra are")
            ));
        }
        let volume = VolumeMesh::of(soup.positions.clone(), &self.all);
        soup.volume = Some(volume.map_err(|e| at_origin(&e, &self.origins))?);
        soup.origins = self.origins;
        Ok(())
    }
}

/// The nodes between the corners, in rising order.
fn middles(tetrahedron: &Tetrahedron) -> [Option<u32>; 6] {
    let mut middles = tetrahedron.middles;
    middles.sort_unstable();
    middles
}

/// What is wrong with a tetrahedron, and where in the file that one stands.
#[must_use]
pub fn at_origin(error: &VolumeError, origins: &[ElementName]) -> String {
    match error.element().and_then(|element| origins.get(element)) {
        Some(origin) => format!("{origin}: {error}"),
        None => error.to_string(),
    }
}

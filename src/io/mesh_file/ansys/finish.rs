//! What a deck comes to when all its commands are known.

use std::collections::BTreeMap;

use super::elements::{DeckElement, Use};
use super::reader::DeckReader;
use crate::io::mesh_file::sets::{Numbered, check_count};
use crate::io::mesh_file::soup::Soup;
use crate::io::mesh_file::tetrahedra::FileTetrahedra;
use crate::io::mesh_file::unread::Unread;
use crate::io::mesh_file::words::at;
use crate::plain;

/// Elements by what is made of them.
#[derive(Default)]
struct Sorted<'e> {
    tetrahedra: FileTetrahedra,
    solids: Vec<&'e DeckElement>,
    shells: Vec<&'e DeckElement>,
    left_out: Unread,
}

impl Sorted<'_> {
    /// Those that are computed on.
    fn computed(&self) -> &[&DeckElement] {
        if self.solids.is_empty() {
            &self.shells
        } else {
            &self.solids
        }
    }
}

impl DeckReader {
    /// The mesh and what is said of it.
    ///
    /// # Errors
    /// A message naming the line of what cannot be right, or that there is nothing to compute on.
    pub(super) fn finish(mut self) -> Result<Soup, String> {
        if self.soup.positions.is_empty() {
            return Err("it has no nodes (NBLOCK or N): this is no input of Ansys MAPDL, or only of its geometry or its loads".into());
        }
        let elements = std::mem::take(&mut self.elements);
        let sorted = self.sorted(&elements)?;
        self.take_sets(&elements)?;
        let solid = !sorted.solids.is_empty();
        let mut notes = std::mem::take(&mut self.soup.notes);
        let material = most(
            sorted.computed(),
            |element| element.material,
            "materials",
            &mut notes,
        );
        self.soup.said.material = self.materials.elastic(material, &mut notes);
        self.soup.said.supports = self
            .held
            .supports(solid, &mut self.soup.node_sets, &mut notes);
        if !solid {
            self.take_thickness(&sorted, &mut notes);
        }
        self.note_rest(&sorted.left_out, &mut notes);
        self.soup.notes = notes;
        if solid {
            sorted.tetrahedra.hand_to(&mut self.soup)?;
        }
        Ok(self.soup)
    }

    fn sorted<'e>(&mut self, elements: &'e [DeckElement]) -> Result<Sorted<'e>, String> {
        let mut sorted = Sorted::default();
        for element in elements {
            let routine = self.routines.get(&element.kind).ok_or_else(|| {
                let what = format!(
                    "elements of type {} stand here, and no ET says what they are",
                    element.kind
                );
                at(element.line, &what)
            })?;
            match routine.used {
                Use::Tetrahedron | Use::Brick => {
                    let tetrahedron = element.tetrahedron(routine, &self.nodes)?;
                    sorted.tetrahedra.push(tetrahedron, element.origin)?;
                    sorted.solids.push(element);
                }
                Use::Shell => sorted.shells.push(element),
                Use::Contact | Use::Other => sorted.left_out.add(&routine.name, element.line),
            }
        }
        if sorted.computed().is_empty() {
            let others = if sorted.left_out.is_empty() {
                String::new()
            } else {
                format!(", but {}", sorted.left_out.listed())
            };
            return Err(format!(
                "it has no tetrahedra (SOLID187 or SOLID285) and no shells (SHELL181 or SHELL281){others}: mesh the part with them"
            ));
        }
        if sorted.solids.is_empty() {
            for element in &sorted.shells {
                let triangles = element.triangles(&self.nodes)?;
                self.soup.triangles.extend(triangles);
            }
        } else {
            for element in &sorted.shells {
                let name = &self.routines[&element.kind].name;
                sorted.left_out.add(name, element.line);
            }
        }
        Ok(sorted)
    }

    /// Looks up what components name.
    fn take_sets(&mut self, elements: &[DeckElement]) -> Result<(), String> {
        let sets = self.node_sets.len() + self.element_sets.len();
        check_count(sets, self.nodes.len())?;
        let nodes = self.node_list().numbered;
        for set in 0..self.node_sets.len() {
            let members = self.node_sets.members(set, &nodes);
            self.take_set(
                self.node_sets.name(set).to_owned(),
                members.found,
                members.missing,
            );
        }
        let numbered = Numbered::of(&self.element_places);
        for set in 0..self.element_sets.len() {
            let members = self.element_sets.members(set, &numbered);
            let nodes = (members.found.iter()).flat_map(|&at| &elements[at as usize].nodes);
            let mut found: Vec<u32> = nodes.filter_map(|n| self.nodes.get(n).copied()).collect();
            found.sort_unstable();
            found.dedup();
            self.take_set(
                self.element_sets.name(set).to_owned(),
                found,
                members.missing,
            );
        }
        Ok(())
    }

    fn take_set(&mut self, name: String, found: Vec<u32>, missing: u64) {
        if missing > 0 {
            self.soup.notes.push(format!(
                "the component {} names {missing} nodes or elements that are not there",
                plain::quote(&name)
            ));
        }
        self.soup.node_sets.push((name, found));
    }

    fn take_thickness(&mut self, sorted: &Sorted, notes: &mut Vec<String>) {
        let section = most(&sorted.shells, |element| element.section, "sections", notes);
        self.soup.said.thickness = self.thickness.get(&section).copied().filter(|&t| t > 0.0);
        if self.soup.said.thickness.is_none() {
            notes.push(format!(
                "the file has no thickness that is read (SECDATA of section {section}): the project's is taken"
            ));
        }
        let curved = |element: &&&DeckElement| element.nodes.len() > 4;
        let curved = sorted.shells.iter().filter(curved).count();
        if curved > 0 {
            notes.push(format!(
                "{} taken as flat: nodes between the corners are left out",
                plain::either(curved, "curved shell is", "curved shells are")
            ));
        }
    }

    /// Notes what is left out and what is not read.
    fn note_rest(&self, left_out: &Unread, notes: &mut Vec<String>) {
        if !left_out.is_empty() {
            notes.push(format!(
                "{} left out, as not computed on: {}",
                plain::either(left_out.total(), "element is", "elements are"),
                left_out.listed()
            ));
        }
        if !self.unread.is_empty() {
            notes.push(format!(
                "commands of the file that are not read: {}",
                self.unread.listed()
            ));
        }
        if !self.strays.is_empty() {
            notes.push(format!(
                "lines of the file that belong to no command that is read: {}",
                self.strays.listed()
            ));
        }
    }
}

/// The number that most elements have; more than one is noted.
fn most(
    elements: &[&DeckElement],
    number: impl Fn(&DeckElement) -> u64,
    what: &str,
    notes: &mut Vec<String>,
) -> u64 {
    let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
    for &element in elements {
        *counts.entry(number(element)).or_default() += 1;
    }
    let found = counts
        .iter()
        .max_by_key(|(number, count)| (**count, std::cmp::Reverse(**number)));
    let number = found.map_or(1, |(number, _)| *number);
    if counts.len() > 1 {
        notes.push(format!(
            "the elements are of {} {what}: number {number}, which most have, is taken for all",
            counts.len()
        ));
    }
    number
}

//! What is known of a deck while it is read.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use glam::DVec3;

use super::command::Parameters;
use super::elements::{DeckElement, Routine};
use super::material::Materials;
use super::selection::DeckSelection;
use crate::io::mesh_file::held::HeldNodes;
use crate::io::mesh_file::place::{ElementName, FilePlace};
use crate::io::mesh_file::sets::{Numbered, Sets};
use crate::io::mesh_file::soup::Soup;
use crate::io::mesh_file::tetrahedra::bounded;
use crate::io::mesh_file::unread::Unread;
use crate::io::mesh_file::words::at;

#[derive(Default)]
pub(super) struct DeckReader {
    pub(super) soup: Soup,
    pub(super) known: Parameters,
    /// Places in our lists by the deck's numbers.
    pub(super) nodes: HashMap<u64, u32>,
    pub(super) element_places: HashMap<u64, u32>,
    /// The deck's numbers of the nodes in our list, and its largest of nodes and of elements.
    pub(super) node_numbers: Vec<u64>,
    pub(super) last_node: u64,
    pub(super) last_element: u64,
    /// The nodes in the order of their numbers, as long as there are so many.
    pub(super) numbered: Option<(usize, Rc<Numbered>)>,
    /// Nodes with directions of their own.
    pub(super) turned: HashSet<u32>,
    pub(super) elements: Vec<DeckElement>,
    pub(super) routines: HashMap<u64, Routine>,
    /// What elements without attributes of their own get: type, material, section.
    pub(super) active: Active,
    pub(super) materials: Materials,
    /// Thickness by number of section: the sum of its layers.
    pub(super) thickness: HashMap<u64, f64>,
    pub(super) section: u64,
    pub(super) node_sets: Sets,
    pub(super) element_sets: Sets,
    pub(super) selection: DeckSelection,
    pub(super) held: HeldNodes,
    pub(super) unread: Unread,
    /// Line of the command that made a system of coordinates active that is not the global one.
    pub(super) elsewhere: Option<usize>,
    /// Loops and conditions that are open.
    pub(super) depth: usize,
    /// What comes after a first solution belongs to another one.
    pub(super) solved: bool,
    pub(super) ended: bool,
    /// Whether the numbers that follow belong to a block that is not read.
    pub(super) in_unread: bool,
    /// Numbers that belong to no block.
    pub(super) strays: Unread,
}

/// Numbers that elements get.
#[derive(Clone, Copy)]
pub(super) struct Active {
    pub(super) kind: u64,
    pub(super) material: u64,
    pub(super) section: u64,
}

impl Default for Active {
    fn default() -> Self {
        Self {
            kind: 1,
            material: 1,
            section: 1,
        }
    }
}

impl DeckReader {
    pub(super) fn take_node(
        &mut self,
        number: u64,
        position: DVec3,
        angles: &[f64],
        line: usize,
    ) -> Result<(), String> {
        let place = self.soup.positions.len() as u32;
        bounded(u64::from(place) + 1, FilePlace::Line(line))?;
        if number == 0 || self.nodes.insert(number, place).is_some() {
            let what = format!("node {number} is there a second time, or has no number");
            return Err(at(line, &what));
        }
        self.soup.positions.push(position);
        self.node_numbers.push(number);
        self.last_node = self.last_node.max(number);
        if angles.iter().any(|&angle| angle != 0.0) {
            self.turned.insert(place);
        }
        Ok(())
    }

    pub(super) fn take_element(&mut self, element: DeckElement) -> Result<(), String> {
        let place = self.elements.len() as u32;
        let ElementName { number, .. } = element.origin;
        if let Some(first) = self.element_places.insert(number, place) {
            let first = self.elements[first as usize].line;
            let what = format!("element {number} is there a second time (first in line {first})");
            return Err(at(element.line, &what));
        }
        self.last_element = self.last_element.max(number);
        self.elements.push(element);
        Ok(())
    }
}

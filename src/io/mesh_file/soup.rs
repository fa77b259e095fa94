//! What a mesh file holds before it is checked.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec3;

use super::found::DeckSaid;
use super::held::NodeSet;
use super::place::ElementName;
use crate::memory;
use crate::mesh::volume::VolumeMesh;
use crate::project::Masks;

/// What a file holds, unchecked, in its own unit.
#[derive(Default)]
pub(super) struct Soup {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Name, first triangle and the one after the last.
    pub(super) groups: Vec<(String, usize, usize)>,
    /// What was left out of the file, or is not known: whole sentences without a stop.
    pub(super) notes: Vec<String>,
    /// Tetrahedra on the positions: their surface is the mesh, whatever triangles there are.
    pub(super) volume: Option<VolumeMesh>,
    /// Where each of the tetrahedra stands in the file.
    pub(super) origins: Vec<ElementName>,
    /// Positions by name.
    pub(super) node_sets: Vec<NodeSet>,
    /// What it says of the part beside its mesh.
    pub(super) said: DeckSaid,
}

impl Soup {
    /// Names the triangles from `first` on.
    pub(super) fn group(&mut self, name: &str, first: usize) {
        if !name.is_empty() && first < self.triangles.len() {
            self.groups
                .push((name.to_owned(), first, self.triangles.len()));
        }
    }

    /// Vertices of the mesh that lie in each group: `numbers` are those of the file's vertices in the mesh, which has
    /// so many.
    pub(super) fn masks(&mut self, numbers: &[Option<u32>], vertices: usize) -> Masks {
        let mut masks = Masks::new();
        let of_triangles = self.groups.iter().map(|(name, ..)| name.as_str());
        let of_nodes = self.node_sets.iter().map(|(name, _)| name.as_str());
        let names: BTreeSet<&str> = of_triangles.chain(of_nodes).collect();
        if (names.len() as f64) * (vertices as f64) > memory::allowed() / 4.0 {
            let said = format!(
                "the {} named groups of the file are too many to be kept as masks",
                names.len()
            );
            self.notes.push(said);
            return masks;
        }
        let mut set = |name: &str, members: &mut dyn Iterator<Item = u32>| {
            let mask = masks
                .entry(name.to_owned())
                .or_insert_with(|| Arc::new(vec![false; vertices]));
            let mask = Arc::make_mut(mask);
            for number in members.filter_map(|v| numbers[v as usize]) {
                mask[number as usize] = true;
            }
        };
        for (name, first, last) in &self.groups {
            let corners = self.triangles[*first..*last].iter().flatten();
            set(name, &mut corners.copied());
        }
        for (name, nodes) in &self.node_sets {
            set(name, &mut nodes.iter().copied());
        }
        masks.retain(|_, mask| mask.iter().any(|&m| m));
        masks
    }
}

//! Which nodes a deck holds, and how, whichever of its commands said so.

use std::collections::BTreeMap;

use crate::elasticity::DofSet;
use crate::mesh::unroll::Axis;
use crate::plain;
use crate::project::{SupportKeys, SupportKind};

/// A name and nodes, in rising order.
pub type NodeSet = (String, Vec<u32>);

/// Freedoms that are held, by node.
#[derive(Default)]
pub struct HeldNodes {
    nodes: BTreeMap<u32, u8>,
}

/// A way of holding.
struct HoldingWay {
    kind: SupportKind,
    normal: Axis,
    /// Freedoms that must be held for it.
    need: u8,
    /// Of the nodes, where the file has none for them.
    name: &'static str,
}

/// A solid has no rotations.
fn ways(solid: bool) -> Vec<HoldingWay> {
    let full = if solid {
        DofSet::DISPLACEMENTS
    } else {
        DofSet::ALL
    };
    let all = |kind, need: DofSet, name| HoldingWay {
        kind,
        normal: Axis::Z,
        need: need.0,
        name,
    };
    let mut ways = vec![all(SupportKind::Clamped, full, "held")];
    if !solid {
        ways.push(all(SupportKind::Pinned, DofSet::DISPLACEMENTS, "pinned"));
    }
    let axes = [
        (Axis::X, "held along x"),
        (Axis::Y, "held along y"),
        (Axis::Z, "held along z"),
    ];
    for (axis, (normal, name)) in axes.into_iter().enumerate() {
        ways.push(HoldingWay {
            kind: SupportKind::Symmetry,
            normal,
            need: DofSet::symmetry(axis).0 & full.0,
            name,
        });
    }
    ways
}

fn fits(held: u8, need: u8) -> bool {
    held & need == need
}

impl HeldNodes {
    /// Holds a node, beside what is held of it already.
    pub fn hold(&mut self, node: u32, dofs: DofSet) {
        *self.nodes.entry(node).or_default() |= dofs.0;
    }

    /// The supports that this is, on sets of nodes: those of the file that hold the same nodes, and new ones. What no
    /// support can say is noted.
    pub fn supports(
        &self,
        solid: bool,
        sets: &mut Vec<NodeSet>,
        notes: &mut Vec<String>,
    ) -> Vec<SupportKeys> {
        let ways = ways(solid);
        let supports = ways.iter().filter_map(|way| {
            let stronger = |w: &&HoldingWay| w.need != way.need && fits(w.need, way.need);
            let stronger: Vec<u8> = ways.iter().filter(stronger).map(|w| w.need).collect();
            let is_own =
                |&held: &u8| fits(held, way.need) && !stronger.iter().any(|&need| fits(held, need));
            // With nodes that are held in more ways: what lies between them is held too.
            self.nodes.values().any(is_own).then(|| SupportKeys {
                kind: way.kind,
                box_mm: None,
                box_axis: None,
                vertices: Some(name_of(self.held(way.need), way.name, sets)),
                normal: way.normal,
                bedding_n_per_mm3: None,
            })
        });
        let supports = supports.collect();
        let meant = if solid {
            DofSet::DISPLACEMENTS
        } else {
            DofSet::ALL
        };
        let said = |held: u8| {
            let fitting = ways.iter().filter(|way| fits(held, way.need));
            fitting.fold(0, |said, way| said | way.need)
        };
        let in_part = |&&held: &&u8| held & meant.0 & !said(held) != 0;
        let lost = self.nodes.values().filter(in_part).count();
        if lost > 0 {
            notes.push(format!(
                "{} held in a way that is neither clamped, pinned nor a mirror plane: in part free here",
                plain::either(lost, "node is", "nodes are")
            ));
        }
        supports
    }

    fn held(&self, need: u8) -> Vec<u32> {
        let held = self.nodes.iter().filter(|&(_, &held)| fits(held, need));
        held.map(|(&node, _)| node).collect()
    }
}

/// The name of a set of just these nodes; a new one gets `name`, with a number where that is taken.
fn name_of(nodes: Vec<u32>, name: &str, sets: &mut Vec<NodeSet>) -> String {
    if let Some((known, _)) = sets.iter().find(|(_, of)| *of == nodes) {
        return known.clone();
    }
    let mut free = name.to_owned();
    let mut number = 1;
    while sets.iter().any(|(taken, _)| *taken == free) {
        number += 1;
        free = format!("{name} {number}");
    }
    sets.push((free.clone(), nodes));
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_is_said_by_the_sets_of_the_file() {
        let mut held = HeldNodes::default();
        for node in [1, 2, 5] {
            held.hold(node, DofSet::of(&[0, 1]));
            held.hold(node, DofSet::of(&[2]));
        }
        held.hold(7, DofSet::of(&[1]));
        let mut sets = vec![("rim".to_owned(), vec![1, 2, 5])];
        let mut notes = Vec::new();
        let supports = held.supports(true, &mut sets, &mut notes);
        let named: Vec<_> = (supports.iter())
            .map(|s| (s.kind, s.normal, s.vertices.as_deref()))
            .collect();
        assert_eq!(
            named,
            [
                (SupportKind::Clamped, Axis::Z, Some("rim")),
                (SupportKind::Symmetry, Axis::Y, Some("held along y")),
            ]
        );
        // The mirror plane goes on to what is clamped.
        assert_eq!(sets[1].1, [1, 2, 5, 7]);
        assert!(notes.is_empty());
    }

    #[test]
    fn a_shell_has_rotations() {
        let mut held = HeldNodes::default();
        held.hold(1, DofSet::DISPLACEMENTS);
        held.hold(2, DofSet::ALL);
        held.hold(3, DofSet::of(&[0]));
        let (mut sets, mut notes) = (Vec::new(), Vec::new());
        let supports = held.supports(false, &mut sets, &mut notes);
        let kinds: Vec<SupportKind> = supports.iter().map(|s| s.kind).collect();
        assert_eq!(kinds, [SupportKind::Clamped, SupportKind::Pinned]);
        assert_eq!(sets[1].1, [1, 2]);
        assert!(notes[0].starts_with("1 node is"), "{notes:?}");
    }
}

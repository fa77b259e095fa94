//! What was changed while a mesh was taken in, counted, and in words.

use serde::Serialize;

use crate::plain;
use crate::units;

/// What was changed while a mesh was taken in; all zero for a clean one.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// Vertices merged because their positions were equal to the bit.
    pub welded_vertices: usize,
    /// Vertices merged because they were nearer than the tolerance asked for.
    pub joined_vertices: usize,
    /// Triangles without area, which were left out.
    pub degenerate_triangles: usize,
    /// Triangles that repeat another, which were left out.
    pub duplicate_triangles: usize,
    /// Triangles turned over so that neighbours agree on the outside.
    pub flipped_triangles: usize,
    /// Separate bodies found, of which one was kept.
    pub bodies: usize,
    /// Share of their area in the bodies that were left out.
    pub left_out: f64,
    /// Edges shared by more than two triangles: kept, the shell is joined there.
    pub non_manifold_edges: usize,
    /// Edges with a triangle on one side only: free rims.
    pub boundary_edges: usize,
    /// Holes that were filled because that was asked for.
    pub filled_holes: usize,
    /// Triangles thinner than a hundredth of their length: kept; graded elements do not have them.
    pub slivers: usize,
    /// Triangles that long edges were halved into, for what is painted and shown a vertex; none where none was.
    pub halved_into: usize,
    /// The mesh is open, but closes where vertices within so much (m) of each other are joined.
    pub closes_within: Option<f64>,
    /// So many open edges would be joined where vertices within so much (m) of each other are, and others stay open.
    pub torn: Option<(f64, usize)>,
    /// What the file holds that was left out, or that its reader does not know: whole sentences without a stop.
    pub notes: Vec<String>,
}

impl RepairReport {
    /// What was done and found, in words; nothing for a clean mesh.
    #[must_use]
    pub fn in_words(&self, body: usize) -> Option<String> {
        /// A part with screws and inserts beside it leaves out less.
        const MUCH: f64 = 0.5;
        let mut parts = Vec::new();
        if self.bodies > 1 {
            let lacks = if self.left_out > MUCH {
                format!(
                    ", which leaves out {:.0} % of the surface: the mesh has come apart, or the part has several",
                    (100.0 * self.left_out).floor()
                )
            } else {
                String::new()
            };
            parts.push(format!(
                "body {body} of {} is used (0 to {}, by falling area; the part's body setting picks another){lacks}",
                self.bodies,
                self.bodies - 1
            ));
        }
        let found = [
            (
                self.joined_vertices,
                "near vertex joined",
                "near vertices joined",
            ),
            (
                self.degenerate_triangles,
                "triangle without area dropped",
                "triangles without area dropped",
            ),
            (
                self.duplicate_triangles,
                "duplicate triangle dropped",
                "duplicate triangles dropped",
            ),
            (
                self.flipped_triangles,
                "triangle turned over",
                "triangles turned over",
            ),
            (self.filled_holes, "hole filled", "holes filled"),
            (
                self.non_manifold_edges,
                "edge joins more than two triangles",
                "edges join more than two triangles",
            ),
            (self.slivers, "sliver", "slivers"),
        ];
        let found = found.into_iter().filter(|&(number, ..)| number > 0);
        parts.extend(found.map(|(number, one, many)| plain::either(number, one, many)));
        if let Some(within) = self.closes_within {
            let mm = plain::digits(units::mm(within));
            parts.push(format!(
                "{} open, and the mesh closes when vertices within {mm} mm are joined (part.weld_mm = {mm})",
                plain::either(self.boundary_edges, "edge is", "edges are")
            ));
        }
        if let Some((within, edges)) = self.torn {
            let mm = plain::digits(units::mm(within));
            parts.push(format!(
                "{edges} open edges lie along each other and are not joined: the wall is torn there. Vertices within {mm} mm are joined by part.weld_mm = {mm}"
            ));
        }
        if self.halved_into > 0 {
            parts.push(format!(
                "long edges halved: {} triangles to paint on and to show fields at (part.halve_mm)",
                self.halved_into
            ));
        }
        let changed = (!parts.is_empty()).then(|| parts.join(", "));
        let said: Vec<String> = changed.into_iter().chain(self.notes.clone()).collect();
        (!said.is_empty()).then(|| said.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_a_thing_is_not_many() {
        let words = |number: usize| {
            let report = RepairReport {
                joined_vertices: number,
                flipped_triangles: number,
                non_manifold_edges: number,
                slivers: number,
                boundary_edges: number,
                closes_within: Some(1e-6),
                ..RepairReport::default()
            };
            report.in_words(0).unwrap()
        };
        assert_eq!(
            words(1),
            "1 near vertex joined, 1 triangle turned over, 1 edge joins more than two triangles, 1 sliver, 1 edge is open, and the mesh closes when vertices within 0.001 mm are joined (part.weld_mm = 0.001)"
        );
        assert!(words(2).starts_with("2 near vertices joined, 2 triangles turned over, 2 edges"));
        assert!(words(2).contains("2 slivers, 2 edges are open"));
    }

    #[test]
    fn a_body_that_is_the_least_of_the_file_says_so() {
        let words = |left_out: f64| {
            let report = RepairReport {
                bodies: 192,
                left_out,
                ..RepairReport::default()
            };
            report.in_words(0).unwrap()
        };
        assert!(words(0.991).contains("leaves out 99 % of the surface"));
        assert!(!words(0.2).contains("leaves out"));
    }
}

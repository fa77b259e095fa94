//! What was changed while a mesh was taken in, counted, and in words.

use serde::Serialize;

use crate::plain;

/// What was changed while a mesh was taken in; all zero for a clean one.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RepairReport {
    /// Vertices merged because their positions were equal to the bit.
    pub welded_vertices: usize,
    /// Vertices merged because they were nearer than the tolerance asked for.
    pub joined_vertices: usize,
    pub degenerate_triangles: usize,
    pub duplicate_triangles: usize,
    /// Triangles turned over so that neighbours agree on the outside.
    pub flipped_triangles: usize,
    /// Separate bodies found, of which one was kept.
    pub bodies: usize,
    /// Edges shared by more than two triangles: kept, the shell is joined there.
    pub non_manifold_edges: usize,
    /// Edges with a triangle on one side only: free rims.
    pub boundary_edges: usize,
    /// Holes that were filled because that was asked for.
    pub filled_holes: usize,
    /// Triangles thinner than a hundredth of their length: kept; graded elements do not have them.
    pub slivers: usize,
    /// The mesh is open, but closes where vertices within so much (m) of each other are joined.
    pub closes_within: Option<f64>,
    /// What the file holds that was left out, or that its reader does not know: whole sentences without a stop.
    pub notes: Vec<String>,
}

impl RepairReport {
    /// What was done and found, in words; nothing for a clean mesh.
    #[must_use]
    pub fn in_words(&self, body: usize) -> Option<String> {
        let mut parts = Vec::new();
        if self.bodies > 1 {
            parts.push(format!(
                "body {body} of {} is used (0 to {}, by falling area; the part's body setting picks another)",
                self.bodies,
                self.bodies - 1
            ));
        }
        let mut count = |n: usize, what: &str| {
            if n > 0 {
                parts.push(format!("{n} {what}"));
            }
        };
        count(self.joined_vertices, "near vertices joined");
        count(self.degenerate_triangles, "triangles without area dropped");
        count(self.duplicate_triangles, "duplicate triangles dropped");
        count(self.flipped_triangles, "triangles turned over");
        count(self.filled_holes, "holes filled");
        count(
            self.non_manifold_edges,
            "edges join more than two triangles",
        );
        count(self.slivers, "slivers");
        if let Some(within) = self.closes_within {
            let mm = plain::digits(within * 1e3);
            parts.push(format!(
                "{} edges are open, and the mesh closes when vertices within {mm} mm are joined (part.weld_mm = {mm})",
                self.boundary_edges
            ));
        }
        let changed = (!parts.is_empty()).then(|| parts.join(", "));
        let said: Vec<String> = changed.into_iter().chain(self.notes.clone()).collect();
        (!said.is_empty()).then(|| said.join("; "))
    }
}

//! What of a pressure on the surface the nodes of elements take.

use super::elements::Elements;
use crate::elasticity::load::merge;
use crate::mesh::{SurfacePoint, TriMesh};

/// Σ share N(point) for each node that takes part, in rising order: consistent nodal shares, which sum to those of
/// the points. `guesses` say for each facet of the mesh where a search for its element may begin.
#[must_use]
pub fn nodal_shares(
    elements: &dyn Elements,
    mesh: &TriMesh,
    guesses: &[u32],
    pressure: &[(SurfacePoint, f64)],
) -> Vec<(u32, f64)> {
    // A tip covers few elements, and points that follow each other mostly lie in the same one.
    let mut covered: Vec<(u32, Vec<f64>)> = Vec::new();
    let (mut last, mut values) = (0, Vec::new());
    for &(at, share) in pressure {
        let outward = mesh.facet_normal(at.triangle);
        let mut guess = guesses[at.triangle as usize];
        let (element, place) = elements.find(mesh.point(at), outward, &mut guess);
        elements.values(place, &mut values);
        if covered.get(last).is_none_or(|c| c.0 != element) {
            let known = covered.iter().position(|c| c.0 == element);
            last = known.unwrap_or(covered.len());
        }
        if last == covered.len() {
            covered.push((element, vec![0.0; values.len()]));
        }
        for (sum, value) in covered[last].1.iter_mut().zip(&values) {
            *sum += share * value;
        }
    }
    let nodes = |(element, sums): &(u32, Vec<f64>)| {
        let nodes = elements.nodes_of(*element as usize).to_vec();
        nodes.into_iter().zip(sums.clone())
    };
    merge(covered.iter().flat_map(nodes).collect())
}

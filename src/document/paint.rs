//! Painting on the part: what a hand does to the layers of a document.

use std::sync::Arc;

use super::Document;
use super::state::Layer;
use crate::mesh::SurfacePoint;

/// Whether a stroke adds to a layer or takes from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brush {
    Paint,
    Erase,
}

impl Document {
    /// The vertices of a layer, where any were painted.
    #[must_use]
    pub fn layer(&self, layer: Layer) -> Option<&Arc<Vec<bool>>> {
        self.state.layer(layer)
    }

    /// A support on vertices still to be painted.
    pub fn add_painted_support(&mut self) {
        self.state.add_painted_support(self.part.positions().len());
    }

    fn layer_mut(&mut self, layer: Layer, first: bool) -> &mut Vec<bool> {
        let vertices = self.part.positions().len();
        self.state.layer_mut(layer, first, vertices)
    }

    /// Nothing is painted on a layer any more: it is as if it had never been.
    pub fn clear(&mut self, layer: Layer) {
        self.state.clear(layer);
        self.settle();
    }

    /// One dab of the brush: every vertex within `radius` (m) over the surface. The first dab of paint on
    /// an unpainted layer begins from nothing painted; the first erasing dab on the feasible layer from
    /// everything.
    pub fn dab(&mut self, layer: Layer, brush: Brush, at: SurfacePoint, radius: f64) {
        let near = self.march.near(&self.part, at, radius, &mut self.scratch);
        // A brush finer than the mesh still leaves its mark.
        let nearest = (0..3).max_by(|&a, &b| at.barycentric[a].total_cmp(&at.barycentric[b]));
        let corner = nearest.map(|c| self.part.triangles()[at.triangle as usize][c]);
        let vertices = near.into_iter().map(|(v, _)| v).chain(corner);
        self.mark(layer, brush, vertices);
    }

    /// Paints or erases vertices.
    pub fn mark(&mut self, layer: Layer, brush: Brush, vertices: impl IntoIterator<Item = u32>) {
        let paint = brush == Brush::Paint;
        if !paint && layer != Layer::Feasible && self.layer(layer).is_none() {
            return;
        }
        let vertices: Vec<u32> = vertices.into_iter().collect();
        let mask = self.layer_mut(layer, !paint);
        for &v in &vertices {
            mask[v as usize] = paint;
        }
        if let Some(other) = layer.excluded().filter(|_| paint)
            && self.layer(other).is_some()
        {
            let mask = self.layer_mut(other, false);
            for &v in &vertices {
                mask[v as usize] = false;
            }
        }
    }

    /// Every vertex is painted.
    pub fn fill(&mut self, layer: Layer) {
        self.repaint(layer, |_, mask| mask.fill(true));
    }

    /// What was painted is not, and what was not is; without a feasible region everything counts as it.
    pub fn invert(&mut self, layer: Layer) {
        self.repaint(layer, |_, mask| mask.iter_mut().for_each(|m| *m = !*m));
    }

    /// The layer grows by a distance over the surface (m), by one vertex at least.
    pub fn grow(&mut self, layer: Layer, by: f64) {
        self.repaint(layer, |document, mask| document.extend(mask, true, by));
    }

    /// The layer shrinks by a distance over the surface (m), by one vertex at least.
    pub fn shrink(&mut self, layer: Layer, by: f64) {
        self.repaint(layer, |document, mask| document.extend(mask, false, by));
    }

    /// One step of undo that changes a layer.
    fn repaint(&mut self, layer: Layer, change: impl FnOnce(&Self, &mut Vec<bool>)) {
        let mut mask = self.layer_mut(layer, true).clone();
        change(self, &mut mask);
        *self.layer_mut(layer, true) = mask;
        self.settle();
    }

    /// Vertices near those that are `painted` become so too.
    fn extend(&self, mask: &mut [bool], painted: bool, by: f64) {
        let beside: Vec<u32> = (self.part.edges().iter())
            .filter(|e| mask[e.a as usize] != mask[e.b as usize])
            .flat_map(|e| [e.a, e.b])
            .collect();
        // From the rim: what lies behind it is painted already.
        let rim = beside
            .iter()
            .copied()
            .filter(|&v| mask[v as usize] == painted);
        let reached = self.march.from_set(&rim.collect::<Vec<_>>(), by);
        for (m, d) in mask.iter_mut().zip(reached) {
            if d <= by {
                *m = painted;
            }
        }
        for v in beside {
            mask[v as usize] = painted;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Quality;

    fn document() -> Document {
        Document::new(crate::io::opening::bundled().unwrap(), None)
    }

    fn at(document: &Document) -> SurfacePoint {
        SurfacePoint {
            triangle: (document.part.triangles().len() / 2) as u32,
            barycentric: [1.0 / 3.0; 3],
        }
    }

    #[test]
    fn a_painted_region_grows_shrinks_and_turns_over() {
        let mut d = document();
        let place = at(&d);
        let count = |d: &Document| {
            let mask = d.state.painted.as_ref();
            mask.map_or(0, |m| m.iter().filter(|&&m| m).count())
        };
        d.dab(Layer::Feasible, Brush::Paint, place, 9e-3);
        d.settle();
        let dab = count(&d);
        d.grow(Layer::Feasible, 6e-3);
        let grown = count(&d);
        d.shrink(Layer::Feasible, 6e-3);
        let back = count(&d);
        assert!(
            grown > dab + 20 && back.abs_diff(dab) <= dab / 4,
            "{dab} {grown} {back}"
        );
        d.invert(Layer::Feasible);
        assert_eq!(count(&d), d.part.positions().len() - back);
        d.fill(Layer::Feasible);
        assert_eq!(count(&d), d.part.positions().len());
        for expected in [d.part.positions().len() - back, back, grown, dab] {
            d.undo();
            assert_eq!(count(&d), expected);
        }
        // Less than an element still moves the rim by one vertex.
        d.grow(Layer::Feasible, 1e-6);
        assert!(count(&d) > dab);
    }

    #[test]
    fn layers_are_apart_and_what_is_empty_is_gone() {
        let mut d = document();
        let place = at(&d);
        let count = |d: &Document, layer| d.layer(layer).map(|m| m.iter().filter(|&&m| m).count());
        for layer in [Layer::KeepOut, Layer::Support, Layer::Touch] {
            // Nothing to take from.
            d.dab(layer, Brush::Erase, place, 6e-3);
            assert_eq!(count(&d, layer), None);
            d.dab(layer, Brush::Paint, place, 6e-3);
            d.settle();
            assert!(count(&d, layer).unwrap() > 10);
        }
        assert_eq!(count(&d, Layer::Feasible), None);
        let supports = d.state.project.supports.len();
        assert!(d.state.project.supports[supports - 1].vertices.is_some());
        let key = d.simulation_inputs(Quality::Draft);
        d.dab(Layer::Touch, Brush::Erase, place, 20e-3);
        d.settle();
        assert_eq!(count(&d, Layer::Touch), None);
        assert!(d.state.project.touch.region.is_none());
        assert_ne!(d.simulation_inputs(Quality::Draft), key);
        d.undo();
        assert_eq!(d.simulation_inputs(Quality::Draft), key);
        d.clear(Layer::Support);
        assert_eq!(d.state.project.supports.len(), supports - 1);
        d.clear(Layer::KeepOut);
        assert!(d.state.project.feasible.keep_out.is_none());
        d.undo();
        assert!(count(&d, Layer::KeepOut).unwrap() > 10);
    }
}

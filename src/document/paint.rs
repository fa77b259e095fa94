//! Painting on the part: layers of vertices, and what a hand does to them.

use std::sync::Arc;

use super::Document;
use crate::mesh::SurfacePoint;
use crate::mesh::unroll::Axis;
use crate::project::{SupportKeys, SupportKind};

/// What is painted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layer {
    /// Where gauges may go: everywhere when nothing is painted.
    #[default]
    Feasible,
    /// Where no gauge may go.
    KeepOut,
    /// What the last of the painted supports holds.
    Support,
    /// Where touches come: everywhere when nothing is painted.
    Touch,
    /// Of a solid: the face that gauges are glued to, and the one that is touched, where what was found by
    /// itself is wrong.
    Inside,
    Outside,
}

impl Layer {
    pub const ALL: [Self; 6] = [
        Self::Feasible,
        Self::KeepOut,
        Self::Support,
        Self::Touch,
        Self::Inside,
        Self::Outside,
    ];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Feasible => "Feasible",
            Self::KeepOut => "Keep out",
            Self::Support => "Support",
            Self::Touch => "Touch region",
            Self::Inside => "Inside face",
            Self::Outside => "Outside face",
        }
    }

    /// Whether it says something of a solid only.
    #[must_use]
    pub fn is_face(self) -> bool {
        matches!(self, Self::Inside | Self::Outside)
    }

    /// The layer that a vertex cannot be on at the same time.
    fn excluded(self) -> Option<Self> {
        match self {
            Self::Inside => Some(Self::Outside),
            Self::Outside => Some(Self::Inside),
            _ => None,
        }
    }
}

/// Whether a stroke adds to a layer or takes from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brush {
    Paint,
    Erase,
}

const KEEP_OUT: &str = "keep-out";
const TOUCH: &str = "touch-region";
const INSIDE: &str = "inside-face";
const OUTSIDE: &str = "outside-face";

impl Document {
    /// The vertices of a layer, where any were painted.
    #[must_use]
    pub fn layer(&self, layer: Layer) -> Option<&Arc<Vec<bool>>> {
        let state = &self.state;
        match layer {
            Layer::Feasible => state.painted.as_ref(),
            Layer::KeepOut => state.masks.get(state.project.feasible.keep_out.as_ref()?),
            Layer::Touch => state.masks.get(state.project.touch.region.as_ref()?),
            Layer::Support => state.masks.get(self.painted_support()?),
            Layer::Inside => state.masks.get(state.project.part.inside.as_ref()?),
            Layer::Outside => state.masks.get(state.project.part.outside.as_ref()?),
        }
    }

    /// The name of the last support that is a mask of vertices.
    fn painted_support(&self) -> Option<&String> {
        let supports = self.state.project.supports.iter().rev();
        { supports }.find_map(|s| s.vertices.as_ref())
    }

    /// A support on vertices still to be painted.
    pub fn add_painted_support(&mut self) {
        let free = |name: &String| !self.state.masks.contains_key(name);
        let numbered = (1..).map(|k| format!("support-{k}"));
        let Some(name) = numbered.take(10_000).find(free) else {
            return;
        };
        let none = Arc::new(vec![false; self.part.positions().len()]);
        self.state.masks.insert(name.clone(), none);
        self.state.project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: None,
            box_axis: None,
            vertices: Some(name),
            normal: Axis::Z,
        });
    }

    /// The mask of a layer, to be changed: it begins as `first` where there is none yet.
    fn layer_mut(&mut self, layer: Layer, first: bool) -> &mut Vec<bool> {
        let vertices = self.part.positions().len();
        let name = match layer {
            Layer::Feasible => {
                let mask = self
                    .state
                    .painted
                    .get_or_insert_with(|| Arc::new(vec![first; vertices]));
                return Arc::make_mut(mask);
            }
            Layer::KeepOut => {
                let name = self.own_name(self.state.project.feasible.keep_out.clone(), KEEP_OUT);
                self.state.project.feasible.keep_out = Some(name.clone());
                name
            }
            Layer::Touch => {
                let name = self.own_name(self.state.project.touch.region.clone(), TOUCH);
                self.state.project.touch.region = Some(name.clone());
                name
            }
            Layer::Inside => {
                let name = self.own_name(self.state.project.part.inside.clone(), INSIDE);
                self.state.project.part.inside = Some(name.clone());
                name
            }
            Layer::Outside => {
                let name = self.own_name(self.state.project.part.outside.clone(), OUTSIDE);
                self.state.project.part.outside = Some(name.clone());
                name
            }
            Layer::Support => {
                if self.painted_support().is_none() {
                    self.add_painted_support();
                }
                self.painted_support().cloned().unwrap_or_default()
            }
        };
        let mask = self.state.masks.entry(name);
        Arc::make_mut(mask.or_insert_with(|| Arc::new(vec![false; vertices])))
    }

    /// A name for the mask of a layer that nothing else goes by: what two keys of a project share is copied
    /// before one of them changes.
    fn own_name(&mut self, name: Option<String>, wanted: &str) -> String {
        let project = &mut self.state.project;
        let others = usize::from(name.is_some());
        let wish = name.as_deref().unwrap_or(wanted);
        if project.mask_names().filter(|n| *n == wish).count() <= others {
            return wish.to_owned();
        }
        let taken: Vec<String> = project.mask_names().map(|n| n.clone()).collect();
        let numbered = (2..).map(|k| format!("{wanted}-{k}"));
        let fresh = { numbered }
            .find(|n| !taken.contains(n))
            .unwrap_or_default();
        if let Some(mask) = name.and_then(|name| self.state.masks.get(&name).cloned()) {
            self.state.masks.insert(fresh.clone(), mask);
        }
        fresh
    }

    /// Nothing is painted on a layer any more: it is as if it had never been.
    pub fn clear(&mut self, layer: Layer) {
        match layer {
            Layer::Feasible => self.state.painted = None,
            Layer::KeepOut => {
                if let Some(name) = self.state.project.feasible.keep_out.take() {
                    self.forget_mask(&name);
                }
            }
            Layer::Touch => {
                if let Some(name) = self.state.project.touch.region.take() {
                    self.forget_mask(&name);
                }
            }
            Layer::Inside => {
                if let Some(name) = self.state.project.part.inside.take() {
                    self.forget_mask(&name);
                }
            }
            Layer::Outside => {
                if let Some(name) = self.state.project.part.outside.take() {
                    self.forget_mask(&name);
                }
            }
            Layer::Support => {
                if let Some(name) = self.painted_support().cloned() {
                    let supports = &mut self.state.project.supports;
                    supports.retain(|s| s.vertices.as_ref() != Some(&name));
                    self.forget_mask(&name);
                }
            }
        }
        self.settle();
    }

    fn forget_mask(&mut self, name: &String) {
        if !self.state.project.mask_names().any(|n| n == name) {
            self.state.masks.remove(name);
        }
    }

    /// A region without a vertex would forbid every touch, or mean nothing.
    pub(super) fn drop_empty_layers(&mut self) {
        let empty = |d: &Self, layer| d.layer(layer).is_some_and(|mask| !mask.contains(&true));
        if empty(self, Layer::KeepOut)
            && let Some(name) = self.state.project.feasible.keep_out.take()
        {
            self.forget_mask(&name);
        }
        if empty(self, Layer::Touch)
            && let Some(name) = self.state.project.touch.region.take()
        {
            self.forget_mask(&name);
        }
        if empty(self, Layer::Inside)
            && let Some(name) = self.state.project.part.inside.take()
        {
            self.forget_mask(&name);
        }
        if empty(self, Layer::Outside)
            && let Some(name) = self.state.project.part.outside.take()
        {
            self.forget_mask(&name);
        }
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
        self.repaint(layer, |document, mask| document.spread(mask, true, by));
    }

    /// The layer shrinks by a distance over the surface (m), by one vertex at least.
    pub fn shrink(&mut self, layer: Layer, by: f64) {
        self.repaint(layer, |document, mask| document.spread(mask, false, by));
    }

    /// One step of undo that changes a layer.
    fn repaint(&mut self, layer: Layer, change: impl FnOnce(&Self, &mut Vec<bool>)) {
        let mut mask = self.layer_mut(layer, true).clone();
        change(self, &mut mask);
        *self.layer_mut(layer, true) = mask;
        self.settle();
    }

    /// Vertices near those that are `painted` become so too.
    fn spread(&self, mask: &mut [bool], painted: bool, by: f64) {
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

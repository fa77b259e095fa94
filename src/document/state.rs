//! What undo brings back: the project, and the layers that are painted on its part.

use std::sync::Arc;

use crate::mesh::unroll::Axis;
use crate::project::{Masks, Project, SupportKeys, SupportKind};

/// What undo brings back. The mesh is not part of it: opening a file begins a new history.
#[derive(Clone, PartialEq)]
pub struct DocumentState {
    pub project: Project,
    /// Where gauges may go, one value a vertex of the part; absent when nothing was painted.
    pub painted: Option<Arc<Vec<bool>>>,
    /// Masks of the part's vertices that supports may name.
    pub masks: Masks,
}

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
    /// Where touches come more often than elsewhere.
    Often,
}

impl Layer {
    pub const ALL: [Self; 7] = [
        Self::Feasible,
        Self::KeepOut,
        Self::Support,
        Self::Touch,
        Self::Often,
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
            Self::Often => "Often touched",
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
    pub(super) fn excluded(self) -> Option<Self> {
        match self {
            Self::Inside => Some(Self::Outside),
            Self::Outside => Some(Self::Inside),
            _ => None,
        }
    }
}

/// The key of a project that names the mask of a layer, where one does.
fn key(project: &Project, layer: Layer) -> Option<&Option<String>> {
    match layer {
        Layer::KeepOut => Some(&project.feasible.keep_out),
        Layer::Touch => Some(&project.touch.region),
        Layer::Often => Some(&project.touch.often),
        Layer::Inside => Some(&project.part.inside),
        Layer::Outside => Some(&project.part.outside),
        Layer::Feasible | Layer::Support => None,
    }
}

/// The same to be changed, with the name that a new mask is given.
fn key_mut(project: &mut Project, layer: Layer) -> Option<(&mut Option<String>, &'static str)> {
    match layer {
        Layer::KeepOut => Some((&mut project.feasible.keep_out, "keep-out")),
        Layer::Touch => Some((&mut project.touch.region, "touch-region")),
        Layer::Often => Some((&mut project.touch.often, "often-touched")),
        Layer::Inside => Some((&mut project.part.inside, "inside-face")),
        Layer::Outside => Some((&mut project.part.outside, "outside-face")),
        Layer::Feasible | Layer::Support => None,
    }
}

impl DocumentState {
    /// The vertices of a layer, where any were painted.
    #[must_use]
    pub fn layer(&self, layer: Layer) -> Option<&Arc<Vec<bool>>> {
        let name = match layer {
            Layer::Feasible => return self.painted.as_ref(),
            Layer::Support => self.painted_support(),
            _ => key(&self.project, layer)?.as_ref(),
        };
        self.masks.get(name?)
    }

    /// The name of the last support that is a mask of vertices.
    fn painted_support(&self) -> Option<&String> {
        let supports = self.project.supports.iter().rev();
        { supports }.find_map(|s| s.vertices.as_ref())
    }

    /// A support still to be painted, on a part of so many vertices.
    pub(super) fn add_painted_support(&mut self, vertices: usize) {
        let free = |name: &String| !self.masks.contains_key(name);
        let numbered = (1..).map(|k| format!("support-{k}"));
        let Some(name) = numbered.take(10_000).find(free) else {
            return;
        };
        let none = Arc::new(vec![false; vertices]);
        self.masks.insert(name.clone(), none);
        self.project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: None,
            box_axis: None,
            vertices: Some(name),
            normal: Axis::Z,
            bedding_n_per_mm3: None,
        });
    }

    /// The mask of a layer, to be changed, on a part of so many vertices: the feasible one begins as `first` where there
    /// is none yet.
    pub(super) fn layer_mut(
        &mut self,
        layer: Layer,
        first: bool,
        vertices: usize,
    ) -> &mut Vec<bool> {
        if layer == Layer::Feasible {
            let mask = self
                .painted
                .get_or_insert_with(|| Arc::new(vec![first; vertices]));
            return Arc::make_mut(mask);
        }
        let name = self.name_to_paint(layer, vertices);
        let mask = self.masks.entry(name);
        Arc::make_mut(mask.or_insert_with(|| Arc::new(vec![false; vertices])))
    }

    /// The name of the mask that a layer is painted in.
    fn name_to_paint(&mut self, layer: Layer, vertices: usize) -> String {
        let Some((named, wanted)) = key_mut(&mut self.project, layer) else {
            if self.painted_support().is_none() {
                self.add_painted_support(vertices);
            }
            return self.painted_support().cloned().unwrap_or_default();
        };
        let named = named.clone();
        let name = self.own_name(named, wanted);
        if let Some((key, _)) = key_mut(&mut self.project, layer) {
            *key = Some(name.clone());
        }
        name
    }

    /// A name for the mask of a layer that nothing else goes by: what two keys of a project share is copied
    /// before one of them changes.
    fn own_name(&mut self, name: Option<String>, wanted: &str) -> String {
        let project = &mut self.project;
        let others = usize::from(name.is_some());
        let asked = name.as_deref().unwrap_or(wanted);
        if project.mask_names().filter(|n| *n == asked).count() <= others {
            return asked.to_owned();
        }
        let taken: Vec<String> = project.mask_names().map(|n| n.clone()).collect();
        let numbered = (2..).map(|k| format!("{wanted}-{k}"));
        let fresh = { numbered }
            .find(|n| !taken.contains(n))
            .unwrap_or_default();
        if let Some(mask) = name.and_then(|name| self.masks.get(&name).cloned()) {
            self.masks.insert(fresh.clone(), mask);
        }
        fresh
    }

    /// Nothing is painted on a layer any more: it is as if it had never been.
    pub(super) fn clear(&mut self, layer: Layer) {
        match layer {
            Layer::Feasible => self.painted = None,
            Layer::Support => {
                if let Some(name) = self.painted_support().cloned() {
                    let supports = &mut self.project.supports;
                    supports.retain(|s| s.vertices.as_ref() != Some(&name));
                    self.forget_mask(&name);
                }
            }
            _ => {
                let name = key_mut(&mut self.project, layer).and_then(|(key, _)| key.take());
                if let Some(name) = name {
                    self.forget_mask(&name);
                }
            }
        }
    }

    fn forget_mask(&mut self, name: &String) {
        if !self.project.mask_names().any(|n| n == name) {
            self.masks.remove(name);
        }
    }

    /// A region without a vertex would forbid every touch, or mean nothing.
    pub(super) fn drop_empty_layers(&mut self) {
        for layer in Layer::ALL {
            if matches!(layer, Layer::Feasible | Layer::Support) {
                continue;
            }
            if self.layer(layer).is_some_and(|mask| !mask.contains(&true)) {
                self.clear(layer);
            }
        }
    }
}

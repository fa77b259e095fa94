//! Masks of the part's vertices, by name, and the supports that name some.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{BadValue, Project, SupportKeys, SupportKind};
use crate::elasticity::support::HeldRegion;
use crate::elasticity::{DofSet, Support};
use crate::mesh::unroll::Axis;
use crate::plain::quote;

/// Masks of the part's vertices by name: arrays beside the project file, and groups of the mesh file.
pub type Masks = BTreeMap<String, Arc<Vec<bool>>>;

impl Project {
    /// The names of all masks that the project refers to, beside what is painted.
    pub fn mask_names(&mut self) -> impl Iterator<Item = &mut String> {
        self.mask_keys().map(|(_, name)| name)
    }

    /// The same with the key that each stands under.
    pub fn mask_keys(&mut self) -> impl Iterator<Item = (&'static str, &mut String)> {
        let supports = self.supports.iter_mut();
        let supports = supports.map(|s| ("support.vertices", s.vertices.as_mut()));
        let others = [
            ("part.inside", self.part.inside.as_mut()),
            ("part.outside", self.part.outside.as_mut()),
            ("touch.region", self.touch.region.as_mut()),
            ("touch.often", self.touch.often.as_mut()),
            ("feasible.keep_out", self.feasible.keep_out.as_mut()),
        ];
        supports
            .chain(others)
            .filter_map(|(key, name)| Some((key, name?)))
    }

    /// A mask that the project names.
    ///
    /// # Errors
    /// [`BadValue`] where there is none of that name.
    pub fn mask<'a>(
        key: &str,
        name: Option<&String>,
        masks: &'a Masks,
    ) -> Result<Option<&'a Arc<Vec<bool>>>, BadValue> {
        let Some(name) = name else {
            return Ok(None);
        };
        let found = masks.get(name).ok_or_else(|| BadValue {
            key: key.into(),
            rule: "the name of an array beside the project file or of a group of the mesh file"
                .into(),
            value: format!("{} (there is {})", quote(name), names(masks)),
        })?;
        Ok(Some(found))
    }

    /// The supports, with the masks of the part's vertices that some of them name.
    ///
    /// # Errors
    /// [`BadValue`] for a support without a region, or with a mask that is not there.
    pub fn supports(&self, masks: &Masks) -> Result<Vec<Support>, BadValue> {
        let axis = |a: Axis| [Axis::X, Axis::Y, Axis::Z].iter().position(|&b| a == b);
        let held = |s: &SupportKeys| match s.kind {
            SupportKind::Clamped => DofSet::ALL,
            SupportKind::Pinned => DofSet::DISPLACEMENTS,
            SupportKind::Symmetry => DofSet::symmetry(axis(s.normal).unwrap_or(2)),
        };
        self.supports
            .iter()
            .map(|s| {
                Ok(Support {
                    region: region(s, masks)?,
                    held: held(s),
                    bedding: s.bedding(),
                })
            })
            .collect()
    }
}

fn names(masks: &Masks) -> String {
    /// Names that are listed.
    const MOST: usize = 8;
    if masks.is_empty() {
        return "none".into();
    }
    let listed: Vec<String> = masks.keys().take(MOST).map(|name| quote(name)).collect();
    let more = if masks.len() > MOST { ", …" } else { "" };
    format!("{}{more}", listed.join(", "))
}

fn region(support: &SupportKeys, masks: &Masks) -> Result<HeldRegion, BadValue> {
    match (support.oriented_box(), &support.vertices) {
        (Some(held), None) => Ok(HeldRegion::Box(held)),
        (None, Some(name)) => {
            let mask = Project::mask("support.vertices", Some(name), masks)?;
            let mask = mask.map(Arc::clone).unwrap_or_default();
            Ok(HeldRegion::Vertices(mask))
        }
        (both, _) => Err(BadValue {
            key: "support".into(),
            rule: "given one region: box_mm or vertices".into(),
            value: if both.is_some() {
                "given both"
            } else {
                "given neither"
            }
            .into(),
        }),
    }
}

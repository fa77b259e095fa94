//! One body of several, with the hollows in it.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::numbers::NumberMap;
use super::report::RepairReport;
use super::topology::components;
use super::{MeshError, winding};
use crate::bounds::Bounds;

/// One body of several.
pub(super) struct KeptBody {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Of each vertex of the whole.
    pub(super) numbers: Vec<Option<u32>>,
}

/// Keeps one connected body (joined at least at a vertex), by falling area, and only the vertices it uses.
pub(super) fn keep_body(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    body: usize,
    report: &mut RepairReport,
) -> Result<KeptBody, MeshError> {
    let labels = components(positions.len(), triangles);
    let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
    for tri in triangles {
        let [a, b, c] = tri.map(|v| positions[v as usize]);
        *areas.entry(labels[tri[0] as usize]).or_default() += (b - a).cross(c - a).length();
    }
    let mut by_area: Vec<(u32, f64)> = areas.into_iter().collect();
    by_area.sort_by(|x, y| y.1.total_cmp(&x.1).then(x.0.cmp(&y.0)));
    let hollows = hollows(positions, triangles, &labels, &by_area);
    by_area.retain(|(label, _)| !hollows.contains_key(label));
    report.bodies = by_area.len();
    let &(label, _) = by_area.get(body).ok_or(MeshError::NoSuchBody {
        body,
        count: by_area.len(),
    })?;
    report.left_out = share_left_out(&by_area, body);
    let mut used = vec![false; positions.len()];
    let mut chosen: Vec<[u32; 3]> = Vec::new();
    let belongs = |l: u32| l == label || hollows.get(&l) == Some(&label);
    for tri in triangles.iter().filter(|t| belongs(labels[t[0] as usize])) {
        for &v in tri {
            used[v as usize] = true;
        }
        chosen.push(*tri);
    }
    // In their old order, so that a mesh that needs no repair keeps its numbers.
    let mut renumber = vec![0; positions.len()];
    let mut kept = Vec::new();
    for v in (0..positions.len()).filter(|&v| used[v]) {
        renumber[v] = kept.len() as u32;
        kept.push(positions[v]);
    }
    for tri in &mut chosen {
        *tri = tri.map(|v| renumber[v as usize]);
    }
    let numbers = renumber.into_iter().zip(used);
    Ok(KeptBody {
        positions: kept,
        triangles: chosen,
        numbers: numbers.map(|(v, used)| used.then_some(v)).collect(),
    })
}

/// Share of the area of all bodies that is not this one's.
fn share_left_out(by_area: &[(u32, f64)], body: usize) -> f64 {
    let all: f64 = by_area.iter().map(|b| b.1).sum();
    let others = by_area.iter().enumerate().filter(|(k, _)| *k != body);
    others.map(|(_, b)| b.1).sum::<f64>() / all
}

/// One of several surfaces.
struct Enclosing<'t> {
    triangles: Vec<&'t [u32; 3]>,
    bounds: Bounds,
    /// Six times the volume it encloses (m³), negative where it faces inward.
    volume: f64,
}

impl<'t> Enclosing<'t> {
    const NOTHING: Self = Self {
        triangles: Vec::new(),
        bounds: Bounds::NOTHING,
        volume: 0.0,
    };

    fn add(&mut self, tri: &'t [u32; 3], positions: &[DVec3], origin: DVec3) {
        let corners = tri.map(|v| positions[v as usize]);
        for p in corners {
            self.bounds = self.bounds.with(p);
        }
        let [a, b, c] = corners.map(|p| p - origin);
        self.volume += a.dot(b.cross(c));
        self.triangles.push(tri);
    }

    /// Whether it faces outward and a point lies within it.
    fn surrounds(&self, positions: &[DVec3], point: DVec3) -> bool {
        self.volume > 0.0 && self.bounds.contains(point) && {
            let seen =
                |t: &&[u32; 3]| winding::solid_angle(&t.map(|v| positions[v as usize]), point);
            self.triangles.iter().map(seen).sum::<f64>() > 2.0 * std::f64::consts::PI
        }
    }
}

/// Surfaces that face inward and lie within another one bound a hollow of it: by their labels, that of the
/// surface around them.
fn hollows(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    labels: &[u32],
    by_area: &[(u32, f64)],
) -> HashMap<u32, u32> {
    let mut found = HashMap::new();
    if by_area.len() < 2 {
        return found;
    }
    let places: NumberMap<u32, usize> = by_area.iter().map(|b| b.0).zip(0..).collect();
    let mut surfaces: Vec<Enclosing> = by_area.iter().map(|_| Enclosing::NOTHING).collect();
    for tri in triangles {
        let label = labels[tri[0] as usize];
        surfaces[places[&label]].add(tri, positions, positions[label as usize]);
    }
    for (k, &(inner, _)) in by_area.iter().enumerate() {
        if surfaces[k].volume >= 0.0 {
            continue;
        }
        let point = positions[inner as usize];
        let around = surfaces[..k]
            .iter()
            .position(|outer| outer.surrounds(positions, point));
        if let Some(outer) = around {
            found.insert(inner, by_area[outer].0);
        }
    }
    found
}

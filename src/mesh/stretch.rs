//! What laying a part flat does to its lengths: no barrel can be laid flat without stretching it somewhere.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::TriMesh;
use super::locate::SurfaceIndex;

/// What lengths are kept to.
pub const KEPT: f64 = 0.05;

/// How far a flat view departs from the lengths of the part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stretch {
    /// The largest share that any length on a facet is off by; 0 where nothing is seen of it.
    pub facets: Vec<f64>,
    /// Of what is seen, the share where lengths are off by more than [`KEPT`].
    pub off: f64,
    /// 95 % of what is seen is off by less.
    pub most: f64,
}

impl Stretch {
    /// What a reader of the view must know of its lengths.
    #[must_use]
    pub fn words(&self) -> String {
        let kept = 100.0 * KEPT;
        if self.off < 0.005 {
            return format!("Lengths are kept to {kept:.0} %");
        }
        format!(
            "Hatched: lengths are off by more than {kept:.0} %, on {:.0} % of the view; on 95 % of it they are within {:.0} %",
            100.0 * self.off,
            (100.0 * self.most).ceil()
        )
    }
}

/// The facets that are seen of a part laid flat, as they are in space and in the plane.
pub(super) struct SeenFacets {
    facets: Vec<StretchFacet>,
    /// Of the part.
    count: usize,
}

struct StretchFacet {
    number: usize,
    /// In the plane (m²).
    area: f64,
    /// Products of its two sides: in space, and in the plane of their parts around and along.
    space: Gram,
    around: Gram,
    along: Gram,
}

/// aa, ab, bb of two sides a and b (m²).
type Gram = [f64; 3];

impl SeenFacets {
    /// Of a part, the triangles that a flat view (`positions`, which rise towards the eye) is seen to have on top.
    pub fn of(
        mesh: &TriMesh,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        index: &SurfaceIndex,
    ) -> Self {
        let high = positions.iter().map(|p| p.z).fold(0.0, f64::max);
        let facet = |(number, tri): (usize, &[u32; 3])| {
            let flat = tri.map(|v| positions[v as usize]);
            is_on_top(number as u32, flat, high, index)
                .then(|| StretchFacet::of(number, mesh.corners(number as u32), flat))
        };
        let facets: Vec<Option<StretchFacet>> =
            triangles.par_iter().enumerate().map(facet).collect();
        Self {
            facets: facets.into_iter().flatten().collect(),
            count: triangles.len(),
        }
    }

    /// The factor on lengths around that keeps most of the view within [`KEPT`]; 1 where none is clearly better.
    pub fn best_factor(&self) -> f64 {
        /// In the share of the view.
        const CLEARLY: f64 = 0.02;
        /// Facets that tell what the view is like.
        const ENOUGH: usize = 20_000;
        let every = self.facets.len().div_ceil(ENOUGH).max(1);
        let plain = self.share_off(1.0, every);
        let (best, least) = (-20..=20)
            .map(|k| 1.0 + 0.01 * f64::from(k))
            .map(|factor| (factor, self.share_off(factor, every)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((1.0, plain));
        if least < plain - CLEARLY { best } else { 1.0 }
    }

    /// The share of the view where lengths are off, told by one facet in so many.
    fn share_off(&self, factor: f64, every: usize) -> f64 {
        let area = |off: bool| -> f64 {
            let facets =
                (self.facets.iter().step_by(every)).filter(|f| !off || f.departure(factor) > KEPT);
            facets.map(|f| f.area).sum()
        };
        area(true) / area(false).max(f64::MIN_POSITIVE)
    }

    /// What the view does to lengths, with a factor on those around.
    pub fn stretch(&self, factor: f64) -> Stretch {
        let mut facets = vec![0.0; self.count];
        for facet in &self.facets {
            facets[facet.number] = facet.departure(factor);
        }
        let mut order: Vec<&StretchFacet> = self.facets.iter().collect();
        order.sort_by(|a, b| facets[a.number].total_cmp(&facets[b.number]));
        let all: f64 = order.iter().map(|f| f.area).sum();
        let mut below = 0.0;
        let most = order.iter().find(|f| {
            below += f.area;
            below >= 0.95 * all
        });
        Stretch {
            most: most.map_or(0.0, |f| facets[f.number]),
            off: self.share_off(factor, 1),
            facets,
        }
    }
}

/// Whether the middle of a triangle laid flat is the first thing met from above.
fn is_on_top(number: u32, flat: [DVec3; 3], high: f64, index: &SurfaceIndex) -> bool {
    let [a, b, c] = flat;
    let above = 2.0 * high.abs() + a.distance(b) + a.distance(c);
    let middle = (a + b + c) / 3.0;
    let eye = middle.truncate().extend(middle.z.max(high) + above);
    (index.ray(eye, DVec3::NEG_Z)).is_some_and(|(at, _)| at.triangle == number)
}

impl StretchFacet {
    fn of(number: usize, [a, b, c]: [DVec3; 3], flat: [DVec3; 3]) -> Self {
        let [p, q, r] = flat.map(DVec3::truncate);
        let (u, v): (DVec2, DVec2) = (q - p, r - p);
        let (d, e) = (b - a, c - a);
        Self {
            number,
            area: u.perp_dot(v).abs() / 2.0,
            space: [d.dot(d), d.dot(e), e.dot(e)],
            around: [u.x * u.x, u.x * v.x, v.x * v.x],
            along: [u.y * u.y, u.y * v.y, v.y * v.y],
        }
    }

    /// The largest share that a length on it is off by: its principal stretches against 1.
    fn departure(&self, factor: f64) -> f64 {
        let flat: [f64; 3] =
            std::array::from_fn(|k| factor * factor * self.around[k] + self.along[k]);
        let determinant = |[aa, ab, bb]: Gram| (aa * bb - ab * ab).max(0.0);
        let [aa, ab, bb] = self.space;
        let scale = determinant(self.space);
        if scale <= 1e-12 * aa * bb {
            return 0.0; // a sliver: it has no area to be seen
        }
        // Half the sum of the squared stretches, and their product.
        let mean = (flat[0] * bb + flat[2] * aa - 2.0 * flat[1] * ab) / (2.0 * scale);
        let product = determinant(flat) / scale;
        let largest = mean + (mean * mean - product).max(0.0).sqrt();
        let least = product / largest.max(f64::MIN_POSITIVE);
        (largest.sqrt() - 1.0).max(1.0 - least.sqrt())
    }
}

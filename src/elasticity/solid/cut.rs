//! How much material a cell holds, and where: its moments.
//!
//! A box is halved along all sides until the distance to the surface is as good as linear in it; then it is cut
//! by the plane that the distances at its corners say (marching tetrahedra). Flat walls come
//! out exactly however they cross, round ones to the tolerance. All integrals that a stiffness needs follow from
//! the moments of the material against products of Legendre polynomials.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::lagrange::{gauss, legendre};
use crate::mesh::inside::SignedDistance;
use crate::mesh::stance::Stance;

/// A box: lower corner and sides (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Lower corner (m).
    pub lower: DVec3,
    /// Lengths of its sides (m).
    pub sides: DVec3,
}

impl Cell {
    /// Its middle (m).
    #[must_use]
    pub fn centre(&self) -> DVec3 {
        self.lower + self.sides / 2.0
    }

    /// Half its diagonal (m).
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.sides.length() / 2.0
    }

    /// A point in the cell's own coordinates, -1 to 1.
    #[must_use]
    pub fn local(&self, point: DVec3) -> DVec3 {
        (point - self.lower) / self.sides * 2.0 - 1.0
    }
}

/// How finely cells are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutting {
    /// How far the surface may be from where it is taken to be (m).
    pub tolerance: f64,
    /// Times that a cell may be halved.
    pub depth: u32,
}

/// Integrals over the material of a cell of Pᵢ(ξ) Pⱼ(η) Pₖ(ζ), divided by an eighth of the cell's volume:
/// number i + n (j + n k) for degrees below n.
#[derive(Clone, Debug)]
pub struct CellMoments {
    /// n: one more than the highest degree along each axis.
    pub degrees: usize,
    /// n³ integrals.
    pub values: Vec<f64>,
}

impl CellMoments {
    fn none(degrees: usize) -> Self {
        Self {
            degrees,
            values: vec![0.0; degrees.pow(3)],
        }
    }

    /// Share of the cell that is material.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.values[0] / 8.0
    }

    /// Of a cell that is all material.
    #[must_use]
    pub fn full(degrees: usize) -> Self {
        let mut moments = Self::none(degrees);
        moments.values[0] = 8.0;
        moments
    }

    fn add(&mut self, at: DVec3, weight: f64) {
        let n = self.degrees;
        let mut lines = [[0.0; MOST]; 3];
        for (line, x) in lines.iter_mut().zip(at.to_array()) {
            legendre(x, &mut line[..n]);
        }
        self.add_product(&lines, weight);
    }

    /// Adds weight × xᵢ yⱼ zₖ.
    fn add_product(&mut self, [x, y, z]: &[[f64; MOST]; 3], weight: f64) {
        // With the length known, the loops are unrolled: this is where cutting spends its time.
        match self.degrees {
            3 => product::<3>(&mut self.values, x, y, z, weight),
            5 => product::<5>(&mut self.values, x, y, z, weight),
            7 => product::<7>(&mut self.values, x, y, z, weight),
            _ => product::<MOST>(&mut self.values, x, y, z, weight),
        }
    }

    /// Weights at the points of the tensor Gauss rule of `degrees` points a side that give the very same
    /// integrals of all polynomials of these degrees.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        let n = self.degrees;
        let rule = gauss(n);
        // Wᵢₐ = wₐ (2 i + 1) / 2 Pᵢ(xₐ), one side after the other.
        let table: Vec<Vec<f64>> = (rule.iter())
            .map(|&(x, w)| {
                let mut p = vec![0.0; n];
                legendre(x, &mut p);
                p.iter()
                    .enumerate()
                    .map(|(i, p)| w * (2 * i + 1) as f64 / 2.0 * p)
                    .collect()
            })
            .collect();
        let mut values = self.values.clone();
        for _ in 0..3 {
            // Contract the fastest index and append it as the slowest: after three turns all are back.
            let mut turned = vec![0.0; values.len()];
            let rest = n * n;
            for r in 0..rest {
                for (a, row) in table.iter().enumerate() {
                    let sum = (0..n).map(|i| row[i] * values[r * n + i]).sum();
                    turned[a * rest + r] = sum;
                }
            }
            values = turned;
        }
        values
    }
}

/// Degrees of the highest order.
const MOST: usize = 2 * super::lagrange::HIGHEST + 1;

fn product<const N: usize>(
    into: &mut [f64],
    x: &[f64; MOST],
    y: &[f64; MOST],
    z: &[f64; MOST],
    weight: f64,
) {
    let x: [f64; N] = std::array::from_fn(|i| x[i]);
    for (plane, z) in into.chunks_exact_mut(N * N).zip(&z[..N]) {
        for (row, y) in plane.chunks_exact_mut(N).zip(&y[..N]) {
            let w = weight * y * z;
            for i in 0..N {
                row[i] += w * x[i];
            }
        }
    }
}

/// Rules on a tetrahedron with corners 0, x, y, z of the unit kind, by points a side.
struct CutRules {
    /// Along a side of a box.
    line: Vec<(f64, f64)>,
    /// By depth: coarser where the pieces are small.
    tetrahedra: Vec<Vec<(DVec3, f64)>>,
}

impl CutRules {
    fn new(order: usize) -> Self {
        let mut tetrahedra: Vec<_> = [order + 2, order + 1].map(conical).into();
        tetrahedra.push(QUADRATIC.map(|p| (DVec3::from_array(p), 1.0 / 24.0)).into());
        Self {
            line: gauss(order + 1),
            tetrahedra,
        }
    }

    fn tetrahedron(&self, depth: u32) -> &[(DVec3, f64)] {
        &self.tetrahedra[(depth as usize).min(self.tetrahedra.len() - 1)]
    }
}

/// Points of the rule that is exact for degree 2, of equal weights.
const QUADRATIC: [[f64; 3]; 4] = {
    const A: f64 = 0.138_196_601_125_010_5;
    const B: f64 = 0.585_410_196_624_968_5;
    [[A, A, A], [B, A, A], [A, B, A], [A, A, B]]
};

/// A product rule folded onto the tetrahedron, exact for degree 2 n - 3 and better; weights sum to 1/6.
fn conical(n: usize) -> Vec<(DVec3, f64)> {
    let rule: Vec<(f64, f64)> = (gauss(n).into_iter())
        .map(|(x, w)| (f64::midpoint(x, 1.0), w / 2.0))
        .collect();
    let mut points = Vec::with_capacity(n * n * n);
    for &(a, wa) in &rule {
        for &(b, wb) in &rule {
            for &(c, wc) in &rule {
                let x = a;
                let y = b * (1.0 - a);
                let z = c * (1.0 - a) * (1.0 - b);
                let jacobian = (1.0 - a).powi(2) * (1.0 - b);
                points.push((DVec3::new(x, y, z), wa * wb * wc * jacobian));
            }
        }
    }
    points
}

/// Cuts cells for shape functions of one order.
pub struct CellCutter<'s> {
    surface: &'s SignedDistance,
    /// Along which cells stand.
    stance: Stance,
    cutting: Cutting,
    rules: CutRules,
    degrees: usize,
}

impl<'s> CellCutter<'s> {
    /// For elements of this order that stand so, cut by this surface.
    #[must_use]
    pub fn new(
        surface: &'s SignedDistance,
        stance: Stance,
        cutting: Cutting,
        order: usize,
    ) -> Self {
        Self {
            surface,
            stance,
            cutting,
            rules: CutRules::new(order),
            degrees: 2 * order + 1,
        }
    }

    /// The moments of a cell's material.
    #[must_use]
    pub fn moments(&self, cell: &Cell) -> CellMoments {
        let mut work = CutCell {
            cutter: self,
            cell,
            known: FxHashMap::default(),
            moments: CellMoments::none(self.degrees),
        };
        work.visit([0; 3], 0, None);
        work.moments
    }
}

/// A cell under the knife. Places are lattice numbers: halves of the smallest box.
struct CutCell<'c> {
    cutter: &'c CellCutter<'c>,
    cell: &'c Cell,
    known: FxHashMap<[u32; 3], f64>,
    moments: CellMoments,
}

/// Corners of a box in halves of its sides, and the middles of its faces with their corners.
const CORNERS: [[u32; 3]; 8] = [
    [0, 0, 0],
    [2, 0, 0],
    [0, 2, 0],
    [2, 2, 0],
    [0, 0, 2],
    [2, 0, 2],
    [0, 2, 2],
    [2, 2, 2],
];
const FACES: [([u32; 3], [usize; 4]); 6] = [
    ([0, 1, 1], [0, 2, 6, 4]),
    ([2, 1, 1], [1, 3, 7, 5]),
    ([1, 0, 1], [0, 1, 5, 4]),
    ([1, 2, 1], [2, 3, 7, 6]),
    ([1, 1, 0], [0, 1, 3, 2]),
    ([1, 1, 2], [4, 5, 7, 6]),
];

/// A box in six tetrahedra around its diagonal (H. Kuhn 1960), by its corners.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 1, 5, 7],
    [0, 2, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 4, 6, 7],
];

impl CutCell<'_> {
    fn finest(&self) -> u32 {
        2 << self.cutter.cutting.depth
    }

    fn point(&self, at: [u32; 3]) -> DVec3 {
        let whole = f64::from(self.finest());
        self.cell.lower + self.cell.sides * DVec3::from_array(at.map(|i| f64::from(i) / whole))
    }

    /// Signed distance (m), with what is known of the triangles near there.
    fn distance(&mut self, at: [u32; 3], nearby: Option<&[u32]>) -> f64 {
        if let Some(&known) = self.known.get(&at) {
            return known;
        }
        let place = self.cutter.stance.place(self.point(at));
        let signed = self.cutter.surface.among(nearby, place);
        self.known.insert(at, signed);
        signed
    }

    /// The triangles that can be nearest within a box, by its middle, how far its corners are from that and how far the
    /// surface is (m), of those that can be near it; nothing where they are few already, or too many for a list.
    fn narrow(
        &self,
        middle: [u32; 3],
        reach: f64,
        distance: f64,
        nearby: Option<&[u32]>,
    ) -> Option<Vec<u32>> {
        /// So few are not worth a look for fewer.
        const FEW: usize = 2;
        if nearby.is_some_and(|triangles| triangles.len() <= FEW) {
            return None;
        }
        let centre = self.cutter.stance.place(self.point(middle));
        (self.cutter.surface).nearby(nearby, (centre, reach), distance)
    }

    fn visit(&mut self, lower: [u32; 3], depth: u32, nearby: Option<&[u32]>) {
        let side = self.finest() >> depth;
        let half = side / 2;
        let place = |offset: [u32; 3]| std::array::from_fn(|i| lower[i] + offset[i] * half);
        let reach = self.cell.reach() / f64::from(1 << depth);
        let centre = self.distance(place([1; 3]), nearby);
        if centre.abs() >= reach {
            if centre < 0.0 {
                self.whole(lower, side);
            }
            return;
        }
        let narrowed = self.narrow(place([1; 3]), reach, centre, nearby);
        let nearby = narrowed.as_deref().or(nearby);
        let corners = CORNERS.map(|c| self.distance(place(c), nearby));
        let faces = FACES.map(|(middle, _)| self.distance(place(middle), nearby));
        let all = corners.iter().chain(&faces).chain([&centre]);
        // No point of the box is farther than half its longest side from all of these: none lies across.
        let covered = self.cell.sides.max_element() / f64::from(2 << depth);
        let uniform = all
            .clone()
            .all(|d| (*d < 0.0) == (centre < 0.0) && d.abs() >= covered);
        if uniform {
            if centre < 0.0 {
                self.whole(lower, side);
            }
            return;
        }
        let mean =
            |ring: &[usize]| ring.iter().map(|&c| corners[c]).sum::<f64>() / ring.len() as f64;
        let off = (FACES.iter().zip(faces))
            .map(|((_, ring), middle)| (middle - mean(ring)).abs())
            .fold((centre - mean(&[0, 1, 2, 3, 4, 5, 6, 7])).abs(), f64::max);
        if off > self.cutter.cutting.tolerance && depth < self.cutter.cutting.depth {
            for child in CORNERS {
                self.visit(
                    std::array::from_fn(|i| lower[i] + child[i] / 2 * half),
                    depth + 1,
                    nearby,
                );
            }
            return;
        }
        if all.clone().all(|&d| d <= 0.0) {
            self.whole(lower, side);
        } else if all.clone().any(|&d| d < 0.0) {
            self.cut(lower, half, depth, corners);
        }
    }

    fn local(&self, at: [u32; 3]) -> DVec3 {
        let whole = f64::from(self.finest());
        DVec3::from_array(at.map(|i| f64::from(i) / whole)) * 2.0 - 1.0
    }

    fn whole(&mut self, lower: [u32; 3], side: u32) {
        let cutter = self.cutter;
        let from = self.local(lower);
        let half = f64::from(side) / f64::from(self.finest());
        if side == self.finest() {
            self.moments = CellMoments::full(cutter.degrees);
            return;
        }
        // A product of integrals along the three sides.
        let mut lines = [[0.0; MOST]; 3];
        for (line, from) in lines.iter_mut().zip(from.to_array()) {
            for &(x, weight) in &cutter.rules.line {
                let mut p = [0.0; MOST];
                legendre(from + (x + 1.0) * half, &mut p[..cutter.degrees]);
                for (sum, p) in line.iter_mut().zip(p) {
                    *sum += weight * half * p;
                }
            }
        }
        self.moments.add_product(&lines, 1.0);
    }

    fn cut(&mut self, lower: [u32; 3], half: u32, depth: u32, corners: [f64; 8]) {
        let points = CORNERS.map(|c| self.local(std::array::from_fn(|i| lower[i] + c[i] * half)));
        for tetrahedron in TETRAHEDRA {
            self.tetrahedron(
                tetrahedron.map(|c| points[c]),
                tetrahedron.map(|c| corners[c]),
                depth,
            );
        }
    }

    /// Adds the part of a tetrahedron in which the linear function is negative.
    fn tetrahedron(&mut self, points: [DVec3; 4], values: [f64; 4], depth: u32) {
        let negative: Vec<usize> = (0..4).filter(|&i| values[i] < 0.0).collect();
        let positive: Vec<usize> = (0..4).filter(|&i| values[i] >= 0.0).collect();
        // Where the function is zero between a negative and a positive corner.
        let zero =
            |i: usize, j: usize| points[i].lerp(points[j], values[i] / (values[i] - values[j]));
        // Only ever added up, never taken away: a sum of positive weights keeps every stiffness positive.
        match (&negative[..], &positive[..]) {
            ([], _) => {}
            (_, []) => self.piece(points, depth),
            (&[i], &[a, b, c]) => {
                self.piece([points[i], zero(i, a), zero(i, b), zero(i, c)], depth);
            }
            (&[a, b, c], &[i]) => self.wedge(
                [points[a], points[b], points[c]],
                [zero(a, i), zero(b, i), zero(c, i)],
                depth,
            ),
            (&[i, j], &[a, b]) => self.wedge(
                [points[i], zero(i, a), zero(i, b)],
                [points[j], zero(j, a), zero(j, b)],
                depth,
            ),
            _ => {}
        }
    }

    /// The wedge between two triangles.
    fn wedge(&mut self, [a, b, c]: [DVec3; 3], [d, e, f]: [DVec3; 3], depth: u32) {
        self.piece([a, b, c, d], depth);
        self.piece([b, c, d, e], depth);
        self.piece([c, d, e, f], depth);
    }

    fn piece(&mut self, [a, b, c, d]: [DVec3; 4], depth: u32) {
        let (x, y, z) = (b - a, c - a, d - a);
        let volume = x.cross(y).dot(z).abs();
        if volume == 0.0 {
            return;
        }
        let cutter = self.cutter;
        for &(at, weight) in cutter.rules.tetrahedron(depth) {
            self.moments
                .add(a + x * at.x + y * at.y + z * at.z, weight * volume);
        }
    }
}

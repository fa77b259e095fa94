//! The shell of a barrel laid flat: rims of rectangles, and between them a lattice of triangles around windows.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use glam::DVec2;

use super::barrel_spec::BarrelSpec;
use super::body::{AROUND, CORNERS};

/// Cells from the lower to the upper end of a rim: those that a rod grows from, and one on either side.
const RIM_LEVELS: isize = 4;

/// Which rim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rim {
    Low,
    High,
}

/// Where a rod grows from a rim.
pub(super) struct Foot {
    /// Points around it, as the rod's section takes them in.
    pub around: [usize; CORNERS],
    /// The cells that are open there.
    pub cells: [usize; 4],
}

/// Points (s around, y up, mm) and quadrilaterals, anticlockwise as seen from outside. Places that triangles and rims
/// share are counted in half steps around and in levels up, so that they are the same point by their numbers.
pub(super) struct LimbLattice {
    pub points: Vec<DVec2>,
    pub quads: Vec<[u32; 4]>,
    named: BTreeMap<(isize, isize), u32>,
    /// Steps along a side of a triangle; even, so that the apex lies on the next row's steps.
    side: isize,
    /// Steps all around.
    pub columns: isize,
    /// Levels between the rims.
    levels: isize,
    /// Length of half a step around.
    half: f64,
    rim: f64,
    height: f64,
}

impl LimbLattice {
    /// The points and quadrilaterals of a whole barrel.
    pub fn new(spec: &BarrelSpec) -> Self {
        let pitch = spec.pitch();
        let side = 2 * (steps(pitch, 2.0 * spec.element) as isize).max(2);
        let mut lattice = Self {
            points: Vec::new(),
            quads: Vec::new(),
            named: BTreeMap::new(),
            side,
            columns: spec.around as isize * side,
            levels: spec.rows as isize * side,
            half: pitch / (2 * side) as f64,
            rim: spec.rim,
            height: spec.height,
        };
        lattice.add_rim(-RIM_LEVELS);
        lattice.add_rim(lattice.levels);
        for row in 0..spec.rows as isize {
            for k in 0..spec.around as isize {
                for corners in lattice.pair(row, k) {
                    lattice.add_triangle(corners, spec);
                }
            }
        }
        lattice
    }

    /// The angle about the axis at a step around.
    pub fn angle(&self, column: isize) -> f64 {
        TAU * column as f64 / self.columns as f64
    }

    /// The foot of a rod about a step around, in the middle of a rim.
    pub fn foot(&self, column: isize, end: Rim) -> Foot {
        // The rod comes towards whoever looks from the axis at the lower rim, and arrives at the upper one.
        let (first, level, up) = match end {
            Rim::Low => (0, -RIM_LEVELS / 2, -1),
            Rim::High => (RIM_LEVELS * self.columns, self.levels + RIM_LEVELS / 2, 1),
        };
        let around = AROUND.map(|(i, j)| {
            let u = 2 * (column + i);
            self.named[&(u.rem_euclid(2 * self.columns), level + up * j)] as usize
        });
        let cells = [(-1, -1), (0, -1), (-1, 0), (0, 0)].map(|(i, j)| {
            let row = RIM_LEVELS / 2 + j;
            (first + row * self.columns + (column + i).rem_euclid(self.columns)) as usize
        });
        Foot { around, cells }
    }

    /// The upright and the hanging triangle of a place in a row, anticlockwise.
    fn pair(&self, row: isize, k: isize) -> [[(isize, isize); 3]; 2] {
        let n = self.side;
        let (u, v) = (2 * n * k + n * (row % 2), n * row);
        [
            [(u, v), (u + 2 * n, v), (u + n, v + n)],
            [(u + 2 * n, v), (u + 3 * n, v + n), (u + n, v + n)],
        ]
    }

    fn height_at(&self, v: isize) -> f64 {
        let share = |levels: isize| levels as f64 / RIM_LEVELS as f64;
        if v < 0 {
            self.rim * (1.0 + share(v))
        } else if v > self.levels {
            self.height - self.rim * (1.0 - share(v - self.levels))
        } else {
            self.rim + (self.height - 2.0 * self.rim) * v as f64 / self.levels as f64
        }
    }

    fn position(&self, (u, v): (isize, isize)) -> DVec2 {
        DVec2::new(u as f64 * self.half, self.height_at(v))
    }

    fn add(&mut self, point: DVec2) -> u32 {
        self.points.push(point);
        (self.points.len() - 1) as u32
    }

    /// The point at a place, which is made when it is first asked for.
    fn node(&mut self, (u, v): (isize, isize)) -> u32 {
        let place = (u.rem_euclid(2 * self.columns), v);
        if let Some(&known) = self.named.get(&place) {
            return known;
        }
        let made = self.add(self.position(place));
        self.named.insert(place, made);
        made
    }

    fn add_rim(&mut self, lowest: isize) {
        for v in lowest..lowest + RIM_LEVELS {
            for u in (0..self.columns).map(|i| 2 * i) {
                let places = [(u, v), (u + 2, v), (u + 2, v + 1), (u, v + 1)];
                let corners = places.map(|place| self.node(place));
                self.quads.push(corners);
            }
        }
    }

    /// Belts of quadrilaterals from the sides of a triangle to its window.
    fn add_triangle(&mut self, corners: [(isize, isize); 3], spec: &BarrelSpec) {
        let sides = self.along_sides(corners);
        let places: Vec<DVec2> = sides.iter().map(|&p| self.position(p)).collect();
        let window = window(corners.map(|p| self.position(p)), spec, self.side as usize);
        let belts = steps(spec.bar, spec.element);
        let mut before: Vec<u32> = sides.iter().map(|&p| self.node(p)).collect();
        for belt in 1..=belts {
            let share = belt as f64 / belts as f64;
            let ring: Vec<u32> = (places.iter().zip(&window))
                .map(|(&from, &to)| self.add(from.lerp(to, share)))
                .collect();
            for i in 0..ring.len() {
                let next = (i + 1) % ring.len();
                self.quads
                    .push([before[i], before[next], ring[next], ring[i]]);
            }
            before = ring;
        }
    }

    /// Every step along the three sides.
    fn along_sides(&self, corners: [(isize, isize); 3]) -> Vec<(isize, isize)> {
        let mut along = Vec::new();
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let step = ((to.0 - from.0) / self.side, (to.1 - from.1) / self.side);
            along.extend((0..self.side).map(|j| (from.0 + j * step.0, from.1 + j * step.1)));
        }
        along
    }
}

/// As few equal steps as keep each at most `longest`.
pub(super) fn steps(length: f64, longest: f64) -> usize {
    (length / longest - 1e-9).ceil().max(1.0) as usize
}

/// Centre and radius of the circle that touches the three sides.
pub(super) fn incircle([a, b, c]: [DVec2; 3]) -> (DVec2, f64) {
    let opposite = [b.distance(c), c.distance(a), a.distance(b)];
    let around: f64 = opposite.iter().sum();
    let centre = (opposite[0] * a + opposite[1] * b + opposite[2] * c) / around;
    (centre, (b - a).perp_dot(c - a) / around)
}

/// The window of a triangle: half a bar from its sides, with round corners. As many points a side as are asked for,
/// evenly from the middle of one corner on towards the next.
fn window(triangle: [DVec2; 3], spec: &BarrelSpec, points: usize) -> Vec<DVec2> {
    let (centre, inside) = incircle(triangle);
    let radius = spec.corner_radius;
    // The centres of the corners' circles.
    let share = (inside - spec.bar / 2.0 - radius) / inside;
    let core = triangle.map(|corner| centre.lerp(corner, share));
    let mut outline = Vec::with_capacity(3 * points);
    for k in 0..3 {
        let (from, to) = (core[k], core[(k + 1) % 3]);
        let along = (to - from).normalize();
        let out = -along.perp();
        // Half of each corner's arc belongs to this side.
        let turn = |corner: DVec2| {
            (corner - centre)
                .normalize()
                .dot(out)
                .clamp(-1.0, 1.0)
                .acos()
        };
        let [first, last] = [turn(from), turn(to)].map(|angle| radius * angle);
        let straight = from.distance(to);
        let length = first + straight + last;
        outline.extend((0..points).map(|j| {
            let at = length * j as f64 / points as f64;
            let on_arc = |centre: DVec2, angle: f64| {
                centre + radius * (angle.cos() * out + angle.sin() * along)
            };
            if at < first {
                on_arc(from, (at - first) / radius)
            } else if at <= first + straight {
                from + (at - first) * along + radius * out
            } else {
                on_arc(to, (at - first - straight) / radius)
            }
        }));
    }
    outline
}

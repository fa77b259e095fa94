//! The families of limbs that the bundled ones belong to: a lattice tube of columns and hoops, and a barrel of
//! triangles with a frame inside ([`barrel`]).
//!
//! The tube is written in unrolled coordinates (s around, z up, in mm here, as a designer would state them) and
//! bent into a tube. The bundled limb was chosen by measurement among thirty of these.

use glam::{DVec2, DVec3};

use crate::bounds::Bounds;
use crate::mesh::TriMesh;

pub mod barrel;
mod barrel_spec;
mod body;
mod frame;
mod lattice;

/// Parameters of a lattice limb. Lengths in millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct LimbSpec {
    /// Unrolled length around the limb. The mid-surface radius is `circumference / (arc in radians)`.
    pub circumference: f64,
    /// Angle the limb covers (degrees); 360 closes the tube.
    pub arc_degrees: f64,
    pub height: f64,
    /// Radius at the top over radius at the bottom.
    pub taper: f64,
    /// Centres of the columns along s.
    pub columns: Vec<f64>,
    pub column_width: f64,
    /// Lower and upper end of each hoop, from the bottom up, touching neither each other nor beyond
    /// the height; the first and last form the rims.
    pub hoops: Vec<(f64, f64)>,
    pub support: LimbSupport,
    /// Radius of the windows' corners; 0 leaves them sharp.
    pub corner_radius: f64,
    /// Largest side of an element.
    pub element: f64,
}

/// How the limb is held.
#[derive(Clone, Debug, PartialEq)]
pub enum LimbSupport {
    /// Bosses of this half-width about each of these s, this tall, at both ends.
    Bosses {
        centres: Vec<f64>,
        half_width: f64,
        depth: f64,
    },
    /// Both rims all round, this deep.
    Rims { depth: f64 },
}

/// Why a limb cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LimbError {
    #[error("{what} must be {rule}, but is {value}")]
    Range {
        what: &'static str,
        rule: &'static str,
        value: f64,
    },
    #[error(
        "hoops must lie one above the other between 0 and the height, with windows between them"
    )]
    Hoops,
    #[error("columns must lie apart from each other around the limb, with windows between them")]
    Columns,
}

impl Default for LimbSpec {
    /// The bundled limb.
    fn default() -> Self {
        Self {
            circumference: 200.0,
            arc_degrees: 360.0,
            height: 120.0,
            taper: 1.0,
            columns: vec![20.0, 70.0, 130.0, 180.0],
            column_width: 12.0,
            hoops: vec![
                (0.0, 10.0),
                (27.0, 37.0),
                (55.0, 65.0),
                (83.0, 93.0),
                (110.0, 120.0),
            ],
            support: LimbSupport::Bosses {
                centres: vec![70.0, 130.0],
                half_width: 6.0,
                depth: 5.0,
            },
            corner_radius: 0.0,
            element: 2.5,
        }
    }
}

/// A rule of one parameter.
fn range(what: &'static str, rule: &'static str, value: f64, holds: bool) -> Result<(), LimbError> {
    if holds && value.is_finite() {
        Ok(())
    } else {
        Err(LimbError::Range { what, rule, value })
    }
}

/// A supported patch, in mm: the box that holds exactly its part of the surface.
pub type BoxMm = [[f64; 3]; 2];

impl LimbSpec {
    /// A regular grid of windows: `columns` equal columns and `hoops` equal hoops, rims included.
    #[must_use]
    pub fn grid(&self, columns: usize, hoops: usize, hoop_width: f64) -> Self {
        let pitch = self.circumference / columns as f64;
        let step = (self.height - hoop_width) / (hoops.max(2) - 1) as f64;
        Self {
            columns: (0..columns).map(|i| (i as f64 + 0.5) * pitch).collect(),
            hoops: (0..hoops)
                .map(|j| (j as f64 * step, j as f64 * step + hoop_width))
                .collect(),
            ..self.clone()
        }
    }

    #[must_use]
    pub fn closed(&self) -> bool {
        self.arc_degrees >= 360.0
    }

    /// Mid-surface radius at the bottom (mm).
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.circumference / self.arc_degrees.to_radians()
    }

    /// The mesh (m) and the boxes of its supports (mm), deterministic.
    ///
    /// # Errors
    /// [`LimbError`] where the parameters do not describe a limb.
    pub fn build(&self) -> Result<(TriMesh, Vec<BoxMm>), LimbError> {
        self.check()?;
        let mut grid = Grid::new(self);
        grid.round_corners(self.corner_radius);
        let positions: Vec<DVec3> = grid.nodes.iter().map(|&p| self.bend(p)).collect();
        // Building through the same checks as any file: a generator is no exception.
        let (mesh, _) =
            TriMesh::new(&positions, &grid.triangles(), 0).map_err(|_| LimbError::Range {
                what: "the element size",
                rule: "above zero and small enough for the columns",
                value: self.element,
            })?;
        Ok((mesh, self.support_boxes()))
    }

    fn check(&self) -> Result<(), LimbError> {
        let positive = "above zero";
        range(
            "the circumference",
            positive,
            self.circumference,
            self.circumference > 0.0,
        )?;
        range("the height", positive, self.height, self.height > 0.0)?;
        range(
            "the taper",
            "between 0.2 and 5",
            self.taper,
            (0.2..=5.0).contains(&self.taper),
        )?;
        range(
            "the arc",
            "between 10 and 360 degrees",
            self.arc_degrees,
            (10.0..=360.0).contains(&self.arc_degrees),
        )?;
        let smallest = self.circumference.max(self.height) / 2000.0;
        range(
            "the element size",
            "at least 1/2000 of the limb",
            self.element,
            self.element >= smallest,
        )?;
        range(
            "the corner radius",
            "zero or more",
            self.corner_radius,
            self.corner_radius >= 0.0,
        )?;
        range(
            "the column width",
            positive,
            self.column_width,
            self.column_width > 0.0,
        )?;
        let stacked = self.hoops.windows(2).all(|w| w[0].1 < w[1].0);
        let proper = self.hoops.iter().all(|h| h.0 < h.1);
        let inside = self.hoops.first().is_some_and(|h| h.0 >= 0.0)
            && self.hoops.last().is_some_and(|h| h.1 <= self.height);
        if !(stacked && proper && inside) {
            return Err(LimbError::Hoops);
        }
        let mut centres = self.columns.clone();
        centres.sort_by(f64::total_cmp);
        let apart = centres.windows(2).all(|w| w[1] - w[0] > self.column_width);
        let within = centres
            .first()
            .is_some_and(|c| c - self.column_width / 2.0 >= 0.0)
            && centres
                .last()
                .is_some_and(|c| c + self.column_width / 2.0 <= self.circumference);
        let narrowest = self.narrowest_window(&centres);
        range(
            "the corner radius",
            "at most half the narrowest window",
            self.corner_radius,
            self.corner_radius <= narrowest / 2.0,
        )?;
        if apart && within {
            Ok(())
        } else {
            Err(LimbError::Columns)
        }
    }

    /// Smallest side of a window, from the columns' centres in rising order.
    fn narrowest_window(&self, centres: &[f64]) -> f64 {
        let between_hoops = self.hoops.windows(2).map(|w| w[1].0 - w[0].1);
        let between_columns = centres.windows(2).map(|w| w[1] - w[0] - self.column_width);
        let across_seam = match (self.closed(), centres) {
            (true, [first, .., last]) => first + self.circumference - last - self.column_width,
            _ => f64::INFINITY,
        };
        between_hoops
            .chain(between_columns)
            .fold(across_seam, f64::min)
    }

    /// (s, z) in mm to a point in metres.
    fn bend(&self, p: DVec2) -> DVec3 {
        let angle = (p.x - self.circumference / 2.0) / self.radius();
        let radius = self.radius() * (1.0 + (self.taper - 1.0) * p.y / self.height);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), p.y) / 1000.0
    }

    /// Unrolled patches (s from, s to, z from, z to) that are held.
    fn support_patches(&self) -> Vec<[f64; 4]> {
        let ends = |depth: f64| [(0.0, depth), (self.height - depth, self.height)];
        match &self.support {
            LimbSupport::Rims { depth } => ends(*depth)
                .iter()
                .map(|&(z0, z1)| [0.0, self.circumference, z0, z1])
                .collect(),
            LimbSupport::Bosses {
                centres,
                half_width,
                depth,
            } => ends(*depth)
                .iter()
                .flat_map(|&(z0, z1)| {
                    centres
                        .iter()
                        .map(move |c| [c - half_width, c + half_width, z0, z1])
                })
                .collect(),
        }
    }

    /// The boxes around the held patches (mm), a hair larger so that rounding keeps the rim inside.
    fn support_boxes(&self) -> Vec<BoxMm> {
        const HAIR: f64 = 0.01;
        self.support_patches()
            .iter()
            .map(|&[s0, s1, z0, z1]| {
                let steps = 360;
                let corners = (0..=steps).flat_map(|i| {
                    let s = s0 + (s1 - s0) * f64::from(i) / f64::from(steps);
                    [z0, z1].map(|z| self.bend(DVec2::new(s, z)) * 1000.0)
                });
                let around = Bounds::around(corners).grown(HAIR);
                let round = |p: DVec3| p.to_array().map(|x| (x * 1000.0).round() / 1000.0);
                [around.lower, around.upper].map(round)
            })
            .collect()
    }
}

/// The structured grid in (s, z): lines through every feature, cells that are material.
struct Grid {
    lines_s: Vec<f64>,
    lines_z: Vec<f64>,
    closed: bool,
    material: Vec<bool>,
    /// Positions in (s, z), row by row, of every grid crossing (some belong to no material).
    nodes: Vec<DVec2>,
    /// Lines of s and z that features pin: nodes on them move only along them.
    fixed_s: Vec<f64>,
    fixed_z: Vec<f64>,
}

impl Grid {
    fn new(spec: &LimbSpec) -> Self {
        let half = spec.column_width / 2.0;
        let mut fixed_s = Vec::new();
        if !spec.closed() {
            fixed_s.extend([0.0, spec.circumference]);
        }
        fixed_s.extend(spec.columns.iter().flat_map(|c| [c - half, c + half]));
        let mut fixed_z = vec![0.0, spec.height];
        fixed_z.extend(spec.hoops.iter().flat_map(|h| [h.0, h.1]));
        for [s0, s1, z0, z1] in spec.support_patches() {
            if !(spec.closed() && s1 - s0 >= spec.circumference) {
                fixed_s.extend([s0, s1]);
            }
            fixed_z.extend([z0, z1]);
        }
        let length = spec.circumference;
        if spec.closed() {
            start_at_a_column(spec, &mut fixed_s);
        }
        let lines_s = subdivide(&mut fixed_s, spec.element);
        let lines_z = subdivide(&mut fixed_z, spec.element);
        let columns = lines_s.len() - 1;
        let in_column = |s: f64| {
            spec.columns.iter().any(|c| {
                let d = (s - c).rem_euclid(length);
                d.min(length - d) < half
            })
        };
        let in_hoop = |z: f64| spec.hoops.iter().any(|h| h.0 < z && z < h.1);
        let material = (0..lines_z.len() - 1)
            .flat_map(|j| {
                let z = f64::midpoint(lines_z[j], lines_z[j + 1]);
                let lines_s = &lines_s;
                (0..columns).map(move |i| {
                    in_hoop(z) || in_column(f64::midpoint(lines_s[i], lines_s[i + 1]))
                })
            })
            .collect();
        let nodes = lines_z
            .iter()
            .flat_map(|&z| lines_s.iter().map(move |&s| DVec2::new(s, z)))
            .collect();
        Self {
            lines_s,
            lines_z,
            closed: spec.closed(),
            material,
            nodes,
            fixed_s,
            fixed_z,
        }
    }

    fn columns(&self) -> usize {
        self.lines_s.len() - 1
    }

    fn around(&self) -> f64 {
        self.lines_s[self.columns()] - self.lines_s[0]
    }

    fn node(&self, i: usize, j: usize) -> usize {
        j * self.lines_s.len() + if self.closed { i % self.columns() } else { i }
    }

    fn is_material(&self, i: isize, j: isize) -> bool {
        let (columns, rows) = (self.columns() as isize, self.lines_z.len() as isize - 1);
        let i = if self.closed {
            i.rem_euclid(columns)
        } else {
            i
        };
        (0..columns).contains(&i)
            && (0..rows).contains(&j)
            && self.material[(j * columns + i) as usize]
    }

    /// Cells split along alternating diagonals, so that the mesh has no preferred hand.
    fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for j in 0..self.lines_z.len() - 1 {
            for i in 0..self.columns() {
                if !self.is_material(i as isize, j as isize) {
                    continue;
                }
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    .map(|(i, j)| self.node(i, j) as u32);
                if (i + j) % 2 == 0 {
                    triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        triangles
    }

    /// Moves the nodes near each window corner onto a quarter circle, then lets the inner nodes settle.
    fn round_corners(&mut self, radius: f64) {
        if radius <= 0.0 {
            return;
        }
        let mut moved = vec![false; self.nodes.len()];
        for j in 0..self.lines_z.len() {
            for i in 0..self.columns() {
                if let Some(inward) = self.window_corner(i, j) {
                    self.round_corner(i, j, inward, radius, &mut moved);
                }
            }
        }
        self.smooth(&moved);
    }

    /// The direction into the window, where exactly one of the four cells around a node is a window.
    fn window_corner(&self, i: usize, j: usize) -> Option<(isize, isize)> {
        let (i, j) = (i as isize, j as isize);
        let cells = [(0, 0), (-1, 0), (0, -1), (-1, -1)];
        let mut empty = cells
            .iter()
            .filter(|(di, dj)| !self.is_material(i + di, j + dj));
        let &(di, dj) = empty.next()?;
        let inside = (0..self.lines_z.len() as isize - 1).contains(&(j + dj))
            && (self.closed || (0..self.columns() as isize).contains(&(i + di)));
        (empty.next().is_none() && inside).then_some((2 * di + 1, 2 * dj + 1))
    }

    fn round_corner(
        &mut self,
        i: usize,
        j: usize,
        (di, dj): (isize, isize),
        radius: f64,
        moved: &mut [bool],
    ) {
        let corner = DVec2::new(self.lines_s[i], self.lines_z[j]);
        let centre = corner + DVec2::new(di as f64, dj as f64) * radius;
        // Along each side the distance 0…r from the corner becomes 45°…0° of the arc.
        let place = |distance: f64, along_s: bool| {
            let angle = (1.0 - distance / radius) * std::f64::consts::FRAC_PI_4;
            let (to, across) = (radius * angle.sin(), radius * angle.cos());
            if along_s {
                DVec2::new(centre.x - di as f64 * to, centre.y - dj as f64 * across)
            } else {
                DVec2::new(centre.x - di as f64 * across, centre.y - dj as f64 * to)
            }
        };
        let n = self.node(i, j);
        self.nodes[n] = place(0.0, true);
        moved[n] = true;
        for along_s in [true, false] {
            for step in 1.. {
                let (a, b) = if along_s {
                    (i as isize + di * step, j as isize)
                } else {
                    (i as isize, j as isize + dj * step)
                };
                let columns = self.columns() as isize;
                let a = if self.closed {
                    a.rem_euclid(columns)
                } else {
                    a
                };
                if !(0..=columns).contains(&a) || !(0..self.lines_z.len() as isize).contains(&b) {
                    break;
                }
                let at = DVec2::new(self.lines_s[a as usize], self.lines_z[b as usize]);
                let away = (at - corner).abs();
                let distance = match along_s {
                    // The seam of a closed limb is one step like any other.
                    true if self.closed => away.x.min(self.around() - away.x),
                    true => away.x,
                    false => away.y,
                };
                if distance >= radius {
                    break;
                }
                let n = self.node(a as usize, b as usize);
                let mut placed = place(distance, along_s);
                if self.closed {
                    // On the side of the seam that the node is kept on.
                    placed.x -= ((placed.x - at.x) / self.around()).round() * self.around();
                }
                self.nodes[n] = placed;
                moved[n] = true;
            }
        }
    }

    /// Laplacian smoothing of nodes inside the material; feature lines and edges stay.
    fn smooth(&mut self, moved: &[bool]) {
        let pinned_s: Vec<bool> = self
            .lines_s
            .iter()
            .map(|s| near(&self.fixed_s, *s))
            .collect();
        let pinned_z: Vec<bool> = self
            .lines_z
            .iter()
            .map(|z| near(&self.fixed_z, *z))
            .collect();
        for _ in 0..20 {
            let before = self.nodes.clone();
            for j in 1..self.lines_z.len() - 1 {
                for i in 1..self.columns() {
                    let n = self.node(i, j);
                    let (ii, jj) = (i as isize, j as isize);
                    let inner = [(0, 0), (-1, 0), (0, -1), (-1, -1)]
                        .iter()
                        .all(|(di, dj)| self.is_material(ii + di, jj + dj));
                    if moved[n] || !inner {
                        continue;
                    }
                    let around = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)];
                    let mean = around
                        .iter()
                        .map(|&(i, j)| before[j * self.lines_s.len() + i])
                        .sum::<DVec2>()
                        / 4.0;
                    if !pinned_s[i] {
                        self.nodes[n].x = mean.x;
                    }
                    if !pinned_z[j] {
                        self.nodes[n].y = mean.y;
                    }
                }
            }
            if self.closed {
                self.copy_seam();
            }
        }
    }

    fn copy_seam(&mut self) {
        let (width, columns) = (self.lines_s.len(), self.columns());
        for j in 0..self.lines_z.len() {
            let first = self.nodes[j * width];
            self.nodes[j * width + columns] =
                first + DVec2::X * (self.lines_s[columns] - self.lines_s[0]);
        }
    }
}

/// For a closed limb the grid starts at a column's edge, so that a window across s = 0 is divided as
/// evenly as the others.
fn start_at_a_column(spec: &LimbSpec, fixed_s: &mut Vec<f64>) {
    let length = spec.circumference;
    let first = spec.columns.iter().copied().fold(f64::INFINITY, f64::min);
    let start = first - spec.column_width / 2.0;
    for s in fixed_s.iter_mut() {
        *s = start + (*s - start + 1e-9).rem_euclid(length) - 1e-9;
    }
    fixed_s.push(start + length);
}

fn near(lines: &[f64], x: f64) -> bool {
    lines.iter().any(|l| (l - x).abs() < 1e-9)
}

/// The lines themselves and as many equal steps between neighbours as keep each at most `element`.
fn subdivide(lines: &mut Vec<f64>, element: f64) -> Vec<f64> {
    lines.sort_by(f64::total_cmp);
    lines.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let mut out = vec![lines[0]];
    for pair in lines.windows(2) {
        let steps = ((pair[1] - pair[0]) / element - 1e-9).ceil().max(1.0) as usize;
        for k in 1..=steps {
            out.push(pair[0] + (pair[1] - pair[0]) * k as f64 / steps as f64);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bundled_limb_has_its_published_size() {
        let (mesh, boxes) = LimbSpec::default().build().unwrap();
        assert_eq!(mesh.positions().len(), 2724);
        // 20 columns' and hoops' worth of the unrolled 200 × 120 mm: 13 360 mm², facets a little less.
        assert!(
            (mesh.area() * 1e6 - 13_360.0).abs() < 15.0,
            "{}",
            mesh.area() * 1e6
        );
        assert_eq!(boxes.len(), 4);
        let finer = LimbSpec {
            element: 2.0,
            ..LimbSpec::default()
        };
        assert_eq!(finer.build().unwrap().0.positions().len(), 4096);
    }

    #[test]
    fn the_surface_faces_outward_and_has_sixteen_windows() {
        let (mesh, _) = LimbSpec::default().build().unwrap();
        for t in 0..mesh.triangles().len() as u32 {
            let middle = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
            assert!(mesh.facet_normal(t).dot(middle.with_z(0.0)) > 0.0);
        }
        let (v, e, f) = (
            mesh.positions().len() as i64,
            mesh.edges().len() as i64,
            mesh.triangles().len() as i64,
        );
        // A tube has Euler characteristic 0; each window takes one away.
        assert_eq!(v - e + f, -16);
    }

    #[test]
    fn the_family_reaches_arcs_tapers_grids_and_round_corners() {
        let open = LimbSpec {
            arc_degrees: 180.0,
            taper: 0.7,
            corner_radius: 4.0,
            support: LimbSupport::Rims { depth: 5.0 },
            ..LimbSpec::default()
        };
        let (mesh, boxes) = open.build().unwrap();
        assert_eq!(boxes.len(), 2);
        assert!(mesh.boundary_edges().count() > 0);
        let fine = LimbSpec {
            element: 1.0,
            ..LimbSpec::default()
        };
        let sharp = fine.build().unwrap().0.area();
        let round = LimbSpec {
            corner_radius: 4.0,
            ..fine
        };
        // Each of the 64 corners gains (1 - π/4) r².
        let gain = 64.0 * (1.0 - std::f64::consts::FRAC_PI_4) * 16.0 * 1e-6;
        let grown = round.build().unwrap().0.area() - sharp;
        // Chords add a little; one corner of the 64 left out would take 1.6 %.
        assert!((grown / gain - 1.0).abs() < 0.03, "{grown} of {gain}");
        let tangled = LimbSpec {
            corner_radius: 9.0,
            ..LimbSpec::default()
        };
        assert!(tangled.build().is_err());
        assert!(LimbSpec::default().grid(6, 4, 8.0).build().is_ok());
    }

    #[test]
    fn impossible_limbs_are_refused() {
        let thin = LimbSpec {
            element: 0.0,
            ..LimbSpec::default()
        };
        assert!(thin.build().is_err());
        let crossed = LimbSpec {
            hoops: vec![(0.0, 30.0), (20.0, 40.0)],
            ..LimbSpec::default()
        };
        assert_eq!(crossed.build().unwrap_err(), LimbError::Hoops);
    }
}

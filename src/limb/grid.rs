//! The structured grid that a lattice limb is made on.

use glam::DVec2;

use super::spec::LimbSpec;

/// The structured grid in (s, z): lines through every feature, cells that are material.
pub(super) struct LimbGrid {
    lines_s: Vec<f64>,
    lines_z: Vec<f64>,
    closed: bool,
    material: Vec<bool>,
    /// Positions in (s, z), row by row, of every grid crossing (some belong to no material).
    pub(super) nodes: Vec<DVec2>,
    /// Lines of s and z that features pin: nodes on them move only along them.
    fixed_s: Vec<f64>,
    fixed_z: Vec<f64>,
}

impl LimbGrid {
    pub(super) fn new(spec: &LimbSpec) -> Self {
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
    pub(super) fn triangles(&self) -> Vec<[u32; 3]> {
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
    pub(super) fn round_corners(&mut self, radius: f64) {
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

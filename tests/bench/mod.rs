//! Published shell problems, each returning computed over reference on an n × n mesh.
#![allow(dead_code, reason = "each test uses its own part of these")]

pub mod hexes;
pub mod round;
pub mod slotted;
pub mod solids;

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::unwatched;
use hapdef::elasticity::{DofSet, Material, ShellModel, ShellSection};
use hapdef::mesh::TriMesh;

/// The diagonal that cells are cut along: benchmark figures depend on it.
#[derive(Clone, Copy)]
pub enum Cut {
    Rising,
    Falling,
}

/// A mapped grid of nu × nv cells.
pub fn grid(nu: usize, nv: usize, cut: Cut, map: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let p: Vec<DVec3> = (0..=nv)
        .flat_map(|j| (0..=nu).map(move |i| (i as f64 / nu as f64, j as f64 / nv as f64)))
        .map(|(u, v)| map(u, v))
        .collect();
    let at = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let t: Vec<[u32; 3]> = (0..nv)
        .flat_map(|j| {
            (0..nu).flat_map(move |i| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                match cut {
                    Cut::Rising => [[a, b, c], [a, c, d]],
                    Cut::Falling => [[a, b, d], [b, c, d]],
                }
            })
        })
        .collect();
    TriMesh::new(&p, &t, 0).unwrap().0
}

pub fn section(e: f64, nu: f64, thickness: f64) -> ShellSection {
    ShellSection {
        material: Material {
            youngs_modulus: e,
            poissons_ratio: nu,
        },
        thickness,
    }
}

fn solve(
    mesh: &TriMesh,
    section: ShellSection,
    held: impl Fn(DVec3) -> u8,
    forces: &[(u32, DVec3)],
) -> Vec<f64> {
    let held: Vec<DofSet> = mesh.positions().iter().map(|&p| DofSet(held(p))).collect();
    let model = ShellModel::new(&Arc::new(mesh.clone()), section, &held, &unwatched).unwrap();
    model.solve(&forces.to_vec())
}

fn vertex_at(mesh: &TriMesh, p: DVec3) -> u32 {
    (0..mesh.positions().len() as u32)
        .min_by(|&a, &b| {
            let d = |v: u32| mesh.positions()[v as usize].distance(p);
            d(a).total_cmp(&d(b))
        })
        .unwrap()
}

fn on(x: f64, y: f64) -> bool {
    (x - y).abs() < 1e-9 * (1.0 + y.abs())
}

fn symmetry(axis: usize) -> u8 {
    DofSet::symmetry(axis).0
}

/// Scordelis–Lo roof, one quarter: vertical displacement at the middle of the free edge, of 0.3024.
pub fn ratio_roof(n: usize) -> f64 {
    let (r, half, phi) = (25.0, 25.0, 40f64.to_radians());
    let mesh = grid(n, n, Cut::Falling, |u, v| {
        let a = phi * u;
        DVec3::new(r * a.sin(), half * v, r * a.cos())
    });
    let mut forces = vec![DVec3::ZERO; mesh.positions().len()];
    for t in 0..mesh.triangles().len() as u32 {
        for v in mesh.triangles()[t as usize] {
            forces[v as usize] -= DVec3::Z * 90.0 * mesh.facet_area(t) / 3.0;
        }
    }
    let forces: Vec<(u32, DVec3)> = forces
        .into_iter()
        .enumerate()
        .map(|(v, f)| (v as u32, f))
        .collect();
    // y = 0: the middle (mirror); y = half: rigid diaphragm, x and z held; x = 0: mirror.
    let u = solve(
        &mesh,
        section(4.32e8, 0.0, 0.25),
        |p| {
            let mut mask = 0;
            if on(p.y, 0.0) {
                mask |= symmetry(1);
            }
            if on(p.x, 0.0) {
                mask |= symmetry(0);
            }
            if on(p.y, half) {
                mask |= DofSet::of(&[0, 2]).0;
            }
            mask
        },
        &forces,
    );
    let corner = vertex_at(&mesh, DVec3::new(r * phi.sin(), 0.0, r * phi.cos()));
    -u[6 * corner as usize + 2] / 0.3024
}

/// Pinched cylinder with end diaphragms, one octant.
pub fn ratio_cylinder(n: usize) -> f64 {
    let (r, half) = (300.0, 300.0);
    let mesh = grid(n, n, Cut::Falling, |u, v| {
        let a = FRAC_PI_2 * u;
        DVec3::new(r * a.sin(), half * v, r * a.cos())
    });
    let top = vertex_at(&mesh, DVec3::new(0.0, 0.0, r));
    let u = solve(
        &mesh,
        section(3e6, 0.3, 3.0),
        |p| {
            let mut mask = 0;
            if on(p.y, 0.0) {
                mask |= symmetry(1);
            }
            if p.x.abs() < 1e-6 {
                mask |= symmetry(0);
            }
            if p.z.abs() < 1e-6 {
                mask |= symmetry(2);
            }
            if on(p.y, half) {
                mask |= DofSet::of(&[0, 2]).0;
            }
            mask
        },
        &[(top, DVec3::NEG_Z * 0.25)],
    );
    -u[6 * top as usize + 2] / 1.8248e-5
}

/// Clamped square plate, centre load, one quarter: 0.00560 P a² / D.
pub fn ratio_plate(n: usize) -> f64 {
    let s = section(1.7472e7, 0.3, 0.01);
    let mesh = grid(n, n, Cut::Rising, |u, v| DVec3::new(u, v, 0.0));
    let centre = vertex_at(&mesh, DVec3::ZERO);
    let u = solve(
        &mesh,
        s,
        |p| {
            let mut mask = 0;
            if on(p.x, 0.0) {
                mask |= symmetry(0);
            }
            if on(p.y, 0.0) {
                mask |= symmetry(1);
            }
            if on(p.x, 1.0) || on(p.y, 1.0) {
                mask |= 63;
            }
            mask
        },
        &[(centre, DVec3::NEG_Z * 0.25)],
    );
    -u[6 * centre as usize + 2] / (0.00560 * 4.0 / s.bending_stiffness())
}

/// Clamped circular plate, centre load, one quarter: P R² / 16 π D. Three blocks of n × n cells.
pub fn ratio_disc(n: usize) -> f64 {
    let (r, s) = (5.0, section(1.7472e7, 0.3, 0.02));
    let mesh = disc(n, r);
    let centre = vertex_at(&mesh, DVec3::ZERO);
    let u = solve(
        &mesh,
        s,
        |p| {
            let mut mask = 0;
            if on(p.x, 0.0) {
                mask |= symmetry(0);
            }
            if on(p.y, 0.0) {
                mask |= symmetry(1);
            }
            if p.length() > r * (1.0 - 1e-9) {
                mask |= 63;
            }
            mask
        },
        &[(centre, DVec3::NEG_Z * 0.25)],
    );
    -u[6 * centre as usize + 2] / (r * r / (16.0 * PI * s.bending_stiffness()))
}

/// A quarter disc of radius r: a square block and two blocks out to the rim, welded exactly.
pub fn disc(n: usize, r: f64) -> TriMesh {
    let inner = 0.5 * r;
    let diagonal = 0.42 * r;
    let corner = [
        DVec3::new(inner, 0.0, 0.0),
        DVec3::new(diagonal, diagonal, 0.0),
        DVec3::new(0.0, inner, 0.0),
    ];
    let core = |u: f64, v: f64| {
        corner[0] * (u * (1.0 - v)) + corner[1] * (u * v) + corner[2] * ((1.0 - u) * v)
    };
    let mut p = Vec::new();
    let mut t = Vec::new();
    let mut block = |map: &dyn Fn(f64, f64) -> DVec3| {
        let base = p.len() as u32;
        let part = grid(n, n, Cut::Rising, map);
        // Round so that the blocks' common sides weld to the bit.
        p.extend(part.positions().iter().map(|q| (*q * 1e9).round() / 1e9));
        t.extend(part.triangles().iter().map(|q| q.map(|v| v + base)));
    };
    block(&core);
    for half in 0..2 {
        block(&|u, v| {
            let side = if half == 0 {
                core(1.0, v)
            } else {
                core(1.0 - v, 1.0)
            };
            let a = (v + f64::from(half)) * PI / 4.0;
            side * (1.0 - u) + DVec3::new(a.cos(), a.sin(), 0.0) * (r * u)
        });
    }
    TriMesh::new(&p, &t, 0).unwrap().0
}

/// Twisted beam, 6n × n cells, a unit load at the free end in each of two directions.
pub fn ratio_twisted(n: usize) -> [f64; 2] {
    let (length, width) = (12.0, 1.1);
    let mesh = grid(6 * n, n, Cut::Falling, |u, v| {
        let a = FRAC_PI_2 * u;
        let y = (v - 0.5) * width;
        DVec3::new(length * u, y * a.cos(), y * a.sin())
    });
    // At the free end the width lies along z.
    [(DVec3::Z, 2, 0.0054245), (DVec3::Y, 1, 0.0017532)].map(|(force, axis, reference)| {
        let tip = vertex_at(&mesh, DVec3::new(length, 0.0, 0.0));
        let u = solve(
            &mesh,
            section(29e6, 0.22, 0.32),
            |p| if on(p.x, 0.0) { 63 } else { 0 },
            &[(tip, force)],
        );
        u[6 * tip as usize + axis] / reference
    })
}

/// Cook's membrane: vertical displacement at the middle of the loaded side, of 23.9655.
pub fn ratio_cook(n: usize) -> f64 {
    let mesh = grid(n, n, Cut::Falling, |u, v| {
        let (bottom, top) = (44.0 * u, 44.0 + 16.0 * u);
        DVec3::new(48.0 * u, bottom + (top - bottom) * v, 0.0)
    });
    let forces: Vec<(u32, DVec3)> = (0..=n)
        .map(|j| {
            let share = if j == 0 || j == n { 0.5 } else { 1.0 } / n as f64;
            ((j * (n + 1) + n) as u32, DVec3::Y * share)
        })
        .collect();
    let u = solve(
        &mesh,
        section(1.0, 1.0 / 3.0, 1.0),
        |p| {
            if on(p.x, 0.0) {
                63
            } else {
                DofSet::of(&[2, 3, 4]).0
            }
        },
        &forces,
    );
    let middle = vertex_at(&mesh, DVec3::new(48.0, 52.0, 0.0));
    u[6 * middle as usize + 1] / 23.9655
}

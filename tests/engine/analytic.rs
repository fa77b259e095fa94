//! The shell element against patch tests, published benchmarks and closed forms.
//!
//! Sources: R. H. `MacNeal` and R. L. Harder, "A proposed standard set of problems to test finite element
//! accuracy" (1985); T. Belytschko et al., "Stress projection for membrane and shear locking in shell
//! finite elements" (1985), the obstacle course; S. Timoshenko and S. Woinowsky-Krieger, "Theory of
//! Plates and Shells". Ratios that the same pair of elements reaches on the same meshes are known; each
//! must be at least as near to one, to 0.01.

use crate::bench;

use bench::{ratio_cook, ratio_cylinder, ratio_disc, ratio_plate, ratio_roof, ratio_twisted};
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::unwatched;
use hapdef::elasticity::element::Facet;
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::{DofSet, Material, Model, ShellModel, ShellSection};
use hapdef::mesh::{SurfacePoint, TriMesh};

fn near(name: &str, computed: f64, known: f64) {
    println!("{name}: {computed:.4} (known {known:.3})");
    assert!(
        (computed - 1.0).abs() <= (known - 1.0).abs() + 0.01,
        "{name}: {computed:.4}, known {known:.3}"
    );
}

/// `MacNeal` and Harder's patch: exact displacements given on the rim; the inner nodes must follow.
fn patch(field: impl Fn(DVec3) -> [f64; 6]) -> (TriMesh, ShellSection, f64, f64) {
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let p = [
        at(0.0, 0.0),
        at(0.24, 0.0),
        at(0.24, 0.12),
        at(0.0, 0.12),
        at(0.04, 0.02),
        at(0.18, 0.03),
        at(0.16, 0.08),
        at(0.08, 0.08),
    ];
    let quads = [
        [0, 1, 5, 4],
        [1, 2, 6, 5],
        [2, 3, 7, 6],
        [3, 0, 4, 7],
        [4, 5, 6, 7],
    ];
    let t: Vec<[u32; 3]> = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let mesh = TriMesh::new(&p, &t, 0).unwrap().0;
    let section = ShellSection {
        material: Material {
            youngs_modulus: 1e6,
            poissons_ratio: 0.25,
        },
        thickness: 1e-3,
    };
    // Rim degrees of freedom are given, so the inner ones balance K_ii u_i = -K_ir u_r: solve it densely.
    let n = 48;
    let mut k = nalgebra::DMatrix::<f64>::zeros(n, n);
    for (t, tri) in mesh.triangles().iter().enumerate() {
        let element = Facet::new(mesh.corners(t as u32), &section).stiffness(&section);
        for i in 0..18 {
            for j in 0..18 {
                let place = |f: usize| 6 * tri[f / 6] as usize + f % 6;
                k[(place(i), place(j))] += element[(i, j)];
            }
        }
    }
    let exact: Vec<f64> = mesh.positions().iter().flat_map(|&p| field(p)).collect();
    let rim = nalgebra::DVector::from_column_slice(&exact[..24]);
    let right = -k.view((24, 0), (24, 24)) * &rim;
    let inner = k
        .view((24, 24), (24, 24))
        .into_owned()
        .lu()
        .solve(&right)
        .unwrap();
    let scale = exact.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let error = (0..24)
        .map(|i| (inner[i] - exact[24 + i]).abs())
        .fold(0.0, f64::max);
    let u = nalgebra::DVector::from_iterator(48, rim.iter().chain(inner.iter()).copied());
    let energy = 0.5 * (u.transpose() * &k * &u)[(0, 0)];
    (mesh, section, error / scale, energy)
}

#[test]
fn membrane_patch_is_exact() {
    let (_, _, error, energy) = patch(|p| {
        let (x, y) = (p.x, p.y);
        [
            1e-3 * (x + y / 2.0),
            1e-3 * (y + x / 2.0),
            0.0,
            0.0,
            0.0,
            0.0,
        ]
    });
    assert!(error < 1e-12, "{error}");
    // ½ ∫ ε:D:ε t dA with ε = 1e-3 (1, 1, 1) over 0.24 × 0.12 at t = 1e-3, by hand.
    let by_hand = 0.5 * 1e-6 * (1e6 / (1.0 - 0.0625)) * (2.0 + 2.0 * 0.25 + 0.375) * 1e-3 * 0.0288;
    assert!((energy / by_hand - 1.0).abs() < 1e-10, "{energy} {by_hand}");
}

#[test]
fn bending_patch_is_exact() {
    let (_, _, error, energy) = patch(|p| {
        let (x, y) = (p.x, p.y);
        let w = 1e-3 * (x * x + x * y + y * y) / 2.0;
        let (wx, wy) = (1e-3 * (x + y / 2.0), 1e-3 * (y + x / 2.0));
        // Thin: the fibres stay normal, θ = (w,y, -w,x).
        [0.0, 0.0, w, wy, -wx, 0.0]
    });
    assert!(error < 1e-9, "{error}");
    assert!((energy / 3.68e-12 - 1.0).abs() < 1e-3, "{energy:e}");
}

#[test]
fn scordelis_lo_roof() {
    for (n, known) in [(4, 1.086), (8, 1.015), (16, 0.999)] {
        near(&format!("Scordelis–Lo roof, {n}"), ratio_roof(n), known);
    }
}

#[test]
fn pinched_cylinder() {
    for (n, known) in [(4, 0.630), (8, 0.934), (16, 1.020)] {
        near(&format!("pinched cylinder, {n}"), ratio_cylinder(n), known);
    }
}

#[test]
fn clamped_square_plate() {
    for (n, known) in [(4, 1.020), (8, 1.008), (16, 1.004)] {
        near(&format!("clamped square plate, {n}"), ratio_plate(n), known);
    }
}

#[test]
fn clamped_circular_plate() {
    for (n, known) in [(4, 1.003), (8, 1.001)] {
        near(
            &format!("clamped circular plate, {n}"),
            ratio_disc(n),
            known,
        );
    }
}

#[test]
fn twisted_beam() {
    for (n, known) in [(2, 0.995), (4, 0.997)] {
        let [first, second] = ratio_twisted(n);
        near(&format!("twisted beam, in plane, {n}"), first, known);
        near(&format!("twisted beam, out of plane, {n}"), second, known);
    }
}

#[test]
fn cooks_membrane() {
    for (n, known) in [(4, 0.857), (8, 0.937), (16, 0.975)] {
        near(&format!("Cook's membrane, {n}"), ratio_cook(n), known);
    }
}

/// A cantilever strip under an end load: ε = 6 F (L - x) / E b t² on the face, at the middle.
#[test]
fn strain_on_the_faces_of_a_clamped_beam() {
    let (length, width, t, e) = (0.1, 0.01, 1e-3, 1e9);
    let mesh = bench::grid(40, 4, bench::Cut::Rising, |u, v| {
        DVec3::new(u * length, v * width, 0.0)
    });
    let section = ShellSection {
        material: Material {
            youngs_modulus: e,
            poissons_ratio: 0.0,
        },
        thickness: t,
    };
    let held: Vec<DofSet> = mesh
        .positions()
        .iter()
        .map(|p| {
            if p.x < 1e-9 {
                DofSet::ALL
            } else {
                DofSet::default()
            }
        })
        .collect();
    let model = ShellModel::new(&Arc::new(mesh.clone()), section, &held, &unwatched).unwrap();
    let end: Vec<u32> = (0..mesh.positions().len() as u32)
        .filter(|&v| mesh.positions()[v as usize].x > length - 1e-9)
        .collect();
    let share = |v: u32| {
        if [0.0, width].contains(&mesh.positions()[v as usize].y) {
            0.125
        } else {
            0.25
        }
    };
    let forces = end.iter().map(|&v| (v, DVec3::NEG_Z * share(v))).collect();
    let u = model.solve(&forces);
    let middle = model.mesh.index().nearest(DVec3::new(0.051, 0.0052, 0.0)).0;
    let at: [SurfacePoint; 1] = [middle];
    let expected = 6.0 * (length - mesh.point(middle).x) / (e * width * t * t);
    for (face, sign) in [(Face::Outside, 1.0), (Face::Inside, -1.0)] {
        let observer = model.observer(&at, face);
        let frame = observer.frames()[0];
        let [xx, yy, xy] = observer.strain_of(&model, &u)[0];
        let along = DVec3::X;
        let (c, s) = (along.dot(frame.x_axis), along.dot(frame.y_axis));
        let strain = xx * c * c + yy * s * s + xy * c * s;
        assert!(
            (strain / (sign * expected) - 1.0).abs() < 0.01,
            "{strain:e} against {expected:e}"
        );
    }
    let check = model.check(&forces, &u);
    assert!(
        check.reaction_error < 1e-8 && check.energy_error < 1e-8,
        "{check:?}"
    );
}

//! How fast the shell converges, in displacement and in the strain of its inner face; and whether what it
//! says about its own error is true.

use crate::bench;

use std::sync::Arc;

use bench::round::{Disc, aim, strain_error};
use bench::{Cut, grid, section};
use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::elasticity::linearity::linearity;
use hapdef::elasticity::{DofSet, ShellModel, Touch};
use hapdef::mesh::TriMesh;

/// Observed order from three meshes of which each halves the last: log₂ of successive changes.
fn order(values: [f64; 3]) -> f64 {
    ((values[1] - values[0]) / (values[2] - values[1]))
        .abs()
        .log2()
}

#[test]
fn displacements_converge_with_the_square_of_the_element_size() {
    type Case = (&'static str, fn(usize) -> f64, usize, f64);
    let cases: [Case; 6] = [
        ("Scordelis–Lo roof", bench::ratio_roof, 8, 1.7),
        ("pinched cylinder", bench::ratio_cylinder, 4, 1.3),
        ("clamped square plate", bench::ratio_plate, 8, 1.4),
        // Under a point load the exact solution is not smooth.
        ("clamped circular plate", bench::ratio_disc, 4, 1.0),
        ("twisted beam", |n| bench::ratio_twisted(n)[0], 2, 1.2),
        ("Cook's membrane", bench::ratio_cook, 8, 1.2),
    ];
    for (name, ratio, n, least) in cases {
        let values = [n, 2 * n, 4 * n].map(ratio);
        let p = order(values);
        println!("{name}: order {p:.2} from {values:.4?}");
        assert!(p > least, "{name}: order {p:.2} from {values:?}");
    }
}

/// Nodal forces of a pressure of 1 Pa on a flat part, against z.
fn pressure(mesh: &TriMesh) -> Vec<(u32, DVec3)> {
    let mut forces = vec![0.0; mesh.positions().len()];
    for (t, tri) in (0..).zip(mesh.triangles()) {
        for &v in tri {
            forces[v as usize] += mesh.facet_area(t) / 3.0;
        }
    }
    (0..)
        .zip(forces)
        .map(|(v, f)| (v, DVec3::NEG_Z * f))
        .collect()
}

fn clamped_where(mesh: &TriMesh, test: impl Fn(DVec3) -> bool) -> Vec<DofSet> {
    let all = |p: &DVec3| {
        if test(*p) {
            DofSet::ALL
        } else {
            DofSet::default()
        }
    };
    mesh.positions().iter().map(all).collect()
}

/// A clamped strip under its own pressure: on the face ε = 3 q (L - x)² / E t² with ν = 0.
#[test]
fn inner_strain_of_a_clamped_beam_converges_to_the_closed_form() {
    let (length, width, s) = (0.1, 0.01, section(1e9, 0.0, 1e-3));
    let error = |n: usize| {
        let mesh = Arc::new(grid(10 * n, n, Cut::Rising, |u, v| {
            DVec3::new(u * length, v * width, 0.0)
        }));
        let held = clamped_where(&mesh, |p| p.x < 1e-9);
        let model = ShellModel::new(&mesh, s, &held, &unwatched).unwrap();
        let u = model.solve(&pressure(&mesh));
        let places: Vec<DVec3> = (0..40)
            .map(|k| {
                DVec3::new(
                    0.01 + 0.002 * f64::from(k),
                    0.002 + 0.001 * f64::from(k % 7),
                    0.0,
                )
            })
            .collect();
        // Pressed down, the top stretches and the inside (below) is compressed.
        strain_error(&model, &u, &places, |p| {
            [
                -3.0 * (length - p.x).powi(2) / (1e9 * s.thickness.powi(2)),
                0.0,
                0.0,
            ]
        })
    };
    let errors = [2, 4, 8].map(error);
    println!("beam: {errors:?}");
    assert!(errors[1] < 0.01 && errors[2] < 0.003, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 1.5, "{errors:?}");
    }
}

/// A clamped disc under pressure: w = q (R² - r²)² / 64 D.
#[test]
fn inner_strain_of_a_clamped_disc_converges_to_the_closed_form() {
    let (r, s) = (5.0, section(1.7472e7, 0.3, 0.02));
    let error = |n: usize| {
        let mesh = Arc::new(bench::disc(n, r));
        let held: Vec<DofSet> = mesh
            .positions()
            .iter()
            .map(|p| {
                let mut mask = 0;
                if p.x.abs() < 1e-9 {
                    mask |= DofSet::symmetry(0).0;
                }
                if p.y.abs() < 1e-9 {
                    mask |= DofSet::symmetry(1).0;
                }
                if p.length() > r * (1.0 - 1e-9) {
                    mask |= DofSet::ALL.0;
                }
                DofSet(mask)
            })
            .collect();
        let model = ShellModel::new(&mesh, s, &held, &unwatched).unwrap();
        let u = model.solve(&pressure(&mesh));
        let places: Vec<DVec3> = (0..60)
            .map(|k| {
                let a = 0.1 + 1.3 * f64::from(k % 8) / 7.0;
                DVec3::new(a.cos(), a.sin(), 0.0) * (0.3 + 4.2 * f64::from(k) / 59.0)
            })
            .collect();
        strain_error(&model, &u, &places, |p| {
            let rr = p.length_squared();
            let c = -1.0 / (16.0 * s.bending_stiffness());
            // -z w″ and -z w′/r on the face below, w downward being negative.
            let half = s.thickness / 2.0;
            let radial = -(half * c * (3.0 * rr - r * r));
            let hoop = -(half * c * (rr - r * r));
            let (x, y) = (p.x / p.length(), p.y / p.length());
            [
                -(radial * x * x + hoop * y * y),
                -(radial * y * y + hoop * x * x),
                -(radial - hoop) * x * y,
            ]
        })
    };
    let errors = [4, 8, 16].map(error);
    println!("disc: {errors:?}");
    assert!(errors[1] < 0.02 && errors[2] < 0.006, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 1.4, "{errors:?}");
    }
}

#[test]
fn the_estimated_error_is_the_true_one_to_a_factor_of_two() {
    let mut all = Vec::new();
    for thickness in [0.4e-3, 1e-3, 2e-3] {
        for spokes in [48, 96] {
            let disc = Disc::new(spokes, thickness);
            let graded = disc.graded(&aim(400, 0), true);
            all.push((
                format!("as given, {spokes} spokes, {thickness} m"),
                graded,
                disc,
            ));
        }
        for (vertices, passes) in [(800, 1), (1600, 2), (4000, 2)] {
            let disc = Disc::new(96, thickness);
            let graded = disc.graded(&aim(vertices, passes), false);
            all.push((format!("graded, {vertices}, {thickness} m"), graded, disc));
        }
    }
    for (name, graded, disc) in all {
        let [displacement, strain] = disc.errors(&graded.model);
        let e = graded.estimate;
        let effect = [
            e.displacement_percent / displacement,
            e.strain_percent / strain,
        ];
        println!(
            "{name}: {} vertices; displacement {:.3} % of {displacement:.3} %, strain {:.3} % of {strain:.3} %: effectivity {effect:.2?}",
            graded.model.mesh.positions().len(),
            e.displacement_percent,
            e.strain_percent
        );
        for (k, effect) in effect.into_iter().enumerate() {
            assert!((0.5..=2.0).contains(&effect), "{name}, {k}: {effect}");
        }
    }
}

#[test]
fn grading_is_worth_its_elements() {
    // The same numbers of vertices, even and graded; one number alone may be lucky with how elements lie.
    let disc = Disc::new(96, 1e-3);
    let counts = [800, 1200, 1600, 2400, 3600];
    let mean = |passes: usize| -> [f64; 2] {
        let errors = counts.map(|n| disc.errors(&disc.graded(&aim(n, passes), false).model));
        println!("{passes} passes: {errors:.3?}");
        [0, 1].map(|k| errors.iter().map(|e| e[k].ln()).sum::<f64>() / counts.len() as f64)
    };
    let (even, graded) = (mean(0), mean(2));
    assert!(
        graded[0] < even[0] && graded[1] < even[1],
        "{graded:?} {even:?}"
    );
}

/// A clamped disc pressed in its middle stiffens: w/t + 0.443 (w/t)³ = linear w/t (Timoshenko and
/// Woinowsky-Krieger, table 82, immovable edge).
#[test]
fn the_estimate_of_linearity_is_that_of_a_clamped_disc() {
    let mut disc = Disc::new(96, 0.5e-3);
    disc.touch.tip_radius = 1.5e-3;
    let graded = disc.graded(&aim(3000, 1), false);
    for share in [0.1, 0.3, 0.6] {
        let mut touch = disc.touch;
        touch.force = share * disc.section.thickness / disc.under();
        let u = graded.model.solve(&graded.model.forces(&touch));
        let found = linearity(&graded.model, &[touch], &[u]);
        let mut w = share;
        for _ in 0..100 {
            w = share - 0.443 * w * w * w;
        }
        let known = 100.0 * (w / share - 1.0);
        println!(
            "w/t {share}: {:.2} %, known {known:.2} %",
            found.largest_percent
        );
        assert!((found.largest_percent / known - 1.0).abs() < 0.25);
        assert_eq!(found.beyond, 0);
    }
}

/// A strip held at one end bends without stretching: the second displacement must relax what the first
/// would stretch. The elastica at F L² / E I = 0.4 deflects by 0.1310 L (K. E. Bisshopp and D. C. Drucker,
/// Quarterly of Applied Mathematics 3 (1945)), 1.75 % less than the linear 0.1333 L.
#[test]
fn a_strip_that_only_bends_is_nearly_linear() {
    let (length, width, s) = (0.1, 0.01, section(1e9, 0.0, 1e-3));
    let mesh = Arc::new(grid(40, 4, Cut::Rising, |u, v| {
        DVec3::new(u * length, v * width, 0.0)
    }));
    let held = clamped_where(&mesh, |p| p.x < 1e-9);
    let model = ShellModel::new(&mesh, s, &held, &unwatched).unwrap();
    let inertia = width * s.thickness.powi(3) / 12.0;
    let touch = Touch {
        position: DVec3::new(length - 1e-3, width / 2.0, 0.0),
        normal: DVec3::Z,
        force: 0.4 * 1e9 * inertia / length.powi(2),
        tip_radius: 1e-3,
    };
    let u = model.solve(&model.forces(&touch));
    let found = linearity(&model, &[touch], &[u]);
    println!("{found:?}");
    assert!(
        (found.largest_percent / -1.75 - 1.0).abs() < 0.15,
        "{found:?}"
    );
}

#[test]
fn a_higher_quality_is_nearer_to_the_truth() {
    let disc = Disc::new(96, 1e-3);
    let errors: Vec<[f64; 2]> = Quality::ALL
        .iter()
        .map(|q| disc.errors(&disc.graded(&q.budget().elements, false).model))
        .collect();
    println!("{errors:?}");
    assert!(errors[2][0] < 1.0 && errors[2][1] < 2.0, "{errors:?}");
    assert!(errors[1][0] < 2.0 && errors[1][1] < 5.0, "{errors:?}");
    assert!(errors[2][1] <= errors[0][1]);
}

//! Solids in a grid: against closed forms, against a solid model of someone else, against the shell, and under
//! refinement.

mod bench;

use bench::solids::{Found, bent_tube, clamp, model, slotted, strip, tube};
use glam::{DQuat, DVec3};
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::solid::SolidModel;
use hapdef::elasticity::solid::immersed::Fineness;
use hapdef::elasticity::{Material, Model as _, Touch};

#[test]
fn cells_larger_than_the_wall_bend_as_a_beam() {
    for (turn, about) in [
        (DQuat::IDENTITY, "along the grid"),
        (
            DQuat::from_axis_angle(DVec3::X, 0.3),
            "turned about its length",
        ),
    ] {
        for (cells, order, most) in [
            (2.5, 2, 0.01),
            (4.0, 2, 0.03),
            (2.5, 3, 6e-3),
            (4.0, 3, 6e-3),
        ] {
            let Found {
                displacement,
                strain,
                ..
            } = strip(turn, cells, order);
            println!("{about}, cells {cells} walls, order {order}: {displacement:.4} {strain:.4}");
            assert!((displacement - 1.0).abs() < most, "{about}: {displacement}");
            assert!((strain - 1.0).abs() < 1.5 * most, "{about}: {strain}");
        }
    }
    // Linear cells lock: the test can tell.
    assert!(strip(DQuat::IDENTITY, 2.5, 1).displacement < 0.5);
}

#[test]
fn a_tube_bends_as_a_beam() {
    for (cells, order, most) in [(2.0, 2, 0.01), (1.33, 2, 5e-3), (2.0, 3, 5e-3)] {
        let Found {
            displacement,
            strain,
            ..
        } = bent_tube(cells, order);
        println!("cells {cells} walls, order {order}: {displacement:.4} {strain:.4}");
        assert!((displacement - 1.0).abs() < most, "{displacement}");
        assert!((strain - 1.0).abs() < 1.5 * most, "{strain}");
    }
}

#[test]
fn a_slotted_limb_agrees_with_someone_elses_solid() {
    let mut last = [f64::INFINITY; 2];
    for (cells_mm, most) in [(8.0, [9.0, 6.0]), (4.5, [3.0, 3.0])] {
        let found = slotted(cells_mm, 2);
        let found = [found.displacement, found.strain];
        println!(
            "cells of {cells_mm} mm: {:.2} % and {:.2} %",
            found[0], found[1]
        );
        for k in 0..2 {
            assert!(
                found[k] < most[k] && found[k] < last[k],
                "{cells_mm}: {found:?}"
            );
        }
        last = found;
    }
}

/// Strains on the inside of a short tube that is pressed, at places around it: their rms departure from cubic
/// cells, over the largest.
#[test]
fn strain_inside_converges() {
    let (inner, outer, length) = (0.0285_f64, 0.0315_f64, 0.06_f64);
    let part = tube(inner, outer, length, 90);
    let support = clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.01));
    let touch = Touch {
        position: DVec3::new(outer, 0.0, 0.045),
        normal: DVec3::X,
        force: 10.0,
        tip_radius: 0.006,
    };
    let places: Vec<DVec3> = (0..40)
        .map(|k| {
            let angle = 0.35 + 0.14 * f64::from(k);
            DVec3::new(
                inner * angle.cos(),
                inner * angle.sin(),
                0.02 + 0.0008 * f64::from(k),
            )
        })
        .collect();
    let read = |m: &SolidModel| -> Vec<[f64; 3]> {
        let u = m.system().solve_freedoms(&m.load(&touch));
        let points: Vec<_> = places.iter().map(|&p| m.index().nearest(p).0).collect();
        m.observer(&points, Face::Inside).strain_of(m, &u)
    };
    let material = Material {
        youngs_modulus: 2e9,
        poissons_ratio: 0.35,
    };
    let at = |size: f64, order: usize| {
        let fineness = Fineness {
            order,
            tolerance: 1e-3,
            ..Fineness::of(size, 3e-3)
        };
        read(&model(
            &part,
            material,
            std::slice::from_ref(&support),
            &fineness,
        ))
    };
    let fine = at(4e-3, 3);
    let scale = fine.iter().flatten().fold(0.0f64, |m, e| m.max(e.abs()));
    let sizes = [9e-3, 6e-3, 4e-3];
    let errors: Vec<f64> = sizes
        .iter()
        .map(|&size| {
            let both = at(size, 2).into_iter().zip(&fine);
            let squares: Vec<f64> = both
                .flat_map(|(a, b)| (0..3).map(move |k| (a[k] - b[k]).powi(2)))
                .collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / scale
        })
        .collect();
    let rate = (errors[0] / errors[2]).ln() / (sizes[0] / sizes[2]).ln();
    println!("strain errors {errors:?}, rate {rate:.2}");
    assert!(rate > 1.2 && errors[2] < 0.01, "{errors:?} {rate}");
}

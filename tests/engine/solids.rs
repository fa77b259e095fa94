//! Solids in a grid: against closed forms, against a solid model of someone else, against the shell, and under
//! refinement.

use std::sync::Arc;

use crate::bench;

use bench::hexes::Bricks;
use bench::solids::{Found, bent_tube, block, clamp, model, shell_of, slotted, strip, tube, under};
use glam::{DQuat, DVec3};
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::solid::SolidModel;
use hapdef::elasticity::solid::immersed::Fineness;
use hapdef::elasticity::support::HeldRegion;
use hapdef::elasticity::{DofSet, Material, Model as _, Support, Touch};
use hapdef::mesh::TriMesh;
use hapdef::mesh::oriented_box::OrientedBox;
use hapdef::mesh::stance::Stance;

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
        let u = m.system().solve_dofs(&m.load(&touch));
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

const RESIN: Material = Material {
    youngs_modulus: 1.7e9,
    poissons_ratio: 0.35,
};

/// The face of a part in a plane through the origin, kept from moving through it.
fn mirror(axis: usize) -> Support {
    let mut upper = DVec3::ONE;
    let mut lower = DVec3::NEG_ONE;
    upper[axis] = 1e-9;
    lower[axis] = -1e-9;
    Support {
        region: HeldRegion::Box(OrientedBox::of_file(lower, upper)),
        held: DofSet::symmetry(axis),
        bedding: None,
    }
}

#[test]
fn a_block_under_uniform_load_shortens_as_hooke_says() {
    // An eighth of a block between three mirrors; a tip that is much wider than it presses evenly.
    let sides = DVec3::new(0.02, 0.015, 0.025);
    let part = block(sides, |p| p);
    let supports = [mirror(0), mirror(1), mirror(2)];
    let touch = Touch {
        position: DVec3::new(0.01, 0.0075, 0.025),
        normal: DVec3::Z,
        force: 300.0,
        tip_radius: 1e3,
    };
    let stress = touch.force / (sides.x * sides.y);
    let strain = stress / RESIN.youngs_modulus;
    for size in [12e-3, 5e-3] {
        let m = model(&part, RESIN, &supports, &Fineness::of(size, 0.015));
        let u = m.system().solve_dofs(&m.load(&touch));
        let corner = [m.index().nearest(sides).0];
        let moved = m.observer(&corner, Face::Outside).displacement_of(&m, &u)[0];
        let exact = DVec3::new(
            RESIN.poissons_ratio * strain * sides.x,
            RESIN.poissons_ratio * strain * sides.y,
            -strain * sides.z,
        );
        println!("{size}: {moved:?} of {exact:?}");
        assert!(
            moved.distance(exact) < 2e-3 * exact.length(),
            "{moved} {exact}"
        );
    }
}

#[test]
fn far_from_a_small_tip_a_thick_block_gives_way_as_a_half_space() {
    // J. Boussinesq 1885: u(r) = (1 - ν²) F / (π E r). What holds the block from below adds to all of it alike.
    let part = block(DVec3::new(0.06, 0.06, 0.04), |p| {
        p - DVec3::new(0.03, 0.03, 0.04)
    });
    let support = clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, -0.038));
    let m = model(&part, RESIN, &[support], &Fineness::of(4e-3, 0.04));
    let touch = Touch {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        force: 10.0,
        tip_radius: 2e-3,
    };
    let u = m.system().solve_dofs(&m.load(&touch));
    let sunk = |r: f64| {
        let sum: f64 = (0..8)
            .map(|k| {
                let angle = std::f64::consts::FRAC_PI_4 * (f64::from(k) + 0.3);
                let at = m
                    .index()
                    .nearest(DVec3::new(r * angle.cos(), r * angle.sin(), 0.0))
                    .0;
                -m.observer(&[at], Face::Outside).displacement_of(&m, &u)[0].z
            })
            .sum();
        sum / 8.0
    };
    let (near, far) = (5e-3, 9e-3);
    let plane = (1.0 - RESIN.poissons_ratio.powi(2)) / RESIN.youngs_modulus;
    let exact = plane * touch.force / std::f64::consts::PI * (1.0 / near - 1.0 / far);
    let found = sunk(near) - sunk(far);
    println!("{:.4} of Boussinesq", found / exact);
    assert!((found / exact - 1.0).abs() < 0.05, "{found} {exact}");
}

#[test]
fn a_solid_and_a_shell_of_the_same_tube_agree() {
    // What a shell leaves out of a wall of a tenth of the radius (RESULTS.md).
    let found = shell_of(3.0);
    println!("{found:?}");
    assert!(found.displacement < 2.5 && found.strain < 2.0, "{found:?}");
}

#[test]
fn a_box_that_is_turned_with_the_part_holds_it_as_one_by_the_grid_does() {
    // A block pressed beside its foot, and a flange pressed above the boss that it is held by: cells stand as the box does.
    type Place = fn(DVec3) -> DVec3;
    type Part<'a> = &'a dyn Fn(Place) -> Arc<TriMesh>;
    let upright: Place = |p| p;
    let turn: Place = |p| DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 0.8) * p;
    let flange = |place: Place| {
        let bricks = Bricks {
            axes: [
                vec![0.0, 0.015, 0.025, 0.04],
                vec![0.0, 0.015, 0.025, 0.04],
                vec![0.0, 0.005, 0.01],
            ],
            keep: |p| p.z > 0.005 || (p - DVec3::new(0.02, 0.02, p.z)).abs().max_element() < 0.005,
            place,
        };
        bricks.surface()
    };
    let beam = |place: Place| block(DVec3::new(0.01, 0.01, 0.05), place);
    let cases: [(&str, Part, f64, DVec3, DVec3, f64); 2] = [
        (
            "beam",
            &beam,
            0.01,
            DVec3::new(0.01, 0.005, 0.045),
            DVec3::X,
            3e-3,
        ),
        (
            "flange",
            &flange,
            0.005,
            DVec3::new(0.02, 0.02, 0.01),
            DVec3::Z,
            2e-3,
        ),
    ];
    for (name, part, top, at, normal, size) in cases {
        let ways = [(upright, false), (turn, false), (turn, true)];
        let [upright, oblique, across] = ways.map(|(turn, with_another)| {
            let part = part(turn);
            let stance = Stance::about(turn(DVec3::Z));
            let region = |lower, upper| {
                HeldRegion::Box(OrientedBox {
                    stance,
                    lower,
                    upper,
                })
            };
            let held = |region| Support {
                region,
                held: DofSet::ALL,
                bedding: None,
            };
            let foot = held(region(DVec3::NEG_ONE, DVec3::new(1.0, 1.0, top)));
            // Another box lies along the file's axes within what the foot holds: cells stand as that one does.
            let middle = turn(DVec3::new(at.y, at.y, 0.0));
            let another = held(HeldRegion::Box(OrientedBox::of_file(
                middle - 1e-3,
                middle + 1e-3,
            )));
            let supports = if with_another {
                vec![another, foot]
            } else {
                vec![foot]
            };
            let touch = Touch {
                position: turn(at),
                normal: turn(normal),
                force: 1.0,
                tip_radius: 3e-3,
            };
            let m = model(&part, RESIN, &supports, &Fineness::of(size, 0.01));
            let load = m.load(&touch);
            let u = m.system().solve_dofs(&load);
            let check = m.check_all(&[touch], &[u]);
            assert!(check.reaction_error < 1e-6, "{name}: {check:?}");
            under(&m, &touch)
        });
        let [turned, across] = [oblique, across].map(|moved| moved / upright - 1.0);
        println!(
            "{name}: {:.2} % more, across the cells {:.2} %",
            100.0 * turned,
            100.0 * across
        );
        assert!(turned.abs() < 2e-3, "{name}: {upright} {oblique}");
        assert!(across.abs() < 5e-2, "{name}: {upright} {across}");
    }
}

#[test]
fn a_face_in_the_border_of_a_box_is_held_beside_what_lies_in_it() {
    // A block on a foot: the box ends where the foot meets the block's underside, which lies in it but for rounding.
    let bricks = Bricks {
        axes: [
            vec![0.0, 0.008, 0.012, 0.02],
            vec![0.0, 0.008, 0.012, 0.02],
            vec![-0.002, 2e-16, 0.02],
        ],
        keep: |p| p.z > 0.0 || (p - DVec3::new(0.01, 0.01, p.z)).abs().max_element() < 0.002,
        place: |p| p,
    };
    let part = bricks.surface();
    let touch = Touch {
        position: DVec3::new(0.02, 0.01, 0.015),
        normal: DVec3::X,
        force: 10.0,
        tip_radius: 4e-3,
    };
    let moved = |top: f64| {
        let foot = clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, top));
        let m = model(&part, RESIN, &[foot], &Fineness::of(4e-3, 0.02));
        // What springs do to nodes that are held beside them is counted once.
        let check = m.check_all(&[touch], &[m.system().solve_dofs(&m.load(&touch))]);
        assert!(check.reaction_error < 1e-6, "{top}: {check:?}");
        under(&m, &touch)
    };
    let (at, above, below) = (moved(0.0), moved(5e-4), moved(-5e-4));
    println!("held at the underside {at:.2e}, above {above:.2e}, below {below:.2e}");
    assert!((at / above - 1.0).abs() < 0.1, "{at} {above}");
    assert!(below > 2.0 * at, "{below} {at}");
}

#[test]
fn an_edge_and_a_corner_hold_a_solid_too() {
    // A beam of ten sides, fixed at its foot, pressed in its middle and propped at its head, where an edge or two corners
    // are held: F L³ 7/768 E I there, in place of F L³ / 24 E I with a free head.
    let (side, length) = (0.01, 0.1);
    let part = block(DVec3::new(side, side, length), |p| p);
    let foot = clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 1e-9));
    let at_head = |p: &DVec3| p.x > 0.5 * side && p.z > 0.5 * length;
    let head: Vec<bool> = part.positions().iter().map(at_head).collect();
    assert_eq!(head.iter().filter(|h| **h).count(), 2);
    let one: Vec<bool> = (part.positions().iter())
        .map(|p| at_head(p) && p.y > 0.5 * side)
        .collect();
    let held = |mask: &[bool]| Support {
        region: HeldRegion::Vertices(std::sync::Arc::new(mask.to_vec())),
        held: DofSet::DISPLACEMENTS,
        bedding: None,
    };
    let touch = Touch {
        position: DVec3::new(side, side / 2.0, length / 2.0),
        normal: DVec3::X,
        force: 1.0,
        tip_radius: 3e-3,
    };
    let moved = |supports: &[Support], place: DVec3, size: f64| {
        let m = model(&part, RESIN, supports, &Fineness::of(size, side));
        let u = m.system().solve_dofs(&m.load(&touch));
        let at = [m.index().nearest(place).0];
        m.observer(&at, Face::Outside).displacement_of(&m, &u)[0]
    };
    let across = DVec3::new(0.0, side / 2.0, length / 2.0);
    let corner = DVec3::new(side, side, length);
    let inertia = side.powi(4) / 12.0;
    let unit = touch.force * length.powi(3) / (RESIN.youngs_modulus * inertia);
    for size in [5e-3, 3.5e-3] {
        let free = moved(std::slice::from_ref(&foot), across, size).length();
        assert!((free / (unit / 24.0) - 1.0).abs() < 0.06, "{}", free / unit);
        for (what, mask) in [("edge", &head), ("corner", &one)] {
            let supports = [foot.clone(), held(mask)];
            let propped = moved(&supports, across, size).length();
            let stays = moved(&supports, corner, size).length();
            println!("{what}, {size} m: {:.4} of free", propped / free);
            // An edge that is held along the beam too keeps its head from turning a little: less than a prop alone.
            let prop = 7.0 / 768.0 * 24.0;
            assert!((0.5..1.15).contains(&(propped / free / prop)), "{what}");
            assert!(stays < 2e-3 * free, "{what}: {stays} {free}");
        }
    }
}

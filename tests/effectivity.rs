//! What the program says of its own error on solids, against the error it has: an independent solution of
//! tetrahedra on the very same parts.

mod bench;

use std::sync::Arc;

use bench::hexes::{Bricks, ends};
use bench::solids::clamp;
use glam::DVec3;
use hapdef::budget::{Quality, unwatched};
use hapdef::elasticity::estimate::under_load;
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::solid::SolidModel;
use hapdef::elasticity::solid::ground::SolidGround;
use hapdef::elasticity::{Material, Model as _, Support, Touch};
use hapdef::mesh::walls::Side;

const MATERIAL: Material = Material {
    youngs_modulus: 1.7e9,
    poissons_ratio: 0.35,
};

struct Case {
    name: &'static str,
    bricks: Bricks,
    support: Support,
    touches: Vec<Touch>,
    places: Vec<DVec3>,
    /// Sides of the bricks that the truth is computed on.
    truth: DVec3,
}

fn touch(position: [f64; 3], normal: [f64; 3], tip_mm: f64) -> Touch {
    Touch {
        position: DVec3::from_array(position) * 1e-3,
        normal: DVec3::from_array(normal).normalize(),
        force: 10.0,
        tip_radius: tip_mm * 1e-3,
    }
}

fn mm(points: &[[f64; 3]]) -> Vec<DVec3> {
    points
        .iter()
        .map(|&p| DVec3::from_array(p) * 1e-3)
        .collect()
}

fn cube() -> Case {
    Case {
        name: "cube 20 mm",
        bricks: Bricks {
            axes: [ends(0.0, 0.02), ends(0.0, 0.02), vec![0.0, 0.002, 0.02]],
            keep: |_| true,
            place: |p| p,
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.002)),
        touches: vec![
            touch([10.0, 10.0, 20.0], [0.0, 0.0, 1.0], 3.0),
            touch([20.0, 10.0, 12.0], [1.0, 0.0, 0.0], 3.0),
            touch([5.0, 0.0, 16.0], [0.0, -1.0, 0.0], 3.0),
        ],
        places: mm(&[
            [0.0, 10.0, 10.0],
            [10.0, 20.0, 10.0],
            [20.0, 10.0, 5.0],
            [10.0, 0.0, 5.0],
        ]),
        truth: DVec3::new(1.0, 1.0, 1.0) * 1e-3,
    }
}

/// A channel 80 × 30 × 30 mm with walls of 3 mm.
fn channel() -> Case {
    Case {
        name: "channel",
        bricks: Bricks {
            axes: [
                vec![0.0, 0.003, 0.027, 0.03],
                vec![0.0, 0.003, 0.03],
                vec![0.0, 0.004, 0.08],
            ],
            keep: |p| p.y < 0.003 || p.x < 0.003 || p.x > 0.027,
            place: |p| p,
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.004)),
        touches: vec![
            touch([0.0, 20.0, 60.0], [-1.0, 0.0, 0.0], 4.0),
            touch([15.0, 0.0, 40.0], [0.0, -1.0, 0.0], 4.0),
            touch([30.0, 10.0, 20.0], [1.0, 0.0, 0.0], 4.0),
            touch([15.0, 0.0, 70.0], [0.0, -1.0, 0.0], 4.0),
        ],
        places: mm(&[
            [3.0, 15.0, 30.0],
            [15.0, 3.0, 30.0],
            [27.0, 15.0, 50.0],
            [15.0, 3.0, 12.0],
        ]),
        truth: DVec3::new(1.5, 1.5, 2.0) * 1e-3,
    }
}

/// A thick tube of 16 flat sides.
fn tube() -> Case {
    let round: Vec<f64> = (0..=16).map(f64::from).collect();
    Case {
        name: "thick tube",
        bricks: Bricks {
            axes: [vec![0.012, 0.020], round, vec![0.0, 0.005, 0.06]],
            keep: |_| true,
            place: |c| {
                let angle = c.y / 16.0 * std::f64::consts::TAU;
                DVec3::new(c.x * angle.cos(), c.x * angle.sin(), c.z)
            },
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.005)),
        touches: vec![
            touch([19.6, 3.9, 40.0], [0.98, 0.195, 0.0], 4.0),
            touch([-19.6, 3.9, 25.0], [-0.98, 0.195, 0.0], 4.0),
            touch([3.9, 19.6, 55.0], [0.195, 0.98, 0.0], 4.0),
        ],
        places: mm(&[
            [12.0, 0.0, 30.0],
            [0.0, 12.0, 20.0],
            [-12.0, 0.0, 40.0],
            [0.0, -12.0, 12.0],
        ]),
        truth: DVec3::new(0.0015, 0.34, 0.0016),
    }
}

/// An L of 12 mm, thick beside the span.
fn bracket() -> Case {
    Case {
        name: "bracket",
        bricks: Bricks {
            axes: [
                vec![0.0, 0.012, 0.05],
                ends(0.0, 0.02),
                vec![0.0, 0.005, 0.038, 0.05],
            ],
            keep: |p| p.x < 0.012 || p.z > 0.038,
            place: |p| p,
        },
        support: clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.005)),
        touches: vec![
            touch([40.0, 10.0, 50.0], [0.0, 0.0, 1.0], 4.0),
            touch([0.0, 10.0, 25.0], [-1.0, 0.0, 0.0], 4.0),
            touch([20.0, 10.0, 50.0], [0.0, 0.0, 1.0], 4.0),
        ],
        places: mm(&[
            [12.0, 10.0, 20.0],
            [25.0, 10.0, 38.0],
            [12.0, 10.0, 30.0],
            [40.0, 10.0, 38.0],
        ]),
        truth: DVec3::new(1.5, 1.5, 1.5) * 1e-3,
    }
}

fn solve(
    model: &SolidModel,
    touches: &[Touch],
    places: &[DVec3],
) -> (Vec<f64>, Vec<Vec<[f64; 3]>>) {
    let loads: Vec<_> = touches.iter().map(|t| model.load(t)).collect();
    let solutions = model.system().solve_loads(&loads);
    let under = (touches.iter().zip(&loads).zip(&solutions))
        .map(|((t, l), u)| under_load(l, t, u))
        .collect();
    let points: Vec<_> = places.iter().map(|&p| model.index().nearest(p).0).collect();
    let observer = model.observer(&points, Face::Inside);
    // In axes that do not depend on how the surface is cut.
    let strains = (solutions.iter())
        .map(|u| {
            let read = observer.strain_of(model, u);
            (read.iter().zip(observer.frames()))
                .map(|(&[xx, yy, xy], frame)| {
                    let normal = frame.z_axis;
                    let x = normal.any_orthonormal_vector();
                    let y = normal.cross(x);
                    let along = |d: DVec3, e: DVec3| {
                        let (a, b) = (d.dot(frame.x_axis), d.dot(frame.y_axis));
                        let (c, f) = (e.dot(frame.x_axis), e.dot(frame.y_axis));
                        xx * a * c + yy * b * f + xy / 2.0 * (a * f + b * c)
                    };
                    [along(x, x), along(y, y), 2.0 * along(x, y)]
                })
                .collect()
        })
        .collect();
    (under, strains)
}

fn rms(v: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = v.collect();
    100.0 * (all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64).sqrt()
}

#[test]
fn estimates_of_solids_are_of_the_size_of_the_error() {
    for case in [cube(), channel(), tube(), bracket()] {
        let support = std::slice::from_ref(&case.support);
        let start = std::time::Instant::now();
        let truth = case.bricks.model(case.truth, MATERIAL, support);
        let coarse = case.bricks.model(case.truth * 1.4, MATERIAL, support);
        let (right, right_strains) = solve(&truth, &case.touches, &case.places);
        let (less, _) = solve(&coarse, &case.touches, &case.places);
        println!(
            "{}: truth {} unknowns, coarser tetrahedra {:.2} % away, {:.0} s; {:?}",
            case.name,
            truth.system().dimension(),
            rms(less.iter().zip(&right).map(|(a, b)| a / b - 1.0)),
            start.elapsed().as_secs_f64(),
            right
        );
        let part: Arc<_> = case.bricks.surface();
        let told = |_: DVec3| None::<Side>;
        let ground = SolidGround::new(&part, MATERIAL, support, &told, &unwatched).unwrap();
        for quality in [Quality::Draft, Quality::Standard] {
            let start = std::time::Instant::now();
            let aim = quality.budget().elements;
            let graded = ground
                .grade(&case.touches, &case.places, &aim, &unwatched)
                .unwrap();
            let (under, strains) = solve(&graded.model, &case.touches, &case.places);
            let off = rms(under.iter().zip(&right).map(|(a, b)| a / b - 1.0));
            let strain_off = rms(strains.iter().zip(&right_strains).flat_map(|(a, b)| {
                let largest = b.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
                a.iter()
                    .flatten()
                    .zip(b.iter().flatten())
                    .map(move |(a, b)| (a - b) / largest)
                    .collect::<Vec<_>>()
            }));
            println!(
                "  {}: wall {:.2} cells {:.2} mm, {} unknowns, {} models: error {off:.2} % said {:.2} %; strain {strain_off:.2} % said {:.2} %; {:.1} s",
                quality.name(),
                ground.wall() * 1e3,
                graded.fineness.size * 1e3,
                graded.model.system().dimension(),
                graded.models,
                graded.estimate.displacement_percent,
                graded.estimate.strain_percent,
                start.elapsed().as_secs_f64(),
            );
            println!(
                "    under {:?}",
                under
                    .iter()
                    .zip(&right)
                    .map(|(a, b)| a / b - 1.0)
                    .collect::<Vec<_>>()
            );
        }
    }
}

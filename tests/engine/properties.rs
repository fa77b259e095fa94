//! What must hold whatever the numbers: rigid motion, rotation, renumbering, superposition, reciprocity,
//! determinism, and each fast way against a naive one.

use crate::bench;

use std::sync::Arc;

use glam::{DQuat, DVec3};
use hapdef::budget::{Quality, unwatched};
use hapdef::dataset::{self, Signal, SignalMatrix};
use hapdef::design::{self, Inputs};
use hapdef::elasticity::element::Facet;
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::respond::{Quantity, Responses, SolvedSide, respond, respond_from};
use hapdef::elasticity::support::held_freedoms;
use hapdef::elasticity::{DofSet, Model as _, ShellModel, Touch};
use hapdef::gauge::Gauge;
use hapdef::mesh::TriMesh;
use hapdef::placement::SelectorKind;
use hapdef::regression::tune::Effort;
use hapdef::regression::{Hyper, PositionModel};

fn bundled() -> Inputs {
    hapdef::cli::bundled().unwrap().inputs
}

fn held(inputs: &Inputs) -> Vec<DofSet> {
    let supports = inputs.project.supports(&inputs.masks).unwrap();
    held_freedoms(&inputs.part, &supports)
}

fn model(inputs: &Inputs) -> ShellModel {
    let held = held(inputs);
    ShellModel::new(&inputs.part, inputs.project.section(), &held, &unwatched).unwrap()
}

fn touch(inputs: &Inputs, toward: DVec3) -> Touch {
    let index = inputs.part.index();
    let (at, _) = index.nearest(toward);
    Touch {
        position: inputs.part.point(at),
        normal: inputs.part.normal(at),
        force: 10.0,
        tip_radius: 5e-3,
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[test]
fn rigid_motion_makes_no_force_and_no_strain() {
    let section = bench::section(1.7e9, 0.35, 1.5e-3);
    let corners = [
        DVec3::new(0.01, 0.002, -0.003),
        DVec3::new(0.013, 0.001, 0.0),
        DVec3::new(0.011, 0.004, 0.001),
    ];
    let facet = Facet::new(corners, &section);
    let k = facet.stiffness(&section);
    let (shift, spin) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(30.0, -70.0, 55.0));
    let motion = nalgebra::SVector::<f64, 18>::from_fn(|i, _| {
        let p = corners[i / 6];
        if i % 6 < 3 {
            (shift + spin.cross(p))[i % 6]
        } else {
            spin[i % 6 - 3]
        }
    });
    let scale = k.amax() * motion.amax();
    assert!((k * motion).amax() < 1e-12 * scale);
    assert!((k - k.transpose()).amax() < 1e-12 * k.amax());
    for z in [-0.75e-3, 0.0, 0.75e-3] {
        let strain = facet.strain([0.2, 0.5, 0.3], z);
        assert!((strain * motion).amax() < 1e-12 * strain.amax() * motion.amax());
    }
}

#[test]
fn an_element_has_exactly_six_motions_without_energy() {
    let section = bench::section(1.7e9, 0.35, 1.5e-3);
    let corners = [
        DVec3::ZERO,
        DVec3::new(2e-3, 0.0, 1e-3),
        DVec3::new(0.5e-3, 1.7e-3, 0.0),
    ];
    let k = Facet::new(corners, &section).stiffness(&section);
    let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    assert!(values[5].abs() < 1e-9 * values[17] && values[6] > 0.0);
    assert!(values[6] > 1e6 * values[5].abs(), "{values:?}");
}

#[test]
fn a_turned_limb_deforms_the_same() {
    let inputs = bundled();
    let u = {
        let m = model(&inputs);
        m.solve(&m.forces(&touch(&inputs, DVec3::new(0.03, 0.01, 0.07))))
    };
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -1.1, 2.3);
    let positions: Vec<DVec3> = inputs.part.positions().iter().map(|&p| turn * p).collect();
    let turned = TriMesh::new(&positions, inputs.part.triangles(), 0)
        .unwrap()
        .0;
    let held = held(&inputs);
    let m = ShellModel::new(
        &Arc::new(turned),
        inputs.project.section(),
        &held,
        &unwatched,
    )
    .unwrap();
    let mut t = touch(&inputs, DVec3::new(0.03, 0.01, 0.07));
    t.position = turn * t.position;
    t.normal = turn * t.normal;
    let v = m.solve(&m.forces(&t));
    let back: Vec<f64> = v
        .chunks_exact(3)
        .flat_map(|d| (turn.inverse() * DVec3::from_slice(d)).to_array())
        .collect();
    let difference: Vec<f64> = u.iter().zip(&back).map(|(a, b)| a - b).collect();
    assert!(
        norm(&difference) < 1e-8 * norm(&u),
        "{:e}",
        norm(&difference) / norm(&u)
    );
}

#[test]
fn touches_superpose_and_are_reciprocal_and_in_balance() {
    let inputs = bundled();
    let m = model(&inputs);
    let [a, b] = [DVec3::new(0.03, 0.01, 0.07), DVec3::new(-0.03, 0.0, 0.03)]
        .map(|p| m.forces(&touch(&inputs, p)));
    let (ua, ub) = (m.solve(&a), m.solve(&b));
    let both: Vec<(u32, DVec3)> = a.iter().chain(&b).copied().collect();
    let sum: Vec<f64> = m
        .solve(&both)
        .iter()
        .zip(ua.iter().zip(&ub))
        .map(|(s, (x, y))| s - x - y)
        .collect();
    assert!(norm(&sum) < 1e-11 * norm(&ua));
    let spread = |f: &[(u32, DVec3)]| -> Vec<(usize, f64)> {
        f.iter()
            .flat_map(|&(v, f)| (0..3).map(move |c| (6 * v as usize + c, f[c])))
            .collect()
    };
    let work = |f: &[(u32, DVec3)], u: &[f64]| -> f64 {
        f.iter()
            .map(|&(v, f)| f.dot(DVec3::from_slice(&u[6 * v as usize..])))
            .sum()
    };
    let (ab, ba) = (work(&a, &ub), work(&b, &ua));
    assert!((ab - ba).abs() < 1e-10 * work(&a, &ua).abs(), "{ab} {ba}");
    let check = m.check(&a, &ua);
    assert!(
        check.reaction_error < 1e-8 && check.energy_error < 1e-8,
        "{check:?}"
    );
    assert!(m.system().residual(&spread(&a), &ua) < 1e-10);
    // A touch that lies half on a boss goes into the support directly.
    let boss = m.forces(&touch(&inputs, DVec3::new(0.0187, 0.0257, 0.005)));
    let check = m.check(&boss, &m.solve(&boss));
    assert!(check.reaction_error < 1e-8, "{check:?}");
}

/// All responses, outputs by rows.
fn table(responses: &Responses, touches: usize) -> Vec<f64> {
    let mut row = vec![0.0; touches];
    (0..responses.rows())
        .flat_map(|r| {
            responses.row_into(r, &mut row);
            row.clone()
        })
        .collect()
}

fn many_touches(inputs: &Inputs) -> Vec<Touch> {
    (0..70)
        .map(|k| touch(inputs, DVec3::new(0.03, 0.001 * f64::from(k) - 0.03, 0.06)))
        .collect()
}

fn some_sites(inputs: &Inputs) -> Vec<hapdef::mesh::SurfacePoint> {
    hapdef::mesh::sample::random(&inputs.part, 12, 3, |_| true)
}

#[test]
fn blocks_give_the_bytes_of_single_touches() {
    let inputs = bundled();
    let m = model(&inputs);
    let touches = many_touches(&inputs);
    let observer = m.observer(&some_sites(&inputs), Face::Inside);
    let read = |side: SolvedSide, touches: &[Touch]| {
        let reading = Quantity::StrainAndDisplacement;
        let r = respond_from(side, &m, touches, &observer, reading, &unwatched).unwrap();
        table(&r, touches.len())
    };
    for (side, t) in [
        (SolvedSide::Loads, 2),
        (SolvedSide::Loads, 69),
        (SolvedSide::LoadsAbove, 2),
        (SolvedSide::LoadsAbove, 69),
        (SolvedSide::OutputsAbove, 2),
        (SolvedSide::OutputsAbove, 69),
    ] {
        let all = read(side, &touches);
        let single = read(side, &touches[t..=t]);
        let column: Vec<f64> = all.iter().skip(t).step_by(touches.len()).copied().collect();
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&column), bits(&single));
        let u = m.solve(&m.forces(&touches[t]));
        let direct = observer.displacement_of(&m, &u)[5];
        let read = DVec3::from_array(std::array::from_fn(|k| single[3 * (12 + 5) + k]));
        assert!(direct.distance(read) < 1e-12 * direct.length());
    }
}

/// Maxwell and Betti: solving for the loads or for the outputs, all the way or above a cut, gives the same, and what takes least is done.
#[test]
fn loads_and_outputs_are_reciprocal() {
    let inputs = bundled();
    let m = model(&inputs);
    let touches = many_touches(&inputs);
    let observer = m.observer(&some_sites(&inputs), Face::Inside);
    let angles: Vec<f64> = (0..12).map(|k| 0.3 * f64::from(k)).collect();
    for reading in [
        Quantity::Strain,
        Quantity::StrainAndDisplacement,
        Quantity::Gauge(&angles),
        Quantity::GaugeAndDisplacement(&angles),
        Quantity::GaugeDifference(&angles, 3.0),
        Quantity::Displacement,
    ] {
        // More touches than outputs, and fewer.
        for touches in [&touches[..], &touches[..20]] {
            let ways = [
                SolvedSide::Loads,
                SolvedSide::Outputs,
                SolvedSide::LoadsAbove,
                SolvedSide::OutputsAbove,
            ];
            let [a, b, c, d] = ways.map(|side| {
                let r = respond_from(side, &m, touches, &observer, reading, &unwatched).unwrap();
                assert_eq!(r.side, side);
                table(&r, touches.len())
            });
            for other in [b, c, d] {
                assert_eq!(a.len(), other.len());
                for (x, y) in a.chunks(touches.len()).zip(other.chunks(touches.len())) {
                    let apart: Vec<f64> = x.iter().zip(y).map(|(x, y)| x - y).collect();
                    assert!(
                        norm(&apart) < 1e-9 * norm(x),
                        "{:e}",
                        norm(&apart) / norm(x)
                    );
                }
            }
        }
    }
    let fewer = |count: usize| {
        let reading = Quantity::Gauge(&angles);
        respond(&m, &touches[..count], &observer, reading, &unwatched).unwrap()
    };
    assert_eq!(
        (fewer(70).side, fewer(70).solves),
        (SolvedSide::Outputs, 12)
    );
    assert_eq!((fewer(5).side, fewer(5).solves), (SolvedSide::Loads, 5));
}

/// Blocks are used again and again, with only what was filled taken out of them.
#[test]
fn what_a_block_held_before_leaves_no_trace() {
    let inputs = bundled();
    let m = model(&inputs);
    let part = &inputs.part;
    let at = hapdef::mesh::sample::random(part, 600, 1, |_| true).into_iter();
    let touches: Vec<Touch> = at.map(|at| touch(&inputs, part.point(at))).collect();
    let sites = hapdef::mesh::sample::random(part, 400, 3, |_| true);
    let observer = m.observer(&sites, Face::Inside);
    let one = m.solve(&m.forces(&touches[333]));
    let direct = observer.strain_of(&m, &one);
    for side in [
        SolvedSide::Loads,
        SolvedSide::Outputs,
        SolvedSide::LoadsAbove,
        SolvedSide::OutputsAbove,
    ] {
        let read = respond_from(side, &m, &touches, &observer, Quantity::Strain, &unwatched);
        let read = table(&read.unwrap(), touches.len());
        let of_one = read.iter().skip(333).step_by(touches.len());
        let (mut apart, mut size) = (0.0_f64, 0.0_f64);
        for (read, direct) in of_one.zip(direct.iter().flatten()) {
            (apart, size) = (apart.max((read - direct).abs()), size.max(direct.abs()));
        }
        assert!(apart < 1e-9 * size, "{side:?}: {apart:e} of {size:e}");
    }
}

#[test]
fn the_inside_face_is_the_outside_face_of_the_shell_turned_over() {
    let inputs = bundled();
    let flipped: Vec<[u32; 3]> = inputs
        .part
        .triangles()
        .iter()
        .map(|&[a, b, c]| [a, c, b])
        .collect();
    let other = TriMesh::new(inputs.part.positions(), &flipped, 0)
        .unwrap()
        .0;
    let held = held(&inputs);
    let section = inputs.project.section();
    let m = ShellModel::new(&inputs.part, section, &held, &unwatched).unwrap();
    let n = ShellModel::new(&Arc::new(other), section, &held, &unwatched).unwrap();
    let u = m.solve(&m.forces(&touch(&inputs, DVec3::new(0.03, 0.01, 0.07))));
    let place = DVec3::new(0.028, 0.012, 0.06);
    let size = |m: &ShellModel, face| {
        let at = m.mesh.index().nearest(place).0;
        let [xx, yy, xy] = m.observer(&[at], face).strain_of(m, &u)[0];
        (f64::midpoint(xx, yy), ((xx - yy) / 2.0).hypot(xy / 2.0))
    };
    let (inside, outside) = (size(&m, Face::Inside), size(&n, Face::Outside));
    assert!(
        (inside.0 - outside.0).abs() < 1e-9 * inside.1
            && (inside.1 - outside.1).abs() < 1e-9 * inside.1
    );
    assert!(
        (size(&m, Face::Outside).0 - inside.0).abs() > 0.1 * inside.1,
        "the faces differ under bending"
    );
}

fn small(signal: Signal) -> (Inputs, hapdef::budget::Budget) {
    let mut inputs = bundled();
    inputs.project.gauge.signal = signal;
    inputs.project.selection.sensors = 3;
    let mut budget = Quality::Draft.budget();
    budget.touches = 200;
    budget.test_touches = 60;
    budget.selection_touches = 120;
    budget.selection_candidates = 10;
    budget.candidates = 20;
    budget.tuning_touches = 90;
    (inputs, budget)
}

/// A gauge half a millimetre along, back, across, back, and turned by a degree either way.
fn moved(gauge: &Gauge) -> [Gauge; 6] {
    let across = gauge.normal.cross(gauge.direction);
    let at = |along: f64, aside: f64, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Gauge {
            position: gauge.position + gauge.direction * along + across * aside,
            direction: gauge.direction * cos + across * sin,
            ..*gauge
        }
    };
    let half = 0.5e-3;
    [
        at(half, 0.0, 0.0),
        at(-half, 0.0, 0.0),
        at(0.0, half, 0.0),
        at(0.0, -half, 0.0),
        at(0.0, 0.0, 1.0),
        at(0.0, 0.0, -1.0),
    ]
}

#[test]
fn slopes_of_gluing_are_what_moved_gauges_read() {
    let (inputs, budget) = small(Signal::Strain);
    let simulated = design::simulate(&inputs, &budget, &unwatched).unwrap();
    let all = &simulated.dataset;
    let slopes = all.slopes.as_ref().unwrap();
    let touches: Vec<Touch> = slopes
        .columns()
        .touches()
        .iter()
        .map(|&t| all.touches[t])
        .collect();
    let sites: Vec<usize> = (0..all.sites.len()).step_by(61).collect();
    let gauges: Vec<Gauge> = (sites.iter())
        .flat_map(|&s| moved(&all.sites[s].gauge))
        .collect();
    let model = simulated.model().unwrap();
    let read = dataset::measure(&*model, &touches, &gauges, Signal::Strain, &unwatched);
    let (read, _) = read.unwrap();
    // Metres twice, and a radian. Half a millimetre is not three quarters, which the slopes are taken over: strain has
    // kinks where elements meet.
    let steps = [1e-3, 1e-3, 2_f64.to_radians()];
    for (kind, (step, limit)) in steps.into_iter().zip([0.25, 0.25, 0.02]).enumerate() {
        let (mut apart, mut whole) = (0.0, 0.0);
        for (i, &site) in sites.iter().enumerate() {
            let [forth, back] = [0, 1].map(|side| read.row(6 * i + 2 * kind + side));
            let differences = forth.iter().zip(back).map(|(f, b)| (f - b) / step);
            for (difference, &slope) in differences.zip(slopes.row(site)[kind]) {
                apart += (difference - f64::from(slope)).powi(2);
                whole += difference * difference;
            }
        }
        let share = (apart / whole).sqrt();
        assert!(share < limit, "{kind}: {share}");
    }
    assert_eq!(
        slopes.columns().touches(),
        (0..200_usize).collect::<Vec<_>>()
    );
    let (other, budget) = small(Signal::NormalDisplacement);
    let simulated = design::simulate(&other, &budget, &unwatched).unwrap();
    assert!(simulated.dataset.slopes.is_none());
}

#[test]
fn one_thread_or_many_give_the_same_bytes() {
    let (inputs, budget) = small(Signal::Strain);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let design = pool
            .install(|| {
                design::run(
                    &design::DesignRequest {
                        inputs: &inputs,
                        kinds: &SelectorKind::ALL,
                        budget: &budget,
                    },
                    &|| 0.0,
                    &unwatched,
                )
            })
            .unwrap();
        let bits: Vec<u64> = design
            .simulated
            .dataset
            .x
            .values()
            .iter()
            .map(|x| x.to_bits())
            .collect();
        let errors: Vec<u64> = design
            .evaluation
            .rows
            .iter()
            .map(|r| r.error_mm.to_bits())
            .collect();
        (
            bits,
            design
                .selections
                .iter()
                .map(|s| s.sets.clone())
                .collect::<Vec<_>>(),
            errors,
            design.work(),
            design.simulated.dataset.slopes.clone(),
        )
    };
    let one = run(1);
    for threads in [2, 8] {
        let many = run(threads);
        assert!(one.0 == many.0, "dataset on {threads} threads");
        assert_eq!(one.1, many.1);
        assert_eq!(one.2, many.2);
        assert_eq!(one.3, many.3);
        assert!(one.4 == many.4, "slopes on {threads} threads");
    }
}

#[test]
fn the_work_is_counted_and_nothing_is_done_twice() {
    // Every fourth of 200 touches.
    const SAMPLE: u64 = 50;
    let (inputs, budget) = small(Signal::Displacement);
    let mut budget = budget;
    budget.elements.most_vertices = budget.elements.vertices;
    let simulated = Arc::new(design::simulate(&inputs, &budget, &unwatched).unwrap());
    let work = simulated.dataset.work;
    assert_eq!(
        (work.assemblies, work.factorizations, work.solves),
        // An even mesh, a graded one, and that one halved; on each the sample of the loads, then all; and
        // never anew for more vertices, since they are spent.
        (3, 3, 3 * SAMPLE + 200)
    );
    let design = design::run_from(
        &design::DesignRequest {
            inputs: &inputs,
            kinds: &SelectorKind::ALL,
            budget: &budget,
        },
        simulated,
        &|| 0.0,
        &unwatched,
    )
    .unwrap();
    let total = design.work();
    // The reference is the only other model, and on it what takes least is solved for.
    let truth = design.reference.work;
    assert_eq!((truth.assemblies, truth.factorizations), (1, 1));
    assert!(truth.solves <= 60, "{truth:?}");
    assert_eq!(total.assemblies, work.assemblies + 1);
    assert_eq!(total.solves, work.solves + truth.solves);
}

#[test]
fn training_knows_nothing_of_the_test_touches() {
    // The same training data give the same predictions whatever is asked, in whatever company.
    let x = SignalMatrix::new(30, (0..60).map(|i| f64::from(i).sin()).collect());
    let targets: Vec<[f64; 3]> = (0..30)
        .map(|t| [f64::from(t), 1.0, -f64::from(t)])
        .collect();
    let effort = Effort {
        tolerance: 1e-6,
        max_steps: 100_000,
    };
    let model = PositionModel::train(&x, &targets, &Hyper::default(), effort);
    let asked = SignalMatrix::new(2, vec![0.1, 0.9, 0.2, -0.4]);
    let alone = SignalMatrix::new(1, vec![0.1, 0.2]);
    assert_eq!(model.predict(&asked)[0], model.predict(&alone)[0]);
}

#[test]
fn what_the_project_asks_of_a_choice_is_kept() {
    let (mut inputs, budget) = small(Signal::Strain);
    inputs.project.gauge.directions = 2;
    let selection = &mut inputs.project.selection;
    selection.spacing_mm = 15.0;
    selection.cost_budget = Some(4.0);
    // The lower half is dear.
    selection.costs.push(hapdef::project::CostKeys {
        box_mm: [[-1e3, -1e3, -1e3], [1e3, 1e3, 60.0]],
        box_axis: None,
        cost: 3.5,
    });
    let simulated = Arc::new(design::simulate(&inputs, &budget, &unwatched).unwrap());
    let sites = &simulated.dataset.sites;
    for pair in sites.chunks_exact(2) {
        assert_eq!(pair[0].gauge.position, pair[1].gauge.position);
        assert!(pair[0].gauge.direction.dot(pair[1].gauge.direction).abs() < 1e-9);
        assert!(pair[0].rms_strain >= pair[1].rms_strain);
    }
    let feasibility = design::filter(&inputs, &simulated);
    let reduced = design::reduce_sites(&inputs, &simulated, &feasibility, &budget).unwrap();
    for kind in SelectorKind::ALL {
        let chosen = design::Choosing {
            inputs: &inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget: &budget,
            watch: &unwatched,
        }
        .select(kind)
        .unwrap();
        let set = &chosen.sets.last().unwrap().sites;
        let cost = |s: &usize| {
            if sites[*s].gauge.position.z <= 0.06 {
                3.5
            } else {
                1.0
            }
        };
        assert!(set.iter().map(cost).sum::<f64>() <= 4.0, "{kind:?}");
        for (k, a) in set.iter().enumerate() {
            for b in &set[..k] {
                let apart = sites[*a].gauge.position.distance(sites[*b].gauge.position);
                assert!(apart == 0.0 || apart >= 0.015, "{kind:?}: {apart}");
            }
        }
    }
    // What not even one gauge fits into is refused: a report of none would be handed on.
    let mut poor = inputs.clone();
    poor.project.selection.cost_budget = Some(0.1);
    for kind in SelectorKind::ALL {
        let none = design::Choosing {
            inputs: &poor,
            simulated: &simulated,
            reduced: &reduced,
            budget: &budget,
            watch: &unwatched,
        }
        .select(kind);
        let why = none.expect_err(kind.name()).to_string();
        assert!(why.contains("raise the budget"), "{kind:?}: {why}");
    }
    let choose = |inputs: &Inputs, kind| {
        design::Choosing {
            inputs,
            simulated: &simulated,
            reduced: &reduced,
            budget: &budget,
            watch: &unwatched,
        }
        .select(kind)
        .unwrap()
    };
    let clean = choose(&inputs, SelectorKind::GreedySvr);
    inputs.project.gauge.noise_microstrain = 50.0;
    assert_eq!(choose(&inputs, SelectorKind::GreedySvr).sets, clean.sets);
    inputs.project.selection.with_noise = true;
    let noisy = choose(&inputs, SelectorKind::GreedySvr);
    let [noisy, clean] = [&noisy, &clean].map(|s| s.sets[2].criterion.unwrap());
    assert!(noisy > 1.05 * clean);
    inputs.project.gauge.directions = 2;
    inputs.project.gauge.signal = Signal::Displacement;
    assert!(design::simulate(&inputs, &budget, &unwatched).is_err());
}

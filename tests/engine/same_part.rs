//! The same part gets the same elements, however its file orders it, wherever it lies and in whatever unit it is
//! written; and what is held stays with the vertices that were named.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Budget, BudgetLimits, Quality, unwatched};
use hapdef::design::{self, Inputs};
use hapdef::elasticity::grade::ShellGround;
use hapdef::elasticity::solid::ground::SolidGround;
use hapdef::elasticity::support::HeldRegion;
use hapdef::elasticity::{DofSet, ElasticError, Material, ShellSection, Support, Touch};
use hapdef::given::{self, GivenSite};
use hapdef::io::mesh_file::read_mesh;
use hapdef::limb::{BoxMm, LimbSpec, LimbSupport};
use hapdef::mesh::TriMesh;
use hapdef::mesh::oriented_box::OrientedBox;
use hapdef::mesh::repair::Repair;
use hapdef::mesh::unroll::Axis;
use hapdef::project::{Masks, Project, SupportKeys, SupportKind, Unit};

const SECTION: ShellSection = ShellSection {
    material: Material {
        youngs_modulus: 1.7e9,
        poissons_ratio: 0.35,
    },
    thickness: 1.5e-3,
};

/// A small slotted tube, held at both rims.
fn tube() -> (TriMesh, Vec<BoxMm>) {
    let spec = LimbSpec {
        circumference: 120.0,
        height: 60.0,
        columns: vec![15.0, 45.0, 75.0, 105.0],
        column_width: 10.0,
        hoops: vec![(0.0, 8.0), (26.0, 34.0), (52.0, 60.0)],
        support: LimbSupport::Rims { depth: 5.0 },
        element: 4.0,
        ..LimbSpec::default()
    };
    spec.build().unwrap()
}

/// The numbers below `count` in an order that the seed decides; 0 leaves them as they are.
fn shuffled(count: usize, seed: u64) -> Vec<u32> {
    let mut numbers: Vec<u32> = (0..count as u32).collect();
    if seed == 0 {
        return numbers;
    }
    let mut state = seed;
    for i in (1..count).rev() {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        numbers.swap(i, (state >> 33) as usize % (i + 1));
    }
    numbers
}

/// The same surface with vertices and triangles in another order and corners turned.
fn reordered(mesh: &TriMesh, seed: u64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let old = shuffled(mesh.positions().len(), seed);
    let mut new = vec![0; old.len()];
    for (number, &v) in (0u32..).zip(&old) {
        new[v as usize] = number;
    }
    let order = shuffled(mesh.triangles().len(), seed);
    let triangles = order.iter().map(|&t| {
        let mut tri = mesh.triangles()[t as usize].map(|v| new[v as usize]);
        if seed > 0 {
            tri.rotate_left(t as usize % 3);
        }
        tri
    });
    let positions = old.iter().map(|&v| mesh.positions()[v as usize]);
    (positions.collect(), triangles.collect())
}

/// How the tube is written to its file.
#[derive(Clone, Copy)]
struct Written {
    seed: u64,
    shift_mm: DVec3,
    unit: Unit,
}

const AS_IT_IS: Written = Written {
    seed: 0,
    shift_mm: DVec3::ZERO,
    unit: Unit::Millimetre,
};

/// What came back of it.
struct Computed {
    triangles: usize,
    displacements: Vec<DVec3>,
    strains: Vec<f64>,
}

fn part(written: Written) -> TriMesh {
    let (positions, triangles) = reordered(&tube().0, written.seed);
    let to_mm = if written.unit == Unit::Metre {
        1e3
    } else {
        1.0
    };
    let mut text = String::new();
    for p in positions {
        let p = (p * 1e3 + written.shift_mm) / to_mm;
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tube.obj");
    std::fs::write(&path, text).unwrap();
    read_mesh(&path, Some(written.unit), 0, Repair::default())
        .unwrap()
        .mesh
}

fn inputs(written: Written) -> Inputs {
    let mut project = Project::around("tube.obj", Some(written.unit));
    project.part.thickness_mm = SECTION.thickness * 1e3;
    for corners in tube().1 {
        let moved = corners.map(|c| (DVec3::from_array(c) + written.shift_mm).to_array());
        project.supports.push(SupportKeys {
            kind: SupportKind::Clamped,
            box_mm: Some(moved),
            box_axis: None,
            vertices: None,
            normal: Axis::Z,
            bedding_n_per_mm3: None,
        });
    }
    Inputs {
        project,
        part: Arc::new(part(written)),
        painted: None,
        masks: Masks::new(),
    }
}

/// Places between the rims, none of them where two facets are as near as each other, with the outside's direction.
fn places(count: usize, first: usize) -> Vec<(DVec3, DVec3)> {
    let (mesh, _) = tube();
    let free: Vec<u32> = (0..mesh.triangles().len() as u32)
        .filter(|&t| (0.01..0.05).contains(&mesh.corners(t)[0].z))
        .collect();
    (0..count)
        .map(|k| {
            let t = free[(first + 37 * k) % free.len()];
            let [a, b, c] = mesh.corners(t);
            (a * 0.51 + b * 0.29 + c * 0.2, mesh.facet_normal(t))
        })
        .collect()
}

fn computed(written: Written) -> Computed {
    let shift = written.shift_mm * 1e-3;
    let touches: Vec<Touch> = (places(6, 5).into_iter())
        .map(|(place, normal)| Touch {
            position: place + shift,
            normal,
            force: 1.0,
            tip_radius: 3e-3,
        })
        .collect();
    let sites: Vec<GivenSite> = (places(12, 11).into_iter())
        .map(|(place, _)| GivenSite {
            position: place + shift,
            direction: DVec3::Z,
        })
        .collect();
    let limits = BudgetLimits {
        vertices: Some(1200),
        ..BudgetLimits::default()
    };
    let budget: Budget = Quality::Draft.budget().within(&limits);
    let answer = given::answer(&inputs(written), &touches, &sites, &budget, &unwatched).unwrap();
    Computed {
        triangles: answer.model.mesh().triangles().len(),
        displacements: answer.pairs().map(|p| p.displacement).collect(),
        strains: answer.pairs().map(|p| p.strain).collect(),
    }
}

/// The largest departure over the largest value, of displacements and of strains.
fn departures(found: &Computed, from: &Computed) -> [f64; 2] {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let pairs = found.displacements.iter().zip(&from.displacements);
    let moved = largest(&mut pairs.map(|(a, b)| a.distance(*b)));
    let pairs = found.strains.iter().zip(&from.strains);
    let strained = largest(&mut pairs.map(|(a, b)| (a - b).abs()));
    [
        moved / largest(&mut from.displacements.iter().map(|u| u.length())),
        strained / largest(&mut from.strains.iter().map(|e| e.abs())),
    ]
}

#[test]
fn the_same_part_gets_the_same_elements() {
    let here = computed(AS_IT_IS);
    let shift_mm = DVec3::new(1250.0, -700.0, 3000.0);
    let others = [
        ("another order", 1, DVec3::ZERO, Unit::Millimetre),
        ("a third order", 2, DVec3::ZERO, Unit::Millimetre),
        ("shifted", 0, shift_mm, Unit::Millimetre),
        ("in metres", 0, DVec3::ZERO, Unit::Metre),
        ("all of it", 3, shift_mm, Unit::Metre),
    ];
    for (what, seed, shift_mm, unit) in others {
        let there = computed(Written {
            seed,
            shift_mm,
            unit,
        });
        let [moved, strained] = departures(&there, &here);
        println!("{what}: displacements {moved:.1e}, strains {strained:.1e}");
        assert_eq!(there.triangles, here.triangles, "{what}");
        assert!(
            moved < 1e-6 && strained < 1e-6,
            "{what}: {moved} {strained}"
        );
    }
}

#[test]
fn the_same_part_is_touched_at_the_same_places() {
    let drawn = |seed: u64| {
        let mut inputs = inputs(Written { seed, ..AS_IT_IS });
        inputs.project.touch.count = 30;
        inputs.project.sites.spacing_mm = 6.0;
        let simulated = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched).unwrap();
        let sites = simulated.points.iter().map(|&at| simulated.mesh.point(at));
        let touches = simulated.dataset.touches.iter().map(|t| t.position);
        (touches.collect::<Vec<_>>(), sites.collect::<Vec<_>>())
    };
    let (here, there) = (drawn(0), drawn(4));
    assert_eq!(here.0, there.0);
    assert_eq!(here.1, there.1);
}

/// The lower hoop up to 8 mm as a mask of the vertices.
fn lower_hoop(positions: &[DVec3]) -> Support {
    let mask = positions.iter().map(|p| p.z < 8.001e-3).collect();
    Support {
        region: HeldRegion::Vertices(Arc::new(mask)),
        held: DofSet::ALL,
        bedding: None,
    }
}

#[test]
fn a_mask_holds_the_same_places_in_any_order() {
    for seed in 0..3 {
        let (positions, triangles) = reordered(&tube().0, seed);
        let (part, _) = TriMesh::new(&positions, &triangles, 0).unwrap();
        let support = lower_hoop(part.positions());
        let ground = ShellGround::new(&Arc::new(part), SECTION, &[support], false);
        assert!(ground.check_held().is_ok());
        let remeshed = ground.even(500);
        for remeshed in [ground.halved(&remeshed), remeshed] {
            let held = ground.held(&remeshed);
            for (p, held) in remeshed.mesh.positions().iter().zip(held) {
                assert_eq!(held == DofSet::ALL, p.z < 8.001e-3, "{seed}: {p}");
            }
        }
    }
}

#[test]
fn a_solid_answers_the_same_in_any_order() {
    let whole = crate::bench::solids::tube(0.012, 0.02, 0.05, 16);
    let touch = Touch {
        position: DVec3::new(0.0, 0.02, 0.04),
        normal: DVec3::Y,
        force: 10.0,
        tip_radius: 4e-3,
    };
    let found_at = |seed: u64, off: DVec3| {
        let (mut positions, triangles) = reordered(&whole, seed);
        for p in &mut positions {
            *p += off;
        }
        let touch = Touch {
            position: touch.position + off,
            ..touch
        };
        let (part, _) = TriMesh::new(&positions, &triangles, 0).unwrap();
        let is_foot = |p: &DVec3| p.z - off.z < 1e-9;
        let mask = part.positions().iter().map(is_foot).collect();
        let foot = Support {
            region: HeldRegion::Vertices(Arc::new(mask)),
            held: DofSet::ALL,
            bedding: None,
        };
        let told = |_: DVec3| None;
        let ground = SolidGround::new(
            &Arc::new(part),
            SECTION.material,
            &[foot],
            &told,
            &unwatched,
        );
        let ground = ground.unwrap();
        let model = ground.model(&ground.fineness(8e-3), &unwatched).unwrap();
        let moved = crate::bench::solids::under(&model, &touch);
        (ground.whole.positions().to_vec(), moved)
    };
    let found = |seed: u64| found_at(seed, DVec3::ZERO);
    let first = found(0);
    assert!(first.1 > 1e-7, "{}", first.1);
    for seed in 1..3 {
        assert_eq!(found(seed), first, "{seed}");
    }
    // Elsewhere it is computed where it lies: only rounding is another.
    let shifted = found_at(0, DVec3::new(0.3, -0.7, 1.1)).1;
    assert!((shifted / first.1 - 1.0).abs() < 1e-6, "{shifted}");
}

#[test]
fn what_is_not_held_is_told_where_the_part_lies() {
    let (tube, _) = tube();
    let away = DVec3::new(5.0, -3.0, 2.0);
    let positions: Vec<DVec3> = tube.positions().iter().map(|&p| p + away).collect();
    let (part, _) = TriMesh::new(&positions, tube.triangles(), 0).unwrap();
    let part = Arc::new(part);
    let beside = Support {
        region: HeldRegion::Box(OrientedBox::of_file(DVec3::ZERO, DVec3::ONE)),
        held: DofSet::ALL,
        bedding: None,
    };
    let ground = ShellGround::new(&part, SECTION, &[beside], false);
    let Err(ElasticError::NothingHeld { lower, upper }) = ground.check_held() else {
        panic!("nothing holds it");
    };
    let (least, most) = part.bounds();
    assert!(lower.distance(least) < 1e-6, "{lower}");
    assert!(upper.distance(most) < 1e-6, "{upper}");
}

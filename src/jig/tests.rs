//! On the bundled limb, and on limbs that a jig cannot do everything in.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::shapes::closed;
use super::*;
use crate::budget::unwatched;
use crate::gauge::Gauge;
use crate::limb::LimbSpec;
use crate::mesh::stance::Stance;
use crate::mesh::{Facets, TriMesh};

const HALF_FILM: DVec2 = DVec2::new(6.3, 3.0);

/// The bundled limb with ten gauges, some of them at one height.
fn limb() -> (TriMesh, Vec<PressedGauge>) {
    const PLACES: [(f64, f64); 10] = [
        (34.0, 177.0),
        (66.0, 49.0),
        (20.0, 52.0),
        (99.0, -53.0),
        (8.0, 151.0),
        (112.0, 177.0),
        (62.0, 177.0),
        (8.0, -155.0),
        (112.0, 139.0),
        (26.0, -53.0),
    ];
    let (mesh, _) = LimbSpec::default().build().unwrap();
    let gauges = (1..).zip(PLACES).map(|(number, (height, degrees))| {
        let way = DVec2::from_angle(f64::to_radians(degrees)) * 0.04;
        let (at, _) = mesh.index().nearest(way.extend(height * 1e-3));
        let out = mesh.normal(at);
        PressedGauge {
            number,
            gauge: Gauge::on(
                &mesh,
                at,
                DVec3::Z + out.cross(DVec3::Z) * f64::from(number as u32 % 3),
            ),
        }
    });
    let gauges = gauges.collect();
    (mesh, gauges)
}

fn of(face: &TriMesh, part: &TriMesh) -> Wall {
    Wall {
        face: Arc::new(face.clone()),
        part: Arc::new(part.clone()),
        stance: Stance::about(DVec3::Z),
    }
}

/// The one that stands for all that hang together with one.
fn root<K: Copy + Eq + std::hash::Hash>(of: &HashMap<K, K>, mut k: K) -> K {
    while of[&k] != k {
        k = of[&k];
    }
    k
}

/// Whether every edge has one facet on each side, and all facets hang together.
fn is_one_closed_body(solid: &Facets) -> bool {
    let key = |v: u32| solid.positions[v as usize].to_array().map(f64::to_bits);
    let mut edges = HashMap::new();
    let mut piece: HashMap<_, _> = HashMap::new();
    for t in &solid.triangles {
        for k in 0..3 {
            let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
            *edges.entry((a, b)).or_insert(0) += 1;
            piece.insert(a, a);
        }
    }
    let paired = edges
        .iter()
        .all(|(&(a, b), n)| edges.get(&(b, a)) == Some(n));
    for &(a, b) in edges.keys() {
        let (a, b) = (root(&piece, a), root(&piece, b));
        piece.insert(a, b);
    }
    let roots = piece.keys().filter(|&&k| piece[&k] == k).count();
    paired && roots == 1
}

#[test]
fn every_piece_is_one_closed_body_and_none_runs_into_another() {
    let (mesh, gauges) = limb();
    let jig = plan(of(&mesh, &mesh), &gauges, HALF_FILM, &unwatched).unwrap();
    assert!(jig.left_out.is_empty(), "{:?}", jig.left_out);
    let arms: Vec<usize> = jig
        .stacks
        .iter()
        .flat_map(|s| &s.arms)
        .map(|a| a.number)
        .collect();
    assert_eq!(arms.len(), gauges.len());
    for stack in &jig.stacks {
        let parts = parts(&jig, stack);
        for part in &parts {
            assert!(is_one_closed_body(&part.solid), "{}", part.name);
            assert!(
                part.solid.volume() > 50.0,
                "{}: {}",
                part.name,
                part.solid.volume()
            );
        }
        let shapes: Vec<_> = parts.iter().map(|p| closed(&p.solid)).collect();
        for (i, one) in shapes.iter().enumerate() {
            for (j, other) in shapes.iter().enumerate().skip(i + 1) {
                let both = one.intersection(other).volume();
                let names = (&parts[i].name, &parts[j].name);
                assert!(both < 0.05, "{names:?} share {both} mm³");
            }
        }
    }
}

#[test]
fn pads_press_gauges_where_they_belong() {
    let (mesh, gauges) = limb();
    let jig = plan(of(&mesh, &mesh), &gauges, HALF_FILM, &unwatched).unwrap();
    for stack in &jig.stacks {
        for arm in &stack.arms {
            let glued = gauges.iter().find(|g| g.number == arm.number).unwrap();
            // The middle of the face lies the gap before the gauge.
            let middle = arm.pad.grid().position(|at| at == DVec2::ZERO).unwrap();
            let face = arm.pad.point(DVec2::ZERO, arm.pad.face[middle]);
            let place = stack.frame.here(glued.gauge.position);
            let out = stack.frame.way(glued.gauge.normal);
            let off = place - face;
            assert!((off.dot(out) - jig.sizes.gap).abs() < 0.15, "{off}");
            assert!(
                off.dot(arm.pad.along).abs() < 0.1 && off.z.abs() < 0.1,
                "{off}"
            );
            // And all of it keeps off the wall by about as much.
            for (at, d) in arm.pad.grid().zip(&arm.pad.face) {
                let point = stack.frame.out_of(arm.pad.point(at, *d));
                let far = mesh.index().nearest(point).1 * 1e3;
                assert!(far > 0.6 * jig.sizes.gap, "{far} mm at {at}");
            }
        }
    }
}

#[test]
fn what_is_in_the_way_is_found_and_said() {
    let (mesh, whole) = limb();
    // A plate across the tube at half its height: what lies on either side is reached from there.
    let across = |height: f64| {
        let mut positions = mesh.positions().to_vec();
        let mut triangles = mesh.triangles().to_vec();
        let first = positions.len() as u32;
        positions.extend([
            DVec3::new(-0.2, -0.2, height),
            DVec3::new(0.2, -0.2, height),
            DVec3::new(0.2, 0.2, height),
            DVec3::new(-0.2, 0.2, height),
        ]);
        triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| v + first)));
        TriMesh::from_checked(positions, triangles)
    };
    let (low, high) = mesh.bounds();
    let jig = plan(
        of(&mesh, &across(f64::midpoint(low.z, high.z))),
        &whole,
        HALF_FILM,
        &unwatched,
    )
    .unwrap();
    let entries: Vec<Entry> = jig.stacks.iter().map(|s| s.entry).collect();
    assert!(
        entries.contains(&Entry::Foot) && entries.contains(&Entry::Top),
        "{entries:?}"
    );
    for stack in &jig.stacks {
        for arm in &stack.arms {
            let z = whole[arm.number - 1].gauge.position.z;
            assert_eq!(
                z < f64::midpoint(low.z, high.z),
                stack.entry == Entry::Foot,
                "{z}"
            );
        }
    }
    // Both ends closed: nothing gets in, and every gauge says why.
    let mut shut = across(low.z + 1e-4);
    let lid = across(high.z - 1e-4);
    let more = lid.positions().len() - 4;
    let first = shut.positions().len() as u32;
    let mut positions = shut.positions().to_vec();
    positions.extend(&lid.positions()[more..]);
    let mut triangles = shut.triangles().to_vec();
    triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| v + first)));
    shut = TriMesh::from_checked(positions, triangles);
    let jig = plan(of(&mesh, &shut), &whole, HALF_FILM, &unwatched).unwrap();
    assert!(jig.stacks.is_empty());
    let numbers: Vec<usize> = jig.left_out.iter().map(|l| l.number).collect();
    assert_eq!(numbers, (1..=whole.len()).collect::<Vec<_>>());
    let said = jig.left_out[0].why.words();
    assert!(said.contains("in the way"), "{said}");
}

#[test]
fn gauges_that_are_too_near_to_each_other_are_pressed_in_turn() {
    let (mesh, gauges) = limb();
    let first = gauges[0];
    let mut second = PressedGauge { number: 2, ..first };
    second.gauge.position += DVec3::Z * 4e-3;
    let jig = plan(of(&mesh, &mesh), &[first, second], HALF_FILM, &unwatched).unwrap();
    assert_eq!(jig.stacks.len(), 2);
    assert!(jig.left_out.is_empty());
}

#[test]
fn what_a_filter_lets_through_is_reached() {
    let (mesh, gauges) = limb();
    let gauges: Vec<Gauge> = gauges.iter().map(|g| g.gauge).collect();
    let reach = RodReach::new(of(&mesh, &mesh), &gauges, HALF_FILM, &unwatched).unwrap();
    assert!(gauges.iter().all(|g| reach.gets_to(g)));
    // A gauge on a wall that looks along the axis cannot be pressed from it.
    let tilted = Gauge {
        normal: DVec3::new(0.3, 0.0, 0.95).normalize(),
        ..gauges[0]
    };
    assert!(!reach.gets_to(&tilted));
}

#[test]
fn a_rod_that_is_too_long_for_the_printer_comes_in_pieces() {
    let (mesh, gauges) = limb();
    let wall = of(&mesh, &mesh);
    let mut jig = plan(wall, &gauges, HALF_FILM, &unwatched).unwrap();
    jig.sizes.longest = 60.0;
    for stack in &jig.stacks {
        let mut rods = parts(&jig, stack);
        rods.retain(|part| part.name.starts_with("rod-"));
        assert!(rods.len() > 2, "{}", rods.len());
        for rod in &rods {
            assert!(is_one_closed_body(&rod.solid), "{}", rod.name);
            let along = rod.solid.positions.iter().map(|p| p.z);
            let (low, high) = along.fold((f64::MAX, f64::MIN), |(l, h), z| (l.min(z), h.max(z)));
            assert!(high - low <= 60.0, "{}: {}", rod.name, high - low);
        }
        for pair in rods.windows(2) {
            let [one, other] = [&pair[0], &pair[1]].map(|part| closed(&part.solid));
            assert!(one.intersection(&other).volume() < 0.05);
            // The peg reaches into the next piece.
            assert!(one.min_gap(&other, 1.0) < 0.3);
        }
    }
}

//! Which way a part stands: the axis that is found or set, and what follows it.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use hapdef::elasticity::support::HeldPart;
use hapdef::io::{project_file, svg};
use hapdef::mesh::TriMesh;
use hapdef::mesh::flatten::Flat;
use hapdef::mesh::oriented_box::OrientedBox;
use hapdef::mesh::stance::{Direction, Stance};
use hapdef::mesh::stretch::KEPT;
use hapdef::mesh::unroll::{Axis, Unrolling};
use hapdef::project::{CostKeys, Masks, PartAxis, Project, RegionKeys, SupportKeys, Unit, boxes};

const AROUND: usize = 48;

/// A body of revolution about z (m): its profile as radius over height.
fn turned(profile: impl Fn(f64) -> f64, height: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    const LEVELS: usize = 24;
    let ring = |j: usize| {
        let z = height * j as f64 / LEVELS as f64;
        let radius = profile(z);
        (0..AROUND).map(move |i| {
            let a = i as f64 / AROUND as f64 * std::f64::consts::TAU;
            DVec3::new(radius * a.cos(), radius * a.sin(), z)
        })
    };
    let points = (0..=LEVELS).flat_map(ring).collect();
    let at = |i: usize, j: usize| (j * AROUND + i % AROUND) as u32;
    let triangles = (0..LEVELS)
        .flat_map(|j| {
            (0..AROUND).flat_map(move |i| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
        })
        .collect();
    (points, triangles)
}

fn mesh(points: &[DVec3], triangles: &[[u32; 3]], turn: DQuat) -> TriMesh {
    let points: Vec<DVec3> = points.iter().map(|&p| turn * p + 0.4).collect();
    TriMesh::new(&points, triangles, 0).unwrap().0
}

fn tube(radius: f64, height: f64, turn: DQuat) -> TriMesh {
    let (points, triangles) = turned(|_| radius, height);
    mesh(&points, &triangles, turn)
}

/// A closed box from the origin.
fn closed_box(size: DVec3) -> TriMesh {
    let points: Vec<DVec3> = (0..8)
        .map(|k| size * DVec3::new(f64::from(k & 1), f64::from((k >> 1) & 1), f64::from(k >> 2)))
        .collect();
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles: Vec<[u32; 3]> = (faces.iter())
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    TriMesh::new(&points, &triangles, 0).unwrap().0
}

fn up(mesh: &TriMesh) -> DVec3 {
    Stance::of(mesh).up()
}

/// Turns z to a direction.
fn onto(direction: DVec3) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, direction.normalize())
}

#[test]
fn a_tube_stands_along_its_axis_however_long_it_is_and_however_it_lies() {
    for height in [0.2, 0.02] {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            assert_eq!(up(&tube(0.03, height, onto(axis))), axis);
        }
        let oblique = DVec3::new(-0.5, 0.8, 0.6).normalize();
        for direction in [oblique, -oblique] {
            let found = up(&tube(0.03, height, onto(direction)));
            assert!(found.distance(oblique) < 1e-6, "{height}: {found}");
        }
        // A few degrees off an axis of its coordinates it is meant along that.
        let leaning = DVec3::new(0.08, 1.0, -0.05);
        assert_eq!(up(&tube(0.03, height, onto(leaning))), DVec3::Y);
    }
}

#[test]
fn what_sticks_out_at_one_end_does_not_tilt_the_axis() {
    let (mut points, triangles) = turned(|_| 0.03, 0.15);
    // A boss of 60 mm at the upper end: the longest principal axis leans to it by 33°.
    for p in &mut points {
        if p.z > 0.11 && p.y.atan2(p.x).abs() < 0.4 {
            (p.x, p.y) = (3.0 * p.x, 3.0 * p.y);
        }
    }
    let part = mesh(&points, &triangles, onto(DVec3::Y));
    assert_eq!(up(&part), DVec3::Y);
    // Nor where the file has it in no direction of its own.
    let oblique = DVec3::new(0.5, 0.6, -0.5).normalize();
    let found = up(&mesh(&points, &triangles, onto(oblique)));
    assert!(found.dot(oblique) > 3_f64.to_radians().cos(), "{found}");
}

#[test]
fn of_directions_that_are_as_good_the_longest_is_up_and_then_z() {
    assert_eq!(up(&closed_box(DVec3::ONE)), DVec3::Z);
    assert_eq!(up(&closed_box(DVec3::new(3.0, 2.0, 1.0))), DVec3::X);
    assert_eq!(up(&closed_box(DVec3::new(1.0, 1.0, 4.0))), DVec3::Z);
    // A plate is as thin along both of its sides.
    let plate = |x: f64, y: f64| {
        let points = [
            DVec3::ZERO,
            DVec3::X * x,
            DVec3::new(x, y, 0.0),
            DVec3::Y * y,
        ];
        TriMesh::new(&points, &[[0, 1, 2], [0, 2, 3]], 0).unwrap().0
    };
    assert_eq!(up(&plate(2.0, 1.0)), DVec3::X);
    assert_eq!(up(&plate(1.0, 1.0)), DVec3::Y);
}

#[test]
fn the_views_of_a_report_are_of_the_part() {
    for up in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 0.5)] {
        let stance = Stance::about(up);
        assert!(stance.up().distance(up.normalize()) < 1e-12);
        assert!(stance.front().dot(stance.up()).abs() < 1e-12);
        let views = svg::standard_views(stance);
        assert_eq!(views.map(|v| v.name), ["front", "right", "back", "left"]);
        for view in &views {
            assert_eq!(view.up, stance.up());
        }
        // What is on the right of who looks from in front is seen from the right.
        let right = views[0].up.cross(views[0].toward).normalize();
        assert!(views[1].toward.dot(right) > 0.9);
    }
    assert_eq!(Stance::about(DVec3::Z).front(), DVec3::X);
}

#[test]
fn a_barrel_says_where_its_lengths_are_not_kept_and_a_tube_keeps_them() {
    let straight = Flat::of(&tube(0.03, 0.1, onto(DVec3::Y)), Stance::about(DVec3::Y));
    assert!(straight.stretch.off < 1e-12 && straight.stretch.most < 0.01);
    assert!(straight.stretch.words().contains("kept"));
    assert!((straight.upper - straight.lower).y - 0.1 < 1e-9);

    // Half as wide again in the middle as at both ends.
    let profile = |z: f64| 0.02 + 0.01 * (1.0 - (z / 0.05 - 1.0).powi(2));
    let (points, triangles) = turned(profile, 0.1);
    let flat = Flat::of(
        &mesh(&points, &triangles, DQuat::IDENTITY),
        Stance::about(DVec3::Z),
    );
    let stretch = &flat.stretch;
    assert!(stretch.off > 0.2 && stretch.off < 0.8, "{}", stretch.off);
    assert!(
        stretch.most > 0.15 && stretch.most < 0.6,
        "{}",
        stretch.most
    );
    assert!(stretch.words().contains("Hatched"), "{}", stretch.words());
    // The belly, where most of it is, is kept; the ends are said to be off.
    let vertices = flat.stretch_at_vertices();
    for (p, off) in flat.positions.iter().zip(vertices) {
        let along = (p.y - flat.lower.y) / (flat.upper.y - flat.lower.y);
        if (0.4..0.6).contains(&along) {
            assert!(off < KEPT, "{along}: {off}");
        } else if !(0.1..0.9).contains(&along) {
            assert!(off > KEPT, "{along}: {off}");
        }
    }
    let values = vec![0.0; points.len()];
    let picture = svg::unrolled(&flat, svg::Paint::Tint(&values), &[], 900.0);
    assert!(picture.contains("url(#stretched)"));
}

#[test]
fn a_frame_inside_neither_moves_nor_shrinks_the_unrolled_wall() {
    let (mut points, mut triangles) = turned(|_| 0.03, 0.1);
    let (inner, more) = turned(|_| 0.008, 0.1);
    let first = points.len() as u32;
    points.extend(inner.iter().map(|p| p + DVec3::X * 0.01));
    triangles.extend(more.iter().map(|t| t.map(|v| first + v)));
    // A floor holds both together.
    for i in 0..AROUND as u32 {
        let next = (i + 1) % AROUND as u32;
        triangles.extend([[i, first + i, next], [next, first + i, first + next]]);
    }
    let part = mesh(&points, &triangles, DQuat::IDENTITY);
    let unrolling = Unrolling::of(&part, Stance::about(DVec3::Z));
    assert!(
        (unrolling.radius - 0.03).abs() < 1e-6,
        "{}",
        unrolling.radius
    );
    let middle = unrolling.origin - DVec3::splat(0.4);
    assert!(middle.truncate().length() < 1e-6, "{middle}");
    // What lies behind the wall is not seen, and says nothing of the view.
    let flat = Flat::of(&part, Stance::about(DVec3::Z));
    assert!(flat.stretch.off < 1e-12, "{}", flat.stretch.off);
}

#[test]
fn a_new_support_is_a_slice_at_the_lower_end() {
    let part = tube(0.03, 0.2, onto(DVec3::Y));
    let (lower, upper) = part.bounds();
    let stance = Stance::of(&part);
    let (low, high) = stance.lower_end(&part, 0.05).along_axes().unwrap();
    assert!(low.distance(lower) < 1e-9, "{low} {lower}");
    let expected = DVec3::new(upper.x, lower.y + 0.01, upper.z);
    assert!(high.distance(expected) < 1e-9, "{high} {expected}");
}

#[test]
fn the_key_is_a_word_or_a_direction() {
    let read = |value: &str| {
        let text = format!("format = 1\n[part]\nmesh = \"a.stl\"\nunit = \"mm\"\n{value}");
        toml::from_str::<Project>(&text).map(|p| p.part.axis)
    };
    let axis = |value: &str| read(&format!("axis = {value}")).unwrap();
    assert_eq!(read("").unwrap(), PartAxis::Auto);
    assert_eq!(axis("\"auto\""), PartAxis::Auto);
    assert_eq!(axis("\"y\""), PartAxis::Coordinate(Axis::Y));
    assert_eq!(axis("[0, 1, -0.5]"), PartAxis::Along([0.0, 1.0, -0.5]));
    for wrong in ["\"w\"", "[0, 1]", "[0, 1, 0, 0]", "3", "[\"x\", 0, 0]"] {
        let said = read(&format!("axis = {wrong}")).unwrap_err().to_string();
        assert!(said.contains("axis"), "{said}");
    }
    let said = read("axis = \"w\"").unwrap_err().to_string();
    assert!(said.contains("\"auto\", \"x\", \"y\", \"z\""), "{said}");

    let mut project = Project::around("a.stl", Some(Unit::Millimetre));
    assert_eq!(project.part.axis, PartAxis::Auto);
    for (direction, fine) in [
        ([0.0, -2.0, 0.1], true),
        ([0.0; 3], false),
        ([0.0, f64::NAN, 1.0], false),
        ([1e300, 0.0, 0.0], false),
    ] {
        project.part.axis = PartAxis::Along(direction);
        let checked = project.check().map_err(|e| e.to_string());
        assert_eq!(checked.is_ok(), fine, "{direction:?}: {checked:?}");
        if let Err(said) = checked {
            assert!(said.contains("part.axis"), "{said}");
        }
    }
}

/// What a support holds of a tube, as a share of its surface, and how long the border of that is.
fn held_share(part: &TriMesh, keys: SupportKeys) -> (f64, f64) {
    let mut project = Project::around("a.stl", Some(Unit::Millimetre));
    project.supports = vec![keys];
    let supports = project.supports(&Masks::new()).unwrap();
    let held = HeldPart::new(&Arc::new(part.clone()), &supports);
    let mesh = &held.mesh;
    let facets = (0..mesh.triangles().len() as u32).filter(|&t| held.facet_belongs(t, 0));
    let area: f64 = facets.map(|t| mesh.facet_area(t)).sum();
    let border = mesh.edges().iter().filter(|e| held.is_border(e));
    let length = border.map(|e| {
        let [a, b] = [e.a, e.b].map(|v| mesh.positions()[v as usize]);
        a.distance(b)
    });
    (area / part.area(), length.sum())
}

#[test]
fn a_new_support_is_turned_as_the_part_is() {
    let oblique = DVec3::new(0.5, 0.8, 0.6).normalize();
    let around = std::f64::consts::TAU * 0.03;
    for direction in [DVec3::X, DVec3::Y, DVec3::Z, oblique] {
        // Not at a row of vertices: the part is cut along the box, whichever way that lies.
        const SHARE: f64 = 0.13;
        let part = tube(0.03, 0.2, onto(direction));
        let stance = Stance::of(&part);
        let keys = SupportKeys::clamping(&stance.lower_end(&part, SHARE).grown(1e-5));
        assert_eq!(keys.box_axis.is_some(), direction == oblique);
        let again = keys.oriented_box().unwrap();
        let [low, high] = again.span(Direction::Up);
        if direction == oblique {
            assert!((high - low - 0.2 * SHARE - 2e-5).abs() < 1e-6);
        }
        let (share, border) = held_share(&part, keys);
        assert!((share - SHARE).abs() < 1e-3, "{direction}: {share}");
        assert!(
            (border / around - 1.0).abs() < 0.01,
            "{direction}: {border}"
        );
    }
}

#[test]
fn a_turned_box_is_kept_by_the_project_and_one_by_the_axes_writes_what_it_did() {
    let mut project = Project::around("a.stl", Some(Unit::Millimetre));
    let part = tube(0.03, 0.2, onto(DVec3::new(0.5, 0.8, 0.6)));
    let stance = Stance::of(&part);
    for stance in [Stance::default(), stance] {
        let held = stance.lower_end(&part, 0.05);
        project.supports = vec![SupportKeys::clamping(&held)];
        let text = project_file::to_text(&project);
        assert_eq!(text.contains("\nbox_axis = "), stance != Stance::default());
        assert_eq!(project_file::parse(&text).unwrap(), project);
    }
    for (axis, fine) in [
        ([0.0, -2.0, 0.1], true),
        ([0.0; 3], false),
        ([f64::NAN; 3], false),
    ] {
        project.supports[0].box_axis = Some(axis);
        let checked = project.check().map_err(|e| e.to_string());
        assert_eq!(checked.is_ok(), fine, "{axis:?}: {checked:?}");
        if let Err(said) = checked {
            assert!(said.contains("support.box_axis"), "{said}");
        }
    }
    project.supports[0].box_axis = Some([0.0, 0.0, 1.0]);
    project.supports[0].box_mm = None;
    project.supports[0].vertices = Some("rim".into());
    let said = project.check().map_err(|e| e.to_string());
    assert!(said.is_err_and(|said| said.contains("support.box_axis")));
}

#[test]
fn boxes_of_regions_and_costs_stand_as_the_part_does() {
    let part = tube(0.03, 0.2, onto(DVec3::new(0.5, 0.8, 0.6)));
    let whole = OrientedBox::around(&part, Stance::of(&part));
    let half = OrientedBox {
        lower: DVec3 {
            z: 0.5 * (whole.lower.z + whole.upper.z),
            ..whole.lower
        },
        ..whole
    };
    let (box_mm, box_axis) = boxes::keys(&half);
    let mut project = Project::around("a.stl", Some(Unit::Millimetre));
    project.evaluation.regions = vec![RegionKeys {
        name: "upper half".into(),
        box_mm,
        box_axis,
    }];
    project.selection.costs = vec![CostKeys {
        box_mm,
        box_axis,
        cost: 2.0,
    }];
    let text = project_file::to_text(&project);
    assert_eq!(text.matches("box_axis = ").count(), 2);
    let read = project_file::parse(&text).unwrap();
    assert_eq!(read, project);
    let region = &read.evaluation.regions[0];
    let region = boxes::oriented(&region.box_mm, region.box_axis);
    let inside = (part.positions().iter())
        .filter(|&&p| boxes::contains(&region, p))
        .count();
    let share = inside as f64 / part.positions().len() as f64;
    assert!((share - 0.5).abs() < 0.05, "{share}");
    for key in ["evaluation.region.box_axis", "selection.cost.box_axis"] {
        let mut wrong = project.clone();
        if key.starts_with("evaluation") {
            wrong.evaluation.regions[0].box_axis = Some([0.0; 3]);
        } else {
            wrong.selection.costs[0].box_axis = Some([0.0; 3]);
        }
        let said = wrong.check().unwrap_err().to_string();
        assert!(said.contains(key), "{said}");
    }
}

#[test]
fn images_and_halves_are_of_the_part_as_it_stands() {
    let direction = DVec3::new(0.5, 0.8, 0.6).normalize();
    let part = tube(0.03, 0.2, onto(direction));
    let around = OrientedBox::around(&part, Stance::of(&part));
    // The tube lies about (0.4, 0.4, 0.4), from there on along its axis.
    let middle = DVec3::splat(0.4) + direction * 0.1;
    for (number, d) in Direction::ALL.into_iter().enumerate() {
        let along = around.stance.direction(d);
        assert!((around.middle(d) - middle.dot(along)).abs() < 1e-4, "{d:?}");
        let p = middle + DVec3::new(0.01, -0.02, 0.03);
        let image = around.mirrored(p, d);
        assert!(around.mirrored(image, d).distance(p) < 1e-12);
        let moved = around.stance.coordinates(image - p);
        for other in (0..3).filter(|&other| other != number) {
            assert!(moved[other].abs() < 1e-12, "{d:?}: {moved}");
        }
        assert!(around.contains(part.positions()[0], 1e-12));
    }
    // By the file's axes for a part along z.
    let upright = OrientedBox::around(&tube(0.03, 0.2, DQuat::IDENTITY), Stance::default());
    let [front, right, up] = Direction::ALL.map(|d| upright.stance.direction(d));
    assert_eq!([front, right, up], DVec3::AXES);
    assert_eq!(upright.along_axes(), Some((upright.lower, upright.upper)));
}

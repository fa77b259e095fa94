//! Where touches come to a part, and where its gauges can go.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hapdef::budget::{Budget, Quality, unwatched};
use hapdef::cli;
use hapdef::design;
use hapdef::elasticity::Material;
use hapdef::elasticity::solid::ground::SolidGround;
use hapdef::feasible::SiteSurroundings;
use hapdef::mesh::mount::Mount;
use hapdef::mesh::reach::{FINGERTIP, Finger};
use hapdef::mesh::room::Room;
use hapdef::mesh::walls::WallSide;
use hapdef::mesh::{SurfacePoint, TriMesh};

/// Side of a voxel (m).
const CELL: f64 = 2e-3;
const NYLON: Material = Material {
    youngs_modulus: 1.7e9,
    poissons_ratio: 0.39,
};

/// The surface of all voxels of a block of so many that are filled.
fn voxels(counts: [i32; 3], filled: impl Fn([i32; 3]) -> bool) -> Arc<TriMesh> {
    let full = |p: [i32; 3]| (0..3).all(|a| (0..counts[a]).contains(&p[a])) && filled(p);
    let mut numbers: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let all = (0..counts[0])
        .flat_map(|i| (0..counts[1]).flat_map(move |j| (0..counts[2]).map(move |k| [i, j, k])));
    for p in all.filter(|&p| full(p)) {
        for (axis, up) in (0..3).flat_map(|a| [(a, 0), (a, 1)]) {
            let mut beyond = p;
            beyond[axis] += 2 * up - 1;
            if full(beyond) {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut corner = |du: i32, dv: i32| {
                let mut at = p;
                at[axis] += up;
                at[u] += du;
                at[v] += dv;
                *numbers.entry(at).or_insert_with(|| {
                    positions.push(DVec3::from_array(at.map(f64::from)) * CELL);
                    positions.len() as u32 - 1
                })
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if up == 1 {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, c, b], [a, d, c]]);
            }
        }
    }
    Arc::new(TriMesh::new(&positions, &triangles, 0).unwrap().0)
}

fn reaches(mesh: &TriMesh, radius: f64, at_mm: [f64; 3], normal: DVec3) -> bool {
    Finger::new(mesh, radius).reaches(DVec3::from_array(at_mm) * 1e-3, normal)
}

/// A closed box, 40 mm and walls of 2 mm, with a window of 12 mm in its roof, and a block on a post below it.
fn house() -> Arc<TriMesh> {
    voxels([20, 20, 20], |[i, j, k]| {
        let within = |low: i32, high: i32| (low..high).contains(&i) && (low..high).contains(&j);
        let wall = !within(1, 19) || !(1..19).contains(&k);
        let window = k == 19 && within(7, 13);
        let block = within(6, 14) && (6..10).contains(&k);
        let post = within(9, 11) && k < 6;
        (wall && !window) || block || post
    })
}

#[test]
fn a_window_lets_in_what_fits_through_it() {
    let house = house();
    let on_block = |radius: f64| reaches(&house, radius, [20.0, 20.0, 20.0], DVec3::Z);
    assert!(on_block(0.0) && on_block(1e-3) && on_block(4e-3));
    assert!(!on_block(FINGERTIP) && !on_block(0.1));
    // The house is touched from outside by any finger, from inside by none.
    for radius in [1e-3, FINGERTIP, 0.1] {
        assert!(reaches(&house, radius, [0.0, 20.0, 20.0], DVec3::NEG_X));
        assert!(!reaches(&house, radius, [2.0, 20.0, 20.0], DVec3::X));
        assert!(!reaches(&house, radius, [14.0, 14.0, 12.0], DVec3::NEG_Z));
    }
}

#[test]
fn a_narrow_gap_keeps_fingers_off_its_bottom() {
    // Two walls of 10 mm, 4 mm apart and 30 mm high, on a floor.
    let walls = voxels([12, 10, 20], |[i, _, k]| k < 5 || !(5..7).contains(&i));
    let bottom = |radius: f64| reaches(&walls, radius, [12.0, 10.0, 10.0], DVec3::Z);
    assert!(bottom(1e-3) && !bottom(FINGERTIP));
    let beside = |height: f64| reaches(&walls, 1e-3, [10.0, 10.0, height], DVec3::X);
    assert!(!beside(20.0), "deep in the gap");
    assert!(beside(39.9), "at its edge");
}

#[test]
fn a_pad_gets_round_corners_and_not_into_what_is_closed() {
    let house = house();
    let room = Room::of(&house, &unwatched).unwrap();
    let at = |mm: [f64; 3], normal| room.at(DVec3::from_array(mm) * 1e-3, normal);
    // Through the window, round the block, to the wall behind it.
    let wall = at([2.0, 20.0, 16.0], DVec3::X);
    assert!((2e-3..7e-3).contains(&wall), "{wall}");
    assert!(at([0.0, 20.0, 20.0], DVec3::NEG_X).is_infinite());
    let closed = voxels([20, 20, 20], |p| p.iter().any(|c| !(3..17).contains(c)));
    let room = Room::of(&closed, &unwatched).unwrap();
    let inside = room.at(DVec3::new(6e-3, 20e-3, 20e-3), DVec3::X);
    assert!(inside <= 0.0, "{inside}");
}

#[test]
fn what_is_closed_is_open_for_those_who_glue() {
    let closed = SiteSurroundings {
        behind: vec![true; 2],
        room: vec![0.0; 2],
    };
    assert!(closed.are_closed());
    assert_eq!(closed.opened().room, [f64::INFINITY; 2]);
    let open = SiteSurroundings {
        behind: vec![true; 2],
        room: vec![0.0, 3e-3],
    };
    assert_eq!(open.clone().opened(), open);
}

/// Share of a mesh's area where this holds of a facet's middle (mm) and normal.
fn share(mesh: &TriMesh, among: impl Fn(u32) -> bool, is: impl Fn(DVec3, DVec3) -> bool) -> f64 {
    let mut areas = [0.0; 2];
    for t in (0..mesh.triangles().len() as u32).filter(|&t| among(t)) {
        let middle = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        let at = usize::from(is(middle * 1e3, mesh.facet_normal(t)));
        areas[at] += mesh.facet_area(t);
    }
    areas[1] / (areas[0] + areas[1])
}

/// Which facets of the inside are the back of a wall that is touched.
fn behind(ground: &SolidGround) -> Vec<bool> {
    let middles: Vec<SurfacePoint> = (0..ground.inside.triangles().len() as u32)
        .map(|triangle| SurfacePoint {
            triangle,
            barycentric: [1.0 / 3.0; 3],
        })
        .collect();
    ground.behind(&middles)
}

/// A square tube, 40 × 40 × 72 mm with walls of 2 mm and windows of 12 mm all round, one end open, in the other a
/// floor of 6 mm with a rod of 12 mm standing on it.
fn framed_tube(windows: bool) -> Arc<TriMesh> {
    voxels([20, 20, 36], |[i, j, k]| {
        let within = |low: i32, high: i32| (low..high).contains(&i) && (low..high).contains(&j);
        let wall = !within(1, 19);
        let beside = |c: i32| (7..13).contains(&c);
        let window = windows && (beside(i) || beside(j)) && (12..18).contains(&k);
        (wall && !window) || k < 3 || within(7, 13)
    })
}

#[test]
fn touches_come_to_the_outside_and_gauges_to_the_back_of_it() {
    for windows in [true, false] {
        let part = framed_tube(windows);
        let ground = SolidGround::new(&part, NYLON, &[], &|_| None, &unwatched).unwrap();
        assert!((ground.reach.usual - 2e-3).abs() < 1e-4);
        assert!(ground.reach.walled);
        let beside = |p: DVec3| (p.x - 20.0).abs().max((p.y - 20.0).abs());
        let outside = share(&ground.outside, |_| true, |p, _| beside(p) > 19.5);
        assert!(outside > 0.97, "windows {windows}: {outside}");
        let backs = behind(&ground);
        let is_back = |t: u32| backs[t as usize];
        let inside = share(&ground.inside, is_back, |p, _| {
            (17.5..18.5).contains(&beside(p))
        });
        assert!(inside > 0.97, "windows {windows}: {inside}");
        // The rod is still there to be seen, and counted.
        let rod = share(&ground.whole, |_| true, |p, _| beside(p) < 6.5 && p.z > 7.0);
        assert!(rod > 0.05);
        let framed = ground.walls.sides.iter().filter(|&&s| s == WallSide::Frame);
        assert!(framed.count() > 100);
        let words = ground.reach.words(FINGERTIP).join(" ");
        assert!(words.contains("touch.reach_mm"), "{words}");
    }
}

#[test]
fn what_the_user_says_of_a_face_holds() {
    let part = framed_tube(false);
    let rod = |p: DVec3| (p.x - 0.02).abs().max((p.y - 0.02).abs()) < 6.5e-3 && p.z > 7e-3;
    let told = |p: DVec3| rod(p).then_some(WallSide::Inside);
    let ground = SolidGround::new(&part, NYLON, &[], &told, &unwatched).unwrap();
    let backs = behind(&ground);
    let on_rod = share(&ground.inside, |t| backs[t as usize], |p, _| rod(p * 1e-3));
    assert!(on_rod > 0.15, "{on_rod}");
}

/// What a part is fastened to keeps fingers off what it surrounds, and off nothing beside it.
#[test]
fn nothing_comes_through_what_a_part_is_fastened_to() {
    // A cup upside down: its floor, 4 mm above the rim that it stands on, could be touched from below.
    let cup = voxels([20, 20, 20], |[i, j, k]| {
        let wall = ![i, j].iter().all(|c| (1..19).contains(c));
        (wall && k < 20) || k == 2
    });
    let rim: Vec<u32> = (0u32..cup.triangles().len() as u32)
        .filter(|&t| cup.corners(t).iter().all(|p| p.z == 0.0))
        .collect();
    let mount = Mount::behind(&cup, &rim).unwrap();
    assert!(mount.normal.distance(DVec3::NEG_Z) < 1e-12);
    let reaches = |mounts: &[Mount], at_mm: [f64; 3], normal: DVec3| {
        let finger = Finger::new(&cup, 1e-3).around(mounts);
        finger.reaches(DVec3::from_array(at_mm) * 1e-3, normal)
    };
    let floor = ([21.0, 17.0, 4.0], DVec3::NEG_Z);
    assert!(reaches(&[], floor.0, floor.1) && !reaches(&[mount], floor.0, floor.1));
    let side = ([0.0, 17.0, 3.0], DVec3::NEG_X);
    assert!(reaches(&[mount], side.0, side.1));
    let all: Vec<u32> = (0..cup.triangles().len() as u32).collect();
    assert_eq!(Mount::behind(&cup, &all), None);
}

#[test]
fn a_block_without_walls_keeps_its_faces() {
    let block = voxels([12, 12, 12], |_| true);
    let ground = SolidGround::new(&block, NYLON, &[], &|_| None, &unwatched).unwrap();
    assert!(behind(&ground).iter().all(|&b| b));
    assert!(ground.outside.area() > 0.45 * block.area());
}

/// The limb of the paper is nobody's to give: it lies beside this repository or not at all.
#[test]
fn the_papers_limb_is_touched_on_its_shell_and_glued_to_behind_it() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/paper-limb/ds.dat");
    if crate::is_missing(&path) {
        return;
    }
    let inputs = cli::open(&path, None).unwrap().inputs;
    // The radius of the shell's outside at each height, by the outermost vertices of the file.
    let places = || inputs.part.positions().iter().map(|p| *p * 1e3);
    let radius = |height: f64| {
        let level = places().filter(|p| (p.y - height).abs() < 2.5);
        level.map(|p| p.x.hypot(p.z)).fold(0.0, f64::max)
    };
    let levels: Vec<f64> = (38..=162).map(|y| radius(f64::from(y))).collect();
    let depth =
        |p: DVec3| levels[((p.y - 38.0).round().max(0.0) as usize).min(124)] - p.x.hypot(p.z);
    let budget = Budget {
        touches: 400,
        test_touches: 40,
        ..Quality::Draft.budget()
    };
    let simulated = design::simulate(&inputs, &budget, &unwatched).unwrap();
    let part = |of: &[DVec3], is: &dyn Fn(f64) -> bool| {
        let there = of.iter().filter(|&&p| is(depth(p * 1e3))).count();
        there as f64 / of.len() as f64
    };
    let touches: Vec<DVec3> = simulated
        .dataset
        .touches
        .iter()
        .map(|t| t.position)
        .collect();
    let feasible = design::filter(&inputs, &simulated).sites();
    let sites: Vec<DVec3> = (feasible.iter())
        .map(|&s| simulated.dataset.sites[s].gauge.position)
        .collect();
    assert!(sites.len() > 1000, "{}", sites.len());
    let outside = part(&touches, &|depth| depth < 1.0);
    let behind = part(&sites, &|depth| (0.3..2.2).contains(&depth));
    println!("{outside:.4} of touches on the shell, {behind:.4} of feasible sites behind it");
    assert!(outside > 0.97 && behind > 0.97, "{outside} {behind}");
}

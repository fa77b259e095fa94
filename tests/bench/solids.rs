//! Closed solids with closed forms.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use hapdef::budget::{ElementBudget, unwatched};
use hapdef::elasticity::estimate::{AccuracyTarget, Discretization};
use hapdef::elasticity::grade;
use hapdef::elasticity::observe::Face;
use hapdef::elasticity::solid::SolidModel;
use hapdef::elasticity::solid::ground::SolidGround;
use hapdef::elasticity::solid::immersed::{Fineness, Immersed};
use hapdef::elasticity::support::HeldRegion;
use hapdef::elasticity::{DofSet, Material, Model as _, Support, Touch};
use hapdef::given::GivenSite;
use hapdef::io::points::{read_sites, read_touches};
use hapdef::mesh::TriMesh;
use hapdef::mesh::oriented_box::OrientedBox;
use hapdef::mesh::walls::WallSide;

/// A surface of quadrangles (each counter-clockwise from outside), cut in two.
pub fn of_quads(positions: &[DVec3], quads: &[[u32; 4]]) -> Arc<TriMesh> {
    let triangles: Vec<[u32; 3]> = (quads.iter())
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    Arc::new(TriMesh::new(positions, &triangles, 0).unwrap().0)
}

/// A block from the origin, placed by `place`.
pub fn block(sides: DVec3, place: impl Fn(DVec3) -> DVec3) -> Arc<TriMesh> {
    let positions: Vec<DVec3> = (0..8)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * sides)
        .map(place)
        .collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    of_quads(&positions, &quads)
}

/// A tube about z between two radii, of `n` flat sides.
pub fn tube(inner: f64, outer: f64, length: f64, n: u32) -> Arc<TriMesh> {
    let ring = |r: f64, z: f64| {
        (0..n).map(move |i| {
            let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            DVec3::new(r * a.cos(), r * a.sin(), z)
        })
    };
    let positions: Vec<DVec3> = ring(outer, 0.0)
        .chain(ring(outer, length))
        .chain(ring(inner, 0.0))
        .chain(ring(inner, length))
        .collect();
    let quads: Vec<[u32; 4]> = (0..n)
        .flat_map(|i| {
            let j = (i + 1) % n;
            [
                [i, j, n + j, n + i],
                [2 * n + j, 2 * n + i, 3 * n + i, 3 * n + j],
                [j, i, 2 * n + i, 2 * n + j],
                [n + i, n + j, 3 * n + j, 3 * n + i],
            ]
        })
        .collect();
    of_quads(&positions, &quads)
}

/// All displacements held in a box.
pub fn clamp(lower: DVec3, upper: DVec3) -> Support {
    Support {
        region: HeldRegion::Box(OrientedBox::of_file(lower, upper)),
        held: DofSet::ALL,
        bedding: None,
    }
}

pub fn model(
    part: &Arc<TriMesh>,
    material: Material,
    supports: &[Support],
    fineness: &Fineness,
) -> SolidModel {
    let immersed = Immersed::new(part, material, supports);
    immersed.model(part, fineness, &unwatched).unwrap()
}

/// Displacement under a touch, along it, a newton (m/N).
pub fn under(m: &SolidModel, touch: &Touch) -> f64 {
    let load = m.load(touch);
    let u = m.system().solve_dofs(&load);
    load.iter().map(|&(i, f)| f * u[i]).sum::<f64>() / (touch.force * touch.force)
}

/// Strain at a place on the surface along a direction under a touch.
pub fn strain_along(m: &SolidModel, touch: &Touch, place: DVec3, direction: DVec3) -> f64 {
    let u = m.system().solve_dofs(&m.load(touch));
    let observer = m.observer(&[m.index().nearest(place).0], Face::Inside);
    let frame = observer.frames()[0];
    let [xx, yy, xy] = observer.strain_of(m, &u)[0];
    let (x, y) = (direction.dot(frame.x_axis), direction.dot(frame.y_axis));
    xx * x * x + yy * y * y + xy * x * y
}

/// What a case gave: computed over exact, or a departure (%).
#[derive(Clone, Copy, Debug)]
pub struct Found {
    pub displacement: f64,
    pub strain: f64,
    pub unknowns: usize,
}

/// Without lateral contraction a clamped strip is a beam.
pub const BEAM: Material = Material {
    youngs_modulus: 2e9,
    poissons_ratio: 0.0,
};

/// A strip 100 × 20 × 2 mm held at one end and pressed at the other, turned out of the grid: displacement under
/// the load and strain at its root's half, over those of the beam with shear.
pub fn strip(turn: DQuat, cells: f64, order: usize) -> Found {
    let (length, width, wall) = (0.11_f64, 0.02_f64, 0.002_f64);
    let part = block(DVec3::new(length, width, wall), |p| turn * p);
    // The box is as wide as the part's turned end.
    let support = clamp(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(0.01, 1.0, 1.0));
    let fineness = Fineness {
        order,
        ..Fineness::of(cells * wall, wall)
    };
    let m = model(&part, BEAM, &[support], &fineness);
    let touch = Touch {
        position: turn * DVec3::new(length - 0.01, width / 2.0, wall),
        normal: turn * DVec3::Z,
        force: 1.0,
        tip_radius: 0.004,
    };
    let arm = length - 0.02;
    let (e, inertia) = (BEAM.youngs_modulus, width * wall.powi(3) / 12.0);
    let shear = 1.2 * arm / (e / 2.0 * width * wall);
    let exact = arm.powi(3) / (3.0 * e * inertia) + shear;
    let x = 0.05;
    let place = turn * DVec3::new(x, width / 2.0, 0.0);
    let strain = strain_along(&m, &touch, place, turn * DVec3::X);
    let exact_strain = -(length - 0.01 - x) * wall / 2.0 / (e * inertia);
    Found {
        displacement: under(&m, &touch) / exact,
        strain: strain / exact_strain,
        unknowns: m.system().dimension(),
    }
}

/// A tube bent by pulls and pushes on its free end, over the beam: how far the middle of its wall moves, and the
/// strain inside.
pub fn bent_tube(cells: f64, order: usize) -> Found {
    let (inner, outer, length) = (0.0285_f64, 0.0315_f64, 0.12_f64);
    let sides = 120;
    let part = tube(inner, outer, length, sides);
    let support = clamp(DVec3::splat(-1.0), DVec3::new(1.0, 1.0, 0.02));
    let wall = outer - inner;
    let fineness = Fineness {
        order,
        ..Fineness::of(cells * wall, wall)
    };
    let m = model(&part, BEAM, &[support], &fineness);
    // Pressures on the end that grow with x: a pure couple.
    let count = 60;
    let (mut load, mut moment) = (std::collections::BTreeMap::new(), 0.0);
    for k in 0..count {
        let angle = std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(count);
        let position =
            DVec3::new(angle.cos(), angle.sin(), 0.0) * (inner + outer) / 2.0 + DVec3::Z * length;
        let touch = Touch {
            position,
            normal: DVec3::Z,
            force: angle.cos(),
            tip_radius: 0.003,
        };
        moment += position.x * touch.force;
        for (dof, force) in m.load(&touch) {
            *load.entry(dof).or_insert(0.0) += force;
        }
    }
    let load: Vec<(usize, f64)> = load.into_iter().collect();
    let u = m.system().solve_dofs(&load);
    // The second moment of the polygon's ring, which is a little less than the circle's.
    let n = f64::from(sides);
    let polygon = (std::f64::consts::TAU / n).sin() * n / std::f64::consts::TAU;
    let spread = (2.0 + (std::f64::consts::TAU / n).cos()) / 3.0;
    let ring = std::f64::consts::FRAC_PI_4 * (outer.powi(4) - inner.powi(4));
    let stiffness = BEAM.youngs_modulus * ring * polygon * spread;
    let at = |p: DVec3| [m.index().nearest(p).0];
    let height = 0.09;
    let side = m.observer(&at(DVec3::new(0.0, outer, height)), Face::Outside);
    let moved = side.displacement_of(&m, &u)[0].x;
    let exact = moment * (height - 0.02_f64).powi(2) / (2.0 * stiffness);
    let inside = m.observer(&at(DVec3::new(inner, 0.0, 0.06)), Face::Inside);
    let frame = inside.frames()[0];
    let [xx, yy, xy] = inside.strain_of(&m, &u)[0];
    let (c, s) = (frame.x_axis.z, frame.y_axis.z);
    let strain = xx * c * c + yy * s * s + xy * c * s;
    Found {
        displacement: moved.abs() / exact,
        strain: strain.abs() * stiffness / (moment * inner),
        unknowns: m.system().dimension(),
    }
}

/// What is read under each touch on the slotted tube: how far the middle of the wall moves (m), and the strain
/// of its inside along the site's direction, touch by touch and site by site.
struct Readings {
    middle: Vec<Vec<DVec3>>,
    strain: Vec<Vec<f64>>,
    unknowns: usize,
}

/// Touches and sites of the slotted tube, on the middle of its wall.
fn slotted_places() -> (Vec<Touch>, Vec<GivenSite>) {
    let touches = read_touches(&super::slotted::fixture("touches.csv")).unwrap();
    let sites = read_sites(&super::slotted::fixture("sites.csv")).unwrap();
    (touches, sites)
}

fn along_site(frame: &DMat3, direction: DVec3, [xx, yy, xy]: [f64; 3]) -> f64 {
    let (x, y) = (direction.dot(frame.x_axis), direction.dot(frame.y_axis));
    xx * x * x + yy * y * y + xy * x * y
}

/// The slotted tube made solid, with a wall of this thickness (m) and cells of a size (m).
fn slotted_solid(wall: f64, cells: f64, order: usize) -> Readings {
    let inputs = super::slotted::inputs();
    let (touches, sites) = slotted_places();
    let part = Arc::new(inputs.part.thickened(wall));
    let supports = inputs.project.supports(&inputs.masks).unwrap();
    let immersed = Immersed::new(&part, inputs.project.section().material, &supports);
    let fineness = Fineness {
        order,
        ..Fineness::of(cells, wall)
    };
    let m = immersed.model(&part, &fineness, &unwatched).unwrap();
    slotted_readings(&m, wall, &touches, &sites)
}

/// From the middle of the tube's wall to its outside.
fn to_outside(p: DVec3, wall: f64) -> DVec3 {
    p.with_z(0.0).normalize() * wall / 2.0
}

/// Touches of the slotted tube on its outside.
fn on_outside(touches: &[Touch], wall: f64) -> Vec<Touch> {
    let outside = |t: &Touch| Touch {
        position: t.position + to_outside(t.position, wall),
        ..*t
    };
    touches.iter().map(outside).collect()
}

fn slotted_readings(m: &SolidModel, wall: f64, touches: &[Touch], sites: &[GivenSite]) -> Readings {
    let radial = |p: DVec3| to_outside(p, wall);
    let pressed = on_outside(touches, wall);
    let loads: Vec<_> = pressed.iter().map(|t| m.load(t)).collect();
    let face = |sign: f64| -> Vec<_> {
        let on = |p: DVec3| m.index().nearest(p + radial(p) * sign).0;
        sites.iter().map(|s| on(s.position)).collect()
    };
    let inner = m.observer(&face(-1.0), Face::Inside);
    let outer = m.observer(&face(1.0), Face::Outside);
    let mut readings = Readings {
        middle: Vec::new(),
        strain: Vec::new(),
        unknowns: m.system().dimension(),
    };
    for u in m.system().solve_loads(&loads) {
        let (below, above) = (inner.displacement_of(m, &u), outer.displacement_of(m, &u));
        let middle = below.iter().zip(&above).map(|(b, a)| (*b + *a) / 2.0);
        readings.middle.push(middle.collect());
        let read = inner.strain_of(m, &u);
        let each = read.iter().zip(inner.frames()).zip(sites);
        let strains = each.map(|((&e, frame), s)| along_site(frame, s.direction, e));
        readings.strain.push(strains.collect());
    }
    readings
}

/// The same tube as a shell of a wall (m), with even triangles.
fn slotted_shell(wall: f64, vertices: usize) -> Readings {
    let mut inputs = super::slotted::inputs();
    inputs.project.part.thickness_mm = wall * 1e3;
    let (touches, sites) = slotted_places();
    let supports = inputs.project.supports(&inputs.masks).unwrap();
    let ground = grade::ShellGround::new(&inputs.part, inputs.project.section(), &supports, false);
    let m = ground.model(&ground.even(vertices), &unwatched).unwrap();
    let loads: Vec<_> = touches.iter().map(|t| m.load(t)).collect();
    let at: Vec<_> = sites
        .iter()
        .map(|s| m.index().nearest(s.position).0)
        .collect();
    let observer = m.observer(&at, Face::Inside);
    let mut readings = Readings {
        middle: Vec::new(),
        strain: Vec::new(),
        unknowns: m.system().dimension(),
    };
    for u in m.system().solve_loads(&loads) {
        readings.middle.push(observer.displacement_of(&m, &u));
        let read = observer.strain_of(&m, &u);
        let each = read.iter().zip(observer.frames()).zip(&sites);
        let strains = each.map(|((&e, frame), s)| along_site(frame, s.direction, e));
        readings.strain.push(strains.collect());
    }
    readings
}

/// Departures of readings from those that are taken for right: rms over the touches of the displacement under
/// the load (%), and of the strain beyond two tip radii over the touch's largest there (%).
fn departure(found: &Readings, right: &Readings) -> Found {
    let (touches, sites) = slotted_places();
    let far = |t: usize, s: usize| {
        s >= touches.len()
            && sites[s].position.distance(touches[t].position) > 2.0 * touches[t].tip_radius
    };
    let (mut displacement, mut strain) = (Vec::<f64>::new(), Vec::<f64>::new());
    for (t, touch) in touches.iter().enumerate() {
        // The first sites lie under the touches.
        let under = |r: &Readings| r.middle[t][t].dot(touch.normal);
        displacement.push(under(found) / under(right) - 1.0);
        let beyond: Vec<usize> = (0..sites.len()).filter(|&s| far(t, s)).collect();
        let sizes = beyond.iter().map(|&s| right.strain[t][s].abs());
        let largest = sizes.fold(0.0, f64::max);
        let off = |&s: &usize| (found.strain[t][s] - right.strain[t][s]) / largest;
        strain.extend(beyond.iter().map(off));
    }
    let rms = |v: &[f64]| 100.0 * (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
    Found {
        displacement: rms(&displacement),
        strain: rms(&strain),
        unknowns: found.unknowns,
    }
}

/// The slotted tube of the shell's test, thick, against a solid model that shares nothing with this one (747 000
/// degrees of freedom, quadratic wedges), as [`departure`].
pub fn slotted(cells_mm: f64, order: usize) -> Found {
    let found = slotted_solid(3e-3, cells_mm * 1e-3, order);
    departure(&found, &slotted_reference(&found))
}

/// The same as a design at a quality computes it, with what that says of its own error.
pub fn slotted_graded(aim: &ElementBudget) -> (Found, Discretization) {
    let wall = 3e-3;
    let inputs = super::slotted::inputs();
    let (touches, sites) = slotted_places();
    let part = Arc::new(inputs.part.thickened(wall));
    let supports = inputs.project.supports(&inputs.masks).unwrap();
    let material = inputs.project.section().material;
    let ground = SolidGround::new(
        &part,
        material,
        &supports,
        &|_| None::<WallSide>,
        &unwatched,
    )
    .unwrap();
    let places: Vec<DVec3> = (sites.iter())
        .map(|s| s.position - to_outside(s.position, wall))
        .collect();
    let pressed = on_outside(&touches, wall);
    let target = AccuracyTarget::new(&pressed, &places, aim);
    let graded = ground.grade(&target, &unwatched).unwrap();
    let found = slotted_readings(&graded.model, wall, &touches, &sites);
    let off = departure(&found, &slotted_reference(&found));
    (off, graded.estimate)
}

/// What the independent solid says at the places of some readings.
fn slotted_reference(found: &Readings) -> Readings {
    let reference = super::slotted::solid();
    let read = |t: usize, s: usize| reference.get(&(t, s)).copied().unwrap_or_default();
    let (touches, sites) = (found.middle.len(), found.middle[0].len());
    let row = |t: usize| (0..sites).map(move |s| read(t, s));
    Readings {
        middle: (0..touches)
            .map(|t| row(t).map(|r| r.0 * 1e-3).collect())
            .collect(),
        strain: (0..touches)
            .map(|t| row(t).map(|r| r.1).collect())
            .collect(),
        unknowns: 0,
    }
}

/// The shell of the slotted tube against this program's own solid, both fine, over the thickness of the wall.
pub fn shell_of(wall_mm: f64) -> Found {
    let wall = wall_mm * 1e-3;
    let cells = (wall * 1.33).max(2e-3).min(wall * 2.0);
    departure(&slotted_shell(wall, 16_000), &slotted_solid(wall, cells, 2))
}

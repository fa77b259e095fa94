//! The frame inside a barrel: rods that grow out of both rims, and braces between them.

use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::barrel_spec::BarrelSpec;
use super::body::{AROUND, CORNERS, LimbBody, Ring};
use super::lattice::{Foot, LimbLattice, steps};

/// The corners of a rod's section that look at the next rod and at the one before, exactly so of four.
const TOWARDS: [usize; 2] = [4, 6];

/// A rod from foot to foot.
struct FrameRod {
    rings: Vec<Ring>,
    /// Sides that braces grow out of.
    open: BTreeSet<(usize, usize)>,
    /// Section where it begins to stand upright, and sections from there to where it ends to.
    upright: usize,
    length: usize,
}

/// The steps around that rods stand at, as evenly as there are steps.
pub(super) fn columns(spec: &BarrelSpec, lattice: &LimbLattice) -> impl Iterator<Item = isize> {
    let (rods, all) = (spec.frame.rods as isize, lattice.columns);
    (0..rods).map(move |k| (2 * k * all + rods) / (2 * rods))
}

/// Grows the frame out of the feet that were left open on the inner face, the lower and the upper one of each rod.
pub(super) fn grow(
    spec: &BarrelSpec,
    lattice: &LimbLattice,
    feet: &[[Foot; 2]],
    body: &mut LimbBody,
) {
    let inner = lattice.points.len();
    let mut rods: Vec<FrameRod> = columns(spec, lattice)
        .zip(feet)
        .map(|(column, ends)| {
            let ends = [0, 1].map(|end| ends[end].around.map(|point| (inner + point) as u32));
            rod(spec, lattice.angle(column), ends, body)
        })
        .collect();
    let sites = spec.frame.braces + 1;
    for brace in 1..sites {
        for k in 0..rods.len() {
            let next = (k + 1) % rods.len();
            let station = rods[k].upright + (brace * rods[k].length + sites / 2) / sites;
            let here = knot(&mut rods[k], station, TOWARDS[0], 1);
            let there = knot(&mut rods[next], station, TOWARDS[1], -1);
            add_brace(spec, here, there, body);
        }
    }
    for rod in &rods {
        body.sweep(&rod.rings, &rod.open);
    }
}

/// A rod in the plane of the axis and an angle: inwards from the lower foot, up, and outwards to the upper one.
fn rod(spec: &BarrelSpec, angle: f64, [from, to]: [Ring; 2], body: &mut LimbBody) -> FrameRod {
    let (sin, cos) = angle.sin_cos();
    let outwards = DVec3::new(sin, 0.0, cos);
    let across = DVec3::new(cos, 0.0, -sin);
    let path = Path::new(spec);
    let mut rings = vec![from];
    rings.extend(path.sections.iter().map(|section| {
        let centre = section.radius * outwards + section.y * DVec3::Y;
        let (sin, cos) = section.climb.sin_cos();
        let along = cos * outwards + sin * DVec3::Y;
        body.ring(centre, [across, along.cross(across)], spec.frame.rod_radius)
    }));
    rings.push(to);
    FrameRod {
        rings,
        open: BTreeSet::new(),
        upright: path.upright,
        length: path.length,
    }
}

/// A place of a rod's middle: distance from the axis, height, and the angle of its direction from outwards to up.
struct RodSection {
    radius: f64,
    y: f64,
    climb: f64,
}

/// The middle of a rod between its feet.
struct Path {
    sections: Vec<RodSection>,
    upright: usize,
    length: usize,
}

impl Path {
    fn new(spec: &BarrelSpec) -> Self {
        let frame = &spec.frame;
        let (low, high) = (spec.rim / 2.0, spec.height - spec.rim / 2.0);
        let bend = 2.0 * frame.rod_radius;
        let turned = frame.distance + bend;
        let inwards = spec.radius_at(low, -spec.wall / 2.0) - turned;
        let straight = steps(inwards, bend);
        let arc = steps(bend * FRAC_PI_2, frame.rod_radius).max(2);
        let tall = high - low - 2.0 * bend;
        // Room for the knots of all braces.
        let length = steps(tall, 2.0 * frame.brace_radius).max(3 * (frame.braces + 1));
        let mut sections = Vec::new();
        let mut add = |radius, y, climb| sections.push(RodSection { radius, y, climb });
        let share = |i: usize, of: usize| i as f64 / of as f64;
        for i in 1..=straight {
            add(turned + inwards * (1.0 - share(i, straight)), low, PI);
        }
        for i in 1..=arc {
            let turn = FRAC_PI_2 * share(i, arc);
            let (sin, cos) = turn.sin_cos();
            add(turned - bend * sin, low + bend * (1.0 - cos), PI - turn);
        }
        for i in 1..length {
            add(
                frame.distance,
                low + bend + tall * share(i, length),
                FRAC_PI_2,
            );
        }
        for i in 0..=arc {
            let turn = FRAC_PI_2 * share(i, arc);
            let (sin, cos) = turn.sin_cos();
            add(
                turned - bend * cos,
                high - bend * (1.0 - sin),
                FRAC_PI_2 - turn,
            );
        }
        for i in 1..straight {
            add(turned + inwards * share(i, straight), high, 0.0);
        }
        Self {
            sections,
            // The foot is a section too.
            upright: straight + arc,
            length,
        }
    }
}

/// Opens two by two sides of a rod about a corner of a section, and names the points around them as the brace's
/// sections count theirs: with the rod's corners (`way` 1) where it begins, against them (-1) where it arrives.
fn knot(rod: &mut FrameRod, station: usize, corner: usize, way: isize) -> Ring {
    for (i, j) in [(corner - 1, 1), (corner, 1), (corner - 1, 0), (corner, 0)] {
        rod.open.insert((station - j, i));
    }
    AROUND.map(|(i, j)| {
        let side = corner.wrapping_add_signed(way * i) % CORNERS;
        rod.rings[station.wrapping_add_signed(j)][side]
    })
}

/// A straight brace between two knots.
fn add_brace(spec: &BarrelSpec, here: Ring, there: Ring, body: &mut LimbBody) {
    let (from, to) = (body.middle(&here), body.middle(&there));
    let across = DVec3::Y.cross((to - from).normalize());
    let radius = spec.frame.brace_radius;
    let count = steps(from.distance(to), 2.0 * spec.frame.rod_radius).max(2);
    let mut rings = vec![here];
    rings.extend((1..count).map(|i| {
        let centre = from.lerp(to, i as f64 / count as f64);
        body.ring(centre, [across, DVec3::Y], radius)
    }));
    rings.push(there);
    body.sweep(&rings, &BTreeSet::new());
}

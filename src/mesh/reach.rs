//! Where a fingertip gets to, and which faces are the back of a wall that it gets to.
//!
//! A fingertip is a ball on a finger as thick as the ball. It comes in straight, along the direction that it presses
//! in or a little tilted from it, and reaches a place where neither ball nor finger meets anything else of the part.
//! So rods behind a window are out of reach of what does not fit through the window, however they face, and so is
//! what stands far behind a slot. The way in is followed by steps as long as there is room around the ball (sphere
//! tracing, J. C. Hart 1996).

use std::f64::consts::{FRAC_PI_6, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::TriMesh;
use super::locate::SurfaceIndex;
use super::mount::Mount;
use super::walls::{WallSide, Walls, frame, middle};
use crate::budget::{Cancelled, Watch, report};
use crate::units;

/// Radius of a fingertip (m).
pub const FINGERTIP: f64 = 8e-3;

/// A fingertip gives way by this share of its radius.
const GIVES: f64 = 0.15;
/// A finger may come in tilted by this from the direction that it presses in, to as many sides.
const TILT: f64 = FRAC_PI_6;
const AROUND: u32 = 6;
/// Least steps of a finger on its way, in radii and in sizes of the part.
const STEP: f64 = 0.25;
const FINEST: f64 = 1e-3;
/// How far a ball stays off what it touches, in sizes of the part.
const OFF: f64 = 1e-6;

/// Walls thicker than this many usual ones are of the frame. Between a shell and its frame there is a gap in
/// thickness; where there is none, nobody can tell them apart.
const THICK: f64 = 1.75;
/// Neighbours whose normals differ by less than this lie on one face (cos 30°).
const SMOOTH: f64 = 0.866;
/// Where less than this share of what faces inward is the back of a wall, the part has no walls to speak of.
const WALLED: f64 = 0.1;
/// Shares of the outside below this are not worth a word.
const WORTH: f64 = 0.02;

/// A finger that comes to a part from outside.
pub struct Finger<'a> {
    index: &'a SurfaceIndex,
    /// Of its tip (m).
    radius: f64,
    /// The box that holds the part (m), and how large it is.
    bounds: (DVec3, DVec3),
    size: f64,
    mounts: &'a [Mount],
}

impl<'a> Finger<'a> {
    /// `radius` (m) is that of the tip; a finger without any is a ray.
    #[must_use]
    pub fn new(mesh: &'a TriMesh, radius: f64) -> Self {
        let (lower, upper) = mesh.bounds();
        Self {
            index: mesh.index(),
            radius,
            bounds: (lower, upper),
            size: (upper - lower).length(),
            mounts: &[],
        }
    }

    /// With what the part is fastened to.
    #[must_use]
    pub fn around(self, mounts: &'a [Mount]) -> Self {
        Self { mounts, ..self }
    }

    /// Whether its tip can come to rest on a point of the part (m) that looks in a direction.
    #[must_use]
    pub fn reaches(&self, at: DVec3, normal: DVec3) -> bool {
        if !normal.is_normalized() {
            return false;
        }
        let off = at + normal * (OFF * self.size);
        let ball = off + normal * self.radius;
        // A large ball gives way by more than a thin part is thick: nothing may lie between it and the place.
        let between = || (self.index.ray(off, normal)).is_some_and(|(_, far)| far < self.radius);
        self.room(ball) >= 0.0 && !between() && ways(normal).any(|way| self.is_free(ball, way))
    }

    /// How much farther off the surface is than the tip needs it to be (m).
    fn room(&self, ball: DVec3) -> f64 {
        self.index.nearest(ball).1 - (1.0 - GIVES) * self.radius
    }

    /// Whether nothing stands in the way from a place of the ball straight out.
    fn is_free(&self, ball: DVec3, way: DVec3) -> bool {
        let give = (1.0 - GIVES) * self.radius;
        if self.index.ray(ball, way).is_some()
            || (self.mounts.iter()).any(|mount| mount.stops(ball, give, way))
        {
            return false;
        }
        if self.radius <= 0.0 {
            return true;
        }
        let least = (STEP * self.radius).max(FINEST * self.size);
        let mut at = ball;
        while !self.has_left(at, way) {
            let room = self.room(at);
            if room < 0.0 {
                return false;
            }
            at += way * room.max(least);
        }
        true
    }

    /// Whether a ball is past the box that holds the part, and goes on away from it.
    fn has_left(&self, ball: DVec3, way: DVec3) -> bool {
        let (lower, upper) = self.bounds;
        let away = ball - ball.clamp(lower, upper);
        away.length() >= self.radius && away.dot(way) >= 0.0
    }
}

/// The directions that a finger lies in when it presses against a normal, the likeliest first.
fn ways(normal: DVec3) -> impl Iterator<Item = DVec3> {
    let frame = frame(normal);
    let (sin, cos) = TILT.sin_cos();
    let tilted = (0..AROUND).map(move |k| {
        let (y, x) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
        frame * DVec3::new(sin * x, sin * y, cos)
    });
    std::iter::once(normal).chain(tilted)
}

/// What a fingertip reaches of a part's walls, one value a facet.
#[derive(Clone, Debug)]
pub struct Reach {
    /// Faces outward, is reached, and belongs to no frame.
    pub touched: Vec<bool>,
    /// Faces inward, and is the back of a wall that is touched; of a part without such walls, all that faces inward.
    pub backs: Vec<bool>,
    /// Thickness of half of the walls that are reached (m); NaN where there are none.
    pub usual: f64,
    /// Shares of what faces outward: out of reach, and of the frame.
    pub unreached: f64,
    /// Share of what faces outward that belongs to a frame.
    pub framed: f64,
    /// Whether there are walls with a back.
    pub walled: bool,
}

impl Reach {
    /// Looks at every facet of a closed surface whose walls are known; `radius` (m) is the fingertip's, and the part is
    /// fastened to `mounts`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(
        mesh: &TriMesh,
        walls: &Walls,
        radius: f64,
        mounts: &[Mount],
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let finger = Finger::new(mesh, radius).around(mounts);
        let mut touched = reached(mesh, &finger, walls, watch)?;
        fill(mesh, walls, &mut touched);
        let area = |of: &dyn Fn(usize) -> bool| -> f64 {
            let facets = (0u32..mesh.triangles().len() as u32).filter(|&t| of(t as usize));
            facets.map(|t| mesh.facet_area(t)).sum()
        };
        let is = |side: WallSide| area(&|t| walls.sides[t] == side).max(f64::MIN_POSITIVE);
        let (outward, inward) = (is(WallSide::Outside), is(WallSide::Inside));
        let reached = area(&|t| touched[t]);
        let own = walls.thickness.iter().zip(&touched);
        let own: Vec<f64> = own.map(|(&w, &t)| if t { w } else { f64::NAN }).collect();
        let usual = middle(&own, mesh);
        let framed = frames(mesh, walls, &touched, THICK * usual);
        for (touched, framed) in touched.iter_mut().zip(framed) {
            *touched &= !framed;
        }
        let mut backs = backs(walls, &touched, THICK * usual);
        let walled = area(&|t| backs[t]) > WALLED * inward;
        if !walled {
            backs = walls.sides.iter().map(|&s| s == WallSide::Inside).collect();
        }
        Ok(Self {
            unreached: 1.0 - reached / outward,
            framed: (reached - area(&|t| touched[t])) / outward,
            touched,
            backs,
            usual,
            walled,
        })
    }

    /// Takes what the user says of a facet for what was found.
    pub fn tell(&mut self, t: u32, side: WallSide) {
        self.touched[t as usize] = side == WallSide::Outside;
        self.backs[t as usize] = side == WallSide::Inside;
    }

    /// Sides of facets, without the faces that are of no use.
    #[must_use]
    pub fn sides(&self, sides: &[WallSide]) -> Vec<WallSide> {
        let facets = sides.iter().zip(self.touched.iter().zip(&self.backs));
        facets
            .map(|(&side, (touched, back))| match side {
                WallSide::Outside if !touched => WallSide::Frame,
                WallSide::Inside if !back => WallSide::Frame,
                _ => side,
            })
            .collect()
    }

    /// What was left out, in plain words.
    #[must_use]
    pub fn words(&self, radius: f64) -> Vec<String> {
        let mut words = Vec::new();
        if self.unreached > WORTH || self.framed > WORTH {
            let frame = if self.framed > WORTH {
                format!(
                    ", and {:.0} % is of walls more than {THICK} times as thick as usual ({:.2} mm), taken for its frame",
                    100.0 * self.framed,
                    units::mm(self.usual)
                )
            } else {
                String::new()
            };
            words.push(format!(
                "Of what faces outward, a fingertip of {} mm (touch.reach_mm) does not get to {:.0} %{frame}: no touches come there. Paint the outside (part.outside) where it is otherwise.",
                units::mm(radius),
                100.0 * self.unreached
            ));
        }
        if !self.walled {
            words.push(
                "Hardly anything that faces inward is the back of a wall that can be touched: gauges may go on all of it. Paint the inside (part.inside, feasible.painted) where that is too much.".into(),
            );
        }
        words
    }
}

/// Which facets of the outside a finger reaches.
fn reached(
    mesh: &TriMesh,
    finger: &Finger,
    walls: &Walls,
    watch: Watch,
) -> Result<Vec<bool>, Cancelled> {
    const CHUNK: usize = 512;
    let all: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
    let is_reached = |&t: &u32| {
        let middle = mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        walls.sides[t as usize] == WallSide::Outside && finger.reaches(middle, mesh.facet_normal(t))
    };
    let mut touched: Vec<bool> = Vec::with_capacity(all.len());
    for chunk in all.chunks(CHUNK) {
        report(watch, "Touching the part", touched.len(), all.len())?;
        touched.par_extend(chunk.par_iter().map(is_reached));
    }
    Ok(touched)
}

/// The facet beyond each side of a facet, where that goes on smoothly.
fn beside(mesh: &TriMesh, t: u32) -> impl Iterator<Item = u32> {
    let sides = mesh.triangle_edges()[t as usize];
    sides.into_iter().filter_map(move |e| {
        let [a, b] = mesh.edges()[e as usize].triangles[..] else {
            return None;
        };
        let other = if a == t { b } else { a };
        (mesh.facet_normal(t).dot(mesh.facet_normal(other)) > SMOOTH).then_some(other)
    })
}

/// A facet of the outside between facets that are all touched is touched too: small dents are no windows.
fn fill(mesh: &TriMesh, walls: &Walls, touched: &mut [bool]) {
    let old = touched.to_vec();
    for (t, touched) in (0u32..).zip(touched) {
        if *touched || walls.sides[t as usize] != WallSide::Outside {
            continue;
        }
        let mut around = beside(mesh, t).map(|o| old[o as usize]).peekable();
        *touched = around.peek().is_some() && around.all(|t| t);
    }
}

/// Which facets lie on faces whose wall is thicker than this (m) over more than half of what is touched of them.
fn frames(mesh: &TriMesh, walls: &Walls, touched: &[bool], thick: f64) -> Vec<bool> {
    let (faces, count) = smooth_faces(mesh);
    let mut areas = vec![[0.0; 2]; count];
    for (t, &face) in (0u32..).zip(&faces) {
        if touched[t as usize] {
            // What has no other side is neither.
            let at = usize::from(walls.thickness[t as usize] > thick);
            areas[face][at] += mesh.facet_area(t);
        }
    }
    faces.iter().map(|&f| areas[f][1] > areas[f][0]).collect()
}

/// The face that each facet belongs to, bounded by creases, and how many there are.
fn smooth_faces(mesh: &TriMesh) -> (Vec<usize>, usize) {
    let mut faces = vec![usize::MAX; mesh.triangles().len()];
    let mut count = 0;
    for first in 0..mesh.triangles().len() as u32 {
        if faces[first as usize] != usize::MAX {
            continue;
        }
        faces[first as usize] = count;
        let mut open = vec![first];
        while let Some(t) = open.pop() {
            for other in beside(mesh, t) {
                if faces[other as usize] == usize::MAX {
                    faces[other as usize] = count;
                    open.push(other);
                }
            }
        }
        count += 1;
    }
    (faces, count)
}

/// Which facets lie behind what is touched, on the other side of a wall that is not thicker than this (m).
fn backs(walls: &Walls, touched: &[bool], thick: f64) -> Vec<bool> {
    let facets = walls.sides.iter().zip(&walls.thickness).zip(&walls.facing);
    facets
        .map(|((&side, &thickness), facing)| {
            side == WallSide::Inside
                && thickness <= thick
                && facing.is_some_and(|front| touched[front as usize])
        })
        .collect()
}

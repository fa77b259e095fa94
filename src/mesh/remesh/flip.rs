//! Edges turned towards equal angles: Delaunay on the surface.

use std::collections::BTreeSet;

use glam::DVec3;

use super::working::{Working, key};
use crate::mesh::numbers::NumberSet;

/// Opposite angles within this (rad) of half a turn are half a turn but for rounding: the edge stays.
const LEVEL: f64 = 1e-5;
/// Passes over the mesh at most.
const PASSES: usize = 6;

/// Edges to be looked at, in the order that a pass over all edges of the mesh would have: an edge about which nothing
/// has changed since the last look stays as it is, and is passed over.
#[derive(Default)]
struct Queue {
    /// Of this pass, yet to come.
    now: BTreeSet<(u32, u32)>,
    next: BTreeSet<(u32, u32)>,
    /// Edges that this pass has made: it did not know them when it began.
    made: NumberSet<(u32, u32)>,
    /// Where this pass is.
    at: (u32, u32),
    /// The first pass looks at all edges, and needs no queue.
    is_first: bool,
}

impl Queue {
    fn changed(&mut self, edge: (u32, u32)) {
        if edge <= self.at || self.made.contains(&edge) {
            self.next.insert(edge);
        } else if !self.is_first {
            self.now.insert(edge);
        }
    }

    fn made(&mut self, edge: (u32, u32)) {
        self.made.insert(edge);
        self.next.insert(edge);
    }
}

/// Turns edges until no pair of triangles would have a larger smallest angle the other way.
pub(super) fn flip(work: &mut Working) {
    let mut queue = Queue {
        is_first: true,
        ..Queue::default()
    };
    for edge in work.edges() {
        queue.at = edge;
        look(work, edge, &mut queue);
    }
    for _ in 1..PASSES {
        queue = Queue {
            now: queue.next,
            ..Queue::default()
        };
        while let Some(edge) = queue.now.pop_first() {
            queue.at = edge;
            look(work, edge, &mut queue);
        }
    }
}

/// What is to be done with an edge.
enum FlipVerdict {
    Stays,
    /// It would be turned if what it would be turned to were not there already.
    Barred,
    /// Between these triangles it is turned to the edge between these vertices.
    Turns([u32; 2], [u32; 2]),
}

fn look(work: &mut Working, (a, b): (u32, u32), queue: &mut Queue) {
    if work.is_line(a, b) {
        return;
    }
    let Some(on) = work.pair_on_edge(a, b) else {
        return;
    };
    match verdict(work, [a, b], on) {
        FlipVerdict::Stays => {}
        FlipVerdict::Barred => {
            queue.next.insert((a, b));
        }
        FlipVerdict::Turns(on, [c, d]) => {
            work.flip(a, b, on, [c, d]);
            queue.made(key(c, d));
            for beside in [key(a, c), key(c, b), key(b, d), key(d, a)] {
                queue.changed(beside);
            }
        }
    }
}

fn verdict(work: &Working, [a, b]: [u32; 2], [s, t]: [u32; 2]) -> FlipVerdict {
    let opposite = |t: u32| {
        let mut corners = work.triangles[t as usize].into_iter();
        corners.find(|&v| v != a && v != b)
    };
    let (Some(c), Some(d)) = (opposite(s), opposite(t)) else {
        return FlipVerdict::Stays;
    };
    let [pa, pb, pc, pd] = [a, b, c, d].map(|v| work.position(v));
    // Two angles of at most a quarter turn need no arc cosine.
    let is_sharp = |at: DVec3| (pa - at).dot(pb - at) >= 0.0;
    if c == d || (is_sharp(pc) && is_sharp(pd)) {
        return FlipVerdict::Stays;
    }
    let angle = |at: DVec3| (pa - at).angle_between(pb - at);
    // Delaunay on the surface: opposite angles of more than half a turn.
    if angle(pc) + angle(pd) <= std::f64::consts::PI + LEVEL {
        return FlipVerdict::Stays;
    }
    if work.is_edge(c, d) {
        return FlipVerdict::Barred;
    }
    let (n, m) = (work.normal(s), work.normal(t));
    let mean = n + m;
    // After the turn: a, d, c and b, c, d in the winding of s.
    let forward = {
        let tri = work.triangles[s as usize];
        (0..3).any(|i| tri[i] == a && tri[(i + 1) % 3] == b)
    };
    let sign = if forward { 1.0 } else { -1.0 };
    let first = (pd - pa).cross(pc - pa) * sign;
    let second = (pc - pb).cross(pd - pb) * sign;
    let sound = |new: DVec3| new.dot(mean) > 0.5 * new.length() * mean.length();
    let size = mean.length();
    if !sound(first) || !sound(second) || first.length().min(second.length()) < 1e-6 * size {
        return FlipVerdict::Stays;
    }
    FlipVerdict::Turns([s, t], [c, d])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::TriMesh;
    use crate::mesh::surface::Surface;

    /// A square that is sheared so far that most of its edges are to be turned, some of them several times.
    fn sheared() -> Surface {
        const SIDE: u32 = 12;
        let place = |k: u32| {
            let (x, y) = (f64::from(k % SIDE), f64::from(k / SIDE));
            DVec3::new(
                x + 2.7 * y + 0.2 * (y * y).sin(),
                y + 0.1 * x.cos(),
                0.3 * (x - y).sin(),
            )
        };
        let corners = (0..SIDE * (SIDE - 1)).filter(|k| (k + 1) % SIDE != 0);
        let triangles =
            corners.flat_map(|k| [[k, k + 1, k + SIDE], [k + 1, k + SIDE + 1, k + SIDE]]);
        let places = (0..SIDE * SIDE).map(place).collect();
        let mesh = TriMesh::from_checked(places, triangles.collect());
        Surface::new(&Arc::new(mesh), |_| false, |_| false)
    }

    /// Looks at all edges in every pass; how many each of them turned.
    fn in_plain_passes(work: &mut Working) -> [usize; PASSES] {
        [(); PASSES].map(|()| {
            let mut turned = 0;
            for edge in work.edges() {
                let mut queue = Queue::default();
                look(work, edge, &mut queue);
                turned += queue.made.len();
            }
            turned
        })
    }

    #[test]
    fn what_is_passed_over_would_not_have_been_turned() {
        let surface = sheared();
        let [mut quick, mut plain] = [(), ()].map(|()| Working::new(&surface, &|_| 1.0));
        flip(&mut quick);
        let turned = in_plain_passes(&mut plain);
        println!("turned in each pass: {turned:?}");
        assert!(turned[0] > 10 && turned[1] > 5, "{turned:?}");
        assert_eq!(quick.triangles, plain.triangles);
        assert_eq!(quick.around, plain.around);
    }
}

//! The pieces that are printed.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec2, DVec3};

use super::arm::{Arm, EYELET, TAB};
use super::convex::block;
use super::digits::{Lettering, facing, number};
use super::pad::{ACROSS, ALONG, Pad};
use super::plan::{Jig, Stack};
use super::rod::HEAD;
use super::shapes::{
    JigSolid, closed, cuboid, cylinder, hole_along_x, hole_along_y, hull, joined, moved, placed,
    read, turned,
};
use super::sizes::Sizes;
use crate::mesh::Facets;

/// One that is printed.
#[derive(Clone, Debug)]
pub struct PrintedPart {
    /// Of its file, without the ending.
    pub name: String,
    /// As it sits on its rod, pads at the wall (mm, in the stack's frame).
    pub solid: Facets,
    /// As it is laid to be printed: the frame's directions turned.
    pub print_turn: DMat3,
}

/// Height of the seat, outside (mm).
const SEAT: f64 = 5.0;
/// What sticks out beyond it to hold (mm).
const GRIP: f64 = 25.0;
/// How far the seat's spokes reach beyond the rim (mm).
const BEYOND_RIM: f64 = 4.0;
/// Radius of the pins that hold: a nail of 3 mm through the rod, a piece of filament through a stem (mm).
const PINS: [f64; 2] = [1.6, 1.0];
/// From the end of a stem, or of a rod's piece, to what goes through it (mm).
const TO_PIN: f64 = 2.5;

/// All pieces of a stack of a jig, in the order in which they are put onto the rod.
#[must_use]
pub fn parts(jig: &Jig, stack: &Stack) -> Vec<PrintedPart> {
    let sizes = &jig.sizes;
    let mut parts = rod(sizes, stack);
    for (k, arm) in stack.arms.iter().enumerate().rev() {
        parts.push(PrintedPart {
            name: format!("ring-{:02}", arm.number),
            solid: read(&ring(sizes, arm)),
            print_turn: DMat3::IDENTITY,
        });
        parts.push(PrintedPart {
            name: format!("pad-{:02}", arm.number),
            solid: read(&pad(sizes, arm)),
            // On a side of its stem.
            print_turn: DMat3::from_rotation_x(FRAC_PI_2) * DMat3::from_rotation_z(-arm.angle),
        });
        parts.extend(sleeve(sizes, stack, k));
    }
    parts.push(seat(sizes, stack));
    parts
}

/// The rod's section, or that of a hole for it, between two heights.
fn shaft(sizes: &Sizes, play: f64, from: f64, to: f64) -> JigSolid {
    let radius = sizes.rod + play;
    let flat = sizes.rod - sizes.flat + play;
    let off = cuboid(
        DVec3::new(flat, -2.0 * radius, from - 1.0),
        DVec3::new(3.0 * radius, 2.0 * radius, to + 1.0),
    );
    cylinder(radius, from, to).difference(&off)
}

/// The rod, in as many pieces as the printer needs: each sits on the one before with a peg.
fn rod(sizes: &Sizes, stack: &Stack) -> Vec<PrintedPart> {
    /// Length of a peg (mm).
    const PEG: f64 = 12.0;
    let foot = -stack.lift - SEAT - GRIP;
    let inner = stack.arms.last().map_or(0.0, |arm| arm.ring(sizes)[1]);
    let whole = shaft(sizes, 0.0, foot, inner + 0.1)
        .union(&cylinder(sizes.ring_radius(), inner, inner + HEAD))
        .difference(&hole_along_y(
            PINS[0],
            0.0,
            [-2.0 * sizes.rod, 2.0 * sizes.rod],
            -stack.lift - SEAT - PINS[0] - 0.2,
        ));
    // Lying on its flat.
    let print_turn = DMat3::from_rotation_y(FRAC_PI_2);
    let length = inner + HEAD - foot;
    let pieces = (length / (sizes.longest - PEG)).ceil().max(1.0) as usize;
    let each = length / pieces as f64;
    let wide = 2.0 * sizes.ring_radius();
    let thin = Sizes {
        rod: sizes.rod - sizes.wall,
        flat: (sizes.flat - sizes.wall / 2.0).max(0.4),
        ..*sizes
    };
    (0..pieces)
        .map(|k| {
            let [from, to] = [k, k + 1].map(|n| foot + each * n as f64);
            let low = if k == 0 { from - 1.0 } else { from };
            let high = if k + 1 == pieces { to + 1.0 } else { to };
            let mut piece = whole.intersection(&cuboid(
                DVec3::new(-wide, -wide, low),
                DVec3::new(wide, wide, high),
            ));
            if k > 0 {
                piece = piece.difference(&shaft(&thin, sizes.play, from - 1.0, from + PEG + 0.5));
            }
            if k + 1 < pieces {
                piece = piece.union(&shaft(&thin, 0.0, to - 1.0, to + PEG));
            }
            let of = if pieces == 1 {
                String::new()
            } else {
                format!("-{}", k + 1)
            };
            PrintedPart {
                name: format!("rod-{}{of}", stack.letter),
                solid: read(&piece),
                print_turn,
            }
        })
        .collect()
}

/// What rests on the rim: four spokes, of which the one with the arrow points to the part's front. Where something sticks out of
/// the opening it stands on feet.
fn seat(sizes: &Sizes, stack: &Stack) -> PrintedPart {
    const WIDTH: f64 = 8.0;
    let (low, high) = (-stack.lift - SEAT, -stack.lift);
    let spokes = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y].map(|way| {
        let [near, far] = rim(stack, way);
        let reach = (far + BEYOND_RIM).max(2.0 * sizes.ring_radius());
        let side = way.perp() * (WIDTH / 2.0);
        let between = |from: f64, to: f64, low: f64, high: f64| {
            let ends = [way * from - side, way * to + side];
            let (a, b) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            cuboid(a.extend(low), b.extend(high))
        };
        let spoke = between(0.0, reach, low, high);
        if stack.lift > 0.0 {
            let inner = near.max(reach - 10.0).min(reach - 4.0);
            return spoke.union(&between(inner, reach, low, 0.0));
        }
        spoke
    });
    let tip = rim(stack, DVec2::X)[1] + 2.0;
    let arrow = [
        DVec2::new(tip, 0.0),
        DVec2::new(tip - 6.0, 3.0),
        DVec2::new(tip - 6.0, -3.0),
    ];
    let arrow: Vec<DVec3> = arrow
        .iter()
        .flat_map(|p| [p.extend(low - 1.0), p.extend(low + 0.8)])
        .collect();
    let hub = cylinder(sizes.ring_radius() + sizes.wall, low, high);
    let body = joined(spokes.into_iter().chain([hub]).collect());
    // Cut into its outside, which lies on the printer's bed.
    let cut = shaft(sizes, sizes.play, low - 2.0, high + 1.0).union(&hull(&arrow));
    PrintedPart {
        name: format!("seat-{}", stack.letter),
        solid: read(&body.difference(&cut)),
        print_turn: DMat3::IDENTITY,
    }
}

/// From and to where the rim lies in a direction (mm).
fn rim(stack: &Stack, way: DVec2) -> [f64; 2] {
    /// Cosine of how far off it may lie.
    const BESIDE: f64 = 0.94;
    let near = stack
        .rim
        .iter()
        .filter(|p| p.normalize_or_zero().dot(way) > BESIDE);
    let reach = |points: &mut dyn Iterator<Item = &DVec2>| {
        points
            .map(|p| p.length())
            .fold([f64::INFINITY, 0.0], |[l, h], r| [l.min(r), h.max(r)])
    };
    let found = reach(&mut near.into_iter());
    if found[1] > 0.0 {
        return found;
    }
    let [_, far] = reach(&mut stack.rim.iter());
    [far, far]
}

/// The sleeve between a ring and the one before it, or the seat; nothing where they lie on each other.
fn sleeve(sizes: &Sizes, stack: &Stack, k: usize) -> Option<PrintedPart> {
    let to = stack.arms[k].ring(sizes)[0];
    let from = match k {
        0 => -stack.lift,
        _ => stack.arms[k - 1].ring(sizes)[1],
    };
    if to - from < sizes.wall / 2.0 {
        return None;
    }
    let radius = sizes.ring_radius();
    let mut body =
        cylinder(radius, from, to).difference(&shaft(sizes, sizes.play, from - 1.0, to + 1.0));
    if to - from > 6.0 {
        let hand = Lettering {
            size: DVec2::new(2.0, 3.2),
            stroke: 0.7,
            raised: 0.4,
        };
        let sign = number(k + 1, &hand);
        let at = DVec3::new(-radius + 0.2, 0.0, f64::midpoint(from, to));
        body = body.union(&placed(&sign, facing(DVec3::NEG_Y, DVec3::NEG_X), at));
    }
    Some(PrintedPart {
        name: format!("sleeve-{}{}", stack.letter, k + 1),
        solid: read(&body),
        print_turn: DMat3::IDENTITY,
    })
}

/// A ring with strut, guide, the eyelet of its cord, and its number.
fn ring(sizes: &Sizes, arm: &Arm) -> JigSolid {
    let (half, hole) = (sizes.guide_half(), sizes.stem / 2.0 + sizes.play);
    let [from, to] = arm.guide(sizes);
    let [low, high] = arm.ring(sizes);
    let z = arm.pad.height;
    let radius = sizes.ring_radius();
    let ring = cylinder(radius, low, high);
    let tab = cuboid(
        DVec3::new(0.0, -sizes.strut_half(), low),
        DVec3::new(radius + TAB, sizes.strut_half(), high),
    );
    let guide = cuboid(
        DVec3::new(from, -half, z - half),
        DVec3::new(to, half, z + half),
    );
    // The eyelet looks towards the opening, where the cord comes from.
    let eyelet = cuboid(
        DVec3::new(to - 3.0, -half, z - half - EYELET),
        DVec3::new(to, half, z - half + 0.5),
    );
    let hand = Lettering {
        size: DVec2::new(2.0, 3.6),
        stroke: 0.7,
        raised: 0.5,
    };
    let sign = number(arm.number, &hand);
    let middle = f64::midpoint(from, to);
    let signs = [-1.0, 1.0].map(|side| {
        let ways = facing(DVec3::X * -side, DVec3::Y * side);
        placed(&sign, ways, DVec3::new(middle, side * half, z))
    });
    let strut = hull(
        &(arm.strut(sizes).into_iter())
            .flat_map(|[low, high]| block(low, high, 0.0))
            .collect::<Vec<_>>(),
    );
    let all = [ring, tab, strut, guide, eyelet].into_iter().chain(signs);
    let body = joined(all.collect());
    let drawn = from - arm.travel;
    let channel = cuboid(
        DVec3::new(drawn - 0.5, -hole, z - hole),
        DVec3::new(to + 1.0, hole, z + hole),
    );
    let slot = cuboid(
        DVec3::new(drawn + 1.0, -PINS[1] - 0.2, z - half - 40.0),
        DVec3::new(from + TO_PIN + 1.5, PINS[1] + 0.2, z),
    );
    // The slot is for the pin alone: the ring is left.
    let slot = slot.difference(&cylinder(radius + TAB, low - 1.0, high + 1.0));
    let cord = hole_along_x(
        1.0,
        [to - 4.0, to + 1.0],
        0.0,
        z - half - EYELET / 2.0 + 0.2,
    );
    let bore = turned(&shaft(sizes, sizes.play, low - 1.0, high + 1.0), -arm.angle);
    let cut = joined(vec![channel, slot, cord, bore]);
    turned(&body.difference(&cut), arm.angle)
}

/// A pad with its stem and its number.
fn pad(sizes: &Sizes, arm: &Arm) -> JigSolid {
    let pad = &arm.pad;
    let half = sizes.stem / 2.0;
    let end = pad.back - arm.stem(sizes);
    let stem = cuboid(
        DVec3::new(end, -half, pad.height - half),
        DVec3::new(pad.back + sizes.pad / 2.0, half, pad.height + half),
    );
    let pin = moved(
        &cylinder(PINS[1], pad.height - half - 1.0, pad.height + half + 1.0),
        DVec3::X * (end + TO_PIN),
    );
    let stem = turned(&stem.difference(&pin), arm.angle);
    let room = pad.half.x - sizes.stem / 2.0_f64.sqrt();
    let hand = Lettering {
        size: DVec2::new(0.3 * room, (1.2 * pad.half.y).min(4.0)),
        stroke: 0.6,
        raised: 0.5,
    };
    let at = pad.out * pad.back + pad.along * (pad.half.x - room / 2.0) + DVec3::Z * pad.height;
    let sign = placed(&number(arm.number, &hand), facing(-pad.along, -pad.out), at);
    joined(vec![closed(&plate(pad)), stem, sign])
}

/// The pad between its face and its back.
fn plate(pad: &Pad) -> Facets {
    let row = ALONG + 1;
    let count = (row * (ACROSS + 1)) as u32;
    let at = |i: usize, j: usize| (j * row + i) as u32;
    let mut triangles = Vec::new();
    for j in 0..ACROSS {
        for i in 0..ALONG {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
            triangles.extend([[a, c, b], [a, d, c]].map(|t| t.map(|v| v + count)));
        }
    }
    let rim = (0..ALONG)
        .map(|i| (i, 0))
        .chain((0..ACROSS).map(|j| (ALONG, j)))
        .chain((0..ALONG).map(|i| (ALONG - i, ACROSS)))
        .chain((0..ACROSS).map(|j| (0, ACROSS - j)));
    let rim: Vec<u32> = rim.map(|(i, j)| at(i, j)).collect();
    for (k, &a) in rim.iter().enumerate() {
        let b = rim[(k + 1) % rim.len()];
        triangles.extend([[a, a + count, b], [b, a + count, b + count]]);
    }
    Facets {
        positions: pad.points(0.0),
        triangles,
    }
}

//! Which arms sit on which rod, and whether all of them get in and out.

use glam::{DVec2, DVec3};

use super::arm::{Arm, Bodies};
use super::convex::{meet, swept};
use super::frame::{Entry, JigFrame};
use super::reach::RodReach;
use super::rod::{Interior, RodLine, cover};
use super::sizes::Sizes;
use super::slots::slots;
use super::wall::{PressedGauge, Wall};
use super::why::{LeftOutGauge, Why};
use crate::budget::{Cancelled, Watch};

/// A rod with its arms, brought in together.
#[derive(Clone, Debug)]
pub struct Stack {
    /// By which its pieces are named: a, b, …
    pub letter: String,
    /// The end that it comes in at.
    pub entry: Entry,
    /// Where its rod runs.
    pub frame: JigFrame,
    /// From the opening inwards.
    pub arms: Vec<Arm>,
    /// The rim of the opening about the rod (mm): the seat rests on it.
    pub rim: Vec<DVec2>,
    /// How far the seat stands off the rim, for what sticks out of the opening (mm).
    pub lift: f64,
}

/// All that presses the gauges of a part.
pub struct Jig {
    /// Of its pieces.
    pub sizes: Sizes,
    /// What else its rods get to.
    pub reach: RodReach,
    /// One after another: a second one for what does not fit beside the first, or comes in at the other end.
    pub stacks: Vec<Stack>,
    /// What must be pressed by hand.
    pub left_out: Vec<LeftOutGauge>,
}

/// A jig for gauges with a film of half these sizes (mm).
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn plan(
    wall: Wall,
    gauges: &[PressedGauge],
    film: DVec2,
    watch: Watch,
) -> Result<Jig, Cancelled> {
    /// Rods, one after another.
    const RODS: usize = 6;
    let interior = Interior::new(wall, gauges.iter().map(|g| g.gauge.position), film);
    let rods = cover(&interior, gauges, RODS, watch)?;
    let reached = |number: usize| {
        let mut arms = rods.iter().flat_map(|rod| &rod.arms);
        arms.any(|arm| arm.number == number)
    };
    // What is said of the others is of the line that the most are reached on.
    let line = rods.first().map(|rod| rod.line);
    let line = line.or_else(|| interior.lines().first().copied());
    let left = gauges.iter().filter(|g| !reached(g.number));
    let mut left_out = line.map_or(Vec::new(), |line| interior.rod(line, left).left_out);
    let mut stacks: Vec<Stack> = Vec::new();
    let lines = rods.iter().map(|rod| rod.line).collect();
    for rod in rods {
        let (passes, refused) = passes(&interior, rod.line, rod.arms);
        left_out.extend(refused.iter().map(|arm| LeftOutGauge {
            number: arm.number,
            why: Why::Arm,
        }));
        for arms in passes {
            stacks.push(Stack {
                letter: letter(stacks.len()),
                entry: interior.entry(rod.line),
                frame: interior.frame(rod.line),
                rim: interior.rim(rod.line),
                lift: lift(&interior.sizes, &arms),
                arms,
            });
        }
    }
    left_out.sort_by_key(|left| left.number);
    Ok(Jig {
        sizes: interior.sizes,
        reach: RodReach::of(interior, lines),
        stacks,
        left_out,
    })
}

/// a to z, and then a2, b2, …
fn letter(k: usize) -> String {
    const LETTERS: usize = 26;
    let letter = char::from(b'a' + (k % LETTERS) as u8);
    match k / LETTERS {
        0 => letter.to_string(),
        round => format!("{letter}{}", round + 1),
    }
}

/// Arms that fit beside each other, in as few goes as a greedy search finds: each arm in the first that it fits into.
/// Those come after them that do not even fit alone, with the seat in the way.
fn passes(interior: &Interior, line: RodLine, arms: Vec<Arm>) -> (Vec<Vec<Arm>>, Vec<Arm>) {
    let mut passes: Vec<Vec<Arm>> = Vec::new();
    let mut refused = Vec::new();
    for arm in arms {
        let mut left = Some(arm);
        for pass in &mut passes {
            let Some(arm) = left.take() else { break };
            let mut with = pass.clone();
            with.push(arm.clone());
            space_rings(&interior.sizes, &mut with);
            if fit(interior, line, &with) {
                *pass = with;
            } else {
                left = Some(arm);
            }
        }
        if let Some(arm) = left {
            let mut alone = vec![arm];
            space_rings(&interior.sizes, &mut alone);
            if fit(interior, line, &alone) {
                passes.push(alone);
            } else {
                refused.extend(alone);
            }
        }
    }
    (passes, refused)
}

/// How far the seat must stand off the rim (mm).
fn lift(sizes: &Sizes, arms: &[Arm]) -> f64 {
    /// Between the seat and what sticks out (mm).
    const SPARE: f64 = 1.0;
    let out = arms.iter().map(|arm| arm.sticks_out(sizes));
    let out = out.fold(0.0, f64::max);
    if out > 0.0 { out + SPARE } else { 0.0 }
}

/// Makes room for rings on their rod.
fn space_rings(sizes: &Sizes, arms: &mut [Arm]) {
    let wanted: Vec<f64> = arms.iter().map(|a| a.pad.height).collect();
    let lowest = sizes.ring / 2.0;
    let found = slots(&wanted, lowest, sizes.ring, sizes.wall);
    for (arm, slot) in arms.iter_mut().zip(found) {
        arm.slot = slot;
    }
}

/// Whether all arms (from the opening inwards) get in, are slid on one after another from the innermost, and have their
/// pads pressed without meeting each other.
fn fit(interior: &Interior, line: RodLine, arms: &[Arm]) -> bool {
    /// How far a strut may rise over its length.
    const STEEP: f64 = 1.2;
    let sizes = &interior.sizes;
    let steep = arms.iter().any(|arm| {
        let reach = (arm.guide(sizes)[0] - sizes.ring_radius()).max(1.0);
        (arm.slot - arm.pad.height).abs() > STEEP * reach.max(sizes.ring)
    });
    if steep || arms.iter().any(|arm| interior.gets_in(line, arm).is_err()) {
        return false;
    }
    pairs(arms).all(|(a, b)| are_apart(sizes, a, b))
}

/// Whether two arms, the second farther in, stand beside each other and the first gets there after the second.
fn are_apart(sizes: &Sizes, outer: &Arm, inner: &Arm) -> bool {
    let pressed = |arm: &Arm| -> Bodies {
        let [ring, strut, guide, pad] = arm.bodies(sizes, 0.0);
        [ring, strut, guide, swept(&pad, arm.pad.out * -arm.travel)]
    };
    let (first, second) = (pressed(outer), pressed(inner));
    let beside = !crossing(&first, &second);
    let way = DVec3::NEG_Z * (inner.pad.height + 50.0);
    let moving = outer.bodies(sizes, outer.travel).map(|b| swept(&b, way));
    beside && !crossing(&moving, &inner.bodies(sizes, inner.travel))
}

/// Each two, the first nearer to the opening.
fn pairs(arms: &[Arm]) -> impl Iterator<Item = (&Arm, &Arm)> {
    (arms.iter().enumerate()).flat_map(|(k, a)| arms[k + 1..].iter().map(move |b| (a, b)))
}

fn crossing(some: &Bodies, others: &Bodies) -> bool {
    some.iter().any(|a| others.iter().any(|b| meet(a, b)))
}

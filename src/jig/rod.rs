//! Lines that a rod may run on, and which gauges arms on it get to.

use glam::{DVec2, DVec3};

use super::arm::Arm;
use super::convex::{Obstacle, bar, swept};
use super::frame::{Entry, JigFrame};
use super::sizes::Sizes;
use super::wall::{PressedGauge, Wall};
use super::why::{LeftOutGauge, Why};
use crate::budget::{Cancelled, Watch, report};
use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;
use crate::units;

/// Height of the rod's head, behind the innermost ring (mm).
pub const HEAD: f64 = 3.0;

/// What gauges are pressed in, and with what.
pub struct Interior {
    /// The part.
    pub wall: Wall,
    /// Half length and width of a gauge's film (mm).
    pub film: DVec2,
    /// Of the pieces.
    pub sizes: Sizes,
    /// Both ends of the part.
    ends: Vec<PartEnd>,
    /// Of the gauge nearest to the middle (mm).
    nearest: f64,
}

/// An end of the part.
struct PartEnd {
    entry: Entry,
    /// Of a rod in the middle.
    frame: JigFrame,
    obstacle: Obstacle,
    /// The part's end there, about the middle (mm).
    rim: Vec<DVec2>,
}

/// A line that a rod may run on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodLine {
    /// The number of the end.
    end: usize,
    /// Of the middle (mm).
    beside: DVec2,
}

/// A line with the arms that get to their gauges on it, and those that do not.
#[derive(Clone, Debug)]
pub struct Rod {
    /// Where it runs.
    pub line: RodLine,
    /// From the opening inwards.
    pub arms: Vec<Arm>,
    /// In the gauges' order.
    pub left_out: Vec<LeftOutGauge>,
}

impl Interior {
    /// For gauges at places (m) on the inner face, with a film of half these sizes (mm).
    #[must_use]
    pub fn new(wall: Wall, places: impl Iterator<Item = DVec3>, film: DVec2) -> Self {
        let middle = middle(&wall.face, wall.stance);
        let distance = |place: DVec3| {
            let at = wall.stance.coordinates(place).truncate();
            units::mm(at.distance(middle))
        };
        let nearest = places.map(distance).fold(f64::INFINITY, f64::min);
        Self {
            sizes: Sizes::within(nearest),
            ends: [Entry::Foot, Entry::Top]
                .into_iter()
                .filter_map(|entry| PartEnd::new(entry, &wall, middle))
                .collect(),
            wall,
            film,
            nearest,
        }
    }

    /// Lines that are tried: the middle, and around it.
    #[must_use]
    pub fn lines(&self) -> Vec<RodLine> {
        /// Over the distance of the nearest gauge.
        const AROUND: [f64; 3] = [0.2, 0.4, 0.6];
        const WAYS: u32 = 8;
        let around = AROUND.iter().flat_map(|share| {
            (0..WAYS).map(move |k| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(WAYS);
                DVec2::from_angle(angle) * (share * self.nearest)
            })
        });
        let ends = 0..self.ends.len();
        std::iter::once(DVec2::ZERO)
            .chain(around)
            .flat_map(|beside| ends.clone().map(move |end| RodLine { end, beside }))
            .collect()
    }

    /// The frame of a rod there.
    #[must_use]
    pub fn frame(&self, line: RodLine) -> JigFrame {
        self.ends[line.end].frame.beside(line.beside)
    }

    /// The end that it comes in at.
    #[must_use]
    pub fn entry(&self, line: RodLine) -> Entry {
        self.ends[line.end].entry
    }

    /// The rim of its opening (mm).
    #[must_use]
    pub fn rim(&self, line: RodLine) -> Vec<DVec2> {
        let rim = self.ends[line.end].rim.iter();
        rim.map(|p| *p - line.beside).collect()
    }

    /// A rod for these gauges.
    #[must_use]
    pub fn rod<'g>(
        &self,
        line: RodLine,
        gauges: impl IntoIterator<Item = &'g PressedGauge>,
    ) -> Rod {
        let mut rod = Rod {
            line,
            arms: Vec::new(),
            left_out: Vec::new(),
        };
        for gauge in gauges {
            let number = gauge.number;
            match self.arm(line, gauge) {
                Ok(arm) => rod.arms.push(arm),
                Err(why) => rod.left_out.push(LeftOutGauge { number, why }),
            }
        }
        rod.arms
            .sort_by(|a, b| a.pad.height.total_cmp(&b.pad.height));
        rod
    }

    /// The arm of a gauge, its pad drawn back as little as lets it in.
    ///
    /// # Errors
    /// Why there is none on this line.
    pub fn arm(&self, line: RodLine, gauge: &PressedGauge) -> Result<Arm, Why> {
        /// Travels that are tried (mm).
        const STEP: f64 = 1.0;
        let sizes = &self.sizes;
        let frame = self.frame(line);
        let mut arm = Arm::new(&self.wall, gauge, &frame, self.film, sizes)?;
        let least = arm.travel;
        let steps = ((arm.most_travel(sizes) - least) / STEP).floor();
        arm.travel = least + steps * STEP;
        self.gets_in(line, &arm)?;
        for step in 0..steps as u32 {
            let tried = Arm {
                travel: least + f64::from(step) * STEP,
                ..arm.clone()
            };
            if self.gets_in(line, &tried).is_ok() {
                return Ok(tried);
            }
        }
        Ok(arm)
    }

    /// Whether an arm gets from outside to its place, drawn back, along its rod.
    ///
    /// # Errors
    /// What does not.
    pub fn gets_in(&self, line: RodLine, arm: &Arm) -> Result<(), Why> {
        let obstacle = &self.ends[line.end].obstacle;
        let head = bar(self.sizes.rod, -1.0, arm.ring(&self.sizes)[1] + HEAD);
        if obstacle.meets(&head, line.beside) {
            return Err(Why::Rod);
        }
        let way = DVec3::NEG_Z * (arm.pad.height.max(arm.slot) + 50.0);
        let [ring, strut, guide, pad] = arm.bodies(&self.sizes, arm.travel);
        let blocked = |body: &[DVec3]| obstacle.meets(&swept(body, way), line.beside);
        if blocked(&pad) {
            return Err(Why::Pad(arm.travel));
        }
        if [ring, strut, guide].iter().any(|body| blocked(body)) {
            return Err(Why::Arm);
        }
        Ok(())
    }
}

impl PartEnd {
    fn new(entry: Entry, wall: &Wall, middle: DVec2) -> Option<Self> {
        /// What belongs to the rim (mm).
        const RIM: f64 = 2.0;
        let (part, stance) = (&*wall.part, wall.stance);
        let heights = part.positions().iter().map(|p| stance.coordinates(*p).z);
        let end = match entry {
            Entry::Foot => heights.fold(f64::INFINITY, f64::min),
            Entry::Top => heights.fold(f64::NEG_INFINITY, f64::max),
        };
        let frame = JigFrame::at(entry, stance, middle, end);
        let places = part.positions().iter().map(|&p| frame.here(p));
        Some(Self {
            entry,
            frame,
            rim: places.filter(|p| p.z < RIM).map(DVec3::truncate).collect(),
            obstacle: Obstacle::new(part, &frame)?,
        })
    }
}

/// The middle of a face in the stance's plane (m): of its box.
fn middle(face: &TriMesh, stance: Stance) -> DVec2 {
    let flat = face
        .positions()
        .iter()
        .map(|p| stance.coordinates(*p).truncate());
    let (low, high) = flat.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| {
        (l.min(p), h.max(p))
    });
    (low + high) / 2.0
}

/// Rods that together get to as many gauges as one after another can, each to the most that are left, at most so many.
///
/// # Errors
/// [`Cancelled`] when the watch asks for it.
pub fn cover(
    interior: &Interior,
    gauges: &[PressedGauge],
    most: usize,
    watch: Watch,
) -> Result<Vec<Rod>, Cancelled> {
    let mut tried: Vec<Rod> = Vec::new();
    let lines = interior.lines();
    let count = lines.len();
    for (k, line) in lines.into_iter().enumerate() {
        report(watch, "Looking for a rod", k, count)?;
        tried.push(interior.rod(line, gauges));
        if tried.last().is_some_and(|rod| rod.left_out.is_empty()) {
            break;
        }
    }
    let mut rods: Vec<Rod> = Vec::new();
    while rods.len() < most {
        // Of several with as many the first: nearest to the middle.
        let best = tried
            .iter()
            .rev()
            .max_by_key(|rod| rod.arms.len())
            .filter(|rod| !rod.arms.is_empty())
            .cloned();
        let Some(best) = best else { break };
        let held = |number: usize| best.arms.iter().any(|a| a.number == number);
        for rod in &mut tried {
            rod.arms.retain(|a| !held(a.number));
        }
        rods.push(best);
    }
    Ok(rods)
}

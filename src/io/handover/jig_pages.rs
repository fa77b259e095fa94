//! The jig in the report: what is put together in which order, a picture of each step, and what is pressed by hand.

use glam::{DVec2, DVec3};

use super::marks::{ACCENT, INK};
use super::source::HandoverSource;
use crate::gauge::Gauge;
use crate::jig::{Arm, Jig, Stack, bar, outline};
use crate::paper::{Align, Flow, Ink, Sheet, SheetLine};
use crate::workshop::Inner;

/// Pictures in a row, and how high each is (mm).
const ROW: usize = 5;
const HEIGHT: f64 = 58.0;

/// How a jig is used, whatever its pieces.
const USE: [&str; 5] = [
    "Push the stem of each pad into its arm from outside, and a piece of filament (1.75 mm) through the hole in its end, where it shows in the slot. Tie a cord to it, lead it through the eyelet at the end of the arm and back along the rod.",
    "Put the pieces onto the rod in the order of the table, up to its head; the flat gives the angles, the sleeves give the heights. The seat comes last, its arrow on the outside; a nail of 3 mm through the rod holds all of it.",
    "Draw all pads back and push the rod in until the seat rests on the rim, its arrow to the part's front. Try this before there is glue on anything.",
    "Pull the cords until each pad lies at the wall, and fasten them around the end of the rod. Let it cure.",
    "Undo the cords, push the pads back and draw the rod out as it came.",
];

/// The section; nothing where nothing is chosen.
pub(super) fn all(flow: &mut Flow, source: &HandoverSource<'_>) {
    let jig = &source.jig;
    if jig.stacks.is_empty() && jig.left_out.is_empty() {
        return;
    }
    flow.heading("The jig");
    if jig.stacks.is_empty() {
        flow.text("No rod reaches a gauge on a straight way in, so there is none: the gauges are pressed by hand.");
    } else {
        flow.text(&format!(
            "The pieces in jig/ are to be printed in mm, as they lie. They press the gauges to the wall while the glue cures: a rod, a ring with one arm for each gauge, and in each arm a pad that carries the wall's shape, {} mm before it, which film, wool and gauge fill.",
            jig.sizes.gap
        ));
        for (k, step) in (1..).zip(USE) {
            flow.point(&format!("{k}."), step);
        }
    }
    for stack in &jig.stacks {
        stack_of(flow, source, stack);
    }
    for left in &jig.left_out {
        let words = left.why.words();
        let number = left.number;
        let mut text = format!("Gauge {number} is pressed by hand: {words}.");
        if let Some(offer) = instead(source, number) {
            text.push(' ');
            text += &offer;
        }
        flow.point("•", &text);
    }
}

/// The nearest feasible site that the jig gets to, in words.
fn instead(source: &HandoverSource<'_>, number: usize) -> Option<String> {
    /// Of the nearest.
    const TRIED: usize = 150;
    let gauge = source.inner.gauges.iter().find(|g| g.number == number)?;
    let all = &source.design.simulated.dataset.sites;
    let far = |at: &Gauge| at.position.distance(gauge.gauge.position);
    let mut sites: Vec<Gauge> = (source.design.feasibility.sites().into_iter())
        .map(|s| source.inner.gauge(&all[s].gauge))
        .collect();
    sites.sort_by(|a, b| far(a).total_cmp(&far(b)));
    let mut nearest = sites.iter().take(TRIED);
    let found = nearest.find(|site| source.jig.reach.gets_to(site))?;
    let [x, y, z] = (found.position * 1e3).to_array();
    Some(format!(
        "The nearest site that an arm gets to is {:.0} mm away, at ({x:.0}, {y:.0}, {z:.0}) mm; feasible.jig = true keeps to such sites.",
        far(found) * 1e3
    ))
}

fn stack_of(flow: &mut Flow, source: &HandoverSource<'_>, stack: &Stack) {
    let jig = &source.jig;
    let letter = &stack.letter;
    let after = if letter == "a" {
        ""
    } else {
        ", when the one before is out again"
    };
    let entry = stack.entry.name();
    flow.need(HEIGHT);
    flow.text(&format!("Rod {letter} comes in at the {entry}{after}."));
    let rows: Vec<Vec<String>> = (1..)
        .zip(stack.arms.iter().enumerate().rev())
        .map(|(step, (k, arm))| row(jig, stack, step, (k, arm)))
        .collect();
    flow.table(
        &[
            "Step",
            "Ring and pad",
            "Then",
            "Height of the pad (mm)",
            "About the rod (°)",
            "Drawn back (mm)",
        ],
        &rows,
    );
    let order: Vec<&Arm> = stack.arms.iter().rev().collect();
    let steps: Vec<usize> = (1..=order.len()).collect();
    for chunk in steps.chunks(ROW) {
        let width = flow.width() / ROW as f64;
        let (sheet, corner) = flow.room(HEIGHT + 6.0);
        for (column, &step) in chunk.iter().enumerate() {
            let corner = corner + DVec2::new(column as f64 * width, 0.0);
            picture(
                sheet,
                (&source.inner, jig, stack),
                &order[..step],
                corner,
                DVec2::new(width - 2.0, HEIGHT),
            );
            let below = corner + DVec2::new(width / 2.0, HEIGHT + 4.0);
            sheet.say(below, &format!("{step}"), 3.0, Align::Middle);
        }
    }
}

fn row(jig: &Jig, stack: &Stack, step: usize, (k, arm): (usize, &Arm)) -> Vec<String> {
    let [low, _] = arm.ring(&jig.sizes);
    let before = match k {
        0 => -stack.lift,
        _ => stack.arms[k - 1].ring(&jig.sizes)[1],
    };
    let sleeve = format!("sleeve {}{}", stack.letter, k + 1);
    let then = match (k, low - before > jig.sizes.wall / 2.0) {
        (0, true) => format!("{sleeve}, seat {}", stack.letter),
        (0, false) => format!("seat {}", stack.letter),
        (_, true) => sleeve,
        (_, false) => String::from("–"),
    };
    vec![
        step.to_string(),
        format!("{:02}", arm.number),
        then,
        format!("{:.1}", arm.pad.height),
        format!("{:.0}", arm.angle.to_degrees()),
        format!("{:.0}", arm.travel),
    ]
}

/// The rod with some of its arms, the last of them in colour, in the outline of the part; seen from the side and a little from
/// above, the opening below.
fn picture(
    sheet: &mut Sheet,
    (inner, jig, stack): (&Inner, &Jig, &Stack),
    arms: &[&Arm],
    corner: DVec2,
    room: DVec2,
) {
    let sizes = &jig.sizes;
    // To the right, up, and towards who looks.
    let toward = DVec3::new(0.5, -0.8, 0.33).normalize();
    let right = DVec3::Z.cross(toward).normalize();
    let up = toward.cross(right);
    let flat = |p: DVec3| DVec2::new(p.dot(right), p.dot(up));
    let part: Vec<DVec2> = (inner.mesh.positions().iter())
        .map(|&p| flat(stack.frame.here(p)))
        .collect();
    let around = outline(part);
    let deep = stack.arms.last().map_or(0.0, |arm| arm.ring(sizes)[1]);
    let rod = bar(sizes.rod, -stack.lift - 20.0, deep + 3.0);
    let mut bodies: Vec<(f64, Vec<DVec2>, Ink)> = Vec::new();
    let mut add = |body: &[DVec3], ink: Ink| {
        let near = body.iter().map(|p| p.dot(toward)).sum::<f64>() / body.len() as f64;
        bodies.push((near, outline(body.iter().map(|&p| flat(p)).collect()), ink));
    };
    add(&rod, [0xe8, 0xea, 0xed]);
    for (k, arm) in arms.iter().enumerate() {
        let ink = if k + 1 == arms.len() {
            [0xf4, 0xc2, 0x9b]
        } else {
            [0xd3, 0xd8, 0xde]
        };
        for body in arm.bodies(sizes, 0.0) {
            add(&body, ink);
        }
    }
    bodies.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = around.iter().chain(bodies.iter().flat_map(|b| &b.1));
    let (low, high) = all.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), &p| {
        (l.min(p), h.max(p))
    });
    let scale = (room / (high - low)).min_element();
    let spare = room - (high - low) * scale;
    let place = |p: DVec2| {
        let q = (p - low) * scale;
        corner + spare / 2.0 + DVec2::new(q.x, (high - low).y * scale - q.y)
    };
    let pale = SheetLine::new([0xa0, 0xa8, 0xb4], 0.2);
    sheet.shape(around.into_iter().map(place), None, Some(pale));
    for (_, body, ink) in bodies {
        sheet.shape(
            body.into_iter().map(place),
            Some(ink),
            Some(SheetLine::new(INK, 0.12)),
        );
    }
    if let Some(arm) = arms.last() {
        let at = arm.pad.point(DVec2::ZERO, arm.pad.back);
        let at = place(flat(at));
        sheet.circle(at, 2.1, Some([255; 3]), Some(SheetLine::new(ACCENT, 0.25)));
        sheet.say(
            at + DVec2::new(0.0, 1.0),
            &arm.number.to_string(),
            2.6,
            Align::Middle,
        );
    }
}

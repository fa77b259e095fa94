//! A card for each gauge: where it goes, by what can be measured, with a picture of the wall around it.

use glam::DVec2;

use super::marks::{BLUE, INK, gauge, label};
use super::source::HandoverSource;
use crate::paper::{Align, Flow, Ink, PlacedWords, Sheet, SheetLine, Typeface};
use crate::workshop::{GluedGauge, Landmarks, Patch};

const HEIGHT: f64 = 50.0;
const PICTURE: f64 = 46.0;

/// Of all gauges.
pub(super) fn all(flow: &mut Flow, source: &HandoverSource<'_>) {
    flow.heading("A card for each gauge");
    flow.text("Pictures are at full size and seen from inside, with the part's axis up; blue is an edge of the wall. Lengths are straight, as callipers measure them, from the middle of the gauge.");
    for (glued, landmarks) in source.inner.gauges.iter().zip(&source.landmarks) {
        let patch = Patch::around(&source.inner, glued.gauge.position, 0.6e-3 * PICTURE);
        let (sheet, corner) = flow.room(HEIGHT);
        frame(sheet, corner);
        if let Ok(patch) = patch {
            picture(sheet, source, &patch, glued, corner);
        }
        words(
            sheet,
            source,
            glued,
            landmarks,
            corner + DVec2::new(PICTURE + 6.0, 0.0),
        );
    }
}

fn frame(sheet: &mut Sheet, corner: DVec2) {
    let size = DVec2::splat(PICTURE);
    let points = [
        corner,
        corner + DVec2::new(size.x, 0.0),
        corner + size,
        corner + DVec2::new(0.0, size.y),
    ];
    sheet.shape(points, None, Some(SheetLine::new([0xd8, 0xdc, 0xe3], 0.2)));
}

/// The wall's edges and the gauges in the frame.
fn picture(
    sheet: &mut Sheet,
    source: &HandoverSource<'_>,
    patch: &Patch,
    glued: &GluedGauge,
    corner: DVec2,
) {
    let half = PICTURE / 2.0;
    let middle = corner + DVec2::splat(half);
    let place = |p: DVec2| middle + DVec2::new(p.x, -p.y) * 1e3;
    for edge in &patch.edges {
        let ends = edge.map(|v| patch.flat[v as usize] * 1e3);
        if let Some(ends) = clipped(ends, half) {
            sheet.line(
                ends.map(|p| middle + DVec2::new(p.x, -p.y)),
                SheetLine::new(BLUE, 0.35),
            );
        }
    }
    let keys = &source.inputs.project.gauge;
    let size = DVec2::new(keys.grid_length_mm, keys.grid_width_mm);
    for other in &source.inner.gauges {
        let inside = |p: &DVec2| p.abs().max_element() * 1e3 < half - 3.0;
        let Some(at) = patch.lay(other.gauge.position).filter(inside) else {
            continue;
        };
        if other.number != glued.number {
            label(sheet, place(at), other.number);
        } else if let Some(along) = patch.turn(glued.gauge.position, glued.gauge.direction) {
            gauge(
                sheet,
                place(at),
                DVec2::new(along.x, -along.y),
                size,
                glued.number,
            );
        }
    }
    let arrow =
        [(-1.2, 3.0), (0.0, 0.0), (1.2, 3.0)].map(|(x, y)| corner + DVec2::new(2.8 + x, 1.4 + y));
    sheet.shape(arrow, Some(INK), None);
}

/// What of a line lies in a square about the origin.
fn clipped([a, b]: [DVec2; 2], half: f64) -> Option<[DVec2; 2]> {
    let way = b - a;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for k in 0..2 {
        if way[k].abs() < 1e-12 {
            if a[k].abs() > half {
                return None;
            }
            continue;
        }
        let ends = [(-half - a[k]) / way[k], (half - a[k]) / way[k]];
        from = from.max(ends[0].min(ends[1]));
        to = to.min(ends[0].max(ends[1]));
    }
    (from < to).then(|| [a + way * from, a + way * to])
}

fn words(
    sheet: &mut Sheet,
    source: &HandoverSource<'_>,
    glued: &GluedGauge,
    at: &Landmarks,
    corner: DVec2,
) {
    const PALE: Ink = [0x4a, 0x55, 0x68];
    /// Between two lines, and before their texts (mm).
    const LINE: f64 = 4.9;
    const IN: f64 = 20.0;
    let title = format!("Gauge {}", glued.number);
    sheet.say(corner + DVec2::new(0.0, 4.6), &title, 4.2, Align::Left);
    let lines = place(glued, at).into_iter().chain(read(source, glued));
    for (k, (label, text)) in lines.enumerate() {
        let at = corner + DVec2::new(0.0, 10.4 + LINE * k as f64);
        for (at, text, size, ink) in [
            (at, label.to_owned(), 2.8, PALE),
            (at + DVec2::new(IN, 0.0), text, 3.1, INK),
        ] {
            sheet.words(PlacedWords {
                at,
                text,
                size,
                face: Typeface::Text,
                ink,
                align: Align::Left,
            });
        }
    }
}

/// Where it is.
fn place(glued: &GluedGauge, at: &Landmarks) -> Vec<(&'static str, String)> {
    let mm = |metres: f64| format!("{:.1} mm", metres * 1e3);
    let side = if at.turned_deg >= 0.0 {
        "clockwise"
    } else {
        "counterclockwise"
    };
    let towards = if at.around_deg >= 0.0 {
        "right"
    } else {
        "left"
    };
    let mut lines = vec![
        (
            "Height",
            format!(
                "{} above the foot, {} below the top",
                mm(at.above_foot),
                mm(at.below_top)
            ),
        ),
        (
            "Around",
            format!(
                "{:.1}° about the axis from the front, towards the {towards}",
                at.around_deg.abs()
            ),
        ),
    ];
    if let Some((distance, _)) = at.from_edge {
        lines.push((
            "Edge",
            format!("{} from the nearest edge of the wall", mm(distance)),
        ));
    }
    lines.push((
        "Direction",
        format!(
            "{:.0}° {side} from the part's axis, seen from inside",
            at.turned_deg.abs()
        ),
    ));
    let others: Vec<String> = (at.neighbours.iter())
        .map(|n| format!("gauge {}: {}", n.number, mm(n.distance)))
        .collect();
    if !others.is_empty() {
        lines.push(("Neighbours", others.join(", ")));
    }
    let p = glued.gauge.position * 1e3;
    lines.push((
        "Place",
        format!("({:.2}, {:.2}, {:.2}) mm, on the inner face", p.x, p.y, p.z),
    ));
    lines
}

/// What it reads, and where it is wired to.
fn read(source: &HandoverSource<'_>, glued: &GluedGauge) -> Vec<(&'static str, String)> {
    let channel = source
        .wiring
        .channels
        .iter()
        .find(|c| c.gauge == glued.number);
    let Some(c) = channel else { return Vec::new() };
    let ([low, high], [least, most]) = (c.microstrain, c.counts);
    vec![
        (
            "Reads",
            format!(
                "{low:.0} to {high:+.0} µε under {} N, {least:.0} to {most:+.0} counts",
                source.wiring.force_n
            ),
        ),
        ("Wired to", format!("pin {}, channel {}", c.pin, c.channel)),
    ]
}

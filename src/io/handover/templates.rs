//! `template.pdf`: the inside of the wall at full size, to be cut out and laid in.

mod head;
mod tiles;

use glam::DVec2;

use self::head::{HEAD, MARGIN, head};
use super::marks::{BLUE, INK, gauge, label};
use super::source::HandoverSource;
use crate::paper::{Align, Sheet, SheetLine};
use crate::workshop::{GluedGauge, Landmarks, Patch};

/// All sheets: a patch for each gauge, then the whole inside.
///
/// # Errors
/// Where a gauge lies on no wall.
pub(super) fn sheets(source: &HandoverSource<'_>) -> Result<Vec<Sheet>, String> {
    let mut sheets = patches(source)?;
    sheets.extend(tiles::sheets(source));
    let count = sheets.len();
    for (k, sheet) in sheets.iter_mut().enumerate() {
        let at = DVec2::new(sheet.size.x - MARGIN, sheet.size.y - 7.0);
        sheet.say(at, &format!("{} of {count}", k + 1), 2.8, Align::Right);
        let at = DVec2::new(MARGIN, sheet.size.y - 7.0);
        sheet.say(
            at,
            &format!(
                "Templates for {}, 1 : 1, seen from inside. Run {}",
                source.name, source.run
            ),
            2.8,
            Align::Left,
        );
    }
    Ok(sheets)
}

fn patches(source: &HandoverSource<'_>) -> Result<Vec<Sheet>, String> {
    /// Between two patches, and below each for its words (mm).
    const GAP: f64 = 6.0;
    const WORDS: f64 = 10.0;
    /// What the words below take at least.
    const NARROWEST: f64 = 32.0;
    let new = || {
        let mut sheet = Sheet::new(source.format);
        head(
            &mut sheet,
            "A patch for each gauge",
            "Cut along the circle; its arrow points along the part's axis. Blue lines lie on the edges of the wall: what is beyond is folded around.",
        );
        sheet
    };
    let mut sheets = vec![new()];
    let size = source.format.size();
    let (mut corner, mut tall) = (DVec2::new(MARGIN, HEAD), 0.0_f64);
    for (glued, landmarks) in source.inner.gauges.iter().zip(&source.landmarks) {
        let radius = radius(source, landmarks);
        let patch = Patch::around(&source.inner, glued.gauge.position, radius * 1e-3)?;
        let side = (2.0 * radius).max(NARROWEST);
        if corner.x + side > size.x - MARGIN {
            corner = DVec2::new(MARGIN, corner.y + tall + GAP);
            tall = 0.0;
        }
        if corner.y + 2.0 * radius + WORDS > size.y - MARGIN {
            sheets.push(new());
            corner = DVec2::new(MARGIN, HEAD);
            tall = 0.0;
        }
        let last = sheets.len() - 1;
        one(
            &mut sheets[last],
            source,
            &patch,
            glued,
            corner + DVec2::new(side / 2.0, radius),
            radius,
        );
        tall = tall.max(2.0 * radius + WORDS);
        corner.x += side + GAP;
    }
    Ok(sheets)
}

/// Of a patch (mm): beyond the nearest edge of the wall, so that it can be put in one way only, and not so large that a tube
/// cannot be laid flat.
fn radius(source: &HandoverSource<'_>, landmarks: &Landmarks) -> f64 {
    const BEYOND: f64 = 12.0;
    const LARGEST: f64 = 34.0;
    let keys = &source.inputs.project.gauge;
    let film = DVec2::new(keys.grid_length_mm, keys.grid_width_mm).length() / 2.0 + 9.0;
    let edge = landmarks.from_edge.map_or(0.0, |(far, _)| far * 1e3);
    (edge + BEYOND).clamp(film, LARGEST.max(film))
}

fn one(
    sheet: &mut Sheet,
    source: &HandoverSource<'_>,
    patch: &Patch,
    glued: &GluedGauge,
    middle: DVec2,
    radius: f64,
) {
    let place = |p: DVec2| middle + DVec2::new(p.x, -p.y) * 1e3;
    for tri in &patch.triangles {
        let corners = tri.map(|v| patch.flat[v as usize] * 1e3);
        let inside = in_circle(&corners, radius);
        if !inside.is_empty() {
            let grey = [0xf2, 0xf3, 0xf5];
            let drawn = inside.into_iter().map(|p| middle + DVec2::new(p.x, -p.y));
            sheet.shape(drawn, Some(grey), Some(SheetLine::new(grey, 0.05)));
        }
    }
    for edge in &patch.edges {
        let [a, b] = edge.map(|v| patch.flat[v as usize] * 1e3);
        if let Some((from, to)) = chord(a, b, radius) {
            let ends = [a.lerp(b, from), a.lerp(b, to)];
            sheet.line(
                ends.map(|p| middle + DVec2::new(p.x, -p.y)),
                SheetLine::new(BLUE, 0.4),
            );
        }
    }
    sheet.circle(middle, radius, None, Some(SheetLine::new(INK, 0.2)));
    let keys = &source.inputs.project.gauge;
    let size = DVec2::new(keys.grid_length_mm, keys.grid_width_mm);
    for other in source
        .inner
        .gauges
        .iter()
        .filter(|o| o.number != glued.number)
    {
        if let Some(at) = patch
            .lay(other.gauge.position)
            .filter(|p| p.length() * 1e3 < radius - 2.5)
        {
            label(sheet, place(at), other.number);
        }
    }
    if let Some(along) = patch.turn(glued.gauge.position, glued.gauge.direction) {
        gauge(
            sheet,
            middle,
            DVec2::new(along.x, -along.y),
            size,
            glued.number,
        );
    }
    // Up is marked on the rim.
    let top = middle - DVec2::new(0.0, radius);
    let arrow = [(-1.4, 3.6), (0.0, 0.8), (1.4, 3.6)].map(|(x, y)| top + DVec2::new(x, y));
    sheet.shape(arrow, Some(INK), None);
    let below = middle + DVec2::new(0.0, radius + 4.0);
    sheet.say(
        below,
        &format!("Gauge {}", glued.number),
        2.6,
        Align::Middle,
    );
    let words = format!("stretched {:.1} % at most", 100.0 * patch.stretch);
    sheet.say(below + DVec2::new(0.0, 3.6), &words, 2.6, Align::Middle);
}

/// Where a line is inside a circle about the origin, as shares of its way.
fn chord(a: DVec2, b: DVec2, radius: f64) -> Option<(f64, f64)> {
    let way = b - a;
    let (square, half) = (way.length_squared(), a.dot(way));
    let root = half * half - square * (a.length_squared() - radius * radius);
    if square <= 0.0 || root <= 0.0 {
        return None;
    }
    let ends = [-1.0, 1.0].map(|s| (-half + s * root.sqrt()) / square);
    let (from, to) = (ends[0].max(0.0), ends[1].min(1.0));
    (from < to).then_some((from, to))
}

/// A triangle's part in a circle about the origin, its round side as corners.
fn in_circle(corners: &[DVec2; 3], radius: f64) -> Vec<DVec2> {
    if corners.iter().all(|c| c.length() <= radius) {
        return corners.to_vec();
    }
    let mut points = Vec::new();
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if let Some((from, to)) = chord(a, b, radius) {
            points.push(a.lerp(b, from));
            points.push(a.lerp(b, to));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_where_the_paper_ends() {
        let (from, to) = chord(DVec2::new(-2.0, 0.0), DVec2::new(2.0, 0.0), 1.0).unwrap();
        assert!((from - 0.25).abs() < 1e-12 && (to - 0.75).abs() < 1e-12);
        assert_eq!(
            chord(DVec2::new(-2.0, 3.0), DVec2::new(2.0, 3.0), 1.0),
            None
        );
        let small = [DVec2::ZERO, DVec2::X * 0.5, DVec2::Y * 0.5];
        assert_eq!(in_circle(&small, 1.0), small);
        let large = small.map(|p| p * 10.0);
        assert!(
            in_circle(&large, 1.0)
                .iter()
                .all(|p| p.length() < 1.0 + 1e-9)
        );
    }
}

//! The whole inside unrolled at full size, over as many sheets as it needs.

use std::collections::BTreeMap;

use glam::DVec2;

use super::head::{HEAD, MARGIN, head};
use crate::io::handover::marks::{BLUE, INK, gauge};
use crate::io::handover::source::HandoverSource;
use crate::io::svg::from_behind;
use crate::mesh::flatten::Flat;
use crate::mesh::stretch::KEPT;
use crate::paper::{Sheet, SheetLine};

/// What neighbouring sheets have in common (mm).
const OVERLAP: f64 = 10.0;
/// What a gauge reaches beyond the seam (mm).
const SEAM: f64 = 6.0;
/// Share of the view in which lengths may be off where gauges may be placed by it.
const TRUSTED: f64 = 0.02;
/// More sheets than anybody glues together.
const MOST: usize = 40;

/// The inside in the plane (mm), as seen from inside: what is to the right outside is to the left.
struct FlatInside {
    positions: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
    /// Whether lengths on each of them are off.
    stretched: Vec<bool>,
    rims: Vec<[u32; 2]>,
    /// Middle, direction and number of each gauge.
    gauges: Vec<(DVec2, DVec2, usize)>,
    lower: DVec2,
    upper: DVec2,
}

impl FlatInside {
    fn of(source: &HandoverSource<'_>) -> (Self, String) {
        let inner = &source.inner;
        let flat = Flat::of(&inner.mesh, inner.stance);
        let seen = |p: DVec2| DVec2::new(-p.x, p.y) * 1e3;
        let positions: Vec<DVec2> = flat.positions.iter().map(|p| seen(p.truncate())).collect();
        let order = from_behind(&flat.triangles, &flat.positions);
        let triangles: Vec<[u32; 3]> = order.iter().map(|&t| flat.triangles[t]).collect();
        let (a, b) = (seen(flat.lower), seen(flat.upper));
        let gauges = inner.gauges.iter().flat_map(|g| {
            let along = flat
                .turn(g.gauge.position, g.gauge.direction)
                .normalize_or(DVec2::Y);
            let at = seen(flat.place(g.gauge.position));
            // Beside the seam it is on both ends.
            let turns = flat
                .around()
                .map_or(vec![0.0], |m| vec![0.0, m * 1e3, -m * 1e3]);
            let near = (a.min(b).x - SEAM..=a.max(b).x + SEAM).clone();
            (turns
                .into_iter()
                .map(move |turn| DVec2::new(at.x + turn, at.y)))
            .filter(move |at| near.contains(&at.x))
            .map(move |at| (at, DVec2::new(-along.x, along.y), g.number))
        });
        let gauges = gauges.collect();
        let plan = Self {
            stretched: order
                .iter()
                .map(|&t| flat.stretch.facets[t] > KEPT)
                .collect(),
            rims: rims(&triangles),
            positions,
            triangles,
            gauges,
            lower: a.min(b),
            upper: a.max(b),
        };
        let words = flat.stretch.words().replace("Hatched", "Shaded");
        let trusted = flat.stretch.off < TRUSTED;
        let more = if trusted {
            ""
        } else {
            ". Place gauges by their patches"
        };
        (plan, format!("{words}{more}."))
    }
}

/// Sides of a single triangle.
fn rims(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut sides: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for tri in triangles {
        for k in 0..3 {
            let (a, b) = (tri[k], tri[(k + 1) % 3]);
            *sides.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    sides
        .into_iter()
        .filter(|(_, count)| *count == 1)
        .map(|(side, _)| side)
        .collect()
}

/// The sheets, rows from above; none where there would be more than anybody glues together.
pub(super) fn sheets(source: &HandoverSource<'_>) -> Vec<Sheet> {
    let (plan, stretch) = FlatInside::of(source);
    let whole = plan.upper - plan.lower;
    let sheet = [Sheet::new(source.format), Sheet::lying(source.format)]
        .into_iter()
        .min_by_key(|sheet| {
            let (columns, rows) = count(whole, room(sheet));
            columns * rows
        });
    let Some(empty) = sheet else {
        return Vec::new();
    };
    let room = room(&empty);
    let step = room - DVec2::splat(OVERLAP);
    let (columns, rows) = count(whole, room);
    if columns * rows > MOST {
        return Vec::new();
    }
    let mut sheets = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let mut sheet = empty.clone();
            let title = format!(
                "The inside unrolled: row {} of {rows}, column {} of {columns}",
                row + 1,
                column + 1
            );
            head(&mut sheet, &title, &stretch);
            // Of the plane, what lies at the upper left corner of the sheet's room.
            let corner = DVec2::new(
                plan.lower.x + step.x * column as f64,
                plan.upper.y - step.y * row as f64,
            );
            let window = Window {
                corner,
                room: room.min(
                    DVec2::new(plan.upper.x - corner.x, corner.y - plan.lower.y)
                        + DVec2::splat(3.0),
                ),
            };
            draw(&mut sheet, &plan, &window, source);
            crosses(&mut sheet, room, (row, rows), (column, columns));
            sheets.push(sheet);
        }
    }
    sheets
}

/// What is drawn on of a sheet (mm).
fn room(sheet: &Sheet) -> DVec2 {
    sheet.size - DVec2::new(2.0 * MARGIN, HEAD + MARGIN + 4.0)
}

/// Columns and rows of sheets for a drawing of a size (mm).
fn count(whole: DVec2, room: DVec2) -> (usize, usize) {
    let step = room - DVec2::splat(OVERLAP);
    let count = ((whole - DVec2::splat(OVERLAP)) / step)
        .ceil()
        .max(DVec2::ONE);
    (count.x as usize, count.y as usize)
}

/// What of the plane a sheet shows.
struct Window {
    corner: DVec2,
    room: DVec2,
}

impl Window {
    /// On the sheet.
    fn place(&self, p: DVec2) -> DVec2 {
        DVec2::new(MARGIN + p.x - self.corner.x, HEAD + self.corner.y - p.y)
    }

    /// A convex shape's part on the sheet (I. Sutherland and G. Hodgman, 1974).
    fn clipped(&self, corners: &[DVec2]) -> Vec<DVec2> {
        let (low, high) = (
            DVec2::new(MARGIN, HEAD),
            DVec2::new(MARGIN, HEAD) + self.room,
        );
        let mut shape: Vec<DVec2> = corners.iter().map(|&p| self.place(p)).collect();
        for k in 0..2 {
            for (limit, sign) in [(low[k], 1.0), (high[k], -1.0)] {
                let inside = |p: DVec2| sign * (p[k] - limit) >= 0.0;
                let mut kept = Vec::with_capacity(shape.len() + 1);
                for i in 0..shape.len() {
                    let (a, b) = (shape[i], shape[(i + 1) % shape.len()]);
                    if inside(a) {
                        kept.push(a);
                    }
                    if inside(a) != inside(b) {
                        kept.push(a.lerp(b, (limit - a[k]) / (b[k] - a[k])));
                    }
                }
                shape = kept;
            }
        }
        shape
    }
}

fn draw(sheet: &mut Sheet, plan: &FlatInside, window: &Window, source: &HandoverSource<'_>) {
    for (tri, stretched) in plan.triangles.iter().zip(&plan.stretched) {
        let grey = if *stretched {
            [0xdd, 0xd9, 0xd0]
        } else {
            [0xf2, 0xf3, 0xf5]
        };
        let shape = window.clipped(&tri.map(|v| plan.positions[v as usize]));
        if shape.len() > 2 {
            sheet.shape(shape, Some(grey), Some(SheetLine::new(grey, 0.05)));
        }
    }
    for rim in &plan.rims {
        let shape = window.clipped(&rim.map(|v| plan.positions[v as usize]));
        if shape.len() >= 2 {
            sheet.line(shape.into_iter().take(2), SheetLine::new(BLUE, 0.3));
        }
    }
    let keys = &source.inputs.project.gauge;
    let size = DVec2::new(keys.grid_length_mm, keys.grid_width_mm);
    for (at, along, number) in &plan.gauges {
        let at = window.place(*at);
        let near = at.clamp(
            DVec2::new(MARGIN, HEAD),
            DVec2::new(MARGIN, HEAD) + window.room,
        );
        if near == at {
            gauge(sheet, at, DVec2::new(along.x, -along.y), size, *number);
        }
    }
}

/// Crosses in the corners of what neighbours have in common: they come to lie on each other.
fn crosses(
    sheet: &mut Sheet,
    room: DVec2,
    (row, rows): (usize, usize),
    (column, columns): (usize, usize),
) {
    let ends = |k: usize, count: usize, room: f64| {
        let mut at = Vec::new();
        if k > 0 {
            at.push(OVERLAP / 2.0);
        }
        if k + 1 < count {
            at.push(room - OVERLAP / 2.0);
        }
        at
    };
    let (mut xs, mut ys) = (ends(column, columns, room.x), ends(row, rows, room.y));
    if xs.is_empty() && ys.is_empty() {
        return;
    }
    // Of a single row or column, two marks on each side.
    if xs.is_empty() {
        xs = vec![10.0, room.x - 10.0];
    }
    if ys.is_empty() {
        ys = vec![10.0, room.y - 10.0];
    }
    for x in &xs {
        for y in &ys {
            let at = DVec2::new(MARGIN + x, HEAD + y);
            for way in [DVec2::X, DVec2::Y] {
                sheet.line([at - way * 3.0, at + way * 3.0], SheetLine::new(INK, 0.15));
            }
            sheet.circle(at, 1.5, None, Some(SheetLine::new(INK, 0.15)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_over_a_sheets_border_is_on_both() {
        let left = Window {
            corner: DVec2::new(0.0, 100.0),
            room: DVec2::new(50.0, 50.0),
        };
        let right = Window {
            corner: DVec2::new(40.0, 100.0),
            ..left
        };
        let triangle = [
            DVec2::new(30.0, 90.0),
            DVec2::new(70.0, 90.0),
            DVec2::new(30.0, 60.0),
        ];
        let area = |shape: &[DVec2]| {
            let pairs = shape.iter().zip(shape.iter().cycle().skip(1));
            pairs.map(|(a, b)| a.perp_dot(*b)).sum::<f64>().abs() / 2.0
        };
        let (a, b) = (left.clipped(&triangle), right.clipped(&triangle));
        // Both have what lies between 40 and 50.
        let common = 0.5 * 10.0 * (22.5 + 15.0);
        assert!((area(&a) + area(&b) - common - 600.0).abs() < 1e-9);
        assert_eq!(
            left.place(DVec2::new(45.0, 90.0)).x - right.place(DVec2::new(45.0, 90.0)).x,
            40.0
        );
    }
}

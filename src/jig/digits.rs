//! Numbers of strokes that any printer can make, as seven segments have them.

use glam::{DVec2, DVec3};

use super::shapes::{JigSolid, cuboid, joined};

/// The segments of each digit: top, its two sides, the middle, their two sides below, bottom.
const SEGMENTS: [u8; 10] = [
    0b111_0111, 0b001_0010, 0b101_1101, 0b101_1011, 0b011_1010, 0b110_1011, 0b110_1111, 0b101_0010,
    0b111_1111, 0b111_1011,
];

/// How numbers are written (mm).
#[derive(Clone, Copy, Debug)]
pub struct Lettering {
    /// Width and height of a digit, between the middles of its strokes.
    pub size: DVec2,
    /// Of a stroke.
    pub stroke: f64,
    /// How far they stand out.
    pub raised: f64,
}

/// A number around the origin, in the plane of x and y, standing out along z from a little below it, so that it holds on what it
/// is put on.
#[must_use]
pub fn number(number: usize, hand: &Lettering) -> JigSolid {
    /// How deep it is sunk (mm).
    const SUNK: f64 = 0.4;
    let digits: Vec<usize> = number
        .to_string()
        .bytes()
        .map(|b| usize::from(b - b'0'))
        .collect();
    let pitch = hand.size.x + 2.2 * hand.stroke;
    let first = -pitch * (digits.len() - 1) as f64 / 2.0;
    let (w, h) = (hand.size.x / 2.0, hand.size.y / 2.0);
    let ends = [
        [DVec2::new(-w, h), DVec2::new(w, h)],
        [DVec2::new(-w, 0.0), DVec2::new(-w, h)],
        [DVec2::new(w, 0.0), DVec2::new(w, h)],
        [DVec2::new(-w, 0.0), DVec2::new(w, 0.0)],
        [DVec2::new(-w, -h), DVec2::new(-w, 0.0)],
        [DVec2::new(w, -h), DVec2::new(w, 0.0)],
        [DVec2::new(-w, -h), DVec2::new(w, -h)],
    ];
    let half = DVec2::splat(hand.stroke / 2.0);
    let strokes = digits.iter().enumerate().flat_map(|(k, &digit)| {
        let middle = DVec2::new(first + k as f64 * pitch, 0.0);
        let on = (0..ends.len()).filter(move |s| SEGMENTS[digit] >> (6 - s) & 1 == 1);
        on.map(move |s| {
            let [from, to] = ends[s].map(|p| p + middle);
            cuboid((from - half).extend(-SUNK), (to + half).extend(hand.raised))
        })
    });
    joined(strokes.collect())
}

/// A number that reads upright for who looks along `-z` after this turn: its x, y and z.
#[must_use]
pub fn facing(x: DVec3, z: DVec3) -> [DVec3; 3] {
    [x, z.cross(x), z]
}

//! Marks that must not lie over each other: each finds the nearest free place around what it names.

use egui::{Pos2, Vec2};

/// Tries around an anchor, nearest first: directions and distances in radii of a mark.
const DISTANCES: [f32; 4] = [2.1, 3.0, 4.2, 5.6];
const DIRECTIONS: usize = 12;

/// Places for round marks of one radius at anchors: at the anchor where it is free, else beside it. The
/// first have the first choice, so that a mark stays where it is when others come.
#[must_use]
pub fn places_apart(anchors: &[Pos2], radius: f32) -> Vec<Pos2> {
    let mut placed: Vec<Pos2> = Vec::with_capacity(anchors.len());
    for &anchor in anchors {
        let free = |at: &Pos2| placed.iter().all(|p| p.distance(*at) >= 2.0 * radius);
        let around = DISTANCES.iter().flat_map(|d| {
            (0..DIRECTIONS).map(move |k| {
                let angle = k as f32 / DIRECTIONS as f32 * std::f32::consts::TAU;
                anchor + Vec2::angled(angle - std::f32::consts::FRAC_PI_2) * (d * radius)
            })
        });
        let place = std::iter::once(anchor).chain(around).find(free);
        // Nowhere free: over its own place, as before.
        placed.push(place.unwrap_or(anchor));
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_do_not_overlap() {
        let anchors: Vec<Pos2> = (0..12)
            .map(|k| Pos2::new(100.0 + 3.0 * (k % 4) as f32, 50.0 + 2.0 * (k / 4) as f32))
            .collect();
        let places = places_apart(&anchors, 9.0);
        assert_eq!(places[0], anchors[0]);
        for (k, a) in places.iter().enumerate() {
            assert!(a.distance(anchors[k]) < 60.0);
            for b in &places[..k] {
                assert!(a.distance(*b) >= 17.99, "{a} {b}");
            }
        }
    }
}

//! Ranges that several keys share. Beyond them nobody can have meant a value, and what is computed from it would
//! overflow, or never end, without a word.

use super::key::{ValueRange, from};

/// Of anything that is made (mm): from a nanometre to a kilometre.
pub(super) const LENGTH: ValueRange = from(1e-6, 1e6);
/// Of anything that may also not be there (mm).
pub(super) const ROOM: ValueRange = from(0.0, 1e6);
/// How far off a place may be (mm), either way.
pub const FARTHEST: f64 = 1e9;
/// Places and boxes (mm), and directions of any length.
pub(super) const PLACES: ValueRange = from(-FARTHEST, FARTHEST);
/// How far off gauges, presses and tips may be (mm).
pub(super) const OFF_MM: ValueRange = from(0.0, 50.0);
/// How far off gains and forces may be (%).
pub(super) const OFF_PERCENT: ValueRange = from(0.0, 50.0);
/// How much of a touch's force may act along the surface (%): more than presses would slide off.
pub(super) const FRICTION: ValueRange = from(0.0, 100.0);
/// How hard touches may come (N).
pub(super) const FORCES: ValueRange = from(1e-3, 1e5);
/// How many gauges can be asked for.
pub(super) const GAUGES: ValueRange = ValueRange::Whole(1, 10_000);

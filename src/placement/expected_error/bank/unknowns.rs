//! What there is to find of a touch: how well it is known before anything is read, and what a reading says of it.

use nalgebra::SVector;

use super::filters::{MOST, PLAIN};
use crate::placement::expected_error::scene::{Neighbourhood, Report, TouchScene};

/// Of all unknowns that there may be; zero of those that are not asked for.
pub(in crate::placement::expected_error) type Unknowns = SVector<f64, MOST>;

/// Deviations of what is known of a press before anything is read: along, across (mm), force (N), and the rest.
pub(in crate::placement::expected_error) fn prior(
    scene: &TouchScene,
    around: &Neighbourhood,
) -> Unknowns {
    within(scene, around.reach)
}

/// The same of a touch within some reach (mm).
pub(super) fn within(scene: &TouchScene, reach: f64) -> Unknowns {
    let mut known = Unknowns::zeros();
    known.fixed_rows_mut::<2>(0).fill(reach);
    known[2] = scene.hardest.unwrap_or(0.0);
    known.rows_mut(PLAIN, scene.unknowns.len()).fill(1.0);
    known
}

/// What is thought of a touch of which nothing was read: as hard as that, in the middle of its place.
pub(super) fn thought(force: f64) -> Unknowns {
    let mut thought = Unknowns::zeros();
    thought[2] = force;
    thought
}

/// What a site's reading of a press of some force says of each unknown, over the reading's deviation, and the square of
/// that.
pub(in crate::placement::expected_error) fn row(
    scene: &TouchScene,
    report: &Report,
    press: usize,
    force: f64,
) -> (Unknowns, f64) {
    let variance = 1.0 + force * force * f64::from(report.variance[press]);
    let mut row = Unknowns::zeros();
    row[0] = force * f64::from(report.slopes[0][press]);
    row[1] = force * f64::from(report.slopes[1][press]);
    row[2] = f64::from(report.value[press]);
    let mut nuisances = report.nuisances();
    for (entry, unknown) in row.iter_mut().skip(PLAIN).zip(&scene.unknowns) {
        let mut of_touch = || nuisances.next().map_or(0.0, |n| f64::from(n[press]));
        *entry = unknown.drift().unwrap_or_else(|| force * of_touch());
    }
    (row * variance.sqrt().recip(), variance)
}

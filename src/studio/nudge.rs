//! A gauge moved by a key: one step on the screen.

use glam::DVec3;

use super::view::{ScreenWay, ViewState};
use crate::project::ChosenSite;
use crate::session::Session;

/// Where a gauge goes one step that way on the screen: to the next free site.
pub fn next_site(
    session: &Session,
    view: &ViewState,
    way: ScreenWay,
    number: usize,
) -> Option<ChosenSite> {
    let (lower, upper) = session.document.part.bounds();
    let spacing_mm = session.document.state.project.sites.spacing_mm;
    let reach = 4e-3 * spacing_mm.min((upper - lower).length() * 1000.0);
    let origin = view.place(session.gauge_place(number)?)?;
    let score = |p: DVec3| {
        let off = view.place(p)? - origin;
        let forward = off.dot(way.vector());
        // Ahead, and rather straight than near.
        (forward > 0.5 * off.length() && forward > 0.5)
            .then(|| off.length() + 2.0 * (off.length() - forward))
    };
    session.best_free_site(number, reach, score)
}

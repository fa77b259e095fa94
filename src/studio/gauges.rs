//! The gauges in hand: picked and moved on the screen.

use egui::{Pos2, Ui, Vec2};

use super::Studio;
use super::tools::Gesture;
use super::viewport::Pane;
use crate::project::ChosenSite;

/// How near (points) the pointer must be to a gauge to take it.
const REACH: f32 = 14.0;

/// A way on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    Left,
    Right,
    Up,
    Down,
}

impl Way {
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Up, Self::Down];

    fn vector(self) -> Vec2 {
        match self {
            Self::Left => Vec2::LEFT,
            Self::Right => Vec2::RIGHT,
            Self::Up => Vec2::UP,
            Self::Down => Vec2::DOWN,
        }
    }
}

impl Studio {
    /// The pointer goes down with the gauges in hand: on one it is picked and may be moved, beside them none
    /// is. Shift picks several, Control puts a new one there.
    pub(super) fn grab(&mut self, ui: &Ui, pane: Pane, at: Pos2) {
        let modifiers = ui.input(|i| i.modifiers);
        let away = |n: &usize| {
            let place = self
                .session
                .gauge_place(*n)
                .and_then(|p| self.view.place_in(pane, p));
            place.map_or(f32::INFINITY, |p| p.distance(at))
        };
        let count = self.session.document.state.project.selection.sites.len();
        let nearest = (0..count).min_by(|a, b| away(a).total_cmp(&away(b)));
        match nearest.filter(|n| away(n) < REACH) {
            Some(number) if modifiers.shift => {
                if self.picked.contains(&number) {
                    self.picked.retain(|&n| n != number);
                } else {
                    self.picked.push(number);
                }
            }
            Some(number) => {
                self.picked = vec![number];
                self.view.gesture = Gesture::Gauge(pane, number, at);
            }
            None if modifiers.command => {
                if let Some(site) = self.site_at(pane, at, usize::MAX) {
                    self.picked = vec![self.session.add_gauge(site)];
                }
            }
            None if !modifiers.shift => self.picked.clear(),
            None => {}
        }
    }

    pub(super) fn drag_gauge(&mut self, pane: Pane, number: usize, at: Pos2) {
        if number >= self.session.document.state.project.selection.sites.len() {
            return;
        }
        if let Some(site) = self.site_at(pane, at, number) {
            self.session.put_gauge(number, &site);
        }
    }

    /// The site for a gauge nearest to a place of a view.
    fn site_at(&self, pane: Pane, at: Pos2, number: usize) -> Option<ChosenSite> {
        self.session.site_near(self.view.pick(pane, at)?, number)
    }

    /// Moves the picked gauges to the next free site that way on the screen.
    pub(super) fn nudge(&mut self, way: Way) {
        let (lower, upper) = self.session.document.part.bounds();
        let spacing_mm = self.session.document.state.project.sites.spacing_mm;
        let reach = 4e-3 * spacing_mm.min((upper - lower).length() * 1000.0);
        for number in self.picked.clone() {
            let from = self.session.gauge_place(number);
            let Some(origin) = from.and_then(|from| self.view.place(from)) else {
                continue;
            };
            let score = |p| {
                let off = self.view.place(p)? - origin;
                let forward = off.dot(way.vector());
                // Ahead, and rather straight than near.
                (forward > 0.5 * off.length() && forward > 0.5)
                    .then(|| off.length() + 2.0 * (off.length() - forward))
            };
            if let Some(site) = self.session.best_free_site(number, reach, score) {
                self.session.put_gauge(number, &site);
            }
        }
        self.session.document.settle();
    }
}

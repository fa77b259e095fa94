//! The gauges in hand: picked, moved, pinned, added and taken away, with what that does to the error.

use std::sync::Arc;

use egui::{Context, Pos2, Ui, Vec2};
use glam::DVec3;

use super::Studio;
use super::drive::Finished;
use super::jobs::Task;
use super::tools::Gesture;
use super::viewport::Pane;
use crate::dataset::Site;
use crate::design::{self, DesignError};
use crate::elasticity::observe::tangent_frame;
use crate::evaluation::{EVERYWHERE, Evaluation};
use crate::io::artifacts::as_chosen;
use crate::job::Stop;
use crate::project::ChosenSite;

/// What selections made by hand are called in results.
pub(super) const BY_HAND: &str = "by-hand";
/// How near (points) the pointer must be to a gauge to take it.
const REACH: f32 = 14.0;
/// Positions nearer than this (mm) are one.
const SAME_MM: f64 = 1e-3;

/// What is known of gauges that no selector put where they are.
#[derive(Default)]
pub(super) struct ByHand {
    /// What the design that they were judged like was computed from.
    of: String,
    pub sites: Vec<ChosenSite>,
    /// Mean error (mm), quickly.
    pub estimate: Option<f64>,
    pub exact: Option<Arc<Evaluation>>,
}

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
    /// Where a gauge of the project is (m).
    fn gauge_place(&self, number: usize) -> Option<DVec3> {
        let site = self.document.state.project.selection.sites.get(number)?;
        Some(DVec3::from_array(site.position_mm) / 1000.0)
    }

    /// The pin that holds a gauge: each pin holds the gauge nearest to it, not farther than sites lie apart.
    pub(super) fn pin_of(&self, number: usize) -> Option<usize> {
        let selection = &self.document.state.project.selection;
        let within = self.document.state.project.sites.spacing_mm.max(SAME_MM);
        let at = |site: &ChosenSite| DVec3::from_array(site.position_mm);
        let held_by = |pin: &[f64; 3]| {
            let off = |n: &usize| at(&selection.sites[*n]).distance(DVec3::from_array(*pin));
            let nearest = (0..selection.sites.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
            nearest.filter(|n| off(n) <= within)
        };
        let mut pins = selection.required_mm.iter();
        pins.position(|pin| held_by(pin) == Some(number))
    }

    /// Whose gauges are shown before any were selected here; nothing where none are, or some were.
    pub(super) fn gauges_before_selection(&self) -> Option<String> {
        let sites = &self.document.state.project.selection.sites;
        if sites.is_empty() || self.design.is_some() {
            return None;
        }
        let whose = if *sites != self.document.saved().project.selection.sites {
            "placed by hand"
        } else if self.document.bundled {
            "those of the bundled example"
        } else {
            "those of the project's file"
        };
        Some(match sites.len() {
            1 => format!("The gauge shown is {whose}").replace("those", "that"),
            n => format!("The {n} gauges shown are {whose}"),
        })
    }

    /// The pointer goes down with the gauges in hand: on one it is picked and may be moved, beside them none
    /// is. Shift picks several, Control puts a new one there.
    pub(super) fn grab(&mut self, ui: &Ui, pane: Pane, at: Pos2) {
        let modifiers = ui.input(|i| i.modifiers);
        let away = |n: &usize| {
            let place = self
                .gauge_place(*n)
                .and_then(|p| self.view.place_in(pane, p));
            place.map_or(f32::INFINITY, |p| p.distance(at))
        };
        let count = self.document.state.project.selection.sites.len();
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
                    self.document.state.project.selection.sites.push(site);
                    self.picked = vec![count];
                    self.drive.take = false;
                }
            }
            None if !modifiers.shift => self.picked.clear(),
            None => {}
        }
    }

    pub(super) fn drag_gauge(&mut self, pane: Pane, number: usize, at: Pos2) {
        if number >= self.document.state.project.selection.sites.len() {
            return;
        }
        if let Some(site) = self.site_at(pane, at, number) {
            self.put_gauge(number, &site);
        }
    }

    fn put_gauge(&mut self, number: usize, site: &ChosenSite) {
        if self.document.state.project.selection.sites[number] == *site {
            return;
        }
        let pin = self.pin_of(number);
        self.document.state.project.selection.sites[number] = site.clone();
        self.drive.take = false;
        // A pin goes with its gauge.
        if let Some(pin) = pin {
            self.document.state.project.selection.required_mm[pin] = site.position_mm;
        }
    }

    /// The site for a gauge nearest to a place of a view: a feasible one that no other gauge has, or where
    /// nothing is simulated yet, the place itself.
    fn site_at(&self, pane: Pane, at: Pos2, number: usize) -> Option<ChosenSite> {
        let place = self.view.pick(pane, at)?;
        let p = self.document.part.point(place);
        if self.simulation.is_none() {
            let frame = tangent_frame(self.document.part.normal(place));
            let old = self.document.state.project.selection.sites.get(number);
            let along = old.map_or(frame.x_axis, |s| DVec3::from_array(s.direction));
            let flat = along - frame.z_axis * along.dot(frame.z_axis);
            let direction = flat.try_normalize().unwrap_or(frame.x_axis);
            return Some(ChosenSite {
                position_mm: (p * 1000.0).to_array(),
                direction: direction.to_array(),
            });
        }
        let allowed = self.free_sites(number);
        let sites = &self.simulation.as_ref()?.simulated.dataset.sites;
        let near = |a: &usize, b: &usize| {
            let d = |s: &usize| sites[*s].position.distance_squared(p);
            d(a).total_cmp(&d(b))
        };
        let best = allowed.into_iter().min_by(near)?;
        as_chosen(sites, &[best]).pop()
    }

    /// Feasible sites (of the dataset) that no gauge other than one has.
    pub(super) fn free_sites(&self, number: usize) -> Vec<usize> {
        // On a layout or by verdicts that no longer hold nothing is moved.
        let current = self.shown_feasible_key();
        let (Some(simulation), Some(key)) = (&self.simulation, current) else {
            return Vec::new();
        };
        let sites = &simulation.simulated.dataset.sites;
        let others: Vec<DVec3> = (self.gauge_places().into_iter().enumerate())
            .filter_map(|(k, p)| (k != number).then_some(p))
            .collect();
        let taken = |s: &usize| {
            let p = sites[*s].position;
            others.iter().any(|o| o.distance(p) < SAME_MM * 1e-3)
        };
        let feasible = match &self.feasibility {
            Some((of, f)) if *of == key => f.sites(),
            _ => Vec::new(),
        };
        feasible.into_iter().filter(|s| !taken(s)).collect()
    }

    /// Moves the picked gauges to the next free site that way on the screen.
    pub(super) fn nudge(&mut self, way: Way) {
        for number in self.picked.clone() {
            let Some(from) = self.gauge_place(number) else {
                continue;
            };
            let Some(sites) = self.simulation.as_ref().map(|s| Arc::clone(&s.simulated)) else {
                return;
            };
            let (lower, upper) = self.document.part.bounds();
            let reach = 4e-3
                * self
                    .document
                    .state
                    .project
                    .sites
                    .spacing_mm
                    .min((upper - lower).length() * 1000.0);
            let Some(origin) = self.view.place(from) else {
                continue;
            };
            let score = |s: &usize| {
                let p = sites.dataset.sites[*s].position;
                let off = self.view.place(p)? - origin;
                let forward = off.dot(way.vector());
                // Ahead, and rather straight than near.
                (p.distance(from) < reach && forward > 0.5 * off.length() && forward > 0.5)
                    .then(|| off.length() + 2.0 * (off.length() - forward))
            };
            let free = self.free_sites(number).into_iter();
            let best = free
                .filter_map(|s| Some((score(&s)?, s)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, site)) = best
                && let Some(site) = as_chosen(&sites.dataset.sites, &[site]).pop()
            {
                self.put_gauge(number, &site);
            }
        }
        self.document.settle();
    }

    /// Pins the picked gauges, or lets them go where all are pinned.
    pub(super) fn pin_picked(&mut self) {
        let all = self.picked.iter().all(|&n| self.pin_of(n).is_some());
        for number in self.picked.clone() {
            match (self.pin_of(number), all) {
                (Some(pin), true) => {
                    self.document
                        .state
                        .project
                        .selection
                        .required_mm
                        .remove(pin);
                }
                (None, false) => {
                    let selection = &mut self.document.state.project.selection;
                    if let Some(site) = selection.sites.get(number) {
                        selection.required_mm.push(site.position_mm);
                    }
                }
                _ => {}
            }
        }
        self.document.settle();
    }

    /// Takes the picked gauges away.
    pub(super) fn remove_picked(&mut self) {
        // Their pins go with them.
        let mut pins: Vec<usize> = self.picked.iter().filter_map(|&n| self.pin_of(n)).collect();
        pins.sort_unstable();
        for pin in pins.into_iter().rev() {
            self.document
                .state
                .project
                .selection
                .required_mm
                .remove(pin);
        }
        let picked = std::mem::take(&mut self.picked);
        let mut number = 0;
        self.document.state.project.selection.sites.retain(|_| {
            number += 1;
            !picked.contains(&(number - 1))
        });
        self.drive.take = false;
        self.document.settle();
    }

    /// The gauges as sites of the dataset of the design, where each is one.
    fn gauge_sites(&self) -> Option<Vec<usize>> {
        let result = self.design.as_ref()?;
        self.gauges_among(&result.design.simulated.dataset.sites)
    }

    /// The same of the simulation that is shown.
    pub(super) fn simulated_sites(&self) -> Option<Vec<usize>> {
        let simulation = self.simulation.as_ref()?;
        self.gauges_among(&simulation.simulated.dataset.sites)
    }

    /// The gauges as some sites, where each is one.
    fn gauges_among(&self, all: &[Site]) -> Option<Vec<usize>> {
        /// What a direction at right angles counts, as a distance (m).
        const TURNED: f64 = 1e-3;
        let spacing = self.document.state.project.sites.spacing_mm * 1e-3;
        let sites = &self.document.state.project.selection.sites;
        let find = |site: &ChosenSite| {
            let (p, d) = (
                DVec3::from_array(site.position_mm) / 1000.0,
                DVec3::from_array(site.direction),
            );
            let off = |s: &usize| {
                all[*s].position.distance(p) + TURNED * (1.0 - all[*s].direction.dot(d).abs())
            };
            let best = (0..all.len()).min_by(|a, b| off(a).total_cmp(&off(b)))?;
            (all[best].position.distance(p) < spacing).then_some(best)
        };
        sites.iter().map(find).collect()
    }

    /// Which design it is that is shown: by what it was computed from, and whose gauges lead.
    fn design_mark(&self) -> String {
        (self.design.as_ref()).map_or_else(String::new, |d| {
            format!("{} {}", d.design.lead.name(), d.key)
        })
    }

    /// Whether what is known of gauges put by hand is of these very ones and of the design that is shown.
    pub(super) fn knows_hand(&self) -> bool {
        self.by_hand.sites == self.document.state.project.selection.sites
            && self.by_hand.of == self.design_mark()
            && self.design_holds() == Some(true)
    }

    /// The design with the gauges as they were put by hand, once they are judged.
    pub(super) fn design_by_hand(&self) -> Option<design::Design> {
        let judged = self.by_hand.exact.as_ref().filter(|_| self.knows_hand())?;
        let design = &self.design.as_ref()?.design;
        Some(design.with_hand(self.gauge_sites()?, judged))
    }

    /// Mean errors (mm) of gauges that were put somewhere by hand: estimated, and on unseen touches.
    #[must_use]
    pub fn by_hand_error(&self) -> (Option<f64>, Option<f64>) {
        if !self.knows_hand() {
            return (None, None);
        }
        let exact = self.by_hand.exact.as_ref();
        let row = exact.and_then(|e| e.rows.iter().find(|r| r.region == EVERYWHERE));
        let estimate = if self.is_matched() {
            self.expected_error()
        } else {
            self.by_hand.estimate
        };
        (estimate, row.map(|r| r.error_mm))
    }

    /// Whether the gauges are those that the design chose.
    pub(super) fn as_designed(&self) -> bool {
        self.design.as_ref().is_some_and(|d| {
            let sites = &d.design.simulated.dataset.sites;
            as_chosen(sites, d.design.chosen()) == self.document.state.project.selection.sites
        })
    }

    /// Finds out about gauges that were put somewhere by hand: an estimate at once, the exact error when
    /// they rest.
    pub(super) fn refresh_by_hand(&mut self, ctx: &Context) {
        let sites = &self.document.state.project.selection.sites;
        if self.design_holds() != Some(true) || sites.is_empty() || self.as_designed() {
            return;
        }
        let of = self.design_mark();
        if self.by_hand.sites != *sites || self.by_hand.of != of {
            self.by_hand = ByHand {
                of,
                sites: sites.clone(),
                ..ByHand::default()
            };
            if self.gauge_sites().is_none() {
                let key = self.by_hand_key();
                self.drive.fail(Task::Judge, key, "no site".into());
                self.complain("A gauge lies at none of the sites that were simulated, and its error cannot be told: move it with the tool “Gauges”, or press “Select gauges”");
            }
            self.start_estimate(ctx);
        }
        let resting = !ctx.input(|i| i.pointer.any_down()) && self.view.gesture == Gesture::None;
        let key = self.by_hand_key();
        let judging = |r: &super::jobs::Running| r.task == Task::Judge && r.job.key == key;
        let known = self.by_hand.exact.is_some() || self.jobs.running.iter().any(judging);
        if resting
            && !known
            && self
                .drive
                .failure(Task::Judge, &self.by_hand_key())
                .is_none()
        {
            self.start_judging(ctx);
        }
    }

    pub(super) fn by_hand_key(&self) -> String {
        format!("{:?} {}", self.by_hand.sites, self.by_hand.of)
    }

    /// By regression; what is expected of matching is known anyway.
    fn start_estimate(&mut self, ctx: &Context) {
        if self.is_matched() {
            return;
        }
        let (Some(sites), Some(result)) = (self.gauge_sites(), &self.design) else {
            return;
        };
        let key = self.by_hand_key();
        let design = Arc::clone(&result.design);
        let inputs = result.inputs.clone();
        self.jobs.start(ctx, Task::Estimate, key, move |_| {
            let (lead, count) = (design.lead.name(), design.chosen().len());
            let exact =
                (design.evaluation.rows.iter()).find(|r| r.selector == lead && r.sensors == count);
            let tuned = exact.and_then(|r| r.hyper).map(|h| h.gamma * count as f64);
            let gamma = tuned.unwrap_or(1.0) / sites.len().max(1) as f64;
            let dataset = &design.simulated.dataset;
            let of = |sites: &[usize]| design::estimate(&inputs, dataset, sites, gamma);
            // What the estimate is off by for the chosen set it is off by for its neighbours.
            let factor = exact.map_or(1.0, |r| r.error_mm / of(design.chosen()));
            Ok(Finished::Estimate(of(&sites) * factor))
        });
    }

    fn start_judging(&mut self, ctx: &Context) {
        let (Some(sites), Some(result)) = (self.gauge_sites(), &self.design) else {
            return;
        };
        let key = self.by_hand_key();
        let design = Arc::clone(&result.design);
        let inputs = result.inputs.clone();
        self.jobs.start(ctx, Task::Judge, key, move |r| {
            let watch = |p| r.report(p);
            let found = design::judge_set(&inputs, &design, &sites, BY_HAND, &watch);
            let found = found.map_err(|e: DesignError| super::drive::stop(&e))?;
            if found.rows.is_empty() {
                return Err(Stop::Failed("no test touch lies in any region".into()));
            }
            Ok(Finished::Judged(Arc::new(found)))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;

    #[test]
    fn gauges_that_nobody_selected_here_are_accounted_for() {
        let mut studio = Studio::around(Document::new(crate::cli::bundled().unwrap(), None));
        let said = studio.gauges_before_selection().unwrap();
        assert_eq!(said, "The 10 gauges shown are those of the bundled example");
        let sites = &mut studio.document.state.project.selection.sites;
        sites.truncate(1);
        let said = studio.gauges_before_selection().unwrap();
        assert_eq!(said, "The gauge shown is placed by hand");
        studio.document.state.project.selection.sites.clear();
        assert_eq!(studio.gauges_before_selection(), None);
    }
}

//! The gauges in hand: moved, pinned, added and taken away, with what that does to the error.

use std::sync::Arc;

use glam::DVec3;

use super::attention::Attention;
use super::drive::stop;
use super::jobs::Task;
use super::results::DesignMark;
use super::{Event, Session};
use crate::dataset::Site;
use crate::design;
use crate::elasticity::observe::tangent_frame;
use crate::evaluation::{EVERYWHERE, Evaluation};
use crate::io::artifacts::as_chosen;
use crate::job::{Reporter, Stop};
use crate::mesh::SurfacePoint;
use crate::project::ChosenSite;

/// What selections made by hand are called in results.
pub const BY_HAND: &str = "by-hand";
/// Positions nearer than this (mm) are one.
pub const SAME_MM: f64 = 1e-3;

/// What the errors of gauges that were put by hand depend on: the gauges, and the design that they are judged like.
#[derive(Clone, Debug, PartialEq)]
struct HandInputs {
    of: Option<DesignMark>,
    sites: Vec<ChosenSite>,
}

/// What is known of gauges that no selector put where they are.
#[derive(Default)]
pub struct ByHand {
    inputs: Option<HandInputs>,
    /// Mean error (mm), quickly.
    estimate: Option<f64>,
    exact: Option<Arc<Evaluation>>,
}

impl ByHand {
    /// As judged on unseen touches.
    #[must_use]
    pub fn exact(&self) -> Option<&Arc<Evaluation>> {
        self.exact.as_ref()
    }
}

impl Session {
    /// Where a gauge of the project is (m).
    #[must_use]
    pub fn gauge_place(&self, number: usize) -> Option<DVec3> {
        let site = self.document.state.project.selection.sites.get(number)?;
        Some(DVec3::from_array(site.position_mm) / 1000.0)
    }

    /// Positions (m) of the project's gauges.
    #[must_use]
    pub fn gauge_places(&self) -> Vec<DVec3> {
        let sites = &self.document.state.project.selection.sites;
        let places = sites
            .iter()
            .map(|s| DVec3::from_array(s.position_mm) / 1000.0);
        places.collect()
    }

    /// The pin that holds a gauge: each pin holds the gauge nearest to it, not farther than sites lie apart.
    #[must_use]
    pub fn pin_of(&self, number: usize) -> Option<usize> {
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
    #[must_use]
    pub fn gauges_before_selection(&self) -> Option<String> {
        let sites = &self.document.state.project.selection.sites;
        if sites.is_empty() || self.results.design.is_some() {
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

    /// Puts a gauge elsewhere; a pin goes with it.
    pub fn put_gauge(&mut self, number: usize, site: &ChosenSite) {
        let sites = &self.document.state.project.selection.sites;
        if sites.get(number).is_none_or(|now| now == site) {
            return;
        }
        let pin = self.pin_of(number);
        let selection = &mut self.document.state.project.selection;
        selection.sites[number] = site.clone();
        if let Some(pin) = pin {
            selection.required_mm[pin] = site.position_mm;
        }
        self.drive.take = false;
    }

    /// One gauge more; its number from zero.
    pub fn add_gauge(&mut self, site: ChosenSite) -> usize {
        let sites = &mut self.document.state.project.selection.sites;
        sites.push(site);
        self.drive.take = false;
        sites.len() - 1
    }

    /// Other gauges in place of those that there are, as one step of undo.
    pub fn use_gauges(&mut self, sites: Vec<ChosenSite>) {
        self.document.state.project.selection.sites = sites;
        self.drive.take = false;
        self.document.settle();
        self.news.happened(Event::GaugesReplaced);
    }

    /// The site for a gauge nearest to a place of the part: a feasible one that no other gauge has, or where nothing is
    /// simulated yet, the place itself.
    #[must_use]
    pub fn site_near(&self, place: SurfacePoint, number: usize) -> Option<ChosenSite> {
        let p = self.document.part.point(place);
        let Some(simulation) = &self.results.simulation else {
            return Some(self.unsimulated_site(place, number));
        };
        let sites = &simulation.value.simulated.dataset.sites;
        let near = |a: &usize, b: &usize| {
            let d = |s: &usize| sites[*s].position.distance_squared(p);
            d(a).total_cmp(&d(b))
        };
        let best = self.free_sites(number).into_iter().min_by(near)?;
        as_chosen(sites, &[best]).pop()
    }

    /// A place of the part, in the direction that the gauge has already.
    fn unsimulated_site(&self, place: SurfacePoint, number: usize) -> ChosenSite {
        let frame = tangent_frame(self.document.part.normal(place));
        let old = self.document.state.project.selection.sites.get(number);
        let along = old.map_or(frame.x_axis, |s| DVec3::from_array(s.direction));
        let flat = along - frame.z_axis * along.dot(frame.z_axis);
        let direction = flat.try_normalize().unwrap_or(frame.x_axis);
        ChosenSite {
            position_mm: (self.document.part.point(place) * 1000.0).to_array(),
            direction: direction.to_array(),
        }
    }

    /// Feasible sites (of the dataset) that no gauge other than one has.
    #[must_use]
    pub fn free_sites(&self, number: usize) -> Vec<usize> {
        // On a layout or by verdicts that no longer hold nothing is moved.
        let (Some(simulation), Some(verdicts)) =
            (&self.results.simulation, self.current_verdicts())
        else {
            return Vec::new();
        };
        let sites = &simulation.value.simulated.dataset.sites;
        let others: Vec<DVec3> = (self.gauge_places().into_iter().enumerate())
            .filter_map(|(k, p)| (k != number).then_some(p))
            .collect();
        let taken = |s: &usize| {
            let p = sites[*s].position;
            others.iter().any(|o| o.distance(p) < SAME_MM * 1e-3)
        };
        verdicts.sites().into_iter().filter(|s| !taken(s)).collect()
    }

    /// The free site for a gauge that scores least, of those that score and lie within `reach` (m).
    #[must_use]
    pub fn best_free_site(
        &self,
        number: usize,
        reach: f64,
        score: impl Fn(DVec3) -> Option<f32>,
    ) -> Option<ChosenSite> {
        let from = self.gauge_place(number)?;
        let simulation = self.results.simulation.as_ref()?;
        let sites = &simulation.value.simulated.dataset.sites;
        let scored = |s: usize| {
            let p = sites[s].position;
            let near = p.distance(from) < reach;
            Some((near.then(|| score(p)).flatten()?, s))
        };
        let free = self.free_sites(number).into_iter();
        let best = free.filter_map(scored).min_by(|a, b| a.0.total_cmp(&b.0));
        as_chosen(sites, &[best?.1]).pop()
    }

    /// Pins some gauges, or lets them go where all are pinned.
    pub fn pin_gauges(&mut self, numbers: &[usize]) {
        let all = numbers.iter().all(|&n| self.pin_of(n).is_some());
        for &number in numbers {
            let pin = self.pin_of(number);
            let selection = &mut self.document.state.project.selection;
            match (pin, all) {
                (Some(pin), true) => drop(selection.required_mm.remove(pin)),
                (None, false) => {
                    if let Some(site) = selection.sites.get(number) {
                        selection.required_mm.push(site.position_mm);
                    }
                }
                _ => {}
            }
        }
        self.document.settle();
    }

    /// Takes some gauges away, and their pins with them.
    pub fn remove_gauges(&mut self, numbers: &[usize]) {
        let mut pins: Vec<usize> = numbers.iter().filter_map(|&n| self.pin_of(n)).collect();
        pins.sort_unstable();
        let selection = &mut self.document.state.project.selection;
        for pin in pins.into_iter().rev() {
            selection.required_mm.remove(pin);
        }
        let mut number = 0;
        selection.sites.retain(|_| {
            number += 1;
            !numbers.contains(&(number - 1))
        });
        self.drive.take = false;
        self.document.settle();
    }

    /// The gauges as sites of the dataset of the design, where each is one.
    fn gauge_sites(&self) -> Option<Vec<usize>> {
        let result = self.results.design.as_ref()?;
        self.gauges_among(&result.value.design.simulated.dataset.sites)
    }

    /// The same of the simulation that is shown.
    #[must_use]
    pub fn simulated_sites(&self) -> Option<Vec<usize>> {
        let simulation = self.results.simulation.as_ref()?;
        self.gauges_among(&simulation.value.simulated.dataset.sites)
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

    fn hand_inputs(&self) -> HandInputs {
        HandInputs {
            of: self.results.design_mark(),
            sites: self.document.state.project.selection.sites.clone(),
        }
    }

    /// Whether what is known of gauges put by hand is of these very ones and of the design that is shown.
    #[must_use]
    pub fn knows_hand(&self) -> bool {
        self.design_holds() == Some(true)
            && self.caches.by_hand.inputs.as_ref() == Some(&self.hand_inputs())
    }

    /// The design with the gauges as they were put by hand, once they are judged.
    pub(super) fn design_by_hand(&self) -> Option<design::Design> {
        let judged = self.caches.by_hand.exact().filter(|_| self.knows_hand())?;
        let design = &self.results.design.as_ref()?.value.design;
        Some(design.with_hand(self.gauge_sites()?, judged))
    }

    /// Mean errors (mm) of gauges that were put somewhere by hand: estimated, and on unseen touches.
    #[must_use]
    pub fn by_hand_error(&self) -> (Option<f64>, Option<f64>) {
        if !self.knows_hand() {
            return (None, None);
        }
        let exact = self.caches.by_hand.exact();
        let row = exact.and_then(|e| e.rows.iter().find(|r| r.region == EVERYWHERE));
        let estimate = if self.is_matched() {
            self.expected_error()
        } else {
            self.caches.by_hand.estimate
        };
        (estimate, row.map(|r| r.error_mm))
    }

    /// Whether the gauges are those that the design chose.
    #[must_use]
    pub fn as_designed(&self) -> bool {
        let sites = &self.document.state.project.selection.sites;
        (self.results.design.as_ref()).is_some_and(|d| d.value.chosen_sites() == *sites)
    }

    /// Finds out about gauges that were put somewhere by hand: an estimate at once, the exact error when they rest.
    pub(super) fn refresh_by_hand(&mut self, attention: &Attention) {
        let none = self.document.state.project.selection.sites.is_empty();
        if self.design_holds() != Some(true) || none || self.as_designed() {
            return;
        }
        let inputs = self.hand_inputs();
        if self.caches.by_hand.inputs.as_ref() != Some(&inputs) {
            self.caches.by_hand = ByHand {
                inputs: Some(inputs.clone()),
                ..ByHand::default()
            };
            if self.gauge_sites().is_none() {
                let key = Box::new(inputs.clone());
                self.jobs.fail(Task::Judge, key, "no site".into());
                self.complain("A gauge lies at none of the sites that were simulated, and its error cannot be told: move it with the tool “Gauges”, or press “Select gauges”");
            }
            self.start_estimate(&inputs);
        }
        let known = self.caches.by_hand.exact.is_some();
        if attention.rests() && !known && self.jobs.is_new(Task::Judge, &inputs) {
            self.start_judging(inputs);
        }
    }

    /// By regression; what is expected of matching is known anyway.
    fn start_estimate(&mut self, inputs: &HandInputs) {
        if self.is_matched() {
            return;
        }
        let (Some(sites), Some(result)) = (self.gauge_sites(), &self.results.design) else {
            return;
        };
        let design = Arc::clone(&result.value.design);
        let snapshot = result.value.snapshot.clone();
        let work = move |_: &Reporter| {
            let (lead, count) = (design.lead.name(), design.chosen().len());
            let exact =
                (design.evaluation.rows.iter()).find(|r| r.selector == lead && r.sensors == count);
            let tuned = exact.and_then(|r| r.hyper).map(|h| h.gamma * count as f64);
            let gamma = tuned.unwrap_or(1.0) / sites.len().max(1) as f64;
            let dataset = &design.simulated.dataset;
            let of = |sites: &[usize]| design::estimate(&snapshot, dataset, sites, gamma);
            // What the estimate is off by for the chosen set it is off by for its neighbours.
            let factor = exact.map_or(1.0, |r| r.error_mm / of(design.chosen()));
            Ok(of(&sites) * factor)
        };
        let inputs = inputs.clone();
        self.jobs
            .start(Task::Estimate, inputs, work, |s, inputs, mm| {
                // Not of gauges that have moved on.
                if s.caches.by_hand.inputs.as_ref() == Some(&inputs) {
                    s.caches.by_hand.estimate = Some(mm);
                }
            });
    }

    fn start_judging(&mut self, inputs: HandInputs) {
        let (Some(sites), Some(result)) = (self.gauge_sites(), &self.results.design) else {
            return;
        };
        let design = Arc::clone(&result.value.design);
        let snapshot = result.value.snapshot.clone();
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let found = design::judge_set(&snapshot, &design, &sites, BY_HAND, &watch);
            let found = found.map_err(|e| stop(&e))?;
            if found.rows.is_empty() {
                return Err(Stop::Failed("no test touch lies in any region".into()));
            }
            Ok(Arc::new(found))
        };
        self.jobs
            .start(Task::Judge, inputs, work, |s, inputs, found| {
                if s.caches.by_hand.inputs.as_ref() == Some(&inputs) {
                    s.caches.by_hand.exact = Some(found);
                }
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::session::Wake;

    #[test]
    fn gauges_that_nobody_selected_here_are_accounted_for() {
        let document = Document::new(crate::io::opening::bundled().unwrap(), None);
        let mut session = Session::new(document, Wake::default());
        let said = session.gauges_before_selection().unwrap();
        assert_eq!(said, "The 10 gauges shown are those of the bundled example");
        let sites = &mut session.document.state.project.selection.sites;
        sites.truncate(1);
        let said = session.gauges_before_selection().unwrap();
        assert_eq!(said, "The gauge shown is placed by hand");
        session.document.state.project.selection.sites.clear();
        assert_eq!(session.gauges_before_selection(), None);
    }
}

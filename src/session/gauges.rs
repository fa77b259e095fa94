//! The gauges in hand: moved, pinned, added and taken away.

use glam::DVec3;

use super::news::Happening;
use super::state::Session;
use crate::dataset::Site;
use crate::elasticity::observe::tangent_frame;
use crate::io::artifacts::as_chosen;
use crate::mesh::SurfacePoint;
use crate::project::ChosenSite;

/// Positions nearer than this (mm) are one.
pub const SAME_MM: f64 = 1e-3;

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
        self.news.happened(Happening::GaugesReplaced);
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
            let d = |s: &usize| sites[*s].gauge.position.distance_squared(p);
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
            let p = sites[*s].gauge.position;
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
            let p = sites[s].gauge.position;
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
    pub(super) fn gauge_sites(&self) -> Option<Vec<usize>> {
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
        let spacing = self.document.state.project.sites.spacing();
        let sites = &self.document.state.project.selection.sites;
        let find = |site: &ChosenSite| {
            let (p, d) = (
                DVec3::from_array(site.position_mm) / 1000.0,
                DVec3::from_array(site.direction),
            );
            let off = |s: &usize| {
                all[*s].gauge.position.distance(p)
                    + TURNED * (1.0 - all[*s].gauge.direction.dot(d).abs())
            };
            let best = (0..all.len()).min_by(|a, b| off(a).total_cmp(&off(b)))?;
            (all[best].gauge.position.distance(p) < spacing).then_some(best)
        };
        sites.iter().map(find).collect()
    }

    /// Whether the gauges are those that the design chose.
    #[must_use]
    pub fn as_designed(&self) -> bool {
        let sites = &self.document.state.project.selection.sites;
        (self.results.design.as_ref()).is_some_and(|d| d.value.chosen_sites() == *sites)
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

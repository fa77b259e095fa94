//! The gauge more that helps most, and the gauge that helps least.

use std::sync::Arc;

use super::jobs::Task;
use super::news::Happening;
use super::state::Session;
use crate::design::InHand;
use crate::document::ExpectedInputs;
use crate::io::artifacts::as_chosen;
use crate::job::{Reporter, Stop};
use crate::project::ChosenSite;

/// Which gauge is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SoughtGauge {
    Most,
    Least,
}

/// What an answer holds for: these gauges, and what is expected of them.
#[derive(Clone, PartialEq)]
struct HelpInputs {
    sought: SoughtGauge,
    sites: Vec<ChosenSite>,
    expected: ExpectedInputs,
}

/// What was found: a site for a gauge more, or the number of one that is there, and the error (mm) that is expected
/// with the one, without the other; nothing where there is none.
struct Helped {
    found: Option<(usize, f64)>,
    /// What it was asked of.
    in_hand: Arc<InHand>,
}

impl Session {
    /// Why no gauge can be looked for that helps most.
    #[must_use]
    pub fn no_helpful(&self) -> Option<&'static str> {
        if self.simulation_holds() == Some(true) && self.current_verdicts().is_none() {
            return Some("The sites are being filtered");
        }
        self.no_help()
    }

    /// Why no gauge can be looked for that helps least.
    #[must_use]
    pub fn no_spare(&self) -> Option<&'static str> {
        let few = self.document.state.project.selection.sites.len() < 2;
        if self.simulation_holds() == Some(true) && few {
            return Some("It takes two gauges at least");
        }
        self.no_help()
    }

    fn no_help(&self) -> Option<&'static str> {
        if self.simulation_holds() != Some(true) {
            return Some("It takes a simulation of the project as it is: press “Simulate”");
        }
        let busy = self.jobs.runs(Task::Help);
        busy.then_some("A gauge is being looked for")
    }

    /// Adds the gauge that helps most, once it is found.
    pub fn add_helpful(&mut self) {
        self.start_helping(SoughtGauge::Most);
    }

    /// Finds the gauge that helps least.
    pub fn find_spare(&mut self) {
        self.start_helping(SoughtGauge::Least);
    }

    fn help_inputs(&self, sought: SoughtGauge) -> Option<HelpInputs> {
        Some(HelpInputs {
            sought,
            sites: self.document.state.project.selection.sites.clone(),
            expected: self.expected_inputs()?,
        })
    }

    fn start_helping(&mut self, sought: SoughtGauge) {
        self.document.settle();
        let (Some(simulation), Some(inputs)) = (&self.results.simulation, self.help_inputs(sought))
        else {
            return;
        };
        let Some(set) = self.simulated_sites() else {
            return self.complain("A gauge lies at none of the sites that were simulated: move it with the tool “Gauges”, or take it away");
        };
        let open = self.open_sites();
        if sought == SoughtGauge::Most && open.is_empty() {
            return self.complain("No free site is left for a gauge: widen the feasible region, or lower “Least spacing” (stage Selection)");
        }
        let simulated = Arc::clone(&simulation.value.simulated);
        let (snapshot, ready) = (self.document.inputs(), self.in_hand());
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let in_hand = match ready {
                Some(ready) => Ok(ready),
                None => InHand::new(&snapshot, simulated, &watch).map(Arc::new),
            };
            let in_hand = in_hand.map_err(|_| Stop::Cancelled)?;
            let found = match sought {
                SoughtGauge::Most => in_hand.most_helpful(&set, &open, &watch),
                SoughtGauge::Least => in_hand.least_helpful(&set, &watch),
            };
            let found = found.map_err(|_| Stop::Cancelled)?;
            Ok(Helped { found, in_hand })
        };
        self.jobs.start(Task::Help, inputs, work, Self::take_help);
    }

    /// Free sites that keep the least spacing to all gauges.
    fn open_sites(&self) -> Vec<usize> {
        let Some(simulation) = &self.results.simulation else {
            return Vec::new();
        };
        let sites = &simulation.value.simulated.dataset.sites;
        let least = self.document.state.project.selection.spacing();
        let gauges = self.gauge_places();
        let has_room = |s: &usize| {
            let away = |gauge: &glam::DVec3| gauge.distance(sites[*s].gauge.position);
            gauges.iter().all(|gauge| away(gauge) >= least)
        };
        let free = self.free_sites(usize::MAX).into_iter();
        free.filter(has_room).collect()
    }

    fn take_help(&mut self, inputs: HelpInputs, helped: Helped) {
        let sought = inputs.sought;
        if self.help_inputs(sought).as_ref() != Some(&inputs) {
            return self.dropped("gauge");
        }
        self.take_in_hand(inputs.expected, helped.in_hand);
        match (helped.found, sought) {
            (None, _) => {}
            (Some((site, mm)), SoughtGauge::Most) => self.add_gauge_at(site, mm),
            (Some((gauge, mm)), SoughtGauge::Least) => {
                self.tell(format!(
                    "Gauge {} helps least: without it {mm:.2} mm are expected. Delete removes it",
                    gauge + 1
                ));
                self.news.happened(Happening::GaugeFound(gauge));
            }
        }
    }

    /// Adds a gauge at a site of the simulation, as one step of undo.
    fn add_gauge_at(&mut self, site: usize, mm: f64) {
        let sites = (self.results.simulation.as_ref()).map(|s| &s.value.simulated.dataset.sites);
        let Some(site) = sites.and_then(|sites| as_chosen(sites, &[site]).pop()) else {
            return;
        };
        self.document.settle();
        let gauge = self.add_gauge(site);
        self.document.settle();
        self.tell(format!(
            "Gauge {} was put where it helps most: {mm:.2} mm are expected with it",
            gauge + 1
        ));
        self.news.happened(Happening::GaugeFound(gauge));
    }
}

//! One key each: the gauge more that helps most, and the gauge that helps least.

use std::sync::Arc;

use egui::Context;

use super::drive::Finished;
use super::jobs::Task;
use super::tools::Tool;
use super::{Command, Studio};
use crate::design::InHand;
use crate::io::artifacts::as_chosen;
use crate::job::Stop;

/// Which gauge is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sought {
    Most,
    Least,
}

/// What was found: a site for a gauge more, or the number of one that is there, and the error (mm) that is expected
/// with the one, without the other; nothing where there is none.
pub(super) struct Helped {
    sought: Sought,
    found: Option<(usize, f64)>,
    /// What it was asked of, and what that holds for.
    in_hand: Arc<InHand>,
    of: String,
}

impl Studio {
    /// Why one of these two commands cannot be given now.
    pub(super) fn no_help(&self, command: Command) -> Option<&'static str> {
        if !matches!(command, Command::AddHelpful | Command::FindSpare) {
            return None;
        }
        if self.simulation_holds() != Some(true) {
            return Some("It takes a simulation of the project as it is: press “Simulate”");
        }
        let filtered = (self.feasibility.as_ref()).map(|(key, _)| key);
        if command == Command::AddHelpful && filtered != self.shown_feasible_key().as_ref() {
            return Some("The sites are being filtered");
        }
        let gauges = self.document.state.project.selection.sites.len();
        if command == Command::FindSpare && gauges < 2 {
            return Some("It takes two gauges at least");
        }
        let busy = self.jobs.runs(Task::Help);
        busy.then_some("A gauge is being looked for")
    }

    /// What an answer holds for: these gauges, and what is expected of them.
    fn help_key(&self) -> String {
        let sites = &self.document.state.project.selection.sites;
        format!("{sites:?} {:?}", self.expected_key())
    }

    pub(super) fn add_helpful(&mut self, ctx: &Context) {
        self.start_helping(ctx, Sought::Most);
    }

    pub(super) fn find_spare(&mut self, ctx: &Context) {
        self.start_helping(ctx, Sought::Least);
    }

    fn start_helping(&mut self, ctx: &Context, sought: Sought) {
        self.document.settle();
        let Some(simulation) = &self.simulation else {
            return;
        };
        let Some(set) = self.simulated_sites() else {
            return self.complain("A gauge lies at none of the sites that were simulated: move it with the tool “Gauges”, or take it away");
        };
        let open = self.open_sites();
        if sought == Sought::Most && open.is_empty() {
            return self.complain("No free site is left for a gauge: widen the feasible region, or lower “Least spacing” (stage Selection)");
        }
        let simulated = Arc::clone(&simulation.simulated);
        let (inputs, ready) = (self.document.inputs(), self.expected.in_hand().cloned());
        let of = self.expected_key().unwrap_or_default();
        let key = self.help_key();
        self.jobs.start(ctx, Task::Help, key, move |r| {
            let watch = |p| r.report(p);
            let in_hand = match ready {
                Some(ready) => Ok(ready),
                None => InHand::new(&inputs, simulated, &watch).map(Arc::new),
            };
            let in_hand = in_hand.map_err(|_| Stop::Cancelled)?;
            let found = match sought {
                Sought::Most => in_hand.most_helpful(&set, &open, &watch),
                Sought::Least => in_hand.least_helpful(&set, &watch),
            };
            Ok(Finished::Helped(Box::new(Helped {
                sought,
                found: found.map_err(|_| Stop::Cancelled)?,
                in_hand,
                of,
            })))
        });
    }

    /// Free sites that keep the least spacing to all gauges.
    fn open_sites(&self) -> Vec<usize> {
        let Some(simulation) = &self.simulation else {
            return Vec::new();
        };
        let sites = &simulation.simulated.dataset.sites;
        let least = self.document.state.project.selection.spacing_mm * 1e-3;
        let gauges = self.gauge_places();
        let has_room = |s: &usize| {
            let away = |gauge: &glam::DVec3| gauge.distance(sites[*s].position);
            gauges.iter().all(|gauge| away(gauge) >= least)
        };
        let free = self.free_sites(usize::MAX).into_iter();
        free.filter(has_room).collect()
    }

    pub(super) fn take_help(&mut self, helped: Helped, key: &str) {
        if key != self.help_key() {
            return self.dropped("gauge");
        }
        self.take_in_hand(helped.of, helped.in_hand);
        let Some((found, mm)) = helped.found else {
            return;
        };
        self.view.take(Tool::Gauges);
        match helped.sought {
            Sought::Most => self.add_gauge_at(found, mm),
            Sought::Least => {
                self.picked = vec![found];
                self.tell(format!(
                    "Gauge {} helps least: without it {mm:.2} mm are expected. Delete removes it",
                    found + 1
                ));
            }
        }
    }

    /// Adds a gauge at a site of the simulation, as one step of undo.
    fn add_gauge_at(&mut self, site: usize, mm: f64) {
        let Some(simulation) = &self.simulation else {
            return;
        };
        let Some(site) = as_chosen(&simulation.simulated.dataset.sites, &[site]).pop() else {
            return;
        };
        self.document.settle();
        let sites = &mut self.document.state.project.selection.sites;
        sites.push(site);
        let count = sites.len();
        self.picked = vec![count - 1];
        self.drive.take = false;
        self.document.settle();
        self.tell(format!(
            "Gauge {count} was put where it helps most: {mm:.2} mm are expected with it"
        ));
    }
}

//! Selections that are kept: named, with what was known of them, and taken again.

use glam::DVec3;

use super::news::Happening;
use super::state::Session;
use crate::evaluation::{Chooser, Evaluation};
use crate::placement::SelectorKind;
use crate::project::{KeptError, KeptFailure, KeptSelection};

/// A selector's name as read by people.
#[must_use]
pub fn chooser_title(selector: &str) -> &str {
    let kind = SelectorKind::ALL.into_iter().find(|k| k.name() == selector);
    kind.map_or(Chooser::Hand, Chooser::from).title()
}

impl Session {
    /// Keeps the gauges as they are, with what is known of them; its name is said as [`Happening::Kept`].
    pub fn keep(&mut self) {
        let project = &self.document.state.project;
        let sites = project.selection.sites.clone();
        if sites.is_empty() {
            self.complain("There are no gauges to keep yet. Press “Select gauges” first");
            return;
        }
        let cost = sites
            .iter()
            .map(|s| self.cost_of(DVec3::from_array(s.position_mm)))
            .sum();
        let designed = self.as_designed() && self.design_holds() == Some(true);
        let known = self.knows_hand();
        let (chooser, evaluation, seconds): (Chooser, Option<&Evaluation>, f64) =
            match self.results.design.as_ref().map(|d| &d.value) {
                Some(d) if designed => {
                    let stage = format!("select {}", d.design.chosen_by.name());
                    let took = d.design.seconds.iter().find(|s| s.stage == stage);
                    (
                        d.design.chosen_by.into(),
                        Some(&d.design.evaluation),
                        took.map_or(0.0, |s| s.seconds),
                    )
                }
                _ => {
                    let exact = self.caches.by_hand.exact().filter(|_| known);
                    (Chooser::Hand, exact.map(|e| &**e), 0.0)
                }
            };
        let quality = (self.results.design.as_ref()).map_or(self.quality(), |d| d.value.quality);
        let kept = KeptSelection {
            name: self.free_name(&format!("{}, {} gauges", chooser.title(), sites.len())),
            selector: chooser.name().into(),
            quality,
            cost,
            seconds: (seconds * 10.0).round() / 10.0,
            sites,
            errors: evaluation.map_or_else(Vec::new, |e| errors_of(e, chooser)),
            failures: evaluation.map_or_else(Vec::new, |e| failures_of(e, chooser)),
        };
        let name = kept.name.clone();
        self.document.state.project.kept.push(kept);
        self.document.settle();
        self.news.happened(Happening::Kept(name));
    }

    /// Keeps one of them no longer, as one step of undo.
    pub fn delete_kept(&mut self, number: usize) {
        let kept = &mut self.document.state.project.kept;
        if number < kept.len() {
            kept.remove(number);
        }
        self.document.settle();
    }

    fn cost_of(&self, at_mm: DVec3) -> f64 {
        self.document
            .state
            .project
            .selection
            .costs_at(&[at_mm * 1e-3])[0]
    }

    fn free_name(&self, wanted: &str) -> String {
        let taken = |name: &str| {
            self.document
                .state
                .project
                .kept
                .iter()
                .any(|k| k.name == name)
        };
        let numbered = (2..).map(|k| format!("{wanted} ({k})"));
        let mut names = std::iter::once(wanted.to_owned()).chain(numbered);
        names.find(|n| !taken(n)).unwrap_or_default()
    }
}

fn errors_of(evaluation: &Evaluation, chooser: Chooser) -> Vec<KeptError> {
    let rows = evaluation.rows.iter().filter(|r| r.set.chooser == chooser);
    let round = |x: f64| (x * 1e4).round() / 1e4;
    rows.map(|r| KeptError {
        region: r.region.clone(),
        sensors: r.set.sensors,
        mean_mm: round(r.error_mm),
        median_mm: round(r.median_mm),
        p95_mm: round(r.p95_mm),
    })
    .collect()
}

fn failures_of(evaluation: &Evaluation, chooser: Chooser) -> Vec<KeptFailure> {
    let sets = evaluation.failures.iter();
    let sets = sets.filter(|f| f.set.chooser == chooser);
    sets.flat_map(|set| &set.rows)
        .map(|r| KeptFailure {
            failed: r.failed,
            retrained: r.retrained,
            mean_mm: (r.error_mm * 1e4).round() / 1e4,
        })
        .collect()
}

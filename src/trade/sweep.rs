//! Which setting to measure next: from the middle of every ladder outward, along the front.

use super::{Knob, TradePoint, TradeSetting, front, knobs};
use crate::budget::Quality;
use crate::project::{ElementKind, PartModel, Project};

/// Repeats of the centre with other seeds: what an error moves by when nothing is turned.
const REPEATS: u64 = 3;

/// Pairs from which a knob is known.
const ENOUGH: usize = 8;

/// A walk over settings.
pub struct Sweep<'a> {
    project: &'a Project,
    standards: Vec<Quality>,
}

/// The qualities that a sweep measures by their names.
#[must_use]
pub fn standards() -> Vec<Quality> {
    vec![Quality::Draft, Quality::Standard]
}

impl<'a> Sweep<'a> {
    /// Of a project; the named qualities come last, for they may take long.
    #[must_use]
    pub fn new(project: &'a Project, standards: Vec<Quality>) -> Self {
        Self { project, standards }
    }

    /// What is to be measured next when these points are known and `count` more may be: the centre and its
    /// repeats, each knob of it turned by one step, then every neighbour of the front, the cheapest first.
    /// Nothing when all is known or nothing may follow.
    #[must_use]
    pub fn next(&self, known: &[TradePoint], count: usize) -> Option<TradeSetting> {
        if count == 0 {
            return None;
        }
        let is_new = |s: &TradeSetting| known.iter().all(|p| p.setting != *s);
        let named = self
            .standards
            .iter()
            .map(|&q| TradeSetting::named(self.project, q));
        let mut named: Vec<TradeSetting> = named.filter(is_new).collect();
        // What was asked for by name is kept room for.
        if count <= named.len() {
            return Some(named.swap_remove(0));
        }
        let walked = self.walked().into_iter().find(is_new);
        walked
            .or_else(|| self.beside_the_front(known).into_iter().find(is_new))
            .or_else(|| named.into_iter().next())
    }

    /// The settings that every sweep measures.
    fn walked(&self) -> Vec<TradeSetting> {
        let centre = TradeSetting::centre(self.project);
        let repeats = (0..=REPEATS).map(|repeat| TradeSetting { repeat, ..centre });
        let turned = Knob::ALL
            .into_iter()
            .flat_map(|knob| centre.neighbours(knob))
            .filter(|s| self.is_possible(s));
        let fine = Some(TradeSetting::fine(self.project)).filter(|s| self.is_possible(s));
        repeats.chain(turned).chain(fine).collect()
    }

    /// What lies one step from the front: from its two ends inward, and at each of its points the knobs first that
    /// moved the error most. Knobs that nobody is offered are turned around the most accurate point, and elsewhere
    /// until it is known what they do.
    fn beside_the_front(&self, known: &[TradePoint]) -> Vec<TradeSetting> {
        let mut front = front(self.project, known);
        let best = front.iter().rfind(|p| p.setting.limits.is_some());
        let best = best.map(|p| p.setting);
        let mut order = Knob::ALL.to_vec();
        let (reports, _) = knobs(known);
        let moved = |knob: &Knob| {
            let report = reports.iter().find(|r| r.knob == *knob);
            report.map_or(0.0, |r| -r.error_percent.abs())
        };
        order.sort_by(|a, b| moved(a).total_cmp(&moved(b)));
        let turned = |s: &TradeSetting| -> Vec<TradeSetting> {
            let known = |knob: Knob| {
                let report = reports.iter().find(|r| r.knob == knob);
                report.is_some_and(|r| r.pairs >= ENOUGH)
            };
            let turned = |knob: Knob| {
                let all = Some(*s) == best || !known(knob);
                let around = s.neighbours(knob).into_iter();
                around.filter(move |n| all || n.answers(self.project))
            };
            let around = order.iter().flat_map(|&knob| turned(knob));
            around.filter(|n| self.is_possible(n)).collect()
        };
        // One of each in turn: the accurate end, the quick end, and so on to the middle.
        let mut ends = Vec::new();
        while !front.is_empty() {
            let from_the_end = ends.len().is_multiple_of(2);
            let at = if from_the_end { front.len() - 1 } else { 0 };
            ends.push(front.remove(at).setting);
        }
        let mut around: Vec<_> = ends.iter().map(|s| turned(s).into_iter()).collect();
        let mut found = Vec::new();
        loop {
            let before = found.len();
            found.extend(around.iter_mut().filter_map(Iterator::next));
            if found.len() == before {
                return found;
            }
        }
    }

    /// What is another computation at all: a solid is no shell whose wall could be taken as one, touches beyond the
    /// project's own are not there to be pressed or looked at, and a part's own triangles are as many as they are.
    fn is_possible(&self, setting: &TradeSetting) -> bool {
        let project = self.project;
        let centre = TradeSetting::centre(project);
        let (Some(spent), Some(usual)) = (setting.limits, centre.limits) else {
            return true;
        };
        let there = |count: usize, usual: usize| count < 2 * project.touch.count || count <= usual;
        let own = project.part.elements == ElementKind::AsGiven;
        let counted = project.candidates.count.is_some();
        (project.part.model == PartModel::Shell || !spent.as_solid)
            && there(spent.touches, usual.touches)
            && there(spent.expected_places, usual.expected_places)
            && there(spent.expected_presses, usual.expected_presses)
            && (!own || spent.vertices == usual.vertices)
            && (!counted || setting.unexplained == centre.unexplained)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::Measured;

    /// A made-up limb: every knob costs, vertices and touches buy.
    fn made_up(setting: &TradeSetting) -> TradePoint {
        let (cost, error) = match &setting.limits {
            Some(s) => (
                (s.vertices * s.touches) as f64 / 1e5 + s.folds as f64,
                1.0 + 2000.0 / s.vertices as f64 + 500.0 / s.touches as f64,
            ),
            None => (1e6, 5.0),
        };
        TradePoint {
            setting: *setting,
            outcome: Ok(Measured::made_up(cost, error)),
        }
    }

    #[test]
    fn a_walk_measures_nothing_twice_and_reaches_the_ends_of_what_buys() {
        let project = Project::around("a.stl", None);
        let sweep = Sweep::new(&project, standards());
        let mut known: Vec<TradePoint> = Vec::new();
        for left in (0..250).rev() {
            let Some(next) = sweep.next(&known, left) else {
                break;
            };
            assert!(known.iter().all(|p| p.setting != next), "{next:?}");
            known.push(made_up(&next));
        }
        let best = front(&project, &known);
        let spent = best.iter().filter_map(|p| p.setting.limits);
        assert!(
            spent
                .clone()
                .any(|s| s.vertices == 19_200 && s.touches == 3200)
        );
        assert!(spent.clone().any(|s| s.vertices == 300 && s.touches == 100));
        for quality in standards() {
            let named = TradeSetting::named(&project, quality);
            assert!(known.iter().any(|p| p.setting == named));
        }
    }
}

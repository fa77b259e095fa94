//! What the gauges as they are, wherever a hand is just moving one, are expected to err by, and where on the limb: told
//! by a thread of its own at the pace of the hand.

use std::sync::Arc;

use egui::{Context, Ui};

use super::Studio;
use super::drive::Finished;
use super::fields::Field;
use super::jobs::Task;
use super::latest::{Desk, Latest};
use super::results::Tab;
use super::tools::{Gesture, Tool};
use crate::design::{Expected, InHand};
use crate::evaluation::Judging;
use crate::io::report::robust_top;
use crate::job::Stop;
use crate::project::ChosenSite;

const BROKEN: &str = "An internal error stopped the expected error of the gauges. Please report it";

/// A set of gauges, one of which is in hand.
struct Question {
    in_hand: Arc<InHand>,
    sites: Vec<ChosenSite>,
    /// The same as sites of the simulation.
    set: Vec<usize>,
    moves: usize,
    /// Counts the questions that want an answer.
    number: u64,
    /// Whether the answer is known: the gauge is only taken in hand, so that its first move is answered as soon as all
    /// others.
    known: bool,
}

impl Question {
    /// Whether at most the gauge in hand is elsewhere.
    fn continues(&self, before: &Self) -> bool {
        let stays = |k: usize| k == self.moves || self.set[k] == before.set[k];
        Arc::ptr_eq(&self.in_hand, &before.in_hand)
            && (self.moves, self.set.len()) == (before.moves, before.set.len())
            && (0..self.set.len()).all(stays)
    }
}

/// What is expected of a set of gauges.
pub(super) struct Answer {
    of: Arc<InHand>,
    sites: Vec<ChosenSite>,
    /// Of the question.
    number: u64,
    pub expected: Expected,
    /// Where the colours of its map end (mm).
    pub top_mm: f64,
}

#[derive(Default)]
pub(super) struct Expecting {
    /// What sets are asked of, and what it holds for.
    ready: Option<(String, Arc<InHand>)>,
    /// Whether that is the simulation and the project as they are.
    holds: bool,
    worker: Option<Latest<Question, Answer>>,
    /// What was asked last: of what, which sites, and which gauge of them moves.
    asked: Option<(Arc<InHand>, Vec<ChosenSite>, usize)>,
    /// How many questions wanted an answer.
    questions: u64,
    answer: Option<Answer>,
    /// Counts answers, so that the view knows when to build its field anew.
    pub version: u64,
}

impl Expecting {
    /// Takes in answers; an error in the user's terms comes back.
    fn collect(&mut self) -> Option<String> {
        let mut error = None;
        if let Some(worker) = &self.worker {
            for reply in worker.answers() {
                match reply {
                    Ok(answer) => {
                        self.answer = Some(answer);
                        self.version += 1;
                    }
                    Err(message) => error = Some(message),
                }
            }
        }
        error
    }

    /// What sets are asked of holds no longer, until that is looked at again.
    pub fn ask_again(&mut self) {
        self.holds = false;
    }

    /// What sets are asked of, while it holds.
    pub fn in_hand(&self) -> Option<&Arc<InHand>> {
        let (_, ready) = self.ready.as_ref().filter(|_| self.holds)?;
        Some(ready)
    }
}

/// Answers questions on the same other gauges; returns the first that has others.
fn serve(first: Question, desk: &Desk<Question, Answer>) -> Option<Question> {
    let in_hand = Arc::clone(&first.in_hand);
    let mut question = desk.latest(first);
    if !Arc::ptr_eq(&in_hand, &question.in_hand) {
        return Some(question);
    }
    let hand = in_hand.hand(&question.set, question.moves);
    loop {
        if !question.known {
            let expected = in_hand.expected(&hand, &question.set, question.moves);
            desk.answer(Ok(Answer {
                of: Arc::clone(&in_hand),
                sites: question.sites.clone(),
                number: question.number,
                top_mm: robust_top(&expected.map_mm),
                expected,
            }));
        }
        let next = desk.wait()?;
        let next = desk.latest(next);
        if !next.continues(&question) {
            return Some(next);
        }
        question = next;
    }
}

impl Studio {
    /// What is expected of sets depends on; nothing where no simulation holds.
    pub(super) fn expected_key(&self) -> Option<String> {
        let simulation = self.simulation.as_ref()?;
        let (quality, simulated) = (simulation.quality, &simulation.simulated);
        let project = &self.document.state.project;
        let holds = self.simulation_holds() == Some(true);
        // Gauges off the lattice are of one design alone.
        let off = &simulated.dataset.sites[simulated.lattice..];
        holds.then(|| {
            format!(
                "{} {:?} {:?} {} {off:?}",
                self.document.simulation_key_at(quality),
                project.gauge,
                project.touch,
                project.live.largest_force_n
            )
        })
    }

    /// Keeps what is expected of the gauges up to date while somebody looks at it.
    pub(super) fn refresh_expected(&mut self, ctx: &Context) {
        if let Some(error) = self.expected.collect() {
            self.complain(error);
        }
        let key = self.expected_key();
        let ready = self.expected.ready.as_ref();
        self.expected.holds = ready.is_some_and(|(of, _)| Some(of) == key.as_ref());
        if !self.wants_expected() {
            return;
        }
        match (self.expected.in_hand().cloned(), key) {
            (Some(in_hand), _) => self.ask_expected(ctx, &in_hand),
            (None, Some(key)) => self.start_expecting(ctx, key),
            (None, None) => {}
        }
    }

    fn wants_expected(&self) -> bool {
        let looks = self.view.tool == Tool::Gauges
            || self.view.field == Field::Expected
            || self.results == Tab::Confusions;
        let by_hand =
            || self.is_matched() && self.design_holds() == Some(true) && !self.as_designed();
        !self.document.state.project.selection.sites.is_empty() && (looks || by_hand())
    }

    /// Whether sets of gauges are judged by matching.
    pub(super) fn is_matched(&self) -> bool {
        matches!(self.document.state.project.judging(), Judging::Matching(_))
    }

    fn start_expecting(&mut self, ctx: &Context, key: String) {
        let under_way =
            (self.jobs.running.iter()).any(|r| r.task == Task::Expect && r.job.key == key);
        let failed = self.drive.failure(Task::Expect, &key).is_some();
        let moving = ctx.input(|i| i.pointer.any_down());
        let Some(simulation) = &self.simulation else {
            return;
        };
        if under_way || failed || moving {
            return;
        }
        let simulated = Arc::clone(&simulation.simulated);
        let inputs = self.document.inputs();
        self.jobs.start(ctx, Task::Expect, key, move |r| {
            let in_hand = InHand::new(&inputs, simulated, &|p| r.report(p));
            let in_hand = in_hand.map_err(|_| Stop::Cancelled)?;
            Ok(Finished::InHand(Arc::new(in_hand)))
        });
    }

    /// What sets are asked of from now on.
    pub(super) fn take_in_hand(&mut self, key: String, in_hand: Arc<InHand>) {
        self.expected.ready = Some((key, in_hand));
    }

    fn ask_expected(&mut self, ctx: &Context, in_hand: &Arc<InHand>) {
        let sites = &self.document.state.project.selection.sites;
        let moves = match self.view.gesture {
            Gesture::Gauge(_, number, _) => number,
            _ => self.picked.first().copied().unwrap_or(0),
        };
        let moves = moves.min(sites.len().saturating_sub(1));
        let asked = self.expected.asked.as_ref();
        if asked.is_some_and(|(of, asked, number)| {
            Arc::ptr_eq(of, in_hand) && asked == sites && *number == moves
        }) {
            return;
        }
        // The last answer, that is: one that is still to come would take its place.
        let (answer, questions) = (self.expected.answer.as_ref(), self.expected.questions);
        let known = answer.is_some_and(|a| {
            a.number == questions && Arc::ptr_eq(&a.of, in_hand) && a.sites == *sites
        });
        let sites = sites.clone();
        self.expected.asked = Some((Arc::clone(in_hand), sites.clone(), moves));
        let Some(set) = self.simulated_sites() else {
            return;
        };
        self.expected.questions += u64::from(!known);
        let question = Question {
            in_hand: Arc::clone(in_hand),
            moves,
            sites,
            set,
            number: self.expected.questions,
            known,
        };
        let worker = &mut self.expected.worker;
        let worker = worker.get_or_insert_with(|| Latest::start(ctx, BROKEN, serve));
        // Where nobody answers any more the last answer is no longer of these gauges, and is not shown as theirs.
        worker.ask(question);
    }

    /// The newest answer: of the gauges as they are, or while one moves, as they just were.
    pub(super) fn expected_shown(&self) -> Option<&Answer> {
        let in_hand = self.expected.in_hand()?;
        let answer = self.expected.answer.as_ref()?;
        let sites = &self.document.state.project.selection.sites;
        let near = answer.sites == *sites
            || answer.sites.len() == sites.len() && matches!(self.view.gesture, Gesture::Gauge(..));
        (near && Arc::ptr_eq(&answer.of, in_hand)).then_some(answer)
    }

    /// The error (mm) that matching is expected to make with the gauges as they are, once it is known.
    #[must_use]
    pub fn expected_error(&self) -> Option<f64> {
        let sites = &self.document.state.project.selection.sites;
        let answer = self.expected_shown().filter(|a| a.sites == *sites)?;
        Some(answer.expected.error_mm)
    }

    /// Why nothing is known of the gauges yet.
    fn nothing_expected(&self) -> &'static str {
        if self.simulation_holds() != Some(true) {
            "Expected error: press “Simulate”"
        } else if self.document.state.project.selection.sites.is_empty() {
            "Expected error: no gauges yet"
        } else if self.simulated_sites().is_none() {
            "A gauge lies at none of the sites that were simulated"
        } else {
            "Expected error: …"
        }
    }

    /// What is expected of the gauges, over the view.
    pub(super) fn expected_lines(&self, ui: &mut Ui) {
        let (Some(answer), Some(in_hand)) = (self.expected_shown(), self.expected.in_hand()) else {
            ui.weak(self.nothing_expected());
            return;
        };
        let expected = &answer.expected;
        let [lightest, hardest] = in_hand.forces_n;
        ui.label(format!(
            "Expected error: {:.2} mm, {lightest}–{hardest} N",
            expected.error_mm
        ))
        .on_hover_text(
            "Of model matching, over where touches come, how hard they are and what is off",
        );
        let sighted = expected.sighted_mm.filter(|_| expected.blind > 0.0);
        let without = sighted.map_or(String::new(), |mm| format!(", {mm:.2} mm without"));
        ui.label(format!(
            "{:.0} % blind at {} N{without}",
            100.0 * expected.blind,
            in_hand.force_n
        ))
        .on_hover_text(
            "Share of the touches that move no gauge by more than three deviations of its noise",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::{Quality, unwatched};
    use crate::design::{self, expected_errors};

    #[test]
    fn a_gauge_in_hand_is_answered_as_sets_are_judged() {
        let mut inputs = crate::cli::bundled().unwrap().inputs;
        inputs.project.budget.quality = Quality::Draft;
        let budget = Quality::Draft.budget();
        let simulated = Arc::new(design::simulate(&inputs, &budget, &unwatched).unwrap());
        let in_hand = Arc::new(InHand::new(&inputs, Arc::clone(&simulated), &unwatched).unwrap());
        let count = simulated.dataset.sites.len();
        let question = |k: usize| Question {
            in_hand: Arc::clone(&in_hand),
            sites: Vec::new(),
            set: [0, 1, 2 + k, 3, 4].map(|n| n * count / 12).to_vec(),
            moves: 2,
            number: 0,
            known: false,
        };
        assert!(question(5).continues(&question(0)));
        let other = Question {
            moves: 3,
            ..question(5)
        };
        assert!(!other.continues(&question(0)));
        let worker = Latest::start(&Context::default(), BROKEN, serve);
        for k in [0, 4] {
            assert!(worker.ask(question(k)));
            let answer = loop {
                if let Some(reply) = worker.answers().next() {
                    break reply.unwrap();
                }
                std::thread::yield_now();
            };
            let expected = &answer.expected;
            let set = question(k).set;
            let judged = expected_errors(&inputs, &simulated, &[set], &unwatched).unwrap()[0];
            let off = expected.error_mm / judged - 1.0;
            assert!(off.abs() < 0.1, "{} {judged}", expected.error_mm);
            // The map is of the same size, a vertex of the part.
            assert_eq!(expected.map_mm.len(), inputs.part.positions().len());
            let largest = expected.map_mm.iter().copied().fold(0.0, f64::max);
            assert!(
                expected
                    .map_mm
                    .iter()
                    .all(|mm| mm.is_finite() && *mm >= 0.0)
            );
            assert!(largest > 0.5 * judged, "{largest} {judged}");
            assert!((0.0..=1.0).contains(&expected.blind));
            assert!(answer.top_mm > 0.0);
        }
        // Taking another gauge in hand tells nothing new; its first move does.
        let taken = |k: usize, known: bool| Question {
            moves: 3,
            known,
            ..question(k)
        };
        assert!(worker.ask(taken(4, true)) && worker.ask(taken(5, false)));
        let answer = loop {
            if let Some(reply) = worker.answers().next() {
                break reply.unwrap();
            }
            std::thread::yield_now();
        };
        let set = question(5).set;
        let alone = in_hand.expected(&in_hand.hand(&set, 3), &set, 3);
        assert_eq!(answer.expected, alone);
        assert!(worker.answers().next().is_none());
    }
}

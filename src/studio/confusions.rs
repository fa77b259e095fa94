//! Which touches the gauges take for each other: for the place that is pointed at, and the worst of all.

use std::sync::Arc;

use egui::{Align2, Color32, Context, Painter, Stroke, Ui};
use glam::DVec3;

use super::Studio;
use super::drive::Finished;
use super::fields::Field;
use super::jobs::Task;
use super::latest::{Desk, Latest};
use super::overlay::label;
use super::results::{Tab, empty};
use super::viewport::Pane;
use crate::design::InHand;
use crate::job::Stop;
use crate::placement::expected_error::{Mistaken, Pair};

const BROKEN: &str = "An internal error stopped what a touch is taken for. Please report it";

/// What the press nearest to the pointer is taken for by a set.
struct Question {
    in_hand: Arc<InHand>,
    set: Vec<usize>,
    press: usize,
    /// Of the press (m).
    place: DVec3,
}

struct Answer {
    press: usize,
    place: DVec3,
    taken: Vec<Mistaken>,
}

#[derive(Default)]
pub(super) struct Confusions {
    worker: Option<Latest<Question, Answer>>,
    /// What is pointed at, and the gauges: where neither has changed nothing is asked.
    asked: Option<(usize, String)>,
    answer: Option<Answer>,
    /// The worst, and what they hold for.
    pairs: Option<(String, Arc<Vec<Pair>>)>,
    /// Which of them was clicked.
    looked_at: Option<usize>,
}

fn serve(first: Question, desk: &Desk<Question, Answer>) -> Option<Question> {
    let question = desk.latest(first);
    desk.answer(Ok(Answer {
        press: question.press,
        place: question.place,
        taken: question.in_hand.taken_for(&question.set, question.press),
    }));
    desk.wait()
}

impl Studio {
    /// What confusions depend on: the gauges, and what is expected of them.
    pub(super) fn confusions_key(&self) -> Option<String> {
        let sites = &self.document.state.project.selection.sites;
        let of = self.expected_key().filter(|_| !sites.is_empty())?;
        Some(format!("{sites:?} {of}"))
    }

    /// Looks for confusions while somebody looks at them.
    pub(super) fn refresh_confusions(&mut self, ctx: &Context) {
        self.collect_mistaken();
        let shown = self.view.field == Field::Expected;
        if !shown && self.results != Tab::Confusions {
            return;
        }
        let resting = self.view.is_idle() && !ctx.input(|i| i.pointer.any_down());
        let (true, Some(in_hand), Some(key)) = (
            resting,
            self.expected.in_hand().cloned(),
            self.confusions_key(),
        ) else {
            return;
        };
        let Some(set) = self.simulated_sites() else {
            return;
        };
        if shown {
            self.ask_mistaken(ctx, &in_hand, &set, &key);
        }
        let known = self.confusions.pairs.as_ref().is_some_and(|p| p.0 == key);
        let under_way =
            (self.jobs.running.iter()).any(|r| r.task == Task::Confuse && r.job.key == key);
        if known || under_way || self.drive.failure(Task::Confuse, &key).is_some() {
            return;
        }
        self.jobs.start(ctx, Task::Confuse, key, move |r| {
            let pairs = in_hand.worst_pairs(&set, &|p| r.report(p));
            Ok(Finished::Confused(pairs.map_err(|_| Stop::Cancelled)?))
        });
    }

    fn collect_mistaken(&mut self) {
        let mut error = None;
        if let Some(worker) = &self.confusions.worker {
            for reply in worker.answers() {
                match reply {
                    Ok(answer) => self.confusions.answer = Some(answer),
                    Err(message) => error = Some(message),
                }
            }
        }
        if let Some(error) = error {
            self.complain(error);
        }
    }

    /// Asks what the place that is pointed at is taken for.
    fn ask_mistaken(&mut self, ctx: &Context, in_hand: &Arc<InHand>, set: &[usize], key: &str) {
        let Some((press, place)) = self.pointed_press(in_hand) else {
            return;
        };
        let asked = self.confusions.asked.as_ref();
        if asked.is_some_and(|(p, k)| *p == press && k == key) {
            return;
        }
        if asked.is_some_and(|(_, k)| k != key) {
            // Of other gauges.
            self.confusions.answer = None;
        }
        self.confusions.asked = Some((press, key.to_owned()));
        let worker = &mut self.confusions.worker;
        let worker = worker.get_or_insert_with(|| Latest::start(ctx, BROKEN, serve));
        worker.ask(Question {
            in_hand: Arc::clone(in_hand),
            set: set.to_vec(),
            press,
            place,
        });
    }

    /// The press nearest to the pointer, and where it is (m).
    fn pointed_press(&self, in_hand: &InHand) -> Option<(usize, DVec3)> {
        let at = self.document.part.point(self.view.hover?);
        in_hand.press_near(at)
    }

    pub(super) fn take_confusions(&mut self, key: String, pairs: Vec<Pair>) {
        self.confusions.pairs = Some((key, Arc::new(pairs)));
        self.confusions.looked_at = None;
    }

    /// The worst confusions of the gauges as they are, the worst first, once they are known.
    #[must_use]
    pub fn worst_confusions(&self) -> Option<Arc<Vec<Pair>>> {
        let (of, pairs) = self.confusions.pairs.as_ref()?;
        let holds = Some(of) == self.confusions_key().as_ref();
        holds.then(|| Arc::clone(pairs))
    }

    /// The worst pairs as lines, and what the place that is pointed at is taken for.
    pub(super) fn paint_confusions(&self, painter: &Painter, pane: Pane) {
        if self.view.field != Field::Expected && self.results != Tab::Confusions {
            return;
        }
        let pairs = self.worst_confusions();
        for (k, pair) in pairs.iter().flat_map(|pairs| pairs.iter()).enumerate() {
            let looked_at = self.confusions.looked_at == Some(k);
            self.paint_pair(painter, pane, pair, looked_at);
        }
        let pointed = (self.expected.in_hand()).and_then(|i| self.pointed_press(i));
        let answer = self.confusions.answer.as_ref();
        let answer = answer.filter(|a| pointed.is_some_and(|(press, _)| press == a.press));
        if let Some(answer) = answer.filter(|_| self.view.field == Field::Expected) {
            self.paint_mistaken(painter, pane, answer);
        }
    }

    fn paint_pair(&self, painter: &Painter, pane: Pane, pair: &Pair, looked_at: bool) {
        let place = |mm: DVec3| self.view.place_in(pane, mm / 1000.0);
        let (Some(from), Some(to)) = (place(pair.from_mm), place(pair.taken.place_mm)) else {
            return;
        };
        let (width, ink) = if looked_at {
            (2.5, Color32::WHITE)
        } else {
            (1.0, Color32::from_white_alpha(130))
        };
        painter.line_segment([from, to], Stroke::new(width, ink));
        for end in [from, to] {
            painter.circle(end, 3.5, ink, Stroke::new(1.0, Color32::BLACK));
        }
    }

    fn paint_mistaken(&self, painter: &Painter, pane: Pane, answer: &Answer) {
        let Some(here) = self.view.place_in(pane, answer.place) else {
            return;
        };
        painter.circle_stroke(here, 7.0, Stroke::new(2.0, Color32::WHITE));
        for taken in &answer.taken {
            let Some(there) = self.view.place_in(pane, taken.place_mm / 1000.0) else {
                continue;
            };
            let alpha = (90.0 + 165.0 * taken.share).min(255.0) as u8;
            let ink = Color32::from_white_alpha(alpha);
            painter.circle(there, 5.0, ink, Stroke::new(1.0, Color32::BLACK));
            let text = format!("{:.0} %", 100.0 * taken.share);
            let above = there - egui::vec2(0.0, 9.0);
            label(painter, above, Align2::CENTER_BOTTOM, &text, Color32::WHITE);
        }
    }

    /// The tab: the worst confusions, and a way to each.
    pub(super) fn confusions_tab(&mut self, ui: &mut Ui) {
        let Some(pairs) = self.worst_confusions() else {
            let text = match (self.simulation_holds(), self.gauge_places().is_empty()) {
                (_, true) => "No gauges yet: their confusions are listed here",
                (Some(true), _) => "Looking for touches that are taken for each other …",
                _ => "Press “Simulate” to see which touches the gauges take for each other",
            };
            return empty(ui, text);
        };
        let force = self.document.state.project.touch.force_n;
        if pairs.is_empty() {
            let text = format!("At {force} N no touch is taken for one elsewhere");
            return empty(ui, &text);
        }
        ui.weak(format!(
            "Touches of {force} N that are taken for others, the costliest first"
        ));
        if let Some(k) = self.confusion_table(ui, &pairs) {
            self.confusions.looked_at = Some(k);
            let ends = [pairs[k].from_mm, pairs[k].taken.place_mm].map(|mm| mm / 1000.0);
            self.view.frame_points(&ends, &self.document);
        }
    }

    /// All of them; which was clicked.
    fn confusion_table(&self, ui: &mut Ui, pairs: &[Pair]) -> Option<usize> {
        const TITLES: [&str; 5] = [
            "Number",
            "Apart (mm)",
            "Probability",
            "Touched (mm)",
            "Taken for (mm)",
        ];
        let mut clicked = None;
        let table = |ui: &mut Ui| {
            for title in TITLES {
                ui.strong(title);
            }
            ui.end_row();
            for (k, pair) in pairs.iter().enumerate() {
                if self.confusion_row(ui, k, pair) {
                    clicked = Some(k);
                }
            }
        };
        egui::ScrollArea::vertical()
            .auto_shrink(false)
            .show(ui, |ui| {
                egui::Grid::new("confusions")
                    .num_columns(TITLES.len())
                    .striped(true)
                    .spacing([18.0, 3.0])
                    .show(ui, table);
            });
        clicked
    }

    /// One confusion; whether it was clicked.
    fn confusion_row(&self, ui: &mut Ui, k: usize, pair: &Pair) -> bool {
        let chosen = self.confusions.looked_at == Some(k);
        let button = ui
            .add(egui::Button::selectable(chosen, format!("{}", k + 1)))
            .on_hover_text("Look there")
            .accessible_name(format!("Confusion {}", k + 1));
        ui.monospace(format!("{:8.1}", pair.taken.apart_mm));
        ui.monospace(format!("{:6.0} %", 100.0 * pair.taken.share));
        for place in [pair.from_mm, pair.taken.place_mm] {
            ui.monospace(format!("{:7.1} {:7.1} {:7.1}", place.x, place.y, place.z));
        }
        ui.end_row();
        button.clicked()
    }
}

//! What becomes of what is felt and said while presses are made by hand: places are gone through, and what is read of each is
//! written down.

use std::sync::Arc;

use glam::DVec3;

use super::hand_words::{HandOrder, HandSays, PressOrder};
use crate::design::check_on_part;
use crate::link::Recorder;
use crate::live::{HandNews, HandPress, HandPresses};
use crate::mesh::TriMesh;
use crate::units;

/// What is to be pressed.
pub struct HandPlan {
    /// Where to press (m) and the wall's normal there, by the number in the plan.
    pub places: Vec<(DVec3, DVec3)>,
    /// Places that are still to be pressed.
    pub left: Vec<usize>,
    /// Whether a sensor feels how hard it is pressed.
    pub has_sensor: bool,
    /// How hard is meant (N).
    pub meant_n: f64,
    pub(super) part: Arc<TriMesh>,
    /// Of the model.
    pub(super) wall: Arc<TriMesh>,
}

/// The place (m) of the wall that is nearest to another, and its normal.
pub(super) fn on_wall(wall: &TriMesh, place: DVec3) -> (DVec3, DVec3) {
    let (at, _) = wall.index().nearest(place);
    (wall.point(at), wall.normal(at))
}

/// Goes through the places, and writes down what is read.
pub(super) struct HandDesk<'a> {
    plan: &'a HandPlan,
    pub recorder: Recorder,
    pub presses: HandPresses,
    /// Which of the places that are left is next.
    at: usize,
    /// Which of them was asked for last.
    prompted: Option<usize>,
    /// A press that is over, until it is known how hard it was.
    over: Option<HandPress>,
    /// Where this one is pressed (m), if not where it was asked for.
    elsewhere: Option<DVec3>,
    /// How hard (N) the press of now is said to be, which is not over yet.
    force: Option<f64>,
    /// Whether it may be said before its press.
    ahead: bool,
    /// What is pressed just now is of no place any more.
    passed: bool,
    pub taken: usize,
    stopped: bool,
}

impl<'a> HandDesk<'a> {
    pub fn new(plan: &'a HandPlan, recorder: Recorder, ahead: bool) -> Self {
        Self {
            plan,
            recorder,
            presses: HandPresses::default(),
            at: 0,
            prompted: None,
            over: None,
            elsewhere: None,
            force: None,
            ahead,
            passed: false,
            taken: 0,
            stopped: false,
        }
    }

    pub fn is_over(&self) -> bool {
        self.stopped || self.recorder.failed.is_some() || self.at >= self.plan.left.len()
    }

    pub fn prompt(&mut self, tell: &mut dyn FnMut(HandSays)) {
        if let Some(&number) = self.plan.left.get(self.at)
            && self.prompted.replace(self.at) != Some(self.at)
        {
            let all = self.plan.places.len();
            let done = all - self.plan.left.len() + self.at;
            tell(HandSays::Press {
                number,
                which: done + 1,
                all,
                at: self.plan.places[number].0,
            });
            // Both may have been there before it was asked for.
            if self.elsewhere.is_some() {
                tell(HandSays::Moved(self.elsewhere));
            }
            if self.over.is_some() && self.force.is_none() {
                tell(HandSays::HowHard);
            }
        }
    }

    /// Nothing can be pressed until there is a rest again.
    pub fn wait(&mut self, tell: &mut dyn FnMut(HandSays)) {
        (self.presses, self.passed) = (HandPresses::default(), false);
        if self.prompted.take().is_some() {
            tell(HandSays::Wait);
        }
    }

    pub fn hear(&mut self, news: HandNews, tell: &mut dyn FnMut(HandSays)) {
        if self.passed {
            self.passed = news == HandNews::Read;
            return;
        }
        match news {
            HandNews::Read => tell(HandSays::LetGo),
            // A bump while the force of the press before is waited for.
            HandNews::Unsteady if self.over.is_some() => tell(HandSays::HowHard),
            HandNews::Unsteady => {
                // What was said ahead is of this place still.
                if !self.ahead {
                    self.force = None;
                }
                tell(HandSays::Unsteady);
            }
            // Pressed again before it was said how hard the one before was: this one is meant.
            HandNews::Over(press) => {
                self.over = Some(press);
                if self.plan.has_sensor {
                    self.write(None, tell);
                } else if self.force.is_none() {
                    tell(HandSays::HowHard);
                }
            }
        }
    }

    pub fn obey(
        &mut self,
        orders: &mut dyn FnMut() -> Option<PressOrder>,
        tell: &mut dyn FnMut(HandSays),
    ) {
        // Beforehand a force is said for each place; else what is said last counts.
        let asks = self.force.is_none() || !self.ahead;
        let said = asks.then(orders).flatten();
        let order = said.filter(|said| self.is_of_now(said));
        if said.is_some() && order.is_none() {
            tell(HandSays::TakenAlready);
        }
        match order.map(|said| said.order) {
            Some(HandOrder::Stop) => self.stopped = true,
            Some(HandOrder::Skip) => self.go_on(),
            Some(HandOrder::Elsewhere(place)) => self.move_to(place, tell),
            Some(HandOrder::Force(force)) => self.force = Some(force),
            // An empty line too many, or that nobody can type any more.
            Some(HandOrder::AsMeant)
                if self.ahead || self.over.is_some() || self.presses.is_felt() =>
            {
                self.force.get_or_insert(self.plan.meant_n);
            }
            Some(HandOrder::AsMeant) | None => {}
        }
        if self.stopped || self.force.is_none() {
            return;
        }
        if self.plan.has_sensor {
            self.force = None;
        } else if self.over.is_some() {
            self.write(self.force, tell);
        } else if !self.ahead && !self.presses.is_felt() {
            self.force = None;
            tell(HandSays::NothingWaits);
        }
    }

    /// Whether it is said of the press of now, or of all.
    fn is_of_now(&self, said: &PressOrder) -> bool {
        let now = self.plan.left.get(self.at);
        let is_of_now = said.number.is_none_or(|number| now == Some(&number));
        is_of_now || said.order == HandOrder::Stop
    }

    fn move_to(&mut self, place: Option<DVec3>, tell: &mut dyn FnMut(HandSays)) {
        let Some(place) = place else {
            self.elsewhere = None;
            return tell(HandSays::Moved(None));
        };
        let part = &self.plan.part;
        if check_on_part(part, "place", std::iter::once(place)).is_err() {
            return tell(HandSays::OffTheWall(place));
        }
        let (at, _) = on_wall(&self.plan.wall, place);
        self.elsewhere = Some(at);
        tell(HandSays::Moved(self.elsewhere));
    }

    fn go_on(&mut self) {
        (self.over, self.force, self.elsewhere) = (None, None, None);
        self.passed = self.presses.is_felt();
        self.at += 1;
    }

    /// Writes down the press that is over, as the notes of a machine's presses are, with its force (N) where that is told.
    fn write(&mut self, force: Option<f64>, tell: &mut dyn FnMut(HandSays)) {
        let (Some(press), Some(&number)) = (self.over.take(), self.plan.left.get(self.at)) else {
            return;
        };
        let mm = units::mm(self.elsewhere.unwrap_or(self.plan.places[number].0));
        let recorder = &mut self.recorder;
        recorder.own(&format!(
            "press {number} {:.4} {:.4} {:.4}",
            mm.x, mm.y, mm.z
        ));
        for (what, samples) in [("rest", &press.rest), ("depth 0", &press.pressed)] {
            recorder.own(&format!("read {what}"));
            for sample in samples {
                recorder.sample(sample);
            }
            recorder.own("end");
        }
        if let Some(force) = force {
            recorder.own(&format!("force {force}"));
        }
        recorder.own(&format!("pressed {number}"));
        recorder.flush();
        self.taken += 1;
        tell(HandSays::Taken(number, force));
        self.go_on();
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::inference::{Contact, SeveralTouches};
    use crate::live::{LiveUpdate, Sample};

    /// A plate whose corners are to be pressed.
    fn plan(has_sensor: bool) -> HandPlan {
        let corners = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
        let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
        let (plate, _) = TriMesh::new(&corners, &[[0, 1, 2], [0, 2, 3]], 0).unwrap();
        let plate = Arc::new(plate);
        HandPlan {
            places: corners.map(|at| (at, DVec3::Z)).to_vec(),
            left: vec![0, 2, 3],
            has_sensor,
            meant_n: 8.0,
            part: Arc::clone(&plate),
            wall: plate,
        }
    }

    fn desk<'a>(plan: &'a HandPlan, home: &Path, ahead: bool) -> HandDesk<'a> {
        let recorder = Recorder::create(&home.join("part.hapdrec")).unwrap();
        let mut desk = HandDesk::new(plan, recorder, ahead);
        desk.prompt(&mut |_| ());
        desk
    }

    /// What is told as something is heard or said.
    fn told<'a>(
        desk: &mut HandDesk<'a>,
        act: impl FnOnce(&mut HandDesk<'a>, &mut dyn FnMut(HandSays)),
    ) -> Vec<HandSays> {
        let mut all = Vec::new();
        act(desk, &mut |says| all.push(says));
        all
    }

    fn say(desk: &mut HandDesk<'_>, said: impl Into<PressOrder>) -> Vec<HandSays> {
        let mut said = Some(said.into());
        told(desk, |desk, tell| desk.obey(&mut || said.take(), tell))
    }

    fn hear(desk: &mut HandDesk<'_>, news: HandNews) -> Vec<HandSays> {
        told(desk, |desk, tell| desk.hear(news, tell))
    }

    fn over() -> HandNews {
        HandNews::Over(HandPress::default())
    }

    fn of(number: usize, order: HandOrder) -> PressOrder {
        PressOrder {
            number: Some(number),
            order,
        }
    }

    /// A finger is on the limb.
    fn press(desk: &mut HandDesk<'_>) {
        let contact = Contact::of_finger(5.0);
        for k in 0..60 {
            let sample = Sample {
                time_us: k * 10_000,
                counts: vec![0.0],
            };
            let update = LiveUpdate {
                strain: Some(vec![if k < 50 { 0.0 } else { 1e-4 }]),
                touches: (k >= 50).then(|| SeveralTouches::one(contact, 1.0)),
                ..LiveUpdate::nothing(sample.time_us)
            };
            desk.presses.take(&sample, &update, &[1e-6], &[true]);
        }
        assert!(desk.presses.is_felt());
    }

    #[test]
    fn what_is_said_of_a_press_that_was_taken_meanwhile_is_not_said_of_the_next() {
        let (plan, home) = (plan(true), tempfile::tempdir().unwrap());
        let mut desk = desk(&plan, home.path(), false);
        assert_eq!(hear(&mut desk, over()), [HandSays::Taken(0, None)]);
        for order in [HandOrder::Skip, HandOrder::Elsewhere(Some(DVec3::ZERO))] {
            assert_eq!(say(&mut desk, of(0, order)), [HandSays::TakenAlready]);
        }
        assert_eq!((desk.at, desk.elsewhere), (1, None));
        say(&mut desk, of(2, HandOrder::Skip));
        assert_eq!(desk.at, 2);
        // To stop is of all of them.
        say(&mut desk, of(2, HandOrder::Stop));
        assert!(desk.is_over());
    }

    #[test]
    fn a_press_that_is_held_while_its_place_is_skipped_is_not_the_next_ones() {
        for has_sensor in [false, true] {
            let (plan, home) = (plan(has_sensor), tempfile::tempdir().unwrap());
            let mut desk = desk(&plan, home.path(), false);
            press(&mut desk);
            assert!(say(&mut desk, HandOrder::Skip).is_empty());
            assert_eq!(desk.at, 1);
            // It goes on to stand still, and is let go.
            assert!(hear(&mut desk, HandNews::Read).is_empty());
            assert!(hear(&mut desk, over()).is_empty());
            assert!(desk.over.is_none() && desk.taken == 0);
            // What comes then is of the next place: with a sensor that is all, without one it is asked how hard it was.
            assert_eq!(hear(&mut desk, HandNews::Read), [HandSays::LetGo]);
            let said = hear(&mut desk, over());
            if has_sensor {
                assert_eq!(said, [HandSays::Taken(2, None)]);
            } else {
                assert_eq!(said, [HandSays::HowHard]);
            }
        }
    }

    #[test]
    fn it_stops_and_moves_while_a_press_whose_force_is_known_is_held() {
        let (plan, home) = (plan(false), tempfile::tempdir().unwrap());
        let mut desk = desk(&plan, home.path(), false);
        press(&mut desk);
        assert!(say(&mut desk, HandOrder::Force(5.0)).is_empty());
        let there = DVec3::new(0.05, 0.05, 0.0);
        let moved = say(&mut desk, HandOrder::Elsewhere(Some(there)));
        assert!(matches!(moved[..], [HandSays::Moved(Some(at))] if at.distance(there) < 1e-9));
        // Neither that nor an empty line forgets the force; another one is the one that counts.
        say(&mut desk, HandOrder::AsMeant);
        assert_eq!(desk.force, Some(5.0));
        say(&mut desk, HandOrder::Force(6.0));
        say(&mut desk, HandOrder::Stop);
        assert!(desk.is_over() && desk.taken == 0);
    }

    #[test]
    fn a_force_waits_for_its_press_and_a_bump_does_not_take_it() {
        let (plan, home) = (plan(false), tempfile::tempdir().unwrap());
        let mut desk = desk(&plan, home.path(), false);
        assert_eq!(
            say(&mut desk, HandOrder::Force(5.0)),
            [HandSays::NothingWaits]
        );
        assert_eq!(hear(&mut desk, HandNews::Read), [HandSays::LetGo]);
        assert_eq!(hear(&mut desk, over()), [HandSays::HowHard]);
        assert_eq!(hear(&mut desk, HandNews::Unsteady), [HandSays::HowHard]);
        assert_eq!(
            say(&mut desk, HandOrder::Force(5.0)),
            [HandSays::Taken(0, Some(5.0))]
        );
        assert_eq!(hear(&mut desk, HandNews::Unsteady), [HandSays::Unsteady]);
        assert_eq!(hear(&mut desk, over()), [HandSays::HowHard]);
        assert_eq!(
            say(&mut desk, HandOrder::AsMeant),
            [HandSays::Taken(2, Some(8.0))]
        );
        assert!(!desk.is_over());
    }

    #[test]
    fn forces_said_beforehand_are_of_one_place_each() {
        let (plan, home) = (plan(false), tempfile::tempdir().unwrap());
        let mut desk = desk(&plan, home.path(), true);
        let mut lines = [4.0, 5.0].map(HandOrder::Force).into_iter();
        let mut turn = |desk: &mut HandDesk<'_>| {
            told(desk, |desk, tell| {
                desk.obey(&mut || lines.next().map(PressOrder::from), tell);
            })
        };
        for _ in 0..3 {
            assert!(turn(&mut desk).is_empty());
        }
        // Of an unsteady press the force stays for the place.
        assert_eq!(hear(&mut desk, HandNews::Unsteady), [HandSays::Unsteady]);
        for (number, force) in [(0, 4.0), (2, 5.0)] {
            assert!(hear(&mut desk, over()).is_empty() || number == 2);
            assert_eq!(
                turn(&mut desk).last(),
                Some(&HandSays::Taken(number, Some(force)))
            );
        }
    }

    #[test]
    fn nothing_is_pressed_beside_the_limb_or_before_there_is_a_rest() {
        let (plan, home) = (plan(false), tempfile::tempdir().unwrap());
        let mut desk = desk(&plan, home.path(), false);
        let off = DVec3::new(3.0, 0.0, 0.0);
        let said = say(&mut desk, HandOrder::Elsewhere(Some(off)));
        assert_eq!(said, [HandSays::OffTheWall(off)]);
        assert_eq!(
            told(&mut desk, |desk, tell| desk.wait(tell)),
            [HandSays::Wait]
        );
        assert!(told(&mut desk, |desk, tell| desk.wait(tell)).is_empty());
        let again = told(&mut desk, |desk, tell| desk.prompt(tell));
        assert!(matches!(
            again[..],
            [HandSays::Press {
                number: 0,
                which: 2,
                all: 4,
                ..
            }]
        ));
    }
}

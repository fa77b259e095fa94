//! A run of presses that somebody makes by hand: no machine, one place after another, and how hard each was comes from a
//! sensor or from whoever pressed.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use glam::DVec3;

use super::places::places;
use super::ready::pressed;
use super::run::PressingRun;
use crate::design::{Inputs, Sensing, check_on_part};
use crate::io::bench_folder;
use crate::link::{Address, ConnectionState, Listener, Recorder, SessionEvent};
use crate::live::{HandNews, HandPress, HandPresses, Pipeline};
use crate::plain;

/// What whoever presses may say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandOrder {
    /// How hard this press is (N).
    Force(f64),
    /// As hard as was meant.
    AsMeant,
    /// It is pressed there (m) and not where it was asked for; or there after all.
    Elsewhere(Option<DVec3>),
    /// Leaves this place out for now.
    Skip,
    /// Ends the run; what was pressed is kept.
    Stop,
}

/// What whoever presses is told.
#[derive(Clone, Debug, PartialEq)]
pub enum HandSays {
    /// Where to press next (m): its number in the plan, and that it is the `which`-th of all.
    Press {
        number: usize,
        which: usize,
        all: usize,
        at: DVec3,
    },
    /// It is taken to be pressed there (m), or where it was asked for.
    Moved(Option<DVec3>),
    /// The board says nothing, or its rest is taken anew: nothing is to be pressed.
    Wait,
    /// Where it is said to be pressed (m) there is no wall.
    OffTheWall(DVec3),
    /// It was read, and may be let go.
    LetGo,
    /// It is over, and how hard it was is not known yet.
    HowHard,
    /// It was not taken: it never stood still, or came before there was a rest.
    Unsteady,
    /// A force was written, and no press waits for one.
    NothingWaits,
    /// It is written down: its number in the plan, with its force (N) where no sensor feels that.
    Taken(usize, Option<f64>),
    /// What the board or the connection says.
    Board(String),
}

impl HandSays {
    /// For whoever presses, with the force that is meant (N).
    #[must_use]
    pub fn in_words(&self, meant_n: f64) -> String {
        let place = |at: DVec3| {
            let mm = at * 1e3;
            format!("({:.1}, {:.1}, {:.1}) mm", mm.x, mm.y, mm.z)
        };
        match self {
            Self::Press { which, all, at, .. } => format!(
                "press {which} of {all}: at {} with about {meant_n} N; hold it for a second",
                place(*at)
            ),
            Self::Moved(Some(at)) => format!("this one is at {}", place(*at)),
            Self::Moved(None) => "this one is where it was asked for".into(),
            Self::Wait => "leave the limb alone until the board's rest is taken anew".into(),
            Self::OffTheWall(at) => {
                format!("{} is not on the limb, and was passed over", place(*at))
            }
            Self::Board(text) => text.clone(),
            Self::LetGo => "read: let go".into(),
            Self::HowHard => format!("how hard was it, in N? (Enter: {meant_n})"),
            Self::Unsteady => {
                "it was not taken: leave the limb alone for a moment, then press again and hold it for a second".into()
            }
            Self::NothingWaits => "no press waits for a force".into(),
            Self::Taken(_, Some(force)) => format!("taken, with {force} N"),
            Self::Taken(_, None) => "taken".into(),
        }
    }
}

/// A run that can be pressed.
pub struct HandRun {
    /// Where it is written.
    pub folder: PathBuf,
    /// Where to press (m) and the wall's normal there, by the number in the plan.
    pub places: Vec<(DVec3, DVec3)>,
    /// Places that are still to be pressed.
    pub left: Vec<usize>,
    /// Whether a sensor feels how hard it is pressed.
    pub has_sensor: bool,
    /// How hard is meant (N).
    pub meant_n: f64,
    inputs: Inputs,
    sensing: Arc<Sensing>,
}

impl HandRun {
    /// Chooses the places, or takes those that the run was begun with, and writes a plan that is new.
    ///
    /// # Errors
    /// A message in the user's terms: points of another limb, a folder that cannot be read or written.
    pub fn new(run: PressingRun, inputs: Inputs, sensing: Arc<Sensing>) -> anyhow::Result<Self> {
        let PressingRun {
            asked,
            folder,
            about,
            file,
            begun,
        } = run;
        let wanted = places(&asked, &folder, &inputs, &sensing, begun)?;
        let on_wall = |place: &DVec3| on_wall(&sensing, *place);
        let planned: Vec<(DVec3, DVec3)> = wanted.iter().map(on_wall).collect();
        if !begun {
            about.write(&folder)?;
            bench_folder::write_plan(&folder, &planned)?;
        }
        let done = pressed(&folder)?;
        Ok(Self {
            left: (0..planned.len()).filter(|k| !done.contains(k)).collect(),
            places: planned,
            has_sensor: asked.machine.is_some() && file.machine.sensor.is_some(),
            meant_n: asked.force_n,
            folder,
            inputs,
            sensing,
        })
    }

    /// In a few words, for people.
    #[must_use]
    pub fn in_words(&self) -> Vec<String> {
        let (all, left) = (self.places.len(), self.left.len());
        let mut lines = vec![format!(
            "{} by hand, of about {} N each; how hard they are {}",
            plain::either(all, "press", "presses"),
            self.meant_n,
            if self.has_sensor {
                "is felt by a sensor"
            } else {
                "is told"
            }
        )];
        if left < all {
            let there = plain::either(all - left, "press is", "presses are");
            lines.push(format!(
                "{there} there already; places are those that it was begun with"
            ));
        }
        lines
    }

    /// Takes one press after another from a board, until all places are pressed or somebody stops; how many were taken.
    /// `orders` is asked for the next one when the one before was obeyed; with `ahead` forces may be said before their presses, one a
    /// place.
    ///
    /// # Errors
    /// Why nothing can be read or written.
    pub fn press_at(
        &self,
        board: Address,
        (orders, ahead): (&mut dyn FnMut() -> Option<HandOrder>, bool),
        mut tell: impl FnMut(HandSays),
    ) -> anyhow::Result<usize> {
        let live = &self.inputs.project.live;
        let settings = live.settings(self.sensing.gauges.len());
        let pipeline = Pipeline::new(self.sensing.map_for(live), settings);
        let part = bench_folder::next_part(&self.folder)?;
        let recorder = Recorder::create(&part).map_err(anyhow::Error::msg)?;
        let mut desk = HandDesk::new(self, recorder, ahead);
        let (_commands, inbox) = channel();
        let stop = AtomicBool::new(false);
        let ended = Listener::new(board, pipeline).run(&stop, &inbox, |event| {
            match event {
                SessionEvent::Hello(hello) => desk.recorder.hello(hello),
                // What was felt before is over, and its clock may begin anew.
                SessionEvent::State(state) if *state != ConnectionState::Live => {
                    desk.wait(&mut tell);
                }
                SessionEvent::Message(text) | SessionEvent::Trouble(text) => {
                    tell(HandSays::Board(text.to_owned()));
                }
                SessionEvent::Sample {
                    sample,
                    update,
                    pipeline,
                } if update.strain.is_some() => {
                    desk.prompt(&mut tell);
                    let (noise, used) = (pipeline.noise(), pipeline.used());
                    if let Some(news) = desk.presses.take(sample, update, noise, &used) {
                        desk.hear(news, &mut tell);
                    }
                }
                SessionEvent::Turn { .. } => desk.obey(orders, &mut tell),
                _ => {}
            }
            if desk.is_over() {
                stop.store(true, Ordering::Relaxed);
            }
        });
        desk.recorder.flush();
        ended.map_err(anyhow::Error::msg)?;
        match desk.recorder.failed.take() {
            Some(why) => Err(anyhow::Error::msg(why)),
            None => Ok(desk.taken),
        }
    }
}

/// The place (m) of the wall that is nearest to another, and its normal.
fn on_wall(sensing: &Sensing, place: DVec3) -> (DVec3, DVec3) {
    let wall = &sensing.drawn.map.mesh;
    let (at, _) = wall.index().nearest(place);
    (wall.point(at), wall.normal(at))
}

/// Goes through the places, and writes down what is read.
struct HandDesk<'a> {
    run: &'a HandRun,
    recorder: Recorder,
    presses: HandPresses,
    /// Which of the places that are left is next.
    at: usize,
    /// Which of them was asked for last.
    prompted: Option<usize>,
    /// A press that is over, until it is known how hard it was.
    over: Option<HandPress>,
    /// Where this one is pressed (m), if not where it was asked for.
    elsewhere: Option<DVec3>,
    /// What was said and not obeyed yet.
    order: Option<HandOrder>,
    /// Whether it may be said before its press.
    ahead: bool,
    /// What is pressed just now is of no place any more.
    passed: bool,
    taken: usize,
    stopped: bool,
}

impl<'a> HandDesk<'a> {
    fn new(run: &'a HandRun, recorder: Recorder, ahead: bool) -> Self {
        Self {
            run,
            recorder,
            presses: HandPresses::default(),
            at: 0,
            prompted: None,
            over: None,
            elsewhere: None,
            order: None,
            ahead,
            passed: false,
            taken: 0,
            stopped: false,
        }
    }

    fn is_over(&self) -> bool {
        self.stopped || self.recorder.failed.is_some() || self.at >= self.run.left.len()
    }

    fn prompt(&mut self, tell: &mut dyn FnMut(HandSays)) {
        if let Some(&number) = self.run.left.get(self.at)
            && self.prompted.replace(self.at) != Some(self.at)
        {
            let all = self.run.places.len();
            let done = all - self.run.left.len() + self.at;
            tell(HandSays::Press {
                number,
                which: done + 1,
                all,
                at: self.run.places[number].0,
            });
            // Both may have been there before it was asked for.
            if self.elsewhere.is_some() {
                tell(HandSays::Moved(self.elsewhere));
            }
            if self.over.is_some() && self.order.is_none() {
                tell(HandSays::HowHard);
            }
        }
    }

    /// Nothing can be pressed until there is a rest again.
    fn wait(&mut self, tell: &mut dyn FnMut(HandSays)) {
        (self.presses, self.passed) = (HandPresses::default(), false);
        if self.prompted.take().is_some() {
            tell(HandSays::Wait);
        }
    }

    fn hear(&mut self, news: HandNews, tell: &mut dyn FnMut(HandSays)) {
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
                    self.order = None;
                }
                tell(HandSays::Unsteady);
            }
            // Pressed again before it was said how hard the one before was: this one is meant.
            HandNews::Over(press) => {
                self.over = Some(press);
                if self.run.has_sensor {
                    self.write(None, tell);
                } else if self.order.is_none() {
                    tell(HandSays::HowHard);
                }
            }
        }
    }

    fn obey(
        &mut self,
        orders: &mut dyn FnMut() -> Option<HandOrder>,
        tell: &mut dyn FnMut(HandSays),
    ) {
        if self.order.is_none() {
            self.order = orders();
        }
        let Some(order) = self.order else { return };
        let force = match order {
            HandOrder::Stop => {
                self.stopped = true;
                return;
            }
            HandOrder::Skip => return self.go_on(),
            HandOrder::Elsewhere(place) => return self.move_to(place, tell),
            HandOrder::Force(force) => force,
            HandOrder::AsMeant => self.run.meant_n,
        };
        if self.run.has_sensor {
            self.order = None;
        } else if self.over.is_some() {
            self.write(Some(force), tell);
        } else if !self.ahead && !self.presses.is_felt() {
            self.order = None;
            tell(HandSays::NothingWaits);
        }
    }

    fn move_to(&mut self, place: Option<DVec3>, tell: &mut dyn FnMut(HandSays)) {
        self.order = None;
        let Some(place) = place else {
            self.elsewhere = None;
            return tell(HandSays::Moved(None));
        };
        let part = &self.run.inputs.part;
        if check_on_part(part, "place", std::iter::once(place)).is_err() {
            return tell(HandSays::OffTheWall(place));
        }
        let (at, _) = on_wall(&self.run.sensing, place);
        self.elsewhere = Some(at);
        tell(HandSays::Moved(self.elsewhere));
    }

    fn go_on(&mut self) {
        (self.over, self.order, self.elsewhere) = (None, None, None);
        self.passed = self.presses.is_felt();
        self.at += 1;
    }

    /// Writes down the press that is over, as the notes of a machine's presses are, with its force (N) where that is told.
    fn write(&mut self, force: Option<f64>, tell: &mut dyn FnMut(HandSays)) {
        let (Some(press), Some(&number)) = (self.over.take(), self.run.left.get(self.at)) else {
            return;
        };
        let mm = self.elsewhere.unwrap_or(self.run.places[number].0) * 1e3;
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

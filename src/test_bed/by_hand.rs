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
use crate::design::{Inputs, Sensing};
use crate::io::bench_folder;
use crate::link::{Address, ConnectionState, Listener, Recorder, SessionEvent};
use crate::live::{HandNews, HandPress, HandPresses, Pipeline};

/// What whoever presses may say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandOrder {
    /// How hard this press is (N).
    Force(f64),
    /// As hard as was meant.
    AsMeant,
    /// Leaves this place out for now.
    Skip,
    /// Ends the run; what was pressed is kept.
    Stop,
}

/// What whoever presses is told.
#[derive(Clone, Debug, PartialEq)]
pub enum HandSays {
    /// Where to press next: which of how many, and its place (m).
    Press(usize, usize, DVec3),
    /// It was read, and may be let go.
    LetGo,
    /// It is over, and how hard it was is not known yet.
    HowHard,
    /// It was not taken: it never stood still, or came before there was a rest.
    Unsteady,
    /// A force was written, and no press waits for one.
    NothingWaits,
    /// It is written down, with its force (N) where no sensor feels that.
    Taken(Option<f64>),
    /// What the board or the connection says.
    Board(String),
}

/// A run that can be pressed.
pub struct HandRun {
    /// Where it is written.
    pub folder: PathBuf,
    /// Where to press (m), by the number in the plan.
    pub places: Vec<DVec3>,
    /// Places that are still to be pressed.
    pub left: Vec<usize>,
    /// Whether a sensor feels how hard it is pressed.
    pub has_sensor: bool,
    /// How hard is meant (N).
    meant_n: f64,
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
        let surface = &sensing.drawn.map.mesh;
        let on_surface = |place: &DVec3| {
            let (at, _) = surface.index().nearest(*place);
            (surface.point(at), surface.normal(at))
        };
        let planned: Vec<(DVec3, DVec3)> = wanted.iter().map(on_surface).collect();
        if !begun {
            about.write(&folder)?;
            bench_folder::write_plan(&folder, &planned)?;
        }
        let done = pressed(&folder)?;
        Ok(Self {
            left: (0..planned.len()).filter(|k| !done.contains(k)).collect(),
            places: planned.into_iter().map(|(at, _)| at).collect(),
            has_sensor: asked.machine.is_some() && file.machine.sensor.is_some(),
            meant_n: asked.force_n,
            folder,
            inputs,
            sensing,
        })
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
                    (desk.presses, desk.passed) = (HandPresses::default(), false);
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
            tell(HandSays::Press(done + 1, all, self.run.places[number]));
        }
    }

    fn hear(&mut self, news: HandNews, tell: &mut dyn FnMut(HandSays)) {
        if self.passed {
            self.passed = news == HandNews::Read;
            return;
        }
        match news {
            HandNews::Read => tell(HandSays::LetGo),
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

    fn go_on(&mut self) {
        (self.over, self.order) = (None, None);
        self.passed = self.presses.is_felt();
        self.at += 1;
    }

    /// Writes down the press that is over, as the notes of a machine's presses are, with its force (N) where that is told.
    fn write(&mut self, force: Option<f64>, tell: &mut dyn FnMut(HandSays)) {
        let (Some(press), Some(&number)) = (self.over.take(), self.run.left.get(self.at)) else {
            return;
        };
        let mm = self.run.places[number] * 1e3;
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
        tell(HandSays::Taken(force));
        self.go_on();
    }
}

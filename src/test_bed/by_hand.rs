//! A run of presses that somebody makes by hand: no machine, one place after another, and how hard each was comes from a
//! sensor or from whoever pressed.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;

use glam::DVec3;

use super::hand_desk::{HandDesk, HandPlan, on_wall};
use super::hand_words::{HandSays, PressOrder};
use super::places::places;
use super::ready::pressed;
use super::run::PressingRun;
use crate::design::{Inputs, Sensing};
use crate::io::bench_folder;
use crate::link::{Address, ConnectionState, Listener, Recorder, SessionEvent};
use crate::live::Pipeline;
use crate::plain;

/// A run that can be pressed.
pub struct HandRun {
    /// Where it is written.
    pub folder: PathBuf,
    pub plan: HandPlan,
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
        let wall = Arc::clone(&sensing.drawn.map.mesh);
        let on_wall = |place: &DVec3| on_wall(&wall, *place);
        let planned: Vec<(DVec3, DVec3)> = wanted.iter().map(on_wall).collect();
        if !begun {
            about.write(&folder)?;
            bench_folder::write_plan(&folder, &planned)?;
        }
        let done = pressed(&folder)?;
        let plan = HandPlan {
            left: (0..planned.len()).filter(|k| !done.contains(k)).collect(),
            places: planned,
            has_sensor: asked.machine.is_some() && file.machine.sensor.is_some(),
            meant_n: asked.force_n,
            part: Arc::clone(&inputs.part),
            wall,
        };
        Ok(Self {
            folder,
            plan,
            inputs,
            sensing,
        })
    }

    /// In a few words, for people.
    #[must_use]
    pub fn in_words(&self) -> Vec<String> {
        let (all, left) = (self.plan.places.len(), self.plan.left.len());
        let mut lines = vec![format!(
            "{} by hand, of about {} N each; how hard they are {}",
            plain::either(all, "press", "presses"),
            self.plan.meant_n,
            if self.plan.has_sensor {
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
    /// `orders` is asked for the next one; with `ahead` forces may be said before their presses, one a place, and it is asked
    /// when the one before was obeyed.
    ///
    /// # Errors
    /// Why nothing can be read or written.
    pub fn press_at(
        &self,
        board: Address,
        (orders, ahead): (&mut dyn FnMut() -> Option<PressOrder>, bool),
        mut tell: impl FnMut(HandSays),
    ) -> anyhow::Result<usize> {
        let live = &self.inputs.project.live;
        let settings = live.settings(self.sensing.gauges.len());
        let pipeline = Pipeline::new(self.sensing.map_for(live), settings);
        let part = bench_folder::next_part(&self.folder)?;
        let recorder = Recorder::create(&part).map_err(anyhow::Error::msg)?;
        let mut desk = HandDesk::new(&self.plan, recorder, ahead);
        let (_commands, inbox) = channel();
        let stop = AtomicBool::new(false);
        let ended = Listener::new(board, pipeline).run(&stop, &inbox, |event| {
            if let Some(text) = event.words() {
                tell(HandSays::Board(text.into_owned()));
            }
            match event {
                SessionEvent::Hello(hello) => desk.recorder.hello(hello),
                // What was felt before is over, and its clock may begin anew.
                SessionEvent::State(state) if *state != ConnectionState::Live => {
                    desk.wait(&mut tell);
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
                SessionEvent::Turn { traffic, .. } => {
                    desk.recorder.temperature(traffic.temperature());
                    desk.obey(orders, &mut tell);
                }
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

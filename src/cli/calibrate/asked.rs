//! Asks for one press after another, and takes each as it comes.

use super::summary::PressRow;
use crate::cli::out;
use crate::inference::KnownPress;
use crate::io::points::AskedPoint;
use crate::live::{FinishedPress, LiveUpdate, Pipeline, Presses};
use crate::mesh::TriMesh;

/// What was asked for, and what came.
pub struct AskedPresses {
    points: Vec<AskedPoint>,
    taken: Vec<Option<FinishedPress>>,
    presses: Presses,
    /// Whether somebody is told where to press.
    prompts: bool,
    prompted: bool,
    said_read: bool,
    first_us: Option<u64>,
    /// Of each channel (strain).
    pub noise: Vec<f64>,
    /// The number of the board, in hexadecimal, where it has said one.
    pub board: Option<String>,
}

impl AskedPresses {
    /// For these points, in this order; or as their times say.
    pub fn new(points: Vec<AskedPoint>, prompts: bool) -> Self {
        Self {
            taken: vec![None; points.len()],
            points,
            presses: Presses::default(),
            prompts,
            prompted: false,
            said_read: false,
            first_us: None,
            noise: Vec::new(),
            board: None,
        }
    }

    /// Whether all points have been pressed.
    pub fn is_done(&self) -> bool {
        self.taken.iter().all(Option::is_some)
    }

    /// Takes in a sample.
    pub fn take(&mut self, update: &LiveUpdate, pipeline: &Pipeline) {
        let first = *self.first_us.get_or_insert(update.time_us);
        if update.strain.is_none() {
            return;
        }
        self.noise = pipeline.noise().to_vec();
        self.prompt();
        let over = (self.presses).push(update, pipeline.noise(), &pipeline.used());
        self.say_read();
        if let Some(pressed) = over {
            self.place(pressed, first);
        }
    }

    /// The next point that has not been pressed yet.
    fn next(&self) -> Option<usize> {
        self.taken.iter().position(Option::is_none)
    }

    fn prompt(&mut self) {
        let Some(k) = self.next().filter(|_| self.prompts && !self.prompted) else {
            return;
        };
        self.prompted = true;
        let p = self.points[k].position * 1e3;
        out::say(&format!(
            "press {} of {}: at ({:.1}, {:.1}, {:.1}) mm with {:.1} N, for a second; then let go",
            k + 1,
            self.points.len(),
            p.x,
            p.y,
            p.z,
            self.points[k].force.unwrap_or(0.0)
        ));
    }

    fn say_read(&mut self) {
        let (_, read) = self.presses.state();
        if read && self.prompts && !std::mem::replace(&mut self.said_read, true) {
            out::say("read: let go");
        }
    }

    /// A press that is over belongs to the point of its time, where these have any; otherwise to the next one.
    fn place(&mut self, pressed: FinishedPress, first_us: u64) {
        self.said_read = false;
        let seconds = |us: u64| us.saturating_sub(first_us) as f64 * 1e-6;
        let middle = f64::midpoint(seconds(pressed.from_us), seconds(pressed.until_us));
        let timed = self.points.iter().any(|p| p.during_s.is_some());
        let at = |point: &AskedPoint| {
            (point.during_s).is_some_and(|[from, until]| (from..=until).contains(&middle))
        };
        let which = if timed {
            self.points.iter().position(at)
        } else {
            self.next()
        };
        let Some(k) = which else {
            return;
        };
        if pressed.reading.is_none() && self.prompts {
            out::say(
                "it never stood still, and was not taken: press again, and hold it for a second",
            );
            self.prompted = false;
            return;
        }
        if self.taken[k].is_none() {
            self.taken[k] = Some(pressed);
            self.prompted = false;
        }
    }

    /// All that was asked for, with what was read on the part.
    pub fn rows(self, mesh: &TriMesh) -> Vec<PressRow> {
        let row = |(point, pressed): (AskedPoint, Option<FinishedPress>)| {
            let why = match &pressed {
                None => Some("nothing pressed then".to_owned()),
                Some(pressed) if pressed.reading.is_none() => {
                    Some("it never stood still for half a second".to_owned())
                }
                Some(_) => None,
            };
            let force = point.force.unwrap_or(0.0);
            let known = pressed.and_then(|p| p.reading).map(|reading| KnownPress {
                at: mesh.index().nearest(point.position).0,
                force,
                reading,
            });
            PressRow {
                place: point.position * 1e3,
                force,
                used: known.is_some(),
                known,
                misfit: None,
                why,
            }
        };
        self.points.into_iter().zip(self.taken).map(row).collect()
    }
}

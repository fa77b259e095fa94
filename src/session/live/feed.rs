//! What the listening thread leaves for the window.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::gathering::Gathering;
use crate::link::{ConnectionState, SessionEvent};
use crate::live::{Health, LiveNews, LiveUpdate, ShownEstimator, Traffic};
use crate::wire::Hello;

/// How long a trail lasts, and strips reach back (s).
const TRAIL_S: f64 = 1.2;
pub const STRIPS_S: f64 = 8.0;
/// Samples of a strip a second, and looks at the clockwork.
const STRIP_HZ: f64 = 60.0;
const LOOK: Duration = Duration::from_millis(400);
/// The most messages that wait for the window to show them.
const MESSAGES: usize = 50;
/// Between two pictures.
const FRAME: Duration = Duration::from_millis(16);

/// One of the last strains of all gauges.
pub struct Strip {
    pub seconds: f64,
    /// Lowest and highest since the one before (microstrain), a pair each gauge.
    pub range: Vec<(f32, f32)>,
}

/// A recording that is being written.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    pub path: PathBuf,
    pub samples: u64,
    pub bytes: u64,
}

/// Everything that is shown of a connection.
#[derive(Default)]
pub struct Feed {
    pub state: Option<ConnectionState>,
    pub hello: Option<Hello>,
    pub update: Option<LiveUpdate>,
    pub health: Vec<Health>,
    pub used: Vec<bool>,
    pub noise: Vec<f64>,
    pub taring: bool,
    pub tared: bool,
    pub rate: f64,
    pub traffic: Traffic,
    /// Half and 99 % of the samples were computed within so many microseconds.
    pub delays: Option<[f32; 2]>,
    pub trail: VecDeque<(f64, ShownEstimator, DVec3)>,
    pub strips: VecDeque<Strip>,
    pub recording: Option<Recording>,
    /// Where a simulated board is really touched (m, N).
    pub truth: Option<(DVec3, f64)>,
    pub messages: Vec<String>,
    /// What came to pass with the rest and the gauges, each thing once.
    pub news: Vec<LiveNews>,
    /// Why nothing that comes can be used.
    pub trouble: Option<String>,
    /// How it ended.
    pub ended: Option<Result<(), String>>,
    /// Whose trail is drawn.
    pub estimator: ShownEstimator,
    /// Known touches that are being read.
    pub gathering: Gathering,
    open: Option<Strip>,
    looked: Option<Instant>,
    drawn: Option<Instant>,
}

/// Shared with the listening thread.
pub type FeedShared = Arc<Mutex<Feed>>;

/// Takes in what happened on the line, and wakes the window when there is something to see.
pub fn hear(feed: &FeedShared, event: &SessionEvent, wake: &dyn Fn()) {
    let Ok(mut feed) = feed.lock() else {
        return;
    };
    let at_once = feed.take(event);
    let due = feed.drawn.is_none_or(|t| t.elapsed() >= FRAME);
    let seen = matches!(event, SessionEvent::Sample { .. });
    if at_once || (seen && due) {
        feed.drawn = Some(Instant::now());
        wake();
    }
}

impl Feed {
    /// Whether the window must show it at once.
    fn take(&mut self, event: &SessionEvent) -> bool {
        match event {
            SessionEvent::State(state) => {
                self.state = Some((*state).clone());
                if **state == ConnectionState::Waiting {
                    self.trouble = None;
                }
                if **state != ConnectionState::Live {
                    self.update = None;
                    self.trail.clear();
                }
                true
            }
            SessionEvent::Hello(hello) => {
                self.hello = Some((*hello).clone());
                true
            }
            SessionEvent::Sample {
                update, pipeline, ..
            } => {
                self.sample(update);
                self.taring = pipeline.is_taring();
                self.tared = pipeline.rest().is_some();
                if self.health != pipeline.health() {
                    self.health = pipeline.health().to_vec();
                    self.used = pipeline.used();
                }
                false
            }
            SessionEvent::Truth(touch) => {
                self.truth = *touch;
                false
            }
            // When it was recorded is nothing that is seen.
            SessionEvent::Clock { .. } => false,
            SessionEvent::Message(text) | SessionEvent::Unrecorded(text) => {
                self.say(text);
                true
            }
            SessionEvent::News(news) => {
                self.news.retain(|told| !news.follows(*told));
                self.news.push(*news);
                true
            }
            SessionEvent::Trouble(text) => {
                self.trouble = Some((*text).to_owned());
                self.say(text);
                true
            }
            SessionEvent::Turn {
                traffic,
                timing,
                pipeline,
                recorder,
            } => {
                if self.looked.is_some_and(|t| t.elapsed() < LOOK) {
                    return false;
                }
                self.looked = Some(Instant::now());
                (self.traffic, self.rate) = (*traffic, pipeline.rate);
                self.noise = pipeline.noise().to_vec();
                self.delays = timing
                    .quantile(0.5)
                    .zip(timing.quantile(0.99))
                    .map(|(a, b)| [a, b]);
                self.recording = recorder.map(|r| Recording {
                    path: r.path.clone(),
                    samples: r.samples,
                    bytes: r.bytes,
                });
                false
            }
        }
    }

    /// A board that talks without a pause does not fill the memory of a window that is not shown.
    fn say(&mut self, text: &str) {
        if self.messages.len() < MESSAGES {
            self.messages.push(text.to_owned());
        }
    }

    fn sample(&mut self, update: &LiveUpdate) {
        let now = update.time_us as f64 * 1e-6;
        // A clock that began anew.
        if self.strips.back().is_some_and(|s| s.seconds > now + 1.0) {
            self.strips.clear();
            self.trail.clear();
            self.open = None;
        }
        if let Some(guess) = update.by(self.estimator) {
            if self.trail.back().is_none_or(|(t, _, _)| now - t > 0.008) {
                self.trail.push_back((now, self.estimator, guess.position));
            }
        } else {
            self.trail.clear();
        }
        let estimator = self.estimator;
        self.trail
            .retain(|(t, e, _)| now - t < TRAIL_S && *e == estimator);
        if let Some(strain) = &update.strain {
            self.strip(now, strain);
            self.gathering.hear(update.time_us, strain, self.truth);
        }
        self.update = Some(update.clone());
    }

    fn strip(&mut self, now: f64, strain: &[f64]) {
        let values = strain.iter().map(|s| (s * 1e6) as f32);
        match &mut self.open {
            Some(open)
                if now - open.seconds < 1.0 / STRIP_HZ && open.range.len() == strain.len() =>
            {
                for ((low, high), v) in open.range.iter_mut().zip(values) {
                    (*low, *high) = (low.min(v), high.max(v));
                }
            }
            open => {
                let range = values.map(|v| (v, v)).collect();
                if let Some(done) = open.replace(Strip {
                    seconds: now,
                    range,
                }) {
                    self.strips.push_back(done);
                }
                while self
                    .strips
                    .front()
                    .is_some_and(|s| now - s.seconds > STRIPS_S)
                {
                    self.strips.pop_front();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn why_a_board_is_not_understood_stays_until_it_is_asked_anew() {
        let mut feed = Feed::default();
        assert!(feed.take(&SessionEvent::Trouble("version 2")));
        feed.take(&SessionEvent::State(&ConnectionState::Silent));
        assert_eq!(feed.trouble.as_deref(), Some("version 2"));
        feed.take(&SessionEvent::State(&ConnectionState::Waiting));
        assert_eq!(feed.trouble, None);
    }

    #[test]
    fn a_board_that_talks_without_a_pause_fills_no_memory() {
        let mut feed = Feed::default();
        for _ in 0..1000 {
            feed.take(&SessionEvent::Message("again"));
        }
        assert_eq!(feed.messages.len(), MESSAGES);
    }
}

//! Who presses a simulated board, when, where and how hard.

use std::ops::RangeInclusive;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::elasticity::Touch;

/// One press: the force rises, stays and falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// When it begins, on the board's clock (s).
    pub start_s: f64,
    /// How long it lasts, rise and fall included (s).
    pub duration_s: f64,
    /// With its largest force.
    pub touch: Touch,
}

/// How hard a press may be (N): what a finger hardly feels, and more than any robot bears.
pub const PRESSES: RangeInclusive<f64> = 0.001..=1e4;

/// A press as it was asked for: its place need not be on the part's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPress {
    /// When it begins, on the board's clock (s).
    pub start_s: f64,
    /// How long it lasts, rise and fall included (s).
    pub duration_s: f64,
    /// m.
    pub position: DVec3,
    /// The largest one (N).
    pub force: f64,
}

/// Presses in the order of their time.
#[derive(Clone, Debug)]
pub enum Script {
    /// These presses, once.
    Given(Vec<Press>),
    /// Places in the order given, again and again, with drawn forces and pauses.
    Random(Box<Random>),
}

/// Presses without end.
#[derive(Clone, Debug)]
pub struct Random {
    places: Vec<Touch>,
    forces: [f64; 2],
    rng: ChaCha8Rng,
    number: usize,
    press: Press,
}

/// Of rising and of falling.
const RAMP_S: f64 = 0.08;
/// Seconds before anything is touched, so that there is time for a tare.
const FIRST_S: f64 = 3.0;

impl Script {
    /// Presses at these places with forces between two (N).
    #[must_use]
    pub fn random(places: Vec<Touch>, forces: [f64; 2], seed: u64) -> Self {
        if places.is_empty() {
            return Self::Given(Vec::new());
        }
        let mut random = Random {
            press: Press {
                start_s: 0.0,
                duration_s: 0.0,
                touch: places[0],
            },
            places,
            forces,
            rng: ChaCha8Rng::seed_from_u64(seed),
            number: 0,
        };
        random.draw(FIRST_S);
        Self::Random(Box::new(random))
    }

    /// Puts off random presses, as somebody does who lets go until a listener knows the rest. A script that was given is
    /// kept to.
    pub fn leave_alone(&mut self, until_s: f64) {
        if let Self::Random(random) = self
            && random.press.start_s < until_s
        {
            random.draw(until_s);
        }
    }

    /// The press that is on at a time, by its number, with its force at that moment. Times must not fall.
    pub fn at(&mut self, seconds: f64) -> Option<(usize, Touch)> {
        let (number, press) = match self {
            Self::Given(presses) => {
                let on = |p: &Press| p.contains(seconds);
                let number = presses.iter().position(on)?;
                (number, presses[number])
            }
            Self::Random(random) => {
                while seconds >= random.press.start_s + random.press.duration_s {
                    let end = random.press.start_s + random.press.duration_s;
                    let pause = 0.4 + 0.6 * random.rng.random::<f64>();
                    random.draw(end + pause);
                }
                (random.number, random.press)
            }
        };
        let touch = Touch {
            force: press.touch.force * press.share(seconds),
            ..press.touch
        };
        (touch.force > 0.0).then_some((number, touch))
    }
}

impl Random {
    fn draw(&mut self, start_s: f64) {
        let place = self.places[self.number % self.places.len()];
        self.number += 1;
        let [low, high] = self.forces;
        let force = low + (high - low) * self.rng.random::<f64>();
        let duration_s = 0.6 + 0.8 * self.rng.random::<f64>();
        self.press = Press {
            start_s,
            duration_s,
            touch: Touch { force, ..place },
        };
    }
}

impl Press {
    fn contains(&self, seconds: f64) -> bool {
        seconds >= self.start_s && seconds < self.start_s + self.duration_s
    }

    /// Of the largest force at a time.
    fn share(&self, seconds: f64) -> f64 {
        let since = seconds - self.start_s;
        let ramp = RAMP_S.min(self.duration_s / 2.0).max(1e-9);
        let near = since.min(self.duration_s - since) / ramp;
        let t = near.clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }
}

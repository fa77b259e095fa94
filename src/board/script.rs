//! Who presses a simulated board, when, where and how hard.

use std::ops::RangeInclusive;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::as_made::made;
use crate::elasticity::{Push, Touch};
use crate::uncertainty::Making;

/// One press: the force rises, stays and falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScriptedPress {
    /// When it begins, on the board's clock (s).
    pub start_s: f64,
    /// How long it lasts, rise and fall included (s).
    pub duration_s: f64,
    /// With its largest force.
    pub touch: Touch,
    /// Of rising and of falling (s).
    pub ramp_s: f64,
    /// What pushes along the surface, over what presses: a vector along it, as long as the tangent of the tilt.
    pub aside: DVec3,
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
    /// Of rising and of falling (s).
    pub ramp_s: f64,
    /// How far off the upright it pushes, and towards where: from the part's up, over its left as one looks at it from
    /// outside (degrees).
    pub tilt_deg: f64,
    /// Towards where (degrees).
    pub towards_deg: f64,
    /// Of the tip or palm that spreads it (m); the project's where nothing is said.
    pub radius: Option<f64>,
}

/// Presses in the order of their time.
#[derive(Clone, Debug)]
pub enum PressScript {
    /// These presses, once.
    Given(Vec<ScriptedPress>),
    /// Places in the order given, again and again, with drawn forces and pauses.
    Random(Box<Random>),
    /// What a machine presses with just now, and how many pushes there were before it.
    Held(Option<Push>, usize),
}

/// Presses without end.
#[derive(Clone, Debug)]
pub struct Random {
    places: Vec<Touch>,
    drawn: RandomPresses,
    rng: ChaCha8Rng,
    /// Of how presses are made: where and how hard they press is the same whatever that is.
    of_making: ChaCha8Rng,
    number: usize,
    press: ScriptedPress,
}

/// What random presses are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomPresses {
    /// The smallest and the largest force (N).
    pub forces: [f64; 2],
    /// The shortest and the longest ramp (s), drawn evenly over the logarithm.
    pub ramps: [f64; 2],
    /// How far they may push aside (degrees), in any direction.
    pub tilt_deg: f64,
    /// How far off they are made beside that.
    pub making: Making,
}

impl RandomPresses {
    /// Presses with forces between two (N), made as far off as is usual.
    #[must_use]
    pub fn usual(forces: [f64; 2], making: Making) -> Self {
        Self {
            forces,
            ramps: [RAMP_S; 2],
            tilt_deg: 0.0,
            making,
        }
    }
}

/// Of rising and of falling (s), where nothing else is said.
pub const RAMP_S: f64 = 0.08;
/// Beside the seed of the script.
const OF_MAKING: u64 = 0x3a8e;
/// Seconds before anything is touched, so that there is time for a tare.
const FIRST_S: f64 = 3.0;

impl PressScript {
    /// Presses at these places, one after the other.
    #[must_use]
    pub fn random(places: Vec<Touch>, drawn: RandomPresses, seed: u64) -> Self {
        if places.is_empty() {
            return Self::Given(Vec::new());
        }
        let mut random = Random {
            press: ScriptedPress {
                start_s: 0.0,
                duration_s: 0.0,
                touch: places[0],
                ramp_s: RAMP_S,
                aside: DVec3::ZERO,
            },
            places,
            drawn,
            rng: ChaCha8Rng::seed_from_u64(seed),
            of_making: ChaCha8Rng::seed_from_u64(seed ^ OF_MAKING),
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

    /// A machine presses so from now on.
    pub fn hold(&mut self, push: Option<Push>) {
        if let Self::Held(held, number) = self
            && *held != push
        {
            (*held, *number) = (push, *number + 1);
        }
    }

    /// The presses that are on at a time, by their numbers, with their forces at that moment. Times must not fall.
    pub fn at(&mut self, seconds: f64) -> Vec<(usize, Push)> {
        match self {
            Self::Given(presses) => {
                let all = presses.iter().enumerate();
                all.filter_map(|(number, press)| Some((number, press.at(seconds)?)))
                    .collect()
            }
            Self::Random(random) => {
                while seconds >= random.press.start_s + random.press.duration_s {
                    let end = random.press.start_s + random.press.duration_s;
                    let pause = 0.4 + 0.6 * random.rng.random::<f64>();
                    random.draw(end + pause);
                }
                let push = random.press.at(seconds);
                push.map(|push| (random.number, push)).into_iter().collect()
            }
            Self::Held(held, number) => held.map(|push| (*number, push)).into_iter().collect(),
        }
    }
}

impl Random {
    fn draw(&mut self, start_s: f64) {
        let place = self.places[self.number % self.places.len()];
        self.number += 1;
        let [low, high] = self.drawn.forces;
        let force = low + (high - low) * self.rng.random::<f64>();
        let duration_s = 0.6 + 0.8 * self.rng.random::<f64>();
        self.press = ScriptedPress {
            start_s,
            duration_s,
            touch: Touch { force, ..place },
            ramp_s: RAMP_S,
            aside: DVec3::ZERO,
        };
        let [quick, slow] = self.drawn.ramps;
        if quick < slow {
            self.press.ramp_s = quick * (slow / quick).powf(self.rng.random::<f64>());
        } else {
            self.press.ramp_s = quick;
        }
        if self.drawn.tilt_deg > 0.0 {
            let tilt = self.drawn.tilt_deg * self.rng.random::<f64>();
            let towards = 360.0 * self.rng.random::<f64>();
            self.press.aside = aside(place.normal, DVec3::Z, tilt, towards);
        }
        self.press = self.press.made(&self.drawn.making, &mut self.of_making);
    }
}

/// What pushes along a surface with this outward normal, over what presses, where somebody pushes so far off the upright
/// (degrees) towards a direction (degrees, from `up` over the left).
#[must_use]
pub fn aside(normal: DVec3, up: DVec3, tilt_deg: f64, towards_deg: f64) -> DVec3 {
    let along = up.reject_from_normalized(normal);
    // Where the part's up stands on the surface any direction along it is as good.
    let up = along
        .try_normalize()
        .unwrap_or_else(|| normal.any_orthonormal_vector());
    let left = normal.cross(up);
    let (sine, cosine) = towards_deg.to_radians().sin_cos();
    (up * cosine + left * sine) * tilt_deg.to_radians().tan()
}

impl ScriptedPress {
    /// The same as it comes to be made.
    fn made(self, making: &Making, rng: &mut ChaCha8Rng) -> Self {
        let push = made(&self.touch, making, rng);
        let drag = push.force - Push::from(&self.touch).force;
        Self {
            touch: push.touch,
            aside: self.aside + drag / self.touch.force,
            ..self
        }
    }

    /// Its push at a time; nothing before and after it.
    fn at(&self, seconds: f64) -> Option<Push> {
        let force = self.touch.force * self.share(seconds);
        let touch = Touch {
            force,
            ..self.touch
        };
        (force > 0.0).then(|| Push {
            force: (self.aside - self.touch.normal) * force,
            touch,
        })
    }

    /// Of the largest force at a time: a hand presses and lets go with the least jerk (T. Flash and N. Hogan, J. Neuroscience 5,
    /// 1985).
    fn share(&self, seconds: f64) -> f64 {
        let since = seconds - self.start_s;
        if !(0.0..self.duration_s).contains(&since) {
            return 0.0;
        }
        let ramp = self.ramp_s.min(self.duration_s / 2.0).max(1e-9);
        let near = since.min(self.duration_s - since) / ramp;
        let t = near.clamp(0.0, 1.0);
        t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch(force: f64) -> Touch {
        Touch {
            position: DVec3::ZERO,
            normal: DVec3::X,
            force,
            tip_radius: 5e-3,
        }
    }

    fn press(start_s: f64, aside: DVec3) -> ScriptedPress {
        ScriptedPress {
            start_s,
            duration_s: 1.0,
            touch: touch(10.0),
            ramp_s: 0.002,
            aside,
        }
    }

    #[test]
    fn presses_that_overlap_are_on_together_with_their_own_ramps() {
        let mut script = PressScript::Given(vec![press(0.0, DVec3::ZERO), press(0.5, DVec3::ZERO)]);
        let on = |at: f64, script: &mut PressScript| -> Vec<usize> {
            script.at(at).iter().map(|(number, _)| *number).collect()
        };
        assert_eq!(on(0.25, &mut script), [0]);
        assert_eq!(on(0.75, &mut script), [0, 1]);
        assert_eq!(on(1.25, &mut script), [1]);
        assert!(script.at(1.5).is_empty());
        let rising = script.at(0.001)[0].1.touch.force;
        assert!((rising - 5.0).abs() < 1e-9, "{rising}");
    }

    #[test]
    fn a_push_leans_as_far_as_it_is_tilted_and_where_to() {
        // Outward is x, up is z: left, as one looks at the part, is -y.
        for (towards, direction) in [(0.0, DVec3::Z), (90.0, DVec3::NEG_Y), (180.0, DVec3::NEG_Z)] {
            let aside = aside(DVec3::X, DVec3::Z, 20.0, towards);
            let wanted = direction * 20.0_f64.to_radians().tan();
            assert!((aside - wanted).length() < 1e-12, "{aside}");
            let mut script = PressScript::Given(vec![press(0.0, aside)]);
            let push = script.at(0.5)[0].1;
            let off = push.force.angle_between(DVec3::NEG_X).to_degrees();
            assert!((off - 20.0).abs() < 1e-9, "{off}");
            assert_eq!(push.touch.force, 10.0);
        }
        // On top of the part, where up is no direction along the surface.
        let aside = aside(DVec3::Z, DVec3::Z, 45.0, 30.0);
        assert!((aside.length() - 1.0).abs() < 1e-12 && aside.z.abs() < 1e-12);
    }

    #[test]
    fn what_is_drawn_stays_within_what_was_asked() {
        let drawn = RandomPresses {
            forces: [2.0, 3.0],
            ramps: [0.002, 0.08],
            tilt_deg: 20.0,
            making: Making::EXACT,
        };
        let mut script = PressScript::random(vec![touch(1.0)], drawn, 7);
        let (mut most, mut seen) = (0.0_f64, 0);
        for k in 0..100_000 {
            for (_, push) in script.at(1e-3 * f64::from(k)) {
                most = most.max(push.force.angle_between(DVec3::NEG_X).to_degrees());
                assert!(push.touch.force <= 3.0);
                seen += 1;
            }
        }
        assert!(
            seen > 10_000 && (15.0..20.0).contains(&most),
            "{seen} {most}"
        );
    }

    #[test]
    fn presses_are_made_as_far_off_as_is_usual_and_no_others_are_drawn_for_it() {
        let drawn = |making: Making| {
            let script = PressScript::random(
                vec![touch(1.0)],
                RandomPresses::usual([2.0, 8.0], making),
                7,
            );
            let PressScript::Random(mut random) = script else {
                panic!()
            };
            let presses = (0..4000).map(|k| {
                random.draw(f64::from(k));
                random.press
            });
            presses.collect::<Vec<ScriptedPress>>()
        };
        let exact = drawn(Making::EXACT);
        let off = drawn(Making {
            tip: 0.5e-3,
            friction: 0.2,
        });
        let mean =
            |of: fn(&ScriptedPress) -> f64| off.iter().map(of).sum::<f64>() / off.len() as f64;
        let friction = mean(|p| p.aside.length_squared()).sqrt();
        let tip = mean(|p| (p.touch.tip_radius - 5e-3).powi(2)).sqrt();
        assert!((friction - 0.2).abs() < 0.01, "{friction}");
        assert!((tip - 0.5e-3).abs() < 0.02e-3, "{tip}");
        for (exact, off) in exact.iter().zip(&off) {
            assert_eq!(exact.aside, DVec3::ZERO);
            assert_eq!(exact.touch.force, off.touch.force);
            assert_eq!(
                (exact.start_s, exact.duration_s),
                (off.start_s, off.duration_s)
            );
        }
    }
}

//! A simulated board: the protocol byte for byte, driven by an elastic model finer than any estimator's.
//!
//! It has no clock and no port of its own: whoever runs it says what time it is and carries its bytes.

mod disturbance;
mod fault;
mod gain;
mod script;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::draw::normal;
use crate::elasticity::sensitivity::Sensitivity;
use crate::elasticity::{Push, Touch};
use crate::inference::Chain;
use crate::units;
use crate::wire::{Decoded, Decoder, Hello, VERSION, WireMessage, encode};

use disturbance::Disturbed;

pub use disturbance::Disturbances;
pub use fault::{ChannelFault, Fault, Faults, Illness};
pub use gain::{HardestUse, fitting_gain};
pub use script::{GivenPress, PRESSES, PressScript, RAMP_S, RandomPresses, ScriptedPress, aside};

/// How the board measures.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardOptions {
    /// Of noise, drift, gluing and random touches.
    pub seed: u64,
    /// Of the data at first (Hz).
    pub rate_hz: u16,
    /// From strain to counts.
    pub chain: Chain,
    /// Channels that the board has; those beyond the gauges read noise.
    pub channels: usize,
    /// Standard deviation of a reading (strain), and of what it drifts by in a second's walk.
    pub noise: f64,
    /// Standard deviation of the drift in a second (strain).
    pub drift: f64,
    /// Standard deviation of what bridges are off balance by (strain).
    pub offset: f64,
    /// What else there is in the readings beside touches.
    pub disturbances: Disturbances,
    /// Newtons a count of a force sensor, on the channel behind the gauges, where there is one.
    pub tip_n: Option<f64>,
    /// What the board calls itself in its HELLO.
    pub name: String,
}

/// What really happened at one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// On the board's clock (µs).
    pub time_us: u64,
    /// The touch at that moment, the hardest of several; absent where nothing touches.
    pub touch: Option<Touch>,
    /// How many there are.
    pub touches: usize,
    /// The force of all of them on the part (N), with what pushes along the surface.
    pub force: DVec3,
}

impl Truth {
    /// What touches at a time.
    #[must_use]
    pub fn of(time_us: u64, pushes: &[Push]) -> Self {
        let touches = pushes.iter().map(|push| push.touch);
        Self {
            time_us,
            touch: touches.max_by(|a, b| a.force.total_cmp(&b.force)),
            touches: pushes.len(),
            force: pushes.iter().map(|push| push.force).sum(),
        }
    }

    /// Where and how hard (m, N).
    #[must_use]
    pub fn place(&self) -> Option<(DVec3, f64)> {
        self.touch.map(|t| (t.position, t.force))
    }
}

/// The board between two calls.
pub struct SimulatedBoard {
    options: BoardOptions,
    faults: Faults,
    sensitivity: Sensitivity,
    gains: Vec<f64>,
    script: PressScript,
    offsets: Vec<f64>,
    drift: Vec<f64>,
    held: Vec<u32>,
    ears: Decoder,
    rng: ChaCha8Rng,
    sequence: u16,
    streaming: bool,
    rate_hz: u16,
    next_us: u64,
    next_hello_us: u64,
    disturbed: Disturbed,
    /// When it was read last (s).
    read_s: f64,
    /// Readings a newton of what presses, under each press that is on.
    pressed: Vec<(usize, Vec<f64>)>,
    /// Frames that nobody took.
    pub overruns: u32,
}

const SECOND_US: u64 = 1_000_000;
/// Between two HELLOs while nothing is sent, and between two STATUSes (µs).
const HELLO_EVERY: u64 = SECOND_US;
const STATUS_EVERY: u64 = 5_000_000;
/// Seconds after the first START of a listener in which random presses leave it alone: it takes its rest.
const REST_S: f64 = 2.0;
/// Beside the seed of what disturbs.
const DISTURBED: u64 = 0xd157;
/// The fastest that is simulated (Hz).
const FASTEST: u16 = 10_000;

impl SimulatedBoard {
    /// What stands between its strains and its counts.
    #[must_use]
    pub fn chain(&self) -> &Chain {
        &self.options.chain
    }

    /// A board whose gauges read `sensitivity`, with these gains.
    #[must_use]
    pub fn new(
        sensitivity: Sensitivity,
        gains: Vec<f64>,
        script: PressScript,
        options: BoardOptions,
        faults: Faults,
    ) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let offsets = (0..options.channels)
            .map(|_| options.offset * normal(&mut rng))
            .collect();
        // From a stream of their own: what else is drawn is as without them.
        let mut apart = ChaCha8Rng::seed_from_u64(options.seed ^ DISTURBED);
        let disturbed = Disturbed::new(options.disturbances, options.channels, &mut apart);
        Self {
            disturbed,
            read_s: 0.0,
            drift: vec![0.0; options.channels],
            held: vec![0; options.channels],
            rate_hz: options.rate_hz.clamp(1, FASTEST),
            offsets,
            options,
            faults,
            sensitivity,
            gains,
            script,
            ears: Decoder::default(),
            rng,
            sequence: 0,
            streaming: false,
            next_us: 0,
            next_hello_us: 0,
            pressed: Vec::new(),
            overruns: 0,
        }
    }

    /// What it says of itself.
    #[must_use]
    pub fn hello(&self) -> Hello {
        let chain = &self.options.chain;
        Hello {
            version: VERSION,
            board: 0x5151_0000 | (self.options.seed as u32 & 0xFFFF),
            channels: self.options.channels as u8,
            bits: chain.bits,
            reference_mv: units::thousandths(chain.reference_v) as u16,
            supply_mv: units::thousandths(chain.supply_v) as u16,
            gain_milli: units::thousandths(chain.gain) as u32,
            rate_hz: self.rate_hz,
            name: self.options.name.clone(),
        }
    }

    /// Whether the plug is out at a time.
    #[must_use]
    pub fn is_unplugged(&self, now_us: u64) -> bool {
        self.faults.is_unplugged(units::seconds(now_us))
    }

    /// Begins anew after the plug was out: nothing is sent until somebody asks.
    pub fn restart(&mut self, now_us: u64) {
        self.streaming = false;
        self.next_hello_us = now_us;
        self.ears.reset();
    }

    /// What presses from now on, where a machine does.
    pub fn press(&mut self, push: Option<Push>) {
        self.script.hold(push);
    }

    /// What goes wrong, to be changed while the board runs.
    pub fn faults_mut(&mut self) -> &mut Faults {
        &mut self.faults
    }

    /// Bytes from the studio.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64, out: &mut Vec<u8>) {
        let mut received = Vec::new();
        self.ears.push(bytes, |event| {
            if let Decoded::Message { message, .. } = event {
                received.push(message);
            }
        });
        for message in received {
            match message {
                WireMessage::AskHello => self.send(&WireMessage::Hello(self.hello()), now_us, out),
                WireMessage::Start => {
                    if !self.streaming {
                        let now_s = units::seconds(now_us);
                        self.script.leave_alone(now_s + REST_S);
                    }
                    self.streaming = true;
                    self.next_us = self.next_us.max(now_us);
                }
                WireMessage::Stop => {
                    self.streaming = false;
                    self.next_hello_us = now_us + HELLO_EVERY;
                }
                WireMessage::Rate(hertz) => {
                    self.rate_hz = hertz.clamp(1, FASTEST);
                    self.send(&WireMessage::Hello(self.hello()), now_us, out);
                }
                WireMessage::Ping(token) => self.send(&WireMessage::Pong(token), now_us, out),
                _ => {}
            }
        }
    }

    /// Everything that is to be sent until a time, with what really happened at each sample.
    pub fn say(&mut self, now_us: u64, out: &mut Vec<u8>, mut tell: impl FnMut(Truth)) {
        if !self.streaming {
            if now_us >= self.next_hello_us {
                self.next_hello_us = now_us + HELLO_EVERY;
                self.send(&WireMessage::Hello(self.hello()), now_us, out);
            }
            return;
        }
        while self.next_us <= now_us {
            let time_us = self.next_us;
            let (counts, pushes) = self.sample(time_us);
            self.send(&WireMessage::Data(counts), time_us, out);
            tell(Truth::of(time_us, &pushes));
            self.next_us += SECOND_US / u64::from(self.rate_hz);
            if time_us / STATUS_EVERY != self.next_us / STATUS_EVERY {
                let celsius = self.disturbed.temperature(units::seconds(time_us));
                let status = WireMessage::Status {
                    overruns: self.overruns,
                    temperature_centi: Some((100.0 * celsius).round() as i16),
                };
                self.send(&status, time_us, out);
            }
        }
    }

    fn send(&mut self, message: &WireMessage, time_us: u64, out: &mut Vec<u8>) {
        let mut frame = Vec::new();
        encode(
            message,
            self.sequence,
            time_us as u32,
            self.options.chain.bits,
            &mut frame,
        );
        self.sequence = self.sequence.wrapping_add(1);
        let data = matches!(message, WireMessage::Data(_));
        self.faults.spoil(&frame, data, &mut self.rng, out);
    }

    /// All channels at a time: strain, gain, what disturbs, noise, drift, offset, quantization, clipping.
    fn sample(&mut self, time_us: u64) -> (Vec<u32>, Vec<Push>) {
        let seconds = units::seconds(time_us);
        let pushes = self.script.at(seconds);
        let strains = self.felt(&pushes, seconds);
        let mut counts: Vec<u32> = (0..self.options.channels)
            .map(|c| self.count(c, strains[c], seconds))
            .collect();
        let pressing: f64 = pushes.iter().map(|(_, push)| push.touch.force).sum();
        if let Some(tip_n) = self.options.tip_n
            && let Some(count) = counts.get_mut(self.sensitivity.gauges())
        {
            *count = self.tip_count(pressing / tip_n);
        }
        (counts, pushes.into_iter().map(|(_, push)| push).collect())
    }

    /// What each channel feels (strain), before noise and converter.
    fn felt(&mut self, pushes: &[(usize, Push)], seconds: f64) -> Vec<f64> {
        let strain = self.strain(pushes);
        let step = (seconds - self.read_s).max(0.0);
        self.read_s = seconds;
        self.disturbed.pass(step);
        let mut felt: Vec<f64> = (0..self.options.channels)
            .map(|c| {
                let dead = self.faults.illness(c, seconds) == Some(Illness::Dead);
                let felt = strain.get(c).map_or(0.0, |s| s * self.gains[c]);
                let felt = if dead { 0.0 } else { felt };
                self.disturbed.felt(c, felt, seconds, step)
            })
            .collect();
        self.disturbed.mix(&mut felt);
        felt
    }

    /// What the converter makes of what a channel feels (strain).
    fn count(&mut self, c: usize, felt: f64, seconds: f64) -> u32 {
        /// Of an illness.
        const LOUDER: f64 = 40.0;
        let step = f64::from(self.rate_hz).sqrt().recip();
        self.drift[c] += self.options.drift * step * normal(&mut self.rng);
        let illness = self.faults.illness(c, seconds);
        let louder = if illness == Some(Illness::Noisy) {
            LOUDER
        } else {
            1.0
        };
        let noise = louder * self.options.noise * normal(&mut self.rng);
        let read = felt + self.offsets[c] + self.drift[c] + noise;
        let highest = self.options.chain.highest_count();
        let count = f64::from(highest) / 2.0 + read * self.options.chain.counts_per_strain();
        self.held[c] = match illness {
            Some(Illness::Stuck) => self.held[c],
            Some(Illness::Saturated) => highest,
            _ => count.round().clamp(0.0, f64::from(highest)) as u32,
        };
        self.held[c]
    }

    /// What the converter makes of a force sensor that is so many counts above its rest.
    fn tip_count(&mut self, above: f64) -> u32 {
        /// At rest, and its noise.
        const REST: f64 = 400.0;
        const NOISE: f64 = 0.6;
        let highest = f64::from(self.options.chain.highest_count());
        let count = REST + above + NOISE * normal(&mut self.rng);
        count.round().clamp(0.0, highest) as u32
    }

    /// Strains of the gauges; the readings a newton are worked out once a press.
    fn strain(&mut self, pushes: &[(usize, Push)]) -> Vec<f64> {
        self.pressed
            .retain(|(known, _)| pushes.iter().any(|(press, _)| press == known));
        let mut strains = vec![0.0; self.sensitivity.gauges()];
        for (press, push) in pushes {
            let force = push.touch.force;
            let known = self.pressed.iter().position(|(known, _)| known == press);
            let k = known.unwrap_or_else(|| {
                let of_one = Push {
                    force: push.force / force,
                    ..*push
                };
                let read = self.sensitivity.read_push(&of_one);
                self.pressed.push((*press, read));
                self.pressed.len() - 1
            });
            for (strain, per_newton) in strains.iter_mut().zip(&self.pressed[k].1) {
                *strain += per_newton * force;
            }
        }
        strains
    }
}

/// Draws the seed of a simulated board's script from its own.
#[must_use]
pub fn script_seed(seed: u64) -> u64 {
    ChaCha8Rng::seed_from_u64(seed ^ 0x5c21).random()
}

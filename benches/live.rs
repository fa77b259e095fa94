//! Live touch on a simulated board: `cargo bench --bench live` writes `benches/live.md`, which `RESULTS.md`
//! takes in. With `-- soak 30` it listens to a board with faults for so many minutes, and writes nothing; with `-- fast` it does only
//! what is of 4 kHz, and writes nothing either.

mod timing;

use std::fmt::Write as _;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Instant;

use glam::DVec3;
use hapdef::board::{BoardOptions, Faults, HardestUse, PressScript, RandomPresses};
use hapdef::budget::{Quality, unwatched};
use hapdef::design::simulated_board as board;
use hapdef::design::{self, Inputs, Sensing, Workshop};
use hapdef::elasticity::Touch;
use hapdef::elasticity::sensitivity::Sensitivity;
use hapdef::inference::{
    Deviations, Features, KnownPress, LiveLessons, Matching, ReadingErrors, ResponseMap,
    TrainedLive, calibrate, cramer_rao,
};
use hapdef::link::{
    Address, BAUD, ConnectionState, Doorway, Hosted, Listener, Pace, SessionEvent, host,
};
use hapdef::live::{Input, Pipeline, Receiver};
use hapdef::regression::Hyper;
use hapdef::uncertainty::{Gluing, HandPressing, Making, Uncertainty};
use hapdef::wire::{Hello, VERSION, WireMessage, encode};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use timing::{cpu_seconds, reference_seconds};

const FILE: &str = "benches/live.md";
const NOISE: f64 = 1e-6;
const SEED: u64 = 0;
/// The paper's intervals (N), its position and its amplitude errors.
const PAPER: [([f64; 2], &str, &str); 4] = [
    ([0.5, 4.9], "25.43 ± 13.36", "1.05 ± 1.01"),
    ([4.9, 9.8], "11.95 ± 11.85", "1.19 ± 1.19"),
    ([9.8, 19.6], "5.90 ± 7.79", "1.42 ± 1.78"),
    ([19.6, 34.3], "4.48 ± 6.29", "1.54 ± 2.21"),
];
/// From two newtons up, where the aims are set.
const FROM_TWO: [f64; 2] = [2.0, 4.9];
/// Touches of every interval, and draws of the noise for the rms of each.
const TOUCHES: usize = 400;
const DRAWS: usize = 8;
/// The gauge that fails (from 0).
const FAILED: usize = 6;

fn main() {
    let mut arguments = std::env::args().skip_while(|a| a != "soak").skip(1);
    if std::env::args().any(|a| a == "soak") {
        let minutes = arguments.next().and_then(|a| a.parse().ok());
        soak(minutes.unwrap_or(30.0));
        return;
    }
    if std::env::args().any(|a| a == "fast") {
        let mut text = String::new();
        process(&mut text, 4000, 10.0);
        let loaded = hapdef::cli::bundled().expect("the bundled limb");
        Lab::new(loaded.inputs).fast(&mut text);
        println!("{text}");
        return;
    }
    let mut text = String::from(
        "\n## Live touch\n\nRemade by `cargo bench --bench live` (three minutes on two cores). ",
    );
    let reference = reference_seconds();
    let _ = writeln!(
        text,
        "A 4000 × 4000 matrix product on one core took {reference:.1} s beside it. Data: the bundled limb with the ten gauges of its project, Standard quality, {TOUCHES} touches an interval drawn uniformly at random off the nodes with 12 < z < 108 mm (seed of the places: the project's plus 0x7e57), 1 microstrain of noise. The trained estimators have learned from 3200 other touches of the model, evenly spread, with forces from 0.5 to 34.3 N, noise, and (normalized) 3 % of gain jitter; C = 200 mm, ε = 0.1 mm, γ = 0.3.\n"
    );
    let loaded = hapdef::cli::bundled().expect("the bundled limb");
    let mut lab = Lab::new(loaded.inputs);
    lab.accuracy(&mut text);
    lab.speed(&mut text);
    frames(&mut text);
    process(&mut text, 1000, 5.0);
    process(&mut text, 4000, 10.0);
    lab.unplug(&mut text);
    lab.fast(&mut text);
    println!("{text}");
    std::fs::write(FILE, text).expect("the figures can be written");
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(rand_distr::StandardNormal)
}

/// The model, touches nobody has trained on, and what was trained.
struct Lab {
    inputs: Inputs,
    sensing: Sensing,
    touches: Vec<Touch>,
    /// With all gauges and with one failed: raw, normalized.
    trained: [[TrainedLive; 2]; 2],
}

/// Where readings come from, and what the estimators think of them.
struct Scene<'a> {
    name: &'a str,
    truth: &'a Sensitivity,
    gains: Vec<f64>,
    map: Arc<ResponseMap>,
    relative: f64,
    /// What gluing may put on the readings, where the estimator is told of it.
    deviations: Option<Deviations>,
}

/// Errors of one estimator: places (mm) and forces (N).
#[derive(Default)]
struct Off {
    place: Vec<f64>,
    force: Vec<f64>,
}

impl Off {
    fn push(&mut self, place: DVec3, force: f64, touch: &Touch) {
        self.place.push(place.distance(touch.position) * 1e3);
        self.force.push((force - touch.force).abs());
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn quartiles(values: &[f64]) -> String {
    let m = mean(values);
    let deviation = mean(&values.iter().map(|v| (v - m).powi(2)).collect::<Vec<_>>()).sqrt();
    format!("{m:.2} ± {deviation:.2}")
}

impl Lab {
    fn new(inputs: Inputs) -> Self {
        let sensing =
            design::sensing(&inputs, &Quality::Standard.budget(), &unwatched).expect("the model");
        let touches = sensing
            .touches(&inputs, 2 * TOUCHES, SEED + 0x7e57, false)
            .expect("touches");
        let inside = |t: &Touch| t.position.z > 12e-3 && t.position.z < 108e-3;
        let touches = touches.into_iter().filter(inside).take(TOUCHES).collect();
        let gauges = sensing.gauges.len();
        let all = vec![true; gauges];
        let mut one_failed = all.clone();
        one_failed[FAILED] = false;
        let trained = [all, one_failed].map(|used| train(&sensing, &inputs, &used));
        Self {
            inputs,
            sensing,
            touches,
            trained,
        }
    }

    fn scenes<'a>(
        &'a self,
        finer: &'a Sensitivity,
        built: &'a Sensitivity,
        gains: &[f64],
    ) -> Vec<Scene<'a>> {
        let drawn = &self.sensing.drawn.map;
        let none = vec![1.0; gains.len()];
        let scene = |name, truth, gains: &[f64], relative| Scene {
            name,
            truth,
            gains: gains.to_vec(),
            map: Arc::clone(drawn),
            relative,
            deviations: None,
        };
        let mut scenes = vec![
            scene(
                "Truth from the same mesh",
                &*self.sensing.sensitivity,
                &none,
                0.0,
            ),
            scene("Truth from elements of half the size", finer, &none, 0.03),
            scene("Half the size, gains off by 3 %", finer, gains, 0.05),
            Scene {
                deviations: Some(self.sensing.deviations.clone()),
                ..scene(
                    "Half the size; gains off by 3 %, places by 1 mm, directions by 3°",
                    built,
                    gains,
                    self.sensing.off.elements,
                )
            },
        ];
        let calibrated = [
            ("Half the size, gains off by 3 %, calibrated", finer),
            (
                "Half the size; gains, places and directions off, calibrated",
                built,
            ),
        ];
        for (name, truth) in calibrated {
            let found = self.calibrate(truth, gains);
            let map = Arc::new(self.sensing.drawn.calibrated(&found));
            scenes.push(Scene {
                name,
                truth,
                gains: gains.to_vec(),
                map,
                relative: found.relative,
                deviations: Some(
                    self.sensing
                        .drawn
                        .deviations_of(&found.doubts, &self.sensing.off),
                ),
            });
        }
        scenes
    }

    /// Twelve known touches of 10 N, evenly spread, each read for a tenth of a second.
    fn calibrate(&self, truth: &Sensitivity, gains: &[f64]) -> hapdef::inference::Calibration {
        let places = self
            .sensing
            .touches(&self.inputs, 12, 77, true)
            .expect("places");
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let known: Vec<KnownPress> = places
            .iter()
            .map(|t| KnownPress {
                at: self.sensing.drawn.map.mesh.index().nearest(t.position).0,
                force: 10.0,
                reading: read(
                    truth,
                    gains,
                    &Touch { force: 10.0, ..*t },
                    0.1 * NOISE,
                    &mut rng,
                ),
            })
            .collect();
        let off = Uncertainty {
            pressing: HandPressing::EXACT,
            ..self.sensing.off
        };
        calibrate(&self.sensing.drawn, &known, &vec![NOISE; gains.len()], &off)
    }

    fn accuracy(&self, text: &mut String) {
        let (finer, _) = self
            .sensing
            .reference(&self.inputs, &Gluing::EXACT, SEED, &unwatched)
            .expect("the truth");
        let (built, gains) = self
            .sensing
            .reference(&self.inputs, &Gluing::default(), SEED, &unwatched)
            .expect("the truth");
        let _ = writeln!(
            text,
            "The model has elements of {:.2} mm. “Held”: share of the touches within the 90 % region. “Bound”: rms over {DRAWS} draws of the noise over the Cramér–Rao bound (rms with rms), the median over the touches; only where the truth is the model itself does that bound bind. The model error is what matching was told to expect: nothing, 3 %, 5 %, and 20 % (the default for a part that is not calibrated); after twelve known touches of 10 N it is what they show.\n",
            self.sensing.element_mm
        );
        let scenes = self.scenes(&finer, &built, &gains);
        for scene in &scenes {
            self.table(text, scene, false);
        }
        let _ = writeln!(
            text,
            "With gauge {} failed (left out; the trained ones trained again):\n",
            FAILED + 1
        );
        for scene in [&scenes[0], &scenes[1], &scenes[5]] {
            self.table(text, scene, true);
        }
    }

    fn table(&self, text: &mut String, scene: &Scene, failed: bool) {
        let _ = writeln!(
            text,
            "**{}**{}, model error {:.1} %\n\n| force (N) | paper, 9 gauges (mm) | raw SVR | normalized SVR | matching | paper (N) | raw | normalized | matching | held | bound |\n|---|---|---|---|---|---|---|---|---|---|---|",
            scene.name,
            if failed { ", one gauge failed" } else { "" },
            100.0 * scene.relative
        );
        let intervals = PAPER.iter().map(|(f, p, a)| (*f, *p, *a));
        for (forces, place, amplitude) in intervals.chain([(FROM_TWO, "–", "–")]) {
            let row = self.row(scene, failed, forces);
            let [raw, normalized, matching] = &row.off;
            let _ = writeln!(
                text,
                "| {}–{} | {place} | {} | {} | **{}** | {amplitude} | {} | {} | **{}** | {:.0} % | {:.2} |",
                forces[0],
                forces[1],
                quartiles(&raw.place),
                quartiles(&normalized.place),
                quartiles(&matching.place),
                quartiles(&raw.force),
                quartiles(&normalized.force),
                quartiles(&matching.force),
                100.0 * row.held,
                row.bound
            );
        }
        text.push('\n');
    }

    fn row(&self, scene: &Scene, failed: bool, forces: [f64; 2]) -> Row {
        let gauges = scene.gains.len();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let errors = ReadingErrors {
            relative: scene.relative,
            deviations: scene.deviations.clone(),
            ..ReadingErrors::of_noise(NOISE, gauges)
        };
        let mut matching = Matching::new(Arc::clone(&scene.map), errors, 60.0);
        matching.used[FAILED] = !failed;
        let noise: Vec<f64> = matching
            .used
            .iter()
            .map(|u| if *u { NOISE } else { f64::INFINITY })
            .collect();
        let trained = &self.trained[usize::from(failed)];
        let mut off: [Off; 3] = Default::default();
        let (mut held, mut ratios) = (0, Vec::new());
        for touch in &self.touches {
            let force = forces[0] + (forces[1] - forces[0]) * rng.random::<f64>();
            let touch = Touch { force, ..*touch };
            let at = self
                .sensing
                .drawn
                .map
                .mesh
                .index()
                .nearest(touch.position)
                .0;
            let mut squares = 0.0;
            for draw in 0..DRAWS {
                let x = read(scene.truth, &scene.gains, &touch, NOISE, &mut rng);
                let contact = matching.find(&x);
                squares += contact.position.distance_squared(touch.position) / DRAWS as f64;
                if draw > 0 {
                    continue;
                }
                off[2].push(contact.position, contact.force, &touch);
                held += usize::from(contact.region.holds(contact.position, touch.position));
                for (off, estimator) in off.iter_mut().zip(trained) {
                    let (place, force) = estimator.find(&x);
                    off.push(DVec3::from_array(place) * 1e-3, force, &touch);
                }
            }
            let (bound, _) = cramer_rao(&self.sensing.drawn.map, at, force, &noise, &[]);
            ratios.push(squares.sqrt() / bound);
        }
        Row {
            off,
            held: held as f64 / self.touches.len() as f64,
            bound: median(&ratios),
        }
    }

    fn speed(&self, text: &mut String) {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let gains = vec![1.0; self.sensing.gauges.len()];
        let press = |t: &Touch, rng: &mut ChaCha8Rng| {
            read(
                &self.sensing.sensitivity,
                &gains,
                &Touch { force: 8.0, ..*t },
                NOISE,
                rng,
            )
        };
        let samples: Vec<Vec<f64>> = self.touches.iter().map(|t| press(t, &mut rng)).collect();
        let again: Vec<Vec<f64>> = self.touches.iter().map(|t| press(t, &mut rng)).collect();
        let errors = ReadingErrors {
            relative: 0.03,
            ..ReadingErrors::of_noise(NOISE, gains.len())
        };
        let mut matching = Matching::new(Arc::clone(&self.sensing.drawn.map), errors, 60.0);
        let contacts: Vec<_> = samples.iter().map(|x| matching.find(x)).collect();
        let [raw, normalized] = &self.trained[0];
        let everywhere = micros(samples.len(), |k| {
            std::hint::black_box(matching.find(&samples[k]));
        });
        let tracking = micros(samples.len(), |k| {
            std::hint::black_box(matching.track(&again[k], &contacts[k]));
        });
        let svr = [raw, normalized].map(|t| {
            micros(samples.len(), |k| {
                std::hint::black_box(t.find(&samples[k]));
            })
        });
        let _ = writeln!(
            text,
            "A sample on one core, processor time: raw SVR {:.1} µs ({} support vectors), normalized SVR {:.1} µs ({}), aim 20 µs; matching everywhere ({} templates) {everywhere:.0} µs, a touch that goes on {tracking:.0} µs, aim 100 µs.\n",
            svr[0],
            raw.support_vectors(),
            svr[1],
            normalized.support_vectors(),
            self.sensing.drawn.map.mesh.positions().len(),
        );
    }

    /// A board at a port of its own, glued by a workshop and touched at random by 2 to 15 N.
    fn touched_board(&self, options: BoardOptions, faults: Faults) -> Hosted {
        let places = board::places(&self.inputs, &self.sensing, SEED).expect("places");
        let script =
            PressScript::random(places, RandomPresses::usual([2.0, 15.0], Making::EXACT), 1);
        let asked = board::BoardRequest {
            workshop: Workshop::All,
            script,
            hardest: Some(HardestUse {
                force: 15.0,
                seconds: board::LASTS_S,
            }),
            options,
            faults,
        };
        let made = board::simulated(&self.inputs, &self.sensing, asked, &unwatched);
        let door = doorway().open().expect("a port");
        host(made.expect("the board"), door, |_| {}).expect("a thread")
    }

    /// How long after its byte a touch is known, twelve channels at 4 kHz, by the clock: with nothing else on the machine.
    fn fast(&mut self, text: &mut String) {
        const RATE_HZ: u16 = 4000;
        const CHANNELS: usize = 12;
        /// Until when it is watched (s of the board's time).
        const UNTIL: f64 = 25.0;
        let hosted = self.touched_board(
            BoardOptions {
                rate_hz: RATE_HZ,
                ..board::options(&self.inputs, CHANNELS)
            },
            Faults::default(),
        );
        let live = &self.inputs.project.live;
        let settings = live.settings(self.sensing.gauges.len());
        let pipeline = Pipeline::new(self.sensing.map_for(live), settings);
        let address = Address::parse(&hosted.port, BAUD, Pace::Real);
        let (_commands, inbox) = channel();
        let stop = AtomicBool::new(false);
        let (mut samples, mut touched, mut delays) = (0_u64, 0_u64, None);
        Listener::new(address, pipeline)
            .run(&stop, &inbox, |heard| match heard {
                SessionEvent::Sample { update, .. } => {
                    samples += 1;
                    touched += u64::from(update.contact.is_some());
                }
                SessionEvent::Turn { timing, .. } if hosted.seconds() > UNTIL => {
                    delays = timing.quantile(0.5).zip(timing.quantile(0.99));
                    stop.store(true, Ordering::Relaxed);
                }
                _ => {}
            })
            .expect("the board");
        let (half, most) = delays.unwrap_or_default();
        let _ = writeln!(
            text,
            "From byte to touch, {CHANNELS} channels at {RATE_HZ} Hz, touched in {:.0} % of {samples} samples, by the clock: half within {:.3} ms, 99 % within {:.3} ms (aim 2 ms).\n",
            100.0 * touched as f64 / samples.max(1) as f64,
            half / 1e3,
            most / 1e3
        );
    }

    /// A board that is unplugged three times, and how soon that is noticed and mended.
    fn unplug(&mut self, text: &mut String) {
        let mut faults = Faults::default();
        let plugs = [(4.0, 5.0), (8.0, 8.5), (12.0, 14.0)];
        faults.unplugged = plugs.to_vec();
        let options = board::options(&self.inputs, self.sensing.gauges.len());
        let hosted = self.touched_board(options, faults);
        let gauges = self.sensing.gauges.len();
        let live = &self.inputs.project.live;
        let pipeline = Pipeline::new(self.sensing.map_for(live), live.settings(gauges));
        let address = Address::parse(&hosted.port, BAUD, Pace::Real);
        let (_commands, inbox) = channel();
        let stop = AtomicBool::new(false);
        let (mut gone, mut back, mut delays) = (Vec::new(), Vec::new(), None);
        Listener::new(address, pipeline)
            .run(&stop, &inbox, |heard| match heard {
                SessionEvent::State(ConnectionState::Gone) => gone.push(hosted.seconds()),
                SessionEvent::State(ConnectionState::Live) => back.push(hosted.seconds()),
                SessionEvent::Turn { timing, .. } if hosted.seconds() > 17.0 => {
                    delays = timing.quantile(0.5).zip(timing.quantile(0.99));
                    stop.store(true, Ordering::Relaxed);
                }
                _ => {}
            })
            .expect("the board");
        let late = |seen: &[f64], at: &dyn Fn(&(f64, f64)) -> f64| {
            seen.iter()
                .zip(&plugs)
                .map(|(s, p)| s - at(p))
                .fold(0.0, f64::max)
        };
        let (noticed, mended) = (late(&gone, &|p| p.0), late(&back[1..], &|p| p.1));
        let (half, most) = delays.unwrap_or_default();
        let _ = writeln!(
            text,
            "Unplugged three times: noticed after {noticed:.2} s at most (aim 1 s), live again {mended:.2} s after the plug at most (aim 2 s). From byte to touch, 1 kHz, by the clock: half within {:.3} ms, 99 % within {:.3} ms (aim 2 ms).\n",
            half / 1e3,
            most / 1e3
        );
    }
}

struct Row {
    /// Raw, normalized, matching.
    off: [Off; 3],
    held: f64,
    bound: f64,
}

#[cfg(unix)]
fn doorway() -> Doorway {
    Doorway::Terminal
}

#[cfg(not(unix))]
fn doorway() -> Doorway {
    Doorway::Socket("127.0.0.1:0".into())
}

/// Processor microseconds of one of many.
fn micros(count: usize, mut work: impl FnMut(usize)) -> f64 {
    const ROUNDS: usize = 20;
    let before = cpu_seconds();
    for k in 0..ROUNDS * count {
        work(k % count);
    }
    (cpu_seconds() - before) * 1e6 / (ROUNDS * count) as f64
}

fn read(
    truth: &Sensitivity,
    gains: &[f64],
    touch: &Touch,
    noise: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<f64> {
    let clean = truth.read(touch);
    clean
        .iter()
        .zip(gains)
        .map(|(x, g)| x * g + noise * normal(rng))
        .collect()
}

fn train(sensing: &Sensing, inputs: &Inputs, used: &[bool]) -> [TrainedLive; 2] {
    let lesson = sensing.lessons(inputs, 3200, SEED).expect("lessons");
    let lessons = |jitter| LiveLessons {
        x: &lesson.x,
        places_mm: &lesson.places_mm,
        forces: &lesson.forces,
        used,
        noise: NOISE,
        jitter,
        seed: SEED,
    };
    let hyper = Hyper::default();
    [
        TrainedLive::train(Features::Raw, &lessons(0.0), &hyper),
        TrainedLive::train(Features::Normalized, &lessons(0.03), &hyper),
    ]
}

/// Ten million frames over a bad line: whatever comes out must be what went in.
fn frames(text: &mut String) {
    const FRAMES: u64 = 10_000_000;
    const CHANNELS: u64 = 12;
    const BAD: f64 = 1e-4;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut receiver = Receiver::default();
    let (mut wrong, mut seen, mut bytes, mut pending) = (0_u64, 0_u64, Vec::new(), Vec::new());
    // Counts that belong together, and to their time.
    let count = |k: u64, c: u64| {
        ((k.wrapping_mul(2_654_435_761).wrapping_add(c * 977) >> 7) & 0xFFF) as u32
    };
    let hello = Hello {
        version: VERSION,
        board: 1,
        channels: CHANNELS as u8,
        bits: 12,
        reference_mv: 3300,
        supply_mv: 5000,
        gain_milli: 330_000,
        rate_hz: 1000,
        name: String::new(),
    };
    encode(&WireMessage::Hello(hello), 0, 0, 12, &mut bytes);
    receiver.push(&bytes, 0, |_| {});
    let memory = resident_megabytes();
    let before = cpu_seconds();
    for k in 1..=FRAMES {
        bytes.clear();
        let counts = (0..CHANNELS).map(|c| count(k, c)).collect();
        encode(
            &WireMessage::Data(counts),
            k as u16,
            (k * 100) as u32,
            12,
            &mut bytes,
        );
        if rng.random::<f64>() < 1e-3 {
            pending.extend_from_slice(&bytes);
        }
        for &byte in &bytes {
            let drawn = rng.random::<f64>();
            if drawn < BAD {
                pending.push(byte ^ (1 << rng.random_range(0..8)));
            } else if drawn > BAD * 2.0 {
                pending.push(byte);
            }
        }
        // In pieces of any length.
        if pending.len() > 700 || k == FRAMES {
            receiver.push(&pending, 0, |input| {
                if let Input::Sample(sample) = input {
                    seen += 1;
                    let k = sample.time_us / 100;
                    let right =
                        (0..CHANNELS).all(|c| sample.counts[c as usize] == f64::from(count(k, c)));
                    wrong += u64::from(!right);
                }
            });
            pending.clear();
        }
    }
    let spent = cpu_seconds() - before;
    let traffic = receiver.traffic;
    let _ = writeln!(
        text,
        "{FRAMES} frames of 12 channels with bits turned over in 1e-4 of the bytes, 1e-4 of them left out and 1e-3 of the frames sent twice: {seen} shown, **{wrong} wrong**, {} refused, {} known to be lost; {:.1} MB more memory than before; {:.2} µs a frame for encoding, spoiling and decoding.\n",
        traffic.refused,
        traffic.lost,
        resident_megabytes() - memory,
        1e6 * spent / FRAMES as f64
    );
    assert_eq!(wrong, 0, "a wrong value was shown");
}

/// Resident memory (MB) of this process.
fn resident_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status
        .lines()
        .find(|l| l.starts_with("VmRSS"))
        .unwrap_or_default()
        .to_owned();
    line.split_whitespace()
        .nth(1)
        .and_then(|w| w.parse::<f64>().ok())
        .unwrap_or(0.0)
        / 1e3
}

/// A running program that ends with this.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start_board(more: &[&str]) -> (Running, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hapdef"));
    command
        .args(["board", "--simulate", "--quality", "draft"])
        .args(more);
    let mut board = Running(command.stdout(Stdio::piped()).spawn().expect("the board"));
    let mut line = String::new();
    let out = board.0.stdout.take().expect("its output");
    BufReader::new(out).read_line(&mut line).expect("its port");
    let port: serde_json::Value = serde_json::from_str(&line).expect("its port");
    (board, port["port"].as_str().expect("its port").to_owned())
}

/// Processor seconds of another process, of all its threads.
fn seconds_of(process: &Child) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.id())).unwrap_or_default();
    let ticks = |k: usize| {
        stat.rsplit(')')
            .next()
            .and_then(|s| s.split_whitespace().nth(k)?.parse::<f64>().ok())
    };
    (ticks(11).unwrap_or(0.0) + ticks(12).unwrap_or(0.0)) / 100.0
}

/// The program itself at a pseudo-terminal: twelve channels, pressed half of the time; the share of a core (%) that it may take.
fn process(text: &mut String, rate_hz: u16, aim: f64) {
    const SECONDS: f64 = 20.0;
    let (_board, port) = start_board(&["--channels", "12", "--rate", &rate_hz.to_string()]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_hapdef"));
    command.args(["listen", &port, "--quality", "draft"]);
    let mut listening = Running(
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the listener"),
    );
    let mut lines = BufReader::new(listening.0.stdout.take().expect("its output")).lines();
    let mut from = None;
    let (mut count, mut touched) = (0_u64, 0_u64);
    while let Some(Ok(line)) = lines.next() {
        let (begun, spent) =
            *from.get_or_insert_with(|| (Instant::now(), seconds_of(&listening.0)));
        count += 1;
        touched += u64::from(!line.contains("\"x_mm\":null"));
        let elapsed = begun.elapsed().as_secs_f64();
        if elapsed > SECONDS {
            let share = (seconds_of(&listening.0) - spent) / elapsed;
            let _ = writeln!(
                text,
                "`hapdef listen` at a pseudo-terminal, 12 channels at {rate_hz} Hz: {:.0} lines a second, touched in {:.0} % of them, **{:.1} % of a core** (aim {aim} %, with reading, matching and printing).\n",
                count as f64 / elapsed,
                100.0 * touched as f64 / count as f64,
                100.0 * share
            );
            return;
        }
    }
}

/// Listens to a board with all kinds of faults.
fn soak(minutes: f64) {
    let mut more: Vec<String> = [
        "--tcp",
        "127.0.0.1:0",
        "--flip",
        "1e-5",
        "--drop",
        "1e-5",
        "--duplicate",
        "1e-3",
        "--lose",
        "1e-3",
    ]
    .map(Into::into)
    .to_vec();
    let seconds = (minutes * 60.0) as u64;
    for at in (30..seconds).step_by(60) {
        more.extend(["--fault".into(), format!("unplug@{at}+1")]);
        more.extend(["--fault".into(), format!("dead:3@{}+8", at + 15)]);
        more.extend(["--fault".into(), format!("stuck:5@{}+8", at + 20)]);
    }
    let more: Vec<&str> = more.iter().map(String::as_str).collect();
    let (_board, port) = start_board(&more);
    let loaded = hapdef::cli::bundled().expect("the bundled limb");
    let sensing =
        design::sensing(&loaded.inputs, &Quality::Draft.budget(), &unwatched).expect("the model");
    let live = &loaded.inputs.project.live;
    let pipeline = Pipeline::new(sensing.map_for(live), live.settings(sensing.gauges.len()));
    let address = Address::parse(&port, BAUD, Pace::Real);
    let (_commands, inbox) = channel();
    let stop = AtomicBool::new(false);
    let begun = Instant::now();
    let before = cpu_seconds();
    let (mut early, mut unplugs, mut touched, mut left_out, mut last) =
        (None, 0, 0_u64, 0_u64, None);
    let mut backwards = 0;
    Listener::new(address, pipeline)
        .run(&stop, &inbox, |heard| match heard {
            SessionEvent::State(ConnectionState::Gone) => unplugs += 1,
            SessionEvent::Sample { update, .. } => {
                touched += u64::from(update.contact.is_some());
                left_out += u64::from(update.strain.is_some() && update.good < 10);
                backwards += u64::from(last.is_some_and(|l| update.time_us <= l));
                last = Some(update.time_us);
            }
            SessionEvent::Turn { traffic, timing, .. } => {
                if begun.elapsed().as_secs() >= 60 {
                    early.get_or_insert_with(resident_megabytes);
                }
                if begun.elapsed().as_secs() >= seconds {
                    println!(
                        "{minutes} minutes: {} samples, {} lost, {} refused, {unplugs} unplugs, touched in {touched}, a gauge left out in {left_out}, {backwards} out of order; 99 % within {:.2} ms; {:.1} MB after a minute, {:.1} MB at the end; {:.1} % of a core",
                        traffic.samples,
                        traffic.lost,
                        traffic.refused,
                        timing.quantile(0.99).unwrap_or(0.0) / 1e3,
                        early.unwrap_or(0.0),
                        resident_megabytes(),
                        100.0 * (cpu_seconds() - before) / begun.elapsed().as_secs_f64()
                    );
                    stop.store(true, Ordering::Relaxed);
                }
            }
            _ => {}
        })
        .expect("the board");
}

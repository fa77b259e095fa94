//! Live touch without any port or clock: a simulated board's bytes in, touches out.

use std::sync::{Arc, LazyLock};

use crate::gauges;
use hapdef::board::{
    ChannelFault, Faults, HardestUse, Illness, PressScript, RAMP_S, ScriptedPress, SimulatedBoard,
    Truth,
};
use hapdef::budget::{Quality, unwatched};
use hapdef::design::simulated_board as board;
use hapdef::design::{self, Inputs, Sensing, Workshop};
use hapdef::elasticity::Touch;
use hapdef::inference::calibration::noise_of_mean;
use hapdef::inference::{
    AsDrawn, AsGlued, Features, KnownPress, LiveLessons, Matching, ReadingErrors, ResponseMap,
    TrainedLive, calibrate, cramer_rao,
};
use hapdef::live::{Health, Input, LiveUpdate, Pipeline, Receiver};
use hapdef::regression::Hyper;
use hapdef::uncertainty::{HandPressing, Uncertainty};
use hapdef::wire::{WireMessage, encode};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NOISE: f64 = 1e-6;

pub struct Lab {
    pub inputs: Inputs,
    pub sensing: Sensing,
}

pub fn lab() -> &'static Lab {
    static LAB: LazyLock<Lab> = LazyLock::new(|| {
        let mut inputs = hapdef::cli::bundled().unwrap().inputs;
        inputs.project.selection.sites = gauges::sites();
        let sensing = design::sensing(&inputs, &Quality::Draft.budget(), &unwatched).unwrap();
        Lab { inputs, sensing }
    });
    &LAB
}

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(rand_distr::StandardNormal)
}

/// Touches away from the held ends.
pub fn touches(count: usize, seed: u64, force: f64) -> Vec<Touch> {
    let lab = lab();
    let all = lab
        .sensing
        .touches(&lab.inputs, 2 * count, seed, false)
        .unwrap();
    let inside = |t: &Touch| (12e-3..108e-3).contains(&t.position.z);
    all.into_iter()
        .filter(inside)
        .take(count)
        .map(|t| Touch { force, ..t })
        .collect()
}

fn noisy(clean: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
    clean.iter().map(|x| x + NOISE * normal(rng)).collect()
}

#[test]
fn matching_is_as_good_as_can_be() {
    let sensing = &lab().sensing;
    let gauges = sensing.gauges.len();
    let mut matching = Matching::new(
        Arc::clone(&sensing.drawn.map),
        ReadingErrors::of_noise(NOISE, gauges),
        60.0,
    );
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for force in [3.0, 12.0, 30.0] {
        let (mut ratios, mut held, mut tracked, mut of_force) = (Vec::new(), 0, 0, 0.0);
        let touches = touches(120, 5, force);
        for touch in &touches {
            let clean = sensing.sensitivity.read(touch);
            let mut squares = 0.0;
            for draw in 0..6 {
                let contact = matching.find(&noisy(&clean, &mut rng));
                squares += contact.position.distance_squared(touch.position) / 6.0;
                held += usize::from(
                    draw == 0 && contact.region.holds(contact.position, touch.position),
                );
                of_force += (contact.force / force - 1.0).abs() / (6.0 * touches.len() as f64);
                let next = noisy(&clean, &mut rng);
                if let Some(on) = matching.track(&next, &contact) {
                    tracked += 1;
                    let all = matching.find(&next);
                    assert!(
                        on.position.distance(all.position) < 1e-3
                            || on.unexplained <= all.unexplained + 20.0
                    );
                }
            }
            let at = sensing.drawn.map.mesh.index().nearest(touch.position).0;
            let (bound, _) = cramer_rao(&sensing.drawn.map, at, force, &vec![NOISE; gauges], &[]);
            ratios.push(squares.sqrt() / bound);
        }
        ratios.sort_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        assert!(
            (0.5..1.3).contains(&median),
            "{median} of the bound at {force} N"
        );
        let share = held as f64 / touches.len() as f64;
        assert!((0.8..0.98).contains(&share), "{share} held at {force} N");
        assert!(
            of_force < 0.05 && tracked > touches.len() * 4,
            "{of_force} {tracked}"
        );
    }
}

#[test]
fn the_trained_ones_learn() {
    let lab = lab();
    let lesson = lab.sensing.lessons(&lab.inputs, 1000, 0).unwrap();
    let used = vec![true; lab.sensing.gauges.len()];
    let lessons = LiveLessons {
        x: &lesson.x,
        places_mm: &lesson.places_mm,
        forces: &lesson.forces,
        used: &used,
        noise: NOISE,
        jitter: 0.03,
        seed: 0,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut error = |features| {
        let trained = TrainedLive::train(features, &lessons, &Hyper::default());
        let touches = touches(100, 6, 15.0);
        let off = |t: &Touch| {
            let (place, force) = trained.find(&noisy(&lab.sensing.sensitivity.read(t), &mut rng));
            let place = glam::DVec3::from_array(place).distance(t.position * 1e3);
            (place, (force / 15.0 - 1.0).abs())
        };
        let all: Vec<(f64, f64)> = touches.iter().map(off).collect();
        let mean = |k: fn(&(f64, f64)) -> f64| all.iter().map(k).sum::<f64>() / all.len() as f64;
        (mean(|o| o.0), mean(|o| o.1))
    };
    let (raw, normalized) = (error(Features::Raw), error(Features::Normalized));
    assert!(normalized.0 < 3.0 && normalized.1 < 0.1, "{normalized:?}");
    assert!(
        raw.0 < 25.0 && raw.1 < 0.4 && normalized.0 < raw.0,
        "{raw:?}"
    );
}

#[test]
fn known_touches_show_how_gauges_are_glued() {
    let lab = lab();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let glued: Vec<AsGlued> = (0..lab.sensing.gauges.len())
        .map(|_| {
            let mut draw = |s: f64| s * (2.0 * rng.random::<f64>() - 1.0);
            [1.0 + draw(0.05), draw(1.0), draw(1.0), draw(4.0)].into()
        })
        .collect();
    let real = lab.sensing.drawn.glued(&glued);
    let noise = vec![NOISE; glued.len()];
    let known: Vec<KnownPress> = touches(24, 8, 10.0)
        .iter()
        .map(|t| {
            let at = real.mesh.index().nearest(t.position).0;
            let clean: Vec<f64> = real.at(at).iter().map(|g| 10.0 * g).collect();
            KnownPress {
                at,
                force: 10.0,
                reading: (clean.iter().zip(noise_of_mean(&noise)))
                    .map(|(x, n)| x + n * normal(&mut rng))
                    .collect(),
            }
        })
        .collect();
    // Pressed by a machine, on the very model.
    let off = Uncertainty {
        pressing: HandPressing::EXACT,
        elements: 0.01,
        ..lab.sensing.off
    };
    let found = calibrate(&lab.sensing.drawn, &known, &noise, &off);
    assert!(found.relative < 0.02, "{}", found.relative);
    let fitted = lab.sensing.drawn.calibrated(&found);
    // What counts is what is read elsewhere.
    let mut before = 0.0;
    let mut after = 0.0;
    for t in touches(50, 9, 1.0) {
        let at = real.mesh.index().nearest(t.position).0;
        let off = |map: &hapdef::inference::ResponseMap| {
            let pairs = map.at(at).into_iter().zip(real.at(at));
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        before += off(&lab.sensing.drawn.map);
        after += off(&fitted);
    }
    assert!(after < 0.1 * before, "{after} against {before}");
}

/// A board without a port, and what a pipeline makes of it.
pub struct Bench {
    board: SimulatedBoard,
    receiver: Receiver,
    pipeline: Pipeline,
    now_us: u64,
}

impl Bench {
    pub fn new(script: PressScript, faults: Faults, drift: f64) -> Self {
        let lab = lab();
        let gauges = lab.sensing.gauges.len();
        let mut options = board::options(&lab.inputs, gauges);
        options.drift = drift;
        let asked = board::BoardRequest {
            workshop: Workshop::Exact,
            script,
            hardest: Some(HardestUse {
                force: 10.0,
                seconds: board::LASTS_S,
            }),
            options,
            faults,
        };
        let board = board::simulated(&lab.inputs, &lab.sensing, asked, &unwatched);
        let mut settings = lab.inputs.project.live.settings(gauges);
        settings.relative = 0.05;
        let pipeline = Pipeline::new(Arc::clone(&lab.sensing.drawn.map), settings);
        Self {
            board: board.unwrap(),
            receiver: Receiver::default(),
            pipeline,
            now_us: 0,
        }
    }

    /// Runs so many milliseconds and tells of every sample, with what really happened.
    pub fn run(&mut self, milliseconds: u64, mut tell: impl FnMut(&Pipeline, LiveUpdate, Truth)) {
        let mut to_board = Vec::new();
        encode(&WireMessage::AskHello, 0, 0, 12, &mut to_board);
        encode(&WireMessage::Start, 1, 0, 12, &mut to_board);
        for _ in 0..milliseconds {
            let (mut bytes, mut truths) = (Vec::new(), Vec::new());
            self.board
                .receive(&std::mem::take(&mut to_board), self.now_us, &mut bytes);
            self.board.say(self.now_us, &mut bytes, |t| truths.push(t));
            let pipeline = &mut self.pipeline;
            self.receiver
                .push(&bytes, self.now_us, |input| match input {
                    Input::Hello(hello) => {
                        pipeline.hello(&hello);
                        if pipeline.rest().is_none() {
                            pipeline.tare();
                        }
                    }
                    Input::Sample(sample) => {
                        let update = pipeline.push(&sample);
                        if let Some(truth) = truths.iter().find(|t| t.time_us == sample.time_us) {
                            tell(pipeline, update, *truth);
                        }
                    }
                    _ => {}
                });
            self.now_us += 1000;
        }
    }
}

pub fn press(number: usize, force: f64, start_s: f64, duration_s: f64) -> ScriptedPress {
    ScriptedPress {
        start_s,
        duration_s,
        touch: touches(40, 11, force)[number],
        ramp_s: RAMP_S,
        aside: glam::DVec3::ZERO,
    }
}

#[test]
fn nothing_is_felt_where_nothing_touches() {
    // Ten times the usual drift, for two minutes.
    let mut bench = Bench::new(PressScript::Given(Vec::new()), Faults::default(), 1e-6);
    let (mut felt, mut samples) = (0, 0);
    bench.run(120_000, |pipeline, update, _| {
        samples += 1;
        felt += usize::from(update.contact.is_some());
        assert!(
            pipeline.health().iter().all(|h| h.is_good()),
            "{:?}",
            pipeline.health()
        );
    });
    assert!(samples > 119_000 && felt == 0, "{felt} of {samples}");
}

#[test]
fn a_failed_gauge_is_found_and_done_without() {
    let presses: Vec<ScriptedPress> = (0..20)
        .map(|k| press(k, 9.0, 2.0 + f64::from(k as u32), 0.7))
        .collect();
    for (illness, named) in [
        (Illness::Dead, Health::Dead),
        (Illness::Stuck, Health::Stuck),
        (Illness::Saturated, Health::OffScale),
        (Illness::Noisy, Health::Noisy),
    ] {
        let mut faults = Faults::default();
        faults.channels.push(ChannelFault {
            channel: 4,
            illness,
            from_s: 6.0,
            until_s: f64::INFINITY,
        });
        let mut bench = Bench::new(PressScript::Given(presses.clone()), faults, 0.0);
        let (mut found_at, mut errors) = (None, Vec::new());
        bench.run(22_000, |pipeline, update, truth| {
            for (k, health) in pipeline.health().iter().enumerate() {
                assert!(
                    health.is_good() || k == 4,
                    "{illness:?}: gauge {k} is {health:?}"
                );
            }
            let seconds = truth.time_us as f64 * 1e-6;
            if pipeline.health()[4] == named {
                assert!(seconds >= 6.0);
                found_at.get_or_insert(seconds);
            }
            if let (Some(_), Some(touch)) = (found_at, truth.touch)
                && touch.force == 9.0
                && pipeline.health()[4] == named
                && update.contact.is_some()
            {
                errors.push(update.contact.unwrap().position.distance(touch.position) * 1e3);
            }
        });
        let at = found_at.unwrap_or(f64::INFINITY);
        let late = if illness == Illness::Dead { 20.0 } else { 7.0 };
        assert!(at < late, "{illness:?} was found at {at} s");
        errors.sort_by(f64::total_cmp);
        let median = errors[errors.len() / 2];
        assert!(
            errors.len() > 500 && median < 3.0,
            "{illness:?}: {median} mm of {}",
            errors.len()
        );
    }
}

#[test]
fn the_same_on_any_number_of_threads() {
    let lab = lab();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let sensing =
                design::sensing(&lab.inputs, &Quality::Draft.budget(), &unwatched).unwrap();
            let mut matching = Matching::new(
                Arc::clone(&sensing.drawn.map),
                ReadingErrors::of_noise(NOISE, 10),
                60.0,
            );
            touches(20, 4, 6.0)
                .iter()
                .map(|t| matching.find(&sensing.sensitivity.read(t)))
                .collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}

/// A model that is only pressed where presses were says of them what one says that is pressed everywhere.
#[test]
fn pressed_at_some_places_a_model_says_there_what_it_says_everywhere() {
    let Lab { inputs, sensing } = lab();
    // A corner and the middle of a side, too: either triangle is the nearest there.
    let [a, b, _] = sensing.drawn.map.mesh.corners(700);
    let places = touches(6, 5, 1.0).into_iter().map(|t| t.position);
    let places: Vec<_> = places.chain([a, a.midpoint(b)]).collect();
    let budget = Quality::Draft.budget();
    let near = design::drawn_at(inputs, &budget, &places, &unwatched).unwrap();
    let whole = &sensing.drawn;
    assert!(8 * near.map.mesh.triangles().len() < whole.map.mesh.triangles().len());
    let said = |of: &AsDrawn| -> Vec<Vec<f64>> {
        let maps = std::iter::once(&of.map).chain(&of.tip).map(|map| &**map);
        let maps = maps.chain(&of.changes).chain(of.axes.as_deref().unwrap());
        let at = |map: &ResponseMap, place| map.at(map.mesh.index().nearest(place).0);
        let slope = |map: &ResponseMap, place| {
            let slope = map.slope(map.mesh.index().nearest(place).0);
            let change = slope.change.iter().map(|by| by.length());
            change.collect::<Vec<f64>>()
        };
        maps.flat_map(|map| {
            let read = places.iter().map(move |&place| at(map, place));
            read.chain(places[..6].iter().map(move |&place| slope(map, place)))
        })
        .collect()
    };
    for (near, whole) in said(&near).iter().zip(said(whole)) {
        let largest = whole.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (here, there) in near.iter().zip(whole) {
            assert!((here - there).abs() < 1e-9 * largest, "{here} {there}");
        }
    }
}

//! Live touch while channels drift, creep and hum: an independent board, made sample by sample.

use std::f64::consts::TAU;
use std::sync::Arc;

use hapdef::elasticity::Touch;
use hapdef::inference::Chain;
use hapdef::live::{LiveUpdate, Pipeline, Sample};
use hapdef::wire::{Hello, VERSION};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::inference::{lab, normal, touches};

/// What a workshop does to a board (strain, seconds, Hz).
#[derive(Clone, Copy)]
pub struct World {
    pub rate: f64,
    bits: u8,
    noise: f64,
    /// A second, of all channels, and how much it differs among them.
    drift: f64,
    uneven: f64,
    /// A second's walk of each channel.
    walk: f64,
    hum: f64,
    hum_hz: f64,
    /// When it begins (s).
    hums_from: f64,
    /// By how much its frequency wanders (Hz) in twenty seconds.
    wanders_hz: f64,
    /// Share of a force by which a hand trembles.
    trembles: f64,
    /// Share of a load that is read in addition after a long while.
    creep: f64,
    /// Which gauge jumps when a press has gone, and by how much.
    jumps: (usize, f64),
}

pub const CALM: World = World {
    rate: 1000.0,
    bits: 16,
    noise: 1e-6,
    drift: 0.0,
    uneven: 0.0,
    walk: 0.1e-6,
    hum: 0.0,
    hum_hz: 50.0,
    hums_from: 0.0,
    wanders_hz: 0.0,
    trembles: 0.0,
    creep: 0.0,
    jumps: (0, 0.0),
};

impl World {
    pub fn that_jumps(gauge: usize, by: f64) -> Self {
        let jumps = (gauge, by);
        Self { jumps, ..CALM }
    }
}

/// From, for how long (s), rising within (s).
pub struct Press {
    pub touch: Touch,
    pub from: f64,
    pub lasts: f64,
    pub ramp: f64,
}

impl Press {
    pub fn share(&self, now: f64) -> f64 {
        let since = now - self.from;
        let near = since.min(self.lasts - since) / self.ramp;
        let x = near.clamp(0.0, 1.0);
        // With the least jerk.
        x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x)
    }
}

/// Runs a board for so many seconds; tells of every sample what touched, of several touches the first.
pub fn run(
    world: World,
    presses: &[Press],
    seconds: f64,
    mut tell: impl FnMut(f64, &LiveUpdate, Option<&Press>),
) {
    /// Seconds in which creep comes.
    const CREEPS_S: f64 = 6.0;
    /// When a gauge jumps (s).
    const JUMPS_S: f64 = 10.25;
    let lab = lab();
    let gauges = lab.sensing.gauges.len();
    let chain = Chain {
        gain: 100.0,
        bits: world.bits,
        ..Chain::default()
    };
    let mut settings = lab.inputs.project.live.settings(gauges);
    settings.relative = 0.02;
    let mut pipeline = Pipeline::new(Arc::clone(&lab.sensing.drawn.map), settings);
    pipeline.hello(&Hello {
        version: VERSION,
        board: 7,
        channels: gauges as u8,
        bits: chain.bits,
        reference_mv: 3300,
        supply_mv: 5000,
        gain_milli: 100_000,
        rate_hz: world.rate as u16,
        name: "a board".into(),
    });
    pipeline.tare();
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let read: Vec<Vec<f64>> = (presses.iter())
        .map(|p| lab.sensing.sensitivity.read(&p.touch))
        .collect();
    let uneven: Vec<f64> = (0..gauges)
        .map(|_| 1.0 + world.uneven * normal(&mut rng))
        .collect();
    let phases: Vec<f64> = (0..gauges).map(|_| rng.random::<f64>()).collect();
    let (mut walked, mut crept) = (vec![0.0; gauges], vec![0.0; gauges]);
    let highest = f64::from(chain.highest_count());
    for k in 0..(seconds * world.rate) as u64 {
        let now = k as f64 / world.rate;
        let on = presses.iter().position(|p| p.share(now) > 0.0);
        let load = |c: usize| -> f64 {
            let all = presses.iter().zip(&read);
            let trembling = 1.0 + world.trembles * (TAU * 8.3 * now).sin();
            trembling * all.map(|(p, read)| p.share(now) * read[c]).sum::<f64>()
        };
        let counts = (0..gauges)
            .map(|c| {
                walked[c] += world.walk / world.rate.sqrt() * normal(&mut rng);
                crept[c] += (world.creep * load(c) - crept[c]) / (CREEPS_S * world.rate);
                let wandered = world.wanders_hz * 20.0 * (TAU * now / 20.0).sin() / TAU;
                let hum = (TAU * (world.hum_hz * now + wandered + phases[c])).sin();
                let hum = if now < world.hums_from {
                    0.0
                } else {
                    world.hum * hum
                };
                let (gauge, by) = world.jumps;
                let jumped = c == gauge && now > JUMPS_S;
                let strain = load(c)
                    + if jumped { by } else { 0.0 }
                    + crept[c]
                    + walked[c]
                    + world.drift * uneven[c] * now
                    + hum
                    + world.noise * normal(&mut rng);
                let count = 0.4 * highest + strain * chain.counts_per_strain();
                count.round().clamp(0.0, highest)
            })
            .collect();
        let sample = Sample {
            time_us: (now * 1e6) as u64,
            counts,
        };
        let update = pipeline.push(&sample);
        tell(now, &update, on.map(|p| &presses[p]));
    }
}

/// What became of touches.
#[derive(Debug, Default)]
struct Seen {
    /// Samples, and those with the touch shown, while something pressed with all its force.
    pressed: f64,
    shown: f64,
    /// Sum of errors (mm, N).
    off: f64,
    off_n: f64,
    /// Samples shown 0.3 s after a press and later, and how often that began.
    ghosts: f64,
    ghost_events: u32,
    rested: f64,
}

impl Seen {
    fn of(world: World, presses: &[Press], seconds: f64) -> Self {
        let mut seen = Self::default();
        let (mut released, mut ghost) = (0.0, false);
        run(world, presses, seconds, |now, update, press| {
            if let Some(press) = press {
                released = now;
                if press.share(now) < 1.0 || now < press.from + press.ramp + 0.1 {
                    return;
                }
                seen.pressed += 1.0;
                if let Some(contact) = update.contact {
                    seen.shown += 1.0;
                    seen.off += contact.position.distance(press.touch.position) * 1e3;
                    seen.off_n += (contact.force - press.touch.force).abs();
                }
            } else if now > released + 0.3 {
                seen.rested += 1.0;
                let shown = update.contact.is_some();
                seen.ghosts += f64::from(u8::from(shown));
                seen.ghost_events += u32::from(shown && !ghost);
                ghost = shown;
            }
        });
        println!(
            "shown {:.4} of {}, {:.2} mm, {:.2} N off; ghosts {} ({} times) of {}",
            seen.shown / seen.pressed,
            seen.pressed,
            seen.off / seen.shown,
            seen.off_n / seen.shown,
            seen.ghosts,
            seen.ghost_events,
            seen.rested
        );
        seen
    }
}

pub fn press(number: usize, force: f64, from: f64, lasts: f64) -> Press {
    Press {
        touch: touches(40, 11, force)[number],
        from,
        lasts,
        ramp: 0.08,
    }
}

#[test]
fn a_standing_touch_outlives_a_drift() {
    let mut all = Vec::new();
    let mut stand = |world: World, number: usize, seconds: f64, rate: f64| {
        let World { drift, uneven, .. } = world;
        print!("{drift:e} {uneven} press {number}, {seconds} s: ");
        let press = press(number, 1.0, 20.0, seconds);
        all.push(Seen::of(World { rate, ..world }, &[press], seconds + 26.0));
    };
    for (drift, uneven) in [(0.0, 0.0), (2e-6, 0.0), (2e-6, 0.1)] {
        let world = World {
            drift,
            uneven,
            ..CALM
        };
        for number in [0, 3, 5, 9] {
            stand(world, number, 120.0, 250.0);
        }
        if uneven == 0.0 {
            for (number, bits) in [(0, 12), (3, 16), (5, 16), (9, 12)] {
                stand(World { bits, ..world }, number, 600.0, 100.0);
            }
        }
    }
    for seen in &all {
        assert!(
            seen.shown > 0.99 * seen.pressed && seen.ghosts == 0.0,
            "{seen:?}"
        );
    }
    // The ways of a touch to be another one are those of when it came: where they are taken anew, ten minutes are 5 mm off.
    let (still, drifting) = all.split_at(8);
    let within = |all: &[Seen], mm: f64| all.iter().all(|seen| seen.off < mm * seen.shown);
    assert!(within(still, 1.0) && within(drifting, 3.5), "{all:?}");
}

#[test]
fn slow_boards_are_followed_too() {
    for rate in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0] {
        print!("{rate} Hz: ");
        let world = World {
            rate,
            drift: 0.5e-6,
            ..CALM
        };
        let presses = [press(3, 3.0, 60.0, 200.0)];
        let seen = Seen::of(world, &presses, 400.0);
        assert!(
            seen.shown > 0.98 * seen.pressed && seen.ghosts == 0.0 && seen.off_n < 0.6 * seen.shown,
            "{seen:?}"
        );
    }
}

#[test]
fn light_touches_are_felt_under_any_drift() {
    let mut all = Vec::new();
    for (drift, uneven) in [
        (0.0, 0.0),
        (2e-6, 0.0),
        (5e-6, 0.0),
        (5e-6, 0.1),
        (-5e-6, 0.3),
    ] {
        let world = World {
            drift,
            uneven,
            ..CALM
        };
        let at = |k: usize| 4.0 + 2.0 * k as f64;
        let presses: Vec<Press> = (0..20).map(|k| press(k, 1.5, at(k), 0.7)).collect();
        print!("{drift:e} {uneven}: ");
        all.push(Seen::of(world, &presses, 45.0));
    }
    for seen in all {
        assert!(
            seen.shown > 0.9 * seen.pressed && seen.ghosts == 0.0,
            "{seen:?}"
        );
    }
}

#[test]
fn nothing_is_left_of_a_touch_that_crept() {
    let mut all = Vec::new();
    for (creep, force) in [(0.0, 15.0), (0.0, 45.0), (0.01, 15.0), (0.03, 15.0)] {
        let world = World { creep, ..CALM };
        let at = |k: usize| 4.0 + 15.0 * k as f64;
        let presses: Vec<Press> = (0..4).map(|k| press(k, force, at(k), 10.0)).collect();
        print!("{creep} {force} N: ");
        all.push(Seen::of(world, &presses, 64.0));
    }
    for seen in all {
        assert!(
            seen.shown > 0.99 * seen.pressed && seen.ghosts == 0.0,
            "{seen:?}"
        );
    }
}

#[test]
fn rest_is_quiet() {
    let mut all = Vec::new();
    for (noise, bits) in [(0.1e-6, 24), (1e-6, 12), (4e-6, 16)] {
        for drift in [0.0, 2e-6, 5e-6] {
            let world = World {
                noise,
                bits,
                drift,
                uneven: 0.1,
                ..CALM
            };
            print!("{noise:e} {bits} {drift:e}: ");
            all.push(Seen::of(world, &[], 120.0));
        }
    }
    assert!(all.iter().all(|seen| seen.ghosts == 0.0), "{all:?}");
}

#[test]
fn mains_hum_is_no_touch() {
    let mut all = Vec::new();
    for (hum, hum_hz, wanders_hz) in [
        (5e-6, 50.03, 0.0),
        (20e-6, 49.95, 0.0),
        (20e-6, 60.02, 0.0),
        (8e-6, 49.93, 0.03),
        (20e-6, 49.97, 0.05),
    ] {
        let world = World {
            hum,
            hum_hz,
            wanders_hz,
            trembles: wanders_hz,
            ..CALM
        };
        // Those that come so soon after one another leave no second of rest to look at.
        let (every, hard) = if wanders_hz > 0.0 {
            (1.5, 12.0)
        } else {
            (2.0, 1.5)
        };
        let force = |k: usize| if k.is_multiple_of(2) { 1.5 } else { hard };
        let presses: Vec<Press> = (0..20)
            .map(|k| press(k, force(k), 4.0 + every * k as f64, 0.7))
            .collect();
        print!("{hum:e} {hum_hz} ± {wanders_hz}: ");
        all.push(Seen::of(world, &presses, 45.0));
        print!("untouched: ");
        all.push(Seen::of(world, &[], 60.0));
    }
    for seen in all {
        assert!(
            seen.shown >= 0.99 * seen.pressed && seen.ghosts == 0.0,
            "{seen:?}"
        );
    }
}

/// Somebody switches a lamp on: there is no second of rest any more to look for lines in.
#[test]
fn hum_that_begins_is_no_touch_for_long() {
    const ON_S: f64 = 12.0;
    const KNOWN_S: f64 = ON_S + 3.0;
    let touched = |k: usize| press(k, 8.0, KNOWN_S + 1.0 + 1.5 * k as f64, 0.7);
    let presses: Vec<Press> = (0..10).map(touched).collect();
    for hum in [3e-6, 20e-6] {
        let world = World {
            hum,
            hum_hz: 49.96,
            hums_from: ON_S,
            ..CALM
        };
        let (mut begun, mut ghosts, mut released) = (0, 0, 0.0);
        run(world, &presses, KNOWN_S + 18.0, |now, update, press| {
            let shown = u32::from(update.contact.is_some());
            if press.is_some() {
                released = now;
            } else if now < KNOWN_S {
                begun += shown;
            } else if now > released + 0.3 {
                ghosts += shown;
            }
        });
        println!("{hum:e}: {begun} samples until {KNOWN_S} s, {ghosts} ghosts after it");
        // What begins is taken for a touch at first, or the test would say nothing.
        assert!(begun > 0 && ghosts == 0, "{hum:e}: {begun} {ghosts}");
    }
}

/// However steep, a touch is no noise of a gauge, and no gauge that says nothing.
#[test]
fn taps_lose_no_gauge() {
    for (noise, bits) in [(0.1e-6, 24), (1e-6, 16), (8e-6, 16)] {
        let world = World {
            bits,
            noise,
            ..CALM
        };
        let tap = |k: usize| Press {
            ramp: 0.002,
            ..press(k % 40, 8.0, 3.0 + 0.5 * k as f64, 0.25)
        };
        let taps: Vec<Press> = (0..60).map(tap).collect();
        let (mut lost, mut found, mut off) = (0, 0.0, 0.0);
        run(world, &taps, 34.0, |now, update, tap| {
            lost += usize::from(update.strain.is_some() && update.good < 10);
            let settled = tap.filter(|tap| now > tap.from + 0.05 && tap.share(now) == 1.0);
            if let (Some(tap), Some(contact)) = (settled, update.contact) {
                found += 1.0;
                off += contact.position.distance(tap.touch.position) * 1e3;
            }
        });
        println!(
            "{noise:e}: {lost} lost, {:.2} mm off in {found}",
            off / found
        );
        assert!(lost == 0 && found > 60.0 * 190.0 && off / found < 2.0);
    }
}

/// Hands that drum for minutes, with hardly a rest between two presses and some of them far harder than others: what loads
/// have hidden of the rest is seen in every gap, and no press becomes a part of it.
#[test]
fn no_press_is_lost_among_others() {
    const PRESSES: usize = 400;
    /// A gauge must read so much (strain) for a press to be one that can be felt at all.
    const CLEAR: f64 = 40e-6;
    let lab = lab();
    for (bits, noise, creep) in [(12, 2e-6, 0.0), (16, 1e-6, 0.03)] {
        let world = World {
            bits,
            noise,
            creep,
            drift: 0.1e-6,
            ..CALM
        };
        // To the held ends, where one gauge feels anything.
        let places = (lab.sensing)
            .touches(&lab.inputs, PRESSES, 23, false)
            .unwrap();
        let presses: Vec<Press> = (places.into_iter().enumerate())
            .map(|(k, touch)| Press {
                touch: Touch {
                    force: 2.0 * 12.5_f64.powf((k * 7919 % PRESSES) as f64 / PRESSES as f64),
                    ..touch
                },
                from: 3.0 + 0.64 * k as f64,
                lasts: 0.5,
                ramp: 0.05,
            })
            .collect();
        let last = presses[PRESSES - 1].from + 0.5;
        let mut felt = vec![(0, 0); PRESSES];
        let mut ghosts = 0;
        run(world, &presses, last + 4.0, |now, update, press| {
            let Some(press) = press else {
                ghosts += usize::from(now > last + 0.3 && update.contact.is_some());
                return;
            };
            if now > press.from + 0.15 && now < press.from + 0.45 {
                let (shown, of) = &mut felt[((press.from - 3.0) / 0.64).round() as usize];
                *shown += usize::from(update.touches.is_some());
                *of += 1;
            }
        });
        let clear = |k: &usize| {
            let read = lab.sensing.sensitivity.read(&presses[*k].touch);
            read.iter().any(|x| x.abs() > CLEAR)
        };
        let clear: Vec<usize> = (0..PRESSES).filter(clear).collect();
        let lost = |k: &&usize| 2 * felt[**k].0 < felt[**k].1;
        let lost: Vec<&usize> = clear.iter().filter(lost).collect();
        println!(
            "{bits} bits, creep {creep}: lost {} of {} clear ones, ghosts {ghosts}",
            lost.len(),
            clear.len()
        );
        assert!(clear.len() > PRESSES / 2);
        assert!(lost.len() * 100 <= clear.len(), "{lost:?}");
        assert_eq!(ghosts, 0);
    }
}

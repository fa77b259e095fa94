use super::*;
use crate::inference::plate::{CHANNELS, gauged_plate, read_touches};
use crate::inference::{Chain, Matching, ReadingErrors, Several};

/// Of every channel at rest (counts).
const LEVEL: f64 = 2000.0;
const STEP_US: u64 = 5_000;
const TOUCH: [(usize, f64); 1] = [(340, 20.0)];

fn board(board: u32) -> Hello {
    let chain = Chain::default();
    Hello {
        version: 1,
        board,
        channels: CHANNELS as u8,
        bits: chain.bits,
        reference_mv: (1e3 * chain.reference_v) as u16,
        supply_mv: (1e3 * chain.supply_v) as u16,
        gain_milli: (1e3 * chain.gain) as u32,
        rate_hz: 200,
        name: "Board".into(),
    }
}

/// A board that reads a plate, tared.
fn connected() -> Pipeline {
    let map = Arc::new(gauged_plate());
    let mut pipeline = Pipeline::new(map, PipelineSettings::of(CHANNELS));
    pipeline.hello(&board(1));
    tared(&mut pipeline);
    pipeline
}

fn tared(pipeline: &mut Pipeline) {
    pipeline.set_rest(Rest {
        level: vec![LEVEL; CHANNELS],
        noise: vec![1.0; CHANNELS],
        drift: Vec::new(),
    });
}

/// One finger comes and goes, three times.
fn touched(pipeline: &mut Pipeline) {
    let read = read_touches(&gauged_plate(), &TOUCH);
    let scale = pipeline.settings.chain.counts_per_strain();
    let last = pipeline.last_time.unwrap_or(0);
    let mut felt = 0;
    for k in 1..=600_u64 {
        let is_pressed = k % 200 >= 100;
        // A converter's last bit.
        let bit = |c: usize| ((7 * k as usize + 3 * c) % 5) as f64 / 2.0 - 1.0;
        let count = |(c, x): (usize, &f64)| {
            let strain = if is_pressed { *x } else { 0.0 };
            (LEVEL + bit(c) + scale * strain).round()
        };
        let update = pipeline.push(&Sample {
            time_us: last + k * STEP_US,
            counts: read.iter().enumerate().map(count).collect(),
        });
        felt += u32::from(update.contact.is_some());
    }
    assert!(felt > 250, "{felt}");
}

/// How sure one touch is where one of the gauges lies.
fn sure_of_one(several: &Several) -> f64 {
    let map = Arc::new(gauged_plate());
    let mut reading = read_touches(&map, &TOUCH);
    reading[2] += 150e-6;
    let mut matching = Matching::new(map, ReadingErrors::of_noise(1e-6, CHANNELS), 60.0);
    let one = matching.find(&reading);
    matching.count(several, &reading, &one).shares[0]
}

#[test]
fn what_is_known_of_gauges_is_known_of_one_board() {
    let mut pipeline = connected();
    let known = |pipeline: &Pipeline| sure_of_one(&pipeline.counting.several);
    let at_first = known(&pipeline);
    touched(&mut pipeline);
    let proved = known(&pipeline);
    assert!(proved < at_first, "{proved} {at_first}");
    // The same board says hello again.
    pipeline.hello(&board(1));
    assert_eq!(known(&pipeline), proved);
    pipeline.hello(&board(2));
    assert_eq!(known(&pipeline), at_first);
    tared(&mut pipeline);
    touched(&mut pipeline);
    assert!(known(&pipeline) < at_first);
    // As of a recording that begins here.
    pipeline.begin_anew();
    assert_eq!(known(&pipeline), at_first);
}

/// A finger that stands for a minute while every channel drifts by itself, by more than the finger reads there: share of the
/// samples in which it is shown, and samples that show anything after it.
fn stood_under_a_drift() -> [f64; 2] {
    const SAMPLES: [u64; 3] = [1000, 13_000, 15_000];
    let mut pipeline = connected();
    let read = read_touches(&gauged_plate(), &[(340, 3.0)]);
    let rms = (read.iter().map(|x| x * x).sum::<f64>() / read.len() as f64).sqrt();
    let scale = pipeline.settings.chain.counts_per_strain();
    let (mut shown, mut left) = (0.0, 0.0);
    for k in 1..=SAMPLES[2] {
        let is_pressed = (SAMPLES[0]..SAMPLES[1]).contains(&k);
        let drifted = k.saturating_sub(SAMPLES[0]).min(SAMPLES[1] - SAMPLES[0]) as f64;
        let drifted = rms * drifted / (SAMPLES[1] - SAMPLES[0]) as f64;
        let count = |(c, x): (usize, &f64)| {
            let bit = ((7 * k as usize + 3 * c) % 5) as f64 / 2.0 - 1.0;
            let way = [1.0, -0.7, 0.4, -1.3][c % 4] * if c < 5 { 1.0 } else { -0.6 };
            let pressed = if is_pressed { *x } else { 0.0 };
            (LEVEL + bit + scale * (pressed + way * drifted)).round()
        };
        let update = pipeline.push(&Sample {
            time_us: k * STEP_US,
            counts: read.iter().enumerate().map(count).collect(),
        });
        let is_shown = f64::from(u8::from(update.contact.is_some()));
        if is_pressed && k > SAMPLES[0] + 20 {
            shown += is_shown / (SAMPLES[1] - SAMPLES[0] - 21) as f64;
        }
        if k > SAMPLES[1] + 60 {
            left += is_shown;
        }
    }
    [shown, left]
}

#[test]
fn a_touch_that_stands_is_no_drift_and_leaves_none_behind() {
    let [shown, left] = stood_under_a_drift();
    println!("{shown:.3} shown, {left} samples after it");
    assert!(shown > 0.99 && left == 0.0, "{shown} {left}");
}

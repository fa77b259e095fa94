//! What elements leave of readings is as if gauges were glued a little off, and as much as is said of it.

use hapdef::budget::{Quality, unwatched};
use hapdef::design::{self, Inputs};
use hapdef::uncertainty::Gluing;

/// What a gauge reads of a touch by finer elements less what it reads, that, and what it changes by a metre along and
/// across.
type GaugeReading = [f64; 4];

/// Noise that nothing is better than (strain).
const NOISE: f64 = 1e-6;

/// Readings of the chosen gauges, touch by touch.
fn readings(inputs: &Inputs) -> Vec<Vec<GaugeReading>> {
    let budget = Quality::Draft.budget();
    let sensing = design::sensing(inputs, &budget, &unwatched).unwrap();
    let (finer, _) = (sensing.reference(inputs, &Gluing::EXACT, 0, &unwatched)).unwrap();
    let touches = sensing.judged_touches(inputs, &budget, &unwatched).unwrap();
    let drawn = &sensing.drawn;
    (touches.iter())
        .map(|touch| {
            let at = drawn.map.mesh.index().nearest(touch.position).0;
            let map = drawn.map.at(at);
            let [along, across, _] = drawn.changes.each_ref().map(|change| change.at(at));
            let of = |(c, finer): (usize, f64)| {
                let [own, along, across] = [map[c], along[c], across[c]].map(|v| v * touch.force);
                [finer - own, own, 1e3 * along, 1e3 * across]
            };
            finer.read(touch).into_iter().enumerate().map(of).collect()
        })
        .collect()
}

/// Mean square of what is off over its variance, and the mean logarithm of its density.
fn judged(
    readings: &[Vec<GaugeReading>],
    variance: &dyn Fn(&[GaugeReading], &GaugeReading) -> f64,
) -> [f64; 2] {
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for touch in readings {
        for reading in touch {
            let variance = variance(touch, reading) + NOISE * NOISE;
            let square = reading[0] * reading[0] / variance;
            sums[0] += square;
            sums[1] -= f64::midpoint(square, variance.ln());
            count += 1.0;
        }
    }
    sums.map(|sum| sum / count)
}

#[test]
fn what_elements_leave_is_as_if_gauges_were_glued_off() {
    let inputs = hapdef::cli::bundled().unwrap().inputs;
    let simulated = design::simulate(&inputs, &Quality::Draft.budget(), &unwatched).unwrap();
    let left = &simulated.discretization;
    let said = hapdef::uncertainty::Uncertainty::NONE
        .with_elements_of_gauges(left.reading_percent, simulated.length_scale)
        .as_glued;
    let readings = readings(&inputs);
    println!(
        "said: {:.1} % of readings, which change over {:.1} mm: {:.2} mm off, gain {:.1} % off; {:.1} % of the largest strain",
        left.reading_percent,
        1e3 * simulated.length_scale,
        1e3 * said.place,
        100.0 * said.gain,
        left.strain_percent
    );
    // As said, and with the share that fits best, of the gauge's own reading, and half of that and half of all.
    let as_said = judged(&readings, &|_, [_, own, along, across]| {
        said.variance(*own, *along, *across, 0.0)
    });
    let best = |variance: &dyn Fn(&[GaugeReading], &GaugeReading) -> f64| {
        let of = |k: i32| {
            let share = 1e-3 * 1.05_f64.powi(k);
            let [squares, density] =
                judged(&readings, &|all, one| share * share * variance(all, one));
            (density, squares, share)
        };
        (0..120).map(of).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    let own = best(&|_, one| one[1] * one[1]);
    let all = best(&|all, one| {
        let mean = all.iter().map(|r| r[1] * r[1]).sum::<f64>() / all.len() as f64;
        f64::midpoint(one[1] * one[1], mean)
    });
    let scale = simulated.length_scale;
    let glued = best(&|_, [_, own, along, across]| {
        f64::midpoint(own * own, scale * scale * (along * along + across * across))
    });
    println!(
        "squares {:.2}, density {:.2} as said",
        as_said[0], as_said[1]
    );
    for (name, of) in [("own", own), ("own and all", all), ("as glued", glued)] {
        println!(
            "{name}: {:.1} % fits best, density {:.2}",
            100.0 * of.2,
            of.0
        );
    }
    assert!((0.3..2.5).contains(&as_said[0]));
    assert!(glued.0 > own.0 + 0.2 && glued.0 > all.0 + 0.1);
    assert!(as_said[1] > glued.0 - 0.05, "{as_said:?}");
    let ratio = left.reading_percent / 100.0 / glued.2;
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

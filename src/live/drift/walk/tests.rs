use super::*;

const N: usize = 10;
const NOISE: f64 = 1e-6;
const STEP_S: f64 = 0.01;

/// White noise of variance one, more or less (splitmix64).
fn noise(k: u32, c: usize) -> f64 {
    let even = |j: u64| {
        let mut z =
            (12 * (u64::from(k) * N as u64 + c as u64) + j + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 40) as f64 / f64::from(1 << 24)
    };
    (0..12).map(even).sum::<f64>() - 6.0
}

/// What a walk is told: a channel's drift (strain a second) from some time (s) on; which channels are read, and whether
/// a touch hides the others from that time on.
struct Simulated {
    speeds: [f64; N],
    begins_s: f64,
    hidden: usize,
    from_s: f64,
}

impl Simulated {
    fn drifted(&self, c: usize, now_s: f64) -> f64 {
        self.speeds[c] * (now_s - self.begins_s).max(0.0)
    }

    /// A walk that has followed for so many seconds, by blocks of two samples.
    fn followed(&self, seconds: f64) -> RestWalk {
        let mut walk = RestWalk::new(&[NOISE; N], &[], 3.0, 200.0);
        let variance = [NOISE * NOISE / 2.0; N];
        for k in 1..=(seconds / STEP_S) as u32 {
            let now = f64::from(k) * STEP_S;
            let is_hidden = self.hidden > 0 && now > self.from_s;
            let used: [bool; N] = std::array::from_fn(|c| !is_hidden || c >= self.hidden);
            walk.pass(STEP_S, is_hidden);
            let read = |c: usize| self.drifted(c, now) + 0.7 * NOISE * noise(k, c);
            let off: Vec<f64> = (0..N)
                .map(read)
                .zip(walk.rest(0.0))
                .map(|(x, b)| x - b)
                .collect();
            let corrected = walk.correct((&off, f64::INFINITY), &variance, &used, &[]);
            let corrected = corrected.unwrap();
            if !is_hidden {
                walk.settle();
                walk.learn(&corrected, now);
            }
        }
        walk
    }
}

const AT_REST: Simulated = Simulated {
    speeds: [2e-6; N],
    begins_s: 0.0,
    hidden: 0,
    from_s: 0.0,
};

fn uneven(by: f64) -> [f64; N] {
    // Of mean nothing and of rms one.
    let signs = [0.5, -0.9, 1.1, -1.6, 0.9, -0.5, 1.2, -1.1, 1.6, -1.2];
    let rms = (signs.iter().map(|s| s * s).sum::<f64>() / N as f64).sqrt();
    signs.map(|s| 2e-6 * (1.0 + by * s / rms))
}

/// Three channels that nobody reads for two minutes drift as the others are seen to, or are known as badly as is said.
#[test]
fn what_is_hidden_drifts_as_the_others_do() {
    for (by, begins_s, most) in [(0.0, 0.0, 4e-6), (0.1, 0.0, 40e-6), (0.2, 20.0, 80e-6)] {
        let simulated = Simulated {
            speeds: uneven(by),
            begins_s,
            hidden: 3,
            from_s: 3.0,
        };
        let walk = simulated.followed(120.0);
        let covariance = walk.rest_covariance(0.0, true);
        for (c, rest) in walk.rest(0.0).take(3).enumerate() {
            let off = (rest - simulated.drifted(c, 120.0)).abs();
            let deviation = covariance[(c, c)].sqrt();
            assert!(
                deviation < most && off < 3.5 * deviation,
                "{by} {c}: {off} of {deviation}"
            );
        }
    }
}

/// For minutes; and without a drift none is made up.
#[test]
fn channels_that_drift_unevenly_are_told_and_stay_so() {
    for by in [0.0, 0.2] {
        for seconds in [20.0, 180.0] {
            let simulated = Simulated {
                speeds: uneven(by),
                ..AT_REST
            };
            let walk = simulated.followed(seconds);
            for (speed, found) in simulated.speeds.iter().zip(walk.speeds()) {
                assert!(
                    (found - speed).abs() < 0.15e-6,
                    "{by} {seconds}: {found} of {speed}"
                );
            }
            let learned = walk.uneven.sqrt();
            assert!(
                (0.6 * by..0.03 + 1.3 * by).contains(&learned),
                "{by} {seconds}: {learned}"
            );
        }
    }
    let still = Simulated {
        speeds: [0.0; N],
        ..AT_REST
    }
    .followed(180.0);
    assert!(still.rest(1.0).all(|b| b.abs() < 0.3e-6));
    let mean = mean(&still.state.as_slice()[N + 2..]);
    assert!(mean.abs() < 1e-9, "{mean}");
}

/// What three channels hid is farther off than was thought: how much one correction at rest leaves of it, in all (strain).
fn left_of_hidden(by: f64, is_inflated: bool) -> f64 {
    let mut walk = Simulated {
        hidden: 3,
        from_s: 3.0,
        ..AT_REST
    }
    .followed(120.0);
    let (variance, used) = ([NOISE * NOISE; N], [true; N]);
    let hid = [by, -by, by, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let before: Vec<f64> = walk.rest(0.0).collect();
    if is_inflated {
        walk.inflate(&hid, &variance, &used, 16.0);
    }
    let all = (&hid[..], f64::INFINITY);
    walk.correct(all, &variance, &used, &[]).unwrap();
    let moved = walk.rest(0.0).zip(before).map(|(b, was)| b - was);
    hid.iter().zip(moved).map(|(h, m)| (h - m).abs()).sum()
}

#[test]
fn what_is_farther_off_than_was_thought_is_believed() {
    let by = 6e-6;
    let [trusting, inflated] = [false, true].map(|is_inflated| left_of_hidden(by, is_inflated));
    assert!(trusting > 3.0 * NOISE, "{trusting}");
    assert!(inflated < 0.6 * trusting, "{inflated} of {trusting}");
    // What noise may do changes nothing.
    let [trusting, inflated] = [false, true].map(|is_inflated| left_of_hidden(1e-6, is_inflated));
    assert_eq!(trusting, inflated);
}

#[test]
fn what_comes_at_once_is_no_drift() {
    let mut walk = Simulated {
        speeds: [0.0; N],
        ..AT_REST
    }
    .followed(5.0);
    let before: Vec<f64> = walk.rest(0.0).collect();
    let mut jump = [0.0; N];
    jump[3] = 40e-6;
    let refused = walk.correct((&jump, 8.0), &[NOISE * NOISE; N], &[true; N], &[]);
    assert!(refused.is_none() && walk.rest(0.0).eq(before));
    // Where it is a way in which the touch may be another one, it says nothing of the rest.
    let ways = [vec![0.0; N], jump.map(|x| 10.0 * x).to_vec()];
    let taken = walk.correct((&jump, 8.0), &[NOISE * NOISE; N], &[true; N], &ways);
    assert!(taken.is_some_and(|by| by.iter().all(|b| b.abs() < 0.5e-6)));
}

/// One gauge that has been warmed by a hand, few gauges, or none.
#[test]
fn a_tare_is_believed_by_and_large() {
    let mut drift = [0.1e-6; N];
    drift[0] = 80e-6;
    let walk = RestWalk::new(&[NOISE; N], &drift, 3.0, 200.0);
    assert!(walk.speeds().all(|v| v.abs() < 0.2e-6));
    let broken = RestWalk::new(&[NOISE; N], &[f64::NAN; N], 3.0, 200.0);
    assert!(broken.rest(1.0).all(f64::is_finite));
    for n in 0..4 {
        let mut walk = RestWalk::new(&vec![NOISE; n], &vec![1e-6; n], 3.0, 200.0);
        for _ in 0..100 {
            walk.pass(STEP_S, false);
            let off = vec![NOISE; n];
            walk.correct(
                (&off, f64::INFINITY),
                &vec![NOISE * NOISE; n],
                &vec![true; n],
                &[],
            );
            walk.settle();
        }
        assert!(walk.rest(1.0).all(f64::is_finite), "{n}");
    }
}

/// What the channels that a touch loads read beside its model stays for a minute, and is no drift: how far the rest has gone is
/// known as well as is said. Taken for noise of that size it is not.
#[test]
fn what_a_touch_reads_beside_its_model_is_not_the_rest() {
    const LOADED: usize = 5;
    let beside = |c: usize| {
        if c < LOADED {
            4e-6 * (2.0 * c as f64).cos()
        } else {
            0.0
        }
    };
    let off_by_deviations = |is_known: bool| {
        let mut walk = AT_REST.followed(20.0);
        let deviations: [f64; N] = std::array::from_fn(|c| if c < LOADED { 4e-6 } else { 0.0 });
        let noise_of =
            |c: usize| NOISE * NOISE / 2.0 + if is_known { 0.0 } else { deviations[c].powi(2) };
        let variance: [f64; N] = std::array::from_fn(noise_of);
        for k in 2001..=8000 {
            let now = f64::from(k) * STEP_S;
            walk.pass(STEP_S, true);
            if is_known {
                walk.go_off(STEP_S, &deviations);
            }
            let read = |c: usize| AT_REST.drifted(c, now) + beside(c) + 0.7 * NOISE * noise(k, c);
            let off: Vec<f64> = (0..N)
                .map(read)
                .zip(walk.rest(0.0))
                .map(|(x, b)| x - b)
                .collect();
            walk.correct((&off, f64::INFINITY), &variance, &[true; N], &[])
                .unwrap();
        }
        walk.let_go();
        let known = walk.rest_covariance(0.0, false);
        let off = walk.rest(0.0).enumerate();
        let off = off.map(|(c, b)| (b - AT_REST.drifted(c, 80.0)).abs() / known[(c, c)].sqrt());
        off.fold(0.0, f64::max)
    };
    let (known, taken_for_noise) = (off_by_deviations(true), off_by_deviations(false));
    println!("{known:.2} {taken_for_noise:.2} deviations");
    assert!(
        known < 3.0 && taken_for_noise > 4.0,
        "{known} {taken_for_noise}"
    );
}

//! What a workshop does to readings beside touches: mains, warmth, creep, and what channels take from each other.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::draw::normal;

/// How much of each there is; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbances {
    /// Amplitude (strain) and frequency (Hz) of what the mains induce, in every channel at a phase of its own; the frequency
    /// wanders as that of a grid does.
    pub hum: Option<(f64, f64)>,
    /// What all channels drift by together, as a part that is warmed (strain in a second).
    pub warming: f64,
    /// What all channels are off by together as it comes and goes (strain, standard deviation), and the time (s) in which
    /// it does.
    pub wander: Option<(f64, f64)>,
    /// What each channel drifts by alone: standard deviation of its speed (strain in a second).
    pub warming_apart: f64,
    /// Share of a strain that follows later, and the time (s) in which it does: the plastic under a gauge creeps.
    pub creep: Option<(f64, f64)>,
    /// Share of a reading that is of the channel before it, which the converter read just before.
    pub crosstalk: f64,
}

impl Disturbances {
    /// How far channels are off by them at most (strain) in so many seconds.
    #[must_use]
    pub fn most(&self, seconds: f64) -> f64 {
        /// Of what is drawn.
        const DEVIATIONS: f64 = 3.0;
        let wandered = self.wander.map_or(0.0, |(deviation, _)| deviation);
        let hum = self.hum.map_or(0.0, |(amplitude, _)| amplitude);
        let apart = self.warming_apart * seconds;
        hum + self.warming.abs() * seconds + DEVIATIONS * (wandered + apart)
    }
}

/// The same over time.
#[derive(Clone, Debug)]
pub(super) struct Disturbed {
    what: Disturbances,
    phases: Vec<f64>,
    /// What each channel drifts by (strain in a second).
    speeds: Vec<f64>,
    /// What has crept so far (strain).
    crept: Vec<f64>,
    /// How far all have wandered (strain), and what draws the next step.
    wandered: f64,
    steps: ChaCha8Rng,
}

impl Disturbed {
    /// Draws phases and speeds of so many channels.
    pub fn new(what: Disturbances, channels: usize, rng: &mut ChaCha8Rng) -> Self {
        Self {
            phases: (0..channels).map(|_| TAU * rng.random::<f64>()).collect(),
            speeds: (0..channels)
                .map(|_| what.warming + what.warming_apart * normal(rng))
                .collect(),
            crept: vec![0.0; channels],
            wandered: 0.0,
            steps: ChaCha8Rng::from_rng(rng),
            what,
        }
    }

    /// How warm the part is (°C): what all channels drift by together is its warming.
    pub fn temperature(&self, seconds: f64) -> f64 {
        /// Where nothing drifts (°C).
        const ROOM: f64 = 23.0;
        /// Strain a degree that a gauge made for steel shows on nylon: the one expands by 80e-6 more than the other.
        const APPARENT: f64 = 80e-6;
        ROOM + (self.what.warming * seconds + self.wandered) / APPARENT
    }

    /// So long (s) goes by: what all channels wander by follows an Ornstein–Uhlenbeck process, which begins at rest.
    pub fn pass(&mut self, step: f64) {
        if let Some((deviation, time)) = self.what.wander {
            let kept = (-step / time).exp();
            let drawn = deviation * (1.0 - kept * kept).sqrt() * normal(&mut self.steps);
            self.wandered = kept * self.wandered + drawn;
        }
    }

    /// What channel `c` feels (strain) at a time (s), so long (s) after its last reading, where the part strains it by
    /// `felt`.
    pub fn felt(&mut self, c: usize, felt: f64, seconds: f64, step: f64) -> f64 {
        let mut strain = felt + self.wandered + self.speeds[c] * seconds;
        if let Some((amplitude, hertz)) = self.what.hum {
            strain += amplitude * (grid_phase(hertz, seconds) + self.phases[c]).sin();
        }
        if let Some((share, time)) = self.what.creep {
            let crept = &mut self.crept[c];
            // Exact for a strain that stays as it is for the step.
            *crept += (share * felt - *crept) * -(-step / time).exp_m1();
            strain += *crept;
        }
        strain
    }

    /// Mixes each channel with the one before it.
    pub fn mix(&self, strains: &mut [f64]) {
        let share = self.what.crosstalk;
        if share == 0.0 {
            return;
        }
        for c in (1..strains.len()).rev() {
            strains[c] += share * (strains[c - 1] - strains[c]);
        }
    }
}

/// How far (rad) a grid of a mean frequency (Hz) has come at a time (s): as supply and load fall apart it hurries and lags a
/// little, within seconds.
fn grid_phase(hertz: f64, seconds: f64) -> f64 {
    /// Hz and s.
    const OFF: f64 = 0.03;
    const WITHIN: f64 = 20.0;
    TAU * hertz * seconds + OFF * WITHIN * (1.0 - (TAU * seconds / WITHIN).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disturbed(what: Disturbances) -> Disturbed {
        Disturbed::new(what, 3, &mut ChaCha8Rng::seed_from_u64(1))
    }

    #[test]
    fn without_any_the_strain_is_what_the_part_has() {
        let mut none = disturbed(Disturbances::default());
        let mut strains = [1e-6, 2e-6, -3e-6];
        for c in 0..3 {
            assert_eq!(none.felt(c, strains[c], 5.0, 1e-3), strains[c]);
        }
        none.mix(&mut strains);
        assert_eq!(strains, [1e-6, 2e-6, -3e-6]);
    }

    #[test]
    fn a_strain_that_stays_creeps_by_its_share_and_back_when_it_goes() {
        let mut creeping = disturbed(Disturbances {
            creep: Some((0.03, 6.0)),
            ..Disturbances::default()
        });
        let mut last = 0.0;
        for _ in 0..60_000 {
            last = creeping.felt(0, 1e-3, 0.0, 1e-3);
        }
        assert!((last / 1e-3 - 1.03).abs() < 1e-5, "{last}");
        let after = creeping.felt(0, 0.0, 0.0, 6.0);
        assert!((after / 3e-5 - (-1.0_f64).exp()).abs() < 1e-3, "{after}");
    }

    #[test]
    fn hum_has_its_amplitude_and_warmth_its_speed_in_all_channels() {
        let mut humming = disturbed(Disturbances {
            hum: Some((5e-6, 50.0)),
            warming: 2e-6,
            ..Disturbances::default()
        });
        for c in 0..3 {
            let read: Vec<f64> = (0..2000)
                .map(|k| humming.felt(c, 0.0, 1e-3 * f64::from(k), 1e-3))
                .collect();
            let of = |half: &[f64]| half.iter().sum::<f64>() / half.len() as f64;
            // A second's mean, one second later: whole periods of hum are nothing.
            let drifted = of(&read[1000..]) - of(&read[..1000]);
            assert!((drifted - 2e-6).abs() < 5e-9, "{drifted}");
            let most = read[..20].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!((4.9e-6..5.1e-6).contains(&most), "{most}");
        }
    }

    #[test]
    fn a_grid_hurries_and_lags_by_little_and_keeps_its_mean() {
        let hertz =
            |at: f64| (grid_phase(50.0, at + 1e-3) - grid_phase(50.0, at - 1e-3)) / (2e-3 * TAU);
        assert!((hertz(5.0) - 50.03).abs() < 1e-4 && (hertz(15.0) - 49.97).abs() < 1e-4);
        assert!((grid_phase(50.0, 60.0) / TAU - 3000.0).abs() < 1e-9);
    }

    #[test]
    fn all_channels_wander_together_as_far_as_is_said_and_back() {
        let (deviation, time) = (4e-6, 10.0);
        let mut wandering = disturbed(Disturbances {
            wander: Some((deviation, time)),
            ..Disturbances::default()
        });
        let read: Vec<f64> = (0..40_000)
            .map(|_| {
                wandering.pass(1.0);
                let [first, last] = [0, 2].map(|c| wandering.felt(c, 0.0, 0.0, 1.0));
                assert_eq!(first, last);
                first
            })
            .collect();
        let apart = |lag: usize| {
            let pairs = read.iter().zip(&read[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (read.len() - lag) as f64
        };
        assert!((apart(0).sqrt() / deviation - 1.0).abs() < 0.1);
        assert!((apart(10) / apart(0) - (-1.0_f64).exp()).abs() < 0.1);
    }

    #[test]
    fn crosstalk_is_of_the_channel_before() {
        let mixed = disturbed(Disturbances {
            crosstalk: 0.1,
            ..Disturbances::default()
        });
        let mut strains = [1.0, 0.0, 2.0];
        mixed.mix(&mut strains);
        assert_eq!(strains, [1.0, 0.1, 1.8]);
    }
}

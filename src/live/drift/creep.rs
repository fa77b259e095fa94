//! What gauges keep of a load for a while after it has gone, and read more of it the longer it lasts.

use nalgebra::DMatrix;

/// The share of a load that creeps in all channels alike, and in each by itself (standard deviations), and the seconds in
/// which it does. While it lasts, the first is no more than another force.
const ALIKE: f64 = 0.03;
const ALONE: f64 = 0.007;
const SECONDS: f64 = 8.0;

/// What every channel has crept to.
pub(super) struct Creep {
    /// Strain that it would be at rest under.
    settled: Vec<f64>,
    /// Strain that it crept under before, and has not come back from.
    relaxing: Vec<f64>,
    pub loaded: bool,
}

impl Creep {
    /// Of so many channels that nothing has loaded.
    pub fn new(channels: usize) -> Self {
        Self {
            settled: vec![0.0; channels],
            relaxing: vec![0.0; channels],
            loaded: false,
        }
    }

    /// What becomes uncertain in some seconds under a load (strain), or under none.
    pub fn grow(&mut self, covariance: &mut DMatrix<f64>, load: Option<&[f64]>, seconds: f64) {
        if load.is_none() {
            self.let_go(covariance);
            for (relaxing, settled) in self.relaxing.iter_mut().zip(&mut self.settled) {
                *relaxing += std::mem::take(settled);
            }
        }
        self.loaded = load.is_some();
        let share = (seconds / SECONDS).min(1.0);
        along(covariance, &self.relaxing, 2.0 * share * ALIKE * ALIKE);
        for c in 0..self.settled.len() {
            let apart = load.map_or(0.0, |load| load[c]) - self.settled[c];
            let alone = apart * apart + self.relaxing[c] * self.relaxing[c];
            covariance[(c, c)] += 2.0 * share * ALONE * ALONE * alone;
            self.settled[c] += share * apart;
            self.relaxing[c] -= share * self.relaxing[c];
        }
    }

    /// By how much the rest may bend in some seconds (strain), as it comes back from what it crept to.
    pub fn bends_by(&self, seconds: f64) -> f64 {
        let most = self
            .relaxing
            .iter()
            .fold(0.0, |most: f64, r| most.max(r.abs()));
        ALIKE * most * (seconds / SECONDS).powi(2)
    }

    /// What has crept alike was part of the touch, and stays when that goes.
    pub fn let_go(&self, covariance: &mut DMatrix<f64>) {
        if self.loaded {
            along(covariance, &self.settled, ALIKE * ALIKE);
        }
    }
}

/// Adds what all channels are uncertain by along a strain.
fn along(covariance: &mut DMatrix<f64>, strain: &[f64], variance: f64) {
    for (i, a) in strain.iter().enumerate() {
        for (j, b) in strain.iter().enumerate() {
            covariance[(i, j)] += variance * a * b;
        }
    }
}

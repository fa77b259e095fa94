//! What the board's samples say while the machine moves: force limits, contact, and readings.

use super::motion::Motion;
use super::{Collector, CollectorNews, Doing, Marlin, Phase};
use crate::units;

impl Collector {
    /// Takes in a sample of the board.
    pub fn felt(
        &mut self,
        counts: &[f64],
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        self.sample_us = Some(now_us);
        if self.is_watched() {
            // A limb that turns into the tip is felt against the rest before it.
            let rest = if self.rest.is_empty() {
                &self.last_rest
            } else {
                &self.rest
            };
            let force = self.machine.force(counts, rest);
            self.hardest = self.hardest.max(force.unwrap_or(0.0));
            if let Some(force) = force.filter(|f| *f > self.limits.most_force) {
                let most = self.limits.most_force;
                self.escape(
                    format!(
                        "the tip pressed with {force:.1} N, and {most:.1} is the most that it may"
                    ),
                    now_us,
                    out,
                );
                return;
            }
            if force.is_some_and(|f| self.is_reached(f)) {
                self.halt_here(now_us, out);
                return;
            }
        }
        let Doing::Reading {
            from_us,
            until_us,
            reading,
            kept,
        } = &mut self.doing
        else {
            return;
        };
        if now_us < *from_us {
            return;
        }
        reading.push(counts);
        if *kept {
            tell(CollectorNews::Keep);
        }
        if now_us >= *until_us && reading.samples() >= 3 {
            if *kept {
                tell(CollectorNews::Note("end".into()));
            }
            self.next(now_us, out, tell);
        }
    }

    /// Whether what a move was made for is there already: it is not gone on with then, however stiff the limb is.
    pub(super) fn is_reached(&self, force: f64) -> bool {
        /// Deviations of a sample that are no noise.
        const SURE: f64 = 8.0;
        let halted = matches!(&self.doing, Doing::Moving(m) if !m.may_be_stopped());
        match self.phase {
            _ if halted || !matches!(self.doing, Doing::Moving(_)) => false,
            Phase::Approach | Phase::Seek => {
                force >= (2.0 * self.limits.felt).max(SURE * self.tip_noise)
            }
            Phase::Step => force >= self.limits.enough,
            _ => false,
        }
    }

    /// Stops the tip where it is, and asks where that is.
    pub(super) fn halt_here(&mut self, now_us: u64, out: &mut Vec<u8>) {
        Marlin::shout("M410", out);
        self.marlin.forget();
        let axis = &self.machine.radial;
        let way = [self.came_from, self.radial].map(|r| axis.number(units::mm(r)));
        let motion = Motion::stopped(axis.letter, way, &mut self.marlin, now_us, out);
        self.doing = Doing::Moving(motion);
    }

    /// Whether a force can be too large: always but while the tip is taken back from one.
    fn is_watched(&self) -> bool {
        !matches!(self.phase, Phase::Opening | Phase::Escape | Phase::Over)
    }

    /// Whether the tip touches, by its own sensor or, where it has none, by the gauges.
    pub(super) fn touches(&self, mean: &[f64]) -> bool {
        /// Deviations of a reading that are no noise.
        const SURE: f64 = 8.0;
        match self.machine.force(mean, &self.rest) {
            Some(force) => force >= self.limits.felt,
            None => (mean.iter().zip(&self.rest).zip(&self.rest_deviation))
                .any(|((m, r), d)| (m - r).abs() > SURE * std::f64::consts::SQRT_2 * d),
        }
    }
}

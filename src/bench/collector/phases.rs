//! One press, from the tip out of the way to the tip out of the way.

use super::super::machine::Pose;
use super::super::press::SampleMean;
use super::{Collector, CollectorNews, Doing, FAIL, FAILURES, FREE_N, Phase, RunEnd};
use crate::units;

impl Collector {
    pub(super) fn read(
        &mut self,
        what: Option<&str>,
        now_us: u64,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        if let Some(what) = what {
            tell(CollectorNews::Note(format!("read {what}")));
        }
        let from_us = now_us + self.limits.settle_us;
        self.doing = Doing::Reading {
            from_us,
            until_us: from_us + self.limits.read_us,
            reading: SampleMean::default(),
            kept: what.is_some(),
        };
    }

    pub(super) fn begin_press(
        &mut self,
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        if self.check.is_due(self.plan.len()) {
            self.check.begin();
        }
        let Some(planned) = self.planned() else {
            self.through(tell);
            return;
        };
        let what = match self.plan.front() {
            Some((number, _)) if !self.check.now => format!("press {number}"),
            _ => "check".into(),
        };
        let number = self.plan.front().map(|(number, _)| *number);
        tell(CollectorNews::Begun(number.filter(|_| !self.check.now)));
        let (p, n) = (units::mm(planned.at), planned.normal);
        tell(CollectorNews::Note(format!(
            "{what} {:.4} {:.4} {:.4} {:.5} {:.5} {:.5}",
            p.x, p.y, p.z, n.x, n.y, n.z
        )));
        self.phase = Phase::Retract;
        self.rest.clear();
        self.failed = None;
        self.forces = [None; 2];
        self.read_from = None;
        self.go_radial(self.retreat, now_us, out);
    }

    /// What was waited for has come.
    pub(super) fn next(
        &mut self,
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        let doing = std::mem::replace(&mut self.doing, Doing::Nothing);
        let reading = match doing {
            Doing::Reading { reading, .. } => Some(reading),
            _ => None,
        };
        match self.phase {
            // The next look begins a press, unless it is paused.
            Phase::Opening => {
                self.phase = Phase::Retract;
                return;
            }
            Phase::Escape => {
                self.give_up();
                return;
            }
            _ => {}
        }
        let Some(pose) = self.planned().map(|planned| planned.pose) else {
            self.through(tell);
            return;
        };
        match self.phase {
            Phase::Retract => self.turn(&pose, now_us, out),
            Phase::Turn => {
                self.phase = Phase::Rest;
                self.read(Some("rest"), now_us, tell);
            }
            Phase::Rest => self.rested(&reading.unwrap_or_default(), &pose, now_us, out),
            Phase::Approach if self.radial > pose.radial + self.limits.before + 1e-6 => {
                // Something stopped it on its way.
                self.phase = Phase::Feel;
                self.read(None, now_us, tell);
            }
            Phase::Approach => self.seek(&pose, now_us, out),
            Phase::Seek => {
                self.phase = Phase::Feel;
                self.read(None, now_us, tell);
            }
            Phase::Feel => self.feel(&reading.unwrap_or_default(), &pose, now_us, out, tell),
            Phase::Step => self.read_step(now_us, tell),
            Phase::Read => self.deeper(&reading.unwrap_or_default(), now_us, out),
            Phase::Withdraw => {
                self.phase = Phase::After;
                self.read(Some("after"), now_us, tell);
            }
            Phase::After if self.check.now => self.checked(now_us, out, tell),
            Phase::After => self.pressed(tell),
            Phase::Opening | Phase::Escape | Phase::Over => {}
        }
    }

    pub(super) fn turn(&mut self, pose: &Pose, now_us: u64, out: &mut Vec<u8>) {
        self.phase = Phase::Turn;
        let targets = (self.machine.numbers(pose).into_iter().skip(1))
            .map(|(axis, number)| (axis.letter, number, axis.speed))
            .collect();
        self.go(targets, now_us, out);
    }

    pub(super) fn rested(
        &mut self,
        reading: &SampleMean,
        pose: &Pose,
        now_us: u64,
        out: &mut Vec<u8>,
    ) {
        self.rest = reading.mean();
        self.rest_deviation = reading.deviation_of_mean();
        let sensor = self.machine.sensor;
        self.tip_noise = sensor.map_or(0.0, |s| {
            reading.deviation_of(s.channel) * s.newton_per_count.abs()
        });
        let before = std::mem::replace(&mut self.last_rest, self.rest.clone());
        // The tip's own rest hardly moves from one press to the next.
        let moved = self.machine.force(&self.rest, &before);
        if let Some(force) = moved.filter(|f| f.abs() > FREE_N) {
            let why = format!(
                "the tip reads {force:+.1} N since the press before, though it is out of the limb's way: something touches it, or its sensor drifts"
            );
            self.escape(why, now_us, out);
            return;
        }
        self.phase = Phase::Approach;
        self.go_radial(pose.radial + self.limits.before, now_us, out);
    }

    pub(super) fn seek(&mut self, pose: &Pose, now_us: u64, out: &mut Vec<u8>) {
        self.phase = Phase::Seek;
        let last = pose.radial - self.limits.behind;
        // The tip's sensor stops it wherever it touches; gauges are read step by step.
        let next = match self.machine.sensor {
            Some(_) => last,
            None => (self.radial - self.limits.step).max(last),
        };
        self.go_radial(next, now_us, out);
    }

    pub(super) fn feel(
        &mut self,
        reading: &SampleMean,
        pose: &Pose,
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        let mean = reading.mean();
        let early = self.radial > pose.radial + self.limits.before - 1.5 * self.limits.step;
        if early && self.touches(&mean) {
            self.failed = Some(format!(
                "something was met {:.1} mm before the place",
                units::mm(self.radial - pose.radial)
            ));
            self.withdraw(now_us, out);
        } else if self.touches(&mean) {
            self.contact = self.radial;
            self.check.met(self.radial - pose.radial);
            self.forces = [None, self.machine.force(&mean, &self.rest)];
            tell(CollectorNews::Note(format!(
                "contact {:.4}",
                units::mm(pose.radial - self.radial)
            )));
            self.read_step(now_us, tell);
        } else if self.radial <= pose.radial - self.limits.behind + 1e-6 {
            self.failed = Some(format!(
                "nothing was felt to {:.1} mm behind the place",
                units::mm(self.limits.behind)
            ));
            self.withdraw(now_us, out);
        } else {
            self.seek(pose, now_us, out);
        }
    }

    pub(super) fn read_step(&mut self, now_us: u64, tell: &mut dyn FnMut(CollectorNews)) {
        self.phase = Phase::Read;
        let depth = units::mm(self.contact - self.radial);
        self.read(Some(&format!("depth {depth:.4}")), now_us, tell);
    }

    pub(super) fn deeper(&mut self, reading: &SampleMean, now_us: u64, out: &mut Vec<u8>) {
        /// Of a step, below which another says nothing more.
        const LEAST: f64 = 0.05;
        let force = self.machine.force(&reading.mean(), &self.rest);
        self.forces = [self.forces[1], force];
        let depth = self.contact - self.radial;
        if self.check.now {
            self.check.read(depth, force, reading, &self.rest);
        }
        let step = self.next_step(force);
        let enough = depth + 0.5 * self.limits.step >= self.limits.depth
            || force.is_some_and(|f| f >= self.limits.enough)
            || step < LEAST * self.limits.step;
        if enough {
            self.withdraw(now_us, out);
        } else {
            self.phase = Phase::Step;
            self.read_from = Some(self.radial);
            self.go_radial(self.radial - step, now_us, out);
        }
    }

    /// The step that adds at most half of the force that is left, if the limb is as stiff as it was in the last one.
    pub(super) fn next_step(&self, force: Option<f64>) -> f64 {
        let step = self.limits.step;
        let (Some(now), Some(before), Some(from)) = (force, self.forces[0], self.read_from) else {
            return step;
        };
        let stiffness = (now - before) / (from - self.radial).max(1e-6);
        let left = (self.limits.most_force - now).max(0.0);
        if stiffness > 0.0 {
            step.min(0.5 * left / stiffness)
        } else {
            step
        }
    }

    pub(super) fn withdraw(&mut self, now_us: u64, out: &mut Vec<u8>) {
        self.phase = Phase::Withdraw;
        self.go_radial(self.retreat, now_us, out);
    }

    pub(super) fn pressed(&mut self, tell: &mut dyn FnMut(CollectorNews)) {
        let Some((number, planned)) = self.plan.pop_front() else {
            return;
        };
        let failed = self.failed.take();
        if let Some(why) = &failed {
            tell(CollectorNews::Note(format!("failed {number} {why}")));
        } else {
            tell(CollectorNews::Note(format!("pressed {number}")));
            self.check.made(number, planned);
        }
        self.restarts = 0;
        self.failures = failed.as_ref().map_or(0, |_| self.failures + 1);
        let why = failed.clone();
        self.tried[0] += 1;
        self.tried[1] += usize::from(why.is_some());
        match failed {
            None => tell(CollectorNews::Press { number, failed }),
            Some(why) if !self.check.look_first(number, planned, &why) => {
                self.failed(number, planned, why, tell);
            }
            // Whether it is this press or the machine is looked at first.
            Some(_) => {}
        }
        let [tried, none] = self.tried;
        let often = none >= FAILURES && none as f64 > FAIL * tried as f64;
        if let Some(why) = why.filter(|_| self.failures >= FAILURES || often) {
            // The tip is out of the way already.
            self.end(RunEnd::Stopped(format!(
                "{none} of {tried} presses failed, the last because {why}: look how the limb is mounted, and whether the tip and its sensor work"
            )));
            return;
        }
        let over = self.plan.is_empty() && !self.check.is_due(0);
        if over {
            self.through(tell);
            return;
        }
        // The next look begins the next one, unless it is paused.
        self.phase = Phase::Retract;
    }
}

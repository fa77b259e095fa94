//! What the machine says, and what is looked at as time passes.

use super::super::marlin::MachineReply;
use super::motion::Moved;
use super::{Collector, CollectorNews, Doing, FIRST_US, Phase, RESTARTS, SILENT_US};
use crate::units;

impl Collector {
    /// Takes in what the machine says.
    pub fn receive(
        &mut self,
        bytes: &[u8],
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        for reply in self.marlin.push(bytes, now_us, out) {
            self.take(reply, now_us, out, tell);
        }
    }

    fn take(
        &mut self,
        reply: MachineReply,
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        if self.phase == Phase::Over {
            return;
        }
        match reply {
            MachineReply::Restarted => self.restarted(now_us, out, tell),
            MachineReply::Failed(why) => {
                self.lose(
                    &format!("the machine cannot be trusted any more: {why}"),
                    out,
                );
            }
            MachineReply::Done(said) => self.done(&said, now_us, out, tell),
        }
    }

    fn restarted(&mut self, now_us: u64, out: &mut Vec<u8>, tell: &mut dyn FnMut(CollectorNews)) {
        // Boards begin anew when their port is opened.
        let opening = self.phase == Phase::Opening && self.moves == 0;
        if !opening {
            self.restarts += 1;
            if self.wrong.is_some() || self.machine.home.is_empty() || self.restarts > RESTARTS {
                let why = "the machine began anew, and knows no longer where the tip is";
                self.lose(why, out);
                return;
            }
            tell(CollectorNews::Say(
                "the machine began anew: its axes are sent home, and the press is repeated".into(),
            ));
            self.unmake(tell);
            self.doubt("the machine began anew", tell);
        }
        self.open(!opening, now_us, out);
    }

    /// The press that goes on is none: it is made again.
    fn unmake(&mut self, tell: &mut dyn FnMut(CollectorNews)) {
        match self.plan.front() {
            Some((number, _)) if !self.check.now => {
                tell(CollectorNews::Note(format!("again {number}")));
            }
            _ => tell(CollectorNews::Note("again".into())),
        }
        self.check.now = false;
        self.failed = None;
    }

    fn done(
        &mut self,
        said: &[String],
        now_us: u64,
        out: &mut Vec<u8>,
        tell: &mut dyn FnMut(CollectorNews),
    ) {
        match &mut self.doing {
            Doing::Orders(orders) => match orders.pop_front() {
                // Homing may take its time.
                Some(order) => self.marlin.order(&order, 60_000_000, now_us, out),
                None => self.next(now_us, out, tell),
            },
            Doing::Moving(motion) => match motion.take(said, &mut self.marlin, now_us, out) {
                Moved::NotYet => {}
                Moved::There => {
                    if let Some(number) = motion.found {
                        self.radial = units::from_mm(self.machine.radial.way(number));
                    }
                    self.moves += 1;
                    self.next(now_us, out, tell);
                }
                Moved::Wrong(why) if self.phase == Phase::Escape => self.lose(&why, out),
                Moved::Wrong(why) => self.escape(why, now_us, out),
            },
            Doing::Reading { .. } | Doing::Nothing => {}
        }
    }

    /// To be called every few milliseconds.
    pub fn look(&mut self, now_us: u64, out: &mut Vec<u8>, tell: &mut dyn FnMut(CollectorNews)) {
        if self.phase == Phase::Over {
            return;
        }
        let Some(begun) = self.begun_us else {
            self.begun_us = Some(now_us);
            self.open(false, now_us, out);
            return;
        };
        if let Some(reply) = self.marlin.look(now_us, out) {
            self.take(reply, now_us, out, tell);
        }
        if let Doing::Moving(motion) = &self.doing
            && motion.is_late(now_us)
        {
            self.lose("the machine does not come to an end of its move", out);
            return;
        }
        let (since, most) = match self.sample_us {
            Some(last) => (last, SILENT_US),
            None => (begun, FIRST_US),
        };
        let escaping = matches!(self.phase, Phase::Escape | Phase::Over);
        if !escaping && now_us.saturating_sub(since) > most {
            self.escape("the board has fallen silent".into(), now_us, out);
            return;
        }
        // Whoever was paused is looked after here.
        let idle = self.phase == Phase::Retract && matches!(self.doing, Doing::Nothing);
        if idle && !self.paused && !self.waits {
            self.begin_press(now_us, out, tell);
        }
    }
}

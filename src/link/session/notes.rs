//! Notes in a recording: what the studio did while it was made is done again.

use std::time::Instant;

use glam::DVec3;

use super::listener::{Listener, SessionEvent};
use crate::link::counted_line::number;
use crate::live::Sample;

impl Listener {
    /// What the studio did when this was recorded.
    pub(super) fn replay(
        &mut self,
        own: &str,
        time_us: u64,
        arrived: Instant,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        let words: Vec<&str> = own.split_whitespace().collect();
        match words[..] {
            ["tare"] => self.pipeline.tare(),
            ["rest", k, level, noise] => self.rest_of(k, [level, noise, "0"]),
            ["rest", k, level, noise, drift] => self.rest_of(k, [level, noise, drift]),
            ["dead", k] => {
                if let Ok(k) = k.parse() {
                    self.pipeline.mark_dead(&[k]);
                }
            }
            ["clock", unix] => {
                if let Ok(unix_us) = unix.parse() {
                    self.record(|r| r.note_clock(time_us, unix_us));
                    tell(SessionEvent::Clock { unix_us, time_us });
                }
            }
            ["temperature", celsius] => {
                let centi = number(celsius).map(|c| (100.0 * c).round() as i16);
                self.receiver.traffic.temperature_centi = centi;
            }
            ["truth", "none"] => tell(SessionEvent::Truth(None)),
            ["truth", x, y, z, force] => {
                if let [Some(x), Some(y), Some(z), Some(force)] = [x, y, z, force].map(number) {
                    tell(SessionEvent::Truth(Some((
                        DVec3::new(x, y, z) * 1e-3,
                        force,
                    ))));
                }
            }
            ["part" | "line", ..] => {
                if let Some(counts) = self.line.take(own) {
                    self.measure(&Sample { time_us, counts }, arrived, tell);
                }
            }
            _ => {}
        }
    }

    /// The rest of one channel: all are taken when the last one is there.
    fn rest_of(&mut self, channel: &str, values: [&str; 3]) {
        if let [Some(level), Some(noise), Some(drift)] = values.map(number)
            && channel.parse() == Ok(self.rest.level.len())
        {
            self.rest.level.push(level);
            self.rest.noise.push(noise);
            self.rest.drift.push(drift);
        }
        if self.rest.level.len() == self.pipeline.settings.channels.len() {
            self.pipeline.set_rest(std::mem::take(&mut self.rest));
        }
    }
}

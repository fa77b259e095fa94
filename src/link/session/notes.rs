//! Notes in a recording: what the studio did while it was made is done again.

use std::time::Instant;

use glam::DVec3;

use super::listener::{Listener, SessionEvent};
use crate::live::Sample;
use crate::wire::MOST_CHANNELS;

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
            ["truth", "none"] => tell(SessionEvent::Truth(None)),
            ["truth", x, y, z, force] => {
                if let [Some(x), Some(y), Some(z), Some(force)] = [x, y, z, force].map(number) {
                    tell(SessionEvent::Truth(Some((
                        DVec3::new(x, y, z) * 1e-3,
                        force,
                    ))));
                }
            }
            ["part", from, values] => {
                self.gather(from, values);
            }
            ["line", values] => self.replay_line("0", values, time_us, arrived, tell),
            ["line", from, values] => self.replay_line(from, values, time_us, arrived, tell),
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

    /// The end of a line of counts, with what was gathered of it before.
    fn replay_line(
        &mut self,
        from: &str,
        values: &str,
        time_us: u64,
        arrived: Instant,
        tell: &mut impl FnMut(SessionEvent),
    ) {
        if self.gather(from, values) {
            let counts = std::mem::take(&mut self.line);
            self.measure(&Sample { time_us, counts }, arrived, tell);
        }
    }

    /// Counts of a line from one channel on; none of it is used where those before them are missing.
    fn gather(&mut self, from: &str, values: &str) -> bool {
        let from = from.parse().unwrap_or(usize::MAX);
        if from == 0 {
            self.line.clear();
        }
        let piece: Option<Vec<f64>> = values.split(',').map(number).collect();
        let piece = piece.filter(|p| from == self.line.len() && from + p.len() <= MOST_CHANNELS);
        if let Some(piece) = &piece {
            self.line.extend(piece);
        } else {
            self.line.clear();
        }
        piece.is_some()
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| v.is_finite())
}

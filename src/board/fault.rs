//! What goes wrong on request: on the wire, in channels, with the plug.

use std::str::FromStr;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// What a channel suffers from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Illness {
    /// It feels nothing.
    Dead,
    /// It stays at its last value.
    Stuck,
    /// It lies at the end of the range.
    Saturated,
    /// Its noise is forty times as large.
    Noisy,
}

/// A channel that is ill for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelFault {
    /// Number of the channel, from 0.
    pub channel: usize,
    /// What it does.
    pub illness: Illness,
    /// Start, on the board's clock (s).
    pub from_s: f64,
    /// End (s); infinite where it never recovers.
    pub until_s: f64,
}

/// One thing that goes wrong, as it is asked for: `dead:7@5+2`, `unplug@10+1.5`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A channel fails.
    Channel(ChannelFault),
    /// From and until (s).
    Unplug(f64, f64),
}

/// All that goes wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Probability of each byte to have a bit turned over, and to be left out.
    pub flip: f64,
    /// Probability of each byte to be dropped.
    pub drop: f64,
    /// Probability of each frame of data to be sent twice, and never.
    pub duplicate: f64,
    /// Probability of each data frame never to be sent.
    pub lose: f64,
    /// Channels that fail for a while.
    pub channels: Vec<ChannelFault>,
    /// From when until when nothing is connected (s).
    pub unplugged: Vec<(f64, f64)>,
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is no fault: write dead:CHANNEL, stuck:CHANNEL, saturated:CHANNEL or noisy:CHANNEL (from 0), or unplug, each with @SECONDS and +DURATION where wanted, as dead:7@5+2"
            )
        };
        let (what, when) = text
            .split_once('@')
            .map_or((text, None), |(a, b)| (a, Some(b)));
        let (from_s, until_s) = match when {
            None => (0.0, f64::INFINITY),
            Some(when) => {
                let (from, long) = when
                    .split_once('+')
                    .map_or((when, None), |(a, b)| (a, Some(b)));
                let number = |t: &str| t.parse().ok().filter(|v: &f64| *v >= 0.0);
                let from = number(from).ok_or_else(wrong)?;
                let long = long.map_or(Some(f64::INFINITY), number).ok_or_else(wrong)?;
                (from, from + long)
            }
        };
        if what == "unplug" {
            // Without an end it would never come back.
            let until = if until_s.is_finite() {
                until_s
            } else {
                from_s + 1.0
            };
            return Ok(Self::Unplug(from_s, until));
        }
        let (kind, channel) = what.split_once(':').ok_or_else(wrong)?;
        let illness = match kind {
            "dead" => Illness::Dead,
            "stuck" => Illness::Stuck,
            "saturated" => Illness::Saturated,
            "noisy" => Illness::Noisy,
            _ => return Err(wrong()),
        };
        let channel = channel.parse().map_err(|_| wrong())?;
        Ok(Self::Channel(ChannelFault {
            channel,
            illness,
            from_s,
            until_s,
        }))
    }
}

impl Faults {
    /// Takes in one more.
    pub fn add(&mut self, fault: Fault) {
        match fault {
            Fault::Channel(fault) => self.channels.push(fault),
            Fault::Unplug(from, until) => self.unplugged.push((from, until)),
        }
    }

    pub(super) fn is_unplugged(&self, seconds: f64) -> bool {
        self.unplugged
            .iter()
            .any(|(a, b)| (*a..*b).contains(&seconds))
    }

    pub(super) fn illness(&self, channel: usize, seconds: f64) -> Option<Illness> {
        let ill =
            |f: &&ChannelFault| f.channel == channel && (f.from_s..f.until_s).contains(&seconds);
        self.channels.iter().find(ill).map(|f| f.illness)
    }

    /// Sends a frame as a bad line would.
    pub(super) fn spoil(&self, frame: &[u8], data: bool, rng: &mut ChaCha8Rng, out: &mut Vec<u8>) {
        if data && self.lose > 0.0 && rng.random::<f64>() < self.lose {
            return;
        }
        let twice = data && self.duplicate > 0.0 && rng.random::<f64>() < self.duplicate;
        for _ in 0..=usize::from(twice) {
            if self.flip == 0.0 && self.drop == 0.0 {
                out.extend_from_slice(frame);
                continue;
            }
            for &byte in frame {
                if rng.random::<f64>() < self.drop {
                    continue;
                }
                let turned = rng.random::<f64>() < self.flip;
                out.push(if turned {
                    byte ^ (1 << rng.random_range(0..8))
                } else {
                    byte
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_as_they_are_written() {
        let dead = ChannelFault {
            channel: 7,
            illness: Illness::Dead,
            from_s: 5.0,
            until_s: 7.0,
        };
        assert_eq!("dead:7@5+2".parse(), Ok(Fault::Channel(dead)));
        assert_eq!("unplug@10+1.5".parse(), Ok(Fault::Unplug(10.0, 11.5)));
        assert_eq!("unplug@3".parse(), Ok(Fault::Unplug(3.0, 4.0)));
        for bad in [
            "dead",
            "dead:x",
            "deaf:3",
            "dead:3@",
            "dead:3@-1",
            "unplug@1+x",
            "",
        ] {
            assert!(bad.parse::<Fault>().is_err(), "{bad}");
        }
    }
}

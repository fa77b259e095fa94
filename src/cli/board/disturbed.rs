//! What disturbs the readings of a simulated board, as it is asked for.

use std::ops::RangeInclusive;

use clap::Args;

use crate::board::Disturbances;
use crate::cli::ranges::between;

/// What there is in the readings beside touches.
#[derive(Args, Debug, Clone)]
pub struct DisturbanceArgs {
    /// Mains hum in every channel: amplitude (microstrain) and mean frequency (Hz; 50 when left out), as 20 or 20@60. It wanders by
    /// 0.03 Hz, as that of a grid.
    #[arg(long, value_parser = hum)]
    pub hum: Option<(f64, f64)>,
    /// What all channels drift by together (microstrain a second), as a part that is warmed.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = between(-MOST_MICROSTRAIN, MOST_MICROSTRAIN))]
    pub warming: f64,
    /// What all channels are off by together as it comes and goes (microstrain, standard deviation) and the time in which
    /// it does (s; 10 when left out), as 4 or 4@30; the project's when left out.
    #[arg(long, value_parser = wander)]
    pub wander: Option<(f64, f64)>,
    /// What each channel drifts by alone (microstrain a second, standard deviation over the channels).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, MOST_MICROSTRAIN))]
    pub warming_apart: f64,
    /// Creep of the plastic: share of a strain that follows later (%) and the time in which it does (s; 6 when left
    /// out), as 3 or 3@20.
    #[arg(long, value_parser = creep)]
    pub creep: Option<(f64, f64)>,
    /// Share of a reading that is of the channel before it (%).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 100.0))]
    pub crosstalk: f64,
}

impl DisturbanceArgs {
    /// In SI units; where nothing is said, as is usual.
    pub fn disturbances(&self, usual: &Disturbances) -> Disturbances {
        let wander = self
            .wander
            .map(|(deviation, time)| (deviation * 1e-6, time));
        Disturbances {
            hum: self.hum.map(|(amplitude, hertz)| (amplitude * 1e-6, hertz)),
            wander: wander.or(usual.wander),
            warming: self.warming * 1e-6,
            warming_apart: self.warming_apart * 1e-6,
            creep: self.creep.map(|(percent, time)| (percent / 100.0, time)),
            crosstalk: self.crosstalk / 100.0,
        }
    }
}

fn hum(text: &str) -> Result<(f64, f64), String> {
    let wanted = "write MICROSTRAIN or MICROSTRAIN@HERTZ, as 20@50, up to 100000 and 5000";
    pair(text, 50.0, MOST_MICROSTRAIN, 0.01..=5000.0).ok_or_else(|| wanted.into())
}

fn wander(text: &str) -> Result<(f64, f64), String> {
    let wanted = "write MICROSTRAIN or MICROSTRAIN@SECONDS, as 4@10, up to 100000 and 1000000";
    pair(text, 10.0, MOST_MICROSTRAIN, 1e-3..=1e6).ok_or_else(|| wanted.into())
}

fn creep(text: &str) -> Result<(f64, f64), String> {
    let wanted = "write PERCENT or PERCENT@SECONDS, as 3@6, up to 100 and 1000000";
    pair(text, 6.0, 100.0, 1e-3..=1e6).ok_or_else(|| wanted.into())
}

/// An amount up to `most` and what stands behind the @, or what is usual.
fn pair(text: &str, usual: f64, most: f64, range: RangeInclusive<f64>) -> Option<(f64, f64)> {
    let (amount, rest) = match text.split_once('@') {
        Some((amount, rest)) => (amount, rest.parse().ok()?),
        None => (text, usual),
    };
    let amount = amount.parse().ok().filter(|a| (0.0..=most).contains(a))?;
    range.contains(&rest).then_some((amount, rest))
}

/// More than any gauge bears.
pub(super) const MOST_MICROSTRAIN: f64 = 1e5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_disturbs_is_an_amount_and_if_wanted_more() {
        assert_eq!(hum("20"), Ok((20.0, 50.0)));
        assert_eq!(hum("5@60.02"), Ok((5.0, 60.02)));
        assert_eq!(creep("3@20"), Ok((3.0, 20.0)));
        assert_eq!(wander("4"), Ok((4.0, 10.0)));
        for wrong in [
            "", "@50", "nan", "20@", "20@0", "20@nan", "1e9", "-1", "20@50@60",
        ] {
            assert!(hum(wrong).is_err() && creep(wrong).is_err(), "{wrong}");
        }
    }
}

//! From gauges to counts: bridges, amplifiers, pins, and what the board's sketch must know.

use std::fmt::Write as _;

use super::inner::GluedGauge;
use crate::inference::Chain;
use crate::uncertainty::rounding;
use crate::units;

/// Of a gauge as it is bought, and of the resistors beside it (Ω).
pub const RESISTANCE: f64 = 350.0;
/// What resistors and gauges are off their value by (shares): the usual classes.
const RESISTORS: f64 = 0.001;
const GAUGES: f64 = 0.003;

/// One gauge's way to its counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Of the gauge, from 1.
    pub gauge: usize,
    /// Of the board, from 0.
    pub channel: usize,
    /// The board's pin.
    pub pin: String,
    /// Smallest and largest strain (microstrain) and change (counts) that touches of the design's force make.
    pub microstrain: [f64; 2],
    /// See [`Self::microstrain`].
    pub counts: [f64; 2],
    /// Length of a cable along the wall to the foot of the part (m).
    pub cable: f64,
}

/// The whole of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wiring {
    /// The electric constants.
    pub chain: Chain,
    /// Of each gauge, in their order.
    pub channels: Vec<Channel>,
    /// Force that the ranges are of (N).
    pub force_n: f64,
    /// The hardest touch that is expected (N).
    pub hardest_n: f64,
    /// Volts behind the amplifier that bridges stand off the middle by, if resistors are as far off as their classes allow.
    pub offset_v: f64,
    /// The largest gain with which the hardest touch stays in the converter's range, a bridge being trimmed to its middle.
    pub most_gain: f64,
}

/// Wires gauges to the channels of a board (from 0), each with what it reads at `force_n`, up to `hardest_n` (N). `heights` are
/// their heights above the foot of the part (m).
#[must_use]
pub fn wiring(
    gauges: &[GluedGauge],
    channels: &[usize],
    heights: &[f64],
    chain: Chain,
    [force_n, hardest_n]: [f64; 2],
) -> Wiring {
    /// Share of the range's half that the hardest touch may take: bridges are never trimmed quite to its middle.
    const USED: f64 = 0.8;
    /// From the foot to the plug, and what a cable gives way by (m).
    const SPARE: f64 = 0.15;
    let counts = chain.counts_per_strain();
    let channel = |(gauge, (&channel, &height)): (&GluedGauge, (&usize, &f64))| Channel {
        gauge: gauge.number,
        channel,
        pin: format!("A{channel}"),
        microstrain: gauge.strain.map(units::microstrain),
        counts: gauge.strain.map(|s| s * counts),
        cable: height + SPARE,
    };
    let largest = (gauges.iter().flat_map(|g| g.strain)).fold(0.0, |m: f64, s| m.max(s.abs()));
    let at_hardest = largest * hardest_n / force_n.max(f64::MIN_POSITIVE);
    let bridge = chain.supply_v * chain.gauge_factor * f64::from(chain.active_arms) / 4.0;
    let most_gain = USED * 0.5 * chain.reference_v / (bridge * at_hardest).max(f64::MIN_POSITIVE);
    Wiring {
        chain,
        channels: gauges
            .iter()
            .zip(channels.iter().zip(heights))
            .map(channel)
            .collect(),
        force_n,
        hardest_n,
        offset_v: chain.supply_v / 4.0 * (GAUGES + 3.0 * RESISTORS) * chain.gain,
        most_gain,
    }
}

impl Wiring {
    /// What is to be known of the bridges, a sentence each.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let chain = &self.chain;
        let half = chain.reference_v / 2.0;
        let bridge = match chain.active_arms {
            1 => {
                "one gauge and three resistors (or a gauge that is not glued to the wall in place of the one beside it, which takes away what warmth does)"
            }
            2 => "two gauges side by side in the bridge and two resistors",
            _ => "gauges in more than two arms",
        };
        let mut words = vec![
            format!(
                "Each bridge is {bridge}, of {RESISTANCE:.0} Ω, resistors to {:.1} %, supplied with {} V; amplifier ×{}, converter {} bits to {} V: {:.3} counts a microstrain.",
                100.0 * RESISTORS,
                chain.supply_v,
                chain.gain,
                chain.bits,
                chain.reference_v,
                units::from_microstrain(chain.counts_per_strain())
            ),
            format!(
                "Resistors and gauges as far off as their classes allow put a bridge {:.2} V off the converter's middle of {half:.2} V behind the amplifier{}",
                self.offset_v,
                if self.offset_v > 0.5 * half {
                    ": each channel needs a trimmer (a potentiometer of 10 kΩ to the bridge's corner through 47 kΩ), set so that the untouched limb reads the middle."
                } else {
                    ", which leaves room for touches."
                }
            ),
        ];
        words.push(if self.most_gain < chain.gain {
            format!(
                "A touch of {:.0} N drives a gauge out of the converter's range: no more than ×{:.0} stays within it.",
                self.hardest_n, self.most_gain
            )
        } else {
            format!(
                "A touch of {:.0} N stays within the converter's range up to a gain of ×{:.0}.",
                self.hardest_n, self.most_gain
            )
        });
        words.extend(self.rounding_words());
        words
    }

    /// What rounding to counts adds to the noise, where that is much; nothing where it is next to none.
    fn rounding_words(&self) -> Option<String> {
        /// Microstrain: half of the noise of most amplifiers.
        const LITTLE: f64 = 0.5;
        let gain = self.chain.gain.min(self.most_gain);
        let chain = Chain { gain, ..self.chain };
        let count = units::microstrain(1.0 / chain.counts_per_strain());
        let rounded = rounding(count);
        (rounded > LITTLE).then(|| {
            format!(
                "With {} bits and a gain of ×{gain:.0} a count is {count:.1} µε, which adds {rounded:.1} µε to the noise of each reading. The promised errors know of that where gauge.resolution_microstrain is {count:.1}; with more bits there is less of it.",
                chain.bits
            )
        })
    }
}

/// `hapd_config.h`: what the sketch must know of this project.
#[must_use]
pub fn header(wiring: &Wiring, name: &str, board: u32) -> String {
    let chain = &wiring.chain;
    let most = wiring
        .channels
        .iter()
        .map(|c| c.channel + 1)
        .max()
        .unwrap_or(0);
    let pins: Vec<String> = (0..most).map(|k| format!("A{k}")).collect();
    let name: String = (name.chars())
        .map(|c| {
            if c.is_ascii_alphanumeric() || "-_ ".contains(c) {
                c
            } else {
                '-'
            }
        })
        .take(24)
        .collect();
    let mut text = String::from(
        "/* Written by HapDef Studio with the report of this limb: put it beside hapd.ino.\n * Which channel is which gauge:\n",
    );
    for c in &wiring.channels {
        let _ = writeln!(
            text,
            " *   gauge {:>2}: channel {:>2}, pin {}",
            c.gauge, c.channel, c.pin
        );
    }
    let _ = write!(
        text,
        " */\n#ifndef HAPD_CONFIG_H\n#define HAPD_CONFIG_H\n\n#define HAPD_PINS {{{}}}\n#define HAPD_BOARD 0x{board:08X}\n#define HAPD_NAME \"{name}\"\n#define HAPD_REFERENCE_MV {:.0}\n#define HAPD_SUPPLY_MV {:.0}\n#define HAPD_GAIN_MILLI {:.0}\n\n#endif\n",
        pins.join(", "),
        units::thousandths(chain.reference_v),
        units::thousandths(chain.supply_v),
        units::thousandths(chain.gain)
    );
    text
}

/// What must be bought: item, how many, and what for.
#[must_use]
pub fn bill(wiring: &Wiring) -> Vec<[String; 3]> {
    let gauges = wiring.channels.len();
    let arms = usize::from(wiring.chain.active_arms.clamp(1, 4));
    let cable: f64 = wiring.channels.iter().map(|c| c.cable).sum();
    let item = |what: &str, count: String, about: &str| [what.to_owned(), count, about.to_owned()];
    vec![
        item(
            &format!("strain gauge {RESISTANCE:.0} Ω"),
            (gauges * arms).to_string(),
            &format!("gauge factor {}", wiring.chain.gauge_factor),
        ),
        item(
            &format!("resistor {RESISTANCE:.0} Ω, 0.1 %, 25 ppm/K"),
            (gauges * (4 - arms)).to_string(),
            "bridges; or gauges that are not glued, beside the glued ones",
        ),
        item(
            "trimmer 10 kΩ with resistor 47 kΩ",
            gauges.to_string(),
            "to trim a bridge to the middle",
        ),
        item(
            "amplifier channel",
            gauges.to_string(),
            &format!("difference amplifier, ×{}", wiring.chain.gain),
        ),
        item(
            &format!("converter channel, {} bits", wiring.chain.bits),
            gauges.to_string(),
            &format!("to {} V; an Arduino Due has 12", wiring.chain.reference_v),
        ),
        item(
            "cable, three strands of 0.1 mm² (m)",
            format!("{:.1}", cable * 1.2),
            "along the wall to the foot, with 15 cm to the plug",
        ),
        item(
            "strain gauge adhesive, two components",
            "1".into(),
            "with cleaner and coating",
        ),
        item(
            "absorbent wool, separating film, adhesive tape",
            "1".into(),
            "between pads and gauges",
        ),
    ]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gauge::Gauge;

    fn gauge(number: usize, strain: [f64; 2]) -> GluedGauge {
        GluedGauge {
            number,
            gauge: Gauge {
                position: DVec3::ZERO,
                direction: DVec3::Z,
                normal: DVec3::X,
            },
            strain,
            rms: 0.0,
        }
    }

    #[test]
    fn board_project_and_labels_say_the_same() {
        let gauges = [gauge(1, [-200e-6, 100e-6]), gauge(2, [0.0, 400e-6])];
        let made = wiring(
            &gauges,
            &[5, 0],
            &[0.03, 0.07],
            Chain::default(),
            [10.0, 30.0],
        );
        let header = header(&made, "my \"limb\"", 0xABC);
        for line in [
            "#define HAPD_PINS {A0, A1, A2, A3, A4, A5}",
            "gauge  1: channel  5, pin A5",
            "#define HAPD_NAME \"my -limb-\"",
            "#define HAPD_BOARD 0x00000ABC",
            "#define HAPD_SUPPLY_MV 5000",
            "#define HAPD_GAIN_MILLI 330000",
        ] {
            assert!(header.contains(line), "{header}");
        }
        // 2.5 V · GF 2 · 400 µε · 330 at 4096 counts for 3.3 V.
        assert!((made.channels[1].counts[1] - 1.0e-3 * 330.0 / 3.3 * 4096.0 * 1.0).abs() < 1.0);
        // With a gain of that, 30 N take 0.8 of the half of the range.
        let volts = 5.0 * 2.0 / 4.0 * 1200e-6 * made.most_gain;
        assert!((volts - 0.8 * 1.65).abs() < 1e-9, "{volts}");
        assert!(made.words()[2].contains("no more than ×440") || made.most_gain > 330.0);
        // A count at the gain that 30 N leave is a microstrain or less.
        assert_eq!(made.words().len(), 3);
        let coarse = wiring(
            &[gauge(1, [0.0, 4000e-6])],
            &[0],
            &[0.03],
            Chain::default(),
            [10.0, 30.0],
        );
        // 0.977 µε at ×330, and ×44 is left.
        let said = coarse.words()[3].clone();
        assert!(
            said.contains("a gain of ×44 a count is 7.3 µε, which adds 2.1 µε"),
            "{said}"
        );
        let bought = bill(&made);
        assert_eq!((bought[0][1].as_str(), bought[1][1].as_str()), ("2", "6"));
    }
}

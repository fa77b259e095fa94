//! What live touch needs to know beside the design.

use serde::{Deserialize, Serialize};

use super::key::{ValueRange, above, from};
use super::keys::keys;
use super::press::PressKeys;
use super::ranges::{FRICTION, PLACES};
use super::selection::ChosenSite;
use super::value::BadValue;
use crate::inference::{AsGlued, Calibration, Chain, GluingCovariance};
use crate::live::PipelineSettings;
use crate::wire::MOST_CHANNELS;

keys! {
    /// Keys of the table `live`.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct LiveKeys in "live" {
        #[serde(skip_serializing_if = "Vec::is_empty")]
        channels: Vec<usize> = Vec::new(), "", ValueRange::Whole(0, MOST_CHANNELS as u64 - 1),
            "the board's channel (from 0) of each gauge, [0, 1, …]; in their order when left out";
        gauge_factor: f64 = Chain::default().gauge_factor, "", above(0.0, 1e4),
            "relative change of resistance over strain";
        active_arms: u8 = Chain::default().active_arms, "", ValueRange::Whole(1, 4),
            "of each bridge, that the strain changes; a gauge with a dummy is 1";
        model_error: f64 = 0.0, "", from(0.0, 1.0),
            "what the model is off by beside gluing, as a share of the reading, where its elements leave less; a calibration finds it";
        // What is usual is not serialized, as of `touch.forces_n`.
        #[serde(skip_serializing_if = "is_usual_stiffness")]
        stiffness_percent: f64 = STIFFNESS_PERCENT, "%", from(0.0, 50.0),
            "how far off the part's stiffness is (standard deviation): forces are off by it, no places";
        #[serde(skip_serializing_if = "is_usual_friction")]
        friction_percent: f64 = FRICTION_PERCENT, "%", FRICTION,
            "how much of a touch's force may push along the surface (rms, in any direction), where that is more than touches are said to have: found with place and force; 0: touches press straight in";
        largest_force_n: f64 = 60.0, "N", above(0.0, 1e6),
            "nobody presses harder";
        drift_s: f64 = 3.0, "s", from(0.0, 1e6),
            "time in which the rest follows what is read without a touch; 0: never";
    } with {
        /// How the gauges were found to be glued, one each, by known touches.
        #[serde(rename = "glued", skip_serializing_if = "Vec::is_empty")]
        glued: Vec<GluedKeys> = Vec::new();
        /// The known touches that say so.
        #[serde(rename = "press", skip_serializing_if = "Vec::is_empty")]
        presses: Vec<PressKeys> = Vec::new();
    }
}

/// The modulus of a plastic that was printed or moulded, and its wall.
const STIFFNESS_PERCENT: f64 = 5.0;

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks with a reference"
)]
fn is_usual_stiffness(percent: &f64) -> bool {
    *percent == STIFFNESS_PERCENT
}

/// A finger that pushes fifteen degrees off the upright.
const FRICTION_PERCENT: f64 = 25.0;

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks with a reference"
)]
fn is_usual_friction(percent: &f64) -> bool {
    *percent == FRICTION_PERCENT
}

keys! {
    /// One gauge as it was found to be glued.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct GluedKeys in "live.glued" {
        gain: f64, "", above(0.0, 1e6),
            "a gauge as known touches found it to be glued: what its readings are multiplied by";
        along_mm: f64, "mm", from(-1e6, 1e6),
            "how far along itself it lies from where it was drawn";
        across_mm: f64, "mm", from(-1e6, 1e6),
            "how far across itself";
        turned_degrees: f64, "°", from(-1e6, 1e6),
            "how far it is turned from its direction";
        #[serde(skip_serializing_if = "Option::is_none")]
        covariance: Option<GluingCovariance>, "", from(-1e6, 1e6),
            "of these four, what is not known: its upper triangle";
        #[serde(skip_serializing_if = "Option::is_none")]
        site: Option<[f64; 6]>, "mm", PLACES,
            "where its gauge was chosen to be, and its direction: of one elsewhere this says nothing";
    }
}

impl GluedKeys {
    /// Whether it may be of a gauge that is chosen to be there.
    fn is_of(&self, site: &ChosenSite) -> bool {
        self.site.is_none_or(|known| known == numbers(site))
    }
}

fn numbers(site: &ChosenSite) -> [f64; 6] {
    let [x, y, z] = site.position_mm;
    let [u, v, w] = site.direction;
    [x, y, z, u, v, w]
}

impl LiveKeys {
    /// Takes over what known touches have shown of the gauges at these sites, and the touches.
    pub fn take(
        &mut self,
        calibration: &Calibration,
        sites: &[ChosenSite],
        presses: Vec<PressKeys>,
    ) {
        let keys = |((glued, doubt), site): ((&AsGlued, &GluingCovariance), &ChosenSite)| {
            let AsGlued {
                gain,
                along_mm,
                across_mm,
                turned_degrees,
            } = *glued;
            GluedKeys {
                gain,
                along_mm,
                across_mm,
                turned_degrees,
                covariance: Some(*doubt),
                site: Some(numbers(site)),
            }
        };
        let glued = calibration.glued.iter().zip(&calibration.doubts);
        self.glued = glued.zip(sites).map(keys).collect();
        self.model_error = calibration.relative;
        self.presses = presses;
    }

    /// What the model is off by for gauges anywhere (share of a reading): what somebody has said. What a calibration found
    /// is of the gauges that are glued, and no reason to choose others.
    #[must_use]
    pub fn model_error_of_any(&self) -> f64 {
        if self.glued.is_empty() {
            self.model_error
        } else {
            0.0
        }
    }

    /// Forgets it.
    pub fn forget(&mut self) {
        self.glued.clear();
        self.presses.clear();
        self.model_error = Self::default().model_error;
    }

    /// The known touches of the gauges at these very sites.
    pub fn presses_of(&self, sites: &[ChosenSite]) -> impl Iterator<Item = &PressKeys> {
        let (is_of, gauges) = (self.is_of(sites), sites.len());
        (self.presses.iter()).filter(move |p| is_of && p.reading_microstrain.len() == gauges)
    }

    /// How each gauge is glued; nothing without a calibration of the gauges at these very sites.
    #[must_use]
    pub fn glued(&self, sites: &[ChosenSite]) -> Option<Vec<AsGlued>> {
        let values = |g: &GluedKeys| AsGlued {
            gain: g.gain,
            along_mm: g.along_mm,
            across_mm: g.across_mm,
            turned_degrees: g.turned_degrees,
        };
        (self.is_of(sites)).then(|| self.glued.iter().map(values).collect())
    }

    /// What is not known of each gauge; nothing without a calibration of these gauges that says so of all of them.
    #[must_use]
    pub fn doubts(&self, sites: &[ChosenSite]) -> Option<Vec<GluingCovariance>> {
        if !self.is_of(sites) {
            return None;
        }
        self.glued.iter().map(|g| g.covariance).collect()
    }

    /// Whether there is a calibration, and of the gauges at these sites.
    fn is_of(&self, sites: &[ChosenSite]) -> bool {
        let mut pairs = self.glued.iter().zip(sites);
        self.glued.len() == sites.len() && !sites.is_empty() && pairs.all(|(g, s)| g.is_of(s))
    }

    /// The first two gauges (from 0) that are on one channel, and that channel.
    #[must_use]
    pub fn shared_channel(&self) -> Option<(usize, usize, usize)> {
        (self.channels.iter().enumerate()).find_map(|(second, channel)| {
            let first = self.channels[..second].iter().position(|c| c == channel)?;
            Some((first, second, *channel))
        })
    }

    /// Whether channels and calibration are of the gauges at these sites; where they are not, they hold for none.
    ///
    /// # Errors
    /// [`BadValue`] naming the key.
    pub fn check_gauges(&self, sites: &[ChosenSite]) -> Result<(), BadValue> {
        let gauges = sites.len();
        for (key, count) in [
            ("live.channels", self.channels.len()),
            ("live.glued", self.glued.len()),
        ] {
            if count != 0 && count != gauges {
                return Err(BadValue {
                    key: key.to_owned(),
                    rule: "one entry for each chosen gauge, or left out".into(),
                    value: format!("{count} for {gauges} gauges"),
                });
            }
        }
        let pairs = self.glued.iter().zip(sites);
        let other = pairs
            .enumerate()
            .find(|(_, (glued, site))| !glued.is_of(site));
        other.map_or(Ok(()), |(k, _)| {
            Err(BadValue {
                key: "live.glued.site".to_owned(),
                rule: "where its gauge is chosen to be: calibrate again, or take the tables [[live.glued]] out".into(),
                value: format!("another place or direction for gauge {}", k + 1),
            })
        })
    }

    /// Settings of the pipeline for so many gauges.
    #[must_use]
    pub fn settings(&self, gauges: usize) -> PipelineSettings {
        let plain = PipelineSettings::of(gauges);
        PipelineSettings {
            chain: Chain {
                gauge_factor: self.gauge_factor,
                active_arms: self.active_arms,
                ..plain.chain
            },
            channels: if self.channels.len() == gauges {
                self.channels.clone()
            } else {
                plain.channels.clone()
            },
            relative: self.model_error,
            most_force: self.largest_force_n,
            drift_s: (self.drift_s > 0.0).then_some(self.drift_s),
            ..plain
        }
    }
}

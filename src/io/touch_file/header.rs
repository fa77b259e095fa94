//! What a trained estimator's file says of itself.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::design::{Learned, TaughtKnowledge, TrainingOutcome};
use crate::io::FileError;
use crate::io::fingerprint::Fingerprint;
use crate::learning::machine::{self, Regression};
use crate::learning::targets::{Scale, TargetFrame};
use crate::learning::train::MethodTrial;
use crate::learning::{Family, Method, Scores, TouchEstimator, kernel::Kernel};
use crate::plain::quote;
use crate::study::Data;

const FORMAT: &str = "hapdtouch";
/// Of files of regressions, and of matching.
const VERSIONS: [u32; 2] = [1, 2];
/// The longest header that can be meant (bytes).
const LONGEST: usize = 1 << 20;

/// What stands in the header.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimatorHeader {
    format: String,
    version: u32,
    /// Of the program that wrote it.
    program: String,
    /// What it was trained on, and how well it does.
    pub origin: TrainingOrigin,
    /// How many channels a reading has.
    pub channels: usize,
    #[serde(flatten)]
    pub(super) by: EstimatorSection,
}

/// What answers, beside its arrays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum EstimatorSection {
    Regression(Box<RegressionEntry>),
    Matching(Box<MatchingEntry>),
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct MatchingEntry {
    pub(super) matching: TaughtKnowledge,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RegressionEntry {
    pub(super) frame: FrameEntry,
    pub(super) place: MachineEntry,
    pub(super) doubt: DoubtEntry,
    pub(super) force: Option<ForceEntry>,
}

/// What an estimator was trained on, and how well it does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingOrigin {
    /// The name of the file of the data.
    pub data: String,
    /// Key of readings and places.
    pub fingerprint: String,
    /// Touches in the data.
    pub touches: usize,
    /// Touches that it learned from.
    pub train_touches: usize,
    /// Of the division of the touches.
    pub seed: u64,
    /// How it answers.
    pub estimator: Method,
    /// Mean error on the touches that it was chosen by (mm).
    pub validation_mm: f64,
    /// What else was tried.
    pub tried: Vec<MethodTrial>,
    /// On touches that nobody learned from.
    pub test: Scores,
    /// The limb, where it is known.
    pub limb: Option<String>,
    /// The board, where it is known.
    pub board: Option<String>,
    /// What it was brought up to date by, the last time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub update: Option<UpdateSection>,
}

impl TrainingOrigin {
    /// Of a training with a seed on data of a name; limb and board are not known yet.
    #[must_use]
    pub fn of(outcome: &TrainingOutcome, data: &Data, name: &str, seed: u64) -> Self {
        Self {
            data: name.to_owned(),
            fingerprint: fingerprint(data),
            touches: data.targets.len(),
            train_touches: outcome.division.train.len(),
            seed,
            estimator: outcome.method,
            validation_mm: outcome.validation_mm,
            tried: outcome.tried.clone(),
            test: outcome.scores.clone(),
            limb: None,
            board: None,
            update: None,
        }
    }
}

/// Which data something was learned from.
#[must_use]
pub fn fingerprint(data: &Data) -> String {
    let mut key = Fingerprint::default();
    key.add_numbers(data.x.values());
    key.add_numbers(data.targets.iter().flatten());
    key.hex()
}

/// New presses that an estimator was brought up to date by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UpdateSection {
    /// The name of the file of the data.
    pub data: String,
    /// Key of readings and places.
    pub fingerprint: String,
    /// How many there were.
    pub presses: usize,
    /// Mean error on them before (mm); that after it stands under `test`, each judged by the others.
    pub before_mm: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FrameEntry {
    pub(super) middle_mm: [f64; 3],
    pub(super) axes: Vec<[f64; 3]>,
    pub(super) size_mm: f64,
}

/// How known touches answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum MachineEntry {
    Kernel(Kernel),
    Nearest(usize),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DoubtEntry {
    pub(super) usual: f64,
    pub(super) factor: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ForceEntry {
    pub(super) estimator: Family,
    pub(super) middle_n: f64,
    pub(super) size_n: f64,
    pub(super) machine: MachineEntry,
}

/// What every version says first.
#[derive(Deserialize)]
struct First {
    format: String,
    version: u32,
}

impl EstimatorHeader {
    pub(super) fn new(origin: TrainingOrigin, estimator: &Learned) -> Self {
        let (version, by) = match estimator {
            Learned::Regression(estimator) => {
                let entry = RegressionEntry::new(estimator);
                (VERSIONS[0], EstimatorSection::Regression(Box::new(entry)))
            }
            Learned::Matching(taught) => {
                let matching = taught.known;
                (
                    VERSIONS[1],
                    EstimatorSection::Matching(Box::new(MatchingEntry { matching })),
                )
            }
        };
        Self {
            format: FORMAT.to_owned(),
            version,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            origin,
            channels: estimator.channels(),
            by,
        }
    }

    /// From the numbers of its array.
    pub(super) fn read(path: &Path, values: &[f64]) -> Result<Self, FileError> {
        let broken = |what: &str| FileError::broken(path, what);
        if values.len() > LONGEST {
            return Err(broken("its header is too long to be one. Train it again"));
        }
        let bytes: Option<Vec<u8>> = values
            .iter()
            .map(|&v| (v.fract() == 0.0 && (0.0..256.0).contains(&v)).then_some(v as u8))
            .collect();
        let text = bytes.and_then(|bytes| String::from_utf8(bytes).ok());
        let text = text.ok_or_else(|| broken("its header is no text. Train it again"))?;
        let first: First = parse(path, &text)?;
        if first.format != FORMAT {
            return Err(broken(&format!(
                "this is no trained estimator, but {}. Make one with hapdef train",
                quote(&first.format)
            )));
        }
        if !VERSIONS.contains(&first.version) {
            return Err(broken(&format!(
                "it is of version {} of the format, and this program reads versions {} and {}. Train it again, or use the program that wrote it",
                first.version, VERSIONS[0], VERSIONS[1]
            )));
        }
        let header: Self = parse(path, &text)?;
        header
            .check()
            .map_err(|what| broken(&format!("its header says that {what}. Train it again")))?;
        Ok(header)
    }

    /// That frames are frames, and spreads are spreads.
    fn check(&self) -> Result<(), String> {
        match &self.by {
            EstimatorSection::Regression(entry) => entry.check(),
            EstimatorSection::Matching(entry) => check_known(&entry.matching),
        }
    }
}

impl RegressionEntry {
    fn new(estimator: &TouchEstimator) -> Self {
        let TargetFrame { middle, axes, size } = &estimator.frame;
        Self {
            frame: FrameEntry {
                middle_mm: *middle,
                axes: axes.clone(),
                size_mm: *size,
            },
            place: entry(&estimator.place),
            doubt: DoubtEntry {
                usual: estimator.doubt.usual,
                factor: estimator.doubt.factor,
            },
            force: estimator.force.as_ref().map(|force| ForceEntry {
                estimator: force.family,
                middle_n: force.scale.middle,
                size_n: force.scale.size,
                machine: entry(&force.machine),
            }),
        }
    }

    fn check(&self) -> Result<(), String> {
        let axes = &self.frame.axes;
        if !(1..=3).contains(&axes.len()) {
            return Err(format!("places spread in {} directions", axes.len()));
        }
        not_negative("the size of the skin", self.frame.size_mm)?;
        not_negative("the usual distance", self.doubt.usual)?;
        not_negative("the factor of the radius", self.doubt.factor)?;
        if let Some(force) = &self.force {
            not_negative("the size of forces", force.size_n)?;
        }
        Ok(())
    }

    pub(super) fn frame(&self) -> TargetFrame {
        TargetFrame {
            middle: self.frame.middle_mm,
            axes: self.frame.axes.clone(),
            size: self.frame.size_mm,
        }
    }
}

fn check_known(known: &TaughtKnowledge) -> Result<(), String> {
    if known.noise <= 0.0 || known.most_force <= 0.0 {
        return Err("readings have no noise, or nobody presses".to_owned());
    }
    for (what, value) in [
        ("the noise", known.noise),
        ("what the map leaves", known.relative),
        ("the largest force", known.most_force),
        ("the spread of the tip", known.tip),
        ("the friction", known.friction),
        ("the drift", known.drift),
        ("the spread of the stiffness", known.stiffness),
    ] {
        not_negative(what, value)?;
    }
    Ok(())
}

fn not_negative(what: &str, value: f64) -> Result<(), String> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(format!("{what} is {value:e}"))
}

impl ForceEntry {
    pub(super) fn scale(&self) -> Scale {
        Scale {
            middle: self.middle_n,
            size: self.size_n,
        }
    }
}

fn entry(machine: &Regression) -> MachineEntry {
    match &machine.by {
        machine::AnswerRule::Kernel { kernel, .. } => MachineEntry::Kernel(*kernel),
        machine::AnswerRule::Nearest { count, .. } => MachineEntry::Nearest(*count),
    }
}

fn parse<'a, T: Deserialize<'a>>(path: &Path, text: &'a str) -> Result<T, FileError> {
    serde_json::from_str(text).map_err(|e| {
        let what = crate::plain::json(&e);
        FileError::broken(
            path,
            format!("its header is damaged: {what}. Train it again"),
        )
    })
}

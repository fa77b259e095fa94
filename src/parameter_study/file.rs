//! A study as its file has it.

use serde::{Deserialize, Serialize};

use super::axis::StudyAxis;
use super::front::Aim;
use super::service::ServiceLoad;
use crate::budget::Quality;

/// Version of the file's format.
const FORMAT: u32 = 1;

/// A study as its file has it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterStudy {
    format: u32,
    /// How the axes are combined.
    #[serde(default)]
    pub combine: Combine,
    /// Units of a sequence; a grid and a list have as many as their axes say.
    pub count: Option<usize>,
    /// Of a sequence's random draws.
    #[serde(default)]
    pub seed: u64,
    /// What is varied.
    pub base: StudyBase,
    /// Along what.
    #[serde(default, rename = "axis")]
    pub axes: Vec<StudyAxis>,
    /// What the part carries in use.
    #[serde(default)]
    pub service: Vec<ServiceLoad>,
    /// What is wanted of it.
    #[serde(default)]
    pub aim: Aim,
}

/// How axes are combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// Every value with every other, the last axis fastest.
    #[default]
    Grid,
    /// The first values of all, the second ones, and so on.
    List,
    /// A low-discrepancy sequence (I. M. Sobol, USSR Comput. Math. Math. Phys. 7, 1967), shifted at random.
    Sobol,
    /// Each axis divided into as many parts as there are units, each part taken once (M. D. `McKay`, R. J. Beckman and
    /// W. J. Conover, Technometrics 21, 1979).
    LatinHypercube,
}

/// What is varied.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyBase {
    /// A project or a mesh, relative to the study's file.
    pub project: Option<String>,
    /// The bundled limb, or one of its family.
    #[serde(default)]
    pub limb: bool,
    /// Instead of the project's own.
    pub quality: Option<Quality>,
    /// Instead of the project's own.
    pub seed: Option<u64>,
    /// Of what the part is made of (g/cm³): printed nylon.
    #[serde(default = "nylon")]
    pub density_g_cm3: f64,
}

fn nylon() -> f64 {
    1.01
}

impl ParameterStudy {
    /// Parses a study's text, and checks all but how its axes are combined.
    ///
    /// # Errors
    /// A message in the user's terms.
    pub(super) fn of_text(text: &str) -> Result<Self, String> {
        let study: Self = toml::from_str(text).map_err(|e| {
            let line = e
                .span()
                .map_or(1, |s| 1 + text[..s.start].matches('\n').count());
            format!("line {line}: {}", e.message())
        })?;
        study.check()?;
        Ok(study)
    }

    /// Values of the axis that changes fastest: neighbours among so many units differ in nothing else.
    #[must_use]
    pub fn fastest(&self) -> usize {
        match self.combine {
            Combine::Grid => self
                .axes
                .last()
                .and_then(|a| Some(a.listed()?.len()))
                .unwrap_or(1),
            _ => 1,
        }
    }

    fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!(
                "format {} is not read by this version: set format = {FORMAT}",
                self.format
            ));
        }
        if self.base.limb == self.base.project.is_some() {
            return Err("[base] names a project (project = \"…\") or the limb of the program (limb = true): one of the two".into());
        }
        if !(1e-3..=30.0).contains(&self.base.density_g_cm3) {
            return Err("density_g_cm3 is between 0.001 and 30".into());
        }
        for load in &self.service {
            load.check()?;
        }
        for (k, axis) in self.axes.iter().enumerate() {
            axis.check()?;
            if self.axes[..k].iter().any(|other| other.key == axis.key) {
                return Err(format!("the axis {} stands twice", axis.key));
            }
        }
        Ok(())
    }
}

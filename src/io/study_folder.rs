//! The folder of a parameter study: its plan, a file for each unit that was computed, and what is collected of them.
//!
//! | file | holds |
//! |---|---|
//! | `study.toml` | the study, as it was when it was planned |
//! | `plan.json` | how many units there are, and what they were planned from |
//! | `units.csv` | the values of every unit |
//! | `results/000017.json` | what unit 17 found: the same bytes whoever computes it |
//! | `costs/000017.json` | what that took |
//! | `shared/KEY.npz` | a simulation that several units need, while one of them is missing ([`super::kept_simulation`]) |

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::fingerprint::Fingerprint;
use super::{FileError, atomic, project_file, source};
use crate::parameter_study::{ParameterStudy, Points, parse};

/// What was planned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyPlan {
    /// Of this program: units of another would find something else.
    pub version: String,
    /// Of the study's text.
    pub study: String,
    /// Of the base project or mesh.
    pub base: String,
    /// Of the files of the meshes that axes name; nothing of one that was not there.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub meshes: BTreeMap<String, String>,
    /// The folder that the study's paths start from: relative to this one where it can be.
    pub from: String,
    /// How many there are, counted from 0.
    pub units: usize,
}

/// What came of a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitOutcome {
    pub version: String,
    /// As the plan's.
    pub study: String,
    pub base: String,
    pub unit: usize,
    /// The value of each axis.
    pub values: Map<String, Value>,
    /// Each figure, or null; in the order of their columns.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<(String, Option<f64>)>,
    /// Why there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// What a reader must know of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cautions: Vec<String>,
}

/// What a unit took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitCost {
    pub unit: usize,
    pub cpu_seconds: f64,
    pub seconds: f64,
    /// Whether it took another unit's simulation.
    pub shared: bool,
}

/// A folder with a plan in it.
pub struct StudyFolder {
    pub folder: PathBuf,
    pub study: ParameterStudy,
    pub plan: StudyPlan,
}

const STUDY: &str = "study.toml";
const PLAN: &str = "plan.json";
const UNITS: &str = "units.csv";
const RESULTS: &str = "results";
const COSTS: &str = "costs";
const SHARED: &str = "shared";

/// A study from its file.
///
/// # Errors
/// [`FileError`] with what is wrong in it.
pub fn read_study(path: &Path) -> Result<(ParameterStudy, String), FileError> {
    let text = source::read_text(path)?;
    let study = parse(&text).map_err(|why| FileError::broken(path, why))?;
    Ok((study, text))
}

/// Of a text.
#[must_use]
pub fn fingerprint(text: &str) -> String {
    let mut key = Fingerprint::default();
    key.add(text.bytes());
    key.hex()
}

impl StudyFolder {
    /// Plans a study into a folder. One that is planned there already for the same study and base stays, with all that was
    /// computed.
    ///
    /// # Errors
    /// [`FileError`] where another study was planned there, or nothing can be written.
    pub fn plan(
        folder: &Path,
        study_path: &Path,
        base: String,
        meshes: BTreeMap<String, String>,
    ) -> Result<Self, FileError> {
        let (study, text) = read_study(study_path)?;
        let points = Points::of(&study).map_err(|why| FileError::broken(study_path, why))?;
        for inner in [RESULTS, COSTS, "logs"] {
            let path = folder.join(inner);
            std::fs::create_dir_all(&path).map_err(|e| FileError::of(&path, &e))?;
        }
        let home = study_path.parent().unwrap_or(Path::new(""));
        let home = if home.as_os_str().is_empty() {
            Path::new(".")
        } else {
            home
        };
        let plan = StudyPlan {
            version: env!("CARGO_PKG_VERSION").into(),
            study: fingerprint(&text),
            base,
            meshes,
            from: project_file::relative_to(&folder.join(PLAN), home),
            units: points.count(),
        };
        if folder.join(PLAN).exists() {
            let old = Self::open(folder)?;
            // Plans of before have no meshes.
            let same_meshes = old.plan.meshes.is_empty() || old.plan.meshes == plan.meshes;
            if (&old.plan.study, &old.plan.base) != (&plan.study, &plan.base) || !same_meshes {
                return Err(FileError::broken(
                    folder,
                    "another study was planned here, or this one from another base or other meshes. Choose another folder",
                ));
            }
            return Ok(old);
        }
        atomic::write(&folder.join(UNITS), units_csv(&study, &points).as_bytes())?;
        atomic::write(&folder.join(STUDY), text.as_bytes())?;
        let text = serde_json::to_string_pretty(&plan).map_err(|e| FileError::broken(folder, e))?;
        // The last one: where it is, all are.
        atomic::write(&folder.join(PLAN), text.as_bytes())?;
        let folder = folder.to_owned();
        Ok(Self {
            folder,
            study,
            plan,
        })
    }

    /// Opens a folder that was planned.
    ///
    /// # Errors
    /// [`FileError`] where there is no plan, or one of another version.
    pub fn open(folder: &Path) -> Result<Self, FileError> {
        let path = folder.join(PLAN);
        if !path.exists() {
            return Err(FileError::broken(
                folder,
                "no study was planned here: hapdef study plan STUDY --out FOLDER",
            ));
        }
        let plan: StudyPlan = serde_json::from_str(&source::read_text(&path)?).map_err(|e| {
            FileError::broken(&path, format!("this is no plan ({e}). Plan the study anew"))
        })?;
        let (study, text) = read_study(&folder.join(STUDY))?;
        if plan.version != env!("CARGO_PKG_VERSION") {
            return Err(FileError::broken(
                &path,
                format!(
                    "it was planned by version {}, and this is {}: units of both would not compare. Plan the study anew into another folder",
                    crate::plain::quote(&plan.version),
                    env!("CARGO_PKG_VERSION")
                ),
            ));
        }
        if plan.study != fingerprint(&text) {
            return Err(FileError::broken(
                &folder.join(STUDY),
                "it was changed after it was planned. Plan the study anew into another folder",
            ));
        }
        let folder = folder.to_owned();
        Ok(Self {
            folder,
            study,
            plan,
        })
    }

    /// Where the study's paths start from.
    #[must_use]
    pub fn home(&self) -> PathBuf {
        self.folder.join(&self.plan.from)
    }

    fn result_path(&self, unit: usize) -> PathBuf {
        self.folder.join(RESULTS).join(format!("{unit:06}.json"))
    }

    /// Where simulations lie that several units need.
    #[must_use]
    pub fn shared(&self) -> PathBuf {
        self.folder.join(SHARED)
    }

    /// Takes away what lies there, where no unit is missing any more.
    pub fn tidy_shared(&self) {
        let shared = self.shared();
        if shared.is_dir() && (0..self.plan.units).rev().all(|unit| self.is_done(unit)) {
            // Whatever stays costs room and nothing else.
            let _ = std::fs::remove_dir_all(shared);
        }
    }

    /// Whether anything was written of a unit.
    #[must_use]
    pub fn is_done(&self, unit: usize) -> bool {
        self.result_path(unit).exists()
    }

    /// Writes what came of a unit, and what that took.
    ///
    /// # Errors
    /// [`FileError`] when either cannot be written.
    pub fn write(&self, outcome: &UnitOutcome, cost: &UnitCost) -> Result<(), FileError> {
        let path = self.result_path(outcome.unit);
        let text =
            serde_json::to_string_pretty(outcome).map_err(|e| FileError::broken(&path, e))?;
        let cost_path = self
            .folder
            .join(COSTS)
            .join(format!("{:06}.json", cost.unit));
        atomic::write(&cost_path, json!(cost).to_string().as_bytes())?;
        atomic::write(&path, text.as_bytes())
    }

    /// What came of a unit; nothing where it was not computed, or is of another plan.
    ///
    /// # Errors
    /// [`FileError`] where there is something that cannot be read.
    pub fn outcome(&self, unit: usize) -> Result<Option<UnitOutcome>, FileError> {
        let path = self.result_path(unit);
        let text = match source::read_text(&path) {
            Ok(text) => text,
            Err(FileError::Missing { .. }) => return Ok(None),
            Err(error) => return Err(error),
        };
        let outcome: UnitOutcome = serde_json::from_str(&text).map_err(|e| {
            FileError::broken(
                &path,
                format!("this is no result ({e}). Remove it and run the unit again"),
            )
        })?;
        let plan = &self.plan;
        let own = (
            &outcome.version,
            &outcome.study,
            &outcome.base,
            outcome.unit,
        ) == (&plan.version, &plan.study, &plan.base, unit);
        Ok(own.then_some(outcome))
    }

    /// What a unit took, where that is known.
    #[must_use]
    pub fn cost(&self, unit: usize) -> Option<UnitCost> {
        let path = self.folder.join(COSTS).join(format!("{unit:06}.json"));
        serde_json::from_str(&source::read_text(&path).ok()?).ok()
    }
}

fn units_csv(study: &ParameterStudy, points: &Points) -> String {
    use super::table::Writing;
    let names = std::iter::once("unit").chain(study.axes.iter().map(|a| a.key.as_str()));
    let mut table = Writing::new(names);
    for unit in 0..points.count() {
        let values = points
            .values(unit)
            .into_iter()
            .map(|v| in_a_cell(&plain(&v)));
        table.row(std::iter::once(unit.to_string()).chain(values));
    }
    table.text()
}

/// A value of a project as JSON.
#[must_use]
pub fn plain(value: &toml::Value) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

/// A value in a table: texts as they are.
#[must_use]
pub fn in_a_cell(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

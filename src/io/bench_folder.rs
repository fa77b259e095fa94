//! The folder of a run of the test-bed: what is pressed, and the recordings of it.
//!
//! | file | holds |
//! |---|---|
//! | `bench.json` | the limb, the machine, the limits and how readings become strains |
//! | `plan.csv` | the places, in their order |
//! | `answer.json` | what the limb answered at first where it is pressed again and again |
//! | `part-001.hapdrec` … | what was read, a file for each time that it was begun; only ever appended to |

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::fingerprint::Fingerprint;
use super::npz::{self, NpzFile};
use super::table::Writing;
use super::{FileError, atomic, points, source};
use crate::bench::CheckedForce;
use crate::design::Inputs;

const FORMAT: u32 = 1;
const ABOUT: &str = "bench.json";
const ANSWER: &str = "answer.json";
/// The planned places.
pub const PLAN: &str = "plan.csv";

/// Arrays of a dataset that say, letter by letter, which limb and which board it is of.
pub const LIMB: &str = "limb_key";
/// See [`LIMB`].
pub const BOARD: &str = "board_key";
/// The same of the machine that pressed, as its file describes it.
pub const MACHINE: &str = "machine_key";

/// What such an array of a dataset says; nothing where there is none.
///
/// # Errors
/// [`FileError`] where the dataset cannot be read.
pub fn key_in(data: &Path, name: &str) -> Result<Option<String>, FileError> {
    /// The longest that can be meant.
    const LONGEST: usize = 64;
    if data.extension().is_none_or(|e| e != "npz") || !npz::holds(data, name)? {
        return Ok(None);
    }
    let values = npz::Arrays::open(data)?.numbers(name)?.values;
    let letter =
        |v: &f64| (v.fract() == 0.0 && (32.0..127.0).contains(v)).then_some(*v as u8 as char);
    let text: Option<String> = values.iter().map(letter).collect();
    Ok(text.filter(|t| !t.is_empty() && t.len() <= LONGEST))
}

/// What is pressed, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressedPart {
    /// Of these files.
    pub format: u32,
    /// Key of the part and its gauges.
    pub limb: String,
    /// The text of the machine's file.
    pub machine: String,
    /// Of the places.
    pub seed: u64,
    /// Between two readings, and in all (mm).
    pub step_mm: f64,
    /// See [`Self::step_mm`].
    pub depth_mm: f64,
    /// What is enough, and what is never exceeded (N).
    pub force_n: f64,
    /// See [`Self::force_n`].
    pub most_force_n: f64,
    /// The board's channel of each gauge.
    pub channels: Vec<usize>,
    /// Of the gauges.
    pub gauge_factor: f64,
    /// See [`Self::gauge_factor`].
    pub active_arms: u8,
    /// Whether machine and board are simulated.
    pub simulated: bool,
    /// Whether somebody pressed, and no machine: its text may be empty then.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_hand: bool,
}

/// Key of a part and the gauges that were chosen on it: what an estimator was learned on.
#[must_use]
pub fn limb_key(inputs: &Inputs) -> String {
    let mut key = Fingerprint::default();
    key.add_part(inputs);
    for site in &inputs.project.selection.sites {
        key.add_numbers(site.position_mm.iter().chain(&site.direction));
    }
    key.hex()
}

impl PressedPart {
    /// The newest format, of everything else as given by the caller.
    #[must_use]
    pub fn format() -> u32 {
        FORMAT
    }

    /// Of a folder; nothing where none was begun in it.
    ///
    /// # Errors
    /// [`FileError`] where it cannot be read.
    pub fn read(folder: &Path) -> Result<Option<Self>, FileError> {
        let path = folder.join(ABOUT);
        if !path.exists() {
            return Ok(None);
        }
        let text = source::read_text(&path)?;
        let about: Self = serde_json::from_str(&text).map_err(|e| {
            FileError::broken(&path, format!("it is damaged: {}", crate::plain::json(&e)))
        })?;
        if about.format != FORMAT {
            let what = format!(
                "it is of format {}, and this program reads {FORMAT}",
                about.format
            );
            return Err(FileError::broken(&path, what));
        }
        Ok(Some(about))
    }

    /// Key of the machine; empty where somebody pressed by hand.
    #[must_use]
    pub fn machine_key(&self) -> String {
        if self.machine.is_empty() {
            return String::new();
        }
        let mut key = Fingerprint::default();
        key.add(self.machine.bytes());
        key.hex()
    }

    /// Into a folder.
    ///
    /// # Errors
    /// [`FileError`] where it cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), FileError> {
        let path = folder.join(ABOUT);
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| FileError::broken(&path, e.to_string()))?;
        atomic::write(&path, format!("{text}\n").as_bytes())
    }
}

/// What the limb answered at first where a run presses it again and again, if it was pressed there already.
///
/// # Errors
/// [`FileError`] where it cannot be read.
pub fn read_answer(folder: &Path) -> Result<Option<CheckedForce>, FileError> {
    let path = folder.join(ANSWER);
    if !path.exists() {
        return Ok(None);
    }
    let text = source::read_text(&path)?;
    let answer = serde_json::from_str(&text);
    answer
        .map(Some)
        .map_err(|e| FileError::broken(&path, format!("it is damaged: {}", crate::plain::json(&e))))
}

/// Writes it.
///
/// # Errors
/// [`FileError`] where it cannot be written.
pub fn write_answer(folder: &Path, answer: &CheckedForce) -> Result<(), FileError> {
    let path = folder.join(ANSWER);
    let text = serde_json::to_string_pretty(answer)
        .map_err(|e| FileError::broken(&path, e.to_string()))?;
    atomic::write(&path, format!("{text}\n").as_bytes())
}

/// Writes the places of a plan with their normals (m).
///
/// # Errors
/// [`FileError`] where it cannot be written.
pub fn write_plan(folder: &Path, places: &[(DVec3, DVec3)]) -> Result<(), FileError> {
    let mut table = Writing::new(["press", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz"]);
    for (k, (at, normal)) in places.iter().enumerate() {
        let numbers = (*at * 1e3).to_array().into_iter().chain(normal.to_array());
        // To the last bit: a run that is gone on with presses the same places.
        let cells = std::iter::once(k.to_string()).chain(numbers.map(|v| format!("{v:?}")));
        table.row(cells);
    }
    atomic::write(&folder.join(PLAN), table.text().as_bytes())
}

/// The places of a plan (m).
///
/// # Errors
/// [`FileError`] where it cannot be read.
pub fn read_plan(folder: &Path) -> Result<Vec<DVec3>, FileError> {
    let points = points::read_points(&folder.join(PLAN))?;
    Ok(points.into_iter().map(|p| p.position).collect())
}

/// The recordings of a folder, in the order in which they were made.
///
/// # Errors
/// [`FileError`] where the folder cannot be read.
pub fn parts(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let entries = std::fs::read_dir(folder).map_err(|e| FileError::of(folder, &e))?;
    let mut parts: Vec<PathBuf> = (entries.flatten())
        .map(|entry| entry.path())
        .filter(|path| number(path).is_some())
        .collect();
    parts.sort_by_key(|path| number(path));
    Ok(parts)
}

/// A name for the next one.
///
/// # Errors
/// [`FileError`] where the folder cannot be read.
pub fn next_part(folder: &Path) -> Result<PathBuf, FileError> {
    let last = parts(folder)?.iter().filter_map(|p| number(p)).max();
    Ok(folder.join(format!("part-{:03}.hapdrec", last.unwrap_or(0) + 1)))
}

fn number(path: &Path) -> Option<u32> {
    let name = path.file_name()?.to_str()?;
    let digits = name.strip_prefix("part-")?.strip_suffix(".hapdrec")?;
    digits.parse().ok()
}

/// Readings as a dataset: a column a touch.
#[derive(Clone, Debug, Default)]
pub struct TouchColumns {
    /// Strain of each gauge, a row a touch.
    pub strains: Vec<Vec<f64>>,
    /// m.
    pub places: Vec<DVec3>,
    /// N; empty where the tip has no sensor.
    pub forces: Vec<f64>,
    /// Of the tip from where it was first felt (m).
    pub depths: Vec<f64>,
    /// The press in the plan: touches of one are never divided.
    pub groups: Vec<u32>,
    /// On the board's clock (s).
    pub seconds: Vec<f64>,
    /// Of the board (°C); not a number where it did not say that.
    pub temperatures: Vec<f64>,
}

impl TouchColumns {
    /// Writes them as NPZ, with what they are of: the part, and the key of the board.
    ///
    /// # Errors
    /// [`FileError`] where it cannot be written.
    pub fn write_npz(
        &self,
        path: &Path,
        about: &PressedPart,
        board: &str,
    ) -> Result<(), FileError> {
        let build = || -> std::io::Result<NpzFile> {
            let mut file = NpzFile::default();
            let (touches, gauges) = (self.places.len(), self.strains.first().map_or(0, Vec::len));
            let x: Vec<f64> = (0..gauges)
                .flat_map(|g| self.strains.iter().map(move |s| s[g]))
                .collect();
            file.add("X", &[gauges, touches], &x)?;
            let places: Vec<f64> = self.places.iter().flat_map(DVec3::to_array).collect();
            file.add("p_m", &[touches, 3], &places)?;
            if !self.forces.is_empty() {
                file.add("force_n", &[touches], &self.forces)?;
            }
            file.add("depth_m", &[touches], &self.depths)?;
            file.add("time_s", &[touches], &self.seconds)?;
            if self.temperatures.iter().any(|t| t.is_finite()) {
                file.add("temperature_c", &[touches], &self.temperatures)?;
            }
            file.add("groups", &[touches], &self.groups)?;
            let machine = about.machine_key();
            for (name, key) in [(LIMB, &about.limb[..]), (BOARD, board), (MACHINE, &machine)] {
                file.add(name, &[key.len()], key.as_bytes())?;
            }
            Ok(file)
        };
        build().map_err(|e| FileError::of(path, &e))?.save(path)
    }

    /// Writes them as CSV, a row a touch.
    ///
    /// # Errors
    /// [`FileError`] where it cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), FileError> {
        let gauges = self.strains.first().map_or(0, Vec::len);
        let names = [
            "press",
            "t_s",
            "x_mm",
            "y_mm",
            "z_mm",
            "depth_mm",
            "force_n",
            "temperature_c",
        ];
        let microstrain = (0..gauges).map(|g| format!("gauge_{}_microstrain", g + 1));
        let mut table = Writing::new(names.map(str::to_owned).into_iter().chain(microstrain));
        for k in 0..self.places.len() {
            let p = self.places[k] * 1e3;
            let or_nothing = |value: Option<&f64>, digits: usize| {
                let value = value.filter(|v| v.is_finite());
                value.map_or(String::new(), |v| format!("{v:.digits$}"))
            };
            let mut cells = vec![
                self.groups[k].to_string(),
                format!("{:.6}", self.seconds[k]),
                format!("{:.4}", p.x),
                format!("{:.4}", p.y),
                format!("{:.4}", p.z),
                format!("{:.4}", self.depths[k] * 1e3),
                or_nothing(self.forces.get(k), 4),
                or_nothing(self.temperatures.get(k), 2),
            ];
            cells.extend(self.strains[k].iter().map(|s| format!("{:.4}", s * 1e6)));
            table.row(cells);
        }
        atomic::write(path, table.text().as_bytes())
    }
}

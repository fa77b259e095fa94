//! What a calibration found, for people, for programs, and as a table of its presses.

use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};

use crate::cli::out;
use crate::design::Sensing;
use crate::inference::calibration::judged::PressOutlook;
use crate::inference::{Calibration, KnownPress};
use crate::io::atomic;
use crate::io::table::Writing;
use crate::plain::digits;
use crate::project::PressKeys;

/// One press.
pub struct PressRow {
    /// mm.
    pub place: DVec3,
    /// N.
    pub force: f64,
    pub used: bool,
    /// Absent where nothing was read.
    pub known: Option<KnownPress>,
    /// Weighted squares a channel, by what the others foresee.
    pub misfit: Option<f64>,
    /// Why it is not used.
    pub why: Option<String>,
}

impl PressRow {
    /// Leaves it out.
    pub fn leave_out(&mut self, why: String) {
        (self.used, self.why) = (false, Some(why));
    }

    /// As a project keeps it, read by a board of this number; nothing where nothing was read.
    pub fn keys(&self, board: Option<&str>) -> Option<PressKeys> {
        let known = self.known.as_ref()?;
        Some(PressKeys {
            used: self.used,
            board: board.map(str::to_owned),
            ..PressKeys::new(self.place * 1e-3, self.force, &known.reading)
        })
    }

    fn json(&self) -> Value {
        json!({
            "x_mm": rounded(self.place.x),
            "y_mm": rounded(self.place.y),
            "z_mm": rounded(self.place.z),
            "force_n": self.force,
            "used": self.used,
            "misfit": self.misfit.map(rounded),
            "why": self.why,
        })
    }
}

/// What presses say of the supports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FittedBedding {
    /// That they do not give way is as likely as anything else.
    Firm,
    /// This bedding, and its standard deviation (N/mm³).
    Gives([f64; 2]),
}

/// What was found of the part, each with its standard deviation; nothing of what was not asked for.
#[derive(Default)]
pub struct FoundOfPart {
    /// Readings over those of the model, common to all gauges.
    pub factor: Option<[f64; 2]>,
    pub youngs_modulus_gpa: Option<[f64; 2]>,
    pub thickness_mm: Option<[f64; 2]>,
    pub bedding: Option<FittedBedding>,
}

/// What was found.
pub struct Summary {
    pub rows: Vec<PressRow>,
    pub calibration: Calibration,
    pub outlook: PressOutlook,
    pub of_part: FoundOfPart,
}

impl Summary {
    /// Says it.
    ///
    /// # Errors
    /// When it cannot be printed.
    pub fn print(&self, sensing: &Sensing, target: &Path, as_json: bool) -> anyhow::Result<()> {
        let percent: Vec<f64> = (self.outlook.doubts.iter())
            .map(|share| rounded(100.0 * share))
            .collect();
        let worth = self.outlook.worth();
        let mesh = &sensing.drawn.map.mesh;
        let places: Vec<DVec3> = (self.outlook.places.iter().take(worth))
            .map(|&at| mesh.point(at) * 1e3)
            .collect();
        if as_json {
            let next: Vec<Value> = (places.iter())
                .map(|p| json!([rounded(p.x), rounded(p.y), rounded(p.z)]))
                .collect();
            let summary = json!({
                "version": env!("CARGO_PKG_VERSION"),
                "project": target.display().to_string(),
                "presses": self.rows.iter().map(PressRow::json).collect::<Vec<_>>(),
                "used": self.calibration.touches,
                "model_error_percent": rounded(100.0 * self.calibration.relative),
                "unknown_percent": percent,
                "worth_more": worth,
                "next_mm": next,
                "youngs_modulus_gpa": self.of_part.youngs_modulus_gpa.map(with_deviation),
                "thickness_mm": self.of_part.thickness_mm.map(with_deviation),
                "bedding_n_per_mm3": match self.of_part.bedding {
                    Some(FittedBedding::Gives(found)) => with_deviation(found),
                    Some(FittedBedding::Firm) => json!("firm"),
                    None => Value::Null,
                },
            });
            return out::line(&summary.to_string());
        }
        for (k, row) in self.rows.iter().enumerate() {
            if let Some(why) = &row.why {
                out::line(&format!("press {} was left out: {why}", k + 1))?;
            }
        }
        out::line(&format!(
            "calibrated with {} presses: of a reading, {:.2} % is not known of the gauges, and {:.2} % is left by the model",
            self.calibration.touches,
            percent[0],
            100.0 * self.calibration.relative
        ))?;
        if worth > 0 {
            let after = percent[worth.min(percent.len() - 1)];
            let p = places[0];
            out::line(&format!(
                "{worth} presses more would leave {after:.2} % instead; the next one best at ({:.1}, {:.1}, {:.1}) mm",
                p.x, p.y, p.z
            ))?;
        }
        for (what, found, unit) in [
            ("Young's modulus", self.of_part.youngs_modulus_gpa, "GPa"),
            ("the wall's thickness", self.of_part.thickness_mm, "mm"),
            (
                "the supports' bedding",
                match self.of_part.bedding {
                    Some(FittedBedding::Gives(found)) => Some(found),
                    _ => None,
                },
                "N/mm³",
            ),
        ] {
            if let Some([value, deviation]) = found {
                let (value, deviation) = (digits(value), digits(deviation));
                out::line(&format!("{what}: {value} ± {deviation} {unit}"))?;
            }
        }
        if self.of_part.bedding == Some(FittedBedding::Firm) {
            out::line("the supports hold: that they give way is no likelier")?;
        }
        out::line(&format!("saved in {}", target.display()))
    }
}

fn with_deviation([value, deviation]: [f64; 2]) -> Value {
    json!({"value": value, "deviation": deviation})
}

fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// The presses with what each gauge read.
///
/// # Errors
/// When it cannot be written.
pub fn write_table(path: &Path, rows: &[PressRow]) -> anyhow::Result<()> {
    let gauges = (rows.iter())
        .find_map(|r| Some(r.known.as_ref()?.reading.len()))
        .unwrap_or(0);
    let head = ["x_mm", "y_mm", "z_mm", "force_n", "used", "misfit"].map(str::to_owned);
    let strains = (1..=gauges).map(|k| format!("gauge_{k}_microstrain"));
    let mut table = Writing::new(head.into_iter().chain(strains));
    for row in rows {
        let place = row.place.to_array().map(|v| format!("{v:.4}"));
        let misfit = row.misfit.map_or(String::new(), |m| format!("{m:.3}"));
        let about = [format!("{}", row.force), row.used.to_string(), misfit];
        let reading = (0..gauges).map(|k| {
            let strain = row.known.as_ref().map(|known| known.reading[k]);
            let strain = strain.filter(|s| s.is_finite());
            strain.map_or(String::new(), |s| format!("{:.4}", s * 1e6))
        });
        table.row(place.into_iter().chain(about).chain(reading));
    }
    Ok(atomic::write(path, table.text().as_bytes())?)
}

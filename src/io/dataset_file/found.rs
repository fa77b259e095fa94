//! What the files of a dataset hold, and what is checked of it.

use std::path::Path;

use glam::DVec3;

use super::plausible::{self, FileOrigin, FilePlaces};
use crate::dataset::SignalMatrix;
use crate::io::FileError;
use crate::io::table::NamedTable;
use crate::study::Data;

/// Numbers beyond this, and its inverse, have squares that are none, or nothing.
pub(super) const ABSURD: f64 = 1e100;

/// A dataset, and what was left out or assumed, for people.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenData {
    pub data: Data,
    pub notes: Vec<String>,
}

/// What was read, not yet checked.
pub(super) struct FoundDataset {
    /// By rows, one a site.
    pub(super) values: Vec<f64>,
    /// Of the touches (mm).
    pub(super) targets: Vec<[f64; 3]>,
    /// Of the sites (m); empty where nobody knows them.
    pub(super) positions: Vec<DVec3>,
    pub(super) costs: Vec<f64>,
    /// Of the touches (N); empty where nobody knows them.
    pub(super) forces: Vec<f64>,
    pub(super) touches: FileOrigin,
    pub(super) sites: FileOrigin,
    pub(super) notes: Vec<String>,
}

impl FoundDataset {
    /// Touches that something can be learned from.
    pub(super) fn check_apart(&self) -> Result<(), FileError> {
        let touches = self.targets.iter().map(|&p| DVec3::from_array(p));
        FilePlaces::new(&self.touches, touches).check_apart()
    }

    pub(super) fn checked(self, path: &Path) -> Result<GivenData, FileError> {
        self.check_signals(path)?;
        for (site, cost) in self.costs.iter().enumerate() {
            if !(cost.is_finite() && *cost > 0.0) {
                let what = format!("the cost of site {site} is {cost:e}: it must be above zero");
                return Err(FileError::broken(path, what));
            }
        }
        for (touch, force) in self.forces.iter().enumerate() {
            if !(force.is_finite() && *force > 0.0) {
                let what =
                    format!("the force of touch {touch} is {force:e} N: it must be above zero");
                return Err(FileError::broken(path, what));
            }
        }
        let touches = self.targets.iter().map(|&p| DVec3::from_array(p));
        let sites = self.positions.iter().map(|&p| p * 1e3);
        let mut notes = self.notes;
        notes.extend(plausible::check(
            &FilePlaces::new(&self.touches, touches),
            &FilePlaces::new(&self.sites, sites),
        )?);
        Ok(GivenData {
            data: Data {
                x: SignalMatrix::new(self.targets.len(), self.values),
                targets: self.targets,
                positions: self.positions,
                costs: self.costs,
                forces: self.forces,
            },
            notes,
        })
    }

    fn check_signals(&self, path: &Path) -> Result<(), FileError> {
        let touches = self.targets.len();
        let largest = self.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let wrong = |v: &f64| !v.is_finite() || v.abs() > ABSURD;
        if let Some(at) = self.values.iter().position(wrong) {
            let value = self.values[at];
            let what = if value.is_finite() {
                format!("is {value:e}, which nothing can be computed with: choose another unit")
            } else {
                "is no finite number: take one of them out".to_owned()
            };
            let (site, touch) = (at / touches, at % touches);
            let what = format!("the signal of site {site} under touch {touch} {what}");
            return Err(FileError::broken(path, what));
        }
        if largest > 0.0 && largest < 1.0 / ABSURD {
            let what = format!(
                "the largest signal is {largest:e}, which nothing can be computed with: choose another unit"
            );
            return Err(FileError::broken(path, what));
        }
        Ok(())
    }
}

pub(super) const PLACE: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// Where the touches were, and the file of each where the table names one.
pub(super) struct FoundTouches {
    pub(super) mm: Vec<[f64; 3]>,
    /// N; empty where the table has none.
    pub(super) forces: Vec<f64>,
    pub(super) origin: FileOrigin,
    pub(super) files: Option<Vec<String>>,
}

impl FoundTouches {
    pub(super) fn read(path: &Path) -> Result<Self, FileError> {
        let table = NamedTable::read(path)?;
        let columns = table.columns(&PLACE)?;
        let file = table.column("file")?;
        let force = table.column("force_n")?;
        let (mut mm, mut lines, mut files) = (Vec::new(), Vec::new(), Vec::new());
        let mut forces = Vec::new();
        for row in table.rows() {
            let row = row?;
            mm.push(row.numbers(&columns)?);
            lines.push(row.line());
            if let Some(column) = force {
                forces.push(row.number(column)?);
            }
            files.extend(file.map(|column| row.text(column).to_owned()));
        }
        if mm.is_empty() {
            return Err(table.wrong("there is no row below the first line: one is needed a touch"));
        }
        Ok(Self {
            mm,
            forces,
            origin: FileOrigin::lines(path, "touches", lines),
            files: file.map(|_| files),
        })
    }
}

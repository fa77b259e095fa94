//! What the units of a study found: which of them keep what is required, and whom no other beats.

use std::collections::BTreeMap;

use anyhow::bail;
use serde_json::Value;

use crate::budget::{Watch, report};
use crate::io::FileError;
use crate::io::study_folder::{StudyFolder, UnitOutcome, in_a_cell, plain};
use crate::parameter_study::{Points, front};
use crate::plain as words;

/// One unit with what came of it.
pub struct UnitRow {
    /// Of each axis.
    pub values: Vec<Value>,
    pub outcome: Option<UnitOutcome>,
    pub figures: BTreeMap<String, f64>,
    /// Whether it keeps all that is required.
    pub allowed: bool,
    /// Whether no other one beats it in all that is to be small.
    pub on_front: bool,
}

impl UnitRow {
    #[must_use]
    pub fn state(&self) -> &'static str {
        match &self.outcome {
            None => "missing",
            Some(outcome) if outcome.error.is_some() => "failed",
            Some(_) => "done",
        }
    }
}

/// All units of a study, in their order.
pub struct CollectedUnits {
    pub folder: StudyFolder,
    /// Names of the figures, in the order in which units have them.
    pub names: Vec<String>,
    pub rows: Vec<UnitRow>,
}

impl CollectedUnits {
    /// Of a folder, as far as it was computed. `watch` is told of every unit that is read, and may end it.
    ///
    /// # Errors
    /// A result that cannot be read, or an aim that no unit has; or that it was ended.
    pub fn of(folder: StudyFolder, watch: Watch) -> anyhow::Result<Self> {
        let points =
            Points::of(&folder.study).map_err(|why| FileError::broken(&folder.folder, why))?;
        let mut names: Vec<String> = Vec::new();
        let mut rows = Vec::with_capacity(folder.plan.units);
        for unit in 0..folder.plan.units {
            report(watch, "Reading results", unit, folder.plan.units)?;
            let outcome = folder.outcome(unit)?;
            let all = outcome.iter().flat_map(|o| &o.figures);
            for (name, _) in all.clone() {
                if !names.contains(name) {
                    names.push(name.clone());
                }
            }
            let figures = all.filter_map(|(name, value)| Some((name.clone(), (*value)?)));
            rows.push(UnitRow {
                values: points.values(unit).iter().map(plain).collect(),
                figures: figures.collect(),
                outcome,
                allowed: false,
                on_front: false,
            });
        }
        let mut collected = Self {
            folder,
            names,
            rows,
        };
        collected.judge()?;
        Ok(collected)
    }

    /// Who keeps what is required, and whom of these no other beats.
    fn judge(&mut self) -> anyhow::Result<()> {
        let aim = &self.folder.study.aim;
        let asked = aim
            .minimize
            .iter()
            .chain(aim.require.iter().map(|b| &b.figure));
        if let Some(unknown) = asked.clone().find(|f| !self.names.contains(f))
            && !self.names.is_empty()
        {
            bail!(
                "[aim] names the figure {}, which no unit has. There are {}",
                words::quote(unknown),
                self.names.join(", ")
            );
        }
        for row in &mut self.rows {
            let value = |name: &str| row.figures.get(name).copied();
            let keeps = aim
                .require
                .iter()
                .all(|bound| bound.holds(value(&bound.figure)));
            row.allowed = keeps && row.state() == "done";
        }
        if aim.minimize.is_empty() {
            return Ok(());
        }
        let numbers = |row: &UnitRow| -> Vec<f64> {
            let value = |name: &String| row.figures.get(name).copied();
            let all = aim.minimize.iter().map(value);
            all.map(|v| v.filter(|_| row.allowed).unwrap_or(f64::NAN))
                .collect()
        };
        let numbers: Vec<Vec<f64>> = self.rows.iter().map(numbers).collect();
        for (row, on_front) in self.rows.iter_mut().zip(front(&numbers)) {
            row.on_front = on_front;
        }
        Ok(())
    }

    /// Units that were computed, those that failed by themselves, and those that are missing.
    #[must_use]
    pub fn counts(&self) -> [usize; 3] {
        ["done", "failed", "missing"].map(|s| self.rows.iter().filter(|r| r.state() == s).count())
    }

    #[must_use]
    pub fn on_front(&self) -> Vec<usize> {
        let all = self.rows.iter().enumerate();
        all.filter(|(_, row)| row.on_front)
            .map(|(unit, _)| unit)
            .collect()
    }

    /// Of the axes.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.folder.study.axes.iter().map(|a| a.key.as_str())
    }

    /// The values of a unit's axes and what is to be small.
    #[must_use]
    pub fn in_words(&self, unit: usize) -> String {
        let row = &self.rows[unit];
        let axes = self.keys().zip(&row.values);
        let axes = axes.map(|(key, value)| format!("{key} = {}", in_a_cell(value)));
        let small = self.folder.study.aim.minimize.iter();
        let small = small.filter_map(|name| Some(format!("{name} {:.4}", row.figures.get(name)?)));
        axes.chain(small).collect::<Vec<_>>().join(", ")
    }
}

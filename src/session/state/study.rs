//! A parameter study that is open: what its units found, as columns, and the limb of the one that is looked at.

use std::sync::Arc;

use serde_json::Value;

use crate::io::study_folder::in_a_cell;
use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;
use crate::varied::{CollectedUnits, UnitBase};

/// What all units have: the value of an axis, or a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub name: String,
    /// One a unit; no number where it has none. Of words, their place among the words.
    pub values: Vec<f64>,
    /// Where its values are words.
    pub words: Vec<String>,
    /// The smallest and largest of its numbers, where it has any.
    pub range: Option<[f64; 2]>,
    pub is_axis: bool,
    /// Whether it is to be as small as can be, or is required.
    pub is_asked: bool,
}

impl Column {
    fn of_axis(name: &str, values: &[&Value]) -> Self {
        let mut words = Vec::new();
        let number = |value: &&Value| {
            value.as_f64().unwrap_or_else(|| {
                let word = in_a_cell(value);
                let known = words.iter().position(|w| *w == word);
                known.unwrap_or_else(|| {
                    words.push(word);
                    words.len() - 1
                }) as f64
            })
        };
        let values: Vec<f64> = values.iter().map(number).collect();
        Self {
            range: range(&values),
            values,
            name: name.to_owned(),
            words,
            is_axis: true,
            is_asked: false,
        }
    }

    /// A value as it is read.
    #[must_use]
    pub fn in_words(&self, unit: usize) -> String {
        let value = self.values[unit];
        let word = self.words.get(value as usize);
        match word {
            Some(word) if value >= 0.0 => word.clone(),
            _ if value.is_nan() => "–".into(),
            _ => crate::plain::digits(value),
        }
    }
}

fn range(values: &[f64]) -> Option<[f64; 2]> {
    let finite = values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    (low <= high).then_some([low, high])
}

/// A study whose results are looked at.
pub struct OpenStudy {
    pub collected: CollectedUnits,
    /// Axes first, then figures.
    pub columns: Vec<Column>,
    pub(in crate::session) base: UnitBase,
    /// Whether that is still what the study was planned from.
    pub(in crate::session) is_of_base: bool,
}

impl OpenStudy {
    pub(in crate::session) fn new(
        collected: CollectedUnits,
        base: UnitBase,
        is_of_base: bool,
    ) -> Self {
        let rows = &collected.rows;
        let axes = collected.keys().enumerate().map(|(k, key)| {
            let values: Vec<&Value> = rows.iter().map(|row| &row.values[k]).collect();
            Column::of_axis(key, &values)
        });
        let aim = &collected.folder.study.aim;
        let figures = collected.names.iter().map(|name| {
            let value = |row: &crate::varied::UnitRow| row.figures.get(name).copied();
            let values: Vec<f64> = rows
                .iter()
                .map(|row| value(row).unwrap_or(f64::NAN))
                .collect();
            Column {
                range: range(&values),
                values,
                is_asked: aim.minimize.contains(name)
                    || aim.require.iter().any(|bound| bound.figure == *name),
                name: name.clone(),
                words: Vec::new(),
                is_axis: false,
            }
        });
        Self {
            columns: axes.chain(figures).collect(),
            base,
            is_of_base,
            collected,
        }
    }

    /// The column of a name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c.name == name)
    }
}

/// The limb of a unit.
pub struct UnitLimb {
    pub unit: usize,
    pub mesh: Arc<TriMesh>,
    pub stance: Stance,
}

/// The study that is open beside the project: it stays when another project is opened.
#[derive(Default)]
pub struct Study {
    pub(in crate::session) open: Option<Arc<OpenStudy>>,
    pub(in crate::session) limb: Option<Arc<UnitLimb>>,
}

impl Study {
    #[must_use]
    pub fn open(&self) -> Option<&Arc<OpenStudy>> {
        self.open.as_ref()
    }

    /// The limb that was last looked at.
    #[must_use]
    pub fn limb(&self) -> Option<&Arc<UnitLimb>> {
        self.limb.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_numbered_and_read_again() {
        let values = [Value::from("abs"), Value::from("pla"), Value::from("abs")];
        let column = Column::of_axis("material", &values.iter().collect::<Vec<_>>());
        assert_eq!(column.values, [0.0, 1.0, 0.0]);
        assert_eq!(column.in_words(1), "pla");
        assert_eq!(column.range, Some([0.0, 1.0]));
        let numbers = [Value::from(1.5), Value::from(3)];
        let column = Column::of_axis("wall", &numbers.iter().collect::<Vec<_>>());
        assert_eq!(
            (column.values.clone(), column.words.len()),
            (vec![1.5, 3.0], 0)
        );
        assert_eq!(column.in_words(0), "1.5");
    }
}

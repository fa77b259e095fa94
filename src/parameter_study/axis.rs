//! One axis of a study: a key, and the values that it takes.

use serde::Deserialize;
use toml::Value;

use crate::project::{Key, ValueRange, all_keys};

/// The most values of one axis.
const MOST_VALUES: usize = 100_000;

/// A key with its values: a list of them, or so many evenly from one number to another.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyAxis {
    /// A key of the project (`touch.force_n`), an option of `hapdef limb` (`limb.thickness`), or `mesh`.
    pub key: String,
    values: Option<Vec<Value>>,
    from: Option<f64>,
    to: Option<f64>,
    count: Option<usize>,
}

/// What an axis changes.
#[derive(Clone, Copy, Debug)]
pub enum Subject<'a> {
    /// The mesh file.
    Mesh,
    /// An option of `hapdef limb`, by its name without the dashes.
    Limb(&'a str),
    /// A key of the project.
    Project(&'static Key),
}

impl StudyAxis {
    /// That it says its values in one way.
    ///
    /// # Errors
    /// A message with its key.
    pub(super) fn check(&self) -> Result<(), String> {
        let key = &self.key;
        let span = [self.from, self.to];
        match &self.values {
            Some(values) if span == [None; 2] && self.count.is_none() => {
                if values.is_empty() || values.len() > MOST_VALUES {
                    return Err(format!(
                        "the axis {key} has no values, or more than {MOST_VALUES}"
                    ));
                }
            }
            None if span.iter().all(|s| s.is_some_and(f64::is_finite)) => {
                if self.count.is_some_and(|n| !(1..=MOST_VALUES).contains(&n)) {
                    return Err(format!(
                        "the axis {key} has 1 to {MOST_VALUES} values (count)"
                    ));
                }
            }
            _ => {
                return Err(format!(
                    "the axis {key} takes values = […], or from, to and count"
                ));
            }
        }
        self.subject().map(drop)
    }

    /// What it changes.
    ///
    /// # Errors
    /// When there is no such key.
    pub fn subject(&self) -> Result<Subject<'_>, String> {
        let key = self.key.as_str();
        if key == "mesh" || key == "part.mesh" {
            return Ok(Subject::Mesh);
        }
        if let Some(option) = key.strip_prefix("limb.") {
            return Ok(Subject::Limb(option));
        }
        match all_keys().into_iter().find(|known| known.path == key) {
            Some(key) => Ok(Subject::Project(key)),
            None => Err(format!(
                "the axis {key} is no key of a project (`hapdef keys` lists them), no option of `hapdef limb` (limb.NAME) and not mesh"
            )),
        }
    }

    /// Those of its listed values that are words.
    pub fn named(&self) -> impl Iterator<Item = &str> {
        self.values.iter().flatten().filter_map(Value::as_str)
    }

    /// Its values one after another; nothing where it has a span without a count, which only a sequence can fill.
    pub(super) fn listed(&self) -> Option<Vec<Value>> {
        if let Some(values) = &self.values {
            return Some(values.clone());
        }
        let count = self.count?;
        let at = |k: usize| match count {
            1 => 0.0,
            _ => k as f64 / (count - 1) as f64,
        };
        Some((0..count).map(|k| self.between(at(k))).collect())
    }

    /// The value at a share of the whole axis, from 0 to 1.
    pub(super) fn at(&self, share: f64) -> Value {
        match &self.values {
            Some(values) => {
                let k = (share * values.len() as f64) as usize;
                values[k.min(values.len() - 1)].clone()
            }
            None => self.between(share),
        }
    }

    /// The number at a share of the span: a whole one where the key takes no other.
    fn between(&self, share: f64) -> Value {
        let (from, to) = (self.from.unwrap_or(0.0), self.to.unwrap_or(0.0));
        // Both ends exactly.
        let number = from * (1.0 - share) + to * share;
        let whole = match self.subject() {
            Ok(Subject::Project(key)) => matches!(key.range, ValueRange::Whole(..)),
            Ok(Subject::Limb(option)) => ["columns", "hoops"].contains(&option),
            _ => false,
        };
        if whole {
            Value::Integer(number.round() as i64)
        } else {
            Value::Float(number)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str) -> StudyAxis {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn spans_keep_both_ends_and_whole_keys_whole_numbers() {
        let span = axis("key = \"part.thickness_mm\"\nfrom = 1.1\nto = 2.3\ncount = 4\n");
        let numbers: Vec<f64> = span
            .listed()
            .unwrap()
            .iter()
            .filter_map(Value::as_float)
            .collect();
        assert_eq!((numbers[0], numbers[3]), (1.1, 2.3));
        assert!((numbers[1] - 1.5).abs() < 1e-12);
        let whole = axis("key = \"selection.sensors\"\nfrom = 4\nto = 10\ncount = 4\n");
        let numbers: Vec<i64> = whole
            .listed()
            .unwrap()
            .iter()
            .filter_map(Value::as_integer)
            .collect();
        assert_eq!(numbers, [4, 6, 8, 10]);
        assert!(whole.check().is_ok());
    }

    #[test]
    fn what_is_no_key_is_refused_by_name() {
        let said = axis("key = \"part.colour\"\nvalues = [1]\n")
            .check()
            .unwrap_err();
        assert!(
            said.contains("part.colour") && said.contains("hapdef keys"),
            "{said}"
        );
        let said = axis("key = \"mesh\"\nvalues = []\n").check().unwrap_err();
        assert!(said.contains("no values"), "{said}");
        let said = axis("key = \"touch.force_n\"\nvalues = [1]\ncount = 3\n")
            .check()
            .unwrap_err();
        assert!(said.contains("from, to and count"), "{said}");
    }
}

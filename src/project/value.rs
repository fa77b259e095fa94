//! Values of a project: how they are written, what they may be, and why one cannot be used.

use std::borrow::Cow;

use serde::Serialize;

use super::key::{Key, ValueRange, number};

/// A value that cannot be used, by the key it stands under.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} must be {rule}, but is {value}")]
pub struct BadValue {
    /// Path of the key, such as `touch.force_n`.
    pub key: String,
    /// What it must be.
    pub rule: Cow<'static, str>,
    /// What it is.
    pub value: String,
}

/// What can stand under a key.
pub trait Value {
    /// As the file holds it; nothing where the key is left out.
    fn written(&self) -> Option<toml::Value>;

    /// Whether the key may have it.
    ///
    /// # Errors
    /// [`BadValue`] where it may not.
    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        let _ = key;
        Ok(())
    }
}

/// Whether a value is the usual one, and need not be written.
pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// A value by the way it is serialized.
pub(super) fn serialized(value: &impl Serialize) -> Option<toml::Value> {
    toml::Value::try_from(value).ok()
}

/// Values that may be any of their type: the reader of the file has refused all others.
macro_rules! any {
    ($($type:ty),* $(,)?) => { $(
        impl $crate::project::value::Value for $type {
            fn written(&self) -> Option<toml::Value> {
                $crate::project::value::serialized(self)
            }
        }
    )* };
}
pub(super) use any;

any!(bool, String);

impl Value for f64 {
    fn written(&self) -> Option<toml::Value> {
        serialized(self)
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        numbers(key, "", &[*self])
    }
}

macro_rules! whole {
    ($($type:ty: $wide:expr),*) => { $(
        impl Value for $type {
            fn written(&self) -> Option<toml::Value> {
                serialized(self)
            }

            fn obeys(&self, key: &Key) -> Result<(), BadValue> {
                counts(key, "", &[$wide(*self)])
            }
        }
    )* };
}
whole!(u8: u64::from, usize: wide, u64: std::convert::identity);

fn wide(count: usize) -> u64 {
    count as u64
}

impl<T: Value> Value for Option<T> {
    fn written(&self) -> Option<toml::Value> {
        self.as_ref().and_then(Value::written)
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        self.as_ref().map_or(Ok(()), |value| value.obeys(key))
    }
}

impl<const N: usize> Value for [f64; N] {
    fn written(&self) -> Option<toml::Value> {
        // Arrays of ten are more than serde knows to serialize.
        serialized(&self.as_slice())
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        numbers(key, "made of numbers ", self)
    }
}

impl<const N: usize, const M: usize> Value for [[f64; N]; M] {
    fn written(&self) -> Option<toml::Value> {
        rows(self)
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        self.iter().try_for_each(|row| row.obeys(key))
    }
}

impl Value for Vec<f64> {
    fn written(&self) -> Option<toml::Value> {
        serialized(self)
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        numbers(key, "made of numbers ", self)
    }
}

impl<const N: usize> Value for Vec<[f64; N]> {
    fn written(&self) -> Option<toml::Value> {
        (!self.is_empty()).then(|| rows(self)).flatten()
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        self.iter().try_for_each(|row| row.obeys(key))
    }
}

impl Value for Vec<usize> {
    fn written(&self) -> Option<toml::Value> {
        (!self.is_empty()).then(|| serialized(self)).flatten()
    }

    fn obeys(&self, key: &Key) -> Result<(), BadValue> {
        let counted: Vec<u64> = self.iter().map(|&count| count as u64).collect();
        counts(key, "made of whole numbers ", &counted)
    }
}

fn rows<const N: usize>(all: &[[f64; N]]) -> Option<toml::Value> {
    let rows: Option<Vec<_>> = all.iter().map(Value::written).collect();
    rows.map(toml::Value::Array)
}

/// Holds numbers against the range of their key.
fn numbers(key: &Key, kind: &str, values: &[f64]) -> Result<(), BadValue> {
    let ValueRange::Numbers(span) = key.range else {
        return Ok(());
    };
    let outside = values.iter().find(|&&value| !span.contains(value));
    outside.map_or(Ok(()), |&value| {
        Err(BadValue {
            key: key.path.to_owned(),
            rule: format!("{kind}{span}").into(),
            value: number(value),
        })
    })
}

/// Holds whole numbers against the range of their key.
fn counts(key: &Key, kind: &str, values: &[u64]) -> Result<(), BadValue> {
    let ValueRange::Whole(least, most) = key.range else {
        return Ok(());
    };
    let outside = values.iter().find(|count| !(least..=most).contains(count));
    outside.map_or(Ok(()), |count| {
        Err(BadValue {
            key: key.path.to_owned(),
            rule: format!("{kind}between {least} and {most}").into(),
            value: count.to_string(),
        })
    })
}

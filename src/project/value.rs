//! Values of a project that are checked, and why one cannot be used.

use std::borrow::Cow;
use std::ops::RangeInclusive;

pub(super) const MM: f64 = 1e-3;

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

pub(super) fn all_bounded<const N: usize>(
    all: [(&str, f64, RangeInclusive<f64>); N],
) -> Result<(), BadValue> {
    all.into_iter()
        .try_for_each(|(key, value, range)| bounded(key, value, &range))
}

pub(super) fn bounded(key: &str, value: f64, range: &RangeInclusive<f64>) -> Result<(), BadValue> {
    // No number at all is in no range.
    if range.contains(&value) {
        return Ok(());
    }
    Err(BadValue {
        key: key.to_owned(),
        rule: format!(
            "between {} and {}",
            number(*range.start()),
            number(*range.end())
        )
        .into(),
        value: number(value),
    })
}

pub(super) fn counted(
    key: &str,
    count: usize,
    range: &RangeInclusive<usize>,
) -> Result<(), BadValue> {
    if range.contains(&count) {
        return Ok(());
    }
    Err(BadValue {
        key: key.to_owned(),
        rule: format!("between {} and {}", range.start(), range.end()).into(),
        value: count.to_string(),
    })
}

/// A finite number that obeys a rule of its own.
pub(super) fn check(key: &str, rule: &'static str, value: f64, ok: bool) -> Result<(), BadValue> {
    if ok && value.is_finite() {
        return Ok(());
    }
    Err(BadValue {
        key: key.to_owned(),
        rule: rule.into(),
        value: number(value),
    })
}

/// A number as people write it: nobody reads three hundred digits.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() || (1e-4..1e7).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

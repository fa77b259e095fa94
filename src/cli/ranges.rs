//! Numbers that a flag takes, checked as it is read, and combinations of flags that make no sense.

use clap::builder::RangedU64ValueParser;
use clap::error::ErrorKind;

/// A parser of numbers from `least` to `most`.
pub fn between(
    least: f64,
    most: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text: &str| match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!(
            "a number from {} to {} is needed",
            plain(least),
            plain(most)
        )),
    }
}

/// A bound in a few characters.
fn plain(bound: f64) -> String {
    if bound.abs() >= 1e7 {
        format!("{bound:e}")
    } else {
        bound.to_string()
    }
}

/// A parser of whole numbers from `least` to `most`.
#[must_use]
pub fn whole(least: u64, most: u64) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(least..=most)
}

/// Flags that do not go together: `main` ends with exit code 2 on it, as on flags out of range.
#[must_use]
pub fn misuse(message: &str) -> anyhow::Error {
    let error: clap::Error = clap::Error::raw(ErrorKind::ArgumentConflict, format!("{message}\n"));
    error.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_short_whatever_they_are() {
        let said = between(0.0, 1e100)("nan").unwrap_err();
        assert_eq!(said, "a number from 0 to 1e100 is needed");
    }
}

//! The key that says which way a part stands.

use std::fmt;

use glam::DVec3;
use serde::de::{Error, IgnoredAny, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::key::{Key as ProjectKey, number};
use super::value::{BadValue, Value, serialized};
use crate::mesh::TriMesh;
use crate::mesh::stance::Stance;
use crate::mesh::unroll::Axis;

/// The axis that a part stands along: views, unrolling and new boxes follow it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PartAxis {
    /// As the part's shape says.
    #[default]
    Auto,
    /// An axis of the file.
    Coordinate(Axis),
    /// A direction of any length.
    Along([f64; 3]),
}

impl PartAxis {
    /// How a part stands by this key.
    #[must_use]
    pub fn stance(self, part: &TriMesh) -> Stance {
        match self {
            Self::Auto => Stance::of(part),
            Self::Coordinate(axis) => Stance::about(axis.direction()),
            Self::Along(direction) => Stance::about(DVec3::from_array(direction)),
        }
    }
}

impl Value for PartAxis {
    fn written(&self) -> Option<toml::Value> {
        serialized(self)
    }

    fn obeys(&self, key: &ProjectKey) -> Result<(), BadValue> {
        match self {
            Self::Along(direction) => is_direction(key.path, direction),
            Self::Auto | Self::Coordinate(_) => Ok(()),
        }
    }
}

/// Holds that three numbers are a direction.
pub(super) fn is_direction(path: &str, direction: &[f64; 3]) -> Result<(), BadValue> {
    /// Below this a direction is nobody's, and above it no place.
    const SIZES: std::ops::RangeInclusive<f64> = 1e-6..=1e9;
    let size = direction.iter().fold(0.0, |most: f64, x| {
        // What is no number is larger than any.
        if x.abs() <= most { most } else { x.abs() }
    });
    if SIZES.contains(&size) && direction.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(BadValue {
        key: path.to_owned(),
        rule: "a direction, whose numbers are not all 0 and none of them beyond 1e9".into(),
        value: format!("[{}]", direction.map(number).join(", ")),
    })
}

const AUTO: &str = "auto";

impl Serialize for PartAxis {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str(AUTO),
            Self::Coordinate(axis) => axis.serialize(serializer),
            Self::Along(direction) => direction.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for PartAxis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AxisKey)
    }
}

/// Reads a word or three numbers.
struct AxisKey;

impl<'de> Visitor<'de> for AxisKey {
    type Value = PartAxis;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("\"auto\", \"x\", \"y\", \"z\" or a direction [x, y, z]")
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<PartAxis, E> {
        Ok(PartAxis::Coordinate(match word {
            AUTO => return Ok(PartAxis::Auto),
            "x" => Axis::X,
            "y" => Axis::Y,
            "z" => Axis::Z,
            _ => return Err(E::invalid_value(Unexpected::Str(word), &self)),
        }))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<PartAxis, A::Error> {
        let mut direction = [0.0; 3];
        for (k, number) in direction.iter_mut().enumerate() {
            *number =
                (numbers.next_element()?).ok_or_else(|| A::Error::invalid_length(k, &self))?;
        }
        if numbers.next_element::<IgnoredAny>()?.is_some() {
            return Err(A::Error::invalid_length(4, &self));
        }
        Ok(PartAxis::Along(direction))
    }
}

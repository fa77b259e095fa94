//! The points of a study: one for each unit, counted from 0.

use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use toml::Value;

use super::file::{Combine, ParameterStudy};
use super::sobol::{MOST_DIMENSIONS, Sobol};

/// The most units of a study.
pub const MOST_UNITS: usize = 1_000_000;

/// The values of all axes for every unit.
pub struct Points<'a> {
    study: &'a ParameterStudy,
    /// Of each axis, where it can be listed.
    listed: Vec<Vec<Value>>,
    count: usize,
    /// Of a Latin hypercube: the part that each unit takes of each axis.
    parts: Vec<Vec<usize>>,
    sobol: Option<Sobol>,
}

impl<'a> Points<'a> {
    /// The points of a study.
    ///
    /// # Errors
    /// A message where the axes cannot be combined in that way.
    pub fn of(study: &'a ParameterStudy) -> Result<Self, String> {
        let mut points = Self {
            study,
            listed: Vec::new(),
            count: 0,
            parts: Vec::new(),
            sobol: None,
        };
        match study.combine {
            Combine::Grid | Combine::List => points.list()?,
            Combine::Sobol | Combine::LatinHypercube => points.draw()?,
        }
        if points.count > MOST_UNITS {
            return Err(format!(
                "the study has {} units, and a study at most {MOST_UNITS}",
                points.count
            ));
        }
        Ok(points)
    }

    fn list(&mut self) -> Result<(), String> {
        if self.study.count.is_some() {
            return Err("count is of the sequences (combine = \"sobol\" or \"latin-hypercube\"): an axis has a count of its own".into());
        }
        for axis in &self.study.axes {
            let listed = axis.listed();
            let listed = listed.ok_or(format!("the axis {} needs a count", axis.key))?;
            self.listed.push(listed);
        }
        let lengths = self.listed.iter().map(Vec::len);
        self.count = if self.study.combine == Combine::Grid {
            lengths.fold(1, usize::saturating_mul)
        } else {
            let all: Vec<usize> = lengths.collect();
            let first = all.first().copied().unwrap_or(1);
            if all.iter().any(|&n| n != first) {
                return Err(
                    "the axes of a list (combine = \"list\") have as many values as each other"
                        .into(),
                );
            }
            first
        };
        Ok(())
    }

    fn draw(&mut self) -> Result<(), String> {
        let (study, axes) = (self.study, self.study.axes.len());
        let count = study.count.filter(|n| (1..=MOST_UNITS).contains(n));
        self.count = count.ok_or(format!("a sequence needs count, from 1 to {MOST_UNITS}"))?;
        if study.combine == Combine::Sobol {
            if axes > MOST_DIMENSIONS {
                return Err(format!(
                    "a Sobol sequence has at most {MOST_DIMENSIONS} axes here: combine = \"latin-hypercube\" takes more"
                ));
            }
            self.sobol = Some(Sobol::shifted(axes, study.seed));
            return Ok(());
        }
        let mut rng = ChaCha8Rng::seed_from_u64(study.seed);
        for _ in 0..axes {
            let mut parts: Vec<usize> = (0..self.count).collect();
            parts.shuffle(&mut rng);
            self.parts.push(parts);
        }
        Ok(())
    }

    /// How many units there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The value of each axis for a unit, in the order of the axes.
    #[must_use]
    pub fn values(&self, unit: usize) -> Vec<Value> {
        let axes = &self.study.axes;
        match self.study.combine {
            Combine::Grid => {
                let mut left = unit;
                let mut values: Vec<Value> = (self.listed.iter().rev())
                    .map(|listed| {
                        let value = listed[left % listed.len()].clone();
                        left /= listed.len();
                        value
                    })
                    .collect();
                values.reverse();
                values
            }
            Combine::List => self.listed.iter().map(|l| l[unit].clone()).collect(),
            Combine::Sobol => {
                let point = self.sobol.as_ref().map(|s| s.point(unit as u32));
                let shares = point.unwrap_or_default();
                axes.iter()
                    .zip(shares)
                    .map(|(axis, s)| axis.at(s))
                    .collect()
            }
            Combine::LatinHypercube => {
                // Every unit draws for itself, so that it needs no other.
                let mut rng = ChaCha8Rng::seed_from_u64(self.study.seed);
                rng.set_stream(1 + unit as u64);
                let share = |parts: &Vec<usize>, within: f64| {
                    (parts[unit] as f64 + within) / self.count as f64
                };
                (axes.iter().zip(&self.parts))
                    .map(|(axis, parts)| axis.at(share(parts, rng.random())))
                    .collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(head: &str) -> ParameterStudy {
        let axes = "[[axis]]\nkey = \"selection.sensors\"\nvalues = [5, 8]\n[[axis]]\nkey = \"part.thickness_mm\"\nfrom = 1.0\nto = 2.0\n";
        let count = if head.is_empty() { "count = 3\n" } else { "" };
        let text = format!("format = 1\n{head}[base]\nlimb = true\n{axes}{count}");
        ParameterStudy::of_text(&text).unwrap()
    }

    fn numbers(study: &ParameterStudy) -> Vec<(i64, f64)> {
        let points = Points::of(study).unwrap();
        let both = |v: Vec<Value>| Some((v[0].as_integer()?, v[1].as_float()?));
        (0..points.count())
            .filter_map(|k| both(points.values(k)))
            .collect()
    }

    #[test]
    fn the_last_axis_of_a_grid_is_the_fastest() {
        let grid = numbers(&study(""));
        assert_eq!(
            grid,
            [(5, 1.0), (5, 1.5), (5, 2.0), (8, 1.0), (8, 1.5), (8, 2.0)]
        );
    }

    #[test]
    fn sequences_fill_every_axis_and_follow_the_seed() {
        for kind in ["sobol", "latin-hypercube"] {
            let head = |seed: u64| format!("combine = \"{kind}\"\ncount = 64\nseed = {seed}\n");
            let first = numbers(&study(&head(1)));
            assert_eq!(first, numbers(&study(&head(1))));
            assert_ne!(first, numbers(&study(&head(2))), "{kind}");
            assert_eq!(first.len(), 64);
            // Each of sixteen parts of the span as often as the others, and each value in half of the units.
            for part in 0..16 {
                let inside = |x: f64| ((x - 1.0) * 16.0).floor() as i64 == part;
                let count = first.iter().filter(|p| inside(p.1)).count();
                assert_eq!(count, 4, "{kind}: part {part}");
            }
            assert_eq!(first.iter().filter(|p| p.0 == 5).count(), 32, "{kind}");
        }
    }

    #[test]
    fn lists_go_along_together() {
        let text = |values: &str| {
            format!(
                "format = 1\ncombine = \"list\"\n[base]\nlimb = true\n[[axis]]\nkey = \"selection.sensors\"\nvalues = [5, 8]\n[[axis]]\nkey = \"part.thickness_mm\"\nvalues = {values}\n"
            )
        };
        let list = ParameterStudy::of_text(&text("[1.5, 2.0]")).unwrap();
        assert_eq!(numbers(&list), [(5, 1.5), (8, 2.0)]);
        let list = ParameterStudy::of_text(&text("[1.5]")).unwrap();
        let said = Points::of(&list).err().unwrap();
        assert!(said.contains("as many values"), "{said}");
    }
}

//! What is wanted of a study's designs, and which of them no other beats.

use serde::Deserialize;

/// What is wanted.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aim {
    /// Figures that are to be as small as can be.
    #[serde(default)]
    pub minimize: Vec<String>,
    /// What a design has to keep.
    #[serde(default)]
    pub require: Vec<Bound>,
}

/// A bound on a figure.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bound {
    /// Its name.
    pub figure: String,
    /// Not above this.
    pub at_most: Option<f64>,
    /// Not below this.
    pub at_least: Option<f64>,
}

impl Bound {
    /// Whether a value keeps it; one that is missing does not.
    #[must_use]
    pub fn holds(&self, value: Option<f64>) -> bool {
        value.is_some_and(|v| {
            self.at_most.is_none_or(|most| v <= most)
                && self.at_least.is_none_or(|least| v >= least)
        })
    }
}

/// Which of some rows of figures no other row beats: none is as small in all of them and smaller in one. Rows with a
/// figure that is no number are beaten; of equal rows all stay.
#[must_use]
pub fn front(rows: &[Vec<f64>]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..rows.len())
        .filter(|&k| rows[k].iter().all(|v| v.is_finite()))
        .collect();
    let lexically = |a: &usize, b: &usize| {
        let pairs = rows[*a].iter().zip(&rows[*b]);
        pairs
            .map(|(x, y)| x.total_cmp(y))
            .find(|o| o.is_ne())
            .unwrap_or(a.cmp(b))
    };
    order.sort_by(lexically);
    let mut kept: Vec<usize> = Vec::new();
    let beats = |a: usize, b: usize| {
        let pairs = || rows[a].iter().zip(&rows[b]);
        pairs().all(|(x, y)| x <= y) && pairs().any(|(x, y)| x < y)
    };
    for k in order {
        // Whoever beats it comes before it.
        if !kept.iter().any(|&other| beats(other, k)) {
            kept.push(k);
        }
    }
    let mut on_front = vec![false; rows.len()];
    for k in kept {
        on_front[k] = true;
    }
    on_front
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_on_the_front_is_beaten() {
        let rows = [
            [1.0, 9.0],
            [2.0, 3.0],
            [2.0, 4.0],
            [5.0, 1.0],
            [6.0, 1.0],
            [2.0, 3.0],
            [0.5, f64::NAN],
        ];
        let rows: Vec<Vec<f64>> = rows.iter().map(|r| r.to_vec()).collect();
        assert_eq!(front(&rows), [true, true, false, true, false, true, false]);
    }

    #[test]
    fn a_bound_is_kept_by_what_is_there() {
        let bound = Bound {
            figure: "mass_g".into(),
            at_most: Some(2.0),
            at_least: Some(1.0),
        };
        assert!(bound.holds(Some(1.5)) && bound.holds(Some(2.0)));
        assert!(!bound.holds(Some(2.1)) && !bound.holds(Some(0.9)) && !bound.holds(None));
    }
}

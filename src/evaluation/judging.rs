//! What sets of gauges are judged by, and under which touches.

use serde::{Deserialize, Serialize};

/// What turns readings into places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorKind {
    /// The elastic model matched to each reading, as live touch does.
    #[default]
    Matching,
    /// A support vector regression trained for each set, as in the paper.
    Svr,
}

impl EstimatorKind {
    /// All, the default first.
    pub const ALL: [Self; 2] = [Self::Matching, Self::Svr];

    /// As in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Svr => "svr",
            Self::Matching => "matching",
        }
    }

    /// As read by people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Svr => "Support vector regression",
            Self::Matching => "Model matching",
        }
    }
}

/// How sets are judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Judging {
    /// By regression, under touches as hard as those that it learned from.
    #[default]
    Svr,
    /// By matching, under touches of these forces.
    Matching(JudgingForces),
}

/// How hard touches come that sets are judged by.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgingForces {
    /// N, rising; at least one.
    pub judged_n: Vec<f64>,
    /// The hardest press that the estimator thinks possible (N).
    pub most_n: f64,
}

impl JudgingForces {
    /// Which of them sets are compared at: the middle one, of two in the middle the harder.
    #[must_use]
    pub fn middle(&self) -> usize {
        self.judged_n.len() / 2
    }
}

impl Judging {
    /// Which estimator it is.
    #[must_use]
    pub fn estimator(&self) -> EstimatorKind {
        match self {
            Self::Svr => EstimatorKind::Svr,
            Self::Matching(_) => EstimatorKind::Matching,
        }
    }

    /// The same under touches of no other force than the one that sets are compared at.
    #[must_use]
    pub fn at_middle(&self) -> Self {
        match self {
            Self::Svr => Self::Svr,
            Self::Matching(forces) => Self::Matching(JudgingForces {
                judged_n: self.middle_n().into_iter().collect(),
                ..forces.clone()
            }),
        }
    }

    /// The force (N) that sets are compared at, where it is not that of the touches which were learned from.
    #[must_use]
    pub fn middle_n(&self) -> Option<f64> {
        match self {
            Self::Svr => None,
            Self::Matching(forces) => forces.judged_n.get(forces.middle()).copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_compared_at_the_force_in_the_middle() {
        let middle = |judged_n: &[f64]| {
            let forces = JudgingForces {
                judged_n: judged_n.to_vec(),
                most_n: 60.0,
            };
            Judging::Matching(forces).middle_n()
        };
        assert_eq!(middle(&[7.0]), Some(7.0));
        assert_eq!(middle(&[3.0, 10.0]), Some(10.0));
        assert_eq!(middle(&[3.0, 10.0, 25.0]), Some(10.0));
        assert_eq!(Judging::Svr.middle_n(), None);
        let forces = |judged_n: &[f64]| {
            Judging::Matching(JudgingForces {
                judged_n: judged_n.to_vec(),
                most_n: 60.0,
            })
        };
        assert_eq!(forces(&[3.0, 10.0, 25.0]).at_middle(), forces(&[10.0]));
        assert_eq!(Judging::Svr.at_middle(), Judging::Svr);
    }
}

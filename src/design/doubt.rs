//! Numbers of a design that cannot be trusted: what they are, what they may be, and what to do.

use serde::Serialize;

use super::{Checks, Design, Simulated};

/// A number beyond its limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Doubt {
    /// What is beyond its limit, for people.
    pub number: &'static str,
    /// What it is.
    pub value: f64,
    /// What it may be.
    pub limit: f64,
    /// What it means and what to do, in plain words.
    pub words: String,
}

/// Out of balance by more than this share of the load, or worse conditioned, fewer than about five digits of a
/// displacement can be right.
const RESIDUAL: f64 = 1e-5;
const CONDITION: f64 = 1e11;
/// Estimated error of displacements (%) from which the elements decide the answer, not the part.
const MESH_PERCENT: f64 = 15.0;
/// Share by which a better choice of a step may exist unseen.
const GAP: f64 = 0.05;
/// Share of the covariance's spectrum that was negative.
const CLIPPED: f64 = 0.01;

impl Checks {
    /// What makes the solution untrustworthy.
    #[must_use]
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = Vec::new();
        // Not `max`, which leaves out what is no number.
        let (a, b) = (self.reaction_error, self.energy_error);
        let residual = if a.is_nan() || a > b { a } else { b };
        if residual.is_nan() || residual > RESIDUAL {
            doubts.push(Doubt {
                number: "residual",
                value: residual,
                limit: RESIDUAL,
                words: format!(
                    "The solution is out of balance by {residual:.0e} of the load: do not trust it. Check thickness, unit and supports."
                ),
            });
        }
        let condition = self.smallest_pivot.recip();
        if condition.is_nan() || condition > CONDITION {
            doubts.push(Doubt {
                number: "condition",
                value: condition,
                limit: CONDITION,
                words: format!(
                    "The model is nearly singular (condition at least {condition:.0e}): the shell is very thin for its elements or barely held. Hold more of it, or check thickness and unit."
                ),
            });
        }
        doubts
    }
}

impl Simulated {
    /// What makes the signals untrustworthy.
    #[must_use]
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = self.checks.doubts();
        let percent = self.discretization.displacement_percent;
        if percent > MESH_PERCENT {
            doubts.push(Doubt {
                number: "mesh error",
                value: percent,
                limit: MESH_PERCENT,
                words: format!(
                    "The mesh leaves about {percent:.0} % error in displacement: the signals are those of the elements as much as of the part. Choose a higher quality, or allow more vertices."
                ),
            });
        }
        if let Some(linearity) = self.linearity.filter(|l| l.beyond > 0) {
            doubts.push(Doubt {
                number: "linearity",
                value: linearity.beyond as f64,
                limit: 0.0,
                words: format!(
                    "At {:.1} N the shell may snap or fold under {} of {} sampled touches: the linear answer says nothing there. Lower the force.",
                    linearity.force_n, linearity.beyond, linearity.loads
                ),
            });
        }
        doubts
    }
}

impl Design {
    /// What makes its numbers untrustworthy, from the simulation to the errors; none for a sound design.
    #[must_use]
    pub fn doubts(&self) -> Vec<Doubt> {
        let mut doubts = self.simulated.doubts();
        doubts.extend(self.doubts_of_choice());
        let rows = &self.evaluation.rows;
        let short = (rows.iter()).filter(|r| r.converged == Some(false)).count();
        if short > 0 {
            doubts.push(Doubt {
                number: "regressions short of their tolerance",
                value: short as f64,
                limit: 0.0,
                words: format!(
                    "{short} of {} regressions stopped at the effort allowed before they met their tolerance: their errors may be too large. Lower selection.c_mm, or choose a higher quality.",
                    rows.len()
                ),
            });
        }
        doubts
    }

    fn doubts_of_choice(&self) -> Vec<Doubt> {
        let mut doubts = Vec::new();
        let sets = self.selections.iter().flat_map(|s| &s.sets);
        let gap = sets.filter_map(|s| s.gap).fold(0.0, f64::max);
        if gap > GAP {
            doubts.push(Doubt {
                number: "gap",
                value: gap,
                limit: GAP,
                words: format!(
                    "Greedy SVR may have passed over a choice that is better by {:.0} %: its screens departed far from exact fits. Let it score more touches (budget.limits.selection_touches).",
                    100.0 * gap
                ),
            });
        }
        let clipped = self.reduced.geometry().map(|g| g.covariance.clipped);
        if let Some(clipped) = clipped.filter(|c| c.is_nan() || *c > CLIPPED) {
            doubts.push(Doubt {
                number: "clipped mass",
                value: clipped,
                limit: CLIPPED,
                words: format!(
                    "{:.1} % of the Gaussian process's spectrum was negative and was clipped: entropy and mutual information chose by another kernel than was asked for. Shorten selection.gaussian_process.length_mm, or go by another selector.",
                    100.0 * clipped
                ),
            });
        }
        doubts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_its_limit_is_named_with_what_to_do() {
        let sound = Checks {
            reaction_error: 1e-9,
            energy_error: 1e-10,
            smallest_pivot: 1e-6,
            pieces_held: 1,
        };
        assert_eq!(sound.doubts(), []);
        let names =
            |checks: Checks| -> Vec<&str> { checks.doubts().iter().map(|d| d.number).collect() };
        let out = Checks {
            energy_error: 1e-3,
            ..sound
        };
        assert_eq!(names(out), ["residual"]);
        assert_eq!(
            names(Checks {
                energy_error: f64::NAN,
                ..sound
            }),
            ["residual"]
        );
        let singular = Checks {
            smallest_pivot: 1e-13,
            ..out
        };
        assert_eq!(names(singular), ["residual", "condition"]);
        assert_eq!(
            names(Checks {
                smallest_pivot: 0.0,
                ..sound
            }),
            ["condition"]
        );
        assert!(
            singular
                .doubts()
                .iter()
                .all(|d| d.words.contains("heck ") && d.value > d.limit)
        );
    }
}

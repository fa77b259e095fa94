//! Numbers of a design that cannot be trusted: what they are, what they may be, and what to do.

use serde::Serialize;

use super::{Checks, Design, Simulated};
use crate::evaluation::{EVERYWHERE, MatchedRow};

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
/// Share of the touches that may move no gauge above its noise.
const BLIND: f64 = 0.1;

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
        doubts.extend(blind(&self.evaluation.matched));
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

/// What the best of the largest sets does not feel of the lightest touches.
fn blind(rows: &[MatchedRow]) -> Option<Doubt> {
    let everywhere = rows.iter().filter(|r| r.region == EVERYWHERE);
    let best = everywhere.min_by(|a, b| {
        let largest = b.set.sensors.cmp(&a.set.sensors);
        let lightest = largest.then(a.force_n.total_cmp(&b.force_n));
        lightest.then(a.blind.total_cmp(&b.blind))
    })?;
    (best.blind > BLIND).then(|| Doubt {
        number: "blind",
        value: best.blind,
        limit: BLIND,
        words: format!(
            "{:.0} % of the touches of {} N move none of {} above its noise: nothing is felt there. See where (what is blind is marked on the part), add gauges near by or take quieter ones, or paint where touches come (touch.region).",
            100.0 * best.blind,
            crate::plain::digits(best.force_n),
            crate::plain::count(best.set.sensors, "gauge"),
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::{Chooser, EstimatorKind};
    use crate::placement::SelectorKind;

    fn row(sensors: usize, force_n: f64, blind: f64) -> MatchedRow {
        MatchedRow {
            estimator: EstimatorKind::Matching,
            force_n,
            set: Chooser::from(SelectorKind::ExpectedError).set(sensors),
            region: EVERYWHERE.into(),
            error_mm: 1.0,
            median_mm: 1.0,
            p95_mm: 2.0,
            as_built_mm: 2.0,
            calibrated_mm: None,
            sighted_mm: None,
            touches: 100,
            blind,
        }
    }

    #[test]
    fn what_is_not_felt_is_said_of_the_largest_set_and_the_lightest_touches() {
        let half = MatchedRow {
            region: "half".into(),
            ..row(10, 1.0, 0.9)
        };
        let rows = [
            row(5, 3.0, 0.5),
            row(10, 25.0, 0.0),
            row(10, 3.0, 0.04),
            half,
        ];
        assert_eq!(blind(&rows), None);
        let said = blind(&[row(10, 3.0, 0.3), row(10, 25.0, 0.0), row(10, 3.0, 0.12)]).unwrap();
        assert_eq!((said.number, said.value), ("blind", 0.12));
        assert!(
            said.words
                .starts_with("12 % of the touches of 3 N move none of 10 gauges"),
            "{}",
            said.words
        );
        assert_eq!(blind(&[]), None);
    }

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

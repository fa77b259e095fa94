//! What one step of each knob costs and buys.

use serde::{Deserialize, Serialize};

use super::{Knob, Measured, TradePoint};
use crate::statistics::midpoint_median;

/// What turning a knob up brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bought {
    /// The error falls, and by more than its own scatter over the pairs.
    Accuracy,
    /// It falls, but no more than it scatters.
    Unclear,
    /// It does not fall, though time goes up.
    Nothing,
    /// Neither moves.
    Idle,
}

/// One knob over all pairs of measured settings that differ by one step of it alone, each turned the way that is
/// thought to help: more of everything, from strain and a shell to another signal and a solid, from regression to
/// matching, from another selector to the one that chooses for the estimator in force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnobReport {
    /// Which knob.
    pub knob: Knob,
    /// Pairs of settings that differ in it alone.
    pub pairs: usize,
    /// Medians of the change (%): CPU time, mean and median error.
    pub cpu_percent: f64,
    /// Median change of the mean error (%).
    pub error_percent: f64,
    /// Median change of the median error (%).
    pub median_percent: f64,
    /// Standard error of the change of the mean error (%).
    pub scatter_percent: f64,
    /// What the change is worth.
    pub bought: Bought,
}

/// Every knob that was turned, what buys most first; and how far errors of one setting lie apart over its
/// repeats (standard deviation in % of their mean).
#[must_use]
pub fn knobs(points: &[TradePoint]) -> (Vec<KnobReport>, f64) {
    let repeat_scatter = repeat_scatter(points);
    let mut reports: Vec<KnobReport> = Knob::ALL
        .into_iter()
        .filter_map(|knob| report(knob, points, repeat_scatter))
        .collect();
    reports.sort_by(|a, b| a.error_percent.total_cmp(&b.error_percent));
    (reports, repeat_scatter)
}

fn report(knob: Knob, points: &[TradePoint], repeat_scatter: f64) -> Option<KnobReport> {
    /// A step that moves the time by less is free, and one that moves the error by less does not (%).
    const FREE: f64 = 5.0;
    const STILL: f64 = 3.0;
    let pairs = pairs(knob, points);
    if pairs.is_empty() {
        return None;
    }
    let changes = |figure: fn(&Measured) -> f64| -> Vec<f64> {
        let change = |(a, b): &(&Measured, &Measured)| 100.0 * (figure(b) / figure(a)).ln();
        pairs.iter().map(change).collect()
    };
    let errors = changes(|m| m.error_mm);
    let scatter = scatter(&errors, repeat_scatter);
    let [cpu, error, middle] = [
        midpoint_median(changes(|m| m.cpu_seconds)),
        midpoint_median(errors),
        midpoint_median(changes(|m| m.median_mm)),
    ];
    let bought = if error < -2.0 * scatter {
        Bought::Accuracy
    } else if error < -STILL {
        Bought::Unclear
    } else if cpu > FREE {
        Bought::Nothing
    } else {
        Bought::Idle
    };
    let percent = |log: f64| 100.0 * ((log / 100.0).exp() - 1.0);
    Some(KnobReport {
        knob,
        pairs: pairs.len(),
        cpu_percent: percent(cpu),
        error_percent: percent(error),
        median_percent: percent(middle),
        scatter_percent: scatter,
        bought,
    })
}

/// Standard error of the median of some changes (%): from their own scatter, for most of what moves an error moves
/// both of a pair; of a single pair from that of repeats.
fn scatter(changes: &[f64], repeat_scatter: f64) -> f64 {
    /// Of a median over that of a mean, for normal values.
    const MEDIAN: f64 = 1.253;
    const FEW: usize = 2;
    let n = changes.len() as f64;
    let one = if changes.len() < FEW {
        repeat_scatter * std::f64::consts::SQRT_2
    } else {
        let mean = changes.iter().sum::<f64>() / n;
        let squares: f64 = changes.iter().map(|c| (c - mean).powi(2)).sum();
        (squares / (n - 1.0)).sqrt()
    };
    MEDIAN * one / n.sqrt()
}

/// Settings one step of a knob apart, the lower first.
fn pairs(knob: Knob, points: &[TradePoint]) -> Vec<(&Measured, &Measured)> {
    let mut found = Vec::new();
    let single: Vec<&TradePoint> = points.iter().filter(|p| p.setting.repeat == 0).collect();
    for a in &single {
        for b in &single {
            if a.setting.rank(knob) < b.setting.rank(knob)
                && a.setting.differs_in(&b.setting) == Some(knob)
                && let (Some(x), Some(y)) = (a.measured(), b.measured())
                && x.error_mm * y.error_mm > 0.0
            {
                found.push((x, y));
            }
        }
    }
    found
}

/// How far the errors of repeats lie apart (% of their mean); zero where there are none.
fn repeat_scatter(points: &[TradePoint]) -> f64 {
    let Some(first) = points.iter().find(|p| p.setting.repeat > 0) else {
        return 0.0;
    };
    let same = |p: &&TradePoint| {
        super::TradeSetting {
            repeat: 1,
            ..p.setting
        } == super::TradeSetting {
            repeat: 1,
            ..first.setting
        }
    };
    let errors: Vec<f64> = points
        .iter()
        .filter(same)
        .filter_map(|p| Some(p.measured()?.error_mm))
        .filter(|mm| mm.is_finite())
        .collect();
    if errors.is_empty() {
        return 0.0;
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let squares: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
    let degrees = errors.len().saturating_sub(1).max(1) as f64;
    100.0 * (squares / degrees).sqrt() / mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::EstimatorKind;
    use crate::project::Project;
    use crate::trade::TradeSetting;

    #[test]
    fn a_knob_that_only_costs_is_named() {
        let mut project = Project::around("a.stl", None);
        project.evaluation.estimator = EstimatorKind::Svr;
        let centre = TradeSetting::centre(&project);
        let point = |setting: TradeSetting| {
            let spent = setting.limits.unwrap();
            let error =
                4.0 * (1200.0 / spent.vertices as f64).sqrt() + 0.02 * setting.repeat as f64;
            TradePoint {
                setting,
                outcome: Ok(Measured::made_up(
                    spent.folds as f64 + spent.vertices as f64 / 1000.0,
                    error,
                )),
            }
        };
        let mut points: Vec<TradePoint> = (0..3)
            .map(|repeat| point(TradeSetting { repeat, ..centre }))
            .collect();
        for knob in [Knob::Vertices, Knob::Folds, Knob::PointTip] {
            points.extend(centre.neighbours(knob).into_iter().map(point));
        }
        let (reports, repeat_scatter) = knobs(&points);
        assert!(
            repeat_scatter > 0.1 && repeat_scatter < 1.0,
            "{repeat_scatter}"
        );
        let of = |knob| reports.iter().find(|r| r.knob == knob).unwrap();
        assert_eq!(reports[0].knob, Knob::Vertices);
        assert_eq!(of(Knob::Vertices).bought, Bought::Accuracy);
        assert_eq!(of(Knob::Vertices).pairs, 2);
        assert!((of(Knob::Vertices).error_percent + 29.3).abs() < 0.1);
        assert_eq!(of(Knob::Folds).bought, Bought::Nothing);
        assert_eq!(of(Knob::PointTip).bought, Bought::Idle);
        assert!(of(Knob::Folds).cpu_percent > 10.0);
    }
}

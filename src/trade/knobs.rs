//! What one step of each knob costs and buys.

use serde::{Deserialize, Serialize};

use super::{Knob, Measured, Point};

/// What paying more at a knob brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bought {
    /// The error falls by more than it moves by itself.
    Accuracy,
    /// It does not, though the knob costs time.
    Nothing,
    /// Neither time nor error moves by more than they do by themselves.
    Idle,
}

/// One knob over all pairs of measured settings that differ by one step of it, each from the cheaper to the
/// dearer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnobReport {
    pub knob: Knob,
    pub pairs: usize,
    /// Medians of the change from the cheaper to the dearer (%): processor time, mean and median error.
    pub cpu_percent: f64,
    pub error_percent: f64,
    pub median_percent: f64,
    pub bought: Bought,
}

/// Every knob that was turned, what buys most first; and how far errors of one setting lie apart over its
/// repeats (standard deviation in % of their mean).
#[must_use]
pub fn knobs(points: &[Point]) -> (Vec<KnobReport>, f64) {
    let spread = spread(points);
    let mut reports: Vec<KnobReport> = Knob::ALL
        .into_iter()
        .filter_map(|knob| report(knob, points, spread))
        .collect();
    reports.sort_by(|a, b| a.error_percent.total_cmp(&b.error_percent));
    (reports, spread)
}

fn report(knob: Knob, points: &[Point], spread: f64) -> Option<KnobReport> {
    /// A step that moves the time by less is free (%).
    const FREE: f64 = 5.0;
    let pairs = pairs(knob, points);
    if pairs.is_empty() {
        return None;
    }
    let change = |figure: fn(&Measured) -> f64| {
        median(
            pairs
                .iter()
                .map(|(a, b)| 100.0 * (figure(b) / figure(a)).ln())
                .collect(),
        )
    };
    let [cpu, error, middle] = [
        change(|m| m.cpu_seconds),
        change(|m| m.error_mm),
        change(|m| m.median_mm),
    ];
    // The median of n pairs moves by less than one of them does.
    let noise = spread * std::f64::consts::SQRT_2 / (pairs.len() as f64).sqrt();
    let bought = if error < -noise {
        Bought::Accuracy
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
        bought,
    })
}

/// Settings one step of a knob apart, the cheaper first.
fn pairs(knob: Knob, points: &[Point]) -> Vec<(&Measured, &Measured)> {
    let mut found = Vec::new();
    for (k, a) in points.iter().enumerate() {
        for b in &points[k + 1..] {
            if a.setting.repeat + b.setting.repeat > 0
                || a.setting.differs_in(&b.setting) != Some(knob)
            {
                continue;
            }
            if let (Some(x), Some(y)) = (a.measured(), b.measured()) {
                let rises = x.cpu_seconds <= y.cpu_seconds;
                found.push(if rises { (x, y) } else { (y, x) });
            }
        }
    }
    found
}

/// How far the errors of repeats lie apart (% of their mean); zero where there are none.
fn spread(points: &[Point]) -> f64 {
    let Some(first) = points.iter().find(|p| p.setting.repeat > 0) else {
        return 0.0;
    };
    let same = |p: &&Point| {
        super::Setting {
            repeat: 1,
            ..p.setting
        } == super::Setting {
            repeat: 1,
            ..first.setting
        }
    };
    let errors: Vec<f64> = points
        .iter()
        .filter(same)
        .filter_map(|p| Some(p.measured()?.error_mm))
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let squares: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
    let degrees = errors.len().saturating_sub(1).max(1) as f64;
    100.0 * (squares / degrees).sqrt() / mean
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    f64::midpoint(values[(n - 1) / 2], values[n / 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Project;
    use crate::trade::Setting;

    #[test]
    fn a_knob_that_only_costs_is_named() {
        let project = Project::around("a.stl", None);
        let centre = Setting::centre(&project);
        let point = |setting: Setting| {
            let spent = setting.limits.unwrap();
            let error =
                4.0 * (1200.0 / spent.vertices as f64).sqrt() + 0.02 * setting.repeat as f64;
            Point {
                setting,
                outcome: Ok(Measured {
                    cpu_seconds: spent.folds as f64 + spent.vertices as f64 / 1000.0,
                    seconds: 1.0,
                    stages: Vec::new(),
                    judge_cpu_seconds: 0.0,
                    memory_mb: None,
                    error_mm: error,
                    median_mm: error,
                    p95_mm: error,
                    workshop_mm: error,
                    own_error_mm: error,
                    model_percent: 1.0,
                    candidates: 10,
                    sites_mm: Vec::new(),
                }),
            }
        };
        let mut points: Vec<Point> = (0..3)
            .map(|repeat| point(Setting { repeat, ..centre }))
            .collect();
        for knob in [Knob::Vertices, Knob::Folds, Knob::PointTip] {
            points.extend(centre.neighbours(knob).into_iter().map(point));
        }
        let (reports, spread) = knobs(&points);
        assert!(spread > 0.1 && spread < 1.0, "{spread}");
        let of = |knob| reports.iter().find(|r| r.knob == knob).unwrap();
        assert_eq!(reports[0].knob, Knob::Vertices);
        assert_eq!(of(Knob::Vertices).bought, Bought::Accuracy);
        assert_eq!(of(Knob::Vertices).pairs, 2);
        assert!((of(Knob::Vertices).error_percent + 29.3).abs() < 0.1);
        assert_eq!(of(Knob::Folds).bought, Bought::Nothing);
        assert_eq!(of(Knob::PointTip).bought, Bought::Idle);
    }
}

//! Which settings no other beats, and which of them answers what is asked for.

use super::{Measured, TradePoint};
use crate::project::Project;
use crate::statistics::median;

/// What is asked of speed or of accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TradeConstraint {
    /// An answer within so many seconds by the clock.
    Within(f64),
    /// An error at most so much (mm) above the best that was measured.
    OfTheBest(f64),
}

/// The points that answer the project's question and that no other such point beats in both time and error,
/// the quickest first. A point that costs the same and errs the same as another is kept once.
#[must_use]
pub fn front<'a>(project: &Project, points: &'a [TradePoint]) -> Vec<&'a TradePoint> {
    let mut own: Vec<(&TradePoint, &Measured)> = points
        .iter()
        .filter(|p| p.setting.answers(project))
        .filter_map(|p| Some((p, p.measured()?)))
        .filter(|(_, m)| m.error_mm.is_finite() && m.cpu_seconds.is_finite())
        .collect();
    own.sort_by(|(_, a), (_, b)| {
        (a.cpu_seconds.total_cmp(&b.cpu_seconds)).then(a.error_mm.total_cmp(&b.error_mm))
    });
    let mut best = f64::INFINITY;
    own.retain(|(_, m)| {
        let better = m.error_mm < best;
        best = best.min(m.error_mm);
        better
    });
    own.into_iter().map(|(p, _)| p).collect()
}

/// Seconds by the clock a processor second: the median over all points, so that what else ran on the machine while
/// one of them was measured does not count.
#[must_use]
pub fn clock(points: &[TradePoint]) -> f64 {
    let measured = points.iter().filter_map(TradePoint::measured);
    let ratios = measured.map(|m| m.seconds / m.cpu_seconds);
    median(ratios.filter(|r| r.is_finite() && *r > 0.0)).unwrap_or(1.0)
}

/// The point of a front that keeps a promise: the most accurate within the time, or the quickest within the
/// error. Nothing where none does. `clock` is how many seconds pass for one of the processor ([`clock`]).
#[must_use]
pub fn answer<'a>(
    front: &[&'a TradePoint],
    asked: TradeConstraint,
    clock: f64,
) -> Option<&'a TradePoint> {
    let fits =
        |point: &&&TradePoint, fits: &dyn Fn(&Measured) -> bool| point.measured().is_some_and(fits);
    let found = match asked {
        TradeConstraint::Within(seconds) => {
            let in_time = |m: &Measured| m.cpu_seconds * clock <= seconds;
            front.iter().rfind(|p| fits(p, &in_time))
        }
        TradeConstraint::OfTheBest(mm) => {
            let best = front.last()?.measured()?.error_mm;
            let as_good = |m: &Measured| m.error_mm <= best + mm;
            front.iter().find(|p| fits(p, &as_good))
        }
    };
    found.copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Quality;
    use crate::evaluation::EstimatorKind;
    use crate::trade::TradeSetting;

    fn point(repeat: u64, cpu_seconds: f64, error_mm: f64) -> TradePoint {
        let project = Project::around("a.stl", None);
        TradePoint {
            setting: TradeSetting {
                repeat,
                ..TradeSetting::named(&project, Quality::Draft)
            },
            outcome: Ok(Measured::made_up(cpu_seconds, error_mm)),
        }
    }

    #[test]
    fn what_is_beaten_in_both_is_left_out() {
        let project = Project::around("a.stl", None);
        let mut points = vec![
            point(0, 8.0, 2.0),
            point(0, 2.0, 6.0),
            point(0, 4.0, 7.0),
            point(0, 4.0, 3.0),
            point(0, 9.0, 2.0),
            point(1, 1.0, 0.1),
            point(0, 0.5, f64::NAN),
        ];
        points.push(TradePoint {
            outcome: Err("no room".into()),
            ..point(0, 0.1, 0.1)
        });
        let mut other = point(0, 0.1, 0.1);
        other.setting.estimator = EstimatorKind::Svr;
        points.push(other);
        let kept = front(&project, &points);
        let figures: Vec<f64> = (kept.iter())
            .filter_map(|p| Some(p.measured()?.error_mm))
            .collect();
        assert_eq!(figures, [6.0, 3.0, 2.0]);
        let found = |asked| {
            answer(&kept, asked, 0.5)
                .and_then(TradePoint::measured)
                .map(|m| m.error_mm)
        };
        assert_eq!(found(TradeConstraint::Within(2.5)), Some(3.0));
        assert_eq!(found(TradeConstraint::Within(0.5)), None);
        assert_eq!(found(TradeConstraint::OfTheBest(1.0)), Some(3.0));
        assert_eq!(found(TradeConstraint::OfTheBest(0.0)), Some(2.0));
        assert_eq!(clock(&points), 0.5);
        assert_eq!(answer(&[], TradeConstraint::OfTheBest(1.0), 1.0), None);
    }
}

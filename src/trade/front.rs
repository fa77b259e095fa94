//! Which settings no other beats, and which of them answers a wish.

use super::{Measured, Point};
use crate::project::Project;

/// A wish for speed or for accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    /// An answer within so many seconds by the clock.
    Within(f64),
    /// An error at most so much (mm) above the best that was measured.
    OfTheBest(f64),
}

/// The points that answer the project's question and that no other such point beats in both time and error,
/// the quickest first. A point that costs the same and errs the same as another is kept once.
#[must_use]
pub fn front<'a>(project: &Project, points: &'a [Point]) -> Vec<&'a Point> {
    let mut own: Vec<(&Point, &Measured)> = points
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

/// The point of a front that keeps a promise: the most accurate within the time, or the quickest within the
/// error. Nothing where none does.
#[must_use]
pub fn answer<'a>(front: &[&'a Point], asked: Asked) -> Option<&'a Point> {
    let measured = |p: &&&Point| p.measured().cloned();
    match asked {
        Asked::Within(seconds) => front
            .iter()
            .rfind(|p| measured(p).is_some_and(|m| m.seconds <= seconds))
            .copied(),
        Asked::OfTheBest(mm) => {
            let best = front.last()?.measured()?.error_mm;
            front
                .iter()
                .find(|p| measured(p).is_some_and(|m| m.error_mm <= best + mm))
                .copied()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Quality;
    use crate::trade::{Estimator, Setting};

    fn point(repeat: u64, cpu_seconds: f64, error_mm: f64) -> Point {
        let project = Project::around("a.stl", None);
        Point {
            setting: Setting {
                repeat,
                ..Setting::named(&project, Quality::Draft)
            },
            outcome: Ok(Measured {
                cpu_seconds,
                seconds: cpu_seconds / 2.0,
                stages: Vec::new(),
                judge_cpu_seconds: 0.0,
                memory_mb: None,
                error_mm,
                median_mm: error_mm,
                p95_mm: error_mm,
                workshop_mm: error_mm,
                own_error_mm: error_mm,
                model_percent: 1.0,
                candidates: 10,
                sites_mm: Vec::new(),
            }),
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
        points.push(Point {
            outcome: Err("no room".into()),
            ..point(0, 0.1, 0.1)
        });
        let mut other = point(0, 0.1, 0.1);
        other.setting.estimator = Estimator::Matching;
        points.push(other);
        let kept = front(&project, &points);
        let figures: Vec<f64> = (kept.iter())
            .filter_map(|p| Some(p.measured()?.error_mm))
            .collect();
        assert_eq!(figures, [6.0, 3.0, 2.0]);
        let found = |asked| {
            answer(&kept, asked)
                .and_then(Point::measured)
                .map(|m| m.error_mm)
        };
        assert_eq!(found(Asked::Within(2.5)), Some(3.0));
        assert_eq!(found(Asked::Within(0.5)), None);
        assert_eq!(found(Asked::OfTheBest(1.0)), Some(3.0));
        assert_eq!(found(Asked::OfTheBest(0.0)), Some(2.0));
        assert_eq!(answer(&[], Asked::OfTheBest(1.0)), None);
    }
}

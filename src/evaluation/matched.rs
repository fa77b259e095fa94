//! Errors of sets whose readings were matched to the elastic model: at several forces, as drawn, as built, and as
//! built after known presses.

use serde::Serialize;

use super::judging::EstimatorKind;
use super::rows::{EvaluationRow, JudgedSet, NamedRegion, quoted};
use super::set_id::SetId;
use crate::statistics::mean;

/// What was found of one set under touches of one force: errors touch by touch (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct Matched {
    /// Which set.
    pub set: SetId,
    /// N.
    pub force_n: f64,
    /// As drawn.
    pub errors: Vec<f64>,
    /// As a workshop would build it, of which the estimator knows no more than how far off it usually is.
    pub built: Vec<f64>,
    /// The same gauges after known presses, where these were made.
    pub calibrated: Option<Vec<f64>>,
    /// Whether a touch moves no gauge of the set so far that it is told from noise.
    pub blind: Vec<bool>,
}

/// Errors of one set under touches of one force in one region (mm).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MatchedRow {
    /// What located the touches.
    pub estimator: EstimatorKind,
    /// How hard the touches were (N).
    pub force_n: f64,
    /// Which set.
    #[serde(flatten)]
    pub set: SetId,
    /// Name of the region, or of all touches.
    pub region: String,
    /// Mean Euclidean error as drawn.
    pub error_mm: f64,
    /// Median error as drawn (mm).
    pub median_mm: f64,
    /// 95th percentile of the error as drawn (mm).
    pub p95_mm: f64,
    /// Mean as a workshop would build it, uncalibrated.
    pub as_built_mm: f64,
    /// Mean of the same after known presses; absent where none were made.
    pub calibrated_mm: Option<f64>,
    /// Mean as drawn over the touches that are not blind; absent where all are.
    pub sighted_mm: Option<f64>,
    /// Test touches in the region.
    pub touches: usize,
    /// Share of the touches that move no gauge so far that it is told from noise.
    pub blind: f64,
}

impl Matched {
    /// Its errors as those of any other set.
    pub(super) fn judged(&self) -> JudgedSet {
        JudgedSet {
            set: self.set,
            hyper: None,
            converged: None,
            drawn: self.errors.clone(),
            built: self.built.clone(),
        }
    }

    /// A row for all touches, and one for each region that has any.
    pub(super) fn rows(&self, regions: &[NamedRegion]) -> Vec<MatchedRow> {
        let (regions, judged) = (quoted(regions, self.errors.len()), self.judged());
        let row = |region| self.row(region, judged.row(region));
        regions.iter().map(row).collect()
    }

    fn row(&self, region: &NamedRegion, all: EvaluationRow) -> MatchedRow {
        let blind = region.within(&self.blind);
        let errors = region.within(&self.errors).into_iter().zip(&blind);
        let sighted: Vec<f64> = errors.filter_map(|(e, b)| (!b).then_some(e)).collect();
        MatchedRow {
            estimator: EstimatorKind::Matching,
            force_n: self.force_n,
            set: self.set,
            region: all.region,
            error_mm: all.error_mm,
            median_mm: all.median_mm,
            p95_mm: all.p95_mm,
            as_built_mm: all.workshop_mm,
            calibrated_mm: (self.calibrated.as_ref()).map(|errors| mean(&region.within(errors))),
            sighted_mm: (!sighted.is_empty()).then(|| mean(&sighted)),
            touches: all.touches,
            blind: (blind.len() - sighted.len()) as f64 / blind.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::{Chooser, EVERYWHERE, Evaluation, Judging, JudgingForces};
    use crate::placement::SelectorKind;

    fn pca_qr(sensors: usize) -> SetId {
        Chooser::from(SelectorKind::PcaQr).set(sensors)
    }

    fn matched(sensors: usize, force_n: f64) -> Matched {
        Matched {
            set: pca_qr(sensors),
            force_n,
            errors: vec![1.0, 2.0, 3.0, 30.0],
            built: vec![2.0, 2.0, 4.0, 40.0],
            calibrated: (sensors > 1).then(|| vec![1.0, 2.0, 3.0, 34.0]),
            blind: vec![false, false, false, true],
        }
    }

    fn half() -> NamedRegion {
        NamedRegion {
            name: "half".into(),
            contains: vec![true, true, false, false],
        }
    }

    #[test]
    fn errors_are_quoted_with_and_without_blind_touches() {
        let rows = matched(2, 10.0).rows(&[half()]);
        assert_eq!(rows.len(), 2);
        let [all, half] = [&rows[0], &rows[1]];
        assert_eq!((all.region.as_str(), all.touches), (EVERYWHERE, 4));
        assert_eq!((all.error_mm, all.as_built_mm), (9.0, 12.0));
        assert_eq!((all.calibrated_mm, all.sighted_mm), (Some(10.0), Some(2.0)));
        assert_eq!((all.blind, half.blind), (0.25, 0.0));
        assert_eq!((half.error_mm, half.calibrated_mm), (1.5, Some(1.5)));
        let mut blind = matched(1, 10.0);
        blind.blind = vec![true; 4];
        let row = &blind.rows(&[])[0];
        assert_eq!((row.sighted_mm, row.calibrated_mm), (None, None));
    }

    #[test]
    fn sets_are_compared_at_the_force_in_the_middle_in_any_regions() {
        let judging = Judging::Matching(JudgingForces {
            judged_n: vec![3.0, 10.0, 25.0],
            most_n: 60.0,
        });
        let found = vec![
            matched(1, 10.0),
            matched(2, 3.0),
            matched(2, 10.0),
            matched(2, 25.0),
        ];
        let evaluation = Evaluation::of_matched(judging, found, &[]);
        assert_eq!((evaluation.rows.len(), evaluation.sets.len()), (2, 2));
        assert_eq!(evaluation.rows[1].workshop_mm, 12.0);
        let forces = evaluation.by_force(pca_qr(2)).map(|r| r.force_n);
        let forces: Vec<f64> = forces.collect();
        assert_eq!(forces, [3.0, 10.0, 25.0]);
        let quoted = evaluation.in_regions(&[half()]);
        assert_eq!((quoted.rows.len(), quoted.matched.len()), (4, 8));
        assert_eq!(quoted.sets, evaluation.sets);
        assert_eq!(quoted.in_regions(&[]).matched, evaluation.matched);
    }
}

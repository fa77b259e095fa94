//! Judging by estimators that compare a reading with touches that are known: matching, and the nearest neighbours.

use rayon::prelude::*;

use super::question::{Estimator, HeldOut, JudgedQuestion, Parts, StudyQuestion};
use super::{Data, knowledge};
use crate::budget::{Cancelled, Watch, report};
use crate::dataset::SignalMatrix;
use crate::evaluation::failures::{Draw, FailureRow};
use crate::inference::MeasuredMatching;
use crate::placement::expected_error::ReadingScatter;
use crate::regression::Standardizer;
use crate::regression::folds::evenly;
use crate::regression::tune::distances;

/// An estimator that has seen its templates.
enum SeenTemplates {
    Matching(MeasuredMatching),
    Nearest(Nearest),
}

impl SeenTemplates {
    /// From some sites under some touches of data.
    fn new(
        data: &Data,
        question: &StudyQuestion,
        groups: &[usize],
        rows: &[usize],
        touches: &[usize],
    ) -> Self {
        let x = data.x.select_rows(rows).select_columns(touches);
        let targets: Vec<[f64; 3]> = touches.iter().map(|&t| data.targets[t]).collect();
        if question.estimator == Estimator::Nearest {
            let groups: Vec<usize> = touches.iter().map(|&t| groups[t]).collect();
            return Self::Nearest(Nearest::new(&x, targets, &groups));
        }
        let forces: Vec<f64> = if data.forces.is_empty() {
            Vec::new()
        } else {
            touches.iter().map(|&t| data.forces[t]).collect()
        };
        let known = (!forces.is_empty()).then_some(&forces[..]);
        let scatter = ReadingScatter::of(&x, &targets, known);
        let variance = |site: usize, touch: usize| scatter.variance(site, touch);
        let known = knowledge(&forces, None, question.noise, question.svr.seed, &variance);
        Self::Matching(MeasuredMatching::new(&x, &targets, &known))
    }

    /// Where each touch is thought to be (mm), from signals (sites × touches) of which some sites are used.
    fn find(&self, x: &SignalMatrix, used: &[bool]) -> Vec<[f64; 3]> {
        let find = |touch: usize| {
            let reading: Vec<f64> = (0..x.rows()).map(|r| x.row(r)[touch]).collect();
            match self {
                Self::Matching(matching) => matching.find(&reading, used).to_array(),
                Self::Nearest(nearest) => nearest.find(&reading, used),
            }
        };
        (0..x.columns()).into_par_iter().map(find).collect()
    }

    fn neighbours(&self) -> Option<usize> {
        match self {
            Self::Matching(_) => None,
            Self::Nearest(nearest) => Some(nearest.count),
        }
    }
}

/// The nearest neighbours in standardized signals, weighted by one over their distance.
struct Nearest {
    standard: Standardizer,
    /// Touch by touch, a value a site.
    signals: Vec<Vec<f64>>,
    targets: Vec<[f64; 3]>,
    /// How many are averaged.
    count: usize,
}

impl Nearest {
    /// Numbers of neighbours that are tried.
    const COUNTS: [usize; 4] = [1, 2, 4, 8];

    /// With the number of neighbours that finds touches best from those of other groups.
    fn new(x: &SignalMatrix, targets: Vec<[f64; 3]>, groups: &[usize]) -> Self {
        /// Touches that numbers of neighbours are tried on.
        const TRIED: usize = 500;
        let standard = Standardizer::of(x);
        let z = standard.apply(x);
        let mut nearest = Self {
            standard,
            signals: (0..targets.len())
                .map(|t| (0..z.rows()).map(|r| z.row(r)[t]).collect())
                .collect(),
            targets,
            count: 1,
        };
        let used = vec![true; x.rows()];
        let errors = |t: &usize| {
            let others = |o: usize| groups[o] != groups[*t];
            let near = nearest.around(&nearest.signals[*t], &used, &others);
            Self::COUNTS.map(|count| {
                let found = nearest.mean(&near[..count.min(near.len())]);
                distances(&[found], &nearest.targets[*t..=*t])[0]
            })
        };
        let tried = evenly(nearest.targets.len(), TRIED);
        let errors: Vec<[f64; 4]> = tried.par_iter().map(errors).collect();
        let sum = |k: usize| errors.iter().map(|e| e[k]).sum::<f64>();
        let best = (0..Self::COUNTS.len()).min_by(|&a, &b| sum(a).total_cmp(&sum(b)));
        nearest.count = best.map_or(1, |k| Self::COUNTS[k]);
        nearest
    }

    fn find(&self, reading: &[f64], used: &[bool]) -> [f64; 3] {
        let near = self.around(&self.standard.apply_to(reading), used, &|_| true);
        self.mean(&near[..self.count.min(near.len())])
    }

    /// The nearest of the touches that are allowed, with the squares of their distances: as many as are ever asked
    /// for.
    fn around(
        &self,
        signal: &[f64],
        used: &[bool],
        allowed: &dyn Fn(usize) -> bool,
    ) -> Vec<(f64, usize)> {
        let most = Self::COUNTS[Self::COUNTS.len() - 1];
        let away = |touch: usize| -> f64 {
            let pairs = signal.iter().zip(&self.signals[touch]).zip(used);
            let kept = pairs.filter(|(_, used)| **used);
            kept.map(|((a, b), _)| (a - b) * (a - b)).sum()
        };
        let mut near: Vec<(f64, usize)> = (0..self.signals.len())
            .filter(|&t| allowed(t))
            .map(|t| (away(t), t))
            .collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if near.len() > most {
            near.select_nth_unstable_by(most, order);
            near.truncate(most);
        }
        near.sort_by(order);
        near
    }

    /// The mean place (mm) of some touches; the middle of all where there are none.
    fn mean(&self, near: &[(f64, usize)]) -> [f64; 3] {
        /// Squares of distances below this are no distance: signals are standardized.
        const SAME: f64 = 1e-18;
        let all: Vec<(f64, usize)>;
        let near = if near.is_empty() {
            all = (0..self.targets.len()).map(|t| (1.0, t)).collect();
            &all[..]
        } else {
            near
        };
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for &(squared, touch) in near {
            let weight = squared.max(SAME).sqrt().recip();
            for (s, p) in sum.iter_mut().zip(self.targets[touch]) {
                *s += weight * p;
            }
            weights += weight;
        }
        sum.map(|s| s / weights)
    }
}

/// Judges the sites of a question: templates are the touches as they were measured, and what is judged is heard with
/// the noise asked for.
pub(super) fn judge(
    data: &Data,
    question: &StudyQuestion,
    parts: &Parts,
    watch: Watch,
) -> Result<JudgedQuestion, Cancelled> {
    let judge = TemplateJudge {
        data,
        question,
        parts,
        watch,
    };
    let gauges = question.sites.len();
    let errors: Result<Vec<HeldOut>, Cancelled> = (1..=gauges)
        .map(|count| judge.held_out(&question.sites[..count], count))
        .collect();
    let all: Vec<usize> = (0..data.x.rows()).collect();
    Ok(JudgedQuestion {
        criteria_mm: judge.criteria()?,
        errors: errors?,
        baseline: question
            .baseline
            .then(|| judge.held_out(&all, gauges))
            .transpose()?,
        failures: judge.failures()?,
    })
}

struct TemplateJudge<'a> {
    data: &'a Data,
    question: &'a StudyQuestion<'a>,
    parts: &'a Parts<'a>,
    watch: Watch<'a>,
}

impl TemplateJudge<'_> {
    fn seen(&self, rows: &[usize], touches: &[usize]) -> SeenTemplates {
        SeenTemplates::new(self.data, self.question, self.parts.groups, rows, touches)
    }

    /// Errors (mm) at some touches, with some of the gauges.
    fn errors(
        &self,
        seen: &SeenTemplates,
        rows: &[usize],
        touches: &[usize],
        used: &[bool],
    ) -> Vec<f64> {
        let x = self.parts.signals.select_rows(rows).select_columns(touches);
        let targets: Vec<[f64; 3]> = touches.iter().map(|&t| self.data.targets[t]).collect();
        distances(&seen.find(&x, used), &targets)
    }

    fn held_out(&self, rows: &[usize], step: usize) -> Result<HeldOut, Cancelled> {
        report(self.watch, "Judging sites", step, self.question.sites.len())?;
        let seen = self.seen(rows, self.parts.train);
        let errors = self.errors(&seen, rows, self.parts.test, &vec![true; rows.len()]);
        Ok(HeldOut {
            neighbours: seen.neighbours(),
            ..HeldOut::of(rows.len(), errors)
        })
    }

    /// For one gauge, two, … all: the mean over folds of the mean error (mm).
    fn criteria(&self) -> Result<Vec<f64>, Cancelled> {
        let folds = self.parts.folds;
        let sites = self.question.sites;
        let of = |count: usize| -> Result<f64, Cancelled> {
            let rows = &sites[..count];
            let mut sum = 0.0;
            for part in &folds.parts {
                report(self.watch, "Cross-validating", count, sites.len())?;
                let (before, rest) = folds.order.split_at(part.start);
                let (test, after) = rest.split_at(part.len());
                let seen = self.seen(rows, &[before, after].concat());
                let errors = self.errors(&seen, rows, test, &vec![true; count]);
                sum += errors.iter().sum::<f64>() / errors.len().max(1) as f64;
            }
            Ok(sum / folds.parts.len() as f64)
        };
        (1..=sites.len()).map(of).collect()
    }

    /// What lost gauges cost: they are left out, and nothing has to be learned anew for that.
    fn failures(&self) -> Result<Vec<FailureRow>, Cancelled> {
        /// Touches that losses are tried on.
        const TRIED: usize = 200;
        let question = self.question;
        let gauges = question.sites.len();
        let seen = self.seen(question.sites, self.parts.train);
        let tried = evenly(self.parts.test.len(), TRIED);
        let touches: Vec<usize> = tried.iter().map(|&k| self.parts.test[k]).collect();
        let mean = |lost: &[usize]| {
            let used: Vec<bool> = (0..gauges).map(|g| !lost.contains(&g)).collect();
            let errors = self.errors(&seen, question.sites, &touches, &used);
            errors.iter().sum::<f64>() / errors.len().max(1) as f64
        };
        let mut rows = vec![FailureRow::unharmed(mean(&[]))];
        let most = question.failed.min(gauges.saturating_sub(1));
        for failed in 1..=most {
            let draw = Draw {
                gauges,
                failed,
                most: question.subsets,
                seed: question.svr.seed,
            };
            rows.push(draw.row(false, |lost| {
                report(self.watch, "Failing gauges", failed - 1, most)?;
                Ok(mean(lost))
            })?);
        }
        Ok(rows)
    }
}

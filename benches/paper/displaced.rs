//! Displacements, as in the paper: four selectors, sets of one gauge to thirty, read by regression.

use std::fmt::Write as _;

use hapdef::budget::{Budget, unwatched};
use hapdef::dataset;
use hapdef::design::{self, DesignError, Inputs, ReducedSites, Reference, Simulated};
use hapdef::evaluation::{Chooser, EVERYWHERE, EstimatorKind, Evaluation, EvaluationRow};
use hapdef::feasible::Feasibility;
use hapdef::placement::{Selection, SelectorKind};

use crate::kernels::Chosen;
use crate::{MANY, SIZES, Stages};

/// The limb with what was chosen on it by displacements.
pub struct Displaced {
    pub inputs: Inputs,
    pub budget: Budget,
    pub simulated: Simulated,
    pub feasibility: Feasibility,
    pub reduced: ReducedSites,
    /// By the paper's selectors: sets of `SIZES`.
    pub selections: Vec<Selection>,
}

/// What was found of all sets by the same judge.
pub struct Judged {
    /// Unseen touches.
    pub touches: usize,
    /// Of the four selectors.
    pub evaluation: Evaluation,
    /// The same under these touches on the very model that was trained on, as the paper judges.
    pub on_own_model: Evaluation,
    /// Of what each of the authors' kernels chose.
    pub theirs: Vec<Evaluation>,
}

impl Displaced {
    pub fn of(inputs: Inputs, budget: Budget, stages: &mut Stages) -> Result<Self, DesignError> {
        let simulated = design::simulate(&inputs, &budget, &unwatched)?;
        stages.end("simulating displacements");
        let feasibility = design::filter(&inputs, &simulated);
        let reduced = design::reduce_sites(&inputs, &simulated, &feasibility, &budget)?;
        stages.end("filtering and reducing sites");
        let mut selections = Vec::new();
        for kind in SelectorKind::PAPER {
            let chosen = design::Choosing {
                inputs: &inputs,
                simulated: &simulated,
                reduced: &reduced,
                budget: &budget,
                watch: &unwatched,
            }
            .select(kind)?;
            selections.push(of_sizes(&chosen, &SIZES));
            stages.end(&format!("choosing by {}", kind.name()));
        }
        Ok(Self {
            inputs,
            budget,
            simulated,
            feasibility,
            reduced,
            selections,
        })
    }

    /// All sets judged on the same touches: those of the four selectors, and those by the authors' kernels.
    pub fn judged(&self, theirs: &[Chosen], stages: &mut Stages) -> Result<Judged, DesignError> {
        let mut all = self.selections.clone();
        all.extend(theirs.iter().flat_map(|k| k.selections.iter().cloned()));
        let sites = design::sites_to_judge(EstimatorKind::Svr, &self.reduced, &all);
        let reference = design::reference(
            &self.inputs,
            &self.simulated,
            &sites,
            &self.budget,
            &unwatched,
        )?;
        stages.end("measuring on a finer model");
        let evaluation = self.judge(&self.selections, &reference, &self.budget)?;
        stages.end("judging by regression");
        let own = self.on_own_model(&reference)?;
        let on_own_model = self.judge(&self.selections, &own, &self.budget)?;
        stages.end("judging on the model's own data");
        let whole = Budget {
            failure_subsets: 0,
            ..self.budget
        };
        let theirs: Result<Vec<Evaluation>, DesignError> = (theirs.iter())
            .map(|kernel| self.judge(&kernel.selections, &reference, &whole))
            .collect();
        let theirs = theirs?;
        stages.end("judging their kernel");
        Ok(Judged {
            touches: reference.touches.len(),
            evaluation,
            on_own_model,
            theirs,
        })
    }

    /// What the model itself says of unseen touches: neither its elements nor gluing are off.
    fn on_own_model(&self, finer: &Reference) -> Result<Reference, DesignError> {
        let (project, known) = (&self.inputs.project, &self.simulated.dataset);
        let model = self.simulated.model()?;
        let place = |&site: &usize| model.index().nearest(known.sites[site].gauge.position).0;
        let points: Vec<_> = finer.sites.iter().map(place).collect();
        let asked = dataset::AskedSignals {
            signal: known.signal,
            directions: 1,
            slope_touches: &[],
            making: &project.making(),
        };
        let touches = finer.touches.clone();
        let data = dataset::simulate(&*model, touches, &points, &asked, &unwatched)?;
        Ok(Reference {
            touches: data.touches,
            regions: finer.regions.clone(),
            element_mm: self.simulated.element_mm,
            work: data.work,
            sites: finer.sites.clone(),
            drawn: data.sites.iter().map(|s| s.gauge).collect(),
            workshop: data.x.clone(),
            x: data.x,
            off: finer.off,
            grid: finer.grid,
            pressed: None,
        })
    }

    fn judge(
        &self,
        selections: &[Selection],
        reference: &Reference,
        budget: &Budget,
    ) -> Result<Evaluation, DesignError> {
        design::Choosing {
            inputs: &self.inputs,
            simulated: &self.simulated,
            reduced: &self.reduced,
            budget,
            watch: &unwatched,
        }
        .evaluate(selections, reference)
    }
}

/// A selection with its sets of some sizes only, in this order.
pub fn of_sizes(selection: &Selection, sizes: &[usize]) -> Selection {
    let of_size = |&size: &usize| selection.sets.iter().find(|s| s.sites.len() == size);
    Selection {
        sets: sizes.iter().filter_map(of_size).cloned().collect(),
        ..selection.clone()
    }
}

/// What was found of a selector's set of so many gauges.
pub fn row(found: &Evaluation, kind: SelectorKind, gauges: usize) -> Option<&EvaluationRow> {
    found.over_all(Chooser::from(kind).set(gauges))
}

/// What was found of all candidates together.
pub fn baseline(found: &Evaluation) -> Option<&EvaluationRow> {
    found.baseline(EVERYWHERE)
}

/// What is left of a selector's largest set when so many of its gauges fail: mean error and the worst one (mm).
pub fn with_failed(
    found: &Evaluation,
    kind: SelectorKind,
    failed: usize,
    retrained: bool,
) -> Option<(f64, f64)> {
    let set = found.failures_of(kind)?;
    let mut rows = set.rows.iter().filter(|r| r.failed == failed);
    let row = rows.find(|r| failed == 0 || r.retrained == retrained)?;
    Some((row.error_mm, row.worst_mm))
}

pub fn write(text: &mut String, found: &Judged) {
    text.push_str("### Displacement by regression\n\nMean / median / 95 % (mm) of unseen touches on a finer model, then the mean with every gauge glued off its place. No noise, as in the paper; the regression is tuned for each set.\n\n");
    errors(text, &found.evaluation, |r| {
        format!("{}; {:.1}", spread(r), r.workshop_mm)
    });
    text.push_str("The same touches on the model's own elements, as the paper judges: what elements leave is not in it.\n\n");
    errors(text, &found.on_own_model, spread);
    failures(text, &found.evaluation);
}

/// Mean, median and 95 % (mm).
fn spread(row: &EvaluationRow) -> String {
    format!(
        "{:.2} / {:.2} / {:.2}",
        row.error_mm, row.median_mm, row.p95_mm
    )
}

fn errors(text: &mut String, found: &Evaluation, shown: impl Fn(&EvaluationRow) -> String) {
    let titles = SelectorKind::PAPER.map(SelectorKind::title);
    let _ = writeln!(
        text,
        "| gauges | {} |\n|---|{}",
        titles.join(" | "),
        "---|".repeat(titles.len())
    );
    let shown = |row: Option<&EvaluationRow>| row.map_or("–".to_owned(), &shown);
    let mut sizes = SIZES;
    sizes.sort_unstable();
    for gauges in sizes {
        let cells = SelectorKind::PAPER.map(|kind| shown(row(found, kind, gauges)));
        let _ = writeln!(text, "| {gauges} | {} |", cells.join(" | "));
    }
    if let Some(all) = baseline(found) {
        let _ = writeln!(
            text,
            "\nAll {} candidates together: {}.",
            all.set.sensors,
            shown(Some(all))
        );
    }
    text.push('\n');
}

fn failures(text: &mut String, found: &Evaluation) {
    let _ = writeln!(
        text,
        "### Failed gauges\n\nMean error (mm) with so many of {MANY} failed, in brackets the worst of the losses tried; trained anew without them on a part of the touches, and not (a failed gauge then reports its mean).\n\n| selector | trained anew | 0 | 1 | 2 | 3 | 4 | 5 |\n|---|---|---|---|---|---|---|---|"
    );
    for kind in SelectorKind::PAPER {
        for retrained in [true, false] {
            let cells: Vec<String> = (0..=5)
                .map(|failed| {
                    let left = with_failed(found, kind, failed, retrained);
                    left.map_or("–".into(), |(mean, worst)| {
                        format!("{mean:.1} ({worst:.1})")
                    })
                })
                .collect();
            let _ = writeln!(
                text,
                "| {} | {} | {} |",
                kind.name(),
                if retrained { "yes" } else { "no" },
                cells.join(" | ")
            );
        }
    }
    text.push('\n');
}

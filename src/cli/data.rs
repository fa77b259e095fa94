//! What `select` and `evaluate` share: a dataset and the regression that judges on it.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use super::ranges::{between, misuse, whole};
use crate::io::dataset_file::{self, GivenData};
use crate::placement::greedy_svr::{GreedySvr, TOLERANCE};
use crate::plain;
use crate::regression::tune::Effort;
use crate::regression::{Grouping, Hyper, scale};
use crate::study::Data;

/// The dataset.
#[derive(Args, Debug, Clone)]
pub struct DataArgs {
    /// The dataset: an NPZ with `X` (sites × touches), `p_m` (touches × 3, m) and, where there are some,
    /// `site_m` (sites × 3, m) and `cost` (sites); a CSV with a row a site (`x_mm,y_mm,z_mm`, where there
    /// is one `cost`, and a column a touch); or a folder of nodal results as Ansys Mechanical exports
    /// them, one file a touch.
    #[arg(long)]
    pub data: PathBuf,
    /// Where the touches of a CSV or a folder were (.csv): `x_mm,y_mm,z_mm`, and for a folder `file`.
    #[arg(long)]
    pub touches: Option<PathBuf>,
}

impl DataArgs {
    /// Reads it.
    ///
    /// # Errors
    /// As [`dataset_file::read`].
    pub fn load(&self) -> anyhow::Result<(Data, Vec<String>)> {
        Ok(said(dataset_file::read(
            &self.data,
            self.touches.as_deref(),
        )?))
    }

    /// Reads it to be answered: the touches may all be at one place.
    ///
    /// # Errors
    /// As [`dataset_file::read_to_answer`].
    pub fn load_to_answer(&self) -> anyhow::Result<(Data, Vec<String>)> {
        let touches = self.touches.as_deref();
        Ok(said(dataset_file::read_to_answer(&self.data, touches)?))
    }

    /// What came of the data: an error with their file before it.
    ///
    /// # Errors
    /// The error that it is.
    pub fn named<T, E>(&self, result: Result<T, E>) -> anyhow::Result<T>
    where
        Result<T, E>: Context<T, E>,
    {
        result.with_context(|| plain::path(&self.data))
    }
}

/// The data and its notes, which are said.
fn said(given: GivenData) -> (Data, Vec<String>) {
    for note in &given.notes {
        super::out::say(&format!("note: {note}"));
    }
    (given.data, given.notes)
}

/// What is never divided between learning and judging, as `--groups` says.
pub enum KeptTogether {
    /// Repeats of a place, or what other flags say.
    Usual,
    /// Each touch by itself.
    Touch,
    /// What the user gave.
    Given(TouchGroups),
}

/// Groups of touches that the user gave.
pub struct TouchGroups {
    /// Numbered from zero without gaps.
    pub of_touches: Vec<usize>,
    /// The array or file that they are from.
    pub source: String,
}

impl DataArgs {
    /// What `--groups` names: `place`, `none`, an array in the NPZ, or a CSV with a column `group`. Where it is left out
    /// and nothing else is `said`, an array `groups` in the NPZ is taken by itself.
    ///
    /// # Errors
    /// A message for a name of nothing, and as [`dataset_file::groups`].
    pub fn kept(
        &self,
        groups: Option<&str>,
        said: bool,
        touches: usize,
    ) -> anyhow::Result<KeptTogether> {
        /// Taken where nothing else is said.
        const USUAL: &str = "groups";
        let read = |name: &str| -> anyhow::Result<Option<TouchGroups>> {
            let found = dataset_file::groups(&self.data, name, touches)?;
            Ok(found.map(|of_touches| TouchGroups {
                of_touches,
                source: name.to_owned(),
            }))
        };
        let given = match groups {
            Some("place") => None,
            Some("none") => return Ok(KeptTogether::Touch),
            Some(name) => Some(read(name)?.ok_or_else(|| {
                misuse(
                    "--groups takes place, none, an array in an NPZ, or a CSV with a column group",
                )
            })?),
            None if said || !dataset_file::holds(&self.data, USUAL)? => None,
            None => read(USUAL)?,
        };
        Ok(given.map_or(KeptTogether::Usual, KeptTogether::Given))
    }
}

/// Unit of the targets that C, ε and the tolerance are meant in.
#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TargetUnit {
    #[default]
    Mm,
    M,
}

/// What is never divided between learning and judging.
#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SplitArg {
    /// Each touch by itself.
    Touch,
    /// All touches at one place.
    #[default]
    Place,
}

/// The paper's settings, of targets in metres: C 20, epsilon 1e-6.
const PAPER: Hyper = Hyper {
    c: 20e3,
    epsilon: 1e-3,
    gamma: 2e-3,
};
/// Tolerance on the bundled limb (mm).
const USUAL_TOLERANCE_MM: f64 = 0.05;
/// Most steps of a fit, and parts of the cross-validation, when left out.
const USUAL_STEPS: usize = 1_000_000;
const USUAL_FOLDS: usize = 5;
/// Largest C over the spread of the touches: beyond it sums of coefficients lose the touches in their rounding,
/// and fits do not end.
const LARGEST_C: f64 = 1e7;

/// What the criterion is made of.
#[derive(Args, Debug, Clone)]
pub struct CriterionArgs {
    /// Unit of the targets that C, epsilon and the tolerance are in.
    #[arg(long, value_enum, default_value_t)]
    pub target_unit: TargetUnit,
    /// Bound of the coefficients; when left out 200 mm for touches that spread as far as on the bundled limb
    /// (48.7 mm rms) and in proportion for others; 20 (the paper's) in m.
    #[arg(long, value_parser = between(1e-9, 1e9))]
    pub c: Option<f64>,
    /// Half-width of the tube without loss; when left out 0.1 mm for touches that spread as on the bundled limb
    /// and in proportion for others; 1e-6 (the paper's) in m.
    #[arg(long, value_parser = between(0.0, 1e9))]
    pub epsilon: Option<f64>,
    /// Of the Gaussian kernel exp(-γ d²) of standardized signals; 0.3 in mm, 2e-3 (the paper's) in m.
    #[arg(long, value_parser = between(1e-15, 1e9))]
    pub gamma: Option<f64>,
    /// Largest violation of the optimality conditions at which a fit counts as solved; when left out 0.05 mm (or
    /// the same in m) for touches that spread as on the bundled limb and in proportion for others.
    #[arg(long, value_parser = between(1e-12, 1e9))]
    pub tolerance: Option<f64>,
    /// Most steps of one fit; a million when left out.
    #[arg(long, value_parser = whole(1, 1_000_000_000))]
    pub max_steps: Option<usize>,
    /// Parts of the cross-validation; 5 when left out.
    #[arg(long, value_parser = whole(2, 1_000_000))]
    pub folds: Option<usize>,
    /// What is never divided between learning and judging: single touches, or all touches at one place. Touches
    /// are at one place when they are nearer than 1e-5 of the extent of all; on a flat skin whatever their depth.
    #[arg(long, value_enum, default_value_t)]
    pub split: SplitArg,
    /// Touches no farther apart than this are at one place (mm).
    #[arg(long, value_parser = between(1e-9, 1e9))]
    pub place_mm: Option<f64>,
    /// Seed of the folds and of every other draw.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Worker threads; all cores when left out. The result does not depend on it.
    #[arg(long, value_parser = super::common::threads)]
    pub threads: Option<usize>,
    /// Standard deviation of noise added to the signals, in their unit. Expected error, and estimators with templates,
    /// take it for the noise of what is read, beside what the data themselves scatter by.
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1e100))]
    pub noise: f64,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

impl CriterionArgs {
    /// The criterion for touches at these positions (mm), in millimetres whatever the unit asked in: with targets
    /// in metres the same model has a C a thousand times smaller. What is left out is in proportion to how far the
    /// touches spread, except for the paper's settings; what is given is taken as it is.
    ///
    /// # Errors
    /// A message for flags that do not go together.
    pub fn criterion(&self, targets: &[[f64; 3]]) -> anyhow::Result<GreedySvr> {
        let size = scale::relative(targets);
        let (unit, usual) = match self.target_unit {
            TargetUnit::Mm => (1.0, Hyper::default().scaled(size)),
            TargetUnit::M => (1e3, PAPER),
        };
        let mm = |given: Option<f64>, usual: f64| given.map_or(usual, |value| value * unit);
        let hyper = Hyper {
            c: mm(self.c, usual.c),
            epsilon: mm(self.epsilon, usual.epsilon),
            gamma: self.gamma.unwrap_or(usual.gamma),
        };
        let spread = size * scale::USUAL_SPREAD_MM;
        if hyper.c > LARGEST_C * spread {
            return Err(misuse(&format!(
                "--c is {} mm for touches that spread over {spread:.3} mm: nothing above {:.2e} mm can be computed",
                hyper.c,
                LARGEST_C * spread
            )));
        }
        let tolerance = mm(self.tolerance, USUAL_TOLERANCE_MM * size);
        let rounding = hyper.c * targets.len() as f64 * f64::EPSILON;
        if tolerance < rounding {
            return Err(misuse(&format!(
                "--tolerance is {tolerance:e} mm, and sums of {} touches with --c {} mm are rounded to {rounding:.1e} mm: fits would not end. Raise --tolerance, or lower --c",
                targets.len(),
                hyper.c
            )));
        }
        Ok(GreedySvr {
            hyper,
            folds: self.folds.unwrap_or(USUAL_FOLDS),
            seed: self.seed,
            grouping: self.grouping()?,
            effort: Effort {
                tolerance,
                max_steps: self.max_steps.unwrap_or(USUAL_STEPS),
            },
            tolerance: TOLERANCE,
            landmarks: 1.0,
        })
    }

    /// A word on settings that do not grow with the part, where they are taken because nothing else is said.
    #[must_use]
    pub fn paper_note(&self) -> Option<String> {
        let given = [self.c, self.epsilon, self.gamma];
        let is_usual = self.target_unit == TargetUnit::M && given.iter().any(Option::is_none);
        is_usual.then(|| {
            "With --target-unit m, what is left out of --c, --epsilon and --gamma is as in the paper (20, 1e-6, 2e-3), which suits its limb: it does not grow with the part, as the settings in mm do.".into()
        })
    }

    /// Flags that only a regression heeds, and whether they are given.
    #[must_use]
    pub fn of_regression(&self) -> [(&'static str, bool); 6] {
        [
            ("--c", self.c.is_some()),
            ("--epsilon", self.epsilon.is_some()),
            ("--gamma", self.gamma.is_some()),
            ("--tolerance", self.tolerance.is_some()),
            ("--max-steps", self.max_steps.is_some()),
            ("--target-unit", self.target_unit != TargetUnit::Mm),
        ]
    }

    /// Flags that say how touches are divided between learning and judging, and whether they are given.
    #[must_use]
    pub fn of_split(&self) -> [(&'static str, bool); 3] {
        [
            ("--folds", self.folds.is_some()),
            ("--split", self.split == SplitArg::Touch),
            ("--place-mm", self.place_mm.is_some()),
        ]
    }

    fn grouping(&self) -> anyhow::Result<Grouping> {
        match (self.split, self.place_mm) {
            (SplitArg::Touch, None) => Ok(Grouping::Touch),
            (SplitArg::Touch, Some(_)) => Err(misuse(
                "--place-mm has no effect with --split touch: leave one of them out",
            )),
            (SplitArg::Place, None) => Ok(Grouping::Place),
            (SplitArg::Place, Some(mm)) => Ok(Grouping::Within(mm)),
        }
    }

    /// Runs `work` on as many threads as were asked for.
    ///
    /// # Errors
    /// What `work` reports, or that the threads could not be started.
    pub fn in_pool<T: Send>(
        &self,
        work: impl FnOnce() -> anyhow::Result<T> + Send,
    ) -> anyhow::Result<T> {
        super::common::Common {
            threads: self.threads,
            ..super::common::Common::default()
        }
        .in_pool(work)
    }
}

/// The criterion as JSON, in millimetres.
#[must_use]
pub fn criterion_json(svr: &GreedySvr) -> Value {
    json!({
        "c_mm": svr.hyper.c,
        "epsilon_mm": svr.hyper.epsilon,
        "gamma": svr.hyper.gamma,
        "tolerance_mm": svr.effort.tolerance,
        "folds": svr.folds,
        "split": svr.grouping.name(),
        "seed": svr.seed,
    })
}

/// A site as JSON.
#[must_use]
pub fn site_json(data: &Data, index: usize) -> Value {
    match data.positions.get(index) {
        Some(p) => {
            let p = *p * 1e3;
            json!({ "index": index, "x_mm": p.x, "y_mm": p.y, "z_mm": p.z })
        }
        None => json!({ "index": index }),
    }
}

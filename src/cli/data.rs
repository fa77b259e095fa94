//! What `select` and `evaluate` share: a dataset and the regression that judges on it.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use crate::io::dataset_file::{self, GivenData};
use crate::placement::greedy_svr::{GreedySvr, TOLERANCE};
use crate::regression::Hyper;
use crate::regression::tune::Effort;
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
        let GivenData { data, notes } = dataset_file::read(&self.data, self.touches.as_deref())?;
        for note in &notes {
            super::out::say(&format!("note: {note}"));
        }
        Ok((data, notes))
    }
}

/// Unit of the targets that C, ε and the tolerance are meant in.
#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TargetUnit {
    #[default]
    Mm,
    M,
}

/// What the criterion is made of.
#[derive(Args, Debug, Clone)]
pub struct CriterionArgs {
    /// Unit of the targets that C, epsilon and the tolerance are in.
    #[arg(long, value_enum, default_value_t)]
    pub target_unit: TargetUnit,
    /// Bound of the coefficients; 200 in mm, 20 (the paper's) in m.
    #[arg(long)]
    pub c: Option<f64>,
    /// Half-width of the tube without loss; 0.1 in mm, 1e-6 (the paper's) in m.
    #[arg(long)]
    pub epsilon: Option<f64>,
    /// Of the Gaussian kernel exp(-γ d²) of standardized signals; 0.3 in mm, 2e-3 (the paper's) in m.
    #[arg(long)]
    pub gamma: Option<f64>,
    /// Largest violation of the optimality conditions at which a fit counts as solved; 0.05 mm, or the
    /// same in m.
    #[arg(long)]
    pub tolerance: Option<f64>,
    /// Most steps of one fit.
    #[arg(long, default_value_t = 1_000_000)]
    pub max_steps: usize,
    /// Parts of the cross-validation.
    #[arg(long, default_value_t = 5)]
    pub folds: usize,
    /// Seed of the folds and of every other draw.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Worker threads; all cores when left out. The result does not depend on it.
    #[arg(long, value_parser = super::threads)]
    pub threads: Option<usize>,
    /// Standard deviation of noise added to the signals, in their unit.
    #[arg(long, default_value_t = 0.0)]
    pub noise: f64,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

impl CriterionArgs {
    /// The criterion, in millimetres whatever the unit asked in: with targets in metres the same model
    /// has a C a thousand times smaller.
    ///
    /// # Errors
    /// A message for values out of range.
    pub fn criterion(&self) -> anyhow::Result<GreedySvr> {
        let (mm, c, epsilon, gamma) = match self.target_unit {
            TargetUnit::Mm => (1.0, 200.0, 0.1, 0.3),
            TargetUnit::M => (1e3, 20.0, 1e-6, 2e-3),
        };
        let above = [
            ("--c", self.c.unwrap_or(c)),
            ("--gamma", self.gamma.unwrap_or(gamma)),
            ("--tolerance", self.tolerance.unwrap_or(0.05 / mm)),
        ];
        for (name, value) in above {
            anyhow::ensure!(
                value > 0.0 && value.is_finite(),
                "{name} must be a number above zero, but is {value}"
            );
        }
        let epsilon = self.epsilon.unwrap_or(epsilon);
        for (name, value) in [("--epsilon", epsilon), ("--noise", self.noise)] {
            anyhow::ensure!(
                value >= 0.0 && value.is_finite(),
                "{name} must be zero or more, but is {value}"
            );
        }
        anyhow::ensure!(self.folds >= 2, "--folds must be at least 2");
        Ok(GreedySvr {
            hyper: Hyper {
                c: above[0].1 * mm,
                epsilon: epsilon * mm,
                gamma: above[1].1,
            },
            folds: self.folds,
            seed: self.seed,
            effort: Effort {
                tolerance: above[2].1 * mm,
                max_steps: self.max_steps,
            },
            tolerance: TOLERANCE,
            landmarks: 1.0,
        })
    }

    /// Runs `work` on as many threads as were asked for.
    ///
    /// # Errors
    /// What `work` reports, or that the threads could not be started.
    pub fn in_pool<T: Send>(
        &self,
        work: impl FnOnce() -> anyhow::Result<T> + Send,
    ) -> anyhow::Result<T> {
        super::Common {
            threads: self.threads,
            ..super::Common::default()
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

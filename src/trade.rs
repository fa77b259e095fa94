//! Speed against accuracy, measured: the whole pipeline at many settings, all judged by one model that is finer
//! than any of theirs, and what each setting's knobs buy.
//!
//! A [`TradeSetting`] says how much is spent at every stage. [`measure`] runs it and asks the judge; [`Sweep`] says
//! which setting is worth measuring next; [`front`] keeps those that no other beats; [`knobs`] says what a step
//! of each knob costs and buys.

mod front;
mod knobs;
mod setting;
mod spent;
mod sweep;

use serde::{Deserialize, Serialize};

use crate::budget::Watch;
use crate::design::{self, DesignError, DesignRequest, Finest, Inputs, StageTime};
use crate::project::BadValue;
use crate::units;

pub use self::front::{TradeConstraint, answer, clock, front};
pub use self::knobs::{Bought, KnobReport, knobs};
pub use self::setting::TradeSetting;
pub use self::spent::{Knob, Spent};
pub use self::sweep::{Sweep, standards};

/// What a setting costs and achieves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// CPU time (s) from the project to the judged answer, and the same by the clock.
    pub cpu_seconds: f64,
    /// Wall time of the same (s).
    pub seconds: f64,
    /// By the clock, stage by stage.
    pub stages: Vec<StageSeconds>,
    /// CPU time (s) that the judge took beside it.
    pub judge_cpu_seconds: f64,
    /// Most memory that it took (MB), where the system says so; what an allocator kept from runs before is in it.
    pub memory_mb: Option<f64>,
    /// Errors on the judge's touches, by matching at the force in the middle of those that the project is judged at:
    /// mean, median, 95th percentile, and the mean as a workshop would build it.
    #[serde(deserialize_with = "number")]
    pub error_mm: f64,
    /// Median error (mm).
    #[serde(deserialize_with = "number")]
    pub median_mm: f64,
    /// 95th percentile of the error (mm).
    #[serde(deserialize_with = "number")]
    pub p95_mm: f64,
    /// Mean error as built (mm).
    #[serde(deserialize_with = "number")]
    pub workshop_mm: f64,
    /// Mean error that the design itself states, by the same estimator at the same force, on touches of its own and
    /// elements finer than its own.
    #[serde(deserialize_with = "number")]
    pub own_error_mm: f64,
    /// Estimated error of the model's displacements (%).
    #[serde(deserialize_with = "number")]
    pub model_percent: f64,
    /// Candidates that the reduction kept.
    pub candidates: usize,
    /// The chosen gauges (mm), in the order of their choice.
    pub sites_mm: Vec<[f64; 3]>,
}

/// What is no number is written as null.
fn number<'de, D: serde::Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::NAN))
}

/// Seconds by the clock of one stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageSeconds {
    /// Name of the stage.
    pub stage: String,
    /// Wall time (s).
    pub seconds: f64,
}

impl From<&StageTime> for StageSeconds {
    fn from(time: &StageTime) -> Self {
        Self {
            stage: time.stage.to_owned(),
            seconds: time.seconds,
        }
    }
}

/// A setting and what came of it; a message where it cannot be computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TradePoint {
    /// The setting.
    pub setting: TradeSetting,
    /// What it costs and achieves, or why it cannot be computed.
    pub outcome: Result<Measured, String>,
}

impl TradePoint {
    /// What was measured, where it could be.
    #[must_use]
    pub fn measured(&self) -> Option<&Measured> {
        self.outcome.as_ref().ok()
    }
}

/// Clock and memory, which the core does not have of its own.
pub trait CostMeter: Sync {
    /// CPU time (s) of this process so far.
    fn cpu_seconds(&self) -> f64;
    /// Seconds by the clock since any fixed moment.
    fn seconds(&self) -> f64;
    /// Begins to look for the most memory anew.
    fn forget_memory(&self);
    /// The most that was held since, beyond what was held when it was first forgotten (MB).
    fn most_memory_mb(&self) -> Option<f64>;
}

/// Runs the pipeline at a setting and judges what it chose.
///
/// # Errors
/// [`DesignError`] only for a stop; what cannot be computed at this setting is its outcome.
pub fn measure(
    inputs: &Inputs,
    setting: &TradeSetting,
    judge: &Finest,
    meter: &dyn CostMeter,
    watch: Watch,
) -> Result<TradePoint, DesignError> {
    let outcome = match attempt(inputs, setting, judge, meter, watch) {
        Ok(measured) => Ok(measured),
        Err(error) if error.is_cancelled() => return Err(error),
        Err(error) => Err(error.to_string()),
    };
    Ok(TradePoint {
        setting: *setting,
        outcome,
    })
}

fn attempt(
    inputs: &Inputs,
    setting: &TradeSetting,
    judge: &Finest,
    meter: &dyn CostMeter,
    watch: Watch,
) -> Result<Measured, DesignError> {
    let mut inputs = setting.part(inputs)?;
    setting.apply(&mut inputs.project);
    let project = &inputs.project;
    let budget = setting.budget(project);
    meter.forget_memory();
    let (cpu, clock) = (meter.cpu_seconds(), meter.seconds());
    let now = || meter.seconds();
    let asked = DesignRequest {
        inputs: &inputs,
        kinds: &project.selectors(),
        budget: &budget,
    };
    let design = design::run(&asked, &now, watch)?;
    let own_mm = design.simulated.element_mm;
    if own_mm <= judge.element_mm() {
        return Err(BadValue {
            key: "the elements of this setting".into(),
            rule:
                "larger than those of the model that judges it, which memory does not let be finer"
                    .into(),
            value: format!("{own_mm:.2} mm"),
        }
        .into());
    }
    let cpu_seconds = meter.cpu_seconds() - cpu;
    let seconds = meter.seconds() - clock;
    let memory_mb = meter.most_memory_mb();
    let before = meter.cpu_seconds();
    let judged = judge.judge(&inputs, &design, setting.raised(project), watch)?;
    let own = design.chosen_row().map_or(f64::NAN, |r| r.error_mm);
    let sites = &design.simulated.dataset.sites;
    Ok(Measured {
        cpu_seconds,
        seconds,
        stages: design.seconds.iter().map(Into::into).collect(),
        judge_cpu_seconds: meter.cpu_seconds() - before,
        memory_mb,
        error_mm: judged.mean_mm,
        median_mm: judged.median_mm,
        p95_mm: judged.p95_mm,
        workshop_mm: judged.workshop_mm,
        own_error_mm: own,
        model_percent: design.simulated.discretization.displacement_percent,
        candidates: design.candidate_count(),
        sites_mm: (design.chosen().iter())
            .map(|&s| units::mm(sites[s].gauge.position).to_array())
            .collect(),
    })
}

#[cfg(test)]
impl Measured {
    /// A made-up measurement of this CPU time (s) and this error (mm).
    fn made_up(cpu_seconds: f64, error_mm: f64) -> Self {
        Self {
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
        }
    }
}

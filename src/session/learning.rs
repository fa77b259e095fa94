//! What was pressed at the bench teaches an estimator, and live touch goes by it, or by one of a file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::jobs::{Task, stop};
use super::state::Session;
use super::state::learned::Learnt;
use crate::budget::Watch;
use crate::design::{
    Inputs, Learned, PressLessons, Sensing, TrainingOutcome, TrialMethods, train_all,
};
use crate::io::bench_folder::limb_key;
use crate::io::kept_model;
use crate::io::touch_file::{self, TrainingOrigin};
use crate::job::{Reporter, Stop};
use crate::learning::{ByModel, MeasuredTouches, TrainingRequest};
use crate::live::ShownEstimator;
use crate::test_bed::{CollectedRun, Wanted};
use crate::uncertainty::HandPressing;

/// The ending of an estimator's file.
pub const ESTIMATOR: &str = "hapdtouch";

impl Session {
    /// Learns from what was pressed into the bench's folder, and writes the estimator there. Live touch goes by it from
    /// then on.
    pub fn learn_from_presses(&mut self) {
        let (inputs, budget) = (self.document.inputs(), self.budget());
        let project = self.document.path.clone();
        let folder = self.bench_folder();
        let known = self.sensing().map(Arc::clone);
        let of = self.document.sensing_inputs();
        let work = move |r: &Reporter| {
            let watch = |p| r.report(p);
            let failed = |why: anyhow::Error| Stop::Failed(format!("{why:#}"));
            let collected = CollectedRun::read(&folder, Wanted::default()).map_err(failed)?;
            let sensing = if let Some(sensing) = known {
                sensing
            } else {
                let made = kept_model::sensing(&inputs, project.as_deref(), &budget, &watch);
                Arc::new(made.map_err(|e| stop(&e))?)
            };
            let (outcome, origin, untaught) = learned(&collected, &inputs, &sensing, &watch)?;
            let path = free_name(&folder);
            let wrong = |e: crate::io::FileError| Stop::Failed(e.to_string());
            touch_file::write(&path, origin, &outcome.estimator).map_err(wrong)?;
            let file = touch_file::read(&path).map_err(wrong)?;
            Ok((path, file, untaught))
        };
        self.jobs
            .start(Task::Learn, of, work, |s, of, (path, file, untaught)| {
                if let Some(why) = untaught {
                    s.complain(format!("Matching was not tried: {why}"));
                }
                let test = &file.header.origin.test;
            s.tell(format!(
                "Half of the presses that nobody has learned from are found to {:.2} mm; the estimator is in {}",
                test.median_mm,
                path.display()
            ));
                s.take_learned(Learnt {
                    path,
                    of,
                    file: Arc::new(file),
                });
            });
    }

    /// Opens an estimator that was learned from presses of this limb; live touch goes by it from then on.
    pub fn open_estimator(&mut self, path: &Path) {
        let inputs = self.document.inputs();
        let of = self.document.sensing_inputs();
        let path = path.to_owned();
        let work = move |_: &Reporter| {
            let refused = |why: String| Stop::Failed(format!("{}: {why}", path.display()));
            let file = touch_file::read(&path).map_err(|e| Stop::Failed(e.to_string()))?;
            let gauges = inputs.project.selection.sites.len();
            file.check_channels(gauges).map_err(refused)?;
            file.check_limb(&limb_key(&inputs)).map_err(refused)?;
            Ok((path, file))
        };
        self.jobs
            .start(Task::OpenEstimator, of, work, |s, of, (path, file)| {
                s.take_learned(Learnt {
                    path,
                    of,
                    file: Arc::new(file),
                });
            });
    }

    /// Goes by the project's model again.
    pub fn close_estimator(&mut self) {
        self.live.learnt = None;
        self.show_estimator(ShownEstimator::Matching);
        self.live.applied = None;
    }

    fn take_learned(&mut self, learnt: Learnt) {
        if learnt.of != self.document.sensing_inputs() {
            let path = learnt.path.display();
            self.tell(format!(
                "{path} is of gauges or settings that have changed since: live touch does not go by it"
            ));
            return;
        }
        let matching = matches!(learnt.file.estimator, Learned::Matching(_));
        self.live.learnt = Some(learnt);
        // The connection takes it at its next look.
        self.live.applied = None;
        self.show_estimator(if matching {
            ShownEstimator::Matching
        } else {
            ShownEstimator::Learned
        });
    }
}

/// What presses teach, with where that comes from, and why they teach the model nothing.
fn learned(
    collected: &CollectedRun,
    inputs: &Inputs,
    sensing: &Sensing,
    watch: Watch,
) -> Result<(TrainingOutcome, TrainingOrigin, Option<String>), Stop> {
    let limb = limb_key(inputs);
    if collected.about.limb != limb {
        let what = "These presses are of another limb or other gauges: name the folder of this one";
        return Err(Stop::Failed(what.into()));
    }
    let seed = inputs.project.budget.seed;
    let (data, groups) = collected.data();
    let lessons = MeasuredTouches {
        x: &data.x,
        places_mm: &data.targets,
        forces: &data.forces,
        groups: &groups,
    };
    let pressing = if collected.about.by_hand {
        inputs.project.uncertainty().pressing
    } else {
        HandPressing::EXACT
    };
    let presses = PressLessons::new(sensing, &inputs.project, &lessons, pressing);
    let untaught = presses.as_ref().err().map(ToString::to_string);
    let candidates = TrialMethods {
        regressions: true,
        model: presses.as_ref().ok().map(|p| (p, &ByModel::ALL[..])),
    };
    let asked = TrainingRequest {
        seed,
        ..TrainingRequest::default()
    };
    let outcome = train_all(&lessons, &asked, &candidates, watch).map_err(|why| match why {
        crate::learning::LearningError::Cancelled(_) => Stop::Cancelled,
        why => Stop::Failed(match &untaught {
            Some(and) => format!("{why}; {and}"),
            None => why.to_string(),
        }),
    })?;
    let origin = TrainingOrigin {
        limb: Some(limb),
        board: Some(collected.board.clone()).filter(|b| !b.is_empty()),
        ..TrainingOrigin::of(&outcome, &data, "presses", seed)
    };
    Ok((outcome, origin, untaught))
}

/// A name in a folder that no file has yet: what was learned before stays.
fn free_name(folder: &Path) -> PathBuf {
    let numbered = |n: usize| folder.join(format!("estimator-{n}.{ESTIMATOR}"));
    let free = (1..10_000).find(|n| !numbered(*n).exists());
    numbered(free.unwrap_or(1))
}

//! `hapdef train --update`: an old estimator with its channels as they are now.

use std::path::Path;

use serde_json::json;

use super::data::DataArgs;
use super::out;
use super::progress::Bar;
use crate::design::Learned;
use crate::io::touch_file::{self, TrainingOrigin, UpdateSection};
use crate::io::{bench_folder, cpu_seconds};
use crate::learning::{MeasuredTouches, Still, Updated, update};
use crate::plain;
use crate::study::Data;

/// What is asked for.
pub struct UpdateRequest<'a> {
    /// The estimator's file.
    pub old: &'a Path,
    /// Where the new one goes.
    pub out: &'a Path,
    /// Of the parts that presses are left out in.
    pub seed: u64,
    /// One JSON object on stdout.
    pub json: bool,
    /// Of the data.
    pub fingerprint: String,
}

/// Brings it up to date by presses and their groups.
///
/// # Errors
/// A message in the user's terms.
pub fn run(
    asked: &UpdateRequest<'_>,
    args: &DataArgs,
    (data, groups): (&Data, &[usize]),
    notes: &[String],
) -> anyhow::Result<()> {
    let file = touch_file::read(asked.old)?;
    let fits = file.check_channels(data.x.rows());
    args.named(fits.map_err(anyhow::Error::msg))?;
    let Learned::Regression(old) = &file.estimator else {
        anyhow::bail!(
            "{}: this is matching by a map that presses have taught. Train it again with the new presses among the old ones (hapdef train --project)",
            plain::path(asked.old)
        );
    };
    let origin = &file.header.origin;
    check_limb(origin, &args.data)?;
    let before = cpu_seconds();
    let bar = Bar::default();
    let lessons = MeasuredTouches {
        x: &data.x,
        places_mm: &data.targets,
        forces: &data.forces,
        groups,
    };
    let watch = |p| bar.show(p);
    let found = args.named(update(old, &lessons, asked.seed, &watch));
    bar.finish();
    let found = found?;
    let answers = old.find(&data.x);
    let still = Still::of(&old.known_ratios(), &answers, &data.targets);
    let new = TrainingOrigin {
        test: found.after.clone(),
        update: Some(UpdateSection {
            data: name(&args.data),
            fingerprint: asked.fingerprint.clone(),
            presses: data.targets.len(),
            before_mm: found.before.mean_mm,
        }),
        ..origin.clone()
    };
    let estimator = Learned::Regression(Box::new(found.estimator.clone()));
    touch_file::write(asked.out, new, &estimator)?;
    if asked.json {
        let cpu = cpu_seconds() - before;
        return out::line(&json_of(&found, still, notes, cpu).to_string());
    }
    say(&found, still)
}

/// Refuses presses of another limb, where both say which.
fn check_limb(origin: &TrainingOrigin, data: &Path) -> anyhow::Result<()> {
    let here = bench_folder::key_in(data, bench_folder::LIMB)?;
    if let (Some(old), Some(new)) = (&origin.limb, here) {
        anyhow::ensure!(
            *old == new,
            "{}: these presses are of another limb, or of other gauges, than those that the estimator was trained on",
            plain::path(data)
        );
    }
    Ok(())
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn json_of(
    found: &Updated,
    still: Option<Still>,
    notes: &[String],
    cpu_seconds: f64,
) -> serde_json::Value {
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "updated": found.prior.is_some(),
        "before_mm": found.before.mean_mm,
        "test_mm": found.after.mean_mm,
        "median_mm": found.after.median_mm,
        "p95_mm": found.after.p95_mm,
        "coverage": found.after.coverage,
        "force_error_n": found.after.force_error_n,
        "gains": found.gains,
        "rests": found.rests,
        "holds": still.map(|s| s.holds()),
        "holds_probability": still.map(|s| s.probability),
        "cpu_seconds": cpu_seconds,
        "notes": notes,
    })
}

fn say(found: &Updated, still: Option<Still>) -> anyhow::Result<()> {
    if let Some(still) = still {
        out::line(&format!(
            "before: {}",
            still.words("It is brought up to date now")
        ))?;
    }
    if found.prior.is_none() {
        return out::line(&format!(
            "The new presses are found to {:.2} mm as it is, and a change of gains and rests does no better on presses that are left out: it stays as it was",
            found.before.mean_mm
        ));
    }
    for (channel, (gain, rest)) in found.gains.iter().zip(&found.rests).enumerate() {
        out::line(&format!(
            "channel {channel:>3}: reads {:>6.1} % of what it did, its rest {rest:+.4}",
            100.0 * gain
        ))?;
    }
    out::line(&format!(
        "Mean error on the new presses: {:.2} mm before, {:.2} mm now (each judged by the others)",
        found.before.mean_mm, found.after.mean_mm
    ))
}

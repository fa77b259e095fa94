//! `hapdef select`: sites for gauges from a dataset alone.

use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use serde_json::{Value, json};

use super::common::SelectorArg;
use super::data::{CriterionArgs, DataArgs, criterion_json, site_json};
use super::ranges::{between, misuse, whole};
use super::spared::Spared;
use super::{out, progress::Bar};
use crate::bounds::Bounds;
use crate::budget::Watch;
use crate::gaussian_process::GpKernel;
use crate::io::cpu_seconds;
use crate::placement::constraints::{Loss, LostBy, Thorough};
use crate::placement::expected_error::Detail;
use crate::placement::greedy_svr::{Audit, Comparison};
use crate::placement::{Constraints, SelectorKind, SensorSet};
use crate::plain;
use crate::study::{self, Choice, ChoiceRequest, ChoiceSettings, Data};

#[derive(Args, Debug, Clone)]
pub struct SelectArgs {
    #[command(flatten)]
    pub data: DataArgs,
    #[command(flatten)]
    pub criterion: CriterionArgs,
    /// How sites are chosen. Left out it is greedy SVR, whatever a design would choose by: that needs nothing but the data,
    /// where a choice by expected error rests on the noise of the gauges (--noise), which no default can know.
    #[arg(long, value_enum, default_value = "greedy-svr")]
    pub selector: SelectorArg,
    /// Most gauges.
    #[arg(long, default_value_t = 10, value_parser = whole(1, 1_000_000))]
    pub sensors: usize,
    /// Sites that must be chosen, first (zero-based, with commas).
    #[arg(long, value_delimiter = ',')]
    pub require: Vec<usize>,
    /// Sites that must not be chosen (zero-based, with commas).
    #[arg(long, value_delimiter = ',')]
    pub keep_out: Vec<usize>,
    /// Choose only inside this box: x0,y0,z0,x1,y1,z1 (mm).
    #[arg(
        long,
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        value_parser = between(-1e9, 1e9)
    )]
    pub inside: Vec<f64>,
    /// Choose only outside this box: x0,y0,z0,x1,y1,z1 (mm).
    #[arg(
        long,
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        value_parser = between(-1e9, 1e9)
    )]
    pub outside: Vec<f64>,
    /// Least distance between two gauges (mm).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1e9))]
    pub spacing_mm: f64,
    /// What all gauges together may cost (with costs in the dataset; one each otherwise).
    #[arg(long, value_parser = between(1e-9, 1e15))]
    pub cost_budget: Option<f64>,
    /// Stop at this cross-validated error (mm), or expected error where that is what is chosen by.
    #[arg(long, value_parser = between(1e-9, 1e9))]
    pub target_mm: Option<f64>,
    /// Probability that gauges are lost when they are needed (expected error and greedy SVR).
    #[arg(long, default_value_t = 0.0, value_parser = between(0.0, 1.0))]
    pub failure: f64,
    /// How many gauges are lost together, any of them (with --failure; 1 when left out, greedy SVR knows no other).
    #[arg(long, value_parser = whole(1, 5))]
    pub lost: Option<usize>,
    /// Count the worst loss instead of the mean over all (with --failure).
    #[arg(long)]
    pub worst_loss: bool,
    /// Exchange gauges after all are chosen (greedy SVR, entropy and mutual information; expected error always does).
    #[arg(long)]
    pub exchange: bool,
    /// First gauges that a set is begun from; the best set is kept (all but PCA-QR; 1 when left out).
    #[arg(long, value_parser = whole(1, 20))]
    pub starts: Option<usize>,
    /// Share of the criterion by which a choice of greedy SVR may be worse than the best; 0.002 when left out.
    #[arg(long, value_parser = between(0.0, 0.999))]
    pub selection_tolerance: Option<f64>,
    /// Landmarks of greedy SVR's screens, relative to the default: fewer are faster and leave more to be
    /// fitted exactly (1 when left out).
    #[arg(long, value_parser = between(0.01, 100.0))]
    pub landmarks: Option<f64>,
    /// Fit so many of the best and so many random other sites exactly at each step of greedy SVR, and say
    /// whether one of them would have been better (slow).
    #[arg(long, default_value_t = 0, value_parser = whole(0, 1_000_000))]
    pub audit: usize,
    /// Lightest and hardest touch that will come (N, with a comma; expected error only, for data that say the force
    /// of each touch): a third to three times the middle force when left out.
    #[arg(long, value_delimiter = ',', num_args = 1, value_parser = between(1e-6, 1e9))]
    pub forces_n: Vec<f64>,
    /// Length of the kernel of entropy and mutual information (mm); searched when left out with its power,
    /// else the paper's (33).
    #[arg(long, value_parser = between(1e-6, 1e9))]
    pub length_mm: Option<f64>,
    /// Its power, up to 2; searched when left out with the length, else the paper's (1.9).
    #[arg(long, value_parser = between(0.01, 2.0))]
    pub power: Option<f64>,
    /// Variance of a measurement's noise over the field's; the paper's (0.001) when left out.
    #[arg(long, value_parser = between(0.0, 1e9))]
    pub kernel_noise: Option<f64>,
    /// Do not compute the criterion in mm of what the other selectors choose.
    #[arg(long)]
    pub no_criterion: bool,
    /// Also write the chosen sites (.csv): `x_mm,y_mm,z_mm,index`.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub fn run(args: &SelectArgs) -> anyhow::Result<()> {
    args.check()?;
    let (data, mut notes) = args.data.load()?;
    let settings = args.settings(&data)?;
    let of_data = &args.data;
    of_data.named(args.check_out(&data))?;
    let constraints = of_data.named(args.constraints(&data))?;
    let kept_out = of_data.named(args.kept_out(&data))?;
    let bar = Bar::default();
    let watch = |p| bar.show(p);
    let asked = ChoiceRequest {
        data: &data,
        kept_out: &kept_out,
        constraints: &constraints,
        settings: &settings,
    };
    let result = args
        .criterion
        .in_pool(|| of_data.named(args.chosen(&asked, &watch)));
    bar.finish();
    let (choice, criterion_seconds, audit) = result?;
    for step in &audit {
        out::say(&format!(
            "{:>3}: {:.3} mm, the best of {} others {:.3} mm ({:+.2} %)",
            step.sensors,
            step.chosen_mm,
            step.compared,
            step.best_other_mm,
            100.0 * step.excess()
        ));
    }
    // A choice by expected error divides no touches.
    let divided = settings.kind != SelectorKind::ExpectedError;
    let said: Vec<String> = divided
        .then(|| study::place_notes(&settings.svr, &data.targets))
        .into_iter()
        .flatten()
        .chain(divided.then(|| args.criterion.paper_note()).flatten())
        .chain(choice.selection.achieved.words().cloned())
        .collect();
    for note in &said {
        out::say(&format!("note: {note}"));
    }
    notes.extend(said);
    if let Some(path) = &args.out {
        write_sites(path, &data, &choice)?;
    }
    let mut summary = summary(&data, &settings, &choice, criterion_seconds, &notes);
    if !audit.is_empty() {
        summary["audit"] = json!(audit);
    }
    if args.criterion.json {
        out::line(&summary.to_string())
    } else {
        print_table(&choice)
    }
}

fn say(set: &SensorSet) {
    // The others choose in a blink, and PCA-QR chooses anew for each number.
    if let (Some(site), Some(mm), Some(gap)) = (set.sites.last(), set.criterion_mm, set.gap) {
        out::say(&format!(
            "{:>3}: site {site}, {mm:.3} mm (a better one could be better by {:.2} %)",
            set.sites.len(),
            100.0 * gap
        ));
    }
}

impl SelectArgs {
    /// The choice, the CPU time (s) of its criterion, and what was asked beside it.
    fn chosen(
        &self,
        asked: &ChoiceRequest,
        watch: Watch,
    ) -> anyhow::Result<(Choice, f64, Vec<Comparison>)> {
        let mut choice = study::select(asked, &cpu_seconds, watch, &say)?;
        let before = cpu_seconds();
        if !self.no_criterion {
            study::add_criteria(asked, &mut choice.selection, watch)
                .context("the criterion in mm (left out with --no-criterion)")?;
        }
        let criterion_seconds = cpu_seconds() - before;
        let audit = self.audited(asked, &choice, watch)?;
        Ok((choice, criterion_seconds, audit))
    }

    /// That the sites can be written where that is asked for, before anything is chosen.
    fn check_out(&self, data: &Data) -> anyhow::Result<()> {
        ensure!(
            self.out.is_none() || !data.positions.is_empty(),
            "--out writes the positions of the sites (site_m), and the dataset has none"
        );
        Spared::of_data(&self.data.data, self.data.touches.as_deref())
            .check_result("--out", self.out.as_deref())
    }

    fn audited(
        &self,
        asked: &ChoiceRequest,
        choice: &Choice,
        watch: Watch,
    ) -> anyhow::Result<Vec<Comparison>> {
        if self.audit == 0 {
            return Ok(Vec::new());
        }
        let audit = Audit {
            top: self.audit,
            random: self.audit,
            seed: asked.settings.svr.seed,
        };
        Ok(study::audit(asked, choice, audit, watch)?)
    }

    /// That no flag is given in vain.
    fn check(&self) -> anyhow::Result<()> {
        let kind = SelectorKind::from(self.selector);
        let svr = kind == SelectorKind::GreedySvr;
        let expected = kind == SelectorKind::ExpectedError;
        let geometric = [SelectorKind::Entropy, SelectorKind::MutualInformation].contains(&kind);
        let mut flags = vec![
            ("--length-mm", self.length_mm.is_some(), geometric),
            ("--power", self.power.is_some(), geometric),
            ("--kernel-noise", self.kernel_noise.is_some(), geometric),
            (
                "--selection-tolerance",
                self.selection_tolerance.is_some(),
                svr,
            ),
            ("--landmarks", self.landmarks.is_some(), svr),
            ("--audit", self.audit > 0, svr),
            ("--forces-n", !self.forces_n.is_empty(), expected),
            ("--exchange", self.exchange, kind.exchanges_if_asked()),
            ("--starts", self.starts.is_some(), kind.has_starts()),
            ("--no-criterion", self.no_criterion, !svr && !expected),
        ];
        // Nothing is trained for a choice by expected error, and nothing held out.
        let fit = &self.criterion;
        let trained = fit.of_regression().into_iter().chain(fit.of_split());
        flags.extend(trained.map(|(flag, given)| (flag, given, !expected)));
        if let Some((flag, ..)) = flags.iter().find(|(_, given, heeded)| *given && !heeded) {
            return Err(misuse(&format!(
                "{flag} has no effect with --selector {}: leave it out",
                kind.name()
            )));
        }
        if self.audit > 0 && self.exchange {
            return Err(misuse(
                "--audit is about gauge after gauge, which --exchange goes beyond: give one of them",
            ));
        }
        let losses = [
            ("--lost", self.lost.is_some()),
            ("--worst-loss", self.worst_loss),
        ];
        if let Some((flag, _)) = losses.iter().find(|(_, given)| *given)
            && self.failure <= 0.0
        {
            return Err(misuse(&format!(
                "{flag} has no effect without --failure: say how probable a loss is"
            )));
        }
        let target = [("--target-mm", self.target_mm.is_some())];
        let mut judged = (target.into_iter().chain(fit.of_regression())).chain(fit.of_split());
        match judged.find(|(_, given)| *given) {
            Some((flag, _)) if self.no_criterion => Err(misuse(&format!(
                "{flag} is about the criterion, which --no-criterion leaves out: give one of them"
            ))),
            _ => Ok(()),
        }
    }

    fn settings(&self, data: &Data) -> anyhow::Result<ChoiceSettings> {
        let mut svr = self.criterion.criterion(&data.targets)?;
        svr.tolerance = self.selection_tolerance.unwrap_or(svr.tolerance);
        svr.landmarks = self.landmarks.unwrap_or(svr.landmarks);
        let paper = GpKernel::default();
        let kernel_noise = self.kernel_noise.unwrap_or(paper.noise);
        let kernel = (self.length_mm.is_some() || self.power.is_some()).then(|| GpKernel {
            length_m: self.length_mm.map_or(paper.length_m, |l| l * 1e-3),
            power: self.power.unwrap_or(paper.power),
            noise: kernel_noise,
        });
        Ok(ChoiceSettings {
            kind: self.selector.into(),
            svr,
            kernel,
            kernel_noise,
            noise: self.criterion.noise,
            forces: self.forces(data)?,
            detail: Detail::default(),
        })
    }

    fn forces(&self, data: &Data) -> anyhow::Result<Option<[f64; 2]>> {
        match self.forces_n[..] {
            [] => Ok(None),
            [lightest, hardest] if lightest <= hardest => {
                if data.forces.is_empty() {
                    return Err(misuse(
                        "--forces-n needs data that say the force of each touch (force_n): leave it out",
                    ));
                }
                Ok(Some([lightest, hardest]))
            }
            _ => Err(misuse(
                "--forces-n takes the lightest force and the hardest (N): LIGHTEST,HARDEST",
            )),
        }
    }

    fn constraints(&self, data: &Data) -> anyhow::Result<Constraints> {
        known("--require", &self.require, data)?;
        Ok(Constraints {
            sensors: self.sensors,
            required: self.require.clone(),
            spacing: self.spacing_mm * 1e-3,
            costs: None,
            budget: self.cost_budget,
            target_mm: self.target_mm,
            failure: self.failure,
            loss: Loss {
                gauges: self.lost.unwrap_or(Loss::default().gauges),
                by: if self.worst_loss {
                    LostBy::Worst
                } else {
                    LostBy::Expected
                },
            },
            thorough: Thorough {
                exchange: self.exchange,
                starts: self.starts.unwrap_or(Thorough::default().starts),
            },
        })
    }

    fn kept_out(&self, data: &Data) -> anyhow::Result<Vec<usize>> {
        known("--keep-out", &self.keep_out, data)?;
        let mut out = self.keep_out.clone();
        for (name, given, keep_inside) in [
            ("--inside", &self.inside, true),
            ("--outside", &self.outside, false),
        ] {
            if given.is_empty() {
                continue;
            }
            let [x0, y0, z0, x1, y1, z1] = given[..] else {
                bail!("{name} takes six numbers: x0,y0,z0,x1,y1,z1 (mm)");
            };
            ensure!(
                !data.positions.is_empty(),
                "{name} needs the positions of the sites (site_m)"
            );
            let a = glam::DVec3::new(x0, y0, z0) * 1e-3;
            let b = glam::DVec3::new(x1, y1, z1) * 1e-3;
            let bounds = Bounds::between([a, b]);
            let is_out = |&s: &usize| bounds.contains(data.positions[s]) != keep_inside;
            out.extend((0..data.positions.len()).filter(is_out));
        }
        Ok(out)
    }
}

/// That the sites of a flag are there.
fn known(flag: &str, sites: &[usize], data: &Data) -> anyhow::Result<()> {
    let count = data.x.rows();
    match sites.iter().find(|&&site| site >= count) {
        Some(site) => bail!(
            "{flag} {site}: the data have only {}, counted from 0",
            plain::count(count, "site")
        ),
        None => Ok(()),
    }
}

fn summary(
    data: &Data,
    settings: &ChoiceSettings,
    choice: &Choice,
    criterion_seconds: f64,
    notes: &[String],
) -> Value {
    let selection = &choice.selection;
    let last = selection.sets.last();
    let sites: Vec<Value> = last
        .iter()
        .flat_map(|s| &s.sites)
        .map(|&s| site_json(data, s))
        .collect();
    let steps: Vec<Value> = selection.sets.iter().map(step_json).collect();
    // What a choice by expected error weighed stands in the place of a regression that nobody trained.
    let (criterion, folds) = match &choice.weighed {
        Some(weighed) => (json!(weighed), Value::Null),
        None => (
            criterion_json(&settings.svr),
            json!(study::folds(data, settings)),
        ),
    };
    let mm: Vec<Option<f64>> = selection.sets.iter().map(|s| s.criterion_mm).collect();
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "selector": settings.kind,
        "sites": sites,
        "criterion_mm": mm,
        "bound_mm": last.and_then(|s| s.certificate).map(|c| c.bound_mm),
        "steps": steps,
        "criterion_unit": selection.criterion_unit,
        "criterion": criterion,
        "fold_of_touch": folds,
        "counts": {
            "sites": data.x.rows(),
            "touches": data.x.columns(),
            "places": study::places(&settings.svr, &data.targets),
            "pool": selection.pool,
        },
        "geometry": choice.geometry,
        "cpu_seconds": choice.seconds.selection,
        "distance_cpu_seconds": choice.seconds.distances,
        "kernel_search_cpu_seconds": choice.seconds.kernel_search,
        "criterion_cpu_seconds": criterion_seconds,
        "achieved": selection.achieved,
        "notes": notes,
    })
}

fn step_json(set: &SensorSet) -> Value {
    json!({
        "sensors": set.sites.len(),
        "sites": set.sites,
        "criterion": set.criterion,
        "criterion_mm": set.criterion_mm,
        "gap": set.gap,
        "lead": set.margin,
        "bound_mm": set.certificate.map(|c| c.bound_mm),
        "local_mm": set.certificate.map(|c| c.local_mm),
    })
}

fn print_table(choice: &Choice) -> anyhow::Result<()> {
    for set in &choice.selection.sets {
        let sites: Vec<String> = set.sites.iter().map(ToString::to_string).collect();
        let (gauges, sites) = (plain::count(sites.len(), "gauge"), sites.join(","));
        out::line(&match set.criterion_mm {
            Some(mm) => format!("{gauges}, {mm:.3} mm: {sites}"),
            None => format!("{gauges}: {sites}"),
        })?;
    }
    Ok(())
}

fn write_sites(path: &std::path::Path, data: &Data, choice: &Choice) -> anyhow::Result<()> {
    use std::fmt::Write as _;
    let mut text = String::from("x_mm,y_mm,z_mm,index\n");
    for &s in choice.selection.sets.last().iter().flat_map(|s| &s.sites) {
        let p = data.positions[s] * 1e3;
        let _ = writeln!(text, "{},{},{},{s}", p.x, p.y, p.z);
    }
    crate::io::atomic::write(path, text.as_bytes()).context("the sites could not be written")
}

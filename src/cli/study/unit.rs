//! One unit of a study: its project, its design, and what is said of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context as _, anyhow, ensure};
use clap::Parser as _;
use serde_json::Map;
use toml::Value;

use crate::budget::Watch;
use crate::cli::limb;
use crate::cli::limb::LimbArgs;
use crate::design::{self, DesignError, Simulated};
use crate::document::{Document, SimulationInputs};
use crate::io::opening::{bundled, open};
use crate::io::project_file::{self, LoadedProject};
use crate::io::study_folder::{Cost, Outcome, StudyFolder, fingerprint, plain};
use crate::io::{cpu_seconds, glb, mesh_file, source};
use crate::mesh::TriMesh;
use crate::parameter_study::{Figure, ParameterStudy, Points, Subject, figures};
use crate::project::{Masks, Project};

/// What units are made on: the base, and the last simulation, which the next unit may share.
pub struct Bench {
    /// The folder that paths of the study start from.
    home: PathBuf,
    base: Base,
    last: Option<Made>,
}

/// A simulation with what it was made from.
struct Made {
    inputs: SimulationInputs,
    part: Arc<TriMesh>,
    simulated: Arc<Simulated>,
}

impl Made {
    /// Whether it is of these inputs on this part: of another part the inputs say nothing.
    fn is_of(&self, inputs: &SimulationInputs, part: &TriMesh) -> bool {
        self.inputs == *inputs
            && self.part.positions() == part.positions()
            && self.part.triangles() == part.triangles()
    }
}

enum Base {
    Limb,
    /// A project or a mesh.
    File(PathBuf),
}

impl Bench {
    /// For the units of a study whose paths start from a folder.
    ///
    /// # Errors
    /// Where the base is not there.
    pub fn new(study: &ParameterStudy, home: &Path) -> anyhow::Result<Self> {
        let base = match &study.base.project {
            None => Base::Limb,
            Some(name) => {
                let path = home.join(name);
                source::ordinary(&path)?;
                Base::File(path)
            }
        };
        Ok(Self {
            home: home.to_owned(),
            base,
            last: None,
        })
    }

    /// What the base is, in short.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn fingerprint(&self) -> anyhow::Result<String> {
        let path = match &self.base {
            Base::Limb => {
                return Ok(fingerprint(&project_file::to_text(
                    &bundled()?.inputs.project,
                )));
            }
            Base::File(path) => path,
        };
        let loaded = open(path, None)?;
        let mut key = crate::io::fingerprint::Fingerprint::default();
        key.add(project_file::to_text(&loaded.inputs.project).bytes());
        key.add_part(&loaded.inputs);
        Ok(key.hex())
    }

    /// That every axis changes something that is there, by its first value; whether a value can be had is for the unit
    /// to find.
    ///
    /// # Errors
    /// The axis that does not, and why.
    pub fn check_axes(&self, study: &ParameterStudy) -> anyhow::Result<()> {
        for axis in &study.axes {
            match axis.subject().map_err(|why| anyhow!(why))? {
                Subject::Limb(_) => ensure!(
                    matches!(self.base, Base::Limb),
                    "the axis {} is of the limb of the program, and the base is a project: set limb = true in its place",
                    axis.key
                ),
                Subject::Mesh => ensure!(
                    matches!(self.base, Base::File(_)),
                    "the axis {} names meshes for a project, and the base is the limb of the program: name a project",
                    axis.key
                ),
                Subject::Project(key) => {
                    let listed = [
                        "support.",
                        "selection.site.",
                        "selection.cost.",
                        "evaluation.region.",
                        "live.glued.",
                        "kept.",
                    ];
                    ensure!(
                        !listed.iter().any(|list| key.path.starts_with(list)),
                        "the axis {} stands in a list of a project: a study varies keys that stand once",
                        axis.key
                    );
                }
            }
        }
        if let Some(axis) = study
            .axes
            .iter()
            .find(|a| matches!(a.subject(), Ok(Subject::Limb(_))))
        {
            // The options' names are clap's to know.
            let values = Points::of(study).map_err(|why| anyhow!(why))?.values(0);
            let made = limb_args(study, &values);
            made.with_context(|| format!("the axis {}", axis.key))?;
        }
        Ok(())
    }

    /// The project of a unit with what it refers to.
    fn project(&self, study: &ParameterStudy, values: &[Value]) -> anyhow::Result<LoadedProject> {
        match &self.base {
            Base::File(path) => self.of_file(path, study, values),
            Base::Limb => from_limb(study, values),
        }
    }

    fn of_file(
        &self,
        path: &Path,
        study: &ParameterStudy,
        values: &[Value],
    ) -> anyhow::Result<LoadedProject> {
        let (path, text) = if project_file::is_project(path) {
            (path.to_owned(), source::read_text(path)?)
        } else {
            let loaded = open(path, None)?;
            (loaded.path, project_file::to_text(&loaded.inputs.project))
        };
        let mut table: toml::Table =
            toml::from_str(&text).map_err(|e| anyhow!("{}: {}", path.display(), e.message()))?;
        vary(&mut table, study, values, &self.home)?;
        Ok(project_file::load_text(&path, &table.to_string())?)
    }

    /// Computes a unit, one of so many beside each other, among whom the processor's time is divided.
    ///
    /// # Errors
    /// What is not the unit's own fault: a base that cannot be read any more, too little memory, a stop.
    pub fn compute(
        &mut self,
        (folder, points): (&StudyFolder, &Points),
        unit: usize,
        beside: usize,
        watch: Watch,
    ) -> anyhow::Result<(Outcome, Cost)> {
        let (cpu, start) = (cpu_seconds(), Instant::now());
        let study = &folder.study;
        let values = points.values(unit);
        let named = study.axes.iter().zip(&values);
        let plan = &folder.plan;
        let mut outcome = Outcome {
            version: plan.version.clone(),
            study: plan.study.clone(),
            base: plan.base.clone(),
            unit,
            values: named
                .map(|(a, v)| (a.key.clone(), plain(v)))
                .collect::<Map<_, _>>(),
            figures: Vec::new(),
            error: None,
            cautions: Vec::new(),
        };
        let mut shared = false;
        match self.project(study, &values) {
            Err(error) if self.lacks_base() => return Err(error),
            Err(error) => outcome.error = Some(self.without_home(&format!("{error:#}"))),
            Ok(loaded) => match self.designed(loaded, study, watch, &mut shared) {
                Ok((figures, cautions)) => {
                    (outcome.figures, outcome.cautions) = (figures, cautions);
                }
                Err(error) if is_ours(&error) => return Err(error.into()),
                Err(error) => outcome.error = Some(error.to_string()),
            },
        }
        let cost = Cost {
            unit,
            cpu_seconds: (cpu_seconds() - cpu) / beside as f64,
            seconds: start.elapsed().as_secs_f64(),
            shared,
        };
        Ok((outcome, cost))
    }

    /// Whether the base, which was there when the work began, cannot be read any more.
    fn lacks_base(&self) -> bool {
        matches!(&self.base, Base::File(path) if std::fs::read(path).is_err())
    }

    /// Words in which files have the names that the study gives them, wherever it lies.
    fn without_home(&self, said: &str) -> String {
        let absolute = std::path::absolute(&self.home).unwrap_or_default();
        [absolute.as_path(), self.home.as_path()]
            .iter()
            .filter(|home| !home.as_os_str().is_empty())
            .fold(said.to_owned(), |said, home| {
                said.replace(&format!("{}/", home.display()), "")
            })
    }

    /// The figures of a project's design and its cautions.
    fn designed(
        &mut self,
        loaded: LoadedProject,
        study: &ParameterStudy,
        watch: Watch,
        shared: &mut bool,
    ) -> Result<(Vec<Figure>, Vec<String>), DesignError> {
        loaded.inputs.project.check()?;
        let inputs = loaded.inputs.clone();
        let budget = inputs.project.budget.budget();
        let part = Arc::clone(&inputs.part);
        let key = Document::new(loaded, None).simulation_inputs(inputs.project.budget.quality);
        let known = self.last.take().filter(|made| made.is_of(&key, &part));
        *shared = known.is_some();
        let simulated = match known {
            Some(made) => made.simulated,
            None => Arc::new(design::simulate(&inputs, &budget, watch)?),
        };
        self.last = Some(Made {
            inputs: key,
            part,
            simulated: Arc::clone(&simulated),
        });
        let kinds = inputs.project.selectors();
        let begun = Instant::now();
        let clock = || begun.elapsed().as_secs_f64();
        let design = design::run_from(&inputs, simulated, &kinds, &budget, &clock, watch)?;
        let found = figures(&inputs, &design, study.base.density_g_cm3)?;
        Ok((found, design.cautions()))
    }
}

/// Whether a failure is of this machine and moment, and not of the unit.
fn is_ours(error: &DesignError) -> bool {
    let memory = match error {
        DesignError::Elastic(error) => error.is_memory(),
        DesignError::TooLarge { .. } => true,
        _ => false,
    };
    memory || error.is_cancelled()
}

/// The limb with its options, and then the project's keys.
fn from_limb(study: &ParameterStudy, values: &[Value]) -> anyhow::Result<LoadedProject> {
    let mut loaded = bundled()?;
    if let Some(args) = limb_args(study, values)? {
        let made = limb::made(&args)?;
        // As it is in a file (single precision), like anyone who opens it.
        let stored =
            mesh_file::parse_glb(&glb::write_glb(&made.mesh)?).map_err(|why| anyhow!(why))?;
        loaded.inputs.part = Arc::new(stored.mesh);
        loaded.inputs.project = made.project;
        loaded.inputs.masks = Masks::new();
    }
    let mut table: toml::Table = toml::from_str(&project_file::to_text(&loaded.inputs.project))?;
    vary(&mut table, study, values, Path::new(""))?;
    let project: Project = project_file::parse(&table.to_string()).map_err(|why| anyhow!(why))?;
    loaded.inputs.project = project;
    Ok(loaded)
}

/// The options of `hapdef limb`, for themselves.
#[derive(clap::Parser)]
struct Options {
    #[command(flatten)]
    limb: LimbArgs,
}

/// The options of `hapdef limb` that a unit has; nothing where no axis is of them.
fn limb_args(study: &ParameterStudy, values: &[Value]) -> anyhow::Result<Option<LimbArgs>> {
    let mut words = ["limb", "--out", ".", "--no-sites"]
        .map(String::from)
        .to_vec();
    let bare = words.len();
    for (axis, value) in study.axes.iter().zip(values) {
        let Ok(Subject::Limb(option)) = axis.subject() else {
            continue;
        };
        match value {
            Value::Boolean(false) => {}
            Value::Boolean(true) => words.push(format!("--{option}")),
            Value::String(text) => words.push(format!("--{option}={text}")),
            other => words.push(format!("--{option}={other}")),
        }
    }
    if words.len() == bare {
        return Ok(None);
    }
    let said = |e: clap::Error| {
        let text = e.to_string();
        let line = text.lines().next().unwrap_or_default();
        anyhow!("{}", line.trim_start_matches("error: "))
    };
    Ok(Some(Options::try_parse_from(words).map_err(said)?.limb))
}

/// Sets the keys of a unit in a project's table.
fn vary(
    table: &mut toml::Table,
    study: &ParameterStudy,
    values: &[Value],
    home: &Path,
) -> anyhow::Result<()> {
    // Chosen sites, and what was kept beside them, are of the base alone.
    if let Some(Value::Table(selection)) = table.get_mut("selection") {
        selection.remove("site");
    }
    if let Some(Value::Table(live)) = table.get_mut("live") {
        live.remove("glued");
    }
    table.remove("kept");
    let base = &study.base;
    if let Some(quality) = base.quality {
        set(
            table,
            "budget.quality",
            Value::String(quality.name().into()),
        );
    }
    if let Some(seed) = base.seed {
        set(table, "budget.seed", Value::Integer(seed as i64));
    }
    for (axis, value) in study.axes.iter().zip(values) {
        match axis.subject().map_err(|why| anyhow!(why))? {
            Subject::Limb(_) => {}
            Subject::Project(_) => set(table, &axis.key, value.clone()),
            Subject::Mesh => {
                let name = value.as_str().context("mesh takes the names of files")?;
                let path = std::path::absolute(home.join(name))?;
                set(
                    table,
                    "part.mesh",
                    Value::String(path.to_string_lossy().into_owned()),
                );
            }
        }
    }
    Ok(())
}

/// Sets `table.key` to a value, with the tables on the way.
fn set(table: &mut toml::Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => drop(table.insert(path.to_owned(), value)),
        Some((name, rest)) => {
            let inner = table
                .entry(name)
                .or_insert_with(|| Value::Table(toml::Table::new()));
            if let Value::Table(inner) = inner {
                set(inner, rest, value);
            }
        }
    }
}

//! The project of a unit: a study's base, varied along its axes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, anyhow, ensure};
use clap::Parser as _;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use toml::Value;

use super::limb_options::{LimbOptions, made};
use crate::io::opening::{bundled, open};
use crate::io::project_file::{self, LoadedProject};
use crate::io::study_folder::fingerprint;
use crate::io::{atomic, glb, mesh_file, source};
use crate::parameter_study::{ParameterStudy, Points, StudyAxis, Subject};
use crate::project::{Masks, Project};

/// What the units of a study are made of.
pub struct UnitBase {
    /// The folder that paths of the study start from.
    home: PathBuf,
    from: From,
}

enum From {
    Limb,
    /// A project or a mesh.
    File(PathBuf),
}

impl UnitBase {
    /// For the units of a study whose paths start from a folder.
    ///
    /// # Errors
    /// Where the base is not there.
    pub fn new(study: &ParameterStudy, home: &Path) -> anyhow::Result<Self> {
        let from = match &study.base.project {
            None => From::Limb,
            Some(name) => {
                let path = home.join(name);
                source::ordinary(&path)?;
                From::File(path)
            }
        };
        Ok(Self {
            home: home.to_owned(),
            from,
        })
    }

    /// What the base is, in short.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn fingerprint(&self) -> anyhow::Result<String> {
        let path = match &self.from {
            From::Limb => {
                return Ok(fingerprint(&project_file::to_text(
                    &bundled()?.inputs.project,
                )));
            }
            From::File(path) => path,
        };
        let loaded = open(path, None)?;
        let mut key = crate::io::fingerprint::Fingerprint::default();
        key.add(project_file::to_text(&loaded.inputs.project).bytes());
        key.add_part(&loaded.inputs);
        Ok(key.hex())
    }

    /// The meshes that axes name, each with a fingerprint of its file, or nothing of one that is not there: for
    /// [`Self::check_meshes`].
    #[must_use]
    pub fn meshes(&self, study: &ParameterStudy) -> BTreeMap<String, String> {
        let axes = (study.axes.iter()).filter(|a| matches!(a.subject(), Ok(Subject::Mesh)));
        let names: BTreeSet<String> = axes.flat_map(StudyAxis::named).map(String::from).collect();
        let keyed = |name: String| (self.mesh_key(&name), name);
        let found = names.into_iter().map(keyed);
        found.map(|(key, name)| (name, key)).collect()
    }

    /// That those of these names that are meshes are what was `planned` with: figures of another mesh would stand under
    /// its name.
    ///
    /// # Errors
    /// The mesh that is not.
    pub fn check_meshes<'a>(
        &self,
        names: impl IntoIterator<Item = &'a str>,
        planned: &BTreeMap<String, String>,
    ) -> anyhow::Result<()> {
        for name in names {
            ensure!(
                planned
                    .get(name)
                    .is_none_or(|was| self.mesh_key(name) == *was),
                "{name}: the mesh has changed since the study was planned (it was changed, has come, or cannot be read any more): plan it anew into another folder"
            );
        }
        Ok(())
    }

    /// Of the bytes of a mesh's file, and of those that a glTF names beside it.
    fn mesh_key(&self, name: &str) -> String {
        let path = self.home.join(name);
        let Ok(bytes) = source::read(&path) else {
            return String::new();
        };
        let mut key = crate::io::fingerprint::Fingerprint::default();
        for beside in named_by_gltf(&path, &bytes) {
            key.add(source::read(&beside).unwrap_or_default());
        }
        key.add(bytes);
        key.hex()
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
                    matches!(self.from, From::Limb),
                    "the axis {} is of the limb of the program, and the base is a project: set limb = true in its place",
                    axis.key
                ),
                Subject::Mesh => ensure!(
                    matches!(self.from, From::File(_)),
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
                        "live.press.",
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
            made.with_context(|| format!("the axes of the limb ({} …)", axis.key))?;
        }
        Ok(())
    }

    /// The project of a unit with what it refers to.
    ///
    /// # Errors
    /// What cannot be had of these values.
    pub fn project(
        &self,
        study: &ParameterStudy,
        values: &[Value],
    ) -> anyhow::Result<LoadedProject> {
        match &self.from {
            From::File(path) => self.of_file(path, study, values),
            From::Limb => from_limb(study, values),
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

    /// Writes a unit as a project of this name into a folder, with its mesh where that is in no file, unless it is there
    /// already; its path.
    ///
    /// # Errors
    /// What cannot be had of these values, or cannot be written.
    pub fn write(
        &self,
        study: &ParameterStudy,
        values: &[Value],
        folder: &Path,
        name: &str,
    ) -> anyhow::Result<PathBuf> {
        let path = folder.join(format!("{name}.hapdef.toml"));
        if path.exists() {
            // Somebody may have worked on it since.
            return Ok(path);
        }
        let loaded = self.project(study, values)?;
        let inputs = &loaded.inputs;
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let mut project = inputs.project.clone();
        project.part.mesh = match &self.from {
            From::Limb => {
                let file = format!("{name}.glb");
                atomic::write(&folder.join(&file), &glb::write_glb(&inputs.part)?)?;
                file
            }
            From::File(_) => project_file::relative_to(&path, &loaded.mesh_path),
        };
        project_file::save(
            &path,
            &project,
            inputs.painted.as_ref().map(|p| p.as_slice()),
            &inputs.masks,
        )?;
        Ok(path)
    }

    /// Whether the base, which was there when the work began, cannot be read any more.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        matches!(&self.from, From::File(path) if std::fs::read(path).is_err())
    }

    /// Words in which files have the names that the study gives them, wherever it lies.
    #[must_use]
    pub fn without_home(&self, said: &str) -> String {
        let absolute = std::path::absolute(&self.home).unwrap_or_default();
        [absolute.as_path(), self.home.as_path()]
            .iter()
            .filter(|home| !home.as_os_str().is_empty())
            .fold(said.to_owned(), |said, home| {
                said.replace(&format!("{}/", home.display()), "")
            })
    }
}

/// Files with the buffers of a glTF; none of any other file.
fn named_by_gltf(path: &Path, bytes: &[u8]) -> Vec<PathBuf> {
    let is_gltf = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gltf"));
    let parsed = is_gltf.then(|| serde_json::from_slice::<serde_json::Value>(bytes).ok());
    let Some(gltf) = parsed.flatten() else {
        return Vec::new();
    };
    let buffers = gltf["buffers"].as_array().into_iter().flatten();
    let names = buffers.filter_map(|buffer| buffer["uri"].as_str());
    let files = names.filter(|name| !name.starts_with("data:"));
    files.map(|name| path.with_file_name(name)).collect()
}

/// The limb with its options, and then the project's keys.
fn from_limb(study: &ParameterStudy, values: &[Value]) -> anyhow::Result<LoadedProject> {
    let mut loaded = bundled()?;
    if let Some(args) = limb_args(study, values)? {
        let made = made(&args)?;
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
struct LimbFlags {
    #[command(flatten)]
    limb: LimbOptions,
}

/// The options of `hapdef limb` that a unit has; nothing where no axis is of them.
fn limb_args(study: &ParameterStudy, values: &[Value]) -> anyhow::Result<Option<LimbOptions>> {
    let mut words = vec!["limb".to_owned()];
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
    let limb = LimbFlags::try_parse_from(words).map_err(|e| refused(&e))?;
    Ok(Some(limb.limb))
}

/// What is wrong with the options of a limb, as axes of a study.
fn refused(error: &clap::Error) -> anyhow::Error {
    if error.kind() == ErrorKind::MissingRequiredArgument {
        let missing = match error.get(ContextKind::InvalidArg) {
            Some(ContextValue::Strings(missing)) => missing.as_slice(),
            _ => &[],
        };
        let names: Vec<String> = (missing.iter())
            .filter_map(|name| name.trim_start_matches("--").split_whitespace().next())
            .map(|name| format!("limb.{name}"))
            .collect();
        return anyhow!(
            "one of them takes another axis beside it: {}",
            names.join(", ")
        );
    }
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    anyhow!("{}", line.trim_start_matches("error: "))
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

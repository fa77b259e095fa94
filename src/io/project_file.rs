//! Project files: readable, commented, versioned TOML, with arrays in NPZ beside them.

mod masks;
mod names;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use super::mesh_file::{LoadedMesh, read_mesh};
use super::npz::{NpzFile, read_mask};
use super::{FileError, atomic, source};
use crate::design::Inputs;
use crate::mesh::RepairReport;
use crate::plain::{ends, lines_before};
use crate::project::{FORMAT, Masks, Project};

use names::{marked, plain};

pub use names::arrays_path;
pub use text::to_text;

/// Name of the painted mask among the arrays.
const PAINTED: &str = "painted";

/// A project with what it refers to.
pub struct LoadedProject {
    pub inputs: Inputs,
    pub repairs: RepairReport,
    /// Where the project file lies, and the mesh it names.
    pub path: PathBuf,
    pub mesh_path: PathBuf,
    /// The limb inside the program: its mesh lies in no file yet.
    pub bundled: bool,
}

/// Reads a project, its mesh and its masks.
///
/// # Errors
/// [`FileError`] naming the file, the place in it and the remedy.
pub fn load(path: &Path) -> Result<LoadedProject, FileError> {
    load_text(path, &source::read_text(path)?)
}

/// As [`load`], of a text that may stand in that file.
///
/// # Errors
/// As [`load`].
pub fn load_text(path: &Path, text: &str) -> Result<LoadedProject, FileError> {
    let mut project = parse(text).map_err(|m| FileError::broken(path, m))?;
    let mesh_path = path
        .parent()
        .unwrap_or(Path::new("."))
        .join(&project.part.mesh);
    let LoadedMesh {
        mesh,
        mut repairs,
        groups,
        found,
    } = read_mesh(
        &mesh_path,
        project.part.unit,
        project.part.body,
        project.part.repair(),
    )?;
    let keys: toml::Table = toml::from_str(text).unwrap_or_default();
    let taken = found.answer(&mut project, |key| is_given(&keys, key));
    project
        .check()
        .map_err(|e| FileError::broken(&mesh_path, e))?;
    repairs.notes.extend(taken);
    let masks = masks::read(path, &mut project, groups, &mesh)?;
    let painted = masks::read_painted(path, &project, &mesh)?;
    if let Some(name) = &mut project.feasible.painted {
        *name = plain(name).to_owned();
    }
    Ok(LoadedProject {
        inputs: Inputs {
            project,
            part: Arc::new(mesh),
            painted: painted.map(Arc::new),
            masks,
        },
        repairs,
        path: path.to_owned(),
        mesh_path,
        bundled: false,
    })
}

/// Whether a project gives a key, as `table.key`.
fn is_given(table: &toml::Table, key: &str) -> bool {
    let Some((name, key)) = key.split_once('.') else {
        return table.contains_key(key);
    };
    let inner = table.get(name).and_then(toml::Value::as_table);
    inner.is_some_and(|inner| inner.contains_key(key))
}

/// Whether a path names a project and not a mesh, by its ending.
#[must_use]
pub fn is_project(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// The path with the ending that projects have, added where it is missing.
#[must_use]
pub fn with_ending(path: &Path) -> PathBuf {
    if is_project(path) {
        return path.to_owned();
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".hapdef.toml");
    path.with_file_name(name)
}

/// Parses and checks a project's text.
///
/// # Errors
/// A message in the user's terms, with the line where there is one.
pub fn parse(text: &str) -> Result<Project, String> {
    #[derive(serde::Deserialize)]
    struct Versioned {
        format: Option<i64>,
    }
    let version: Versioned = toml::from_str(text).map_err(|e| unreadable(text, &e))?;
    match version.format {
        Some(v) if v == i64::from(FORMAT) => {}
        Some(v) if v > i64::from(FORMAT) => {
            return Err(format!(
                "the project is of format {v}, written by a newer version of HapDef; this one reads up to format {FORMAT}. Update HapDef"
            ));
        }
        Some(v) => {
            return Err(format!(
                "format {v} has never existed. Set format = {FORMAT}"
            ));
        }
        None => {
            return Err(format!(
                "the key \"format\" is missing. Add format = {FORMAT} as the first line"
            ));
        }
    }
    let project: Project = toml::from_str(text).map_err(|e| unreadable(text, &e))?;
    project.check().map_err(|e| match line_of(text, &e.key) {
        Some(line) => format!("line {line}: {e}"),
        None => e.to_string(),
    })?;
    Ok(project)
}

/// The line that a key stands in, by its path; nothing where it is left out, or where one of several tables of its name
/// holds it.
fn line_of(text: &str, path: &str) -> Option<usize> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut names = path.split('.').peekable();
    loop {
        let (key, value) = table.get_key_value(names.next()?)?;
        if names.peek().is_none() {
            return Some(1 + lines_before(text.as_bytes(), key.span().start));
        }
        table = match value.get_ref() {
            DeValue::Table(table) => table,
            DeValue::Array(tables) if tables.len() == 1 => tables[0].get_ref().as_table()?,
            _ => return None,
        };
    }
}

/// What is wrong in a project's text and where; not the line itself, which may be of any length.
fn unreadable(text: &str, error: &toml::de::Error) -> String {
    let place = error.span().map_or_else(String::new, |span| {
        let before = &text.as_bytes()[..span.start.min(text.len())];
        let line = 1 + lines_before(before, before.len());
        let start = before
            .iter()
            .rposition(|&b| b == b'\n')
            .map_or(0, |at| at + 1);
        let column = 1 + String::from_utf8_lossy(&before[start..]).chars().count();
        format!(", line {line}, column {column}")
    });
    format!(
        "this is not a readable project file{place}: {}",
        ends(&in_words(error.message()))
    )
}

/// Types as the library names them, in the words of whoever writes a project.
fn in_words(message: &str) -> String {
    const WHOLE: &str = "expected a whole number from 0 on";
    [
        (" as i128", ""),
        (" as u128", ""),
        ("expected usize", WHOLE),
        ("expected u64", WHOLE),
        ("expected u32", WHOLE),
        ("expected u16", WHOLE),
        ("expected u8", WHOLE),
        ("expected f64", "expected a number"),
    ]
    .iter()
    .fold(message.to_owned(), |said, (from, to)| {
        said.replace(from, to)
    })
}

/// Saves a project atomically, one backup kept, its masks beside it. Paths in it are taken as they are:
/// relative to the file. Whenever it is interrupted, the project is wholly the old one or the new one: the
/// arrays of both lie beside it, those of the old one for its backup.
///
/// # Errors
/// [`FileError`] naming the file that could not be written; what was there before is whole, in its place
/// or as its `.bak`.
pub fn save(
    path: &Path,
    project: &Project,
    painted: Option<&[bool]>,
    masks: &Masks,
) -> Result<(), FileError> {
    save_under(path, "", project, painted, masks)
}

/// As [`save`], with a comment of one line on top.
///
/// # Errors
/// As [`save`].
pub fn save_under(
    path: &Path,
    comment: &str,
    project: &Project,
    painted: Option<&[bool]>,
    masks: &Masks,
) -> Result<(), FileError> {
    let mut project = project.clone();
    let mut kept: BTreeMap<String, &[bool]> = BTreeMap::new();
    for name in project.mask_names() {
        if let Some(mask) = masks.get(plain(name)) {
            *name = marked(name, mask);
            kept.insert(name.clone(), mask);
        }
    }
    project.feasible.painted = painted.map(|mask| marked(PAINTED, mask));
    if let (Some(name), Some(mask)) = (&project.feasible.painted, painted) {
        kept.insert(name.clone(), mask);
    }
    let arrays = arrays_path(path);
    let old = old_arrays(path);
    if !kept.is_empty() {
        let mut both: BTreeMap<&str, &[bool]> = (old.iter())
            .map(|(name, mask)| (name.as_str(), mask.as_slice()))
            .collect();
        both.extend(kept.iter().map(|(name, mask)| (name.as_str(), *mask)));
        write_arrays(&arrays, &both)?;
    }
    let text = to_text(&project);
    let text = match comment {
        "" => text,
        comment => format!("# {comment}\n{text}"),
    };
    atomic::write_with_backup(path, text.as_bytes())
}

/// The arrays that the project in a file names; none where there is no readable one.
fn old_arrays(path: &Path) -> BTreeMap<String, Vec<bool>> {
    let text = source::read_text(path).unwrap_or_default();
    let Ok(mut old) = parse(&text) else {
        return BTreeMap::new();
    };
    let painted = old.feasible.painted.clone();
    let names: Vec<String> = old.mask_names().map(|n| n.clone()).chain(painted).collect();
    let arrays = arrays_path(path);
    if source::ordinary(&arrays).is_err() {
        return BTreeMap::new();
    }
    names
        .into_iter()
        .filter_map(|name| {
            let mask = read_mask(&arrays, &name).ok()?;
            Some((name, mask))
        })
        .collect()
}

fn write_arrays(path: &Path, arrays: &BTreeMap<&str, &[bool]>) -> Result<(), FileError> {
    let mut file = NpzFile::default();
    for (name, mask) in arrays {
        file.add(name, &[mask.len()], mask)
            .map_err(|e| FileError::of(path, &e))?;
    }
    file.save(path)
}

/// A path as a project at `project` should name it: relative where it can be.
#[must_use]
pub fn relative_to(project: &Path, target: &Path) -> String {
    let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned());
    let (from, to) = (absolute(project), absolute(target));
    let folder = from.parent().unwrap_or(Path::new("/"));
    // The root, or the drive, in common is nothing in common.
    let is_near = folder.components().take(2).eq(to.components().take(2));
    let relative = is_near.then(|| pathdiff::diff_paths(&to, folder)).flatten();
    relative.map_or_else(
        || to.to_string_lossy().into_owned(),
        |path| path.to_string_lossy().replace('\\', "/"),
    )
}

#[cfg(test)]
mod tests;

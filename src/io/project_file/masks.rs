//! The masks that a project names: arrays beside it, or groups of its mesh file.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use zip::ZipArchive;

use super::names::{arrays_path, plain};
use crate::io::npz::read_mask;
use crate::io::{FileError, source};
use crate::mesh::TriMesh;
use crate::plain::quote;
use crate::project::{Masks, Project};

/// The masks that a project names, which are then named without their fingerprints: arrays beside the
/// project come before groups of the mesh file.
///
/// # Errors
/// [`FileError`] for a mask that is neither, or not of this mesh.
pub(super) fn read(
    path: &Path,
    project: &mut Project,
    groups: Masks,
    mesh: &TriMesh,
) -> Result<Masks, FileError> {
    let mut masks = groups;
    if project.mask_names().next().is_none() {
        return Ok(masks);
    }
    let found: Vec<String> = masks.keys().cloned().collect();
    let arrays = MaskFile::beside(path)?;
    for (key, name) in project.mask_keys() {
        let own = plain(name).to_owned();
        // What is not there, or is for another mesh, gives way to the group of that name.
        match arrays.mask(key, name, mesh, &found) {
            Ok(mask) => drop(masks.insert(own.clone(), Arc::new(mask))),
            Err(_) if masks.contains_key(&own) => {}
            Err(error) => return Err(error),
        }
        *name = own;
    }
    Ok(masks)
}

/// The painted region, where the project names one.
///
/// # Errors
/// [`FileError`] where it is not there, or not of this mesh.
pub(super) fn read_painted(
    path: &Path,
    project: &Project,
    mesh: &TriMesh,
) -> Result<Option<Vec<bool>>, FileError> {
    let Some(name) = &project.feasible.painted else {
        return Ok(None);
    };
    let arrays = MaskFile::beside(path)?;
    let mask = arrays.mask("feasible.painted", name, mesh, &[])?;
    Ok(Some(mask))
}

/// The file of arrays beside a project.
struct MaskFile {
    project: PathBuf,
    path: PathBuf,
    /// Nothing where there is no such file.
    names: Option<Vec<String>>,
}

impl MaskFile {
    fn beside(project: &Path) -> Result<Self, FileError> {
        let path = arrays_path(project);
        let names = match source::ordinary(&path) {
            Ok(_) => Some(names_in(&path)?),
            Err(FileError::Missing { .. }) => None,
            Err(error) => return Err(error),
        };
        Ok(Self {
            project: project.to_owned(),
            path,
            names,
        })
    }

    /// One value a vertex; `groups` are those of the mesh file.
    fn mask(
        &self,
        key: &str,
        name: &str,
        mesh: &TriMesh,
        groups: &[String],
    ) -> Result<Vec<bool>, FileError> {
        let asked = quote(plain(name));
        let Some(names) = &self.names else {
            return Err(FileError::broken(
                &self.project,
                format!(
                    "{key} names the mask {asked}, which is nowhere: the arrays of this project must lie in {}, and there is no such file. Put them there under that name, or hold and paint it anew{}",
                    self.path.display(),
                    groups_in_words(groups)
                ),
            ));
        };
        if !names.iter().any(|n| n == name) {
            return Err(FileError::broken(
                &self.path,
                format!(
                    "there is no array {asked} in it, which {key} names as a mask; there is {}. Add it, or name another{}",
                    in_words(names),
                    groups_in_words(groups)
                ),
            ));
        }
        let mask = read_mask(&self.path, name)?;
        let length = mask.len();
        mesh.mask_of(mask).ok_or_else(|| {
            let vertices = mesh.before_halving().positions().len();
            let remedy = if key.starts_with("support") {
                ", or give that support a box"
            } else {
                ""
            };
            FileError::broken(
                &self.path,
                format!(
                    "the mask {asked} of {key} has {length} values, but the part has {vertices} vertices, and takes one for each: it is of another mesh, or of the same mesh taken in otherwise (part.body, part.weld_mm, part.halve_mm). Paint it again{remedy}"
                ),
            )
        })
    }
}

/// The names of the arrays in a file.
fn names_in(path: &Path) -> Result<Vec<String>, FileError> {
    let file = File::open(path).map_err(|e| FileError::of(path, &e))?;
    let archive = ZipArchive::new(file)
        .map_err(|e| FileError::broken(path, format!("this is not a readable NPZ file ({e})")))?;
    let names = archive.file_names().filter_map(Result::ok);
    Ok(names.filter_map(|n| array_name(&n)).collect())
}

fn array_name(entry: &str) -> Option<String> {
    entry.strip_suffix(".npy").map(str::to_owned)
}

fn groups_in_words(groups: &[String]) -> String {
    if groups.is_empty() {
        return String::new();
    }
    format!(" (groups of the mesh file are {})", in_words(groups))
}

fn in_words(names: &[String]) -> String {
    /// Names that are listed.
    const MOST: usize = 8;
    if names.is_empty() {
        return "none".into();
    }
    let listed: Vec<String> = names.iter().take(MOST).map(|n| quote(plain(n))).collect();
    let more = if names.len() > MOST { ", …" } else { "" };
    format!("{}{more}", listed.join(", "))
}

#[cfg(test)]
mod tests {
    use super::super::load;
    use super::*;
    use crate::io::npz::NpzFile;

    /// A square of four vertices whose support is a mask; with arrays beside it, where there are any.
    fn project(folder: &Path, arrays: &[(&str, usize)]) -> PathBuf {
        let square = "v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nf 1 2 3\nf 1 3 4\n";
        std::fs::write(folder.join("square.obj"), square).unwrap();
        let path = folder.join("p.hapdef.toml");
        let text = "format = 1\n[part]\nmesh = \"square.obj\"\nunit = \"mm\"\n[[support]]\nvertices = \"rim\"\n";
        std::fs::write(&path, text).unwrap();
        if !arrays.is_empty() {
            let mut file = NpzFile::default();
            for &(name, length) in arrays {
                file.add(name, &[length], &vec![true; length]).unwrap();
            }
            file.save(&folder.join("p.hapdef.npz")).unwrap();
        }
        path
    }

    fn refused(arrays: &[(&str, usize)]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = project(folder.path(), arrays);
        load(&path).err().unwrap().to_string()
    }

    #[test]
    fn a_mask_that_is_there_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = project(folder.path(), &[("rim", 4)]);
        let masks = load(&path).unwrap().inputs.masks;
        // And on all that lies between, where its long edges are halved.
        assert!(masks["rim"].len() > 4 && masks["rim"].iter().all(|m| *m));
    }

    #[test]
    fn what_is_missing_is_said_with_the_file_it_belongs_in() {
        let said = refused(&[]);
        assert!(
            said.contains("“rim”") && said.contains("p.hapdef.npz"),
            "{said}"
        );
        let said = refused(&[("edge", 4), ("grip", 4)]);
        assert!(
            said.contains("p.hapdef.npz") && said.contains("“edge”, “grip”"),
            "{said}"
        );
        let said = refused(&[("rim", 7)]);
        assert!(
            said.contains("7 values") && said.contains("4 vertices"),
            "{said}"
        );
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn nothing_waits_for_a_pipe() {
        use rustix::fs::{CWD, FileType, Mode, mknodat};
        let folder = tempfile::tempdir().unwrap();
        let path = project(folder.path(), &[]);
        for name in ["p.hapdef.npz", "pipe.hapdef.toml"] {
            let pipe = folder.path().join(name);
            mknodat(
                CWD,
                pipe.as_path(),
                FileType::Fifo,
                Mode::RUSR | Mode::WUSR,
                0,
            )
            .unwrap();
        }
        for path in [path, folder.path().join("pipe.hapdef.toml")] {
            let said = load(&path).err().unwrap().to_string();
            assert!(said.contains("pipe"), "{said}");
        }
    }
}

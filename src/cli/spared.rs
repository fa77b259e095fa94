//! The files that a command reads: none of them is written over.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};

use crate::io::outlet;
use crate::io::project_file::{LoadedProject, arrays_path};

/// What a command reads, in words and by path.
pub struct Spared(Vec<(&'static str, PathBuf)>);

impl Spared {
    /// What a project is made of.
    #[must_use]
    pub fn of(loaded: &LoadedProject) -> Self {
        let mut files = vec![
            ("the project itself", loaded.path.clone()),
            ("the mesh of the project", loaded.mesh_path.clone()),
        ];
        // Beside a project that names no arrays may lie what an earlier run has written there.
        if names_arrays(loaded) {
            files.push(("the arrays of the project", arrays_path(&loaded.path)));
        }
        Self(files)
    }

    /// The files of a dataset.
    #[must_use]
    pub fn of_data(data: &Path, touches: Option<&Path>) -> Self {
        Self(vec![("the dataset", data.to_owned())]).and("the table of the touches", touches)
    }

    /// And a file of the command, where it was given.
    #[must_use]
    pub fn and(mut self, what: &'static str, path: Option<&Path>) -> Self {
        self.0.extend(path.map(|path| (what, path.to_owned())));
        self
    }

    /// Refuses an output that is one of them.
    ///
    /// # Errors
    /// A message naming the flag, the path and what lies there.
    pub fn check(&self, flag: &str, output: Option<&Path>) -> anyhow::Result<()> {
        let Some(output) = output else { return Ok(()) };
        let there = self.0.iter().find(|(_, path)| is_same_file(output, path));
        ensure!(
            there.is_none(),
            "{flag} {}: this is {}. Choose another name",
            output.display(),
            there.map_or("a file that is read", |(what, _)| what)
        );
        Ok(())
    }
}

impl Spared {
    /// As [`Self::check`], of a file that is written when all is computed: refuses too what could not be written then.
    ///
    /// # Errors
    /// A message naming the flag, the path and what to do.
    pub fn check_result(&self, flag: &str, output: Option<&Path>) -> anyhow::Result<()> {
        self.check(flag, output)?;
        output.map_or(Ok(()), outlet::file).context(flag.to_owned())
    }
}

fn names_arrays(loaded: &LoadedProject) -> bool {
    let mut project = loaded.inputs.project.clone();
    loaded.inputs.painted.is_some() || project.mask_names().next().is_some()
}

/// Whether two names are of one file that is there, links followed.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let whole = |p: &Path| std::fs::canonicalize(p).ok();
    whole(a).is_some_and(|a| whole(b) == Some(a))
}

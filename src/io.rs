//! Files: meshes, projects, datasets and reports. With `board` the only part that touches the outside.

pub mod artifacts;
pub mod atomic;
pub mod glb;
pub mod mesh_file;
pub mod npz;
pub mod points;
pub mod project_file;
pub mod report;
pub mod svg;
pub mod vtu;

use std::path::PathBuf;

/// A file that could not be read or written, in the user's terms.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    #[error("{}: there is no such file. Check the path", path.display())]
    Missing { path: PathBuf },
    #[error("{}: {message}", path.display())]
    Broken { path: PathBuf, message: String },
}

impl FileError {
    pub(crate) fn broken(path: &std::path::Path, message: impl std::fmt::Display) -> Self {
        Self::Broken {
            path: path.to_owned(),
            message: message.to_string(),
        }
    }

    pub(crate) fn of(path: &std::path::Path, error: &std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::NotFound => Self::Missing {
                path: path.to_owned(),
            },
            std::io::ErrorKind::PermissionDenied => Self::broken(
                path,
                "permission denied. Check who may read and write there",
            ),
            _ => Self::broken(path, error),
        }
    }
}

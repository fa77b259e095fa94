//! Files: meshes, projects, datasets and reports. With `board` the only part that touches the outside.

pub mod artifacts;
pub mod atomic;
pub mod dataset_file;
pub mod glb;
pub mod mesh_file;
pub mod npz;
pub mod points;
pub mod project_file;
pub mod report;
pub mod svg;
pub mod vtu;

use std::path::PathBuf;

/// Processor seconds of this process so far; by the clock where the system does not say.
#[must_use]
pub fn cpu_seconds() -> f64 {
    /// Ticks a second of the kernel's interface, the same on every Linux.
    const TICKS: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name may hold anything; what follows its closing parenthesis does not.
    let fields: Vec<&str> = stat
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .collect();
    let ticks = |k: usize| fields.get(k).and_then(|f| f.parse::<f64>().ok());
    match (ticks(11), ticks(12)) {
        (Some(user), Some(system)) => (user + system) / TICKS,
        _ => std::time::SystemTime::now()
            .duration_since(std::time::UNIX_EPOCH)
            .map_or(0.0, |d| d.as_secs_f64()),
    }
}

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

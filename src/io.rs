//! Files: meshes, projects, datasets and reports. With `board` the only part that touches the outside.

pub mod artifacts;
pub mod atomic;
pub mod bench_folder;
pub mod dataset_file;
pub mod examples;
pub mod fingerprint;
pub mod glb;
pub mod handover;
pub mod kept_model;
pub mod kept_simulation;
pub mod machine_file;
pub mod mesh_file;
pub mod npy;
pub mod npz;
pub mod opening;
pub mod outlet;
#[cfg(feature = "parquet")]
pub mod parquet_table;
pub mod points;
pub mod project_file;
pub mod report;
pub mod response_maps;
pub mod run;
pub mod scatter;
pub mod source;
pub mod study_folder;
pub mod svg;
pub mod table;
pub mod together;
pub mod touch_file;
pub mod touch_source;
pub mod trade_file;
pub mod vtu;

use std::path::PathBuf;

/// CPU time (s) of this process so far.
#[cfg(unix)]
#[must_use]
pub fn cpu_seconds() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    let spent = clock_gettime(ClockId::ProcessCPUTime);
    spent.tv_sec as f64 + spent.tv_nsec as f64 * 1e-9
}

/// Seconds by the clock: the system does not say what the processor spent.
#[cfg(not(unix))]
#[must_use]
pub fn cpu_seconds() -> f64 {
    std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0.0, |d| d.as_secs_f64())
}

/// What this process holds and has held at most (MB, `VmRSS` and `VmHWM`), where the system says so.
fn memory_mb(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|l| l.strip_prefix(key)?.strip_prefix(':'))?;
    let kilobytes: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kilobytes / 1024.0)
}

/// Begins to look for the most memory of this process anew, where the system lets us.
fn forget_memory() {
    // Linux: "5" takes the high-water mark down to what is held now. Nothing depends on it elsewhere.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Clock and memory of this process.
pub struct ProcessMeter {
    start: std::time::Instant,
    /// Memory that was held when it was first forgotten (KB): what stays, beside what is measured.
    held: std::sync::atomic::AtomicU64,
}

impl Default for ProcessMeter {
    fn default() -> Self {
        Self {
            start: std::time::Instant::now(),
            held: 0.into(),
        }
    }
}

impl crate::trade::CostMeter for ProcessMeter {
    fn cpu_seconds(&self) -> f64 {
        cpu_seconds()
    }

    fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    fn forget_memory(&self) {
        forget_memory();
        let held = memory_mb("VmRSS").unwrap_or(0.0) * 1024.0;
        // Once: what an allocator keeps of the run before is not to be taken from what the next one takes.
        let (first, order) = (held as u64, std::sync::atomic::Ordering::Relaxed);
        let _ = self.held.compare_exchange(0, first, order, order);
    }

    fn most_memory_mb(&self) -> Option<f64> {
        let held = self.held.load(std::sync::atomic::Ordering::Relaxed) as f64 / 1024.0;
        memory_mb("VmHWM").map(|most| (most - held).max(0.0))
    }
}

/// A file that could not be read or written, in the user's terms.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    #[error("{}: there is no such file. Check the path", crate::plain::path(path))]
    Missing { path: PathBuf },
    #[error("{}: {message}", crate::plain::path(path))]
    Broken { path: PathBuf, message: String },
}

impl FileError {
    pub(crate) fn broken(path: &std::path::Path, message: impl std::fmt::Display) -> Self {
        Self::Broken {
            path: path.to_owned(),
            // Messages of libraries may carry pieces of the file.
            message: crate::plain::message(&message.to_string()),
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
            std::io::ErrorKind::InvalidFilename => Self::broken(
                path,
                "a name in it is none for a file, or too long. Check the path",
            ),
            _ => Self::broken(path, error),
        }
    }
}

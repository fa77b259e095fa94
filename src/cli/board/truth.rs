//! What really touches a simulated board, as a table.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::mpsc::Sender;

use anyhow::Context as _;

use crate::board::Truth;
use crate::elasticity::Touch;

/// Columns of a truth of several touches, or of some that push aside.
const MORE: &str = ",fx_n,fy_n,fz_n,touches";

/// What really happens, as a table. What goes wrong with it is told to `failed`, once.
pub(super) struct TruthFile {
    file: BufWriter<File>,
    /// Whether there is more to say than one touch that presses straight in.
    says_more: bool,
    failed: Option<Sender<std::io::Error>>,
}

impl TruthFile {
    /// Begins the table.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(
        path: &Path,
        says_more: bool,
        failed: Sender<std::io::Error>,
    ) -> anyhow::Result<Self> {
        let more = if says_more { MORE } else { "" };
        let begin = || {
            let mut file = BufWriter::new(File::create(path)?);
            writeln!(file, "t_us,x_mm,y_mm,z_mm,force_n{more}")?;
            file.flush()?;
            Ok::<_, std::io::Error>(file)
        };
        let file = begin()
            .with_context(|| format!("{}: the truth cannot be written there", path.display()))?;
        Ok(Self {
            file,
            says_more,
            failed: Some(failed),
        })
    }

    /// Adds a row.
    pub fn write(&mut self, truth: &Truth) {
        let mut line = match truth.touch {
            Some(Touch {
                position, force, ..
            }) => {
                let p = position * 1e3;
                format!(
                    "{},{:.4},{:.4},{:.4},{force:.5}",
                    truth.time_us, p.x, p.y, p.z
                )
            }
            None => format!("{},,,,", truth.time_us),
        };
        if self.says_more {
            let all = truth.force;
            let more = match truth.touches {
                0 => ",,,,0".to_owned(),
                touches => format!(",{:.5},{:.5},{:.5},{touches}", all.x, all.y, all.z),
            };
            line.push_str(&more);
        }
        let written = writeln!(self.file, "{line}");
        self.note(written);
        if truth.time_us % 100_000 < 1000 {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let flushed = self.file.flush();
        self.note(flushed);
    }

    fn note(&mut self, outcome: std::io::Result<()>) {
        if let Err(error) = outcome
            && let Some(failed) = self.failed.take()
        {
            // Who no longer listens is about to end anyway.
            let _ = failed.send(error);
        }
    }
}

impl Drop for TruthFile {
    fn drop(&mut self) {
        self.flush();
    }
}

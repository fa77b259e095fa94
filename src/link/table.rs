//! What a board sent, or a recording holds, as a table.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::Context as _;

use crate::inference::SeveralTouches;
use crate::live::{LiveUpdate, Sample};

/// A table of samples, with the truth where a simulated board has told it. Each file has as many columns in every
/// row: one for each number of channels.
pub struct SampleTable {
    /// The last one is being written.
    pub(super) paths: Vec<PathBuf>,
    file: BufWriter<File>,
    /// Where the board is really touched (m, N), where it tells.
    pub truth: Option<(glam::DVec3, f64)>,
    channels: Option<usize>,
}

impl SampleTable {
    /// Begins a table; never over an older one.
    ///
    /// # Errors
    /// When there is one already, or it cannot be written there.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        // An empty file holds nothing that could be lost, and a pipe or a device is no table.
        let old = std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() > 0);
        anyhow::ensure!(
            !old,
            "{}: there is a file of this name already. Choose another, or remove it",
            path.display()
        );
        Self::replace(path)
    }

    /// Begins a table in place of what may stand there.
    pub(super) fn replace(path: &Path) -> anyhow::Result<Self> {
        let file = File::create(path)
            .with_context(|| format!("{}: the table cannot be written there", path.display()))?;
        Ok(Self {
            paths: vec![path.to_owned()],
            file: BufWriter::new(file),
            truth: None,
            channels: None,
        })
    }

    fn path(&self) -> &Path {
        self.paths.last().map_or(Path::new(""), PathBuf::as_path)
    }

    fn unwritten(&self) -> String {
        let path = self.path().display();
        format!("{path}: the table ends here, because it can be written no more")
    }

    /// Takes a sample in; the file that the table goes on in where the number of channels has changed.
    ///
    /// # Errors
    /// When it can be written no more.
    pub fn take(
        &mut self,
        sample: &Sample,
        update: &LiveUpdate,
    ) -> anyhow::Result<Option<PathBuf>> {
        let channels = sample.counts.len();
        let before = self.channels.replace(channels);
        let moved = before.is_some_and(|b| b != channels);
        if moved {
            self.go_on(channels)?;
        }
        let head = if before == Some(channels) {
            Ok(())
        } else {
            self.head(channels)
        };
        head.and_then(|()| self.row(sample, update))
            .with_context(|| self.unwritten())?;
        Ok(moved.then(|| self.path().to_owned()))
    }

    /// Another file beside the first, never over an older one.
    fn go_on(&mut self, channels: usize) -> anyhow::Result<()> {
        /// A board that changes its mind more often is ill.
        const MOST: usize = 99;
        self.flush()?;
        let first = self.paths[0].clone();
        let ordinary = self.file.get_ref().metadata().is_ok_and(|m| m.is_file());
        anyhow::ensure!(
            ordinary && self.paths.len() < MOST,
            "{}: the board has {channels} channels now, and the rows of a table are all alike: it ends here. Listen again for another table",
            self.path().display()
        );
        let (path, file) = another(&first)?;
        self.file = BufWriter::new(file);
        self.paths.push(path);
        Ok(())
    }

    /// Writes what waits.
    ///
    /// # Errors
    /// When it can be written no more.
    pub fn flush(&mut self) -> anyhow::Result<()> {
        let flushed = self.file.flush();
        flushed.with_context(|| self.unwritten())
    }

    /// All is written: what it went on in gets the names beside the table's that are free, and then the table its own, in
    /// place of an older one. The files; where one cannot be named, none is.
    pub(super) fn name(&mut self, table: &Path) -> anyhow::Result<Vec<PathBuf>> {
        self.flush()?;
        let mut names = vec![table.to_owned()];
        let named = self.name_each(table, &mut names);
        if named.is_err() {
            for name in &names[1..] {
                let _ = std::fs::remove_file(name);
            }
        }
        named.map(|()| names)
    }

    fn name_each(&self, table: &Path, names: &mut Vec<PathBuf>) -> anyhow::Result<()> {
        for path in &self.paths[1..] {
            names.push(another(table)?.0);
            std::fs::rename(path, &names[names.len() - 1])?;
        }
        Ok(std::fs::rename(&self.paths[0], table)?)
    }

    /// What was begun, and has no name yet, is not wanted.
    pub(super) fn discard(self) {
        for path in &self.paths {
            let _ = std::fs::remove_file(path);
        }
    }

    fn head(&mut self, channels: usize) -> std::io::Result<()> {
        write!(self.file, "t_us")?;
        for k in 0..channels {
            write!(self.file, ",count_{k}")?;
        }
        writeln!(
            self.file,
            ",x_mm,y_mm,z_mm,force_n,fx_n,fy_n,fz_n,uncertainty_mm,channels_ok,touches,true_x_mm,true_y_mm,true_z_mm,true_force_n"
        )
    }

    fn row(&mut self, sample: &Sample, update: &LiveUpdate) -> std::io::Result<()> {
        write!(self.file, "{}", sample.time_us)?;
        for count in &sample.counts {
            write!(self.file, ",{count}")?;
        }
        match update.contact {
            Some(c) => {
                let (p, f) = (c.position * 1e3, c.on_part());
                write!(
                    self.file,
                    ",{:.3},{:.3},{:.3},{:.4},{:.4},{:.4},{:.4},{:.3}",
                    p.x,
                    p.y,
                    p.z,
                    c.force,
                    f.x,
                    f.y,
                    f.z,
                    c.region.radius * 1e3
                )?;
            }
            None => write!(self.file, ",,,,,,,,")?,
        }
        // How many touch; empty where that is not clear.
        let touching = update
            .touches
            .as_ref()
            .map_or(Some(0), SeveralTouches::count);
        let touching = touching.map_or(String::new(), |count| count.to_string());
        write!(self.file, ",{},{touching}", update.good)?;
        match self.truth {
            Some((p, force)) => {
                let p = p * 1e3;
                writeln!(self.file, ",{:.3},{:.3},{:.3},{force:.4}", p.x, p.y, p.z)
            }
            None => writeln!(self.file, ",,,,"),
        }
    }
}

/// The first file after this one that is not there yet.
fn another(first: &Path) -> anyhow::Result<(PathBuf, File)> {
    let mut number = 2;
    loop {
        let path = numbered(first, number);
        match File::create_new(&path) {
            Ok(file) => return Ok((path, file)),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(e) => {
                let what = format!("{}: the table cannot go on there", path.display());
                return Err(anyhow::Error::new(e).context(what));
            }
        }
    }
}

/// `touches.csv`, `touches-2.csv`, …
fn numbered(first: &Path, number: usize) -> PathBuf {
    let mut name = first.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(ending) = first.extension() {
        name.push(".");
        name.push(ending);
    }
    first.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_us: u64, channels: usize) -> (Sample, LiveUpdate) {
        let counts = vec![7.0; channels];
        let update = LiveUpdate::nothing(time_us);
        (Sample { time_us, counts }, update)
    }

    /// Rows never stand under a head of another number of channels, and no file is written over.
    #[test]
    fn a_table_goes_on_in_another_file_where_the_channels_change() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a-2.csv"), "older").unwrap();
        let mut table = SampleTable::create(&at("a.csv")).unwrap();
        let mut moved = Vec::new();
        for (time, channels) in [(1, 2), (2, 2), (3, 4), (4, 4), (5, 2)] {
            let (sample, update) = sample(time, channels);
            moved.push(table.take(&sample, &update).unwrap());
        }
        table.flush().unwrap();
        let next = [None, None, Some(at("a-3.csv")), None, Some(at("a-4.csv"))];
        assert_eq!(moved, next);
        for (name, rows) in [("a.csv", 3), ("a-3.csv", 3), ("a-4.csv", 2)] {
            let text = std::fs::read_to_string(at(name)).unwrap();
            let columns: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
            assert_eq!(columns.len(), rows, "{text}");
            assert!(columns.iter().all(|c| *c == columns[0]), "{text}");
        }
        assert_eq!(std::fs::read_to_string(at("a-2.csv")).unwrap(), "older");
    }

    #[test]
    fn a_table_is_never_begun_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "").unwrap();
        drop(SampleTable::create(&path).unwrap());
        std::fs::write(&path, "older").unwrap();
        let said = SampleTable::create(&path).err().unwrap().to_string();
        assert!(said.contains("a.csv") && said.contains("already"), "{said}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "older");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_table_on_a_full_disk_says_so() {
        let mut table = SampleTable::create(Path::new("/dev/full")).unwrap();
        let (first, update) = sample(1, 2);
        table.take(&first, &update).unwrap();
        let said = format!("{:#}", table.flush().unwrap_err());
        assert!(
            said.contains("/dev/full") && said.contains("space"),
            "{said}"
        );
    }
}

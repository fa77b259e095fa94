//! Arrays in NPZ: written with the same bytes every time (no time stamps, a fixed order), read from anywhere.

use std::fmt::Display;
use std::fs::File;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use npyz::WriterBuilder;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use super::npy::{self, Array};
use super::{FileError, atomic, source};
use crate::memory;
use crate::plain::{self, quote};

/// An NPZ file being put together.
pub struct NpzFile {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl Default for NpzFile {
    fn default() -> Self {
        Self {
            zip: ZipWriter::new(Cursor::new(Vec::new())),
        }
    }
}

impl NpzFile {
    /// Adds an array in C order.
    ///
    /// # Errors
    /// What the writer reports; a shape that does not fit the values among it.
    pub fn add<T: npyz::AutoSerialize + Copy>(
        &mut self,
        name: &str,
        shape: &[usize],
        values: &[T],
    ) -> std::io::Result<()> {
        let mut bytes = Vec::with_capacity(size_of_val(values) + 128);
        let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&shape)
            .writer(&mut bytes)
            .begin_nd()?;
        writer.extend(values.iter().copied())?;
        writer.finish()?;
        self.entry(name, &bytes)
    }

    /// Adds a text, as a `NumPy` string without dimensions.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn add_text(&mut self, name: &str, text: &str) -> std::io::Result<()> {
        let characters = text.chars().count().max(1);
        let kind = format!("<U{characters}")
            .parse::<npyz::TypeStr>()
            .map_err(std::io::Error::other)?;
        let mut bytes = Vec::new();
        let mut writer = npyz::WriteOptions::new()
            .dtype(npyz::DType::Plain(kind))
            .shape(&[])
            .writer(&mut bytes)
            .begin_nd()?;
        writer.push(text)?;
        writer.finish()?;
        self.entry(name, &bytes)
    }

    fn entry(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(bytes.len() >= u32::MAX as usize);
        self.zip.start_file(format!("{name}.npy"), options)?;
        self.zip.write_all(bytes)
    }

    /// The finished bytes.
    ///
    /// # Errors
    /// What the writer reports.
    pub fn finish(self) -> std::io::Result<Vec<u8>> {
        Ok(self.zip.finish()?.into_inner())
    }

    /// Writes the file atomically.
    ///
    /// # Errors
    /// [`FileError`] naming the file.
    pub fn save(self, path: &Path) -> Result<(), FileError> {
        let bytes = self.finish().map_err(|e| FileError::of(path, &e))?;
        atomic::write(path, &bytes)
    }
}

/// The arrays of an NPZ file from anywhere.
pub struct Arrays {
    path: PathBuf,
    archive: ZipArchive<File>,
}

impl Arrays {
    /// Opens a file and reads its list of arrays.
    ///
    /// # Errors
    /// [`FileError`] for what is no ordinary file, is larger than memory, or is no NPZ.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let cure = "it may be cut off, or a single array (NPY). Write it with numpy.savez";
        Self::open_as(path, ("NPZ file", cure))
    }

    /// The same, of a file that people know by another name, with what may be wrong with it.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_as(path: &Path, (kind, cure): (&str, &str)) -> Result<Self, FileError> {
        let length = source::ordinary(path)?.len();
        if length as f64 > memory::allowed() {
            return Err(FileError::broken(
                path,
                format!(
                    "the file has {}, and {} of memory may be used. Save fewer arrays in it, or allow more with --memory-gb",
                    plain::needed(length as f64),
                    plain::allowed(memory::allowed())
                ),
            ));
        }
        let file = File::open(path).map_err(|e| FileError::of(path, &e))?;
        let archive = ZipArchive::new(file).map_err(|e| {
            FileError::broken(path, format!("this is not a readable {kind} ({e}): {cure}"))
        })?;
        Ok(Self {
            path: path.to_owned(),
            archive,
        })
    }

    /// Whether there is an array of this name.
    #[must_use]
    pub fn holds(&self, name: &str) -> bool {
        self.archive.index_for_name(&member(name)).is_some()
    }

    /// Reads one array of numbers by name: of any type, byte order and order of rows and columns.
    ///
    /// # Errors
    /// [`FileError`] naming the file and the array.
    pub fn numbers(&mut self, name: &str) -> Result<Array, FileError> {
        let Some(index) = self.archive.index_for_name(&member(name)) else {
            return Err(self.missing(name));
        };
        let unreadable = |what: &dyn Display| {
            FileError::broken(
                &self.path,
                format!("the array {} cannot be read: {what}", quote(name)),
            )
        };
        let method = self.archive.by_index_raw(index).map(|m| m.compression());
        let method = method.map_err(|e| unreadable(&e))?;
        if !matches!(
            method,
            CompressionMethod::Stored | CompressionMethod::Deflated
        ) {
            let what = "it is compressed in a way that is not read here. Write it with numpy.savez or numpy.savez_compressed";
            return Err(unreadable(&what));
        }
        let bytes = self.archive.by_index(index);
        let bytes = bytes.map_err(|e| unreadable(&e))?;
        npy::read(bytes).map_err(|e| unreadable(&e))
    }

    fn missing(&self, name: &str) -> FileError {
        let others: Vec<String> = self
            .archive
            .file_names()
            .filter_map(Result::ok)
            .take(12)
            .map(|n| quote(n.trim_end_matches(".npy")))
            .collect();
        let others = if others.is_empty() {
            "nothing".to_owned()
        } else {
            others.join(", ")
        };
        FileError::broken(
            &self.path,
            format!(
                "there is no array {} in it, but {others}. Save the array under that name",
                quote(name)
            ),
        )
    }
}

fn member(name: &str) -> String {
    format!("{name}.npy")
}

/// Whether the file has an array of this name.
///
/// # Errors
/// [`FileError`] when it is no readable archive.
pub fn holds(path: &Path, name: &str) -> Result<bool, FileError> {
    Ok(Arrays::open(path)?.holds(name))
}

/// Reads one mask by name: an array of booleans, or of zeros and ones of any type.
///
/// # Errors
/// [`FileError`] naming the file and the mask.
pub fn read_mask(path: &Path, name: &str) -> Result<Vec<bool>, FileError> {
    let values = Arrays::open(path)?.numbers(name)?.values;
    if let Some(at) = values.iter().position(|&v| v != 0.0 && v != 1.0) {
        return Err(FileError::broken(
            path,
            format!(
                "the mask {} is {} at vertex {at}: a mask has 1 where it is painted and 0 elsewhere. Paint it again",
                quote(name),
                values[at]
            ),
        ));
    }
    Ok(values.into_iter().map(|v| v == 1.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_arrays_give_the_same_bytes_and_come_back() {
        let build = || {
            let mut file = NpzFile::default();
            file.add("x", &[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
                .unwrap();
            file.add("mask", &[3], &[true, false, true]).unwrap();
            file.add_text("signal", "strain").unwrap();
            file.finish().unwrap()
        };
        assert_eq!(build(), build());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        std::fs::write(&path, build()).unwrap();
        assert_eq!(read_mask(&path, "mask").unwrap(), [true, false, true]);
        assert!(
            read_mask(&path, "other")
                .unwrap_err()
                .to_string()
                .contains("other")
        );
    }
}

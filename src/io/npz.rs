//! Arrays in NPZ, the same bytes every time: no time stamps, a fixed order.

use std::io::{Cursor, Read, Write};
use std::path::Path;

use npyz::WriterBuilder;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use super::{FileError, atomic};

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

/// Whether the file has an array of this name.
///
/// # Errors
/// [`FileError`] when it is no readable archive.
pub fn holds(path: &Path, name: &str) -> Result<bool, FileError> {
    let file = std::fs::File::open(path).map_err(|e| FileError::of(path, &e))?;
    let archive = ZipArchive::new(file)
        .map_err(|e| FileError::broken(path, format!("this is not a readable NPZ file ({e})")))?;
    Ok(archive.index_for_name(&format!("{name}.npy")).is_some())
}

/// Reads one array of numbers by name: its shape, and its values by rows whatever their order in the
/// file.
///
/// # Errors
/// [`FileError`] naming the file and the array.
pub fn read_numbers(path: &Path, name: &str) -> Result<(Vec<usize>, Vec<f64>), FileError> {
    let broken = |e: &dyn std::fmt::Display| {
        FileError::broken(path, format!("the array \"{name}\" cannot be read ({e})"))
    };
    if !holds(path, name)? {
        return Err(FileError::broken(
            path,
            format!("there is no array \"{name}\" in it"),
        ));
    }
    let bytes = entry(path, name, &broken)?;
    let header = npyz::NpyFile::new(&bytes[..]).map_err(|e| broken(&e))?;
    let shape: Vec<usize> = header.shape().iter().map(|&n| n as usize).collect();
    let fortran = header.order() == npyz::Order::Fortran;
    let array = || npyz::NpyFile::new(&bytes[..]);
    let read = || -> std::io::Result<Vec<f64>> {
        if let Ok(values) = array()?.into_vec::<f64>() {
            return Ok(values);
        }
        if let Ok(values) = array()?.into_vec::<f32>() {
            return Ok(values.into_iter().map(f64::from).collect());
        }
        if let Ok(values) = array()?.into_vec::<i32>() {
            return Ok(values.into_iter().map(f64::from).collect());
        }
        let values = array()?.into_vec::<i64>()?;
        Ok(values.into_iter().map(|v| v as f64).collect())
    };
    let values = read().map_err(|e| broken(&e))?;
    if values.len() != shape.iter().product::<usize>() {
        return Err(broken(&"it ends too early"));
    }
    let values = match shape[..] {
        [rows, columns] if fortran => (0..rows)
            .flat_map(|r| (0..columns).map(move |c| c * rows + r))
            .map(|k| values[k])
            .collect(),
        _ => values,
    };
    Ok((shape, values))
}

/// Reads one array of bytes or booleans by name.
///
/// # Errors
/// [`FileError`] naming the file and the array.
pub fn read_mask(path: &Path, name: &str) -> Result<Vec<bool>, FileError> {
    let broken = |e: &dyn std::fmt::Display| {
        FileError::broken(
            path,
            format!("the mask \"{name}\" cannot be read ({e}). Paint it again"),
        )
    };
    let bytes = entry(path, name, &broken)?;
    let array = npyz::NpyFile::new(&bytes[..]).map_err(|e| broken(&e))?;
    array.into_vec::<bool>().map_err(|e| broken(&e))
}

/// The bytes of one array, as NPY; `broken` says what it means that they cannot be read.
fn entry(
    path: &Path,
    name: &str,
    broken: &dyn Fn(&dyn std::fmt::Display) -> FileError,
) -> Result<Vec<u8>, FileError> {
    let file = std::fs::File::open(path).map_err(|e| FileError::of(path, &e))?;
    let mut archive = ZipArchive::new(file).map_err(|e| broken(&e))?;
    let mut bytes = Vec::new();
    archive
        .by_name(&format!("{name}.npy"))
        .map_err(|e| broken(&e))?
        .read_to_end(&mut bytes)
        .map_err(|e| broken(&e))?;
    Ok(bytes)
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

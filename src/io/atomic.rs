//! Writing a file so that it is either the old one or the new one, whatever happens in between.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::FileError;

/// Writes aside, syncs, and renames over the target.
///
/// # Errors
/// [`FileError`] naming the target; the old file is then untouched.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let aside = beside(path, "part");
    let attempt = || -> std::io::Result<()> {
        let mut file = File::create(&aside)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&aside, path)?;
        sync_folder(path)
    };
    attempt().map_err(|e| {
        // Best effort: the error that matters is the one above.
        let _ = fs::remove_file(&aside);
        match e.kind() {
            std::io::ErrorKind::NotFound => FileError::broken(
                path,
                "its folder does not exist. Create it or choose another",
            ),
            _ => FileError::of(path, &e),
        }
    })
}

/// As [`write`], keeping what was there before as `NAME.bak`.
///
/// # Errors
/// As [`write`].
pub fn write_with_backup(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    if path.exists() {
        let backup = beside(path, "bak");
        fs::copy(path, &backup).map_err(|e| FileError::of(&backup, &e))?;
    }
    write(path, bytes)
}

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".");
    name.push(ending);
    path.with_file_name(name)
}

/// A rename is only safe on disk once its folder is.
fn sync_folder(path: &Path) -> std::io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_old_file_stays_as_backup() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        write_with_backup(&path, b"one").unwrap();
        write_with_backup(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read(folder.path().join("a.toml.bak")).unwrap(), b"one");
        assert!(!folder.path().join("a.toml.part").exists());
        assert!(write(&folder.path().join("no/such/folder"), b"x").is_err());
    }
}

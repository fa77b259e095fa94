//! Whether results could be written in the end, asked before anything is computed.

use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;

use super::FileError;

/// Refuses a path that a file could not be put at: a folder, a device or a pipe lies there, or its folder is missing or
/// may not be written in.
///
/// # Errors
/// [`FileError`] naming the path and what to do.
pub fn file(path: &Path) -> Result<(), FileError> {
    ordinary(path)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    if !folder.exists() {
        return Err(FileError::broken(
            path,
            "its folder does not exist. Create it or choose another",
        ));
    }
    try_in(folder).map_err(|error| FileError::of(path, &error))
}

/// Refuses a folder that nothing can be written in.
///
/// # Errors
/// As [`file()`].
pub fn folder(path: &Path) -> Result<(), FileError> {
    try_in(path).map_err(|error| match error.kind() {
        ErrorKind::NotADirectory => FileError::broken(path, "this is a file. Choose another name"),
        _ => FileError::of(path, &error),
    })
}

/// Refuses a path where something lies that a file may not take the place of.
///
/// # Errors
/// As [`file()`].
pub(super) fn ordinary(path: &Path) -> Result<(), FileError> {
    let Ok(there) = path.metadata() else {
        return Ok(());
    };
    if there.is_file() {
        return Ok(());
    }
    let what = if there.is_dir() {
        "this is a folder. Choose another name"
    } else {
        "this is a device or a pipe, which a file would take the place of. Choose another name"
    };
    Err(FileError::broken(path, what))
}

/// Makes a file in a folder and takes it away again.
fn try_in(folder: &Path) -> std::io::Result<()> {
    let name = format!(
        ".hapdef-{}-{:?}",
        std::process::id(),
        std::thread::current().id()
    );
    let path = folder.join(name);
    File::create(&path)?;
    std::fs::remove_file(&path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_can_be_written_leaves_no_trace() {
        let here = tempfile::tempdir().unwrap();
        file(&here.path().join("new.csv")).unwrap();
        folder(here.path()).unwrap();
        assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 0);
        let old = here.path().join("old.csv");
        std::fs::write(&old, "1").unwrap();
        file(&old).unwrap();
        assert_eq!(std::fs::read_to_string(old).unwrap(), "1");
    }

    #[test]
    fn what_cannot_be_written_is_refused_with_what_to_do() {
        let here = tempfile::tempdir().unwrap();
        let said = |path: &Path| file(path).unwrap_err().to_string();
        assert!(said(here.path()).contains("this is a folder. Choose"));
        let gone = here.path().join("gone/new.csv");
        assert!(
            said(&gone).contains("its folder does not exist"),
            "{}",
            said(&gone)
        );
        let old = here.path().join("old.csv");
        std::fs::write(&old, "1").unwrap();
        let refused = folder(&old).unwrap_err().to_string();
        assert!(refused.contains("this is a file"), "{refused}");
    }

    #[cfg(unix)]
    #[test]
    fn no_file_takes_the_place_of_a_pipe() {
        let here = tempfile::tempdir().unwrap();
        let pipe = here.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
        assert!(
            file(&pipe)
                .unwrap_err()
                .to_string()
                .contains("a device or a pipe")
        );
        assert!(super::super::atomic::write(&pipe, b"1").is_err());
        assert!(!pipe.metadata().unwrap().is_file());
    }
}

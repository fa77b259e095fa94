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
        step();
        let mut file = File::create(&aside)?;
        step();
        // In two parts, so that a test can end the program in the middle of it.
        let (first, second) = bytes.split_at(bytes.len() / 2);
        file.write_all(first)?;
        step();
        file.write_all(second)?;
        step();
        file.sync_all()?;
        step();
        fs::rename(&aside, path)?;
        step();
        sync_folder(path)?;
        step();
        Ok(())
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

/// A moment at which a test may kill the program.
#[cfg(not(test))]
fn step() {}

#[cfg(test)]
use tests::step;

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
pub(super) mod tests {
    use std::cell::Cell;
    use std::process::Command;

    use super::*;

    /// Set for a program that is to die: at which step, and while writing where.
    pub const DIE_AT: &str = "HAPDEF_TEST_DIE_AT";
    const DIE_WRITING: &str = "HAPDEF_TEST_DIE_WRITING";
    pub const STEPS: u32 = 7;

    thread_local! {
        static STEP: Cell<u32> = const { Cell::new(0) };
    }

    pub fn step() {
        STEP.set(STEP.get() + 1);
        if std::env::var(DIE_AT).is_ok_and(|at| at == STEP.get().to_string()) {
            std::process::abort();
        }
    }

    /// What the program that is killed does; nothing in an ordinary run of the tests.
    #[test]
    fn written_until_killed() {
        if let Some(path) = std::env::var_os(DIE_WRITING) {
            write(Path::new(&path), &b"new".repeat(100_000)).unwrap();
        }
    }

    #[test]
    fn killed_at_any_step_the_file_is_the_old_one_or_the_new_one() {
        let (old, new) = (b"old".repeat(7), b"new".repeat(100_000));
        let mut seen = Vec::new();
        for at in 1..=STEPS {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.toml");
            fs::write(&path, &old).unwrap();
            let died = Command::new(std::env::current_exe().unwrap())
                .args(["--exact", "io::atomic::tests::written_until_killed"])
                .env(DIE_AT, at.to_string())
                .env(DIE_WRITING, &path)
                .output()
                .unwrap();
            assert!(!died.status.success(), "step {at} was not reached");
            let found = fs::read(&path).unwrap();
            assert!(found == old || found == new, "step {at}: {}", found.len());
            seen.push(found == new);
            // What the dead left behind is in nobody's way.
            write(&path, b"next").unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"next");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
        assert_eq!(seen, [false, false, false, false, false, true, true]);
    }

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

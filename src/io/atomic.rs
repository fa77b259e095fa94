//! Writing a file so that it is either the old one or the new one, whatever happens in between.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{FileError, outlet};

/// Writes aside, syncs, and renames over the target. Two that write the same file do it one after the other.
///
/// # Errors
/// [`FileError`] naming the target; the old file is then untouched.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    outlet::ordinary(path)?;
    attempt(path, bytes).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => FileError::broken(
            path,
            "its folder does not exist. Create it or choose another",
        ),
        _ => FileError::of(path, &e),
    })
}

fn attempt(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let aside = beside(path, "part");
    step();
    let mut file = alone(&aside)?;
    step();
    let written = fill(&mut file, bytes).and_then(|()| fs::rename(&aside, path));
    if written.is_err() {
        // Best effort, and while it is ours: the error that matters is the other one.
        let _ = fs::remove_file(&aside);
    }
    written?;
    step();
    sync_folder(path)?;
    step();
    Ok(())
}

/// The file aside, empty, for one program alone. Whoever writes the same file at the same moment waits for it, and
/// then finds its name gone, because it was renamed: the next file of that name is his.
fn alone(aside: &Path) -> std::io::Result<File> {
    loop {
        let open = File::options()
            .write(true)
            .create(true)
            .truncate(false)
            .open(aside)?;
        // Where files cannot be locked nobody is waited for.
        let _ = open.lock();
        if is_named(&open, aside)? {
            open.set_len(0)?;
            return Ok(open);
        }
    }
}

/// Whether an open file still has its name.
#[cfg(unix)]
fn is_named(file: &File, path: &Path) -> std::io::Result<bool> {
    use std::os::unix::fs::MetadataExt as _;
    let own = file.metadata()?;
    match fs::metadata(path) {
        Ok(named) => Ok((named.dev(), named.ino()) == (own.dev(), own.ino())),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(e) => Err(e),
    }
}

#[cfg(not(unix))]
#[allow(clippy::unnecessary_wraps, reason = "elsewhere it may fail")]
fn is_named(_file: &File, _path: &Path) -> std::io::Result<bool> {
    Ok(true)
}

fn fill(file: &mut File, bytes: &[u8]) -> std::io::Result<()> {
    // In two parts, so that a test can end the program in the middle of it.
    let (first, second) = bytes.split_at(bytes.len() / 2);
    file.write_all(first)?;
    step();
    file.write_all(second)?;
    step();
    file.sync_all()?;
    step();
    Ok(())
}

/// As [`write()`], keeping what was there before as `NAME.bak`.
///
/// # Errors
/// As [`write()`].
pub fn write_with_backup(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    if path.exists() {
        let backup = beside(path, "bak");
        fs::copy(path, &backup).map_err(|e| FileError::of(&backup, &e))?;
    }
    write(path, bytes)
}

/// A moment at which a test may kill the program.
#[cfg(not(test))]
pub(super) fn step() {}

#[cfg(test)]
pub(super) use tests::step;

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".");
    name.push(ending);
    path.with_file_name(name)
}

/// A rename is only safe on disk once its folder is.
pub(super) fn sync_folder(path: &Path) -> std::io::Result<()> {
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
        /// The step at which what this thread does ends.
        static END_AT: Cell<Option<u32>> = const { Cell::new(None) };
    }

    /// Does something up to a step, as if it was killed there, and whether it came so far: for what leaves nothing
    /// to destructors that a killed program would not.
    pub fn killed_at(step: u32, work: impl FnOnce()) -> bool {
        STEP.set(0);
        END_AT.set(Some(step));
        let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
        END_AT.set(None);
        match ended {
            Ok(()) => false,
            Err(reason) if reason.is::<Killed>() => true,
            Err(reason) => std::panic::resume_unwind(reason),
        }
    }

    struct Killed;

    pub fn step() {
        STEP.set(STEP.get() + 1);
        if END_AT.get() == Some(STEP.get()) {
            // Without a word: nothing has gone wrong.
            std::panic::resume_unwind(Box::new(Killed));
        }
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
    fn many_that_write_one_file_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let texts = [b'a', b'b', b'c', b'd'].map(|letter| vec![letter; 5000]);
        std::thread::scope(|scope| {
            for text in &texts {
                let path = &path;
                scope.spawn(move || (0..8).for_each(|_| write(path, text).unwrap()));
            }
        });
        assert!(texts.contains(&fs::read(&path).unwrap()));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
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

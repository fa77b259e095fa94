//! Files of a folder that belong together. However it is interrupted, the folder holds all of the old ones or all of
//! the new ones, or shows that it does not and is put right by whoever writes there next.
//!
//! New files are written into a folder inside it. Once all are there, renaming that one is the moment from which they
//! hold; then they take their places one by one. As long as one is on its way, the folder that it waits in is there to
//! be seen. Files of other names are never touched.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::FileError;
use super::atomic::{step, sync_folder};

/// Where new files are written: nothing in it counts yet.
const BEGUN: &str = ".new-files.part";
/// Where they wait once all are there. Its name is for those who find it, after an interruption.
const READY: &str = "new-files-not-yet-in-place";

/// A folder that nobody else writes files into that belong together.
pub struct Together {
    folder: PathBuf,
    /// On the folder itself: nothing lies about afterwards, and the system lets go of it however the program ends.
    _lock: Option<File>,
}

impl Together {
    /// Claims a folder as long as this lives, and puts right what an interruption left there.
    ///
    /// # Errors
    /// [`FileError`] when another program has claimed it, or when what was left cannot be put right.
    pub fn claim(folder: &Path) -> Result<Self, FileError> {
        let claimed = Self {
            folder: folder.to_owned(),
            _lock: locked(folder)?,
        };
        claimed.finish()?;
        Ok(claimed)
    }

    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Has `write` put new files into the folder that it is given, and then all of them into the places of the old.
    ///
    /// # Errors
    /// What `write` reports: the old files are then untouched. [`FileError`] when a new one cannot take its place.
    pub fn replace(
        &self,
        write: impl FnOnce(&Path) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        self.finish()?;
        let begun = self.folder.join(BEGUN);
        let prepared = self
            .begin(&begun)
            .and_then(|()| write(&begun))
            .and_then(|()| self.check_places(&begun));
        if let Err(error) = prepared {
            // Best effort: the error that matters is the other one.
            let _ = fs::remove_dir_all(&begun);
            return Err(self.in_place(error));
        }
        let ready = self.folder.join(READY);
        fs::rename(&begun, &ready)
            .and_then(|()| sync_folder(&ready))
            .map_err(|e| FileError::of(&ready, &e))?;
        step();
        self.finish()
    }

    /// An empty folder for new files: one that is there was left by a run that was interrupted before they held.
    fn begin(&self, begun: &Path) -> Result<(), FileError> {
        let cleared = match fs::remove_dir_all(begun) {
            Err(e) if e.kind() != ErrorKind::NotFound => Err(e),
            _ => Ok(()),
        };
        cleared
            .and_then(|()| fs::create_dir(begun))
            .map_err(|e| FileError::of(&self.folder, &e))?;
        step();
        Ok(())
    }

    /// Whether every new file can take its place: from the moment they hold it is too late to ask.
    fn check_places(&self, begun: &Path) -> Result<(), FileError> {
        for name in names(begun).map_err(|e| FileError::of(begun, &e))? {
            let (new, place) = (begun.join(&name), self.folder.join(&name));
            if !new.is_dir() {
                is_no_folder(&place)?;
                continue;
            }
            if place.exists() && !place.is_dir() {
                return Err(FileError::broken(
                    &place,
                    "a folder is to be made here, but this is a file. Move it away, or choose another folder",
                ));
            }
            for inner in names(&new).map_err(|e| FileError::of(&new, &e))? {
                is_no_folder(&place.join(inner))?;
            }
        }
        Ok(())
    }

    /// Puts every file that waits into its place.
    fn finish(&self) -> Result<(), FileError> {
        let ready = self.folder.join(READY);
        let waiting = match names(&ready) {
            Ok(names) => names,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
            Err(e) => return Err(FileError::of(&ready, &e)),
        };
        for name in waiting {
            let (new, place) = (ready.join(&name), self.folder.join(&name));
            if new.is_dir() {
                put_all(&new, &place)?;
            } else {
                fs::rename(new, &place).map_err(|e| FileError::of(&place, &e))?;
            }
            step();
        }
        // What waited must be in its place for good before nothing tells of it any more.
        sync_folder(&ready)
            .and_then(|()| fs::remove_dir(&ready))
            .map_err(|e| FileError::of(&ready, &e))?;
        step();
        Ok(())
    }

    /// An error about a new file, as one about the place that it is for.
    fn in_place(&self, error: FileError) -> FileError {
        let begun = self.folder.join(BEGUN);
        let place = |path: PathBuf| match path.strip_prefix(&begun) {
            Ok(name) => self.folder.join(name),
            Err(_) => path,
        };
        match error {
            FileError::Missing { path } => FileError::Missing { path: place(path) },
            FileError::Broken { path, message } => FileError::Broken {
                path: place(path),
                message,
            },
        }
    }
}

/// Refuses a place for a file where a folder is.
fn is_no_folder(place: &Path) -> Result<(), FileError> {
    if place.is_dir() {
        return Err(FileError::broken(
            place,
            "a file is to be written here, but this is a folder. Move it away, or choose another folder",
        ));
    }
    Ok(())
}

/// Puts every file of a folder that waits into a folder beside the others, where others may lie already.
fn put_all(ready: &Path, folder: &Path) -> Result<(), FileError> {
    fs::create_dir_all(folder).map_err(|e| FileError::of(folder, &e))?;
    for name in names(ready).map_err(|e| FileError::of(ready, &e))? {
        let place = folder.join(&name);
        fs::rename(ready.join(&name), &place).map_err(|e| FileError::of(&place, &e))?;
        step();
    }
    sync_folder(folder)
        .and_then(|()| fs::remove_dir(ready))
        .map_err(|e| FileError::of(ready, &e))
}

/// The folder locked for this program; unlocked where a system or a network drive cannot lock folders.
fn locked(folder: &Path) -> Result<Option<File>, FileError> {
    /// A program that is just being started holds, for a moment, what this one holds.
    const TRIES: u32 = 10;
    const APART: Duration = Duration::from_millis(20);
    let Ok(file) = File::open(folder) else {
        return Ok(None);
    };
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::Error(_)) => return Ok(None),
            Err(TryLockError::WouldBlock) => std::thread::sleep(APART),
        }
    }
    Err(FileError::broken(
        folder,
        "another hapdef is writing into this folder. Wait until it has ended, or choose another folder",
    ))
}

/// Names of the files in a folder, always in the same order.
fn names(folder: &Path) -> std::io::Result<Vec<OsString>> {
    let entries: std::io::Result<Vec<OsString>> = fs::read_dir(folder)?
        .map(|entry| entry.map(|e| e.file_name()))
        .collect();
    let mut names = entries?;
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::super::atomic;
    use super::super::atomic::tests::killed_at;
    use super::*;

    const NAMES: [&str; 4] = ["a.csv", "b.json", "c.html", "pieces/d.stl"];

    fn put(folder: &Path, text: &str) -> Result<(), FileError> {
        Together::claim(folder)?.replace(|new| {
            fs::create_dir_all(new.join("pieces")).unwrap();
            NAMES
                .iter()
                .try_for_each(|name| atomic::write(&new.join(name), text.as_bytes()))
        })
    }

    /// What stands in the files, one beside the other.
    fn found(folder: &Path) -> String {
        let read = |name| fs::read_to_string(folder.join(name)).unwrap();
        NAMES.map(read).join(" ")
    }

    fn with_old_files() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), "old").unwrap();
        fs::write(folder.path().join("own.txt"), "the user's").unwrap();
        folder
    }

    fn count(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn killed_at_any_step_the_files_are_all_old_or_all_new_or_said_to_be_neither() {
        let mut seen = Vec::new();
        for at in 1.. {
            let folder = with_old_files();
            let path = folder.path();
            let died = killed_at(at, || put(path, "new").unwrap());
            let whole = ["old old old old", "new new new new"].contains(&found(path).as_str());
            assert!(whole || path.join(READY).exists(), "step {at}");
            // Whoever comes next finds one or the other, and nothing of his own is gone.
            drop(Together::claim(path).unwrap());
            let after = found(path);
            assert!(
                ["old old old old", "new new new new"].contains(&after.as_str()),
                "step {at}: {after}"
            );
            assert!(!path.join(READY).exists());
            let own = fs::read_to_string(path.join("own.txt")).unwrap();
            assert_eq!(own, "the user's");
            seen.push((whole, after == "new new new new"));
            put(path, "next").unwrap();
            assert_eq!(
                (found(path).as_str(), count(path)),
                ("next next next next", 5)
            );
            if !died {
                break;
            }
        }
        // Old until all are written, then new; and in between a few steps at which it is said.
        let first_new = seen.iter().position(|(_, new)| *new).unwrap();
        assert!(seen[first_new..].iter().all(|(_, new)| *new), "{seen:?}");
        assert_eq!(first_new, 1 + NAMES.len() * atomic::tests::STEPS as usize);
        let mixed = seen.iter().filter(|(whole, _)| !whole).count();
        assert_eq!(mixed, NAMES.len() - 1, "{seen:?}");
    }

    #[test]
    fn a_folder_is_claimed_by_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = Together::claim(folder.path()).unwrap();
        let second = Together::claim(folder.path()).map(|_| ());
        let said = second.unwrap_err().to_string();
        assert!(said.contains("another hapdef"), "{said}");
        drop(first);
        assert!(Together::claim(folder.path()).is_ok());
        assert_eq!(count(folder.path()), 0, "and nothing lies about");
    }

    #[test]
    fn what_cannot_be_written_leaves_the_old_files_and_is_named_where_it_belongs() {
        let folder = with_old_files();
        let path = folder.path();
        let failed = Together::claim(path).unwrap().replace(|new| {
            atomic::write(&new.join("a.csv"), b"new")?;
            Err(FileError::broken(&new.join("b.json"), "the disk is full"))
        });
        let said = failed.unwrap_err().to_string();
        let named = path.join("b.json").display().to_string();
        assert!(said.starts_with(&named), "{said}");
        assert_eq!((found(path).as_str(), count(path)), ("old old old old", 5));
        // A folder in the place of a file: nothing is replaced.
        fs::remove_file(path.join("c.html")).unwrap();
        fs::create_dir(path.join("c.html")).unwrap();
        let said = put(path, "new").unwrap_err().to_string();
        assert!(said.contains("c.html") && said.contains("folder"), "{said}");
        assert_eq!(fs::read_to_string(path.join("a.csv")).unwrap(), "old");
    }
}

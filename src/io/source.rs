//! Files taken in whole: only ordinary ones, and only as large as memory bears.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

use super::FileError;
use crate::{memory, plain};

/// What is read may become this many times as large in memory while it is taken apart.
const GROWTH: f64 = 8.0;

/// All bytes of an ordinary file. A pipe, a device or a folder is refused before it is opened: reading from it
/// could wait, or go on, for ever.
///
/// # Errors
/// [`FileError`] naming the file, what it is and what to do.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    let length = ordinary(path)?.len();
    let most = (memory::allowed() / GROWTH) as u64;
    let too_large = |length: u64| {
        FileError::broken(
            path,
            format!(
                "the file has {}, and at most {} are read with {} of memory. Make it smaller, or allow more with --memory-gb",
                plain::needed(length as f64),
                plain::allowed(most as f64),
                plain::allowed(memory::allowed())
            ),
        )
    };
    if length > most {
        return Err(too_large(length));
    }
    let file = File::open(path).map_err(|e| FileError::of(path, &e))?;
    let mut bytes = Vec::new();
    // What grows while it is read ends as well.
    let read = file.take(most + 1).read_to_end(&mut bytes);
    read.map_err(|e| FileError::of(path, &e))?;
    if bytes.len() as u64 > most {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// As [`read`], as text.
///
/// # Errors
/// As [`read`], and where it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read(path)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let line = 1 + plain::lines_before(e.as_bytes(), at);
        FileError::broken(
            path,
            format!("line {line} is not text (UTF-8). Save it as UTF-8 text"),
        )
    })
}

/// What is known of an ordinary file, one that may be opened without waiting.
///
/// # Errors
/// [`FileError`] for what is not there, and for what is no ordinary file.
pub fn ordinary(path: &Path) -> Result<Metadata, FileError> {
    let about = std::fs::metadata(path).map_err(|e| FileError::of(path, &e))?;
    if about.is_file() {
        return Ok(about);
    }
    let what = if about.is_dir() {
        "this is a folder. Name a file in it"
    } else {
        "this is a pipe or a device, not a file. Write what it gives into a file first"
    };
    Err(FileError::broken(path, what))
}

/// Memory that may be taken on this machine (bytes): what the user allows, or the usual where the machine, its
/// container and the limits of this process have so much.
#[must_use]
pub fn machine_memory() -> u64 {
    memory_of(&|path| std::fs::read_to_string(path).unwrap_or_default())
}

/// By what the system writes about itself.
fn memory_of(text: &dyn Fn(&str) -> String) -> u64 {
    let of_machine = text("/proc/meminfo")
        .lines()
        .find_map(|l| {
            l.strip_prefix("MemTotal:")?
                .trim()
                .strip_suffix("kB")?
                .trim()
                .parse()
                .ok()
        })
        .map(|kilobytes: u64| kilobytes * 1024);
    let of_process = text("/proc/self/limits")
        .lines()
        .filter(|l| l.starts_with("Max address space") || l.starts_with("Max data size"))
        .filter_map(|l| l.split_whitespace().nth(3)?.parse().ok())
        .min();
    let of_container = text("/sys/fs/cgroup/memory.max").trim().parse().ok();
    let least = [of_machine, of_process, of_container]
        .into_iter()
        .flatten()
        .min();
    // Something else has to live there too.
    least.map_or(memory::USUAL, |bytes: u64| {
        (bytes / 10 * 8).min(memory::USUAL)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_of_machine_container_and_process_is_what_there_is() {
        const GB: u64 = 1 << 30;
        let said = |machine: u64, process: &str, container: &str| {
            let limits = format!(
                "Limit                     Soft Limit           Hard Limit           Units\nMax cpu time              1          2            seconds\nMax data size             unlimited            unlimited            bytes\nMax address space         {process}            unlimited            bytes\n"
            );
            let machine = format!("MemTotal:       {} kB\nMemFree: 3 kB\n", machine >> 10);
            memory_of(&|path| match path {
                "/proc/meminfo" => machine.clone(),
                "/proc/self/limits" => limits.clone(),
                _ => container.to_owned(),
            })
        };
        let most = |bytes: u64| bytes / 10 * 8;
        assert_eq!(said(64 * GB, "unlimited", "max\n"), memory::USUAL);
        assert_eq!(said(4 * GB, "unlimited", "max\n"), most(4 * GB));
        assert_eq!(said(64 * GB, &GB.to_string(), "max\n"), most(GB));
        assert_eq!(
            said(64 * GB, "unlimited", &format!("{}\n", 2 * GB)),
            most(2 * GB)
        );
        assert_eq!(memory_of(&|_| String::new()), memory::USUAL);
    }

    #[test]
    fn only_ordinary_files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "é").unwrap();
        assert_eq!(read_text(&path).unwrap(), "é");
        std::fs::write(&path, b"one\n\xff").unwrap();
        let said = read_text(&path).unwrap_err().to_string();
        assert!(said.contains("line 2"), "{said}");
        let said = read(folder.path()).unwrap_err().to_string();
        assert!(said.contains("folder"), "{said}");
        let said = read(Path::new("/dev/zero")).map_err(|e| e.to_string());
        assert!(!cfg!(unix) || said.unwrap_err().contains("device"));
    }

    #[test]
    fn a_file_larger_than_memory_is_not_begun() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse.stl");
        File::create(&path).unwrap().set_len(1 << 42).unwrap();
        let said = read(&path).unwrap_err().to_string();
        assert!(
            said.contains("sparse.stl") && said.contains("--memory-gb"),
            "{said}"
        );
    }
}

//! The readers of `tests/hard` for libFuzzer, which looks for inputs that reach new code.

#[path = "../../tests/hard/property.rs"]
#[allow(dead_code)]
mod property;
#[path = "../../tests/hard/reader.rs"]
#[allow(dead_code)]
mod reader;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;

pub use reader::Reader;

/// What a reader may take (bytes), and what it is told that it may take.
const MEMORY: u64 = 1_000_000_000;

/// Where files lie while they are read. libFuzzer's hook would end the program at any panic, also at one of a
/// library that its reader catches: it makes place for one that is silent.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    std::panic::set_hook(Box::new(|_| {}));
    hapdef::memory::allow(MEMORY);
    tempfile::tempdir().expect("a folder for files")
});

/// Reads bytes, and ends the program where something does not hold: libFuzzer keeps the input then.
pub fn hold(reader: Reader, bytes: &[u8]) {
    let folder = FOLDER.path();
    let held = catch_unwind(AssertUnwindSafe(|| reader.hold(bytes, folder)));
    let wrong = match held {
        Ok(Ok(_)) => return,
        Ok(Err(wrong)) => wrong,
        Err(panic) => match panic.downcast::<String>() {
            Ok(said) => format!("panic: {said}"),
            Err(_) => "panic".to_owned(),
        },
    };
    eprintln!("{}: {wrong}", reader.name());
    std::process::abort();
}

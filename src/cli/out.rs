//! What a command prints: answers on stdout, which may be piped away or full, and remarks on stderr, which
//! nobody may be reading.

use std::io::{self, Write};

use anyhow::Context as _;

/// Prints one line of an answer on stdout, at once.
///
/// # Errors
/// When it cannot be printed; [`reader_left`] tells a reader that has heard enough from a disk that is full.
pub fn line(text: &str) -> anyhow::Result<()> {
    printed(writeln!(io::stdout().lock(), "{text}"))
}

/// What came of printing something on stdout.
///
/// # Errors
/// As [`line()`].
pub fn printed(outcome: io::Result<()>) -> anyhow::Result<()> {
    outcome
        .and_then(|()| io::stdout().flush())
        .context("the answer could not be printed. Make room where it goes, or send it elsewhere")
}

/// Prints a remark on stderr. Where that is closed or full nobody reads it, and the work goes on.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Whether an error only means that the reader of a pipe has left, as `head` does: nothing went wrong then.
#[must_use]
pub fn reader_left(error: &anyhow::Error) -> bool {
    let mut causes = error.chain().filter_map(|e| e.downcast_ref::<io::Error>());
    causes.any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_that_left_is_no_failure_and_a_full_disk_is_one() {
        let of = |kind: io::ErrorKind| printed(Err(kind.into())).map_err(|e| reader_left(&e));
        assert_eq!(of(io::ErrorKind::BrokenPipe), Err(true));
        assert_eq!(of(io::ErrorKind::StorageFull), Err(false));
        assert!(printed(Ok(())).is_ok());
    }
}

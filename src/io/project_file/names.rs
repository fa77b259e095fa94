//! What a project's arrays are called, and where they lie.

use std::path::{Path, PathBuf};

use crate::io::fingerprint::Fingerprint;

/// Between the name of a mask and the fingerprint of its values, in a file.
const MARK: char = '@';

/// The name without its fingerprint.
pub(super) fn plain(name: &str) -> &str {
    match name.rsplit_once(MARK) {
        Some((plain, mark)) if mark.len() == 16 && mark.bytes().all(|b| b.is_ascii_hexdigit()) => {
            plain
        }
        _ => name,
    }
}

/// The name with the fingerprint of what it names: other values stand under another name, so that arrays
/// for the old project and for the new one can lie in a file together.
pub(super) fn marked(name: &str, mask: &[bool]) -> String {
    let mut hash = Fingerprint::default();
    hash.add(mask.iter().map(|&set| u8::from(set)));
    format!("{}{MARK}{}", plain(name), hash.hex())
}

/// Where a project's arrays lie: `limb.hapdef.toml` has `limb.hapdef.npz`.
#[must_use]
pub fn arrays_path(project: &Path) -> PathBuf {
    project.with_extension("npz")
}

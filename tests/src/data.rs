//! Real measurements beside the repository, where they are, and golden numbers inside it.

use std::io::Write;
use std::path::{Path, PathBuf};

/// Folder of a set of real measurements, or `None` after saying that the test is skipped: they may not be copied into the
/// repository.
pub fn real_data(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    // Written past the capture of passing tests' output: a skip must be seen.
    let _ = writeln!(std::io::stderr(), "SKIPPED a test: no real measurements at {}", folder.display());
    None
}

/// A golden file, parsed.
pub fn golden<T: serde::de::DeserializeOwned>(name: &str) -> T {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

//! Opening files to read. What this process has read is remembered, so that no output takes its place (`write.rs`).
#![expect(clippy::disallowed_methods, reason = "the one place where inputs are opened")]

use std::fs::File;
use std::io::Result as IoResult;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Absolute paths of the regular files that were opened to be read.
static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Opens a file to read it.
pub(super) fn open(path: &Path) -> IoResult<File> {
    let file = File::open(path)?;
    if file.metadata()?.is_file() {
        let path = std::path::absolute(path)?;
        let mut read = read();
        if !read.contains(&path) {
            read.push(path);
        }
    }
    Ok(file)
}

/// Opens a file to see what it is, which makes it no input.
pub(super) fn look_at(path: &Path) -> IoResult<File> {
    File::open(path)
}

/// Whether a file, by whatever name, is one that was opened to be read.
pub(super) fn was_read(path: &Path) -> bool {
    read().iter().any(|input| same_file::is_same_file(input, path).unwrap_or(false))
}

fn read() -> MutexGuard<'static, Vec<PathBuf>> {
    READ.lock().unwrap_or_else(PoisonError::into_inner)
}

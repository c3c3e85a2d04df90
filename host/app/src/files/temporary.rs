//! Files that are being written, and those that a program left behind that was killed while it wrote.
//!
//! The writer holds the operating system's lock on such a file, which ends with the process. So one that can be locked by somebody else
//! is nobody's, and the next program that writes into the folder removes it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, Result as IoResult};
use std::path::Path;

use tempfile::{Builder, NamedTempFile};

const PREFIX: &str = ".host-cal-";
const SUFFIX: &str = ".tmp";
const RANDOM_CHARACTERS: usize = 6;

/// Makes a file to write in a folder, after those of dead programs were removed from there.
pub(super) fn create_in(folder: &Path, prepare: impl Fn(&mut Builder<'_, '_>)) -> IoResult<NamedTempFile> {
    /// More often than by a strange chance nobody takes a new file for a dead one.
    const ATTEMPTS: usize = 10;
    remove_dead(folder);
    for _ in 0..ATTEMPTS {
        let mut builder = Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX).rand_bytes(RANDOM_CHARACTERS);
        prepare(&mut builder);
        let file = builder.tempfile_in(folder)?;
        match file.as_file().try_lock() {
            Ok(()) if file.path().exists() => return Ok(file),
            // Between its making and its locking another program found it unlocked.
            Ok(()) | Err(TryLockError::WouldBlock) => {}
            // Where there are no locks, nobody removes anything.
            Err(TryLockError::Error(_)) => return Ok(file),
        }
    }
    Err(Error::other("a temporary file is removed by others again and again"))
}

/// Removes the files that dead programs left. What cannot be removed stays: it is in nobody's way.
fn remove_dead(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let is_one = entry.file_name().to_str().is_some_and(is_temporary_name);
        if is_one && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            let _ = remove_if_dead(&entry.path());
        }
    }
}

#[expect(clippy::disallowed_methods, reason = "only to be locked")]
fn remove_if_dead(path: &Path) -> IoResult<()> {
    let file: File = OpenOptions::new().read(true).write(true).open(path)?;
    file.try_lock()?;
    std::fs::remove_file(path)
}

fn is_temporary_name(name: &str) -> bool {
    let middle = name.strip_prefix(PREFIX).and_then(|rest| rest.strip_suffix(SUFFIX));
    middle.is_some_and(|middle| middle.len() == RANDOM_CHARACTERS && middle.bytes().all(|byte| byte.is_ascii_alphanumeric()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_dead_program_left_goes_and_what_is_somebodys_stays() {
        let folder = tempfile::tempdir().unwrap();
        let living = create_in(folder.path(), |_| ()).unwrap();
        let others = [".host-cal-notes", ".host-cal-config.tmp2", ".host-cal-a b.cd.tmp", ".host-cal-abc.tmp", "poses.csv.tmp"];
        for name in others {
            std::fs::write(folder.path().join(name), "somebody's").unwrap();
        }
        std::fs::create_dir(folder.path().join(".host-cal-FoLdEr.tmp")).unwrap();
        // As a killed program leaves it.
        let (_, dead) = create_in(folder.path(), |_| ()).unwrap().keep().unwrap();
        assert!(is_temporary_name(dead.file_name().unwrap().to_str().unwrap()));

        let next = create_in(folder.path(), |_| ()).unwrap();
        assert!(!dead.exists());
        assert!(living.path().exists() && next.path().exists(), "of the living nothing is removed");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), others.len() + 3);
    }
}

//! Programs that read back what the command writes: Python with its libraries, Octave, a C compiler, a browser, groff. `check` installs them.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::workspace::{target_folder, workspace};

/// Set by `check` when it could not install the programs, and said so.
const WITHOUT_READERS: &str = "BALLBAR_WITHOUT_READERS";

/// Whether tests that need other programs are to be skipped; says so.
pub fn is_skipped() -> bool {
    let is_skipped = std::env::var_os(WITHOUT_READERS).is_some_and(|value| value == "1");
    if is_skipped {
        eprintln!("SKIPPED, as {WITHOUT_READERS}=1 asks for: this needs Python's libraries, octave-cli, chromium and groff");
    }
    is_skipped
}

/// Runs a script of `tests/readers/` in Python; its standard output.
///
/// # Panics
/// When the script fails, or `check` never ran here.
pub fn python(script: &str, arguments: &[&Path]) -> String {
    let python = target_folder().join("readers/bin/python");
    output(Command::new(python).arg(reader(script)).args(arguments))
}

/// A file of `tests/readers/`.
pub fn reader(name: &str) -> PathBuf {
    workspace().join("tests/readers").join(name)
}

/// Evaluates Octave's code in a directory; its standard output.
///
/// # Panics
/// When the code fails, or Octave is not there.
pub fn octave(directory: &Path, code: &str) -> String {
    output(Command::new("octave-cli").args(["--quiet", "--no-init-file", "--eval", code]).current_dir(directory))
}

/// The standard output of a program that has to succeed.
///
/// # Panics
/// When it fails or is not there.
pub fn output(command: &mut Command) -> String {
    let run = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}; ./check installs it"));
    let words = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{command:?}: {}\n{words}", run.status);
    String::from_utf8(run.stdout).unwrap_or_else(|error| panic!("{command:?}: {error}"))
}

//! Runs the `host-cal` binary as a user would.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// Builds the binary once (nothing to do when it is fresh). A test is named with it, the smallest: so the libraries have the features
/// that `cargo test --workspace` gave them, and none is compiled a second time.
static HOST_CAL: LazyLock<PathBuf> = LazyLock::new(|| {
    let build = escargot::CargoBuild::new().bin("host-cal").args(["--workspace", "--test", "images"]);
    build.run().expect("host-cal builds").path().to_owned()
});

/// What a run printed, and how it ended.
#[derive(Debug)]
pub struct Run {
    /// Exit code.
    pub code: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Run {
    /// The one JSON document on stdout.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("stdout is not JSON ({error}):\n{}\n{}", self.stdout, self.stderr))
    }

    /// Everything, for a snapshot.
    pub fn transcript(&self) -> String {
        format!("exit code {}\n--- stdout ---\n{}--- stderr ---\n{}", self.code, self.stdout, self.stderr)
    }
}

/// `host-cal` in a folder, to be started.
pub fn host_cal_command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(&*HOST_CAL);
    command.args(args).current_dir(folder).env("NO_COLOR", "1").env_remove("COLUMNS");
    command
}

/// Runs `host-cal` in a folder.
pub fn host_cal_in(folder: &Path, args: &[&str]) -> Run {
    let output = host_cal_command(folder, args).output().expect("host-cal starts");
    let text = |bytes| String::from_utf8(bytes).expect("host-cal prints UTF-8");
    Run { code: output.status.code().expect("host-cal ends by itself"), stdout: text(output.stdout), stderr: text(output.stderr) }
}

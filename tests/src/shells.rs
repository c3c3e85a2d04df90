//! A folder with simulated poses of a PUMA 560 that is not as designed.

use crate::command::{Run, host_cal_in};
use tempfile::TempDir;

/// The robot as designed and the rig.
pub const DESIGN: [&str; 4] = ["--robot", "puma560", "--rig", "triangles"];

/// Runs a command that must end well.
pub fn runs(folder: &TempDir, parts: &[&[&str]]) -> Run {
    let run = host_cal_in(folder.path(), &parts.concat());
    assert_eq!(run.code, 0, "{:?}: {}", parts.concat(), run.transcript());
    run
}

/// Poses on shells of all pairings, of Table II's optimised robot, planned with its design.
pub fn simulate(folder: &TempDir, file: &str, more: &[&str]) {
    let robots = ["simulate", "--robot", "puma560-optimised", "--plan-robot", "puma560", "--rig", "triangles"];
    runs(folder, &[&robots, more, &["--out", file]]);
}

/// A folder with `poses.csv`, 180 poses on 46 cm shells, and `other.csv`, 90 poses on 61 cm shells.
pub fn puma() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    simulate(&folder, "poses.csv", &["--bar", "460", "--per-pair", "20", "--sigma-mm", "0.084", "--seed", "7"]);
    simulate(&folder, "other.csv", &["--bar", "610", "--per-pair", "10", "--sigma-mm", "0.084", "--seed", "8"]);
    folder
}

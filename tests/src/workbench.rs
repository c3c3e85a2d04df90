//! A folder to provoke `host-cal` in: good files to spoil, and an older one that nothing may touch.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;

use crate::command::{Run, host_cal_in};
use tempfile::TempDir;

/// A small robot with a joint of either kind.
pub const ROBOT: &str = r#"name = "arm"

[[links]]
translation_mm = [0.0, 0.0, 400.0]
rotation_deg = [0.0, 0.0, 0.0]

[[links]]
translation_mm = [150.0, 0.0, 0.0]
rotation_deg = [0.0, 90.0, 0.0]

[[links]]
translation_mm = [0.0, 20.0, 30.0]
rotation_deg = [0.0, 0.0, 0.0]

[[joints]]
type = "revolute"
offset_deg = -90.0
scale = 1.0
min_deg = -170.0
max_deg = 170.0
counts_per_rev = 8192
sign = 1

[[joints]]
type = "prismatic"
offset_mm = 10.0
scale = 1.0
min_mm = 0.0
max_mm = 500.0
coupling = { joint = 1, ratio = 0.5 }
"#;

/// A rig of two chucks and two spheres.
pub const RIG: &str = r#"[[chucks]]
name = "A"
position_mm = [565.0, 0.0, 0.0]

[[chucks]]
name = "B"
position_mm = [392.0, 100.0, 0.0]

[[spheres]]
name = "1"
position_mm = [57.0, 0.0, 50.0]

[[spheres]]
name = "2"
position_mm = [-28.0, 50.0, 50.0]

[bar]
lengths_mm = [460.0, 610.0]
travel_mm = 75.0
"#;

/// Poses of that robot in that rig.
pub const POSES: &str = "chuck,sphere,q1_deg,q2_mm,length_mm
A,1,10.0,100.0,455.5
# the bar was turned over here
A,2,-20.0,150.0,460.25
B,1,30.0,200.0,610.125
";

const OLD: &str = "an older file that must survive\n";

/// A folder with a good robot, rig and poses, and a file that nothing may touch.
pub struct Workbench(TempDir);

impl Default for Workbench {
    fn default() -> Self {
        Self::new()
    }
}

impl Workbench {
    /// A fresh folder.
    pub fn new() -> Self {
        let bench = Self(TempDir::new().expect("a temporary folder"));
        for (name, text) in [("robot.toml", ROBOT), ("rig.toml", RIG), ("poses.csv", POSES), ("old.toml", OLD)] {
            bench.put(name, text);
        }
        bench
    }

    /// Where a file of the folder is.
    pub fn path(&self, file: &str) -> PathBuf {
        self.0.path().join(file)
    }

    /// Writes a file, whatever was there.
    pub fn put(&self, name: &str, contents: impl AsRef<[u8]>) {
        fs::write(self.path(name), contents).expect("a file in the temporary folder");
    }

    /// Runs `host-cal` in the folder.
    pub fn run(&self, args: &[&str]) -> Run {
        host_cal_in(self.0.path(), args)
    }

    fn files(&self) -> BTreeMap<OsString, Option<Vec<u8>>> {
        let entries = fs::read_dir(self.0.path()).expect("the folder").map(|entry| entry.expect("an entry"));
        entries.map(|entry| (entry.file_name(), fs::read(entry.path()).ok())).collect()
    }

    /// Runs a command that must end with this exit code, print no result and leave the folder as it was; says what it said.
    pub fn fails(&self, code: i32, args: &[&str]) -> String {
        let before = self.files();
        let run = self.run(args);
        assert_eq!((run.code, run.stdout.as_str()), (code, ""), "{args:?}: {}", run.transcript());
        assert!(!run.stderr.contains("panicked"), "{args:?}: {}", run.stderr);
        assert_eq!(self.files(), before, "{args:?} changed a file");
        run.stderr
    }

    /// [`Workbench::fails`] with bad input or usage, and a snapshot of what it says.
    pub fn refuses(&self, name: &str, args: &[&str]) {
        snapshot(name, args, &self.fails(2, args));
    }
}

/// What a command said on stderr.
pub fn snapshot(name: &str, args: &[&str], said: &str) {
    insta::with_settings!({
        description => format!("host-cal {}", args.join(" ")),
        omit_expression => true,
        prepend_module_to_snapshot => false,
        // A path that every run makes anew, wherever the line was broken.
        filters => vec![(r#"(?s)at path ".*?""#, "at path [TEMPORARY]")],
    }, {
        insta::assert_snapshot!(format!("refusals__{name}"), said);
    });
}

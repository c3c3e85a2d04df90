//! What `host-cal export` writes, read back by programs of others: Python's libraries, Octave, a C compiler, rustc. Each computes poses
//! by mathematics of its own, which are held against what `host-cal fk` says.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use ballbar_calib::model::Robot;
use ballbar_tests::command::host_cal_in;
use ballbar_tests::exports::{joint_vectors, pose_by_command, write_calibrated};
use ballbar_tests::readers::{is_skipped, octave, output, python, reader};
use host_cal::files::{ROBOTS, open_robot};
use nalgebra::Matrix4;
use tempfile::TempDir;

/// A spherical wrist, axes that calibration leaves nearly parallel, a slide, few joints, and encoders that count against their joints.
const DESIGNS: [&str; 5] = ["puma560", "ur5e", "stanford", "scara", BACKWARDS];

/// A SCARA with every other scale below zero.
const BACKWARDS: &str = "backwards.toml";

/// A calibrated robot in a folder, with poses that the command computed.
struct Bench {
    folder: TempDir,
    robot: Robot,
    joints: Vec<Vec<f64>>,
    poses: Vec<Matrix4<f64>>,
}

impl Bench {
    fn new(design: &str) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let design = if design == BACKWARDS { write_backwards(folder.path()) } else { design.to_owned() };
        let robot = write_calibrated(folder.path(), &design);
        let joints = joint_vectors(&robot, 7);
        let pose = |q: &Vec<f64>| pose_by_command(folder.path(), "calibrated.toml", &robot, q);
        let poses = joints.iter().map(pose).collect();
        fs::write(folder.path().join("joints.json"), serde_json::to_string(&joints).expect("JSON")).expect("a file");
        Self { folder, robot, joints, poses }
    }

    fn export(&self, format: &str, file: &str, more: &[&str]) {
        let arguments = ["export", "--robot", "calibrated.toml", "--format", format, "--force", "--out", file];
        let run = host_cal_in(self.folder.path(), &[&arguments, more].concat());
        assert_eq!(run.code, 0, "{}", run.transcript());
    }

    fn path(&self, file: &str) -> std::path::PathBuf {
        self.folder.path().join(file)
    }

    /// Encoder outputs as lines of numbers.
    fn lines(&self) -> String {
        let words = |q: &Vec<f64>| q.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(" ") + "\n";
        self.joints.iter().map(words).collect()
    }

    fn holds(&self, what: &str, theirs: &[Matrix4<f64>], tolerance: f64) {
        assert_eq!(theirs.len(), self.poses.len(), "{what}");
        for (q, (ours, theirs)) in self.joints.iter().zip(self.poses.iter().zip(theirs)) {
            let off = (ours - theirs).amax();
            assert!(off < tolerance, "{what} of {:?}: {off:e} at {q:?}\n{ours}{theirs}", self.robot.source.as_str());
        }
    }
}

/// Matrices of lines of 16 numbers, row by row.
fn matrices(text: &str) -> Vec<Matrix4<f64>> {
    let number = |word: &str| word.parse::<f64>().unwrap_or_else(|_| panic!("`{word}` is no number"));
    text.lines().map(|line| Matrix4::from_row_iterator(line.split_whitespace().map(number))).collect()
}

fn write_backwards(folder: &Path) -> String {
    let (_, text) = ROBOTS.iter().find(|(name, _)| *name == "scara").expect("a built-in robot");
    let mut joint = 0;
    let turned = text.lines().map(|line| {
        joint += usize::from(line.starts_with("scale ="));
        if joint % 2 == 1 { line.replace("scale = 1.0", "scale = -1.0") + "\n" } else { format!("{line}\n") }
    });
    let path = folder.join(BACKWARDS);
    fs::write(&path, turned.collect::<String>()).expect("a file");
    path.display().to_string()
}

/// What Python says of a file.
#[derive(serde::Deserialize)]
struct ByPython {
    poses: Vec<[[f64; 4]; 4]>,
    limits: Option<Vec<Option<[f64; 2]>>>,
}

impl ByPython {
    fn new(arguments: &[&Path]) -> Self {
        let text = python("robot.py", arguments);
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
    }

    fn poses(&self) -> Vec<Matrix4<f64>> {
        self.poses.iter().map(|matrix| Matrix4::from_fn(|i, j| matrix[i][j])).collect()
    }

    /// A file without limits and a joint without any hold.
    fn has_limits_of(&self, robot: &Robot, what: &str) {
        let Some(limits) = &self.limits else { return };
        assert_eq!(limits.len(), robot.limits.len(), "{what}");
        for (ours, theirs) in robot.limits.iter().zip(limits) {
            let Some([min, max]) = theirs else { continue };
            assert!((ours.min - min).abs() < 1e-12 && (ours.max - max).abs() < 1e-12, "{what}: {ours:?}, {theirs:?}");
        }
    }
}

#[test]
fn python_computes_the_same_poses_from_every_file_of_data() {
    if is_skipped() {
        return;
    }
    for design in DESIGNS {
        let bench = Bench::new(design);
        let formats = ["urdf", "ros2", "json", "yaml", "csv", "dh", "mdh"].map(|format| (format, &[][..]));
        let zeros = ["urdf", "ros2"].map(|format| (format, &["--joint-zero", "encoder"][..]));
        for (format, more) in formats.into_iter().chain(zeros) {
            bench.export(format, "exported", more);
            let paths = [Path::new(format), &bench.path("exported"), &bench.path("joints.json")];
            // Distances of hundreds of metres cost three digits.
            let tolerance = if !["puma560", "stanford"].contains(&design) && format.ends_with("dh") { 1e-9 } else { 1e-11 };
            let (what, theirs) = (format!("{design} {format} {more:?}"), ByPython::new(&paths));
            assert_eq!(theirs.limits.is_some(), !format.ends_with("dh"), "{what}");
            theirs.has_limits_of(&bench.robot, &what);
            bench.holds(&what, &theirs.poses(), tolerance);
        }
    }
}

#[test]
fn octave_computes_the_same_poses() {
    if is_skipped() {
        return;
    }
    for design in DESIGNS {
        let bench = Bench::new(design);
        bench.export("octave", "robot_pose.m", &[]);
        let vectors = bench.lines().lines().map(|line| format!("[{line}]")).collect::<Vec<_>>().join(", ");
        // Octave prints columns first: a transposed matrix row by row.
        let code = format!("for q = {{{vectors}}}; printf('%.17g ', robot_pose(q{{1}})'); printf('\\n'); end");
        bench.holds(design, &matrices(&octave(bench.folder.path(), &code)), 1e-11);
    }
}

#[test]
fn a_c_compiler_takes_the_header_and_computes_the_same_poses() {
    for design in DESIGNS {
        let bench = Bench::new(design);
        bench.export("c", "robot.h", &[]);
        fs::copy(reader("pose.c"), bench.path("pose.c")).expect("a copy");
        let mut compiler = Command::new("cc");
        compiler.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", "pose", "pose.c", "-lm"]);
        output(compiler.current_dir(bench.folder.path()));
        bench.holds(design, &matrices(&fed(&bench.path("pose"), &bench.lines())), 1e-11);
    }
}

#[test]
fn rustc_takes_the_constants_and_computes_the_same_poses() {
    for design in DESIGNS {
        let bench = Bench::new(design);
        bench.export("rust", "robot.rs", &[]);
        fs::copy(reader("pose.rs"), bench.path("pose.rs")).expect("a copy");
        let mut compiler = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
        compiler.args(["--edition", "2024", "-D", "warnings", "-o", "pose", "pose.rs"]);
        output(compiler.current_dir(bench.folder.path()));
        bench.holds(design, &matrices(&fed(&bench.path("pose"), &bench.lines())), 1e-11);
    }
}

/// The standard output of a program that reads this.
fn fed(program: &Path, input: &str) -> String {
    let file = program.with_extension("input");
    fs::write(&file, input).expect("a file");
    output(Command::new(program).stdin(Stdio::from(fs::File::open(file).expect("a file"))))
}

#[test]
fn imported_descriptions_have_the_kinematics_that_pythons_parser_finds() {
    if is_skipped() {
        return;
    }
    for (file, base, tip) in [
        ("palletiser.urdf", "world", "tool0"),
        ("palletiser.urdf", "base_link", "link_6"),
        ("cobot.urdf", "base_link", "tool0"),
        ("cobot.urdf", "base_link_inertia", "ft_frame"),
        ("seven_axes.urdf", "l0", "ee"),
        ("scara.urdf", "floor", "gripper"),
        ("scara.urdf", "carriage", "left_finger"),
    ] {
        let folder = TempDir::new().expect("a temporary folder");
        let urdf = reader("../urdf").join(file);
        let urdf_name = urdf.display().to_string();
        let arguments = ["import", &urdf_name, "--base", base, "--tip", tip, "--out", "imported.toml"];
        let run = host_cal_in(folder.path(), &arguments);
        assert_eq!(run.code, 0, "{}", run.transcript());
        let robot = open_robot(&folder.path().join("imported.toml").display().to_string()).expect("a robot");
        let joints = joint_vectors(&robot, 5);
        let joints_path = folder.path().join("joints.json");
        fs::write(&joints_path, serde_json::to_string(&joints).expect("JSON")).expect("a file");
        let arguments = [Path::new("urdf"), &urdf, &joints_path, Path::new(base), Path::new(tip)];
        let theirs = ByPython::new(&arguments);
        theirs.has_limits_of(&robot, file);
        for (q, theirs) in joints.iter().zip(theirs.poses()) {
            let off = (pose_by_command(folder.path(), "imported.toml", &robot, q) - theirs).amax();
            assert!(off < 1e-12, "{file} {tip}: {off:e} at {q:?}");
        }
    }
}

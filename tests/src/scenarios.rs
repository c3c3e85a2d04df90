//! What a board has to do for a host, whatever the board is: scenarios run the `host-cal` command against its port.

use std::fmt::Write;

use ballbar::wire::{Answer, Command, Event, MAX_PAYLOAD, ParameterSet, StreamedPose, ToHost, WhichSet};
use ballbar::{JointVector, Kinematics, Sample, SettledPose, Vector3};
use ballbar_calib::model::Robot;
use ballbar_calib::simulate::Shells;
use ballbar_firmware::ENCODERS;
use host_cal::board::{BAUD, BoardLink, joint_encoders, parameter_set};
use host_cal::files::{open_rig, open_robot};
use host_cal::robot_link::JointSpeed;
use host_cal::session::{LogReader, Record};
use host_cal::units::mm_from_m;
use host_cal::virtual_board::{Plant, Script};
use serde_json::Value;
use tempfile::TempDir;

use crate::command::{Run, host_cal_in};
use crate::emulator::Tick;

/// The robot as it is; the board is told the same.
pub const ROBOT: &str = "puma560-optimised";
/// Chucks, spheres and the bar.
pub const RIG: &str = "triangles";
/// What the bar joins.
pub const PAIRING: &str = "A:1";
/// Length of the bar at mid travel, millimetres.
pub const BAR_MM: f64 = 460.0;
/// Travel of the LVDT, metres.
const TRAVEL_M: f64 = 0.075;
/// A step of the LVDT's code, metres: what it can resolve.
const CODE_M: f64 = TRAVEL_M / 61_500.0;

/// For a stream that would otherwise have no end; far longer than any takes.
const TIME_LIMIT: &str = "5m";

/// A board behind a port.
pub trait Bench {
    /// What its hello calls it.
    fn board(&self) -> &'static str;
    /// The port that a host opens.
    fn port(&self) -> String;
}

/// A plant of the robot, at rest and without the bar.
pub fn plant(seed: u64) -> Plant {
    Plant::new(&robot(), TRAVEL_M, seed).expect("the robot's encoders are known")
}

/// So many stations on the shell of [`PAIRING`], without noise of their own.
pub fn script(stations: usize, dwell_s: f64, seed: u64) -> Script {
    let (robot, rig) = (robot(), open_rig(RIG).expect("a built-in rig"));
    let pairings = [rig.all_pairings()[0]];
    assert_eq!(rig.pairing_name(pairings[0]), PAIRING);
    let shells = Shells {
        planned_with: &robot,
        truth: &robot,
        rig: &rig,
        pairings: &pairings,
        bar_m: BAR_MM * 1e-3,
        per_pairing: stations,
        sigma_m: 0.0,
        seed,
    };
    Script::from_shells(&shells, dwell_s, JointSpeed::default(), || {}).expect("the robot reaches the shell")
}

fn robot() -> Robot {
    open_robot(ROBOT).expect("a built-in robot")
}

/// Runs a command against the bench's port that must end well; returns its JSON document.
pub fn host_cal(bench: &dyn Bench, command: &str, more: &[&str]) -> Value {
    let run = host_cal_run(bench, command, more);
    assert_eq!(run.code, 0, "host-cal {command}\n{}", run.transcript());
    run.json()
}

/// Runs a command against the bench's port.
pub fn host_cal_run(bench: &dyn Bench, command: &str, more: &[&str]) -> Run {
    let port = bench.port();
    let args: Vec<&str> = [command, port.as_str()].into_iter().chain(more.iter().copied()).chain(["--json"]).collect();
    host_cal_in(&std::env::temp_dir(), &args)
}

/// A board as it comes from the shelf says what it is, and that it holds no parameters.
pub fn greets_the_host(bench: &dyn Bench) {
    let run = host_cal_run(bench, "status", &[]);
    assert_eq!(run.code, 1, "a board without parameters fails some tests of its own\n{}", run.transcript());
    let status = run.json();
    assert_eq!(status["board"], bench.board());
    assert_eq!(status["started_by"], "power-on");
    assert_eq!(status["robot"], Value::Null);
    assert_eq!(status["rate_hz"], 1000);
    let failed: Vec<&Value> =
        status["self_test"].as_array().expect("a list").iter().filter(|test| test["passed"] == false).collect();
    let unused = &status["stack_unused_bytes"];
    assert_eq!(failed.len(), 3, "parameters, slots, and the LVDT without its bar: {failed:?}; {unused} bytes of stack unused");
}

/// Uploaded parameters are computed with to a micrometre, and stand in flash bit for bit after a reset.
pub fn keeps_parameters_over_a_reset(bench: &dyn Bench, plant: &Plant) {
    // The plant's own curve: `apply` keeps the one that the board has.
    let mut link = connect(bench);
    let set = parameter_set(&robot(), plant.lvdt()).expect("the robot fits a board");
    store(&mut link, &set);
    drop(link);

    let applied = host_cal(bench, "apply", &["--robot", ROBOT, "--uncalibrated", "--vectors", "1000"]);
    assert_eq!(applied["vectors"], 1000);
    assert_eq!(applied["lvdt"], "kept");
    let difference_um = applied["max_position_difference_um"].as_f64().expect("a number");
    assert!(difference_um <= 1.0, "{difference_um} µm between the board's poses and the host's");

    let stored = bytes_of(&active_set(bench));
    assert_eq!(stored, bytes_of(&set));
    let run = host_cal_run(bench, "status", &["--reset"]);
    let status = run.json();
    assert_eq!(status["started_by"], "a reset that was asked for", "{}", run.transcript());
    assert_eq!(status["robot"]["crc"], applied["crc"]);
    assert_eq!(status["robot"]["sequence"], applied["sequence"]);
    assert!(status["uptime_s"].as_f64().expect("a number") < 30.0);
    assert_eq!(bytes_of(&active_set(bench)), stored);
}

/// What the last upload replaced comes back, over a reset too, and once more undoes it.
pub fn brings_back_the_parameters_before(bench: &dyn Bench) {
    const OTHER: &str = "puma560";
    let first = host_cal_run(bench, "status", &[]).json()["robot"]["crc"].clone();
    let second = host_cal(bench, "apply", &["--robot", OTHER, "--uncalibrated", "--vectors", "20"])["crc"].clone();
    assert_ne!(first, second);
    for (back, away) in [(&first, &second), (&second, &first), (&first, &second)] {
        let report = host_cal(bench, "apply", &["--previous", "--vectors", "50"]);
        assert_eq!((&report["crc"], &report["replaced_crc"]), (back, away));
    }
    let status = host_cal_run(bench, "status", &["--reset"]).json();
    assert_eq!((&status["robot"]["crc"], &status["previous"]["crc"]), (&first, &second));
}

fn connect(bench: &dyn Bench) -> BoardLink {
    BoardLink::connect(&bench.port(), BAUD).unwrap_or_else(|error| panic!("{error}"))
}

fn store(link: &mut BoardLink, set: &ParameterSet) {
    let staged = link.request(Command::WriteParameters(set.clone())).expect("the board takes the parameters");
    let Answer::Staged { crc } = staged else { panic!("not staged: {staged:?}") };
    link.act(Command::Commit { crc }).expect("the board stores the parameters");
}

fn active_set(bench: &dyn Bench) -> ParameterSet {
    match connect(bench).request(Command::ReadParameters(WhichSet::Active)) {
        Ok(Answer::Parameters(set)) => set,
        other => panic!("no parameters, but {other:?}"),
    }
}

fn bytes_of(set: &ParameterSet) -> Vec<u8> {
    postcard::to_slice(set, &mut [0; MAX_PAYLOAD]).expect("a set fits into a message").to_vec()
}

/// Stores the robot with the plant's curve and homes the encoders of a robot that has not moved yet.
pub fn make_ready(bench: &dyn Bench, plant: &Plant) {
    store(&mut connect(bench), &parameter_set(&robot(), plant.lvdt()).expect("the robot fits a board"));
    home_at_rest(bench, plant);
}

/// Homes the encoders of a robot that has not moved yet: it stands where the plant begins.
pub fn home_at_rest(bench: &dyn Bench, plant: &Plant) {
    let encoders = joint_encoders(&robot()).expect("the robot's encoders are known");
    let q = encoders.q(plant.counts().map(f64::from));
    let mut text = String::new();
    for &q in &q.as_array()[..plant.joints()] {
        write!(text, "{},", q.to_degrees()).expect("a string takes text");
    }
    let homed = host_cal(bench, "home", &["--q", text.trim_end_matches(',')]);
    assert_eq!(homed["counts"], serde_json::json!(plant.counts()));
}

/// What one run of `host-cal stream` recorded.
pub struct Recording {
    /// Its JSON document.
    pub report: Value,
    /// Every sample.
    pub samples: Vec<Sample>,
    /// Every settled pose.
    pub settled: Vec<SettledPose>,
    /// Every pose of the tool, with the index of its sample.
    pub poses: Vec<(u32, StreamedPose)>,
    /// The session's directory.
    pub folder: TempDir,
}

/// Streams until so many poses have settled. Encoders within a count and the LVDT within 24 codes count as standing still: little of
/// the arm's ringing is left in a settled pose then, and the noise of a long stay is not taken for motion.
pub fn record(bench: &dyn Bench, poses: usize, more: &[&str]) -> (Run, Recording) {
    let folder = tempfile::tempdir().expect("a folder for the session");
    let session = folder.path().to_str().expect("a folder's name is text");
    let (poses_text, bar) = (poses.to_string(), BAR_MM.to_string());
    let mut args = vec!["--session", session, "--raw", "--settled", "--poses", &poses_text, "--for", TIME_LIMIT];
    args.extend(["--rig", RIG, "--pairing", PAIRING, "--bar", &bar, "--band-counts", "1", "--band-codes", "24"]);
    args.extend(more);
    let run = host_cal_run(bench, "stream", &args);
    let mut recording = Recording { report: run.json(), samples: Vec::new(), settled: Vec::new(), poses: Vec::new(), folder };
    recording.read_log();
    assert_eq!(recording.settled.len(), poses, "not all poses settled in time: {}", recording.report);
    (run, recording)
}

impl Recording {
    fn read_log(&mut self) {
        let mut log = LogReader::open(self.folder.path()).expect("the session has a log");
        while let Some(record) = log.next_record().expect("the log can be read") {
            let message = match record {
                Record::Message(message) => message,
                Record::Mark(_) => continue,
                Record::Refused(reason) => panic!("a message that is not believed: {reason}"),
                Record::Damaged => panic!("a damaged frame in the log"),
            };
            let ToHost::Stream(stream) = *message else { continue };
            match stream.event {
                Event::Samples(batch) => self.samples.extend(batch.samples()),
                Event::Settled(pose) => self.settled.push(pose),
                Event::Poses(batch) => {
                    let indices = (batch.index..).step_by(batch.stride.into());
                    self.poses.extend(indices.zip(batch.poses.iter().copied()));
                }
            }
        }
    }

    /// No sample is missing, by the numbers that they have and by what the command says.
    pub fn has_every_sample(&self, at_least: usize) {
        assert!(self.samples.len() >= at_least, "{} samples, expected {at_least} and more", self.samples.len());
        let losses = &self.report["losses"];
        let gap = self.samples.windows(2).find(|pair| pair[1].index != pair[0].index + 1);
        let gap = gap.map(|pair| [pair[0].index, pair[1].index]);
        assert_eq!(gap, None, "samples are missing: {losses}");
        assert_eq!((&losses["missing"], &losses["overruns"]), (&0.into(), &0.into()), "{losses}");
        assert_eq!(self.report["samples"], self.samples.len());
    }

    /// Every sample is what the plant gave.
    pub fn has_true_samples(&self, ticks: &[Tick]) {
        for sample in &self.samples {
            let tick = &ticks[sample.index as usize + 1];
            let expected = Sample {
                index: sample.index,
                t_us: tick.t_us,
                counts: tick.counts.iter().copied().collect(),
                lvdt: ballbar::LvdtReading { code: tick.scan.code, saturated: tick.scan.saturated },
            };
            assert_eq!(*sample, expected);
        }
    }

    /// Every settled pose is the mean of what the plant gave meanwhile.
    pub fn has_true_means(&self, ticks: &[Tick]) {
        for pose in &self.settled {
            let first = pose.index as usize + 1;
            let ticks = &ticks[first..first + pose.samples as usize];
            let mean = |value: &dyn Fn(&Tick) -> f64| ticks.iter().map(value).sum::<f64>() / ticks.len() as f64;
            for joint in 0..ENCODERS {
                let expected = mean(&|tick| f64::from(tick.counts[joint]));
                assert!((pose.counts_mean[joint] - expected).abs() < 1e-6, "joint {joint}: {pose:?}, expected {expected}");
            }
            let expected = mean(&|tick| f64::from(tick.scan.code));
            assert!((pose.code_mean - expected).abs() < 1e-6, "{pose:?}, expected {expected}");
        }
    }

    /// `poses.csv` has the stations of the script in order: joint values to half a count, lengths to a step of the LVDT.
    pub fn has_true_stations(&self, script: &Script) {
        let robot = robot();
        let (encoders, truth) = (joint_encoders(&robot).expect("the encoders are known"), Kinematics::new(&robot.chain));
        let text = std::fs::read_to_string(self.folder.path().join("poses.csv")).expect("the session has poses");
        let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
        assert_eq!(rows.len(), self.settled.len());
        for (row, station) in rows.iter().zip(&script.stations) {
            let held = encoders.counts(&station.q).map(f64::round);
            let q = encoders.q(held);
            let mut found = JointVector::zero();
            for (place, text) in found.as_array_mut().iter_mut().zip(&row[2..8]) {
                *place = text.parse::<f64>().expect("a number").to_radians();
            }
            for (found, held) in encoders.counts(&found).iter().zip(held) {
                assert!((found - held).abs() < 0.5, "{row:?}: {found} counts, the robot stood at {held}");
            }
            let length_mm = mm_from_m(truth.length(&q, &station.bar.expect("the bar is attached").pairing));
            let found_mm: f64 = row[8].parse().expect("a number");
            assert!((found_mm - length_mm).abs() <= mm_from_m(CODE_M), "{row:?}, expected {length_mm} mm");
        }
    }

    /// The board's tool poses are those of the host's kinematics at the plant's joint values, to a micrometre. Returns the largest
    /// difference, metres.
    pub fn has_true_poses(&self, ticks: &[Tick]) -> f64 {
        let robot = robot();
        let (encoders, truth) = (joint_encoders(&robot).expect("the encoders are known"), Kinematics::new(&robot.chain));
        let mut largest_m = 0_f64;
        for (index, streamed) in &self.poses {
            let tick = &ticks[*index as usize + 1];
            let expected = truth.base_from_tool(&encoders.q(tick.counts.map(f64::from)));
            let found = Vector3::from(streamed.pose.position_m.map(f64::from));
            let difference_m = (found - expected.translation_m).norm();
            assert!(difference_m <= 1e-6, "sample {index}: {difference_m} m from where the tool was");
            largest_m = largest_m.max(difference_m);
        }
        largest_m
    }
}

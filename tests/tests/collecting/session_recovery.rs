//! Whatever ends a recording at whatever moment: after the next run every pose that the log holds is in poses.csv, once.
//!
//! A killed program leaves a beginning of the log, and poses.csv as it was at that moment or before. So both are taken apart: a
//! recording is made, the log is cut at every byte of short frames and many of long ones, and put beside every state of poses.csv that can have
//! stood beside it.

use std::fs;
use std::path::{Path, PathBuf};

use ballbar::wire::{
    Answer, BoardHello, Event, MAX_FRAME, PROTOCOL, ParameterSet, Reply, ResetReason, SampleBatch, Stream, ToHost, encode,
};
use ballbar::{Approach, Direction, JointKind, JointVector, LvdtReading, Sample, SettledPose, StillnessCriteria};
use ballbar_tests::at_length::times;
use ballbar_tests::command::host_cal_in;
use host_cal::board::{RobotOnBoard, nominal_lvdt, parameter_set};
use host_cal::files::open_robot;
use host_cal::session::{
    Connection, MarkedPose, MeasuredPose, PoseMark, Recorder, Run, SessionLock, SettledFate, SettledRule, recover,
};
use tempfile::TempDir;

const KINDS: [JointKind; 6] = [JointKind::Revolute; 6];
pub(super) const ALL_HOMED: u8 = 0x3F;

/// A recording in which every step's outcome is kept.
struct Recording {
    folder: TempDir,
    recorder: Option<Recorder>,
    robot: RobotOnBoard,
    set: ParameterSet,
    rule: SettledRule,
    sequence: u32,
    /// The board's clock at the latest event, microseconds; it samples a thousand times a second.
    t_us: u64,
    states: Vec<State>,
    /// Lengths of the log from which on it holds a pose, and the pose's time, microseconds.
    poses: Vec<(u64, u64)>,
    /// Lengths of the log from which on a pose of this time is erased.
    erased: Vec<(u64, u64)>,
}

/// Length of the log and text of poses.csv after a step.
struct State {
    log_bytes: u64,
    poses: Option<String>,
}

pub(super) fn connection() -> Connection {
    Connection { chuck: "A".into(), sphere: "1".into(), bar_m: 0.46 }
}

fn index_at(t_us: u64) -> u32 {
    (t_us / 1_000) as u32
}

pub(super) fn frame(message: &ToHost) -> Vec<u8> {
    encode(message, &mut [0; MAX_FRAME]).expect("it fits").to_vec()
}

pub(super) fn hello() -> BoardHello {
    BoardHello {
        version: PROTOCOL,
        firmware: "0.9.1".try_into().expect("short"),
        board: "test".try_into().expect("short"),
        unique_id: [7; 12],
        encoders: 6,
        rate_min_hz: 100,
        rate_max_hz: 5_000,
        encoder_skew_ns: 0,
        lvdt_delay_ns: 0,
        uptime_us: 0,
        reset: ResetReason::PowerOn,
        active: None,
    }
}

impl Recording {
    fn new() -> Self {
        let set = parameter_set(&open_robot("puma560").unwrap(), nominal_lvdt(0.075)).unwrap();
        let robot = RobotOnBoard::new(set.clone()).unwrap();
        let (folder, rule) = (TempDir::new().unwrap(), SettledRule::new(StillnessCriteria::default()));
        let (states, poses, erased) = (Vec::new(), Vec::new(), Vec::new());
        let mut recording = Self { folder, recorder: None, robot, set, rule, sequence: 0, t_us: 0, states, poses, erased };
        recording.begin();
        recording
    }

    fn session(&self) -> PathBuf {
        self.folder.path().join("s")
    }

    fn log_bytes(&self) -> u64 {
        fs::metadata(self.session().join("stream.bbl")).map_or(0, |log| log.len())
    }

    /// A run begins, and the one before was killed.
    fn begin(&mut self) {
        self.recorder = None;
        self.recorder = Some(begin(&self.session()));
        self.rule = SettledRule::new(StillnessCriteria::default());
        self.greet();
    }

    fn greet(&mut self) {
        let parameters = ToHost::Reply(Reply { id: 1, outcome: Ok(Answer::Parameters(self.set.clone())) });
        self.put(&ToHost::Hello(hello()));
        self.put(&parameters);
        self.keep_state();
    }

    fn recorder(&mut self) -> &mut Recorder {
        self.recorder.as_mut().expect("a run")
    }

    fn put(&mut self, message: &ToHost) {
        self.recorder().frame(&frame(message)).unwrap();
    }

    fn event(&mut self, homed: u8, event: Event) {
        self.sequence += 1;
        self.put(&ToHost::Stream(Stream { sequence: self.sequence, dropped: 0, overruns: 0, homed, event }));
    }

    fn sample(&mut self) -> &mut Self {
        self.sample_at([5; 6])
    }

    fn sample_at(&mut self, counts: [i32; 6]) -> &mut Self {
        let lvdt = LvdtReading { code: 32_768, saturated: false };
        self.t_us += 1_000;
        let (index, t_us) = (index_at(self.t_us), self.t_us);
        let sample = Sample { index, t_us, counts: counts.into_iter().collect(), lvdt };
        let batch = SampleBatch::new(sample);
        self.rule.take_samples(&self.robot, &batch);
        self.event(ALL_HOMED, Event::Samples(batch));
        self.keep_state();
        self
    }

    /// The arm settles; `stream` decides as it does.
    fn settle(&mut self, t_us: u64, counts: f64, code: f64, homed: u8) -> &mut Self {
        self.t_us = t_us;
        let pose = SettledPose {
            index: index_at(t_us),
            t_us,
            duration_us: 500_001,
            samples: 500,
            counts_mean: [counts; 6].into_iter().collect(),
            counts_std: [0.0; 6].into_iter().collect(),
            code_mean: code,
            code_std: 0.0,
        };
        self.event(homed, Event::Settled(pose.clone()));
        let log_bytes = self.log_bytes();
        self.keep_state();
        let fate = self.rule.judge(&self.robot, &pose, homed);
        if let SettledFate::Kept(pose) = fate
            && self.recorder().writes_poses()
        {
            self.poses.push((log_bytes, us(pose.t_s)));
            self.recorder().poses(&[pose]).unwrap();
        }
        self.keep_state();
        self
    }

    /// What `collect` keeps of a move, or of a stand.
    fn measure(&mut self, times_s: &[f64], plan_row: Option<usize>) -> &mut Self {
        let approach = Approach::UNKNOWN.with(1, Some(Direction::Falling));
        let rate_m_s = (times_s.len() > 1).then_some(0.003);
        let pose = |&t_s: &f64| MeasuredPose { q: JointVector::zero(), approach, displacement_m: 0.001, t_s, rate_m_s, plan_row };
        let poses: Vec<MeasuredPose> = times_s.iter().map(pose).collect();
        let before = self.log_bytes();
        self.recorder().poses(&poses).unwrap();
        // Marks of one kind have one length here.
        let mark_bytes = (self.log_bytes() - before) / poses.len() as u64;
        for (number, pose) in (1..).zip(&poses) {
            self.poses.push((before + number * mark_bytes, us(pose.t_s)));
        }
        self.keep_state();
        self
    }

    fn erase(&mut self) -> &mut Self {
        let erased = self.recorder().erase_last().unwrap();
        let log_bytes = self.log_bytes();
        self.erased.extend(erased.times_us.into_iter().map(|t_us| (log_bytes, t_us)));
        self.keep_state();
        self
    }

    fn connect(&mut self, connection: Option<Connection>) -> &mut Self {
        self.recorder().connect(connection).unwrap();
        self.keep_state();
        self
    }

    fn keep_state(&mut self) {
        let poses = fs::read_to_string(self.session().join("poses.csv")).ok();
        self.states.push(State { log_bytes: self.log_bytes(), poses });
    }

    /// Kills the recording at every moment, resumes it, and looks.
    fn kill_everywhere(mut self) {
        self.recorder = None;
        let session = self.session();
        let [log, description] = ["stream.bbl", "session.toml"].map(|name| fs::read(session.join(name)).unwrap());
        let other = self.folder.path().join("killed");
        let (everywhere, mut killed) = (times() > 1, 0);
        for (i, state) in self.states.iter().enumerate() {
            let begins = i.checked_sub(1).map_or(0, |before| self.states[before].log_bytes);
            // A power cut may leave an older poses.csv than a kill can: all of them are tried at a few places, at length at every byte.
            for cut in begins..=state.log_bytes {
                let is_end = cut == state.log_bytes;
                if !is_end && !everywhere && cut % 7 != 0 && self.is_dull(begins, state.log_bytes) {
                    continue;
                }
                let newest = if is_end { i } else { i.saturating_sub(1) };
                let oldest = if is_end || everywhere || cut % 29 == 0 { 0 } else { newest };
                for poses in oldest..=newest {
                    if poses < newest && self.states[poses].poses == self.states[poses + 1].poses {
                        continue;
                    }
                    let _ = fs::remove_dir_all(&other);
                    fs::create_dir(&other).unwrap();
                    fs::write(other.join("stream.bbl"), &log[..cut as usize]).unwrap();
                    fs::write(other.join("session.toml"), &description).unwrap();
                    if let Some(text) = &self.states[poses].poses {
                        fs::write(other.join("poses.csv"), text).unwrap();
                    }
                    self.check_resumed(&other, cut, self.states[poses].poses.as_deref().unwrap_or_default());
                    killed += 1;
                }
            }
        }
        assert!(killed > 300, "{killed} moments");
    }

    /// Frames in which nothing is decided, and which are long.
    fn is_dull(&self, begins: u64, ends: u64) -> bool {
        ends - begins > 300
    }

    fn check_resumed(&self, session: &Path, cut: u64, before: &str) {
        drop(begin(session));
        let mut expected: Vec<u64> = self.poses.iter().filter(|(from, _)| *from <= cut).map(|(_, t_us)| *t_us).collect();
        expected.retain(|t_us| !self.erased.iter().any(|(from, erased)| *from <= cut && erased == t_us));
        // Nothing that stood in the file is taken out of it.
        for t_us in times_us(before) {
            if !expected.contains(&t_us) {
                expected.push(t_us);
            }
        }
        expected.sort_unstable();
        let text = fs::read_to_string(session.join("poses.csv")).unwrap_or_default();
        let mut found = times_us(&text);
        found.sort_unstable();
        assert_eq!(found, expected, "cut after {cut} bytes");
        let widths: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert!(widths.iter().all(|width| *width == 15) && text.is_empty() | text.ends_with('\n'), "{text}");
    }
}

pub(super) fn begin(session: &Path) -> Recorder {
    let lock = SessionLock::acquire(session).unwrap();
    Recorder::begin(&lock, Run::beginning("port", &hello(), 1_000), Some(&KINDS)).unwrap()
}

fn us(t_s: f64) -> u64 {
    (format!("{t_s:.6}").parse::<f64>().unwrap() * 1e6).round() as u64
}

fn times_us(poses: &str) -> Vec<u64> {
    poses.lines().skip(1).map(|line| us(line.split(',').nth(10).unwrap().parse().unwrap())).collect()
}

#[test]
fn a_killed_stream_loses_no_settled_pose_and_writes_none_twice() {
    let mut recording = Recording::new();
    recording.recorder().connect_for_every_settled(connection(), StillnessCriteria::default()).unwrap();
    recording.keep_state();
    recording.sample().settle(1_000_000, 10.0, 30_000.0, ALL_HOMED).settle(2_000_000, 20.0, 31_000.0, ALL_HOMED).sample();
    // Not homed, and beyond the travel.
    recording.settle(3_000_000, 30.0, 32_000.0, 0x1F).settle(4_000_000, 40.0, 65_535.0, ALL_HOMED);
    recording.settle(5_000_000, 50.0, 33_000.0, ALL_HOMED);
    // The port is lost, and the arm stands where it stood.
    recording.recorder().lost().unwrap();
    recording.rule.lose_port();
    recording.recorder().back().unwrap();
    recording.greet();
    recording.settle(6_000_000, 50.0, 33_000.0, ALL_HOMED).settle(7_000_000, 60.0, 34_000.0, ALL_HOMED);
    // Another run; its board was started anew, and its clock comes by the same times.
    recording.begin();
    recording.recorder().connect_for_every_settled(connection(), StillnessCriteria::default()).unwrap();
    recording.settle(8_000_000, 70.0, 35_000.0, ALL_HOMED);
    assert_eq!(recording.poses.len(), 5);
    recording.kill_everywhere();
}

#[test]
fn a_killed_collection_loses_no_pose_that_was_taken_and_brings_no_erased_one_back() {
    let mut recording = Recording::new();
    recording.settle(900_000, 1.0, 30_000.0, ALL_HOMED);
    assert!(recording.poses.is_empty(), "nobody knows what the bar joins");
    recording.connect(Some(connection()));
    recording.measure(&[1.25], Some(2)).measure(&[2.5, 2.75, 3.25], Some(3)).erase().measure(&[4.5], Some(5));
    recording.connect(None).connect(Some(Connection { chuck: "B".into(), ..connection() })).measure(&[5.5], Some(9)).erase();
    recording.measure(&[6.5], None);
    recording.kill_everywhere();
}

#[test]
fn the_log_tells_what_poses_csv_lacks_and_gives_it_back_but_what_was_taken_out() {
    let mut recording = Recording::new();
    recording.recorder().connect_for_every_settled(connection(), StillnessCriteria::default()).unwrap();
    for i in 1..=5_u32 {
        recording.settle(u64::from(i) * 1_000_000, f64::from(10 * i), 30_000.0 + f64::from(i), ALL_HOMED);
    }
    recording.recorder.take().unwrap().end().unwrap();
    let (folder, poses) = (recording.folder.path(), recording.session().join("poses.csv"));
    let check = || host_cal_in(folder, &["log", "check", "s", "--json"]);
    let whole = fs::read_to_string(&poses).unwrap();
    let report = check();
    assert_eq!((report.code, &report.json()["poses_measured"]), (0, &5.into()), "{}", report.transcript());

    // Lost rows are told and come back; one that is commented out stays out; a comment stays.
    let lines: Vec<&str> = whole.lines().collect();
    let edited = format!("{}\n# dropped by Ann\n#{}\n{}\n", lines[0], lines[2], lines[4]);
    fs::write(&poses, &edited).unwrap();
    let report = check();
    let missing = report.json()["poses_missing"].as_array().unwrap().len();
    assert_eq!((report.code, missing), (1, 3), "{}", report.transcript());
    assert!(host_cal_in(folder, &["log", "check", "s"]).stdout.contains("host-cal log recover s"));
    let recovered = host_cal_in(folder, &["log", "recover", "s", "--json"]);
    assert_eq!((recovered.code, &recovered.json()["poses_recovered"]), (0, &3.into()), "{}", recovered.transcript());
    let text = fs::read_to_string(&poses).unwrap();
    assert!(text.starts_with(&edited) && [1, 3, 5].iter().all(|&i| text.lines().filter(|line| *line == lines[i]).count() == 1));
    assert_eq!(check().code, 0);

    // Without the file, all of it.
    fs::remove_file(&poses).unwrap();
    assert_eq!(check().code, 1);
    let lock = SessionLock::acquire(&recording.session()).unwrap();
    let refused = host_cal_in(folder, &["log", "recover", "s"]);
    assert!(refused.code == 2 && refused.stderr.contains("another program records"), "{}", refused.transcript());
    assert_eq!(recover(&lock).unwrap(), 5);
    assert_eq!(fs::read_to_string(&poses).unwrap(), whole);

    // A file that is damaged is told with its line, and left alone.
    fs::write(&poses, &whole[..whole.len() - 5]).unwrap();
    let report = check();
    assert!(report.code == 2 && report.stderr.contains("poses.csv:6"), "{}", report.transcript());
    drop(lock);
    assert_eq!(host_cal_in(folder, &["log", "recover", "s"]).code, 2);
    assert_eq!(fs::read_to_string(&poses).unwrap(), whole[..whole.len() - 5]);
}

/// Counts of a PUMA's joint 1 fall as it turns the positive way.
#[test]
fn the_log_tells_from_which_sides_the_joints_came() {
    let mut recording = Recording::new();
    recording.recorder().connect_for_every_settled(connection(), StillnessCriteria::default()).unwrap();
    recording.sample().sample_at([900, 900, 5, 5, 5, 5]).settle(1_000_000, 900.0, 30_000.0, ALL_HOMED);
    recording.t_us = 3_000;
    recording.recorder().lost().unwrap();
    recording.rule.lose_port();
    recording.recorder().back().unwrap();
    recording.greet();
    recording.settle(4_000_000, 5.0, 30_000.0, ALL_HOMED);
    recording.recorder.take().unwrap().end().unwrap();
    let poses = recording.session().join("poses.csv");
    let whole = fs::read_to_string(&poses).unwrap();
    let signs: Vec<&str> = whole.lines().skip(1).map(|line| line.split(',').nth(9).unwrap()).collect();
    assert_eq!(signs, ["-+0000", ""], "{whole}");
    fs::remove_file(&poses).unwrap();
    assert_eq!(recover(&SessionLock::acquire(&recording.session()).unwrap()).unwrap(), 2);
    assert_eq!(fs::read_to_string(&poses).unwrap(), whole);
}

#[test]
fn a_session_that_was_begun_without_directions_is_read_and_goes_on_without_them() {
    let mut recording = Recording::new();
    recording.connect(Some(connection())).measure(&[1.25], Some(2));
    // As a program before directions were kept has written it.
    let (marks, session) = ([2.5, 3.5].map(older_mark), recording.session());
    marks.iter().for_each(|mark| recording.recorder().frame(mark).unwrap());
    recording.recorder.take().unwrap().end().unwrap();
    let (poses, without) = (session.join("poses.csv"), |text: &str| text.replace("approach,", "").replace(",0-0000,", ","));
    let older = without(&fs::read_to_string(&poses).unwrap());
    fs::write(&poses, &older).unwrap();
    let mut recorder = begin(&session);
    assert_eq!(recorder.recovered(), 2);
    recorder.connect(Some(connection())).unwrap();
    let approach = Approach::UNKNOWN.with(0, Some(Direction::Rising));
    let q = JointVector::zero();
    let pose = MeasuredPose { q, approach, displacement_m: 0.002, t_s: 4.5, rate_m_s: None, plan_row: Some(3) };
    recorder.poses(&[pose]).unwrap();
    recorder.end().unwrap();
    let text = fs::read_to_string(&poses).unwrap();
    assert!(text.starts_with(&older) && text.lines().count() == 5, "{text}");
    assert!(text.lines().all(|line| line.split(',').count() == 14), "{text}");
    let check = host_cal_in(recording.folder.path(), &["log", "check", "s", "--json"]);
    assert_eq!((check.code, &check.json()["poses_measured"]), (0, &4.into()), "{}", check.transcript());

    // Written anew, the file has what the log knows.
    fs::remove_file(&poses).unwrap();
    assert_eq!(recover(&SessionLock::acquire(&session).unwrap()).unwrap(), 4);
    let anew = fs::read_to_string(&poses).unwrap();
    let signs: Vec<&str> = anew.lines().skip(1).map(|line| line.split(',').nth(9).unwrap()).collect();
    assert_eq!(signs, ["0-0000", "", "", "+00000"], "{anew}");
}

/// The frame of a pose without directions.
fn older_mark(t_s: f64) -> Vec<u8> {
    let pose = MarkedPose { q: vec![0.1; 6], displacement_m: 0.001, t_s, rate_m_s: None, plan_row: None };
    encode(&(b'P', PoseMark::Measured(pose)), &mut [0; MAX_FRAME]).unwrap().to_vec()
}

#[test]
fn a_log_that_is_removed_replaced_or_cut_short_ends_the_recording() {
    type Deed = fn(&Path);
    let deeds: [(&str, Deed); 4] = [
        ("removed", |log| fs::remove_file(log).unwrap()),
        ("put another file", |log| {
            fs::copy(log, log.with_extension("copy")).unwrap();
            fs::rename(log.with_extension("copy"), log).unwrap();
        }),
        ("cut short", |log| fs::write(log, "").unwrap()),
        ("removed", |log| fs::rename(log, log.with_extension("old")).unwrap()),
    ];
    for (what, deed) in deeds {
        let mut recording = Recording::new();
        recording.sample();
        deed(&recording.session().join("stream.bbl"));
        let error = recording.recorder.take().unwrap().end().unwrap_err().to_string();
        assert!(error.contains("stream.bbl: another program has ") && error.contains(what), "{error}");
    }
}

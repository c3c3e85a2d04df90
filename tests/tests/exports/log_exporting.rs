//! `host-cal log export`: one log as CSV, Parquet and MCAP, read back by DuckDB and by Python's mcap.

use std::fs;
use std::path::Path;

use ballbar::wire::{
    Answer, BoardHello, Event, LogMark, MAX_FRAME, PROTOCOL, ParameterSet, PoseBatch, Reply, ResetReason, SampleBatch, Stream,
    StreamedPose, ToHost, ToolPose, encode,
};
use ballbar::{Counts, LvdtReading, Sample, SettledPose};
use ballbar_tests::command::{Run, host_cal_in};
use ballbar_tests::readers;
use host_cal::board::{NOMINAL_TRAVEL_M, RobotOnBoard, nominal_lvdt, parameter_set};
use host_cal::files::open_robot;
use host_cal::session::LogWriter;
use serde_json::Value;
use tempfile::TempDir;

mod outputs;

const ALL: [&str; 8] = ["log", "export", "s", "--csv", "s.csv", "--parquet", "s.parquet", "--json"];

/// A log that is written frame by frame.
struct Log {
    folder: TempDir,
    writer: LogWriter,
    sequence: u32,
}

impl Log {
    fn new() -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        fs::create_dir(folder.path().join("s")).expect("a session");
        let writer = LogWriter::open(&folder.path().join("s/stream.bbl")).expect("a new log");
        Self { folder, writer, sequence: 0 }
    }

    fn put(&mut self, message: &ToHost) -> &mut Self {
        let mut buffer = [0; MAX_FRAME];
        self.writer.frame(encode(message, &mut buffer).expect("it fits")).expect("it is written");
        self
    }

    /// The program is started again.
    fn reopen(&mut self) -> &mut Self {
        self.writer = LogWriter::open(&self.folder.path().join("s/stream.bbl")).expect("the log");
        self
    }

    fn hello(&mut self, uptime_us: u64) -> &mut Self {
        self.hello_of(6, uptime_us)
    }

    fn hello_of(&mut self, encoders: u8, uptime_us: u64) -> &mut Self {
        self.put(&ToHost::Hello(BoardHello {
            version: PROTOCOL,
            firmware: "0.9.1".try_into().expect("short"),
            board: "test".try_into().expect("short"),
            unique_id: [7; 12],
            encoders,
            rate_min_hz: 100,
            rate_max_hz: 5_000,
            encoder_skew_ns: 0,
            lvdt_delay_ns: 0,
            uptime_us,
            reset: ResetReason::PowerOn,
            active: None,
        }))
    }

    fn parameters(&mut self, set: &ParameterSet) -> &mut Self {
        self.put(&ToHost::Reply(Reply { id: 1, outcome: Ok(Answer::Parameters(set.clone())) }))
    }

    fn event(&mut self, event: Event) -> &mut Self {
        self.sequence += 1;
        self.put(&ToHost::Stream(Stream { sequence: self.sequence, dropped: 0, overruns: 0, homed: 0xFF, event }))
    }

    fn sample(&mut self, sample: &Sample) -> &mut Self {
        self.event(Event::Samples(SampleBatch::new(sample.clone())))
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn export(&self, args: &[&str]) -> Run {
        host_cal_in(self.path(), args)
    }

    /// Exports a whole log to all formats; what the readers found in them.
    fn read_back(&self) -> Value {
        self.read_back_after(0).1
    }

    /// Exports to all formats, with this exit code; what was said, and what the readers found in the files.
    fn read_back_after(&self, code: i32) -> (Run, Value) {
        let run = self.export(&[&ALL[..], &["--mcap", "s.mcap"]].concat());
        assert_eq!(run.code, code, "{}", run.transcript());
        let read = read_back(self.path());
        assert_eq!(read["row_count"], run.json()["samples"]);
        (run, read)
    }
}

fn read_back(folder: &Path) -> Value {
    let files = ["s.csv", "s.parquet", "s.mcap"].map(|name| folder.join(name));
    let text = readers::python("log_tables.py", &files.each_ref().map(|file| file.as_path()));
    serde_json::from_str(&text).expect("the reader prints JSON")
}

fn sample(index: u32, counts: &[i32], code: u16) -> Sample {
    let lvdt = LvdtReading { code, saturated: code == u16::MAX };
    Sample { index, t_us: 1_000 * u64::from(index), counts: Counts::from_slice(counts).expect("few"), lvdt }
}

fn set_of(robot: &str) -> ParameterSet {
    parameter_set(&open_robot(robot).expect("a built-in robot"), nominal_lvdt(NOMINAL_TRAVEL_M)).expect("its encoders are known")
}

/// Four of a PUMA's joints, the second sliding.
fn sliding() -> ParameterSet {
    let mut set = set_of("puma560");
    set.kinds.truncate(4);
    set.kinds[1] = ballbar::JointKind::Prismatic;
    set.parameters.truncate(8 * 4 + 6);
    set.encoders.truncate(4);
    set.couplings.retain(|coupling| coupling.joint < 4);
    set
}

fn near(value: &Value, expected: f64) {
    let found = value.as_f64().unwrap_or_else(|| panic!("{value} is no number, {expected} was expected"));
    assert!((found - expected).abs() <= 1e-6, "{found} is not {expected}");
}

const COUNTS: [i32; 6] = [1_000, -20_000, 300_000, -4, 0, i32::MIN];

#[test]
fn parameters_that_come_later_give_columns_to_the_whole_table() {
    if readers::is_skipped() {
        return;
    }
    let mut log = Log::new();
    log.hello(0).sample(&sample(1, &COUNTS, 100));
    log.reopen().hello(0).parameters(&set_of("puma560")).sample(&sample(2, &COUNTS, 30_000));
    log.reopen().hello_of(4, 0).parameters(&sliding()).sample(&sample(3, &COUNTS[..4], u16::MAX));
    // A board that has lost its parameters: those of the run before are not its own.
    log.reopen().hello(0).sample(&sample(4, &COUNTS, 40_000));
    let read = log.read_back();

    let types = &read["types"];
    for (column, kind) in [
        ("segment", "UINTEGER"),
        ("t_us", "BIGINT"),
        ("unix_us", "BIGINT"),
        ("counts6", "INTEGER"),
        ("code", "INTEGER"),
        ("saturated", "BOOLEAN"),
        ("homed", "BOOLEAN"),
        ("q2_deg", "DOUBLE"),
        ("q2_mm", "DOUBLE"),
        ("displacement_mm", "DOUBLE"),
    ] {
        assert_eq!(types[column], kind, "{types}");
    }
    assert_eq!(read["segments"], serde_json::json!([1, 2, 3, 4]));
    for row in [&read["rows"][0], &read["rows"][1]] {
        assert_eq!(row["counts6"], i32::MIN);
        for unknown in ["homed", "q1_deg", "q2_deg", "q2_mm", "displacement_mm"] {
            assert!(row[unknown].is_null(), "{unknown} of {row}");
        }
    }

    let csv = fs::read_to_string(log.path().join("s.csv")).expect("the table");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let field = |line: usize, name: &str| lines[line][lines[0].iter().position(|column| *column == name).expect("a column")];
    let puma = RobotOnBoard::new(set_of("puma560")).expect("usable");
    let q = puma.q(COUNTS.map(f64::from));
    assert_eq!(field(2, "q2_deg"), format!("{:.9}", q.as_array()[1].to_degrees()));
    assert_eq!((field(2, "q2_mm"), field(2, "homed")), ("", "1"));
    let sliding = RobotOnBoard::new(sliding()).expect("usable");
    let q = sliding.q([1_000.0, -20_000.0, 300_000.0, -4.0]);
    assert_eq!(field(3, "q2_mm"), format!("{:.9}", q.as_array()[1] * 1e3));
    assert_eq!((field(3, "q2_deg"), field(3, "counts5"), field(3, "displacement_mm")), ("", "", ""), "a smaller board, a fault");
    assert_eq!((field(3, "q4_deg").is_empty(), field(3, "q5_deg")), (false, ""), "a joint that the smaller robot has not");
    assert_eq!(field(3, "saturated"), "1");
}

#[test]
fn settled_poses_tool_poses_and_losses_are_messages_with_the_boards_time() {
    if readers::is_skipped() {
        return;
    }
    let set = set_of("puma560");
    let mut log = Log::new();
    log.put(&ToHost::Mark(LogMark::Back { unix_ms: 1_700_000_000_123 })).hello(5_000_000).parameters(&set);
    let settled = SettledPose {
        index: 10,
        t_us: 6_000_000,
        duration_us: 500_000,
        samples: 500,
        counts_mean: COUNTS.iter().map(|&counts| f64::from(counts) + 0.25).collect(),
        counts_std: COUNTS.iter().map(|_| 0.5).collect(),
        code_mean: 30_000.5,
        code_std: 2.0,
    };
    log.event(Event::Settled(settled.clone()));
    // A turn about (1, 2, 3), whose axes are no round numbers.
    let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(1.0_f32, 2.0, 3.0).normalize() * 2.5);
    let pose = ToolPose {
        position_m: [0.5, -0.25, 1.125],
        x_axis: turn.matrix().column(0).into_owned().into(),
        y_axis: turn.matrix().column(1).into_owned().into(),
    };
    let streamed = |dt_us, displacement_m| StreamedPose { dt_us, pose, displacement_m };
    let poses = [streamed(0, Some(0.0125)), streamed(2_000, None)].into_iter().collect();
    log.sequence += 3;
    log.event(Event::Poses(PoseBatch { index: 20, stride: 2, t_us: 7_000_000, poses }));
    let mut torn = vec![9; 40];
    torn.push(0);
    log.writer.frame(&torn).expect("it is written");
    log.put(&ToHost::Mark(LogMark::Lost { unix_ms: 1_700_000_009_000 }));
    let (run, read) = log.read_back_after(1);

    let told = run.json();
    assert_eq!((&told["damaged"], &told["gaps"], &told["losses"]["missing"]), (&1.into(), &1.into(), &3.into()));
    assert!(run.stderr.contains("warning: MISSING: 3 messages"), "{}", run.stderr);
    assert_eq!(read["row_count"], 0, "a table of no rows is read as well");
    let found = &read["settled"][0];
    assert_eq!(found["unix_us"], 1_700_000_001_123_000_i64, "one second after the hello");
    assert_eq!((&found["duration_us"], &found["samples"], &found["homed"]), (&500_000.into(), &500.into(), &true.into()));
    near(&found["counts_mean3"], 300_000.25);
    near(&found["counts_std3"], 0.5);
    let (q, displacement_m) = RobotOnBoard::new(set).expect("usable").settled(&settled);
    near(&found["q3_deg"], q.as_array()[2].to_degrees());
    near(&found["displacement_mm"], displacement_m.expect("within its travel") * 1e3);

    let [first, second] = [0, 1].map(|i| &read["bar"][i]);
    near(&first["displacement_mm"], 12.5);
    assert!(second.get("displacement_mm").is_none());
    assert_eq!((&second["index"], &second["unix_us"]), (&22.into(), &1_700_000_002_125_000_i64.into()));
    let found = &read["poses"][0];
    for (i, position) in pose.position_m.iter().enumerate() {
        near(&found["at"][i], f64::from(*position));
        near(&found["axes"][0][i], f64::from(pose.x_axis[i]));
        near(&found["axes"][1][i], f64::from(pose.y_axis[i]));
    }
    let told = [
        "segment 1: recording begins",
        "segment 2: the port is back",
        "board test, firmware 0.9.1",
        "the board uses parameters of PUMA 560",
        "3 messages and 0 samples are missing before this",
        "a frame is torn or damaged",
        "segment 3: the port was lost",
    ];
    assert_eq!(read["log"], serde_json::json!(told));
    assert_eq!(read["metadata"]["log"], "s/stream.bbl");
    assert_eq!(read["metadata"]["board"], format!("test {}, firmware 0.9.1", "07".repeat(12)));
    for (key, value) in read["metadata"].as_object().expect("an object") {
        assert_eq!(&read["facts"][format!("ballbar.{key}")], value, "Parquet says the same of itself");
    }
}

#[test]
fn a_long_log_goes_to_several_row_groups_and_a_cut_one_to_as_much_as_is_whole() {
    if readers::is_skipped() {
        return;
    }
    const SAMPLES: u32 = 140_000;
    let mut log = Log::new();
    log.hello(0).parameters(&set_of("puma560"));
    let nth = |index: u32| sample(index, &COUNTS.map(|counts| counts.wrapping_add(index as i32)), 30_000);
    let mut index = 0;
    while index < SAMPLES {
        let mut batch = SampleBatch::new(nth(index));
        index += 1;
        while batch.push(&nth(index - 1), &nth(index)) {
            index += 1;
        }
        log.event(Event::Samples(batch));
    }
    let whole = log.read_back();
    assert_eq!((&whole["row_count"], &whole["row_groups"]), (&index.into(), &2.into()));
    assert_eq!(whole["rows"][1]["counts1"], 1_000 + index - 1);

    let path = log.path().join("s/stream.bbl");
    let bytes = fs::read(&path).expect("the log");
    fs::write(&path, &bytes[..bytes.len() / 2]).expect("half of it");
    let half = log.read_back();
    let [rows, last] = [&half["row_count"], &half["rows"][1]["index"]].map(|value| value.as_u64().expect("a count"));
    assert!(last + 1 == rows && (60_000..80_000).contains(&rows), "{rows} rows up to {last}");
}

#[test]
fn a_damaged_mark_takes_the_segments_time_and_nothing_else_is_taken_for_it() {
    if readers::is_skipped() {
        return;
    }
    let mut log = Log::new();
    log.hello(0).parameters(&set_of("puma560")).sample(&sample(1_000, &COUNTS, 30_000));
    log.writer.frame(&[&[9; 40][..], &[0]].concat()).expect("it is written");
    // Another start of the board: its numbers and its clock begin anew, and it has not said which parameters it uses.
    log.sequence = 0;
    log.hello(0).sample(&sample(5, &COUNTS, 30_000));
    let path = log.path().join("s/stream.bbl");
    let mut bytes = fs::read(&path).expect("the log");
    let (run, read) = log.read_back_after(1);
    assert_eq!((&run.json()["damaged"], &run.json()["losses"]["missing"]), (&1.into(), &0.into()));
    let [first, second] = [0, 1].map(|row| &read["rows"][row]);
    assert!(first["unix_us"].is_i64() && first["q1_deg"].is_f64(), "{first}");
    assert!(second["segment"] == 2 && second["unix_us"].is_null() && second["q1_deg"].is_null(), "{second}");
    assert!(read["log"].as_array().expect("a list").contains(&"segment 2: its mark is damaged, its time unknown".into()));

    // Now the first mark, behind the header's fifteen bytes, as well: there is no mark left to tell any time.
    bytes[17] ^= 0x40;
    fs::write(&path, &bytes).expect("the log");
    log.reopen();
    let (_, read) = log.read_back_after(1);
    assert_eq!(read["segments"], serde_json::json!([1, 2]));
    assert!(read["rows"][0]["unix_us"].is_null(), "and the times of messages are near the mark of the last run");
}

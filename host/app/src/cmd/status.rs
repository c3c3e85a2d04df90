//! `host-cal status`: how the board is.

use ballbar::Stillness;
use ballbar::wire::{Answer, BoardHello, Check, Command, ResetReason, SelfTest, SetIdentity, SlotState, Status};
use clap::Args;
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::port::PortArgs;
use super::report::{Report, print};
use crate::board::{BoardError, reset};
use crate::remedies::Remedied;
use crate::terminal::table::Columns;
use crate::text::one_line;

/// How the board is: counters, encoders, parameters, self-test
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal status /dev/ttyUSB0\n\nExit code 1 when a self-test fails. A board that was just built fails those of parameters and slots until `host-cal apply`."
)]
pub(super) struct StatusArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Reset the board first, and wait until it is back
    #[arg(long)]
    reset: bool,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct StatusReport {
    port: String,
    board: String,
    unique_id: String,
    firmware: String,
    protocol: u16,
    uptime_s: f64,
    started_by: String,
    rate_hz: u16,
    streaming: bool,
    samples: u32,
    overruns: u32,
    stream_messages: u32,
    dropped: u32,
    frames: FramesFromHost,
    encoders: Vec<EncoderLine>,
    lvdt_code: u16,
    lvdt_saturated: bool,
    lvdt_faults: u32,
    stillness: &'static str,
    robot: Option<RobotLine>,
    /// What was in use before, and can be brought back.
    previous: Option<RobotLine>,
    staged_crc: Option<String>,
    slots: [String; 2],
    stack_unused_bytes: u32,
    encoder_skew_ns: u32,
    lvdt_delay_ns: u32,
    self_test: Vec<TestLine>,
}

#[derive(Serialize)]
struct FramesFromHost {
    good: u32,
    crc: u32,
    malformed: u32,
    missing: u32,
}

#[derive(Serialize)]
struct EncoderLine {
    counts: i32,
    homed: bool,
    index_pulses: u32,
    index_errors: u32,
}

#[derive(Serialize)]
struct RobotLine {
    name: String,
    calibrated: bool,
    joints: u8,
    crc: String,
    sequence: u32,
}

impl From<&SetIdentity> for RobotLine {
    fn from(set: &SetIdentity) -> Self {
        Self {
            name: set.name.as_str().to_owned(),
            calibrated: set.is_calibrated,
            joints: set.joints,
            crc: format!("{:08x}", set.crc),
            sequence: set.sequence,
        }
    }
}

impl RobotLine {
    fn text(&self) -> String {
        let what = if self.calibrated { "calibrated" } else { "not calibrated" };
        format!("{} ({what}), {} joints, commit {}, CRC {}", one_line(&self.name), self.joints, self.sequence, self.crc)
    }
}

#[derive(Serialize)]
struct TestLine {
    test: &'static str,
    passed: bool,
}

impl StatusArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let mut link = self.port.connect()?;
        if self.reset {
            link = reset(link, self.port.baud).map_err(Remedied)?;
        }
        let Answer::Status(status) = link.request(Command::Status)? else {
            return Err(BoardError::WrongAnswer { command: "status" }.into());
        };
        let Answer::SelfTest(self_test) = link.request(Command::SelfTest)? else {
            return Err(BoardError::WrongAnswer { command: "self-test" }.into());
        };
        let report = StatusReport::new(&self.port.port, link.hello(), &status, &self_test);
        print(&report, self.output.json)?;
        Ok(if report.self_test.iter().all(|test| test.passed) { Outcome::Good } else { Outcome::Doubtful })
    }
}

impl StatusReport {
    fn new(port: &str, hello: &BoardHello, status: &Status, self_test: &SelfTest) -> Self {
        let hex = |crc: u32| format!("{crc:08x}");
        Self {
            port: port.to_owned(),
            board: hello.board.as_str().to_owned(),
            unique_id: hello.unique_id.iter().map(|byte| format!("{byte:02x}")).collect(),
            firmware: hello.firmware.as_str().to_owned(),
            protocol: hello.version.number,
            uptime_s: status.uptime_us as f64 * 1e-6,
            started_by: reset_text(&hello.reset),
            rate_hz: status.rate_hz,
            streaming: status.streaming.is_some(),
            samples: status.samples,
            overruns: status.overruns,
            stream_messages: status.stream_messages,
            dropped: status.dropped,
            frames: FramesFromHost {
                good: status.link.good,
                crc: status.link.crc,
                malformed: status.link.malformed,
                missing: status.link.missing,
            },
            encoders: status
                .encoders
                .iter()
                .map(|encoder| EncoderLine {
                    counts: encoder.counts,
                    homed: encoder.is_homed,
                    index_pulses: encoder.index_pulses,
                    index_errors: encoder.index_errors,
                })
                .collect(),
            lvdt_code: status.lvdt.code,
            lvdt_saturated: status.lvdt.saturated,
            lvdt_faults: status.lvdt_faults,
            stillness: match status.stillness {
                Stillness::Moving => "moving",
                Stillness::Settling => "settling",
                Stillness::Settled => "settled",
            },
            robot: status.active.as_ref().map(RobotLine::from),
            previous: status.previous.as_ref().map(RobotLine::from),
            staged_crc: status.staged.map(hex),
            slots: status.slots.map(|slot| match slot {
                SlotState::Empty => "empty".to_owned(),
                SlotState::Damaged => "damaged".to_owned(),
                SlotState::Good { sequence, crc } => format!("commit {sequence}, CRC {crc:08x}"),
            }),
            stack_unused_bytes: status.stack_unused_bytes,
            encoder_skew_ns: hello.encoder_skew_ns,
            lvdt_delay_ns: hello.lvdt_delay_ns,
            self_test: self_test.results.iter().map(|r| TestLine { test: test_name(r.check), passed: r.passed }).collect(),
        }
    }
}

fn reset_text(reason: &ResetReason) -> String {
    match reason {
        ResetReason::PowerOn => "power-on".into(),
        ResetReason::BrownOut => "brown-out: the supply sagged".into(),
        ResetReason::Pin => "the reset pin".into(),
        ResetReason::Software => "a reset that was asked for".into(),
        ResetReason::Watchdog => "the WATCHDOG: the firmware stood still".into(),
        ResetReason::Panic(message) => format!("a PANIC of the firmware: {message}"),
        ResetReason::Unknown => "an unknown reset".into(),
    }
}

fn test_name(check: Check) -> &'static str {
    match check {
        Check::Sampling => "samples arrive",
        Check::Overruns => "no sample was lost",
        Check::LvdtSignal => "the LVDT's signal is within the converter's range",
        Check::Index => "index pulses come whole turns apart",
        Check::Parameters => "the parameters in use are those in flash",
        Check::Slots => "both places in flash hold a whole set",
        Check::Kinematics => "the kinematics computes a known pose",
        Check::Stack => "a quarter of the stack was never used",
    }
}

impl Report for StatusReport {
    fn text(&self) -> String {
        let mut text = format!(
            "{}: board {} {}, firmware {}, protocol {}\nup {:.1} s, started by {}\n",
            one_line(&self.port),
            one_line(&self.board),
            self.unique_id,
            one_line(&self.firmware),
            self.protocol,
            self.uptime_s,
            self.started_by
        );
        text += &match &self.robot {
            Some(robot) => format!("robot {}\n", robot.text()),
            None => "no parameters: host-cal apply PORT --robot calibrated.toml\n".into(),
        };
        if let Some(previous) = &self.previous {
            text += &format!("before it {}; back with host-cal apply PORT --previous\n", previous.text());
        }
        text += &format!("flash: {}; {}\n", self.slots[0], self.slots[1]);
        text += &format!(
            "{} Hz, {} samples, {} overruns; {} stream messages, {} dropped; {}\n",
            self.rate_hz,
            self.samples,
            self.overruns,
            self.stream_messages,
            self.dropped,
            if self.streaming { "streaming" } else { "not streaming" }
        );
        text += &format!(
            "from the host: {} frames, {} with a wrong CRC, {} malformed, {} requests missing\n",
            self.frames.good, self.frames.crc, self.frames.malformed, self.frames.missing
        );
        let saturated = if self.lvdt_saturated { " (saturated)" } else { "" };
        text += &format!("LVDT code {}{saturated}, {} faults; {}\n", self.lvdt_code, self.lvdt_faults, self.stillness);
        text += &format!(
            "encoders within {} ns, LVDT {} ns later; {} bytes of stack never used\n\n",
            self.encoder_skew_ns, self.lvdt_delay_ns, self.stack_unused_bytes
        );
        let mut table = Columns::new(&["encoder", "counts", "<homed", "index pulses", "errors"]);
        for (i, encoder) in self.encoders.iter().enumerate() {
            let homed = if encoder.homed { "yes" } else { "no" };
            let [counts, pulses, errors] =
                [encoder.counts.to_string(), encoder.index_pulses.to_string(), encoder.index_errors.to_string()];
            table.row([(i + 1).to_string(), counts, homed.to_owned(), pulses, errors]);
        }
        text += &table.text();
        text += "\n";
        for test in &self.self_test {
            text += &format!("{}  {}\n", if test.passed { "ok    " } else { "FAILED" }, test.test);
        }
        text
    }
}

//! What can go wrong between the host and a board.

use ballbar::LvdtCurve;
use ballbar::wire::{ProtocolVersion, Refusal};
use miette::Diagnostic;
use thiserror::Error;

use super::plausible::Implausible;

/// A serial port that cannot be opened, or is gone.
#[derive(Debug, Error, Diagnostic)]
pub enum PortError {
    /// There is no such port.
    #[error("{name}: there is no such port")]
    #[diagnostic(help("{known}"))]
    Absent {
        /// The port.
        name: String,
        /// What ports there are, in a sentence.
        known: String,
    },
    /// Another program has it, or it may not be used.
    #[error("{name}: the port cannot be opened: {reason}")]
    #[diagnostic(help(
        "Does another program use it? May you? On Linux serial ports belong to the group `dialout`: sudo usermod -aG dialout $USER, then log in again."
    ))]
    Refused {
        /// The port.
        name: String,
        /// The operating system's reason.
        reason: String,
    },
    /// It was there and is gone.
    #[error("{name}: the port is gone: {reason}")]
    #[diagnostic(help("Was the cable pulled or the board switched off?"))]
    Lost {
        /// The port.
        name: String,
        /// The operating system's reason.
        reason: String,
    },
}

/// A conversation with a board that did not lead to what was asked.
#[derive(Debug, Error, Diagnostic)]
pub enum BoardError {
    /// The port.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Port(#[from] PortError),
    /// Nothing that could be a board answered.
    #[error("{port}: no board answers")]
    #[diagnostic(help(
        "Is it the right port, is the board powered, does its lamp blink? `host-cal ports` lists the ports. {heard}"
    ))]
    Silent {
        /// The port.
        port: String,
        /// What was heard instead, in a sentence.
        heard: String,
    },
    /// The board speaks another version of the protocol.
    #[error("{port}: the board speaks protocol {}, this program {}", version(.board), version(.host))]
    #[diagnostic(help("Flash the firmware of this program's version, or use the program of the firmware's; see docs/board.md."))]
    OtherVersion {
        /// The port.
        port: String,
        /// What the board speaks.
        board: ProtocolVersion,
        /// What this program speaks.
        host: ProtocolVersion,
    },
    /// A request was not answered, although it was repeated.
    #[error("{port}: the board did not answer `{command}`")]
    #[diagnostic(help("Nothing tells whether it was carried out. `host-cal status {port}` shows how the board is."))]
    NoReply {
        /// The port.
        port: String,
        /// The command.
        command: &'static str,
    },
    /// The board refused.
    #[error("the board refuses `{command}`: {}", refusal_text(.refusal))]
    #[diagnostic(help("{}", refusal_help(.refusal)))]
    Refused {
        /// The command.
        command: &'static str,
        /// Its reason.
        refusal: Refusal,
    },
    /// The reply cannot be true.
    #[error("the board answers `{command}` with what cannot be true: {reason}")]
    #[diagnostic(help(
        "Is the board sound, are its parameters those of its robot? `host-cal status PORT` shows what it holds; `host-cal apply PORT` stores anew."
    ))]
    Implausible {
        /// The command.
        command: &'static str,
        /// What cannot be true.
        reason: Implausible,
    },
    /// It streams more than any board while a request waits for its answer.
    #[error("{port}: more comes than any board sends, and no answer to what was asked")]
    #[diagnostic(help("Is it the right port? `host-cal ports` lists the ports."))]
    Flood {
        /// The port.
        port: String,
    },
    /// The user wants to end.
    #[error("ended by Ctrl-C or a signal")]
    Stopped,
    /// The reply belongs to another command, which no board of this version sends.
    #[error("the board answers `{command}` with something else")]
    WrongAnswer {
        /// The command.
        command: &'static str,
    },
}

fn version(version: &ProtocolVersion) -> String {
    let hash: String = version.schema.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{} (messages {hash})", version.number)
}

fn refusal_text(refusal: &Refusal) -> String {
    match refusal {
        Refusal::HelloFirst => "it was reset and has not been greeted since".into(),
        Refusal::NotUnderstood => "it does not understand the message".into(),
        Refusal::Rate { min_hz, max_hz } => format!("the rate must be {min_hz} to {max_hz} Hz"),
        Refusal::Stillness => "a pose must hold for 10 ms to 60 s".into(),
        Refusal::NothingSelected => "nothing was selected to stream".into(),
        Refusal::Joint { joints } => format!("there are {joints} joints"),
        Refusal::NotFinite => "a value or the pose is no finite number".into(),
        Refusal::LvdtCurve => LvdtCurve::VALID.into(),
        Refusal::Parameters(error) => error.to_string(),
        Refusal::TooManyJoints { joints, encoders } => format!("the robot has {joints} joints, the board {encoders} encoders"),
        Refusal::NoParameters => "it holds no parameters".into(),
        Refusal::OtherCrc { staged } => format!("other parameters are staged (CRC {staged:08x})"),
        Refusal::Streaming => "storing stops the sampling for half a second, and a stream is running".into(),
        Refusal::Moving => "storing stops the sampling for half a second, and the robot is moving".into(),
        Refusal::Flash => "its flash could not be written; the old parameters are still in use".into(),
        Refusal::NoSample => "it has not taken a sample yet".into(),
        Refusal::NoPrevious => "its flash holds no parameters other than those in use".into(),
    }
}

fn refusal_help(refusal: &Refusal) -> &'static str {
    match refusal {
        Refusal::HelloFirst => "Try again.",
        Refusal::NoParameters => "Upload a robot first: host-cal apply PORT --robot calibrated.toml",
        Refusal::Streaming => "End the stream first: another host-cal may be running.",
        Refusal::NoPrevious => {
            "Only what the last commit replaced can be brought back. Upload a robot's file: host-cal apply PORT --robot robot.toml"
        }
        Refusal::Moving => "Let the robot stand still, and try again.",
        Refusal::Flash => "Try again; if it stays so, the flash is worn out.",
        _ => "Nothing was changed.",
    }
}

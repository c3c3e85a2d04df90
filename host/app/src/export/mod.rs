//! A robot in the formats of others: one file a format, and remarks on what a format cannot hold.

mod code;
mod data;
mod dh;
mod urdf;

use miette::Diagnostic;
use thiserror::Error;

use crate::files::FileKind;
use ballbar_calib::kinematics::{Convention, NearlyParallel};
use ballbar_calib::model::Robot;

/// What to write a robot as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Robot description of ROS
    Urdf,
    /// ROS 2 parameter file with the URDF as robot_description
    Ros2,
    /// Denavit-Hartenberg table, CSV
    Dh,
    /// Modified Denavit-Hartenberg table (Craig), CSV
    Mdh,
    /// Chain as JSON, metres and radians
    Json,
    /// Chain as YAML, metres and radians
    Yaml,
    /// Parameters as CSV, millimetres and degrees
    Csv,
    /// C header, metres and radians
    C,
    /// Rust constants, metres and radians
    Rust,
    /// MATLAB or Octave function that computes the tool's pose, metres and radians
    Octave,
}

impl Format {
    /// What a file of this format is.
    pub fn kind(self) -> FileKind {
        match self {
            Self::Urdf => FileKind::Urdf,
            Self::Ros2 => FileKind::Ros2,
            Self::Dh | Self::Mdh => FileKind::DhTable,
            Self::Json => FileKind::RobotJson,
            Self::Yaml => FileKind::RobotYaml,
            Self::Csv => FileKind::RobotCsv,
            Self::C => FileKind::CHeader,
            Self::Rust => FileKind::RustConstants,
            Self::Octave => FileKind::OctaveFunction,
        }
    }
}

/// Where the joint values of a URDF are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum JointZero {
    /// Joint value = offset + scale * encoder output: links are as in the robot file
    #[default]
    Model,
    /// Joint value = scale * encoder output: offsets are in the origins
    Encoder,
}

/// What every format says of its numbers.
const MODEL: &str = "tool in base = link 1, joint 1, ... joint J, link J+1; link = Trans(x, y, z) Rz(alpha) Ry(beta) Rx(gamma); \
                     joint = Rz (revolute) or Trans_z (prismatic) of offset + scale * encoder output";

/// A robot's text, and what its reader should know.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// Contents of the file.
    pub text: String,
    /// What the format cannot hold, where that went, and what looks like a fault and is none.
    pub remarks: Vec<String>,
    /// Of a format with another model: the largest differences to the robot over random joint vectors, metres and radians.
    pub largest_difference: Option<(f64, f64)>,
    /// Of a DH table: axes whose common normal is far away.
    pub nearly_parallel: Vec<NearlyParallel>,
}

/// A robot that JSON cannot hold.
#[derive(Debug, Error, Diagnostic)]
#[error("the robot cannot be written as JSON: {0}")]
#[diagnostic(help("Every robot that was read can be: this is a fault of the program. Another --format may do meanwhile."))]
pub struct NoJson(#[from] serde_json::Error);

/// Writes a robot in a format; `zero` is for those that hold a URDF.
///
/// # Errors
/// [`NoJson`] of JSON alone.
pub fn export(robot: &Robot, format: Format, zero: JointZero) -> Result<Exported, NoJson> {
    let exact = |text| Exported { text, remarks: Vec::new(), largest_difference: None, nearly_parallel: Vec::new() };
    Ok(match format {
        Format::Urdf => Exported { remarks: urdf::remarks(robot, zero), ..exact(urdf::text(robot, zero)) },
        Format::Ros2 => Exported { remarks: urdf::remarks(robot, zero), ..exact(urdf::ros2_parameters(robot, zero)) },
        Format::Dh => dh::exported(robot, Convention::Standard),
        Format::Mdh => dh::exported(robot, Convention::Modified),
        Format::Json => exact(data::json(robot)?),
        Format::Yaml => exact(data::yaml(robot)),
        Format::Csv => exact(data::csv(robot)),
        Format::C => exact(code::c_header(robot)),
        Format::Rust => exact(code::rust_constants(robot)),
        Format::Octave => exact(code::octave_function(robot)),
    })
}

/// A robot's name with nothing that could end a comment or a quoted text, or go on on another line.
fn plain_name(robot: &Robot) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || " _-.,()".contains(c);
    robot.name.chars().take(120).map(|c| if is_plain(c) { c } else { '_' }).collect()
}

/// The model's words as lines of a comment, each behind a mark.
fn model_lines(mark: &str) -> String {
    MODEL.split("; ").map(|line| format!("{mark}{line}\n")).collect()
}

/// Where a robot's numbers come from, in a line for a comment.
fn origin(robot: &Robot) -> String {
    format!("{}: {}. Written by host-cal {}.", plain_name(robot), robot.standing(), env!("CARGO_PKG_VERSION"))
}

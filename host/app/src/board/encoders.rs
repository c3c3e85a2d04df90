//! How a board counts a robot's encoders.

use ballbar::{EncoderError, JointEncoders, JointKind};
use ballbar_calib::model::Robot;
use miette::Diagnostic;
use thiserror::Error;

/// A robot's file says too little of its encoders for a board to count with them.
#[derive(Debug, Error, Diagnostic)]
#[error("{robot}: {reason}, which the board needs to know")]
#[diagnostic(help("Give every joint `counts_per_rev` (or `counts_per_mm`) and `sign`; see docs/files.md."))]
pub struct NoEncoders {
    robot: String,
    reason: String,
}

/// The map between encoder positions and joint values.
///
/// # Errors
/// [`NoEncoders`] when the file does not say how every joint counts.
pub fn joint_encoders(robot: &Robot) -> Result<JointEncoders<f64>, NoEncoders> {
    let missing = robot.encoders.iter().position(|facts| facts.encoder.is_none());
    let because = |reason| NoEncoders { robot: robot.source.clone(), reason };
    if let Some(i) = missing {
        let key = match robot.chain.joint_kinds()[i] {
            JointKind::Revolute => "counts_per_rev",
            JointKind::Prismatic => "counts_per_mm",
        };
        return Err(because(format!("joint {} has no `{key}`", i + 1)));
    }
    let encoders: Vec<_> = robot.encoders.iter().filter_map(|facts| facts.encoder).collect();
    let couplings: Vec<_> = robot.encoders.iter().flat_map(|facts| facts.couplings.iter().copied()).collect();
    JointEncoders::new(&encoders, &couplings).map_err(|error: EncoderError| because(error.to_string()))
}

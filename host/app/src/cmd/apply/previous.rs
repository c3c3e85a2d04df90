//! `host-cal apply --previous`: the parameters that the last commit replaced, which the other place in flash still holds.

use ballbar::wire::{Answer, Command};
use ballbar_calib::model::JointLimits;
use miette::Diagnostic;
use thiserror::Error;

use super::super::outcome::CommandError;
use super::{ApplyReport, in_use, store};
use crate::board::{BoardError, BoardLink, RobotOnBoard};

#[derive(Debug, Error, Diagnostic)]
#[error("the parameters before, of `{name}`, cannot be used: {reason}")]
#[diagnostic(help("Nothing was changed on the board. Upload a robot's file: host-cal apply PORT --robot robot.toml"))]
struct Unusable {
    name: String,
    reason: String,
}

/// Reads them, and stores them as an upload does: staged, verified, committed by their CRC. The board writes so little that no
/// power cut costs either set.
pub(super) fn bring_back(link: &mut BoardLink, vectors: usize) -> Result<ApplyReport, CommandError> {
    // A program that was killed may have left a stream running, and storing would stall it.
    link.act(Command::StopStream)?;
    let old = in_use(link)?;
    let Answer::Parameters(set) = link.request(Command::ReadPrevious)? else {
        return Err(BoardError::WrongAnswer { command: "read previous parameters" }.into());
    };
    let chain = set.compile().and_then(|_| set.chain());
    let chain = chain.map_err(|error| Unusable { name: set.name.as_str().to_owned(), reason: error.to_string() })?;
    // The board does not know the joint limits.
    let limits: Vec<_> = set
        .usual_ranges()
        .into_iter()
        .map(|range| JointLimits { min: f64::from(*range.start()), max: f64::from(*range.end()) })
        .collect();
    let stored = store(link, &set, &chain.cast(), &limits, vectors)?;
    Ok(ApplyReport::new(link, &set, old.as_ref().map(RobotOnBoard::set), &stored, "as it was with them"))
}

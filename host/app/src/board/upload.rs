//! Putting a robot on a board: nothing is stored that the board was not seen to compute right.

use std::num::NonZeroUsize;

use ballbar::wire::{Answer, Command, MAX_PAYLOAD, ParameterSet, ParameterSetError, WhichSet};
use ballbar::{Kinematics, LvdtCurve};
use ballbar_calib::model::{JointLimits, Robot, Standing};
use serde::Serialize;
use thiserror::Error;

use super::errors::BoardError;
use super::link::BoardLink;
use super::plausible::Implausible;
use super::robot_on_board::{NOMINAL_TRAVEL_M, RobotOnBoard, SetError, nominal_lvdt, parameter_set};
use super::verify::{KinematicsDifference, rounding_of_kinematics, verify_kinematics};

/// Which robots may be put on a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Admission {
    /// Those whose fit was found to be good.
    Calibrated,
    /// Any, whatever stands behind its parameters.
    Any,
}

/// A robot that may be put on a board, and that a board's arithmetic is good enough for.
#[derive(Clone, Copy, Debug)]
pub struct Upload<'a> {
    robot: &'a Robot,
    /// Joint vectors at which the kinematics are compared.
    vectors: NonZeroUsize,
}

/// What is met on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UploadStep {
    /// What the board uses is not to be believed, and is replaced unseen.
    Unseen(Implausible),
    /// The board has no LVDT curve, so that a nominal one goes with the robot.
    NominalLvdt,
    /// The board's kinematics were compared at one more joint vector.
    Compared,
}

/// How a robot came to be on a board.
#[derive(Clone, Debug, PartialEq)]
pub struct Uploaded {
    /// What the board uses now.
    pub stored: SetSummary,
    /// What it used before; `None` when that was nothing, or nothing to be believed.
    pub replaced: Option<SetSummary>,
    /// Commits that this board has seen.
    pub sequence: u32,
    /// Between the board's kinematics and this program's.
    pub difference: KinematicsDifference,
    /// Where its LVDT curve comes from.
    pub lvdt: LvdtOrigin,
}

/// A set of parameters in short.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetSummary {
    /// The robot's name, as far as the board keeps it.
    pub name: String,
    /// Whether a fit made the parameters.
    pub is_calibrated: bool,
    /// CRC-32 of the set.
    pub crc: u32,
}

/// Where the LVDT curve that goes with a robot comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LvdtOrigin {
    /// The board had it.
    Kept,
    /// It is the nominal one.
    Nominal,
    /// It belongs to the set that was brought back.
    BroughtBack,
}

/// Why a robot is not on the board, or is not to be trusted there.
#[derive(Debug, Error)]
pub enum UploadError {
    /// The board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The robot's file cannot be put on any board.
    #[error(transparent)]
    Set(#[from] SetError),
    /// It is a design, and only calibrated robots are admitted.
    #[error("{robot} has no [calibration]: it holds design parameters, not fitted ones")]
    NotCalibrated {
        /// The file.
        robot: String,
    },
    /// It was fitted, nobody knows how well, and only calibrated robots are admitted.
    #[error("{robot}: its [calibration] has no verdict, so that nothing says the fit was good")]
    NotJudged {
        /// The file.
        robot: String,
    },
    /// This board counts fewer encoders than the robot has joints.
    #[error("{robot} has {joints} joints, but the board counts {encoders} encoders")]
    TooManyJoints {
        /// The file.
        robot: String,
        /// Joints of the robot.
        joints: usize,
        /// Encoders of the board.
        encoders: u8,
    },
    /// Single precision is not enough for this robot.
    #[error(
        "{robot}: in single precision, as the board computes, poses are off by up to {:.3} µm and {:.3} µrad",
        .rounding.position_m * 1e6,
        .rounding.axis_rad * 1e6
    )]
    Coarse {
        /// The file.
        robot: String,
        /// What the rounding does.
        rounding: KinematicsDifference,
    },
    /// No message has room for the parameters.
    #[error("the parameters are longer than a message to the board may be")]
    TooLong,
    /// The board gives back something else than it was given.
    #[error(
        "the {} parameters read back from the board are not those that were sent",
        match .0 { WhichSet::Staged => "staged", WhichSet::Active => "stored" }
    )]
    ReadBack(WhichSet),
    /// The board computes other poses.
    #[error(
        "the board's kinematics differ from this program's by {:.3} µm and {:.3} µrad",
        .0.position_m * 1e6,
        .0.axis_rad * 1e6
    )]
    Kinematics(KinematicsDifference),
    /// What the board used before cannot be computed with.
    #[error("the parameters before, of `{name}`, cannot be used: {reason}")]
    Unusable {
        /// The robot's name.
        name: String,
        /// What is wrong with them.
        reason: String,
    },
}

impl<'a> Upload<'a> {
    /// Finds all that can be wrong with the robot before a board is spoken to. The kinematics are compared at `vectors` joint vectors.
    ///
    /// # Errors
    /// [`UploadError::NotCalibrated`], [`UploadError::NotJudged`], [`UploadError::Set`], [`UploadError::Coarse`].
    pub fn new(robot: &'a Robot, admission: Admission, vectors: NonZeroUsize) -> Result<Self, UploadError> {
        let name = || robot.source.clone();
        match (admission, robot.standing()) {
            (Admission::Any, _) | (Admission::Calibrated, Standing::Calibrated | Standing::Reserved) => {}
            (Admission::Calibrated, Standing::NotJudged) => return Err(UploadError::NotJudged { robot: name() }),
            (Admission::Calibrated, Standing::Design) => return Err(UploadError::NotCalibrated { robot: name() }),
        }
        let set = parameter_set(robot, nominal_lvdt(NOMINAL_TRAVEL_M))?;
        if let Ok(compiled) = set.compile() {
            let rounding = rounding_of_kinematics(&robot.kinematics(), &robot.limits, &compiled, vectors.get());
            if !rounding.is_small() {
                return Err(UploadError::Coarse { robot: name(), rounding });
            }
        }
        Ok(Self { robot, vectors })
    }

    /// Puts the robot in place of what the board uses: staged, read back, verified, committed by its CRC, read back. The board's LVDT curve
    /// stays, if it has one.
    ///
    /// # Errors
    /// [`UploadError`]. Until the commit the board keeps what it had; after it only [`UploadError::ReadBack`] of [`WhichSet::Active`] and
    /// [`UploadError::Board`] can still come.
    pub fn put(&self, link: &mut BoardLink, on_step: &mut dyn FnMut(UploadStep)) -> Result<Uploaded, UploadError> {
        let robot = self.robot;
        let (joints, encoders) = (robot.chain.joints(), link.hello().encoders);
        if joints > usize::from(encoders) {
            return Err(UploadError::TooManyJoints { robot: robot.source.clone(), joints, encoders });
        }
        let replaced = in_use(link, on_step)?;
        let (curve, lvdt) = match &replaced {
            Some((_, curve)) => (*curve, LvdtOrigin::Kept),
            None => {
                on_step(UploadStep::NominalLvdt);
                (nominal_lvdt(NOMINAL_TRAVEL_M), LvdtOrigin::Nominal)
            }
        };
        let set = parameter_set(robot, curve)?;
        let wanted = Wanted { set, kinematics: &robot.kinematics(), limits: &robot.limits, vectors: self.vectors };
        Ok(store(link, &wanted, on_step)?.uploaded(replaced.map(|(old, _)| old), lvdt))
    }
}

/// Brings back what the last commit replaced, which the other place in flash still holds: stored as an upload is. The board writes so
/// little that no power cut costs either set.
///
/// # Errors
/// [`UploadError`], as of [`Upload::put`].
pub fn bring_back(
    link: &mut BoardLink,
    vectors: NonZeroUsize,
    on_step: &mut dyn FnMut(UploadStep),
) -> Result<Uploaded, UploadError> {
    let replaced = in_use(link, on_step)?;
    let Answer::Parameters(set) = link.request(Command::ReadPrevious)? else {
        return Err(BoardError::WrongAnswer { command: "read previous parameters" }.into());
    };
    let kinematics = kinematics_of(&set);
    let kinematics =
        kinematics.map_err(|error| UploadError::Unusable { name: set.name.as_str().to_owned(), reason: error.to_string() })?;
    // The board does not know the joint limits.
    let limits: Vec<_> = set
        .usual_ranges()
        .into_iter()
        .map(|range| JointLimits { min: f64::from(*range.start()), max: f64::from(*range.end()) })
        .collect();
    let stored = store(link, &Wanted { set, kinematics: &kinematics, limits: &limits, vectors }, on_step)?;
    Ok(stored.uploaded(replaced.map(|(old, _)| old), LvdtOrigin::BroughtBack))
}

/// What the board uses, with its LVDT curve; nothing where that is not to be believed.
fn in_use(link: &mut BoardLink, on_step: &mut dyn FnMut(UploadStep)) -> Result<Option<(SetSummary, LvdtCurve)>, UploadError> {
    // A program that was killed may have left a stream running, and storing would stall it.
    link.act(Command::StopStream)?;
    match RobotOnBoard::read(link) {
        Ok(None) => Ok(None),
        Ok(Some((old, _))) => {
            let crc = ballbar::crc32(&bytes_of(old.set())?);
            Ok(Some((SetSummary::new(old.set(), crc), old.set().lvdt)))
        }
        Err(BoardError::Implausible { reason, .. }) => {
            on_step(UploadStep::Unseen(reason));
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

/// What a set computes, in this program's precision.
fn kinematics_of(set: &ParameterSet) -> Result<Kinematics<f64>, ParameterSetError> {
    set.compile()?;
    Ok(Kinematics::with_terms(&set.chain()?.cast(), &set.joint_terms()?.cast()))
}

/// A set for the board, with which it is to compute what `kinematics` do within `limits`.
struct Wanted<'a> {
    set: ParameterSet,
    kinematics: &'a Kinematics<f64>,
    limits: &'a [JointLimits],
    vectors: NonZeroUsize,
}

/// How a set was stored.
struct Stored {
    set: SetSummary,
    sequence: u32,
    difference: KinematicsDifference,
}

impl Stored {
    fn uploaded(self, replaced: Option<SetSummary>, lvdt: LvdtOrigin) -> Uploaded {
        Uploaded { stored: self.set, replaced, sequence: self.sequence, difference: self.difference, lvdt }
    }
}

impl SetSummary {
    fn new(set: &ParameterSet, crc: u32) -> Self {
        Self { name: set.name.as_str().to_owned(), is_calibrated: set.is_calibrated, crc }
    }
}

/// Stages, verifies, stores, reads back.
fn store(link: &mut BoardLink, wanted: &Wanted<'_>, on_step: &mut dyn FnMut(UploadStep)) -> Result<Stored, UploadError> {
    let bytes = bytes_of(&wanted.set)?;
    let committed = stage_and_verify(link, wanted, &bytes, on_step)
        .and_then(|(crc, difference)| Ok(link.act(Command::Commit { crc }).map(|()| (crc, difference))?));
    if committed.is_err() {
        // What is staged is not in use; without it a later commit cannot store it by mistake.
        let _ = link.act(Command::Discard);
    }
    let (crc, difference) = committed?;
    check_read_back(link, WhichSet::Active, &bytes)?;
    let sequence = match link.request(Command::Status)? {
        Answer::Status(status) => status.active.map_or(0, |active| active.sequence),
        _ => return Err(BoardError::WrongAnswer { command: "status" }.into()),
    };
    Ok(Stored { set: SetSummary::new(&wanted.set, crc), sequence, difference })
}

/// The CRC by which to commit what is staged.
fn stage_and_verify(
    link: &mut BoardLink,
    wanted: &Wanted<'_>,
    bytes: &[u8],
    on_step: &mut dyn FnMut(UploadStep),
) -> Result<(u32, KinematicsDifference), UploadError> {
    let Wanted { set, kinematics, limits, vectors } = wanted;
    let Answer::Staged { crc } = link.request(Command::WriteParameters(set.clone()))? else {
        return Err(BoardError::WrongAnswer { command: "write parameters" }.into());
    };
    check_read_back(link, WhichSet::Staged, bytes)?;
    let on_vector = || on_step(UploadStep::Compared);
    let difference = verify_kinematics(link, kinematics, limits, WhichSet::Staged, vectors.get(), on_vector)?;
    if difference.is_small() { Ok((crc, difference)) } else { Err(UploadError::Kinematics(difference)) }
}

/// Bit for bit, which `==` on floats is not.
fn check_read_back(link: &mut BoardLink, which: WhichSet, bytes: &[u8]) -> Result<(), UploadError> {
    match link.request(Command::ReadParameters(which))? {
        Answer::Parameters(found) if bytes_of(&found)? == bytes => Ok(()),
        Answer::Parameters(_) => Err(UploadError::ReadBack(which)),
        _ => Err(BoardError::WrongAnswer { command: "read parameters" }.into()),
    }
}

/// As it travels.
fn bytes_of(set: &impl Serialize) -> Result<Vec<u8>, UploadError> {
    let mut buffer = [0; MAX_PAYLOAD];
    postcard::to_slice(set, &mut buffer).map(|bytes| bytes.to_vec()).map_err(|_| UploadError::TooLong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_message_has_room_for_is_told_from_what_is_empty() {
        let longest = "x".repeat(MAX_PAYLOAD - 2);
        assert_eq!(bytes_of(&longest).unwrap().len(), MAX_PAYLOAD);
        assert!(matches!(bytes_of(&(longest + "x")), Err(UploadError::TooLong)));
    }
}

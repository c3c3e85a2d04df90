//! Measuring the LVDT's curve: the bar is set to known lengths, one after the other, and the code at each is taken when it stands.

use std::thread::sleep;
use std::time::{Duration, Instant};

use ballbar::wire::{Answer, Command, Event, Refusal, StreamSelection};
use ballbar::{SettledPose, StillnessCriteria};
use thiserror::Error;

use super::errors::BoardError;
use super::link::BoardLink;
use super::lvdt_fit::LvdtFit;
use super::plausible::Implausible;
use super::robot_on_board::RobotOnBoard;
use crate::deadline::StopFlag;

/// After so much silence the board is asked how it is.
const SILENCE: Duration = Duration::from_secs(1);
/// How long an arm that moves is waited for, and how often the store is tried meanwhile.
const STORE_PATIENCE: Duration = Duration::from_secs(10);
const STORE_LOOK: Duration = Duration::from_millis(200);

/// Who sets the bar to the known lengths.
pub trait LengthSetter {
    /// Sets the length of this number, from 0, or asks for it.
    fn set(&mut self, number: usize) -> LengthSet;

    /// It stood, and was taken.
    fn taken(&mut self, pose: &SettledPose);

    /// What the board streamed was not believed.
    fn refused(&mut self, reason: Implausible);
}

/// How far a length is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthSet {
    /// It is: what stands from now on is this length.
    Now,
    /// It will be, and nobody says when: a code that has not moved is still that of the length before.
    Unsaid,
    /// It will not: the user ends.
    Never,
}

/// Why a curve was not measured or not stored. Nothing was changed on the board, unless it is the board that failed.
#[derive(Debug, Error)]
pub enum LvdtError {
    /// The board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// It holds no robot.
    #[error("the board holds no parameters, of which the curve is a part")]
    NoParameters,
    /// The user ended.
    #[error("ended before all lengths were measured: {found} of {wanted}")]
    Ended {
        /// Lengths measured.
        found: usize,
        /// Lengths asked for.
        wanted: usize,
    },
    /// The stream was ended by somebody else, or the board was reset.
    #[error("the board has stopped streaming")]
    NotStreaming,
    /// The curve is farther from a length than is allowed.
    #[error("the curve is {:.4} mm off a length, allowed are {:.4} mm", .largest_m * 1e3, .tolerance_m * 1e3)]
    TooFarOff {
        /// Largest residual, metres.
        largest_m: f64,
        /// Allowed, metres.
        tolerance_m: f64,
    },
}

/// Takes one pose for each of so many lengths, when the LVDT has stood still for `hold_us`; the arm may do what it likes. Nothing is waited
/// for any longer once the flag is set. Whatever comes of it, the board is left as it is after its start.
///
/// # Errors
/// [`LvdtError`].
pub fn measure_lvdt(
    link: &mut BoardLink,
    lengths: usize,
    hold_us: u32,
    stop: &StopFlag,
    setter: &mut dyn LengthSetter,
) -> Result<Vec<SettledPose>, LvdtError> {
    RobotOnBoard::read(link)?.ok_or(LvdtError::NoParameters)?;
    link.heed(stop);
    let measured = measure(link, lengths, hold_us, setter);
    let left = link.end_stream();
    link.heed(&StopFlag::default());
    let left = left.and_then(|_| link.act(Command::SetStillness(StillnessCriteria::default())));
    let poses = measured?;
    left?;
    Ok(poses)
}

fn measure(
    link: &mut BoardLink,
    lengths: usize,
    hold_us: u32,
    setter: &mut dyn LengthSetter,
) -> Result<Vec<SettledPose>, LvdtError> {
    let criteria = StillnessCriteria { hold_us, band_counts: u16::MAX, ..StillnessCriteria::default() };
    let mut poses: Vec<SettledPose> = Vec::new();
    while poses.len() < lengths {
        let ended = LvdtError::Ended { found: poses.len(), wanted: lengths };
        let is_said = match setter.set(poses.len()) {
            LengthSet::Now => true,
            LengthSet::Unsaid => false,
            LengthSet::Never => return Err(ended),
        };
        // Asked for anew, so that stillness before now does not count.
        let started = link
            .act(Command::SetStillness(criteria))
            .and_then(|()| link.start_stream(StreamSelection { settled: true, ..StreamSelection::default() }));
        if matches!(started, Err(BoardError::Stopped)) {
            return Err(ended);
        }
        started?;
        let old_code = poses.last().map(|pose| pose.code_mean).filter(|_| !is_said);
        let is_new =
            |pose: &SettledPose| old_code.is_none_or(|old| (pose.code_mean - old).abs() > f64::from(criteria.band_codes));
        let pose = next_settled(link, setter, is_new)?.ok_or(ended)?;
        setter.taken(&pose);
        poses.push(pose);
    }
    Ok(poses)
}

/// The next pose that stands and is new; `None` when the user ends instead. A board that falls silent is asked how it is.
fn next_settled(
    link: &mut BoardLink,
    setter: &mut dyn LengthSetter,
    is_new: impl Fn(&SettledPose) -> bool,
) -> Result<Option<SettledPose>, LvdtError> {
    let mut heard = Instant::now();
    while link.check_stop().is_ok() {
        match link.next_frame().map_err(BoardError::from)?.map(|frame| frame.message) {
            Some(Ok(stream)) => {
                heard = Instant::now();
                if let Event::Settled(pose) = stream.event
                    && is_new(&pose)
                {
                    return Ok(Some(pose));
                }
            }
            Some(Err(reason)) => setter.refused(reason),
            None if heard.elapsed() >= SILENCE => {
                heard = Instant::now();
                match link.request(Command::Status) {
                    Ok(Answer::Status(status)) if status.streaming.is_none() => return Err(LvdtError::NotStreaming),
                    Ok(_) | Err(BoardError::Stopped) => {}
                    Err(error) => return Err(error.into()),
                }
            }
            None => {}
        }
    }
    Ok(None)
}

/// Stages a curve that is within `tolerance_m` of every length, and stores it; while the arm moves, the store is tried again for some
/// seconds.
///
/// # Errors
/// [`LvdtError::TooFarOff`], [`LvdtError::Board`].
pub fn store_lvdt(link: &mut BoardLink, fit: &LvdtFit, tolerance_m: f64) -> Result<(), LvdtError> {
    if !fit.is_within(tolerance_m) {
        return Err(LvdtError::TooFarOff { largest_m: fit.largest_m(), tolerance_m });
    }
    link.act(Command::Discard)?;
    let Answer::Staged { crc } = link.request(Command::SetLvdt(*fit.curve()))? else {
        return Err(BoardError::WrongAnswer { command: "set LVDT" }.into());
    };
    let began = Instant::now();
    loop {
        match link.act(Command::Commit { crc }) {
            Err(BoardError::Refused { refusal: Refusal::Moving, .. }) if began.elapsed() < STORE_PATIENCE => sleep(STORE_LOOK),
            stored => return Ok(stored?),
        }
    }
}

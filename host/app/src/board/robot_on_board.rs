//! A robot's file as the board's parameters, and the board's parameters as something to compute with in f64.

use ballbar::wire::{Answer, Command, ParameterSet, ParameterSetError, Refusal, Status, WhichSet, term_numbers};
use ballbar::{
    Chain, Coupling, Encoder, JointEncoders, JointKind, JointTerms, JointVector, LVDT_COEFFICIENTS, LvdtCurve, LvdtReading,
    MAX_JOINTS, SettledPose,
};
use ballbar_calib::kinematics::CanonicalFrames;
use ballbar_calib::model::Robot;
use miette::Diagnostic;
use thiserror::Error;

use super::encoders::{NoEncoders, joint_encoders};
use super::errors::BoardError;
use super::link::BoardLink;

/// Why a robot's file cannot be put on a board.
#[derive(Debug, Error, Diagnostic)]
pub enum SetError {
    /// It says too little of the encoders.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Encoders(#[from] NoEncoders),
    /// The board would refuse it.
    #[error("{robot}: {reason}")]
    #[diagnostic(help("The board would refuse it. docs/files.md says what each number means, and in which unit."))]
    Unfit {
        /// The file.
        robot: String,
        /// What is wrong with it.
        reason: String,
    },
}

/// The parameters of a robot's file, rounded to the board's f32, with an LVDT curve.
///
/// The board is told the robot in canonical frames: those of a file may lie half a kilometre away, where single precision has steps of
/// 30 µm. What it computes is the same.
///
/// # Errors
/// [`SetError`] when the file lacks encoders, or the board could not use it.
pub fn parameter_set(robot: &Robot, lvdt: LvdtCurve) -> Result<ParameterSet, SetError> {
    joint_encoders(robot)?;
    let unfit = |reason: String| SetError::Unfit { robot: robot.source.as_str().to_owned(), reason };
    if robot.encoders.iter().map(|facts| facts.couplings.len()).sum::<usize>() > ballbar::MAX_COUPLINGS {
        return Err(unfit(format!("more than {} couplings", ballbar::MAX_COUPLINGS)));
    }
    // First as the file has it, so that what is wrong is named as it stands there; only how far its frames lie is none of the board's business.
    match check(&set_of(robot, &robot.chain, &robot.terms, lvdt), robot) {
        Ok(()) | Err(ParameterSetError::Precision { .. }) => {}
        Err(error) => return Err(unfit(error.to_string())),
    }
    let frames = CanonicalFrames::new(&robot.chain);
    let set = set_of(robot, frames.chain(), &frames.terms(&robot.terms), lvdt);
    check(&set, robot).map_err(|error| unfit(error.to_string()))?;
    Ok(set)
}

/// First as the board does, which does not know the limits, and then over what the limits let the robot do.
fn check(set: &ParameterSet, robot: &Robot) -> Result<(), ParameterSetError> {
    let ranges: Vec<_> = robot.limits.iter().map(|limits| limits.min as f32..=limits.max as f32).collect();
    set.compile().and_then(|_| set.compile_within(&ranges)).map(|_| ())
}

fn set_of(robot: &Robot, chain: &Chain<f64>, terms: &JointTerms<f64>, lvdt: LvdtCurve) -> ParameterSet {
    let encoders = robot.encoders.iter().filter_map(|facts| facts.encoder);
    let couplings = robot.encoders.iter().flat_map(|facts| &facts.couplings);
    ParameterSet {
        name: cut_to(&robot.name, 32),
        is_calibrated: robot.standing().is_calibrated(),
        kinds: chain.joint_kinds().iter().copied().collect(),
        parameters: chain.parameters().iter().map(|&value| value as f32).collect(),
        encoders: encoders
            .map(|e| Encoder { counts_per_unit: e.counts_per_unit as f32, counts_per_index: e.counts_per_index })
            .collect(),
        couplings: couplings
            .map(|c| Coupling { joint: c.joint, driven_by: c.driven_by, ratio: c.ratio as f32 })
            .take(ballbar::MAX_COUPLINGS)
            .collect(),
        lvdt,
        terms: term_numbers(terms, chain.joints()),
    }
}

/// Travel of the paper's LVDT from end to end, metres.
pub const NOMINAL_TRAVEL_M: f64 = 0.075;

/// A straight line over nine tenths of the codes: what a conditioner that is trimmed to its data sheet gives. Good enough to see
/// the bar move; `host-cal lvdt` measures the real curve.
pub fn nominal_lvdt(travel_m: f64) -> LvdtCurve {
    let (code_min, code_max) = (1_638, 63_898);
    let mut coefficients_m = [0.0; LVDT_COEFFICIENTS];
    let span = LvdtCurve::normalised(f64::from(code_max)) - LvdtCurve::normalised(f64::from(code_min));
    coefficients_m[1] = (travel_m / span) as f32;
    LvdtCurve { code_min, code_max, coefficients_m }
}

/// The first bytes of a text, whole characters only.
fn cut_to<const N: usize>(text: &str, bytes: usize) -> heapless::String<N> {
    let mut cut = heapless::String::new();
    for character in text.chars() {
        if cut.len() + character.len_utf8() > bytes || cut.push(character).is_err() {
            break;
        }
    }
    cut
}

/// The parameters that a board uses, ready to convert what it streams.
#[derive(Clone, Debug)]
pub struct RobotOnBoard {
    set: ParameterSet,
    encoders: JointEncoders<f64>,
    /// Half of each joint's gap, radians or metres.
    backlash: [f32; MAX_JOINTS],
}

impl RobotOnBoard {
    /// Asks the board; `None` when it holds no parameters. Returns the frame of the reply as well, for a log.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn read(link: &mut BoardLink) -> Result<Option<(Self, Vec<u8>)>, BoardError> {
        match link.request_frame(Command::ReadParameters(WhichSet::Active)) {
            Ok((Answer::Parameters(set), frame)) => {
                // Parameters that cannot be computed with are not believed, and do not come here.
                let robot = Self::new(set).ok_or(BoardError::WrongAnswer { command: "read parameters" })?;
                Ok(Some((robot, frame)))
            }
            Ok(_) => Err(BoardError::WrongAnswer { command: "read parameters" }),
            Err(BoardError::Refused { refusal: Refusal::NoParameters, .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Takes a set that came from a board; `None` when it cannot be computed with.
    pub fn new(set: ParameterSet) -> Option<Self> {
        let backlash = set.compile().ok()?.backlash;
        let encoders: Vec<_> = set
            .encoders
            .iter()
            .map(|e| Encoder { counts_per_unit: f64::from(e.counts_per_unit), counts_per_index: e.counts_per_index })
            .collect();
        let couplings: Vec<_> = set
            .couplings
            .iter()
            .map(|c| Coupling { joint: c.joint, driven_by: c.driven_by, ratio: f64::from(c.ratio) })
            .collect();
        let encoders = JointEncoders::new(&encoders, &couplings).ok()?;
        Some(Self { set, encoders, backlash })
    }

    /// The set as the board has it.
    pub fn set(&self) -> &ParameterSet {
        &self.set
    }

    /// Kinds of the joints.
    pub fn kinds(&self) -> &[JointKind] {
        &self.set.kinds
    }

    /// Whether all encoders of the robot's joints were preset since the board started; bit i is encoder i.
    pub fn is_homed(&self, homed: u8) -> bool {
        let joints = (1_u16 << self.set.kinds.len()) - 1;
        u16::from(homed) & joints == joints
    }

    /// The map between counts and joint values.
    pub fn encoders(&self) -> &JointEncoders<f64> {
        &self.encoders
    }

    /// Half of each joint's gap, radians or metres, as far as the board knows it.
    pub fn backlash(&self) -> [f64; MAX_JOINTS] {
        self.backlash.map(f64::from)
    }

    /// Whether by this status they were.
    pub fn is_homed_by(&self, status: &Status) -> bool {
        let homed = status.encoders.iter().enumerate().map(|(i, encoder)| u8::from(encoder.is_homed) << i);
        self.is_homed(homed.sum())
    }

    /// Joint values q, radians or metres, at encoder positions in counts.
    pub fn q(&self, counts: impl IntoIterator<Item = f64>) -> JointVector<f64> {
        self.encoders.q(counts)
    }

    /// Displacement of the bar from mid travel, metres; `None` at a fault of the LVDT.
    pub fn displacement_m(&self, reading: LvdtReading) -> Option<f64> {
        self.set.lvdt.displacement_m(reading).ok()
    }

    /// Joint values and displacement of a settled pose, in SI; no displacement when the bar was beyond its travel.
    pub fn settled(&self, pose: &SettledPose) -> (JointVector<f64>, Option<f64>) {
        let q = self.q(pose.counts_mean.iter().copied());
        (q, self.set.lvdt.displacement_of_code_m(pose.code_mean).ok())
    }
}

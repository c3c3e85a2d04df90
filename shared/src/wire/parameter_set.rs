//! All that a board keeps in flash: the chain, its encoders, the LVDT.

use core::f32::consts::PI;
use core::fmt;
use core::ops::RangeInclusive;

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::term_numbers::{MAX_TERM_NUMBERS, terms_of};
use super::tool_pose::ToolPose;
use crate::{
    Approach, Chain, Coupling, Encoder, EncoderError, JointEncoders, JointKind, JointTerms, JointVector, Kinematics, LvdtCurve,
    MAX_COUPLINGS, MAX_JOINTS, MAX_PARAMETERS, Parameter, ParameterKind, ParameterUnit, TermKind,
};

/// The farthest from the base that a tool may come, metres. At 100 m an f32 is 8 µm from the next, a tenth of what a ball-bar
/// resolves; a link's length in millimetres that was taken for metres comes farther.
pub const MAX_REACH_M: f32 = 100.0;
/// The farthest from the tool that the origin of a frame may lie, metres. At 2 km an f32 is 0.12 mm from the next, and so are the
/// poses: as much as a calibration leaves. Robots whose axes are nearly parallel do have lengths of half a kilometre that cancel.
pub const MAX_SPAN_M: f32 = 2_000.0;
/// The largest angle, radians: at 100 an f32 is 8 µrad from the next.
const MAX_ANGLE_RAD: f32 = 100.0;
/// Scales, in size.
const SCALES: RangeInclusive<f32> = 1e-3..=1e3;
/// Poses at which a set is judged. Each costs less than a forward kinematics (810 instructions): 52,000 at most, 0.3 ms of the board.
const JUDGED_POSES: u32 = 64;
/// Steps from pose to pose of each joint in turn, as parts of 2³² of its range: powers of 1/g, g⁹ = g + 1, whose multiples fill a
/// space of eight joints evenly (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
const STEPS: [u32; MAX_JOINTS] =
    [3_958_238_938, 3_647_910_312, 3_361_911_662, 3_098_335_500, 2_855_423_889, 2_631_556_713, 2_425_240_877, 2_235_100_342];

/// Parameters as they travel and as they stand in flash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ParameterSet {
    /// What the robot is called.
    pub name: String<32>,
    /// Whether a fit made the chain's parameters; design parameters otherwise.
    pub is_calibrated: bool,
    /// Kinds of the J joints.
    pub kinds: Vec<JointKind, MAX_JOINTS>,
    /// The chain's 8·J + 6 parameters, metres, radians and ones.
    pub parameters: Vec<f32, MAX_PARAMETERS>,
    /// The encoders of the J joints.
    pub encoders: Vec<Encoder<f32>, MAX_JOINTS>,
    /// Joints that turn others along.
    pub couplings: Vec<Coupling<f32>, MAX_COUPLINGS>,
    /// The LVDT's curve.
    pub lvdt: LvdtCurve,
    /// Terms of the joints: 10·J + 7 numbers as [`term_numbers`](super::term_numbers()) gives them, or none. Last, so that a set
    /// in the flash of a firmware that knew none is one of this layout but for its end.
    pub terms: Vec<f32, MAX_TERM_NUMBERS>,
}

/// What a set is known by.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SetIdentity {
    /// What the robot is called.
    pub name: String<32>,
    /// Whether a fit made the chain's parameters.
    pub is_calibrated: bool,
    /// Joints of the robot.
    pub joints: u8,
    /// Counts the commits.
    pub sequence: u32,
    /// CRC-32 of the set.
    pub crc: u32,
}

/// A set made ready to compute with.
#[derive(Clone, Debug)]
pub struct CompiledParameters {
    /// Number of joints.
    pub joints: usize,
    /// The chain.
    pub kinematics: Kinematics<f32>,
    /// Half of each joint's gap, radians or metres.
    pub backlash: [f32; MAX_JOINTS],
    /// Counts to joint values.
    pub encoders: JointEncoders<f32>,
    /// Codes to displacements.
    pub lvdt: LvdtCurve,
}

/// Why a set cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ParameterSetError {
    /// No joints, or parameters or encoders that are not as many as the joints ask for.
    Sizes,
    /// The parameter at this index is infinite or not a number.
    NotFinite {
        /// Position in parameter order, from 0.
        index: u8,
    },
    /// The encoders cannot be used.
    Encoders(EncoderError),
    /// The LVDT's curve is none: see [`LvdtCurve::is_valid`].
    Lvdt,
    /// The angle or scale at this index is one that no robot has.
    Implausible {
        /// Position in parameter order, from 0.
        index: u8,
    },
    /// At some of the poses that were looked at, the tool is farther from the base than any robot reaches, or nowhere.
    Reach {
        /// Position in parameter order, from 0, of the largest length.
        longest: u8,
    },
    /// At some of the poses that were looked at, frames lie so far from the tool that single precision gives another robot's pose.
    Precision {
        /// Position in parameter order, from 0, of the largest length.
        longest: u8,
    },
    /// Terms, masses or gravity that no robot has: see [`JointTerms::check`].
    Terms,
}

impl fmt::Display for ParameterSetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parameter = |index: &u8| crate::Parameter::from_index(usize::from(*index));
        match self {
            Self::Sizes => f.write_str("numbers of joints, parameters and encoders do not fit together"),
            Self::NotFinite { index } => write!(f, "{} is not a finite number", parameter(index)),
            Self::Encoders(error) => error.fmt(f),
            Self::Terms => f.write_str("terms of joints, masses or gravity are out of range, or not of such joints"),
            Self::Lvdt => f.write_str(LvdtCurve::VALID),
            Self::Implausible { index } => {
                write!(f, "{} is out of range: an angle is 100 rad at most, a scale 0.001 to 1000 in size", parameter(index))
            }
            Self::Reach { longest } => write!(
                f,
                "the tool comes more than {MAX_REACH_M} m away from the base; the largest length is {}",
                parameter(longest)
            ),
            Self::Precision { longest } => write!(
                f,
                "frames lie more than {} km from the tool, which single precision cannot compute with; the largest length is {}",
                MAX_SPAN_M / 1e3,
                parameter(longest)
            ),
        }
    }
}

impl core::error::Error for ParameterSetError {}

impl ParameterSet {
    /// The chain.
    ///
    /// # Errors
    /// [`ParameterSetError`] for sizes that do not fit together and numbers that are not finite.
    pub fn chain(&self) -> Result<Chain<f32>, ParameterSetError> {
        if let Some(index) = self.parameters.iter().position(|value| !value.is_finite()) {
            return Err(ParameterSetError::NotFinite { index: index as u8 });
        }
        Chain::new(&self.kinds, &self.parameters).map_err(|_| ParameterSetError::Sizes)
    }

    /// The joints' terms; those of a set that has none add nothing.
    ///
    /// # Errors
    /// [`ParameterSetError`] for terms that are not those of the joints.
    pub fn joint_terms(&self) -> Result<JointTerms<f32>, ParameterSetError> {
        let terms = terms_of(&self.terms, self.kinds.len()).ok_or(ParameterSetError::Sizes)?;
        terms.check(&self.kinds).map_err(|_| ParameterSetError::Terms)?;
        Ok(terms)
    }

    /// The encoder outputs over which poses are looked at where nobody knows the joint limits, as on the board: a whole turn of
    /// revolute joints and a metre either way of prismatic ones.
    pub fn usual_ranges(&self) -> Vec<RangeInclusive<f32>, MAX_JOINTS> {
        let range = |kind: &JointKind| match kind {
            JointKind::Revolute => -PI..=PI,
            JointKind::Prismatic => -1.0..=1.0,
        };
        self.kinds.iter().map(range).collect()
    }

    /// Checks everything, poses over the usual ranges too, and makes the set ready to compute with.
    ///
    /// # Errors
    /// [`ParameterSetError`] with the first thing that is wrong.
    pub fn compile(&self) -> Result<CompiledParameters, ParameterSetError> {
        self.compile_within(&self.usual_ranges())
    }

    /// As [`ParameterSet::compile`], for ranges of the encoder outputs that are known, radians or metres.
    ///
    /// # Errors
    /// As [`ParameterSet::compile`].
    pub fn compile_within(&self, ranges: &[RangeInclusive<f32>]) -> Result<CompiledParameters, ParameterSetError> {
        let chain = self.chain()?;
        if self.encoders.len() != chain.joints() {
            return Err(ParameterSetError::Sizes);
        }
        let encoders = JointEncoders::new(&self.encoders, &self.couplings).map_err(ParameterSetError::Encoders)?;
        if !self.lvdt.is_valid() {
            return Err(ParameterSetError::Lvdt);
        }
        let terms = self.joint_terms()?;
        let kinematics = Kinematics::with_terms(&chain, &terms);
        judge(&chain, &kinematics, ranges)?;
        let backlash = core::array::from_fn(|joint| terms.coefficient(joint, TermKind::Backlash));
        Ok(CompiledParameters { joints: chain.joints(), kinematics, backlash, encoders, lvdt: self.lvdt })
    }
}

impl CompiledParameters {
    /// Pose of the tool at encoder outputs `q` that were approached so; none where it is no finite number.
    pub fn tool_pose(&self, q: &JointVector<f32>, approach: Approach) -> Option<ToolPose> {
        let pose = ToolPose::from(&self.kinematics.base_from_tool_approached(q, approach));
        let numbers = pose.position_m.iter().chain(&pose.x_axis).chain(&pose.y_axis);
        numbers.copied().all(f32::is_finite).then_some(pose)
    }
}

/// Whether a chain of finite numbers is a robot's, seen by its poses over `ranges` of the encoder outputs and not by its lengths.
fn judge(chain: &Chain<f32>, kinematics: &Kinematics<f32>, ranges: &[RangeInclusive<f32>]) -> Result<(), ParameterSetError> {
    let is_plausible = |(index, value): (usize, &f32)| {
        let parameter = Parameter::from_index(index);
        match (parameter.kind(), chain.unit(parameter)) {
            (ParameterKind::Scale, _) => SCALES.contains(&value.abs()),
            (_, ParameterUnit::Radian) => value.abs() <= MAX_ANGLE_RAD,
            _ => true,
        }
    };
    if let Some(index) = chain.parameters().iter().enumerate().position(|parameter| !is_plausible(parameter)) {
        return Err(ParameterSetError::Implausible { index: index as u8 });
    }
    for pose in 0..JUDGED_POSES {
        let extent = kinematics.extent(&judged_pose(pose, ranges));
        // Neither holds of what is not a number.
        let (is_near, is_exact) = (extent.reach_m <= MAX_REACH_M, extent.span_m <= MAX_SPAN_M);
        if !is_near {
            return Err(ParameterSetError::Reach { longest: longest(chain) });
        }
        if !is_exact {
            return Err(ParameterSetError::Precision { longest: longest(chain) });
        }
    }
    Ok(())
}

/// The first is the middle of all ranges.
fn judged_pose(pose: u32, ranges: &[RangeInclusive<f32>]) -> JointVector<f32> {
    let mut q = JointVector::zero();
    for ((value, range), step) in q.as_array_mut().iter_mut().zip(ranges).zip(STEPS) {
        let part = pose.wrapping_mul(step) as i32 as f32 / 2_147_483_648.0;
        let (middle, half) = ((range.end() + range.start()) / 2.0, (range.end() - range.start()) / 2.0);
        *value = middle + part * half;
    }
    q
}

fn longest(chain: &Chain<f32>) -> u8 {
    let lengths =
        chain.parameters().iter().enumerate().filter(|&(i, _)| chain.unit(Parameter::from_index(i)) == ParameterUnit::Metre);
    lengths.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs())).map_or(0, |(i, _)| i as u8)
}

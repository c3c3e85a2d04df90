//! All that a board keeps in flash: the chain, its encoders, the LVDT.

use core::fmt;

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::{
    Chain, Coupling, Encoder, EncoderError, JointEncoders, JointKind, Kinematics, LvdtCurve, MAX_COUPLINGS, MAX_JOINTS,
    MAX_PARAMETERS,
};

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
    /// The LVDT curve has no range of codes or no finite coefficients.
    Lvdt,
}

impl fmt::Display for ParameterSetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sizes => f.write_str("numbers of joints, parameters and encoders do not fit together"),
            Self::NotFinite { index } => {
                write!(f, "{} is not a finite number", crate::Parameter::from_index(usize::from(*index)))
            }
            Self::Encoders(error) => error.fmt(f),
            Self::Lvdt => f.write_str("the LVDT curve has no range of codes or no finite coefficients"),
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

    /// Checks everything, and makes the set ready to compute with.
    ///
    /// # Errors
    /// [`ParameterSetError`] with the first thing that is wrong.
    pub fn compile(&self) -> Result<CompiledParameters, ParameterSetError> {
        let chain = self.chain()?;
        if self.encoders.len() != chain.joints() {
            return Err(ParameterSetError::Sizes);
        }
        let encoders = JointEncoders::new(&self.encoders, &self.couplings).map_err(ParameterSetError::Encoders)?;
        if !self.lvdt.is_valid() {
            return Err(ParameterSetError::Lvdt);
        }
        Ok(CompiledParameters { joints: chain.joints(), kinematics: Kinematics::new(&chain), encoders, lvdt: self.lvdt })
    }
}

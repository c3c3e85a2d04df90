#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | may know |
//! | --- | --- |
//! | [`units`] | that people read millimetres and degrees |
//! | [`model`] | what a robot, a rig and a measurement are; no algorithm |
//! | [`designs`] | the paper's robot and a rig to go with it, in numbers |
//! | [`kinematics`] | where every link of a robot stands, and which joints lead to a pose; no measurement |
//! | [`simulate`] | robots at rigs: the lengths that a true robot would give |
//! | [`unknowns`] | what may not be known of chain, rig and bar, in blocks: names, tolerances, columns; no algorithm |
//! | [`identify`] | from measured lengths to parameters: what they can tell, the fit, how sure it is; not whether it is good |
//! | [`assess`] | is a fit good? One answer, with its reasons, from facts alone |
//! | [`plan`] | which poses to measure, and the way between them; neither fits nor judges |
//!
//! Nothing here reads or writes a file, and no error knows of a program that uses the library.
#![forbid(unsafe_code)]

pub mod assess;
pub mod designs;
pub mod identify;
pub mod kinematics;
pub mod model;
pub mod plan;
pub mod simulate;
#[cfg(feature = "serde")]
mod stored;
pub mod units;
pub mod unknowns;

// What is in the signatures here of other crates, so that none of them has to be named as a dependency, in the same version.
pub use ballbar::{
    Chain, ChainError, Coupling, Damping, Encoder, FreeParameters, FreeParametersError, Joint, JointKind, JointVector,
    Kinematics, Lanes, LengthRows, Link, LmOptions, MAX_JOINTS, MAX_PARAMETERS, Matrix3, Measurement, PARAMETERS_OF_LAST_LINK,
    PARAMETERS_PER_JOINT, Pairing, Parameter, ParameterKind, ParameterUnit, Pose, UnknownParameter, Vector3,
};
pub use nalgebra::{DMatrix, DVector};
pub use rand_chacha::ChaCha8Rng;
pub use rand_chacha::rand_core::SeedableRng;

//! What the ball-bar's board and host must agree on to the bit: the kinematic chain, the length of the bar and its gradient, the
//! incremental normal equations with their damped step, the way from encoder counts and LVDT codes to joint values and
//! displacements, and the messages by which the two talk ([`wire`]).
//!
//! A number's way through this crate:
//!
//! ```text
//! counters ──ExtendedCounter──▶ Sample ──SettleDetector──▶ SettledPose ──JointEncoders::q, LvdtCurve──▶ q, length
//!
//! Chain ──Kinematics::new──▶ Kinematics, Measurements ──LengthRows::compute──▶ residuals f, rows ∂d/∂p, forces
//!                                                                                   │ NormalEquations::add
//! JointTerms ──with_terms──────▲
//! new values ◀──Problem::moved── Step ◀──DampedSolver::solve(λ)── JᵀWJ, JᵀWf
//!                            (minimise: from Problem to Minimum)
//! ```
//!
//! Units are SI throughout: metres, radians, and wrenches of a dimensionless unit force along the bar. Frames stand in the names:
//! `base_from_tool` maps tool coordinates to base coordinates. Everything is generic over [`Real`], `f32` or `f64`; nothing
//! allocates, nothing panics on bad numbers, and sizes are set at run time under [`MAX_JOINTS`].
#![no_std]
#![forbid(unsafe_code)]

mod approach;
mod chain;
mod configuration;
mod crc32;
mod kinematics;
mod lengths;
mod lm;
mod loads;
mod measurement;
mod normal;
mod parameter;
mod real;
mod rows;
mod sensing;
mod step;
mod terms;
mod trig;
pub mod wire;

pub use approach::{Approach, Direction};
pub use chain::{Chain, ChainError, Joint, JointKind, JointVector, Link};
pub use configuration::Configuration;
pub use crc32::{crc32, crc32_digest};
pub use kinematics::{Extent, Kinematics, Pose};
pub use lengths::{FreeParameters, FreeParametersError, Lengths};
pub use lm::{ConvergenceTest, LmOptions, Minimum, Problem, Status, lm_memory, minimise};
pub use loads::{Body, Masses, STANDARD_GRAVITY_M_S2};
pub use measurement::{Force, Measurement, Pairing, Quantity};
pub use normal::{MemoryTooShort, NormalEquations, Precision, SizeMismatch};
pub use parameter::{Parameter, ParameterKind, ParameterUnit, UnknownParameter};
pub use real::{Number, Real};
pub use rows::{LANES, Lanes, LengthRows, Rows};
pub use sensing::{
    CounterWidth, Counts, Coupling, Encoder, EncoderError, ExtendedCounter, IndexCheck, JointEncoders, LVDT_COEFFICIENTS,
    LvdtCurve, LvdtFault, LvdtReading, MAX_COUPLINGS, Sample, SettleDetector, SettledPose, Stillness, StillnessCriteria,
};
pub use step::{DampedSolver, Damping, NotPositiveDefinite, Step};
pub use terms::{JointTerms, TERMS_PER_JOINT, TermKind, TermsError, term_basis};
pub use trig::sin_cos_f32;

/// Three-vector of metres or of unit-free direction components.
pub type Vector3<S> = nalgebra::Vector3<S>;
/// Three-by-three matrix; rotations here map from the frame on the right of the name to the one on the left.
pub type Matrix3<S> = nalgebra::Matrix3<S>;

/// The most joints that a chain may have.
pub const MAX_JOINTS: usize = 8;
/// Parameters of one link and the joint behind it: `x y z alpha beta gamma offset scale`.
pub const PARAMETERS_PER_JOINT: usize = 8;
/// Parameters of the last link, which has no joint behind it.
pub const PARAMETERS_OF_LAST_LINK: usize = 6;
/// The most parameters that a chain may have: 8·J + 6.
pub const MAX_PARAMETERS: usize = PARAMETERS_PER_JOINT * MAX_JOINTS + PARAMETERS_OF_LAST_LINK;

/// One value for each parameter of a chain, in parameter order; entries beyond the chain's own count mean nothing.
pub type Row<S> = [S; MAX_PARAMETERS];

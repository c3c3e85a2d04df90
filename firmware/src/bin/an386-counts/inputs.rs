//! What is computed with, as the emulator's loader puts it into the PSRAM: numbers of 32 bits, low byte first.

/// Poses of the robot.
pub(crate) const POSES: usize = 200;
/// Parameters of a robot with six joints.
pub(crate) const PARAMETERS: usize = 54;
/// Of these, free in a fit.
pub(crate) const FREE: usize = 36;

/// A robot, and lengths measured with it.
#[repr(C)]
pub(crate) struct Inputs {
    /// The chain's parameters, metres, radians and ones.
    pub(crate) parameters: [f32; PARAMETERS],
    /// Indices of the free ones, ascending.
    pub(crate) free: [u32; FREE],
    /// The lengths.
    pub(crate) poses: [MeasuredPose; POSES],
}

/// A measured length.
#[repr(C)]
pub(crate) struct MeasuredPose {
    /// Encoder outputs, radians.
    pub(crate) q_rad: [f32; 6],
    /// The chuck in the base frame, metres.
    pub(crate) chuck_base_m: [f32; 3],
    /// The sphere in the tool frame, metres.
    pub(crate) sphere_tool_m: [f32; 3],
    /// The length, metres.
    pub(crate) length_m: f32,
}

//! The paper's experiment: A. Goswami, A. Quaid and M. Peshkin, "Identifying Robot Parameters Using Partial Pose Information",
//! IEEE Control Systems 13(5), 1993, simulated from its Table II and set beside its own numbers.

mod beside;
mod experiment;
mod pairings;
mod stewart;

pub use beside::{BesideThePaper, ClassLine, LongitudeLine, Number, RecoveredLine};
pub use experiment::{Experiment, ExperimentError, Longitude, Recovered, run};
pub use pairings::{PairingRanks, RankClass};
pub use stewart::{StewartPlatform, amplification};

/// Numbers that the paper states.
pub mod stated {
    /// RMS residual on the shells that were fitted, millimetres.
    pub const FITTED_RMS_MM: f64 = 0.084;
    /// RMS residual on the shells of the other radius, millimetres.
    pub const OTHER_RADIUS_RMS_MM: f64 = 0.110;
    /// Radius of the shells that were fitted, millimetres.
    pub const FITTED_RADIUS_MM: f64 = 460.0;
    /// Radius of the other shells, millimetres.
    pub const OTHER_RADIUS_MM: f64 = 610.0;
    /// "Each set consisted of about 800 poses": 90 on each of nine shells.
    pub const POSES_PER_PAIRING: usize = 90;
    /// Parameters identified with all nine pairings.
    pub const ALL_PAIRINGS_RANK: usize = 36;
    /// Parameters identified with one sphere and three chucks.
    pub const ONE_SPHERE_RANK: usize = 33;
    /// The same with the sphere on the axis of joint 6: "we fail to identify, additionally, the error in the sixth joint offset".
    pub const SPHERE_ON_AXIS_RANK: usize = 32;
    /// Position error at the tool for `FITTED_RMS_MM` of ball-bar error, millimetres.
    pub const TOOL_ERROR_MM: f64 = 0.34;
    /// "Roughly four times".
    pub const AMPLIFICATION: f64 = 4.0;
    /// "In most cases convergence occurred within ten iterations".
    pub const ITERATIONS: usize = 10;
}

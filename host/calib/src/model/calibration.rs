//! What is kept of a fit beside the robot that came of it.

/// When, from what and how well a robot was calibrated.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Calibration {
    /// Time of the fit, RFC 3339.
    pub when: String,
    /// The program and its version.
    pub by: String,
    /// What the fit was found to be; `None` in files of versions that did not say.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub verdict: Option<CalibrationVerdict>,
    /// What weighs on it, in whole sentences.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub reasons: Vec<String>,
    /// The robot that the fit began with.
    pub from_robot: String,
    /// Files of poses.
    pub from_poses: Vec<String>,
    /// Number of poses.
    pub poses: usize,
    /// Number of parameters that were free.
    pub free_parameters: usize,
    /// RMS residual before the fit, millimetres.
    pub rms_initial_mm: f64,
    /// RMS residual after it, millimetres.
    pub rms_mm: f64,
    /// RMS residual of poses left out of the fit (cross-validation), millimetres.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub held_out_rms_mm: Option<f64>,
}

/// What the fit behind a robot's file was found to be. What is worse than these is not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum CalibrationVerdict {
    /// Proven, and nothing stands against it.
    Calibrated,
    /// Good, but something weighs on it: see the reasons.
    Reserved,
}

impl CalibrationVerdict {
    /// The word in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibrated => "calibrated",
            Self::Reserved => "reserved",
        }
    }
}

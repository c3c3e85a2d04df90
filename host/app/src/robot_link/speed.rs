//! How fast a robot goes.

use ballbar::{JointKind, JointVector};

/// The highest speed that any joint reaches on a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSpeed {
    /// Of revolute joints, radians per second.
    pub revolute_rad_s: f64,
    /// Of prismatic joints, metres per second.
    pub prismatic_m_s: f64,
}

impl Default for JointSpeed {
    /// 60 degrees and 0.25 m per second.
    fn default() -> Self {
        Self { revolute_rad_s: 60_f64.to_radians(), prismatic_m_s: 0.25 }
    }
}

impl JointSpeed {
    /// Time from one joint vector to another at these speeds throughout, seconds: that of the joint that needs longest.
    pub fn duration_s(&self, kinds: &[JointKind], from: &JointVector<f64>, to: &JointVector<f64>) -> f64 {
        let alone_s = |((kind, from), to): ((&JointKind, &f64), &f64)| {
            let speed = match kind {
                JointKind::Revolute => self.revolute_rad_s,
                JointKind::Prismatic => self.prismatic_m_s,
            };
            (to - from).abs() / speed
        };
        kinds.iter().zip(from.as_array()).zip(to.as_array()).map(alone_s).fold(0.0, f64::max)
    }
}

/// Whole percent of a full speed that is not more than `speed`; 1 at least, 100 at most.
pub(super) fn percent(speed: f64, full_speed: f64) -> u8 {
    // What degrees lose on their way through radians does not cost a percent. Between 1 and 100.
    (100.0 * speed / full_speed + 1e-9).clamp(1.0, 100.0) as u8
}

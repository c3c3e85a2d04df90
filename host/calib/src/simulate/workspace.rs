//! How far the tool is from where a chain says it is.

use ballbar::{Chain, Kinematics};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::model::JointLimits;

/// Difference of two chains at the tool, over random poses within the joint limits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ToolError {
    /// Poses compared.
    pub poses: usize,
    /// RMS distance of the tool frames' origins, metres.
    pub rms_m: f64,
    /// Largest distance, metres.
    pub max_m: f64,
    /// RMS angle between the tool frames, radians.
    pub rms_rad: f64,
}

/// Compares two chains at `poses` joint vectors, uniform within the limits.
pub fn tool_error(truth: &Chain<f64>, estimate: &Chain<f64>, limits: &[JointLimits], poses: usize, seed: u64) -> ToolError {
    let (truth_kinematics, estimate_kinematics) = (Kinematics::new(truth), Kinematics::new(estimate));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut square_m, mut square_rad, mut max_m, mut compared) = (0.0, 0.0, 0.0_f64, 0);
    for _ in 0..poses {
        let q: Vec<f64> = limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let Ok(q) = truth.joint_vector(&q) else { continue };
        let (a, b) = (truth_kinematics.base_from_tool(&q), estimate_kinematics.base_from_tool(&q));
        let distance_m = (a.translation_m - b.translation_m).norm();
        // |R_a − R_b|² = 8 sin²(angle/2), which keeps its digits where the trace would not.
        let angle_rad = 2.0 * ((a.rotation - b.rotation).norm_squared() / 8.0).sqrt().min(1.0).asin();
        square_m += distance_m * distance_m;
        square_rad += angle_rad * angle_rad;
        max_m = max_m.max(distance_m);
        compared += 1;
    }
    let mean = |square: f64| (square / f64::from(compared.max(1))).sqrt();
    ToolError { poses, rms_m: mean(square_m), max_m, rms_rad: mean(square_rad) }
}

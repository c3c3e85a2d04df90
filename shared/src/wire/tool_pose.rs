//! Where the tool is, as it travels.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::Pose;

/// Pose of the tool frame in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct ToolPose {
    /// Origin of the tool frame, metres.
    pub position_m: [f32; 3],
    /// The tool's x axis in the base frame.
    pub x_axis: [f32; 3],
    /// The tool's y axis in the base frame; z is their cross product.
    pub y_axis: [f32; 3],
}

impl From<&Pose<f32>> for ToolPose {
    fn from(pose: &Pose<f32>) -> Self {
        let column = |i| pose.rotation.fixed_view::<3, 1>(0, i).into_owned().into();
        Self { position_m: pose.translation_m.into(), x_axis: column(0), y_axis: column(1) }
    }
}

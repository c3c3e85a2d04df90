//! Several samples or poses in one message, so that the frame's own bytes are shared.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::tool_pose::ToolPose;
use crate::{Counts, LvdtReading, Sample};

/// Samples in one batch, the first included: as many as fit into a frame when every one of eight encoders leaps at every sample.
pub const MAX_BATCH: usize = 20;
/// Poses in one batch.
pub const MAX_POSE_BATCH: usize = 8;

/// Samples with consecutive indices: the first whole, the others as differences, which postcard packs into a byte or two a channel.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SampleBatch {
    /// The first sample.
    pub first: Sample,
    /// The others, each as its difference from the one before.
    pub rest: Vec<SampleStep, { MAX_BATCH - 1 }>,
}

/// A sample as its difference from the one before.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SampleStep {
    /// Time since the one before, microseconds.
    pub dt_us: u16,
    /// Change of the encoder positions, counts, wrapping.
    pub counts: Counts,
    /// Change of the LVDT's code.
    pub code: i32,
    /// Whether this sample's LVDT is saturated.
    pub saturated: bool,
}

impl SampleBatch {
    /// A batch of one.
    pub fn new(first: Sample) -> Self {
        Self { first, rest: Vec::new() }
    }

    /// Samples in the batch.
    pub fn len(&self) -> usize {
        1 + self.rest.len()
    }

    /// A batch has at least its first sample.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Adds `sample`, which comes behind `last`, the batch's latest. False, and nothing added, when it does not fit: the batch is
    /// full, an index is missing between the two, or more than 65 ms lie between them.
    pub fn push(&mut self, last: &Sample, sample: &Sample) -> bool {
        let follows = sample.index == last.index.wrapping_add(1) && sample.counts.len() == last.counts.len();
        let Ok(dt_us) = u16::try_from(sample.t_us.wrapping_sub(last.t_us)) else { return false };
        let step = SampleStep {
            dt_us,
            counts: sample.counts.iter().zip(&last.counts).map(|(now, before)| now.wrapping_sub(*before)).collect(),
            code: i32::from(sample.lvdt.code) - i32::from(last.lvdt.code),
            saturated: sample.lvdt.saturated,
        };
        follows && self.rest.push(step).is_ok()
    }

    /// The samples as they were.
    pub fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        let mut next = Some(self.first.clone());
        let mut steps = self.rest.iter();
        core::iter::from_fn(move || {
            let current = next.take()?;
            next = steps.next().map(|step| step.after(&current));
            Some(current)
        })
    }
}

impl SampleStep {
    fn after(&self, before: &Sample) -> Sample {
        Sample {
            index: before.index.wrapping_add(1),
            t_us: before.t_us.wrapping_add(u64::from(self.dt_us)),
            counts: before.counts.iter().zip(&self.counts).map(|(before, step)| before.wrapping_add(*step)).collect(),
            lvdt: LvdtReading { code: i32::from(before.lvdt.code).wrapping_add(self.code) as u16, saturated: self.saturated },
        }
    }
}

/// Corrected tool poses at equal distances in samples.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct PoseBatch {
    /// Index of the first pose's sample.
    pub index: u32,
    /// Samples from one pose to the next.
    pub stride: u16,
    /// Time of the first pose, microseconds.
    pub t_us: u64,
    /// The poses.
    pub poses: Vec<StreamedPose, MAX_POSE_BATCH>,
}

/// One pose of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct StreamedPose {
    /// Time since the batch's first pose, microseconds.
    pub dt_us: u32,
    /// Where the tool is.
    pub pose: ToolPose,
    /// Displacement of the bar from mid travel, metres; none when the LVDT is at fault.
    pub displacement_m: Option<f32>,
}

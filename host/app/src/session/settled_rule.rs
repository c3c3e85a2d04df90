//! Which settled poses are measured where nobody chooses: one rule for a recording under way and for what its log is found to hold.

use ballbar::wire::SampleBatch;
use ballbar::{Approach, SettledPose, StillnessCriteria};

use super::measured_pose::MeasuredPose;
use crate::board::{ApproachWatch, RobotOnBoard};

/// Follows the settled poses of a run.
#[derive(Clone, Debug)]
pub struct SettledRule {
    criteria: StillnessCriteria,
    last_kept: Option<SettledPose>,
    /// The pose that was kept last, when the port was lost since: an arm that still stands there settles again.
    doubtful: Option<SettledPose>,
    /// Where samples come beside the poses.
    approach: Option<ApproachWatch>,
}

/// What becomes of a settled pose.
#[derive(Clone, Debug, PartialEq)]
pub enum SettledFate {
    /// It is measured.
    Kept(MeasuredPose),
    /// The bar is beyond its travel.
    BeyondTravel,
    /// Not every encoder of a joint is homed.
    NotHomed,
    /// The arm still stands where it stood before the port was lost.
    SameStand,
}

impl SettledRule {
    /// At the beginning of a run in which this counts as standing still.
    pub fn new(criteria: StillnessCriteria) -> Self {
        Self { criteria, last_kept: None, doubtful: None, approach: None }
    }

    /// The port was lost.
    pub fn lose_port(&mut self) {
        self.doubtful = self.last_kept.take().or(self.doubtful.take());
        self.approach = None;
    }

    /// Samples that came before the next settled pose: from which sides the joints come.
    pub fn take_samples(&mut self, robot: &RobotOnBoard, batch: &SampleBatch) {
        let watch = self.approach.get_or_insert_with(|| ApproachWatch::new(robot, &self.criteria));
        for sample in batch.samples() {
            watch.take(&sample, &robot.q(sample.counts.iter().map(|&counts| f64::from(counts))));
        }
    }

    /// What becomes of the next settled pose; bit i of `homed` is encoder i.
    pub fn judge(&mut self, robot: &RobotOnBoard, pose: &SettledPose, homed: u8) -> SettledFate {
        let (q, displacement_m) = robot.settled(pose);
        let Some(displacement_m) = displacement_m else { return SettledFate::BeyondTravel };
        if !robot.is_homed(homed) {
            return SettledFate::NotHomed;
        }
        let is_same = self.doubtful.take().is_some_and(|before| is_same_stand(&before, pose, &self.criteria));
        self.last_kept = Some(pose.clone());
        if is_same {
            return SettledFate::SameStand;
        }
        let t_s = (pose.t_us as f64 + f64::from(pose.duration_us) / 2.0) * 1e-6;
        let approach = self.approach.as_ref().map_or(Approach::UNKNOWN, ApproachWatch::approach);
        SettledFate::Kept(MeasuredPose { q, approach, displacement_m, t_s, rate_m_s: None, plan_row: None })
    }
}

/// Whether the arm has not moved between two poses, as far as the bands tell.
fn is_same_stand(before: &SettledPose, now: &SettledPose, criteria: &StillnessCriteria) -> bool {
    let counts = before.counts_mean.iter().zip(&now.counts_mean).map(|(before, now)| (before - now).abs());
    counts.fold(0.0, f64::max) <= f64::from(criteria.band_counts)
        && (before.code_mean - now.code_mean).abs() <= f64::from(criteria.band_codes)
}

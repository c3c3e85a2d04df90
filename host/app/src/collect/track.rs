//! Poses of an arm that moves: means over short pieces of its way.
//!
//! Over a piece so short that the arm's speed hardly changes, the means of joints and length belong together as at a single
//! moment, but for the time by which the LVDT's signal comes late: with the rate of the length it can be removed (see `lag.rs`).

use ballbar::{Approach, JointKind, JointVector};

use super::collector::Collector;
use super::errors::CollectError;
use super::ledger::RowState;
use crate::session::MeasuredPose;

/// How an arm that moves is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackOptions {
    /// From one pose to the next, seconds.
    pub every_s: f64,
    /// Time of which a pose is the mean, seconds.
    pub mean_s: f64,
}

impl Default for TrackOptions {
    /// Twice a second, of a tenth of a second.
    fn default() -> Self {
        Self { every_s: 0.5, mean_s: 0.1 }
    }
}

/// One sample on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrackPoint {
    pub(super) t_s: f64,
    pub(super) q: JointVector<f64>,
    pub(super) approach: Approach,
    pub(super) displacement_m: f64,
}

/// A pose of an arm that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingPose {
    /// Middle of its time by the board's clock, seconds.
    pub t_s: f64,
    /// Mean encoder outputs, radians or metres.
    pub q: JointVector<f64>,
    /// From which sides the joints came there, where it is known; not of a joint that turned meanwhile.
    pub approach: Approach,
    /// Mean displacement of the bar from mid travel, metres.
    pub displacement_m: f64,
    /// How fast the length grows, metres per second.
    pub rate_m_s: f64,
}

/// A joint that moves less than this during a pose's time stands: such pieces repeat one place, radians or metres.
const LEAST_MOTION: f64 = 1e-4;
/// Samples that a mean is worth calling one.
const LEAST_SAMPLES: usize = 5;

/// Poses of a move, none of them at its standing ends.
pub(super) fn poses(points: &[TrackPoint], kinds: &[JointKind], options: &TrackOptions) -> Vec<MovingPose> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Vec::new() };
    let count = (((last.t_s - first.t_s) / options.every_s).floor() as usize).min(points.len());
    let piece = |i: usize| {
        let middle_s = first.t_s + (i as f64 + 0.5) * options.every_s;
        let start = points.partition_point(|point| point.t_s < middle_s - options.mean_s / 2.0);
        let end = points.partition_point(|point| point.t_s <= middle_s + options.mean_s / 2.0);
        mean(&points[start..end], kinds)
    };
    (0..count).filter_map(piece).collect()
}

fn mean(points: &[TrackPoint], kinds: &[JointKind]) -> Option<MovingPose> {
    let (first, last) = (points.first()?, points.last()?);
    let moved = first.q.as_array().iter().zip(last.q.as_array()).take(kinds.len()).map(|(a, b)| (a - b).abs());
    if points.len() < LEAST_SAMPLES || moved.fold(0.0, f64::max) < LEAST_MOTION {
        return None;
    }
    let count = points.len() as f64;
    let t_s = points.iter().map(|point| point.t_s).sum::<f64>() / count;
    let displacement_m = points.iter().map(|point| point.displacement_m).sum::<f64>() / count;
    let mut q = JointVector::zero();
    for point in points {
        for (sum, value) in q.as_array_mut().iter_mut().zip(point.q.as_array()) {
            *sum += value / count;
        }
    }
    let turned = |joint: &usize| points.iter().any(|point| point.approach.direction(*joint) != last.approach.direction(*joint));
    let approach = (0..kinds.len()).filter(turned).fold(last.approach, |approach, joint| approach.with(joint, None));
    // The line through the samples, by least squares.
    let (along, square) = points.iter().fold((0.0, 0.0), |(along, square), point| {
        let t_s = point.t_s - t_s;
        (along + t_s * (point.displacement_m - displacement_m), square + t_s * t_s)
    });
    (square > 0.0).then(|| MovingPose { t_s, q, approach, displacement_m, rate_m_s: along / square })
}

impl Collector<'_, '_> {
    /// Keeps the poses of a move to a row, which is then measured.
    pub(super) fn keep_moving(&mut self, row: usize, poses: &[MovingPose]) -> Result<(), CollectError> {
        let planned = &self.ledger.rows()[row];
        let residual = |pose: &MovingPose| {
            let (residual_m, reserve_m) = self.residual_m(row, &pose.q, pose.displacement_m);
            (residual_m.abs() <= reserve_m).then_some(residual_m)
        };
        let kept: Vec<(&MovingPose, f64)> = poses.iter().filter_map(|pose| Some((pose, residual(pose)?))).collect();
        let Some(&(last, residual_m)) = kept.last() else { return Ok(()) };
        let plan_row = (*self.ledger.state(row) == RowState::Todo).then_some(planned.line);
        let measured = |&(pose, _): &(&MovingPose, f64)| MeasuredPose {
            q: pose.q,
            approach: pose.approach,
            displacement_m: pose.displacement_m,
            t_s: pose.t_s,
            rate_m_s: Some(pose.rate_m_s),
            plan_row,
        };
        self.board.recorder().poses(&kept.iter().map(measured).collect::<Vec<_>>())?;
        self.summary.written += kept.len();
        if plan_row.is_some() { self.done(row, last.displacement_m, residual_m) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use ballbar::Direction;

    use super::*;

    #[test]
    fn a_move_becomes_means_and_rates_and_its_standing_ends_nothing() {
        // One second standing, two moving evenly, one standing; 100 samples a second.
        let point = |i: usize| {
            let t_s = i as f64 * 0.01;
            let way = (t_s - 1.0).clamp(0.0, 2.0);
            let mut q = JointVector::zero();
            q.as_array_mut()[0] = 0.3 * way;
            let approach = Approach::UNKNOWN.with(0, (t_s > 1.5).then_some(Direction::Rising));
            TrackPoint { t_s, q, approach, displacement_m: 0.002 * way - 0.001 }
        };
        let points: Vec<TrackPoint> = (0..400).map(point).collect();
        let options = TrackOptions { every_s: 0.25, mean_s: 0.1 };
        let poses = poses(&points, &[JointKind::Revolute], &options);
        assert_eq!(poses.len(), 8);
        for pose in poses {
            let way = pose.t_s - 1.0;
            assert!((pose.q.as_array()[0] - 0.3 * way).abs() < 1e-12);
            assert!((pose.displacement_m - (0.002 * way - 0.001)).abs() < 1e-12);
            assert!((pose.rate_m_s - 0.002).abs() < 1e-12);
            assert_eq!(pose.approach.sign::<f64>(0), if way > 0.55 { 1.0 } else { 0.0 }, "{way}");
        }
    }
}

//! The poses that a log holds: what poses.csv has to hold.
//!
//! A pose is in the log before it is in poses.csv: as a mark of its own; and where every settled pose is measured, from the moment its
//! frame came. So a program may be killed at any moment, and the next one finds in the log what the file lacks.

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use ballbar::wire::{Answer, Event, LogMark, ToHost};
use ballbar::{Approach, JointKind};

use super::log::{LogError, LogReader};
use super::measured_pose::{Connection, MeasuredPose};
use super::pose_file::time_us;
use super::pose_mark::PoseMark;
use super::record::Record;
use super::settled_rule::{SettledFate, SettledRule};
use crate::board::RobotOnBoard;

/// A pose that a log holds.
#[derive(Clone, Debug)]
pub struct LoggedPose {
    /// What the bar joined.
    pub connection: Rc<Connection>,
    /// What was measured.
    pub pose: MeasuredPose,
    /// Kinds of the robot's joints, where the log still says.
    pub(super) kinds: Option<Rc<[JointKind]>>,
}

/// Follows a log and gathers its poses, those that were erased taken out.
#[derive(Debug, Default)]
pub struct LoggedPoses {
    poses: Vec<LoggedPose>,
    erased: usize,
    /// What the board of this segment uses.
    robot: Option<(RobotOnBoard, Rc<[JointKind]>)>,
    connection: Option<Rc<Connection>>,
    /// In a run that keeps every settled pose.
    rule: Option<SettledRule>,
    /// A settled pose that is to be kept, and its mark has not come yet.
    undecided: Option<MeasuredPose>,
    /// Times of poses that are erased when the last of their marks comes.
    erasing_us: Vec<u64>,
}

impl LoggedPoses {
    /// Reads the log of a session to its end; nothing where there is none yet.
    ///
    /// # Errors
    /// [`LogError`].
    pub fn read(session: &Path) -> Result<Self, LogError> {
        let mut logged = Self::default();
        if !LogReader::is_begun(session) {
            return Ok(logged);
        }
        let mut reader = LogReader::open(session)?;
        while let Some(record) = reader.next_record()? {
            logged.take(&record);
        }
        logged.end();
        Ok(logged)
    }

    /// Takes the next record.
    pub fn take(&mut self, record: &Record) {
        if !matches!(record, Record::Mark(PoseMark::Erased { .. })) {
            self.erasing_us.clear();
        }
        match record {
            Record::Message(message) => self.take_message(message),
            Record::Mark(mark) => self.take_mark(mark),
            Record::Refused(_) | Record::Damaged => {}
        }
    }

    fn take_message(&mut self, message: &ToHost) {
        match message {
            ToHost::Mark(LogMark::Opened { .. }) => self.end_run(),
            ToHost::Mark(LogMark::Lost { .. }) => {
                self.undecided = None;
                self.robot = None;
                if let Some(rule) = &mut self.rule {
                    rule.lose_port();
                }
            }
            ToHost::Mark(LogMark::Back { .. }) | ToHost::Hello(_) => {}
            ToHost::Reply(reply) => {
                if let Ok(Answer::Parameters(set)) = &reply.outcome {
                    let kinds = set.kinds.iter().copied().collect();
                    self.robot = RobotOnBoard::new(set.clone()).map(|robot| (robot, kinds));
                }
            }
            ToHost::Stream(stream) => {
                self.undecided = None;
                let (Some(rule), Some((robot, _))) = (&mut self.rule, &self.robot) else { return };
                match &stream.event {
                    Event::Samples(batch) => rule.take_samples(robot, batch),
                    Event::Settled(pose) => {
                        if let SettledFate::Kept(pose) = rule.judge(robot, pose, stream.homed) {
                            self.undecided = Some(pose);
                        }
                    }
                    Event::Poses(_) => {}
                }
            }
        }
    }

    /// Nothing more comes.
    pub fn end(&mut self) {
        self.end_run();
    }

    /// How many there are, those erased not counted.
    pub fn count(&self) -> usize {
        self.poses.len()
    }

    /// How many were erased.
    pub fn erased(&self) -> usize {
        self.erased
    }

    /// Kinds of the joints of the robot that has poses.
    pub(super) fn kinds(&self) -> Option<&[JointKind]> {
        self.poses.iter().rev().find_map(|logged| logged.kinds.as_deref())
    }

    /// Those that are not among poses of these times (microseconds by the board's clock), each of which stands for one pose.
    pub fn missing_among(&self, times_us: impl IntoIterator<Item = u64>) -> Vec<LoggedPose> {
        let mut there: HashMap<u64, usize> = HashMap::new();
        for t_us in times_us {
            *there.entry(t_us).or_default() += 1;
        }
        let is_missing = |logged: &&LoggedPose| match there.get_mut(&time_us(logged.pose.t_s)) {
            Some(left) if *left > 0 => {
                *left -= 1;
                false
            }
            _ => true,
        };
        self.poses.iter().filter(is_missing).cloned().collect()
    }

    fn take_mark(&mut self, mark: &PoseMark) {
        self.undecided = None;
        match mark {
            PoseMark::Connected { connection, every_settled } => {
                self.connection = Some(Rc::new(connection.clone()));
                self.rule = every_settled.map(SettledRule::new);
            }
            PoseMark::Disconnected => (self.connection, self.rule) = (None, None),
            PoseMark::Measured(pose) => self.keep(pose.measured(Approach::UNKNOWN)),
            PoseMark::Approached { pose, approach } => self.keep(pose.measured(*approach)),
            PoseMark::Erased { times_us, goes_on } => {
                self.erasing_us.extend(times_us);
                if !goes_on {
                    std::mem::take(&mut self.erasing_us).into_iter().for_each(|t_us| self.erase(t_us));
                }
            }
        }
    }

    fn erase(&mut self, t_us: u64) {
        if let Some(at) = self.poses.iter().rposition(|logged| time_us(logged.pose.t_s) == t_us) {
            self.poses.remove(at);
            self.erased += 1;
        }
    }

    fn keep(&mut self, pose: MeasuredPose) {
        if let Some(connection) = self.connection.clone() {
            let kinds = self.robot.as_ref().map(|(_, kinds)| kinds.clone());
            self.poses.push(LoggedPose { connection, pose, kinds });
        }
    }

    fn end_run(&mut self) {
        if let Some(pose) = self.undecided.take() {
            self.keep(pose);
        }
        (self.robot, self.connection, self.rule) = (None, None, None);
    }
}

#[cfg(test)]
mod tests {
    use ballbar::JointVector;

    use super::*;

    #[test]
    fn many_poses_are_erased_together_or_not_at_all() {
        const POSES: u64 = 400;
        let connection = Connection { chuck: "A".into(), sphere: "1".into(), bar_m: 0.46 };
        let pose = |i: u64| MeasuredPose {
            q: JointVector::zero(),
            approach: Approach::UNKNOWN,
            displacement_m: 0.0,
            t_s: i as f64,
            rate_m_s: None,
            plan_row: Some(2),
        };
        let measured = (0..=POSES).map(|i| PoseMark::measured(&pose(i), 6));
        let before: Vec<_> = [PoseMark::Connected { connection, every_settled: None }].into_iter().chain(measured).collect();
        // The first pose stays.
        let erased: Vec<_> = PoseMark::erased(&(1..=POSES).map(|i| i * 1_000_000).collect::<Vec<_>>()).collect();
        assert!(erased.len() > 3 && erased.iter().all(|mark| mark.frame().is_some()), "{} marks", erased.len());
        for come in 0..=erased.len() {
            let mut logged = LoggedPoses::default();
            before.iter().chain(&erased[..come]).for_each(|mark| logged.take(&Record::Mark(mark.clone())));
            // What comes next is no more of them: a killed program's last frame, and the next run.
            logged.take(&Record::Damaged);
            logged.take(&Record::Mark(PoseMark::Erased { times_us: Vec::new(), goes_on: false }));
            let left = if come == erased.len() { 1 } else { POSES as usize + 1 };
            assert_eq!((logged.count(), logged.erased()), (left, POSES as usize + 1 - left), "{come} marks");
        }
    }
}

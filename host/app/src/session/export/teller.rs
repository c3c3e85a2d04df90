//! From the records of a log to its entries: whose parameters, which segment, what time.

use ballbar::wire::{Answer, Event, LogMark, Stream, ToHost};

use super::super::pose_mark::PoseMark;
use super::super::record::Record;
use super::super::segments::{Segments, unix_ms_of};
use super::entry::Entry;
use super::shape::Shape;
use super::stamp::Stamp;
use super::table::{Setting, TableName, Value};
use crate::board::{RobotOnBoard, StreamLosses};

/// Follows a log.
pub(super) struct Teller<'a> {
    shape: &'a Shape,
    segments: Segments,
    /// Number of this one: within it nothing is missing but what the indices show.
    segment: u32,
    clock: Clock,
    /// What the board of this segment uses, from where it said so.
    robot: Option<RobotOnBoard>,
    /// As of the record before.
    losses: StreamLosses,
    row: Vec<Value>,
}

impl<'a> Teller<'a> {
    pub(super) fn new(shape: &'a Shape) -> Self {
        let clock = Clock { now_us: shape.first_mark_ms.and_then(us_from_ms).unwrap_or(0), ..Clock::default() };
        let (segments, losses) = (Segments::default(), StreamLosses::default());
        Self { shape, segments, segment: 0, clock, robot: None, losses, row: Vec::new() }
    }

    /// Takes the next record and tells what it holds; `losses` are those up to it.
    pub(super) fn take<E>(
        &mut self,
        record: Record,
        losses: StreamLosses,
        tell: &mut impl FnMut(&Entry) -> Result<(), E>,
    ) -> Result<(), E> {
        let before = std::mem::replace(&mut self.losses, losses);
        if self.segments.begins(&record) {
            self.begin_segment(&record);
        }
        let message = match record {
            Record::Message(message) => message,
            Record::Refused(reason) => return tell(&self.note(true, format!("a message is not believed: {reason}"))),
            Record::Mark(mark) => return tell(&self.note(false, text_of(&mark))),
            Record::Damaged => return tell(&self.note(true, "a frame is torn or damaged".into())),
        };
        match *message {
            ToHost::Mark(mark) => {
                let (is_warning, text) = match mark {
                    LogMark::Opened { .. } => (false, "recording begins"),
                    LogMark::Lost { .. } => (true, "the port was lost"),
                    LogMark::Back { .. } => (false, "the port is back"),
                };
                tell(&self.note(is_warning, format!("segment {}: {text}", self.segment)))
            }
            ToHost::Hello(hello) => {
                if !self.clock.is_known {
                    tell(&self.note(true, format!("segment {}: its mark is damaged, its time unknown", self.segment)))?;
                }
                self.clock.greet(hello.uptime_us);
                tell(&self.note(false, format!("board {}, firmware {}", hello.board, hello.firmware)))
            }
            ToHost::Reply(reply) => {
                let Ok(Answer::Parameters(set)) = reply.outcome else { return Ok(()) };
                let text = format!("the board uses parameters of {}", set.name);
                self.robot = RobotOnBoard::new(set);
                tell(&self.note(false, text))
            }
            ToHost::Stream(stream) => self.stream(&stream, before, tell),
        }
    }

    /// Another board may answer from here on: it has said nothing yet of its parameters, and its clock is another.
    fn begin_segment(&mut self, first: &Record) {
        self.segment += 1;
        self.robot = None;
        self.clock.begin(match first {
            Record::Message(message) => match **message {
                ToHost::Mark(mark) => us_from_ms(unix_ms_of(mark)),
                _ => None,
            },
            Record::Refused(_) | Record::Mark(_) | Record::Damaged => None,
        });
    }

    fn stream<E>(
        &mut self,
        stream: &Stream,
        before: StreamLosses,
        tell: &mut impl FnMut(&Entry) -> Result<(), E>,
    ) -> Result<(), E> {
        let (missing, overruns) = (self.losses.missing - before.missing, self.losses.overruns - before.overruns);
        if missing + overruns > 0 {
            let text = format!("{missing} messages and {overruns} samples are missing before this");
            let stamp = self.clock.stamp(0, start_us(&stream.event));
            tell(&Entry::Note { stamp, is_warning: true, text })?;
        }
        let mut row = std::mem::take(&mut self.row);
        let setting = Setting { shape: self.shape, segment: self.segment, robot: self.robot.as_ref(), homed: stream.homed };
        let clock = &mut self.clock;
        match &stream.event {
            Event::Samples(batch) => {
                for sample in batch.samples() {
                    let stamp = clock.stamp(sample.index, sample.t_us);
                    setting.sample(&stamp, &sample, &mut row);
                    tell(&Entry::Row { table: TableName::Samples, stamp, values: &row })?;
                }
            }
            Event::Settled(pose) => {
                let stamp = clock.stamp(pose.index, pose.t_us);
                setting.settled(&stamp, pose, &mut row);
                tell(&Entry::Row { table: TableName::Settled, stamp, values: &row })?;
            }
            Event::Poses(batch) => {
                let mut index = batch.index;
                for pose in &batch.poses {
                    let stamp = clock.stamp(index, batch.t_us.wrapping_add(pose.dt_us.into()));
                    index = index.wrapping_add(batch.stride.into());
                    tell(&Entry::ToolPose { stamp, pose: &pose.pose })?;
                    setting.bar(&stamp, pose.displacement_m, &mut row);
                    tell(&Entry::Row { table: TableName::Bar, stamp, values: &row })?;
                }
            }
        }
        self.row = row;
        Ok(())
    }

    /// A note of the time that the clock shows.
    fn note(&self, is_warning: bool, text: String) -> Entry<'static> {
        let now_us = self.clock.now_us;
        let stamp = Stamp { unix_us: self.clock.is_known.then_some(now_us), log_us: now_us, ..Stamp::default() };
        Entry::Note { stamp, is_warning, text }
    }
}

/// What the host noted of poses, in words.
fn text_of(mark: &PoseMark) -> String {
    match mark {
        PoseMark::Connected { connection, .. } => format!("the bar joins {connection}"),
        PoseMark::Disconnected => "the bar is off, or nobody knows what it joins".into(),
        PoseMark::Measured(pose) | PoseMark::Approached { pose, .. } => format!("the pose of {:.6} s was measured", pose.t_s),
        PoseMark::Erased { times_us, .. } => {
            let times: Vec<String> = times_us.iter().map(|&t_us| format!("{:.6} s", t_us as f64 * 1e-6)).collect();
            format!("poses were erased: {}", times.join(", "))
        }
    }
}

/// Time of an event's beginning by the board's clock, microseconds.
fn start_us(event: &Event) -> u64 {
    match event {
        Event::Samples(batch) => batch.first.t_us,
        Event::Settled(pose) => pose.t_us,
        Event::Poses(batch) => batch.t_us,
    }
}

/// From the board's clock to the calendar. A recording's mark has the host's time; the hello before it has the board's. Both are
/// taken for one moment: the calendar's time is late by what lay between, while differences are the board's own.
#[derive(Clone, Copy, Debug, Default)]
struct Clock {
    /// Time of the latest mark, then of what was told last; microseconds since 1970.
    now_us: i64,
    /// This segment's mark was read. Where it was not, the times above go on from the last one known, so that what a log tells stays
    /// in its order.
    is_known: bool,
    /// What to add to the board's time, microseconds.
    offset_us: Option<i64>,
}

impl Clock {
    /// Another segment, with the time of its mark where that is known.
    fn begin(&mut self, mark_us: Option<i64>) {
        *self = Self { now_us: mark_us.unwrap_or(self.now_us), is_known: mark_us.is_some(), offset_us: None };
    }

    fn greet(&mut self, uptime_us: u64) {
        self.offset_us = self.now_us.checked_sub_unsigned(uptime_us);
    }

    /// When something was by the board's clock. Without a hello, the first thing that came is taken for the mark's moment.
    fn stamp(&mut self, index: u32, t_us: u64) -> Stamp {
        if self.offset_us.is_none() {
            self.greet(t_us);
        }
        let told_us = self.offset_us.and_then(|offset_us| offset_us.checked_add_unsigned(t_us));
        self.now_us = told_us.unwrap_or(self.now_us);
        Stamp { index, t_us, unix_us: told_us.filter(|_| self.is_known), log_us: self.now_us }
    }
}

fn us_from_ms(unix_ms: u64) -> Option<i64> {
    i64::try_from(unix_ms).ok()?.checked_mul(1_000)
}

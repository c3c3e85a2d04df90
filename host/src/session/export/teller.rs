//! From the records of a log to its entries: whose parameters, which segment, what time.

use ballbar::wire::{Answer, Event, LogMark, Stream, ToHost};

use super::super::log::Record;
use super::entry::{Entry, Stamp};
use super::shape::Shape;
use super::table::{Setting, TableName, Value};
use crate::board::{RobotOnBoard, StreamTally};

/// Follows a log.
pub(super) struct Teller<'a> {
    shape: &'a Shape,
    /// Raised by every mark: within one segment nothing is missing but what the indices show.
    segment: u32,
    clock: Clock,
    /// What the board of this segment uses, from where it said so.
    robot: Option<RobotOnBoard>,
    tally: StreamTally,
    row: Vec<Value>,
}

impl<'a> Teller<'a> {
    pub(super) fn new(shape: &'a Shape) -> Self {
        Self { shape, segment: 0, clock: Clock::default(), robot: None, tally: StreamTally::default(), row: Vec::new() }
    }

    /// Takes the next record and tells what it holds.
    pub(super) fn take<E>(&mut self, record: Record, tell: &mut impl FnMut(&Entry) -> Result<(), E>) -> Result<(), E> {
        let Record::Message(message) = record else {
            return tell(&self.note(true, "a frame is torn or damaged".into()));
        };
        match *message {
            ToHost::Mark(mark) => {
                self.begin_segment(mark);
                let (is_warning, text) = match mark {
                    LogMark::Opened { .. } => (false, "recording begins"),
                    LogMark::Lost { .. } => (true, "the port was lost"),
                    LogMark::Back { .. } => (false, "the port is back"),
                };
                tell(&self.note(is_warning, format!("segment {}: {text}", self.segment)))
            }
            ToHost::Hello(hello) => {
                self.clock.greet(hello.uptime_us);
                tell(&self.note(false, format!("board {}, firmware {}", hello.board, hello.firmware)))
            }
            ToHost::Reply(reply) => {
                let Ok(Answer::Parameters(set)) = reply.outcome else { return Ok(()) };
                let text = format!("the board uses parameters of {}", set.name);
                self.robot = RobotOnBoard::new(set);
                tell(&self.note(false, text))
            }
            ToHost::Stream(stream) => self.stream(&stream, tell),
        }
    }

    /// Another board may answer from here on: it has said nothing yet of its parameters, and its clock is another.
    fn begin_segment(&mut self, mark: LogMark) {
        let (LogMark::Opened { unix_ms } | LogMark::Lost { unix_ms } | LogMark::Back { unix_ms }) = mark;
        self.segment += 1;
        self.robot = None;
        self.tally.interrupt();
        self.clock = Clock::at(unix_ms);
    }

    fn stream<E>(&mut self, stream: &Stream, tell: &mut impl FnMut(&Entry) -> Result<(), E>) -> Result<(), E> {
        let before = self.tally.losses();
        self.tally.take(stream);
        let after = self.tally.losses();
        let (missing, overruns) = (after.missing - before.missing, after.overruns - before.overruns);
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
        let stamp = Stamp { unix_us: self.clock.now_us, ..Stamp::default() };
        Entry::Note { stamp, is_warning, text }
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
    /// Time of the segment's mark, then of what was told last; microseconds since 1970.
    now_us: Option<i64>,
    /// What to add to the board's time, microseconds.
    offset_us: Option<i64>,
}

impl Clock {
    fn at(unix_ms: u64) -> Self {
        Self { now_us: i64::try_from(unix_ms).ok().and_then(|ms| ms.checked_mul(1_000)), offset_us: None }
    }

    fn greet(&mut self, uptime_us: u64) {
        self.offset_us = self.now_us.and_then(|now_us| now_us.checked_sub_unsigned(uptime_us));
    }

    /// When something was by the board's clock. Without a hello, the first thing that came is taken for the mark's moment.
    fn stamp(&mut self, index: u32, t_us: u64) -> Stamp {
        if self.offset_us.is_none() {
            self.greet(t_us);
        }
        let unix_us = self.offset_us.and_then(|offset_us| offset_us.checked_add_unsigned(t_us));
        self.now_us = unix_us.or(self.now_us);
        Stamp { index, t_us, unix_us }
    }
}

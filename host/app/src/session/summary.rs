//! What a log holds and what it lacks.

use ballbar::wire::{Event, LogMark, ToHost};
use serde::Serialize;

use super::log::{LogError, LogReader};
use super::logged_poses::LoggedPoses;
use super::record::Record;
use super::segments::Segments;
use crate::board::StreamLosses;

/// What a log holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LogSummary {
    /// Whole frames.
    pub frames: u64,
    /// Torn or damaged ones.
    pub damaged: u64,
    /// Bytes of a frame that the end of the file cuts off.
    pub unfinished_bytes: usize,
    /// Times that a program began to record.
    pub runs: u64,
    /// Times that the port was lost.
    pub gaps: u64,
    /// Samples.
    pub samples: u64,
    /// Settled poses.
    pub settled: u64,
    /// Corrected tool poses.
    pub poses: u64,
    /// Time from the first sample, settled pose or tool pose to the last, by the board's clock, seconds; gaps not counted.
    pub duration_s: f64,
    /// What was lost on the way.
    pub losses: StreamLosses,
}

impl LogSummary {
    /// Reads a log to its end.
    ///
    /// # Errors
    /// [`LogError`].
    pub fn read(reader: &mut LogReader) -> Result<Self, LogError> {
        Self::read_with_poses(reader).map(|(summary, _)| summary)
    }

    /// Reads a log to its end, and gathers the poses that it holds.
    ///
    /// # Errors
    /// [`LogError`].
    pub fn read_with_poses(reader: &mut LogReader) -> Result<(Self, LoggedPoses), LogError> {
        let (mut summing, mut logged) = (Summing::default(), LoggedPoses::default());
        while let Some(record) = reader.next_record()? {
            summing.take(&record);
            logged.take(&record);
        }
        logged.end();
        Ok((summing.end(reader), logged))
    }

    /// Whether nothing is missing: no frame damaged, no message or sample lost or refused, no port lost.
    pub fn is_whole(&self) -> bool {
        let Self { damaged, gaps, losses, .. } = self;
        damaged + gaps + losses.lost() == 0
    }

    /// Counts what an event holds; returns its last time, microseconds.
    fn count(&mut self, event: &Event) -> u64 {
        match event {
            Event::Samples(batch) => {
                self.samples += batch.len() as u64;
                batch.rest.iter().fold(batch.first.t_us, |t_us, step| t_us.wrapping_add(u64::from(step.dt_us)))
            }
            Event::Settled(pose) => {
                self.settled += 1;
                pose.t_us.wrapping_add(u64::from(pose.duration_us))
            }
            Event::Poses(batch) => {
                self.poses += batch.poses.len() as u64;
                batch.t_us + batch.poses.last().map_or(0, |pose| u64::from(pose.dt_us))
            }
        }
    }
}

/// A summary being made, record by record.
#[derive(Debug, Default)]
pub(super) struct Summing {
    summary: LogSummary,
    segments: Segments,
    /// Time of the latest event of this segment by the board's clock, microseconds.
    last_us: Option<u64>,
}

impl Summing {
    /// Counts the next record.
    pub(super) fn take(&mut self, record: &Record) {
        if self.segments.begins(record) {
            self.last_us = None;
        }
        let message = match record {
            Record::Message(message) => message,
            Record::Refused(_) | Record::Mark(_) => {
                self.summary.frames += 1;
                return;
            }
            Record::Damaged => {
                self.summary.damaged += 1;
                return;
            }
        };
        self.summary.frames += 1;
        match &**message {
            ToHost::Mark(mark) => {
                self.summary.runs += u64::from(matches!(mark, LogMark::Opened { .. }));
                self.summary.gaps += u64::from(matches!(mark, LogMark::Lost { .. }));
            }
            ToHost::Stream(stream) => {
                let now_us = self.summary.count(&stream.event);
                let step_us = self.last_us.map_or(0, |last_us| now_us.saturating_sub(last_us));
                self.summary.duration_s += step_us as f64 * 1e-6;
                self.last_us = Some(now_us.max(self.last_us.unwrap_or(0)));
            }
            ToHost::Hello(_) | ToHost::Reply(_) => {}
        }
    }

    /// The summary of what was taken from this reader.
    pub(super) fn end(self, reader: &LogReader) -> LogSummary {
        LogSummary { unfinished_bytes: reader.unfinished_bytes(), losses: reader.losses(), ..self.summary }
    }
}

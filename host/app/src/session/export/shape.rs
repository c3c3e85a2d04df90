//! What a log needs columns for.

use std::collections::BTreeMap;
use std::path::Path;

use ballbar::JointKind;
use ballbar::wire::{Answer, Event, ToHost};

use super::super::description::{BoardDescription, RobotDescription};
use super::super::log::LogReader;
use super::super::record::Record;
use super::super::segments::unix_ms_of;
use super::LogExportError;
use super::column::Column;

/// What a whole log needs columns for, and what it was recorded with.
#[derive(Debug)]
pub(super) struct Shape {
    /// Entries of the log.
    pub(super) records: u64,
    /// Time of the first mark that is whole, milliseconds since 1970.
    pub(super) first_mark_ms: Option<u64>,
    /// Encoders of the smallest board.
    pub(super) encoders_min: usize,
    /// Encoders of the largest board.
    pub(super) encoders_max: usize,
    /// Joints that any robot of the log has, by number from 0. Where one has a revolute and another a prismatic joint, both.
    pub(super) joints: Vec<(usize, JointKind)>,
    /// Boards, in words.
    boards: Vec<String>,
    /// Robots, in words.
    robots: Vec<String>,
    log: String,
}

impl Shape {
    /// Reads a log to its end.
    ///
    /// # Errors
    /// [`LogExportError::Log`], [`LogExportError::Interrupted`].
    pub(super) fn read(reader: &mut LogReader, is_ended: &dyn Fn() -> bool) -> Result<Self, LogExportError> {
        let log = log_name(reader.path());
        let mut shape = Self {
            records: 0,
            first_mark_ms: None,
            encoders_min: usize::MAX,
            encoders_max: 0,
            joints: Vec::new(),
            boards: Vec::new(),
            robots: Vec::new(),
            log,
        };
        while let Some(record) = reader.next_record()? {
            shape.records += 1;
            if is_ended() {
                return Err(LogExportError::Interrupted);
            }
            if let Record::Message(message) = record {
                shape.take(&message);
            }
        }
        shape.joints.sort_by_key(|&(joint, kind)| (joint, kind == JointKind::Prismatic));
        shape.encoders_min = shape.encoders_min.min(shape.encoders_max);
        Ok(shape)
    }

    fn take(&mut self, message: &ToHost) {
        match message {
            ToHost::Hello(hello) => {
                let BoardDescription { kind, unique_id, firmware, .. } = BoardDescription::from(hello);
                note(&mut self.boards, format!("{kind} {unique_id}, firmware {firmware}"));
                if let Some(identity) = &hello.active {
                    let RobotDescription { name, is_calibrated, crc } = identity.into();
                    let state = if is_calibrated { "calibrated" } else { "as designed" };
                    note(&mut self.robots, format!("{name}, {state}, parameters {crc}"));
                }
            }
            ToHost::Reply(reply) => {
                if let Ok(Answer::Parameters(set)) = &reply.outcome {
                    for joint in set.kinds.iter().copied().enumerate() {
                        note(&mut self.joints, joint);
                    }
                }
            }
            ToHost::Stream(stream) => match &stream.event {
                Event::Samples(batch) => self.encoders(batch.first.counts.len()),
                Event::Settled(pose) => self.encoders(pose.counts_mean.len()),
                Event::Poses(_) => {}
            },
            ToHost::Mark(mark) => {
                self.first_mark_ms.get_or_insert(unix_ms_of(*mark));
            }
        }
    }

    fn encoders(&mut self, encoders: usize) {
        self.encoders_min = self.encoders_min.min(encoders);
        self.encoders_max = self.encoders_max.max(encoders);
    }

    /// What a file that is exported says of itself; units of these columns included.
    pub(super) fn facts(&self, columns: &[Column]) -> BTreeMap<String, String> {
        let units: serde_json::Map<String, serde_json::Value> =
            columns.iter().map(|column| (column.name.clone(), column.unit.into())).collect();
        BTreeMap::from(
            [
                ("log", self.log.clone()),
                ("made_by", concat!("host-cal ", env!("CARGO_PKG_VERSION")).to_owned()),
                ("board", self.boards.join("; ")),
                ("robot", self.robots.join("; ")),
                ("units", serde_json::Value::Object(units).to_string()),
            ]
            .map(|(key, value)| (key.to_owned(), value)),
        )
    }
}

/// The session's directory and the file, without the way to them, which means nothing elsewhere.
fn log_name(path: &Path) -> String {
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let names: Vec<_> = path.components().rev().take(2).map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    names.into_iter().rev().collect::<Vec<_>>().join("/")
}

/// Adds what is not there yet.
fn note<T: PartialEq>(list: &mut Vec<T>, item: T) {
    if !list.contains(&item) {
        list.push(item);
    }
}

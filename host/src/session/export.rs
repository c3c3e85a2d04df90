//! A session's samples as a table.

use std::io::Write;

use ballbar::wire::{Answer, Event, ToHost};
use ballbar::{JointKind, Sample};
use miette::Diagnostic;
use thiserror::Error;

use super::log::{LogError, LogReader, Record};
use crate::board::RobotOnBoard;
use crate::units::{ScreenUnit, mm_from_m};

/// Why a log could not be exported.
#[derive(Debug, Error, Diagnostic)]
pub enum ExportError {
    /// The log.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Log(#[from] LogError),
    /// The table.
    #[error("the table cannot be written: {0}")]
    Write(#[from] std::io::Error),
}

/// Writes every sample of a log as a line: run and gap numbers, the board's clock, counts, code, whether all joints were homed, and, from where the log knows the
/// board's parameters, joint values and displacement. Returns how many.
///
/// # Errors
/// [`ExportError`].
pub fn export_csv(reader: &mut LogReader, out: &mut impl Write) -> Result<u64, ExportError> {
    let mut table = Table { out, robot: None, segment: 0, columns: None, lines: 0 };
    while let Some(record) = reader.next_record()? {
        let Record::Message(message) = record else { continue };
        match *message {
            ToHost::Mark(_) => table.segment += 1,
            ToHost::Reply(reply) => {
                if let Ok(Answer::Parameters(set)) = reply.outcome {
                    table.robot = RobotOnBoard::new(set).or(table.robot);
                }
            }
            ToHost::Stream(stream) => {
                if let Event::Samples(batch) = stream.event {
                    for sample in batch.samples() {
                        table.line(&sample, stream.homed)?;
                    }
                }
            }
            ToHost::Hello(_) => {}
        }
    }
    table.out.flush()?;
    Ok(table.lines)
}

struct Table<'a, W> {
    out: &'a mut W,
    robot: Option<RobotOnBoard>,
    /// Raised by every mark: within one segment nothing is missing but what the indices show.
    segment: u32,
    /// Kinds of the joints that the header has columns for; none before it is written.
    columns: Option<Vec<JointKind>>,
    lines: u64,
}

impl<W: Write> Table<'_, W> {
    fn line(&mut self, sample: &Sample, homed: u8) -> std::io::Result<()> {
        let kinds = match self.columns.take() {
            Some(kinds) => kinds,
            None => self.header(sample.counts.len())?,
        };
        let mut fields = vec![self.segment.to_string(), sample.index.to_string(), sample.t_us.to_string()];
        fields.extend(sample.counts.iter().map(i32::to_string));
        fields.push(sample.lvdt.code.to_string());
        fields.push(u8::from(sample.lvdt.saturated).to_string());
        fields.push(self.robot.as_ref().map_or(String::new(), |robot| u8::from(robot.is_homed(homed)).to_string()));
        let q = self.robot.as_ref().map(|robot| robot.q(sample.counts.iter().map(|&counts| f64::from(counts))));
        fields.extend(kinds.iter().enumerate().map(|(i, &kind)| {
            q.as_ref().map_or(String::new(), |q| format!("{:.9}", ScreenUnit::from(kind).from_si(q.as_array()[i])))
        }));
        let displacement = self.robot.as_ref().and_then(|robot| robot.displacement_m(sample.lvdt));
        fields.push(displacement.map_or(String::new(), |m| format!("{:.6}", mm_from_m(m))));
        self.columns = Some(kinds);
        writeln!(self.out, "{}", fields.join(","))?;
        self.lines += 1;
        Ok(())
    }

    /// Writes the header; joints have columns when the parameters are known by now.
    fn header(&mut self, encoders: usize) -> std::io::Result<Vec<JointKind>> {
        let kinds: Vec<JointKind> = self.robot.as_ref().map(|robot| robot.kinds().to_vec()).unwrap_or_default();
        let counts = (1..=encoders).map(|i| format!("counts{i}"));
        let joints = kinds.iter().enumerate().map(|(i, &kind)| format!("q{}_{}", i + 1, ScreenUnit::from(kind).name()));
        let before = ["segment", "index", "t_us"].map(str::to_owned).into_iter().chain(counts);
        let columns = before.chain(["code", "saturated", "homed"].map(str::to_owned)).chain(joints);
        let columns: Vec<String> = columns.chain(["displacement_mm".to_owned()]).collect();
        writeln!(self.out, "{}", columns.join(","))?;
        Ok(kinds)
    }
}

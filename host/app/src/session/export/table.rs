//! The tables of an exported log: columns described once, for all formats, and rows of typed values.

use ballbar::{JointKind, LvdtReading, Sample, SettledPose};

use super::column::{Column, ColumnType};
use super::shape::Shape;
use super::stamp::Stamp;
use crate::board::RobotOnBoard;
use crate::units::{ScreenUnit, mm_from_m};

/// A table of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TableName {
    /// Every sample.
    Samples,
    /// The poses at which the arm stood still.
    Settled,
    /// The bar's displacement beside every tool pose.
    Bar,
}

/// A value of a column's type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value {
    /// Of the integer types.
    Integer(i64),
    /// Of [`ColumnType::Flag`].
    Flag(bool),
    /// Of [`ColumnType::Real`].
    Real(f64),
    /// Nobody can tell.
    Unknown,
}

/// Decimals of joint values, degrees or millimetres.
const JOINT_DECIMALS: usize = 9;
/// Decimals of the bar's displacement, millimetres.
const DISPLACEMENT_DECIMALS: usize = 6;
/// Decimals of means and deviations, counts and codes.
const MEAN_DECIMALS: usize = 6;

impl TableName {
    /// The columns, in a log of this shape.
    pub(super) fn columns(self, shape: &Shape) -> Vec<Column> {
        let mut columns = vec![
            column("segment", "1", ColumnType::Unsigned32),
            column("index", "1", ColumnType::Unsigned32),
            column("t_us", "us", ColumnType::Signed64),
            optional(column("unix_us", "us", ColumnType::Signed64)),
        ];
        let encoders = |name: &'static str, column_type| {
            (1..=shape.encoders_max)
                .map(move |i| Column { is_optional: i > shape.encoders_min, ..column(&format!("{name}{i}"), "1", column_type) })
        };
        let mean = ColumnType::Real { decimals: MEAN_DECIMALS };
        match self {
            Self::Samples => {
                columns.extend(encoders("counts", ColumnType::Signed32));
                columns.extend([column("code", "1", ColumnType::Signed32), column("saturated", "1", ColumnType::Flag)]);
            }
            Self::Settled => {
                columns.extend([
                    column("duration_us", "us", ColumnType::Unsigned32),
                    column("samples", "1", ColumnType::Unsigned32),
                ]);
                columns.extend(encoders("counts_mean", mean));
                columns.extend(encoders("counts_std", mean));
                columns.extend([column("code_mean", "1", mean), column("code_std", "1", mean)]);
            }
            Self::Bar => {}
        }
        columns.push(optional(column("homed", "1", ColumnType::Flag)));
        if self != Self::Bar {
            columns.extend(shape.joints.iter().map(|&(joint, kind)| {
                let unit = ScreenUnit::from(kind).name();
                optional(column(&format!("q{}_{unit}", joint + 1), unit, ColumnType::Real { decimals: JOINT_DECIMALS }))
            }));
        }
        let displacement = ColumnType::Real { decimals: DISPLACEMENT_DECIMALS };
        columns.push(optional(column("displacement_mm", "mm", displacement)));
        columns
    }
}

fn column(name: &str, unit: &'static str, column_type: ColumnType) -> Column {
    Column { name: name.to_owned(), unit, column_type, is_optional: false }
}

fn optional(column: Column) -> Column {
    Column { is_optional: true, ..column }
}

/// What the values of a row are computed with.
pub(super) struct Setting<'a> {
    pub(super) shape: &'a Shape,
    pub(super) segment: u32,
    pub(super) robot: Option<&'a RobotOnBoard>,
    /// Bit i: encoder i was preset.
    pub(super) homed: u8,
}

impl Setting<'_> {
    /// A row of [`TableName::Samples`].
    pub(super) fn sample(&self, stamp: &Stamp, sample: &Sample, row: &mut Vec<Value>) {
        self.beginning(stamp, row);
        self.encoders(sample.counts.iter().map(|&counts| Value::Integer(counts.into())), row);
        row.extend([Value::Integer(sample.lvdt.code.into()), Value::Flag(sample.lvdt.saturated)]);
        row.push(self.is_homed());
        self.joints(sample.counts.iter().map(|&counts| f64::from(counts)), row);
        row.push(self.displacement(sample.lvdt));
    }

    /// A row of [`TableName::Settled`].
    pub(super) fn settled(&self, stamp: &Stamp, pose: &SettledPose, row: &mut Vec<Value>) {
        self.beginning(stamp, row);
        row.extend([pose.duration_us, pose.samples].map(|number| Value::Integer(number.into())));
        self.encoders(pose.counts_mean.iter().map(|&mean| real(mean, MEAN_DECIMALS)), row);
        self.encoders(pose.counts_std.iter().map(|&std| real(std.into(), MEAN_DECIMALS)), row);
        row.extend([pose.code_mean, pose.code_std.into()].map(|number| real(number, MEAN_DECIMALS)));
        row.push(self.is_homed());
        self.joints(pose.counts_mean.iter().copied(), row);
        row.push(displacement(self.robot.and_then(|robot| robot.settled(pose).1)));
    }

    /// A row of [`TableName::Bar`].
    pub(super) fn bar(&self, stamp: &Stamp, displacement_m: Option<f32>, row: &mut Vec<Value>) {
        self.beginning(stamp, row);
        row.push(self.is_homed());
        row.push(displacement(displacement_m.map(f64::from)));
    }

    fn beginning(&self, stamp: &Stamp, row: &mut Vec<Value>) {
        row.clear();
        // The board's clock starts at zero and needs 292,000 years to leave the range.
        let t_us = i64::try_from(stamp.t_us).unwrap_or(i64::MAX);
        row.extend([self.segment, stamp.index].map(|number| Value::Integer(number.into())));
        row.extend([Value::Integer(t_us), stamp.unix_us.map_or(Value::Unknown, Value::Integer)]);
    }

    /// Values of the board's encoders; those of a larger board in the same log are unknown.
    fn encoders(&self, values: impl Iterator<Item = Value>, row: &mut Vec<Value>) {
        row.extend(values.chain(std::iter::repeat(Value::Unknown)).take(self.shape.encoders_max));
    }

    fn is_homed(&self) -> Value {
        self.robot.map_or(Value::Unknown, |robot| Value::Flag(robot.is_homed(self.homed)))
    }

    /// Joint values; those of another robot in the same log, and of joints that the row's board has no encoder for, are unknown.
    fn joints(&self, counts: impl ExactSizeIterator<Item = f64>, row: &mut Vec<Value>) {
        let Some(robot) = self.robot else {
            row.extend(self.shape.joints.iter().map(|_| Value::Unknown));
            return;
        };
        let encoders = counts.len();
        let q = robot.q(counts);
        row.extend(self.shape.joints.iter().map(|&(joint, kind): &(usize, JointKind)| {
            let is_there = joint < encoders && robot.kinds().get(joint) == Some(&kind);
            let value = q.as_array().get(joint).filter(|_| is_there);
            value.map_or(Value::Unknown, |&q| real(ScreenUnit::from(kind).from_si(q), JOINT_DECIMALS))
        }));
    }

    fn displacement(&self, lvdt: LvdtReading) -> Value {
        displacement(self.robot.and_then(|robot| robot.displacement_m(lvdt)))
    }
}

fn displacement(displacement_m: Option<f64>) -> Value {
    displacement_m.map_or(Value::Unknown, |m| real(mm_from_m(m), DISPLACEMENT_DECIMALS))
}

/// Rounded, so that the text of the number and the number itself are the same.
fn real(value: f64, decimals: usize) -> Value {
    let scale = 10_f64.powi(decimals as i32);
    // Zero is added so that what rounds to zero has no sign.
    Value::Real((value * scale).round() / scale + 0.0)
}

//! What files of poses and plans have in common: a header, joints' columns as the robot has them, a chuck and a sphere of the rig,
//! and the place of whatever is wrong.

use std::collections::HashSet;
use std::num::ParseFloatError;
use std::ops::Range;

use ballbar::{JointKind, JointVector};
use ballbar_calib::model::{NamedPoint, PairingId, Rig, Robot};
use csv::{ReaderBuilder, StringRecord, Trim};

use super::numbers::Range as Of;
use super::poses::joint_column;
use super::problem::{Problem, short};
use super::source::{InputError, Source};
use crate::units::ScreenUnit;

/// As much of a name or a field as a message shows.
const SHOWN: usize = 80;

/// A CSV text, being read.
pub(super) struct CsvRows<'a> {
    pub(super) source: &'a Source,
    pub(super) robot: &'a Robot,
    /// What parts the fields.
    separator: char,
    header: StringRecord,
    records: Vec<StringRecord>,
    expected: &'a Expected<'a>,
}

/// What a kind of file has in its header, beside the robot's joints.
pub(super) struct Expected<'a> {
    /// What a row is, for messages: `poses`.
    pub(super) rows_are: &'static str,
    /// Columns that must be there.
    pub(super) required: &'a [&'a str],
    /// Columns that may be there.
    pub(super) optional: &'a [&'a str],
    /// Whether the joints may all be left out.
    pub(super) joints_are_optional: bool,
    /// The header in words, for messages.
    pub(super) header: &'static str,
}

impl<'a> CsvRows<'a> {
    /// Splits the text into records and checks the header.
    pub(super) fn split(source: &'a Source, robot: &'a Robot, expected: &'a Expected<'a>) -> Result<Self, InputError> {
        let separator = separator(source.text());
        let mut builder = ReaderBuilder::new();
        builder.delimiter(separator as u8).comment(Some(b'#')).trim(Trim::All).flexible(true);
        let mut reader = builder.from_reader(source.text().as_bytes());
        let broken = |error: csv::Error| InputError::of_file(source.name(), Problem::Csv(error.to_string()));
        let nothing = || InputError::of_file(source.name(), Problem::NoRows(expected.rows_are));
        if source.text().trim().is_empty() {
            return Err(nothing());
        }
        let header = without_empty_end(reader.headers().map_err(broken)?);
        let mut rows = Self { source, robot, separator, header, records: Vec::new(), expected };
        rows.check_header()?;
        expected.required.iter().try_for_each(|name| rows.required(name).map(drop))?;
        for record in reader.records() {
            let record = record.map_err(broken)?;
            // A line of white space or of separators, as spreadsheets write them, is as empty as an empty one.
            if !record.iter().all(str::is_empty) {
                rows.check_fields(&record)?;
                rows.records.push(record);
            }
        }
        if rows.records.is_empty() { Err(nothing()) } else { Ok(rows) }
    }

    /// The rows.
    pub(super) fn records(&self) -> &[StringRecord] {
        &self.records
    }

    /// Where a column stands; `None` when it is not there.
    pub(super) fn optional(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|other| other == name)
    }

    /// Where a column stands.
    pub(super) fn required(&self, name: &str) -> Result<usize, InputError> {
        let missing = || Problem::MissingColumn { name: name.to_owned(), expected: self.expected.header };
        self.optional(name).ok_or_else(|| self.refuse_header(missing()))
    }

    /// Whether the header has any column of a joint.
    pub(super) fn has_joints(&self) -> bool {
        self.header.iter().any(|name| parse_joint_column(name).is_some())
    }

    /// Where the joints' columns stand.
    pub(super) fn joints(&self) -> Result<Vec<usize>, InputError> {
        self.joint_columns().map(|name| self.required(&name)).collect()
    }

    /// The chuck and the sphere that a row names.
    pub(super) fn pairing(&self, record: &StringRecord, rig: &Rig, chuck: usize, sphere: usize) -> Result<PairingId, InputError> {
        Ok(PairingId {
            chuck: self.end(record, chuck, "chuck", rig.chuck(&record[chuck]), &rig.chucks)?,
            sphere: self.end(record, sphere, "sphere", rig.sphere(&record[sphere]), &rig.spheres)?,
        })
    }

    /// The joints of a row, SI.
    pub(super) fn joint_vector(&self, record: &StringRecord, columns: &[usize]) -> Result<JointVector<f64>, InputError> {
        let mut q = Vec::with_capacity(columns.len());
        for (&column, &kind) in columns.iter().zip(self.robot.chain.joint_kinds()) {
            q.push(ScreenUnit::from(kind).to_si(self.number(record, column, Of::Plausible)?));
        }
        let refuse = |error: ballbar::ChainError| self.refuse_row(record, Problem::Csv(error.to_string()));
        self.robot.chain.joint_vector(&q).map_err(refuse)
    }

    /// A number of a row.
    pub(super) fn number(&self, record: &StringRecord, column: usize, range: Of) -> Result<f64, InputError> {
        let (name, found) = (self.header[column].to_owned(), record[column].to_owned());
        let problem = match self.parse(&found) {
            Ok(number) if range.contains(number) => return Ok(number),
            Ok(_) => Problem::Number { field: name, found, expected: range.words() },
            Err(_) if found.is_empty() => Problem::EmptyField { column: name },
            Err(_) => Problem::NotANumber { column: name, found: short(&found, SHOWN) },
        };
        Err(self.refuse_field(record, column, problem))
    }

    /// A number with a point; where fields are not parted by commas also one with a decimal comma.
    fn parse(&self, field: &str) -> Result<f64, ParseFloatError> {
        if self.separator != ',' && !field.contains('.') { field.replacen(',', ".", 1).parse() } else { field.parse() }
    }

    /// Line of a row, from 1.
    pub(super) fn line(&self, record: &StringRecord) -> usize {
        self.locate(record).0
    }

    /// A problem of one field.
    pub(super) fn refuse_field(&self, record: &StringRecord, column: usize, problem: Problem) -> InputError {
        InputError::at(self.source, self.field_span(record, column), problem)
    }

    fn refuse_row(&self, record: &StringRecord, problem: Problem) -> InputError {
        InputError::at(self.source, self.locate(record).1, problem)
    }

    fn refuse_header(&self, problem: Problem) -> InputError {
        self.refuse_row(&self.header, problem)
    }

    fn check_header(&self) -> Result<(), InputError> {
        let mut names = HashSet::new();
        if let Some(name) = self.header.iter().find(|name| !names.insert(*name)) {
            return Err(self.refuse_header(Problem::Duplicate { what: "column", name: short(name, SHOWN) }));
        }
        self.check_joint_columns().map_err(|problem| self.refuse_header(problem))?;
        let others = [self.expected.required, self.expected.optional].concat();
        let is_known = |name: &str| others.contains(&name) || self.joint_columns().any(|joint| joint == name);
        if let Some(name) = self.header.iter().find(|name| !is_known(name)) {
            let problem = Problem::UnknownColumn { name: short(name, SHOWN), expected: self.expected.header };
            return Err(self.refuse_header(problem));
        }
        Ok(())
    }

    fn joint_columns(&self) -> impl Iterator<Item = String> + '_ {
        self.robot.chain.joint_kinds().iter().enumerate().map(|(i, &kind)| joint_column(i, kind))
    }

    /// Joint columns whose unit does not fit, or that are not as many as the robot's joints.
    fn check_joint_columns(&self) -> Result<(), Problem> {
        let kinds = self.robot.chain.joint_kinds();
        let mut found = 0;
        for name in &self.header {
            let Some((number, unit)) = parse_joint_column(name) else { continue };
            found += 1;
            let Some(&kind) = kinds.get(number - 1) else { continue };
            if unit != ScreenUnit::from(kind).name() {
                let kind_name = match kind {
                    JointKind::Revolute => "revolute",
                    JointKind::Prismatic => "prismatic",
                };
                let expected = joint_column(number - 1, kind);
                return Err(Problem::ColumnUnit { found: name.to_owned(), expected, joint: number, kind: kind_name });
            }
        }
        if found == kinds.len() || found == 0 && self.expected.joints_are_optional {
            return Ok(());
        }
        Err(Problem::JointColumns { found, expected: kinds.len(), header: self.expected.header })
    }

    fn check_fields(&self, record: &StringRecord) -> Result<(), InputError> {
        if record.iter().any(|field| field.contains('\n')) {
            return Err(self.refuse_row(record, Problem::OpenQuote));
        }
        // Spreadsheets write empty fields behind the last column.
        if record.len() < self.header.len() || record.iter().skip(self.header.len()).any(|field| !field.is_empty()) {
            return Err(self.refuse_row(record, Problem::FieldCount { found: record.len(), expected: self.header.len() }));
        }
        Ok(())
    }

    fn end(
        &self,
        record: &StringRecord,
        column: usize,
        what: &'static str,
        index: Option<usize>,
        points: &[NamedPoint],
    ) -> Result<usize, InputError> {
        index.ok_or_else(|| {
            let known = points.iter().map(|point| point.name.as_str()).collect::<Vec<_>>().join(", ");
            self.refuse_field(record, column, Problem::UnknownEnd { what, found: short(&record[column], SHOWN), known })
        })
    }

    /// Number (from 1) and bytes of a record's line. The reader's own position is before the comments and empty lines that it
    /// skipped on the way.
    fn locate(&self, record: &StringRecord) -> (usize, Range<usize>) {
        let (mut number, mut start) = record.position().map_or((1, 0), |at| (at.line() as usize, at.byte() as usize));
        loop {
            let line = self.source.text()[start..].split('\n').next().unwrap_or_default();
            let skipped = line.trim().is_empty() || line.starts_with('#');
            if !skipped || start + line.len() >= self.source.text().len() {
                return (number, start..start + line.trim_end().len());
            }
            start += line.len() + 1;
            number += 1;
        }
    }

    /// The bytes of one field; of the whole line where quotes hide the separators.
    fn field_span(&self, record: &StringRecord, column: usize) -> Range<usize> {
        let line_span = self.locate(record).1;
        let line = &self.source.text()[line_span.clone()];
        if line.contains('"') {
            return line_span;
        }
        let start = line_span.start + line.split(self.separator).take(column).map(|field| field.len() + 1).sum::<usize>();
        let field = line.split(self.separator).nth(column).unwrap_or_default();
        let lead = field.len() - field.trim_start().len();
        start + lead..start + lead + field.trim().len().max(1)
    }
}

/// What parts the fields of the header: of a comma, a semicolon and a tab the first that it has.
fn separator(text: &str) -> char {
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    [',', ';', '\t'].into_iter().find(|&separator| header.contains(separator)).unwrap_or(',')
}

/// A header without the columns at its end that have no name.
fn without_empty_end(header: &StringRecord) -> StringRecord {
    let named = header.iter().enumerate().filter(|(_, name)| !name.is_empty()).last().map_or(0, |(last, _)| last + 1);
    let mut kept = header.clone();
    kept.truncate(named);
    kept
}

/// Number (from 1) and unit of a joint's column.
fn parse_joint_column(name: &str) -> Option<(usize, &str)> {
    let (number, unit) = name.strip_prefix('q')?.split_once('_')?;
    let number = number.parse().ok().filter(|&number| number >= 1)?;
    Some((number, unit))
}

//! Reading files of poses: from columns to rows, with the place of whatever is wrong.

use std::ops::Range;
use std::path::Path;

use ballbar::{JointKind, Measurement};
use csv::{ReaderBuilder, StringRecord, Trim};

use super::numbers::Range as Of;
use super::poses::{Dataset, PoseRow, joint_column};
use super::problem::Problem;
use super::rig::{NamedPoint, PairingId, Rig};
use super::robot::Robot;
use super::source::{InputError, Source};
use crate::units::{ScreenUnit, m_from_mm};

impl Dataset {
    /// Reads files of poses, one after the other.
    ///
    /// # Errors
    /// [`InputError`] naming the line and the column that is wrong.
    pub fn read<'a>(paths: impl IntoIterator<Item = &'a Path>, robot: &Robot, rig: &Rig) -> Result<Self, InputError> {
        let mut dataset = Self::default();
        for path in paths {
            dataset.append(&Source::read(path)?, robot, rig)?;
        }
        Ok(dataset)
    }

    /// Appends the poses of one file and weighs all rows by their `sigma_mm`.
    ///
    /// # Errors
    /// As [`Dataset::read`]; the dataset is then as it was.
    pub fn append(&mut self, source: &Source, robot: &Robot, rig: &Rig) -> Result<(), InputError> {
        let rows = FileReader { source, robot, rig, file: self.files.len() }.rows()?;
        let has_sigma = |rows: &[PoseRow]| rows.first().is_some_and(|row| row.sigma_m.is_some());
        if !self.rows.is_empty() && has_sigma(&rows) != has_sigma(&self.rows) {
            return Err(InputError::of_file(source.name(), Problem::MixedSigma));
        }
        self.files.push(source.name().to_owned());
        self.rows.extend(rows);
        self.set_weights();
        Ok(())
    }

    /// Weights `1/σ²`, scaled to mean 1 so that weighted residuals stay lengths.
    fn set_weights(&mut self) {
        let inverse_variance = |row: &PoseRow| row.sigma_m.map_or(1.0, |sigma| 1.0 / (sigma * sigma));
        let mean = self.rows.iter().map(inverse_variance).sum::<f64>() / self.rows.len() as f64;
        for row in &mut self.rows {
            row.measurement.weight = inverse_variance(row) / mean;
        }
    }
}

/// Where each column of a header stands.
struct Columns {
    chuck: usize,
    sphere: usize,
    q: Vec<usize>,
    length: usize,
    sigma: Option<usize>,
    set: Option<usize>,
    t: Option<usize>,
}

/// One file, being read.
struct FileReader<'a> {
    source: &'a Source,
    robot: &'a Robot,
    rig: &'a Rig,
    /// Its index in the dataset.
    file: usize,
}

impl FileReader<'_> {
    /// All rows, weighted alike.
    fn rows(&self) -> Result<Vec<PoseRow>, InputError> {
        let mut reader =
            ReaderBuilder::new().comment(Some(b'#')).trim(Trim::All).flexible(true).from_reader(self.source.text().as_bytes());
        let broken = |error: csv::Error| InputError::of_file(self.source.name(), Problem::Csv(error.to_string()));
        if self.source.text().trim().is_empty() {
            return Err(InputError::of_file(self.source.name(), Problem::NoPoses));
        }
        let header = reader.headers().map_err(broken)?.clone();
        let columns = self.columns(&header)?;
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(broken)?;
            // A line of white space is as empty as an empty one.
            if record.len() > 1 || !record[0].is_empty() {
                rows.push(self.row(&header, &columns, &record)?);
            }
        }
        if rows.is_empty() {
            return Err(InputError::of_file(self.source.name(), Problem::NoPoses));
        }
        Ok(rows)
    }

    fn columns(&self, header: &StringRecord) -> Result<Columns, InputError> {
        let refuse = |problem| InputError::at(self.source, self.line_span(header), problem);
        for (i, name) in header.iter().enumerate() {
            if header.iter().take(i).any(|other| other == name) {
                return Err(refuse(Problem::Duplicate { what: "column", name: name.to_owned() }));
            }
        }
        self.check_joint_columns(header).map_err(refuse)?;

        let known: Vec<String> = self.known_columns();
        if let Some(name) = header.iter().find(|name| !known.iter().any(|known| known == name)) {
            return Err(refuse(Problem::UnknownColumn(name.to_owned())));
        }
        let optional = |name: &str| header.iter().position(|other| other == name);
        let required = |name: &str| optional(name).ok_or_else(|| refuse(Problem::MissingColumn(name.to_owned())));
        Ok(Columns {
            chuck: required("chuck")?,
            sphere: required("sphere")?,
            q: self.joint_columns().map(|name| required(&name)).collect::<Result<_, _>>()?,
            length: required("length_mm")?,
            sigma: optional("sigma_mm"),
            set: optional("set"),
            t: optional("t_s"),
        })
    }

    fn joint_columns(&self) -> impl Iterator<Item = String> + '_ {
        self.robot.chain.joint_kinds().iter().enumerate().map(|(i, &kind)| joint_column(i, kind))
    }

    fn known_columns(&self) -> Vec<String> {
        let others = ["chuck", "sphere", "length_mm", "sigma_mm", "set", "t_s"];
        self.joint_columns().chain(others.map(str::to_owned)).collect()
    }

    /// Joint columns whose unit does not fit, or that are not as many as the robot's joints.
    fn check_joint_columns(&self, header: &StringRecord) -> Result<(), Problem> {
        let kinds = self.robot.chain.joint_kinds();
        let mut found = 0;
        for name in header {
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
        if found == kinds.len() { Ok(()) } else { Err(Problem::JointColumns { found, expected: kinds.len() }) }
    }

    fn row(&self, header: &StringRecord, columns: &Columns, record: &StringRecord) -> Result<PoseRow, InputError> {
        if record.iter().any(|field| field.contains('\n')) {
            return Err(InputError::at(self.source, self.line_span(record), Problem::OpenQuote));
        }
        if record.len() != header.len() {
            let problem = Problem::FieldCount { found: record.len(), expected: header.len() };
            return Err(InputError::at(self.source, self.line_span(record), problem));
        }
        let chuck = self.end(record, columns.chuck, "chuck", Rig::chuck, &self.rig.chucks)?;
        let sphere = self.end(record, columns.sphere, "sphere", Rig::sphere, &self.rig.spheres)?;
        let pairing = PairingId { chuck, sphere };

        let mut q = Vec::with_capacity(columns.q.len());
        for (&column, &kind) in columns.q.iter().zip(self.robot.chain.joint_kinds()) {
            q.push(ScreenUnit::from(kind).to_si(self.number(header, record, column, Of::Plausible)?));
        }
        let length_m = m_from_mm(self.number(header, record, columns.length, Of::Positive)?);
        let sigma = columns.sigma.map(|column| self.number(header, record, column, Of::Deviation));
        let t_s = columns.t.map(|column| self.number(header, record, column, Of::Finite));
        let joint_vector = self.robot.chain.joint_vector(&q);
        let q =
            joint_vector.map_err(|error| InputError::at(self.source, self.line_span(record), Problem::Csv(error.to_string())))?;
        Ok(PoseRow {
            pairing,
            measurement: Measurement { pairing: self.rig.pairing(pairing), q, length_m, weight: 1.0 },
            sigma_m: sigma.transpose()?.map(m_from_mm),
            set: columns.set.map(|column| record[column].to_owned()),
            t_s: t_s.transpose()?,
            file: self.file,
            line: self.locate(record).0,
        })
    }

    fn end(
        &self,
        record: &StringRecord,
        column: usize,
        what: &'static str,
        find: fn(&Rig, &str) -> Option<usize>,
        points: &[NamedPoint],
    ) -> Result<usize, InputError> {
        let found = &record[column];
        find(self.rig, found).ok_or_else(|| {
            let known = points.iter().map(|point| point.name.as_str()).collect::<Vec<_>>().join(", ");
            let problem = Problem::UnknownEnd { what, found: found.to_owned(), known };
            InputError::at(self.source, self.field_span(record, column), problem)
        })
    }

    fn number(&self, header: &StringRecord, record: &StringRecord, column: usize, range: Of) -> Result<f64, InputError> {
        let (name, found) = (header[column].to_owned(), record[column].to_owned());
        let problem = match found.parse::<f64>() {
            Ok(number) if range.contains(number) => return Ok(number),
            Ok(_) => Problem::Number { field: name, found, expected: range.words() },
            Err(_) if found.is_empty() => Problem::EmptyField { column: name },
            Err(_) => Problem::NotANumber { column: name, found },
        };
        Err(InputError::at(self.source, self.field_span(record, column), problem))
    }

    /// The bytes of a record's line.
    fn line_span(&self, record: &StringRecord) -> Range<usize> {
        self.locate(record).1
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

    /// The bytes of one field; of the whole line where quotes hide the commas.
    fn field_span(&self, record: &StringRecord, column: usize) -> Range<usize> {
        let line_span = self.line_span(record);
        let line = &self.source.text()[line_span.clone()];
        if line.contains('"') {
            return line_span;
        }
        let start = line_span.start + line.split(',').take(column).map(|field| field.len() + 1).sum::<usize>();
        let field = line.split(',').nth(column).unwrap_or_default();
        let lead = field.len() - field.trim_start().len();
        start + lead..start + lead + field.trim().len().max(1)
    }
}

/// Number (from 1) and unit of a joint's column.
fn parse_joint_column(name: &str) -> Option<(usize, &str)> {
    let (number, unit) = name.strip_prefix('q')?.split_once('_')?;
    let number = number.parse().ok().filter(|&number| number >= 1)?;
    Some((number, unit))
}

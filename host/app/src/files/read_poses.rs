//! Reading files of poses: from columns to rows, with the place of whatever is wrong.

use std::path::Path;

use ballbar::Measurement;
use csv::StringRecord;

use super::csv_rows::{CsvRows, Expected};
use super::numbers::Range as Of;
use super::poses::{Dataset, Motion, PoseRow};
use super::problem::Problem;
use super::rig::Rig;
use super::robot::Robot;
use super::source::{InputError, Source};
use crate::units::m_from_mm;

impl Dataset {
    /// Reads files of poses, one after the other.
    ///
    /// # Errors
    /// [`InputError`] naming the line and the column that is wrong.
    pub fn read<'a>(paths: impl IntoIterator<Item = &'a Path>, robot: &Robot, rig: &Rig) -> Result<Self, InputError> {
        let mut dataset = Self::default();
        for path in paths {
            dataset.append(&Source::read_rows(path)?, robot, rig)?;
        }
        Ok(dataset)
    }

    /// Appends the poses of one file and weighs all rows by their `sigma_mm`.
    ///
    /// # Errors
    /// As [`Dataset::read`]; the dataset is then as it was.
    pub fn append(&mut self, source: &Source, robot: &Robot, rig: &Rig) -> Result<(), InputError> {
        let rows = read_rows(source, robot, rig, self.files.len())?;
        let has_sigma = |rows: &[PoseRow]| rows.first().is_some_and(|row| row.sigma_m.is_some());
        if !self.rows.is_empty() && has_sigma(&rows) != has_sigma(&self.rows) {
            return Err(InputError::of_file(source.name(), Problem::MixedSigma));
        }
        self.files.push(source.name().to_owned());
        let before = self.rows.len();
        self.rows.extend(rows);
        for (number, row) in (before + 1..).zip(&mut self.rows[before..]) {
            row.number = number;
        }
        self.set_weights();
        Ok(())
    }

    /// The rows for which `is_apart` holds, and the others; each weighed by itself.
    #[must_use]
    pub fn split(self, is_apart: impl Fn(&PoseRow) -> bool) -> (Self, Self) {
        let (apart, others) = self.rows.into_iter().partition(is_apart);
        let part = |rows| {
            let mut part = Self { rows, files: self.files.clone() };
            part.set_weights();
            part
        };
        (part(apart), part(others))
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
    bar: Option<usize>,
    /// Of the rate and of the lag.
    motion: Option<(usize, usize)>,
}

/// All rows of one file, weighted alike.
fn read_rows(source: &Source, robot: &Robot, rig: &Rig, file: usize) -> Result<Vec<PoseRow>, InputError> {
    const REQUIRED: [&str; 3] = ["chuck", "sphere", "length_mm"];
    const OPTIONAL: [&str; 7] = ["sigma_mm", "set", "t_s", "bar_mm", "plan_row", "rate_mm_s", "lag_ms"];
    const HEADER: &str = "chuck,sphere,q1_deg,…,qJ_deg,length_mm in any order (qi_mm for a prismatic joint); \
                          optional: sigma_mm, set, t_s, bar_mm, plan_row, rate_mm_s, lag_ms";
    const EXPECTED: Expected<'_> =
        Expected { rows_are: "poses", required: &REQUIRED, optional: &OPTIONAL, joints_are_optional: false, header: HEADER };
    let rows = CsvRows::split(source, robot, &EXPECTED)?;
    let columns = Columns {
        chuck: rows.required("chuck")?,
        sphere: rows.required("sphere")?,
        q: rows.joints()?,
        length: rows.required("length_mm")?,
        sigma: rows.optional("sigma_mm"),
        set: rows.optional("set"),
        t: rows.optional("t_s"),
        bar: rows.optional("bar_mm"),
        motion: rows.optional("rate_mm_s").zip(rows.optional("lag_ms")),
    };
    rows.records().iter().map(|record| read_row(&rows, rig, &columns, record, file)).collect()
}

fn read_row(rows: &CsvRows<'_>, rig: &Rig, columns: &Columns, record: &StringRecord, file: usize) -> Result<PoseRow, InputError> {
    let pairing = rows.pairing(record, rig, columns.chuck, columns.sphere)?;
    let q = rows.joint_vector(record, &columns.q)?;
    let length_m = m_from_mm(rows.number(record, columns.length, Of::Positive)?);
    let sigma = columns.sigma.map(|column| rows.number(record, column, Of::Deviation));
    let t_s = columns.t.map(|column| rows.number(record, column, Of::Finite));
    let bar = columns.bar.map(|column| rows.number(record, column, Of::Positive));
    Ok(PoseRow {
        pairing,
        measurement: Measurement { pairing: rig.pairing(pairing), q, length_m, weight: 1.0 },
        sigma_m: sigma.transpose()?.map(m_from_mm),
        set: columns.set.map(|column| record[column].to_owned()),
        t_s: t_s.transpose()?,
        bar_m: bar.transpose()?.map(m_from_mm),
        motion: columns.motion.map_or(Ok(None), |(rate, lag)| read_motion(rows, record, rate, lag))?,
        file,
        line: rows.line(record),
        number: 0,
    })
}

/// Of an arm that moved; both fields are empty for one that stood.
fn read_motion(rows: &CsvRows<'_>, record: &StringRecord, rate: usize, lag: usize) -> Result<Option<Motion>, InputError> {
    if record[rate].is_empty() && record[lag].is_empty() {
        return Ok(None);
    }
    let rate_m_s = m_from_mm(rows.number(record, rate, Of::Plausible)?);
    let removed_lag_s = rows.number(record, lag, Of::Plausible)? * 1e-3;
    Ok(Some(Motion { rate_m_s, removed_lag_s }))
}

//! Reading files of poses: from columns to rows, with the place of whatever is wrong.

use std::path::Path;

use ballbar::{Approach, Direction, Measurement};
use ballbar_calib::model::{Dataset, MixedSigma, Motion, PoseRow, Rig, Robot};
use csv::StringRecord;

use super::csv_rows::{CsvRows, Expected};
use super::numbers::Range as Of;
use super::problem::{Problem, short};
use super::source::{InputError, Source};
use crate::units::m_from_mm;

/// Reads files of poses, one after the other.
///
/// # Errors
/// [`InputError`] naming the line and the column that is wrong.
pub fn read_poses<'a>(paths: impl IntoIterator<Item = &'a Path>, robot: &Robot, rig: &Rig) -> Result<Dataset, InputError> {
    let mut dataset = Dataset::default();
    for path in paths {
        append_poses(&mut dataset, &Source::read_rows(path)?, robot, rig)?;
    }
    Ok(dataset)
}

/// Appends the poses of one file and weighs all rows by their `sigma_mm`.
///
/// # Errors
/// As [`read_poses`]; the dataset is then as it was.
pub fn append_poses(dataset: &mut Dataset, source: &Source, robot: &Robot, rig: &Rig) -> Result<(), InputError> {
    let rows = read_rows(source, robot, rig)?;
    dataset.append(source.name(), rows).map_err(|MixedSigma| InputError::of_file(source.name(), Problem::MixedSigma))
}

/// Where each column of a header stands.
struct Columns {
    chuck: usize,
    sphere: usize,
    q: Vec<usize>,
    length: usize,
    sigma: Option<usize>,
    set: Option<usize>,
    approach: Option<usize>,
    t: Option<usize>,
    bar: Option<usize>,
    /// Of the rate and of the lag.
    motion: Option<(usize, usize)>,
}

/// All rows of one file, weighted alike.
fn read_rows(source: &Source, robot: &Robot, rig: &Rig) -> Result<Vec<PoseRow>, InputError> {
    const REQUIRED: [&str; 3] = ["chuck", "sphere", "length_mm"];
    const OPTIONAL: [&str; 8] = ["approach", "sigma_mm", "set", "t_s", "bar_mm", "plan_row", "rate_mm_s", "lag_ms"];
    const HEADER: &str = "chuck,sphere,q1_deg,…,qJ_deg,length_mm in any order (qi_mm for a prismatic joint); \
                          optional: approach, sigma_mm, set, t_s, bar_mm, plan_row, rate_mm_s, lag_ms";
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
        approach: rows.optional("approach"),
        t: rows.optional("t_s"),
        bar: rows.optional("bar_mm"),
        motion: rows.optional("rate_mm_s").zip(rows.optional("lag_ms")),
    };
    rows.records().iter().map(|record| read_row(&rows, rig, &columns, record)).collect()
}

fn read_row(rows: &CsvRows<'_>, rig: &Rig, columns: &Columns, record: &StringRecord) -> Result<PoseRow, InputError> {
    let pairing = rows.pairing(record, rig, columns.chuck, columns.sphere)?;
    let q = rows.joint_vector(record, &columns.q)?;
    let length_m = m_from_mm(rows.number(record, columns.length, Of::Positive)?);
    let sigma = columns.sigma.map(|column| rows.number(record, column, Of::Deviation));
    let t_s = columns.t.map(|column| rows.number(record, column, Of::Finite));
    let bar = columns.bar.map(|column| rows.number(record, column, Of::Positive));
    Ok(PoseRow {
        pairing,
        measurement: Measurement::new(rig.pairing(pairing), q, length_m),
        approach: columns.approach.map_or(Ok(Approach::UNKNOWN), |column| read_approach(rows, record, column))?,
        sigma_m: sigma.transpose()?.map(m_from_mm),
        set: columns.set.map(|column| record[column].to_owned()),
        t_s: t_s.transpose()?,
        bar_m: bar.transpose()?.map(m_from_mm),
        motion: columns.motion.map_or(Ok(None), |(rate, lag)| read_motion(rows, record, rate, lag))?,
        file: 0,
        line: rows.line(record),
        number: 0,
    })
}

/// `+`, `-` or `0` for each joint; an empty field says nothing of any.
fn read_approach(rows: &CsvRows<'_>, record: &StringRecord, column: usize) -> Result<Approach, InputError> {
    let (field, joints) = (&record[column], rows.robot.chain.joints());
    let direction = |sign| match sign {
        '+' => Some(Some(Direction::Rising)),
        '-' => Some(Some(Direction::Falling)),
        '0' => Some(None),
        _ => None,
    };
    let directions: Option<Vec<_>> = field.chars().map(direction).collect();
    match directions.filter(|directions| directions.is_empty() || directions.len() == joints) {
        Some(directions) => {
            Ok(directions.into_iter().enumerate().fold(Approach::UNKNOWN, |approach, (i, way)| approach.with(i, way)))
        }
        None => Err(rows.refuse_field(record, column, Problem::Approach { found: short(field, 20), joints })),
    }
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

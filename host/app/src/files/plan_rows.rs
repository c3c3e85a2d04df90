//! `plan.csv`: poses to measure and via points, in the order in which the robot goes through them.

use ballbar::{JointKind, Kinematics};
use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{BarAt, PlanRow, RowKind};
use csv::StringRecord;

use super::csv_rows::{CsvRows, Expected};
use super::numbers::Range as Of;
use super::poses::{csv_record, joint_column};
use super::problem::Problem;
use super::source::{InputError, Source};
use crate::units::{ScreenUnit, m_from_mm, mm_from_m};

const MARGINS: [&str; 6] = ["travel_margin_mm", "clearance_mm", "nearest", "limit_margin_deg", "limit_margin_mm", "singularity"];

/// The text of a plan; columns as the robot's joints need them.
pub fn write_plan(robot: &Robot, rig: &Rig, rows: &[PlanRow]) -> String {
    let kinds = robot.chain.joint_kinds();
    let has = |kind| kinds.contains(&kind);
    let is_there = |name: &str| match name {
        "limit_margin_deg" => has(JointKind::Revolute),
        "limit_margin_mm" => has(JointKind::Prismatic),
        _ => true,
    };
    let joints = kinds.iter().enumerate().map(|(i, &kind)| joint_column(i, kind));
    let words = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>();
    let header = words(&["kind", "chuck", "sphere", "bar_mm"])
        .into_iter()
        .chain(joints)
        .chain(words(&["latitude_deg", "longitude_deg", "length_mm"]))
        .chain(words(&MARGINS).into_iter().filter(|name| is_there(name)));
    let mut text = csv_record(header) + "\n";
    for row in rows {
        let number = |value: f64, decimals: usize| format!("{value:.decimals$}");
        let kind = match row.kind {
            RowKind::Via => "via",
            RowKind::Measure => "measure",
        };
        let (chuck, sphere) = (&rig.chucks[row.pairing.chuck].name, &rig.spheres[row.pairing.sphere].name);
        let mut fields = vec![kind.to_owned(), chuck.clone(), sphere.clone(), number(mm_from_m(row.bar_m), 3)];
        // As in files of poses: nanodegrees and nanometres.
        fields.extend(kinds.iter().zip(row.q.as_array()).map(|(&kind, &q)| number(ScreenUnit::from(kind).from_si(q), 9)));
        match row.bar {
            Some(bar) => fields.extend([
                number(bar.latitude_rad.to_degrees(), 4),
                number(below_a_turn(bar.longitude_rad.to_degrees()), 4),
                number(mm_from_m(bar.length_m), 6),
            ]),
            None => fields.extend([const { String::new() }; 3]),
        }
        if let Some(margins) = &row.margins {
            let travel = margins.travel_m.map_or_else(String::new, |travel_m| number(mm_from_m(travel_m), 3));
            fields.extend([travel, number(mm_from_m(margins.clearance_m), 2), margins.nearest.clone()]);
            fields.extend(has(JointKind::Revolute).then(|| number(margins.limit_rad.to_degrees(), 3)));
            fields.extend(has(JointKind::Prismatic).then(|| number(mm_from_m(margins.limit_m), 3)));
            fields.push(number(margins.singularity, 4));
        }
        text += &(csv_record(fields.into_iter()) + "\n");
    }
    text
}

/// What would be written as 360 degrees is 0.
fn below_a_turn(longitude_deg: f64) -> f64 {
    const ROUNDED_UP_DEG: f64 = 359.99995;
    if longitude_deg < ROUNDED_UP_DEG { longitude_deg } else { 0.0 }
}

/// Where each column of a header stands.
struct Columns {
    kind: usize,
    chuck: usize,
    sphere: usize,
    bar: usize,
    q: Vec<usize>,
    latitude: usize,
    longitude: usize,
    length: usize,
}

/// Reads a plan, and proves by its lengths that it is one of this robot at this rig.
///
/// # Errors
/// [`InputError`] naming the line and the column that is wrong.
pub fn read_plan(source: &Source, robot: &Robot, rig: &Rig) -> Result<Vec<PlanRow>, InputError> {
    const HEADER: &str = "kind,chuck,sphere,bar_mm,q1_deg,…,qJ_deg,latitude_deg,longitude_deg,length_mm (qi_mm for a prismatic joint), \
                          then margins, as `host-cal plan` writes them";
    const REQUIRED: [&str; 7] = ["kind", "chuck", "sphere", "bar_mm", "latitude_deg", "longitude_deg", "length_mm"];
    const EXPECTED: Expected<'_> =
        Expected { rows_are: "poses", required: &REQUIRED, optional: &MARGINS, joints_are_optional: false, header: HEADER };
    let rows = CsvRows::split(source, robot, &EXPECTED)?;
    let columns = Columns {
        kind: rows.required("kind")?,
        chuck: rows.required("chuck")?,
        sphere: rows.required("sphere")?,
        bar: rows.required("bar_mm")?,
        q: rows.joints()?,
        latitude: rows.required("latitude_deg")?,
        longitude: rows.required("longitude_deg")?,
        length: rows.required("length_mm")?,
    };
    let kinematics = robot.kinematics();
    rows.records().iter().map(|record| read_row(&rows, rig, &columns, &kinematics, record)).collect()
}

fn read_row(
    rows: &CsvRows<'_>,
    rig: &Rig,
    columns: &Columns,
    kinematics: &Kinematics<f64>,
    record: &StringRecord,
) -> Result<PlanRow, InputError> {
    let kind = match &record[columns.kind] {
        "via" => RowKind::Via,
        "measure" => RowKind::Measure,
        found => {
            let problem = Problem::Word { column: "kind", found: found.to_owned(), expected: "`via` or `measure`" };
            return Err(rows.refuse_field(record, columns.kind, problem));
        }
    };
    let pairing = rows.pairing(record, rig, columns.chuck, columns.sphere)?;
    let q = rows.joint_vector(record, &columns.q)?;
    let is_attached = kind == RowKind::Measure || !record[columns.length].is_empty();
    let bar = if is_attached {
        let angle = |column| Ok::<f64, InputError>(rows.number(record, column, Of::Plausible)?.to_radians());
        Some(BarAt {
            latitude_rad: angle(columns.latitude)?,
            longitude_rad: angle(columns.longitude)?,
            length_m: m_from_mm(rows.number(record, columns.length, Of::Positive)?),
        })
    } else {
        None
    };
    /// Lengths are written to the nanometre, from joints to the nanodegree.
    const SAME_M: f64 = 1e-6;
    let length_m = kinematics.length(&q, &rig.pairing(pairing));
    if let Some(planned) = bar.filter(|planned| (planned.length_m - length_m).abs() > SAME_M) {
        let problem = Problem::PlanOfAnother { planned_mm: mm_from_m(planned.length_m), length_mm: mm_from_m(length_m) };
        return Err(rows.refuse_field(record, columns.length, problem));
    }
    let bar_m = m_from_mm(rows.number(record, columns.bar, Of::Positive)?);
    Ok(PlanRow { kind, pairing, bar_m, q, bar, margins: None, line: rows.line(record) })
}

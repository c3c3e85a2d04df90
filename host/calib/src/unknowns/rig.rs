//! Where chucks and spheres are.

use ballbar::{LANES, Lanes, LengthRows, Measurement, ParameterUnit, Vector3};

use super::{Block, Unknown, UnknownError};
use crate::model::{Dataset, End, NamedPoint, PoseRow, Rig};

/// The centres of those chucks and spheres that have a tolerance, as displacements from where the rig has them. Together they say where the
/// robot stands and how its tool is mounted as well: it is their tolerance that keeps them from it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RigBlock {
    points: Vec<Point>,
}

#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Point {
    end: End,
    /// Into the rig's chucks or spheres.
    index: usize,
    name: String,
    tolerance_m: f64,
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl RigBlock {
    /// The chucks and spheres that a dataset uses and that are not known exactly.
    ///
    /// # Errors
    /// [`UnknownError::NoTolerance`] when there is none.
    pub fn new(rig: &Rig, dataset: &Dataset) -> Result<Self, UnknownError> {
        let used = dataset.pairings();
        let points_of = |end: End, points: &[NamedPoint]| -> Vec<Point> {
            let is_used = |index: usize| used.iter().any(|pairing| pairing.at(end) == index);
            let points = points.iter().enumerate().filter(|&(index, _)| is_used(index));
            let uncertain = points.filter_map(|(index, point)| Some((index, point, point.tolerance_m.filter(|&m| m > 0.0)?)));
            uncertain.map(|(index, point, tolerance_m)| Point { end, index, name: point.name.clone(), tolerance_m }).collect()
        };
        let points: Vec<Point> =
            points_of(End::Chuck, &rig.chucks).into_iter().chain(points_of(End::Sphere, &rig.spheres)).collect();
        if points.is_empty() { Err(UnknownError::NoTolerance) } else { Ok(Self { points }) }
    }
}

impl Block for RigBlock {
    fn unknowns(&self) -> Vec<Unknown> {
        let unknown = |point: &Point, axis: &str| Unknown {
            name: format!("{} {} {axis}", point.end, point.name),
            unit: ParameterUnit::Metre,
            start: 0.0,
            tolerance: Some(point.tolerance_m),
            plausible: point.tolerance_m,
        };
        self.points.iter().flat_map(|point| AXES.map(|axis| unknown(point, axis))).collect()
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        for (point, by_m) in self.points.iter().zip(values.chunks(AXES.len())) {
            if row.pairing.at(point.end) == point.index {
                let centre_m = match point.end {
                    End::Chuck => &mut measurement.pairing.chuck_base_m,
                    End::Sphere => &mut measurement.pairing.sphere_tool_m,
                };
                *centre_m += Vector3::from_column_slice(by_m);
            }
        }
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], swept: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (point, columns) in self.points.iter().zip(columns.chunks_mut(AXES.len())) {
            let joins: Lanes<bool> =
                std::array::from_fn(|lane| rows.get(lane).is_some_and(|row| row.pairing.at(point.end) == point.index));
            for (axis, column) in columns.iter_mut().enumerate() {
                let all = match point.end {
                    End::Chuck => swept.chuck(axis),
                    End::Sphere => *swept.sphere(axis),
                };
                for lane in (0..LANES).filter(|&lane| joins[lane]) {
                    column[lane] = all[lane];
                }
            }
        }
    }

    fn correct_rig(&self, values: &[f64], rig: &mut Rig) {
        for (point, by_m) in self.points.iter().zip(values.chunks(AXES.len())) {
            let points = match point.end {
                End::Chuck => &mut rig.chucks,
                End::Sphere => &mut rig.spheres,
            };
            if let Some(point) = points.get_mut(point.index) {
                point.position_m += Vector3::from_column_slice(by_m);
            }
        }
    }
}

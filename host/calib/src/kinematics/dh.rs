//! Denavit-Hartenberg tables of a chain, standard and modified.
//!
//! Both describe the same common normals, one between each axis and the next: a_i its length, alpha_i the angle between the two axes,
//! d_i and theta_i what lies between two normals along and about the axis that they share. A normal may point either way: here as the one
//! before it, so that most theta are small. They differ in where a row begins:
//!
//! - standard: row i is `Rz(theta_i) · Trans_z(d_i) · Trans_x(a_i) · Rx(alpha_i)`
//! - modified (J. J. Craig, "Introduction to Robotics"): row i is `Rx(alpha_(i-1)) · Trans_x(a_(i-1)) · Rz(theta_i) · Trans_z(d_i)`
//!
//! The line of a revolute axis is given. A prismatic axis has a direction but no place: where it is nearly parallel to a neighbour, its line
//! is laid so that the two meet near by, and d and a stay ordinary numbers.
//!
//! Before the first row and behind the last one stand whole transforms, so that any chain has a table. Where two other axes are
//! nearly parallel their common normal is far away, and d of both runs away with it.

use ballbar::{Chain, JointKind, Kinematics, Matrix3, Pose, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::axis::Axis;
use super::canonical::AtZero;
use super::frames::{apart, compose, from_link, inverse};
use crate::model::JointLimits;

/// Below this angle, radians, axes are taken as parallel: what a file's decimals leave of a right angle.
const PARALLEL_RAD: f64 = 1e-9;
/// Below this angle, radians, a user is told why the values are large: half a degree, more than a well-built arm is off.
const NEARLY_PARALLEL_RAD: f64 = std::f64::consts::PI / 360.0;

/// Axes nearer than this, metres, are taken as meeting.
const TOUCHING_M: f64 = 1e-9;

/// Which of the two tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Convention {
    /// Denavit's and Hartenberg's.
    Standard,
    /// Craig's.
    Modified,
}

/// A row; its joint's encoder output times `scale` is added to theta (revolute) or d (prismatic).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DhRow {
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// Turn about z at encoder output zero, radians.
    pub theta_rad: f64,
    /// Shift along z at encoder output zero, metres.
    pub d_m: f64,
    /// Shift along x, metres: a_i of a standard row i, a_(i-1) of a modified one.
    pub a_m: f64,
    /// Turn about x, radians: alpha_i of a standard row i, alpha_(i-1) of a modified one.
    pub alpha_rad: f64,
    /// Joint value per encoder output.
    pub scale: f64,
}

/// Two axes whose common normal is far away.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NearlyParallel {
    /// Number of the first of the two joints, from 1.
    pub joint: usize,
    /// Angle between their axes, radians.
    pub angle_rad: f64,
}

/// A table of J. Denavit and R. S. Hartenberg (ASME J. Applied Mechanics 22, 1955) for a whole chain:
/// `base_from_first · row 1 · … · row J · last_from_tool`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DhTable {
    /// How the rows are read.
    pub convention: Convention,
    /// What stands before the first row.
    pub base_from_first: Pose<f64>,
    /// One row a joint.
    pub rows: Vec<DhRow>,
    /// What stands behind the last row.
    pub last_from_tool: Pose<f64>,
    /// Where the values run away: such axes are better described otherwise (S. A. Hayati, IEEE CDC 1983).
    pub nearly_parallel: Vec<NearlyParallel>,
}

/// The common normal of an axis and the next one, the arm at encoders zero, base frame.
#[derive(Clone, Copy)]
struct Normal {
    direction: Vector3<f64>,
    from_m: Vector3<f64>,
    to_m: Vector3<f64>,
    /// From `from_m` to `to_m` along the direction, metres; below zero where the direction points the other way.
    a_m: f64,
    /// From axis to next axis about the direction, radians.
    alpha_rad: f64,
}

impl DhTable {
    /// The table of a chain.
    pub fn new(chain: &Chain<f64>, convention: Convention) -> Self {
        let zero = AtZero::of(chain);
        let mut axes = zero.axes(chain);
        let mut far = nearly_parallel(&axes);
        bring_near(&mut axes, 0, &Vector3::zeros(), &mut far);
        let Some(first) = axes.first() else {
            let nothing = from_link(Vector3::zeros(), [0.0; 3]);
            let ends = (nothing, zero.base_from_tool);
            return Self {
                convention,
                base_from_first: ends.0,
                rows: Vec::new(),
                last_from_tool: ends.1,
                nearly_parallel: Vec::new(),
            };
        };
        let begin = begin(first);
        let (mut normals, mut last) = (Vec::new(), begin);
        for i in 1..axes.len() {
            bring_near(&mut axes, i, &last.to_m, &mut far);
            last = next(&last, &axes[i - 1], &axes[i]);
            normals.push(last);
        }
        let table = Self {
            convention,
            base_from_first: begin.frame(&axes[0].direction),
            rows: Vec::new(),
            last_from_tool: zero.base_from_tool,
            nearly_parallel: far,
        };
        table.with_rows(&axes, begin, &normals).closed()
    }

    fn with_rows(mut self, axes: &[Axis], begin: Normal, normals: &[Normal]) -> Self {
        let mut last = begin;
        for (i, axis) in axes.iter().enumerate() {
            // Behind the last axis there is no other: its row goes on along it as far as the tool does.
            let normal = normals.get(i).copied().unwrap_or_else(|| end(axis, &last, &self.last_from_tool));
            let between = match self.convention {
                Convention::Standard => normal,
                Convention::Modified => last,
            };
            self.rows.push(row(axis, &last, &normal, (between.a_m, between.alpha_rad)));
            last = normal;
        }
        self
    }

    /// Whatever the rows leave of the tool's pose at encoders zero is the last transform.
    fn closed(mut self) -> Self {
        let base_from_tool = self.last_from_tool;
        self.last_from_tool = from_link(Vector3::zeros(), [0.0; 3]);
        self.last_from_tool = compose(&inverse(&self.base_from_tool(&[])), &base_from_tool);
        self
    }

    /// Pose of the tool at encoder outputs `q`, radians or metres; those that are missing are zero.
    pub fn base_from_tool(&self, q: &[f64]) -> Pose<f64> {
        let at = |i: usize| q.get(i).copied().unwrap_or(0.0);
        let rows = self.rows.iter().enumerate();
        let last = rows.fold(self.base_from_first, |pose, (i, row)| compose(&pose, &row.transform(self.convention, at(i))));
        compose(&last, &self.last_from_tool)
    }

    /// The largest differences to the chain over random joint vectors within limits: metres and radians.
    pub fn largest_difference(&self, chain: &Chain<f64>, limits: &[JointLimits]) -> (f64, f64) {
        const POSES: usize = 2_000;
        let kinematics = Kinematics::new(chain);
        let mut rng = ChaCha8Rng::seed_from_u64(1955);
        let mut largest = (0.0_f64, 0.0_f64);
        for _ in 0..POSES {
            let q: Vec<f64> = limits.iter().map(|limits| rng.random_range(limits.min..=limits.max)).collect();
            let Ok(vector) = chain.joint_vector(&q) else { return (f64::INFINITY, f64::INFINITY) };
            let (off_m, turned_rad) = apart(&kinematics.base_from_tool(&vector), &self.base_from_tool(&q));
            largest = (largest.0.max(off_m), largest.1.max(turned_rad));
        }
        largest
    }
}

impl DhRow {
    fn transform(&self, convention: Convention, q: f64) -> Pose<f64> {
        let moved = self.scale * q;
        let (theta, d_m) = match self.kind {
            JointKind::Revolute => (self.theta_rad + moved, self.d_m),
            JointKind::Prismatic => (self.theta_rad, self.d_m + moved),
        };
        let about_z = from_link(Vector3::new(0.0, 0.0, d_m), [theta, 0.0, 0.0]);
        let about_x = from_link(Vector3::new(self.a_m, 0.0, 0.0), [0.0, 0.0, self.alpha_rad]);
        match convention {
            Convention::Standard => compose(&about_z, &about_x),
            Convention::Modified => compose(&about_x, &about_z),
        }
    }
}

impl Normal {
    /// The frame at its beginning: z along the axis there, x along the normal.
    fn frame(&self, axis: &Vector3<f64>) -> Pose<f64> {
        let rotation = Matrix3::from_columns(&[self.direction, axis.cross(&self.direction), *axis]);
        Pose { rotation, translation_m: self.from_m }
    }
}

/// Where the table begins on the first axis: below or above the base frame's origin, x as near to the base's as can be. So the transform
/// before the first row is none where the first axis is the base's z.
fn begin(first: &Axis) -> Normal {
    let foot_m = first.point_m - first.direction * first.direction.dot(&first.point_m);
    let x = across(&first.direction, &Vector3::x(), &Vector3::y());
    Normal { direction: x, from_m: foot_m, to_m: foot_m, a_m: 0.0, alpha_rad: 0.0 }
}

/// Where the table ends on the last axis: beside the tool, x as near to the tool's as can be.
fn end(axis: &Axis, last: &Normal, base_from_tool: &Pose<f64>) -> Normal {
    let foot_m = last.to_m + axis.direction * axis.direction.dot(&(base_from_tool.translation_m - last.to_m));
    let column = |i: usize| base_from_tool.rotation.column(i).into();
    let x = across(&axis.direction, &column(0), &column(1));
    Normal { direction: x, from_m: foot_m, to_m: foot_m, a_m: 0.0, alpha_rad: 0.0 }
}

/// What of a direction is across an axis; of another one where it is along it.
fn across(axis: &Vector3<f64>, direction: &Vector3<f64>, other: &Vector3<f64>) -> Vector3<f64> {
    /// Sine of what is along.
    const ALONG: f64 = 0.1;
    let part = |v: &Vector3<f64>| v - axis * axis.dot(v);
    part(direction).try_normalize(ALONG).unwrap_or_else(|| part(other).normalize())
}

/// What lies along and about an axis between the normal that ends on it and the one that begins there.
fn row(axis: &Axis, last: &Normal, normal: &Normal, (a_m, alpha_rad): (f64, f64)) -> DhRow {
    let z = axis.direction;
    let sine = last.direction.cross(&normal.direction).dot(&z);
    let theta_rad = sine.atan2(last.direction.dot(&normal.direction));
    DhRow { kind: axis.kind, theta_rad, d_m: (normal.from_m - last.to_m).dot(&z), a_m, alpha_rad, scale: axis.scale }
}

/// The common normal of two axes; of parallel ones the one that begins where the last ended.
fn next(last: &Normal, axis: &Axis, other: &Axis) -> Normal {
    let (z, w) = (axis.direction, other.direction);
    let cross = z.cross(&w);
    let (direction, from_m, to_m) = if cross.norm() > PARALLEL_RAD {
        let between_m = other.point_m - axis.point_m;
        let along = |u: &Vector3<f64>| between_m.cross(u).dot(&cross) / cross.norm_squared();
        let (from_m, to_m) = (axis.point_m + z * along(&w), other.point_m + w * along(&z));
        (cross.normalize(), from_m, to_m)
    } else {
        let from_m = last.to_m;
        let to_m = other.point_m + w * w.dot(&(from_m - other.point_m));
        let gap_m = to_m - from_m;
        let across_m = gap_m - z * z.dot(&gap_m);
        (across_m.try_normalize(TOUCHING_M).unwrap_or(last.direction), from_m, to_m)
    };
    let direction = facing(direction, &last.direction, &(to_m - from_m));
    let a_m = (to_m - from_m).dot(&direction);
    Normal { direction, from_m, to_m, a_m, alpha_rad: cross.dot(&direction).atan2(z.dot(&w)) }
}

/// Lays the line of a prismatic axis: through the foot that the last normal has on the axis before where it is nearly parallel to that one,
/// else, where it is nearly parallel to the axis behind it, through that one's point nearest to the foot. The pair is then not far.
fn bring_near(axes: &mut [Axis], i: usize, foot_m: &Vector3<f64>, far: &mut Vec<NearlyParallel>) {
    let Some(axis) = axes.get(i).filter(|axis| axis.kind == JointKind::Prismatic) else { return };
    let is_far = |first: usize| far.iter().any(|pair| pair.joint == first + 1);
    let (pair, point_m) = match (i.checked_sub(1).filter(|&before| is_far(before)), axes.get(i + 1)) {
        (Some(before), _) => (before, *foot_m),
        // A prismatic axis behind it will be laid itself.
        (None, Some(behind)) if is_far(i) && behind.kind == JointKind::Revolute => {
            (i, behind.point_m + behind.direction * behind.direction.dot(&(foot_m - behind.point_m)))
        }
        _ => return,
    };
    axes[i] = Axis { point_m, ..*axis };
    far.retain(|other| other.joint != pair + 1);
}

/// A normal's direction or its opposite: as the last normal points, so that a calibrated table is like its design's, where the two are not
/// across one another; else towards the next axis.
fn facing(direction: Vector3<f64>, last: &Vector3<f64>, gap_m: &Vector3<f64>) -> Vector3<f64> {
    const ACROSS: f64 = 0.1;
    let along = direction.dot(last);
    let is_opposite = if along.abs() > ACROSS { along < 0.0 } else { gap_m.dot(&direction) < -TOUCHING_M };
    if is_opposite { -direction } else { direction }
}

fn nearly_parallel(axes: &[Axis]) -> Vec<NearlyParallel> {
    let angles = axes.windows(2).enumerate().map(|(i, pair)| {
        let (z, w) = (pair[0].direction, pair[1].direction);
        NearlyParallel { joint: i + 1, angle_rad: z.cross(&w).norm().atan2(z.dot(&w).abs()) }
    });
    angles.filter(|pair| (PARALLEL_RAD..NEARLY_PARALLEL_RAD).contains(&pair.angle_rad)).collect()
}

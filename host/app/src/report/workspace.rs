//! How far the tool is from where a controller believes it to be, before and after, in two slices of the workspace.

use ballbar::{JointVector, Kinematics, Vector3};
use ballbar_calib::identify::Fit;
use ballbar_calib::kinematics::position_jacobian;
use ballbar_calib::model::Robot;
use nalgebra::{DMatrix, Matrix3xX};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Which slice a point lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slice {
    /// About the plane of the middle y, seen from the side: x against z.
    Side,
    /// About the plane of the middle height, seen from above: x against y.
    Top,
}

/// The tool somewhere.
#[derive(Clone, Copy, Debug)]
pub struct WorkspacePoint {
    /// Origin of the tool frame by the fit, metres.
    pub position_m: Vector3<f64>,
    /// Distance from where the design has it, metres.
    pub before_m: f64,
    /// Standard deviation that the lengths' noise leaves in it, metres.
    pub after_m: f64,
}

/// Random joint vectors within the limits, as far as their tools lie in a slice.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// About the middle y.
    pub side: Vec<WorkspacePoint>,
    /// About the middle height.
    pub top: Vec<WorkspacePoint>,
    /// The middle y, metres.
    pub side_y_m: f64,
    /// The middle height, metres.
    pub top_z_m: f64,
}

const JOINT_VECTORS: usize = 40_000;
/// Half of a slice's thickness, as a fraction of the workspace's extent across it.
const HALF_THICKNESS: f64 = 0.07;

impl Workspace {
    /// Samples the workspace.
    pub(super) fn new(robot: &Robot, fit: &Fit) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let predictor = Predictor::new(robot, fit);
        let draw = |_| {
            let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..=limits.max)).collect();
            let q = robot.chain.joint_vector(&q).ok()?;
            Some((predictor.fitted.base_from_tool(&q).translation_m, q))
        };
        let drawn: Vec<(Vector3<f64>, JointVector<f64>)> = (0..JOINT_VECTORS).filter_map(draw).collect();
        let slice = |axis: usize, about_m: f64| {
            let half_m = HALF_THICKNESS * extent(&drawn, axis);
            let within = drawn.iter().filter(|(position_m, _)| (position_m[axis] - about_m).abs() <= half_m);
            within.map(|(_, q)| predictor.at(q)).collect()
        };
        let (side_y_m, top_z_m) = (middle(&drawn, 1), middle(&drawn, 2));
        Self { side: slice(1, side_y_m), top: slice(2, top_z_m), side_y_m, top_z_m }
    }

    /// The points of a slice.
    pub fn points(&self, slice: Slice) -> &[WorkspacePoint] {
        match slice {
            Slice::Side => &self.side,
            Slice::Top => &self.top,
        }
    }
}

fn extent(drawn: &[(Vector3<f64>, JointVector<f64>)], axis: usize) -> f64 {
    let (low, high) = bounds(drawn, axis);
    high - low
}

fn middle(drawn: &[(Vector3<f64>, JointVector<f64>)], axis: usize) -> f64 {
    let (low, high) = bounds(drawn, axis);
    f64::midpoint(low, high)
}

fn bounds(drawn: &[(Vector3<f64>, JointVector<f64>)], axis: usize) -> (f64, f64) {
    let of = drawn.iter().map(|(position_m, _)| position_m[axis]);
    of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// `position = T(q)` by design and by fit, and `√tr(J C Jᵀ)` of the fit's covariance C.
struct Predictor<'a> {
    design: Kinematics<f64>,
    fitted: Kinematics<f64>,
    free: Vec<usize>,
    covariance: &'a DMatrix<f64>,
}

impl<'a> Predictor<'a> {
    fn new(robot: &Robot, fit: &'a Fit) -> Self {
        let free = fit.parameters.iter().enumerate().filter(|(_, parameter)| parameter.held.is_none());
        Self {
            design: robot.kinematics(),
            fitted: fit.robot(robot).kinematics(),
            free: free.map(|(index, _)| index).collect(),
            covariance: &fit.uncertainty.covariance,
        }
    }

    fn at(&self, q: &JointVector<f64>) -> WorkspacePoint {
        let (position_m, jacobian) = position_jacobian(&self.fitted, q, &Vector3::zeros());
        // What is not the chain's does not move its tool: its columns stay zero.
        let column = |index: usize| jacobian.get((0, index)).map(|_| jacobian.column(index));
        let mut of_free = Matrix3xX::zeros(self.free.len());
        for (mut free, &index) in of_free.column_iter_mut().zip(&self.free) {
            if let Some(column) = column(index) {
                free.copy_from(&column);
            }
        }
        let variance = (&of_free * self.covariance).dot(&of_free);
        WorkspacePoint {
            position_m,
            before_m: (self.design.base_from_tool(q).translation_m - position_m).norm(),
            after_m: variance.max(0.0).sqrt(),
        }
    }
}

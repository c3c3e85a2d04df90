//! Whether the board computes what the host computes.

use ballbar::wire::{Answer, Command, CompiledParameters, ToolPose, WhichSet};
use ballbar::{Approach, Direction, JointVector, Kinematics, MAX_JOINTS, Pose, Vector3};
use ballbar_calib::model::{JointLimits, Robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::errors::BoardError;
use super::link::BoardLink;

/// The largest differences between the board's poses, in f32, and the host's, in f64 from the robot's file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KinematicsDifference {
    /// Joint vectors compared.
    pub vectors: usize,
    /// Between positions of the tool, metres.
    pub position_m: f64,
    /// Between axes of the tool, radians.
    pub axis_rad: f64,
    /// The farthest position from the base, metres.
    pub reach_m: f64,
}

impl KinematicsDifference {
    /// A micrometre for an arm that reaches a metre, in proportion beyond, and a microradian and a half: some ten units in the last
    /// place of an f32.
    pub fn is_small(&self) -> bool {
        self.position_m <= 1e-6 * self.reach_m.max(1.0) && self.axis_rad <= 1.5e-6
    }

    fn take(&mut self, found: &ToolPose, expected: &Pose<f64>) {
        let axis = |found: [f32; 3], i: usize| (wide(found) - expected.rotation.column(i)).norm();
        self.vectors += 1;
        self.position_m = larger(self.position_m, (wide(found.position_m) - expected.translation_m).norm());
        self.axis_rad = larger(self.axis_rad, larger(axis(found.x_axis, 0), axis(found.y_axis, 1)));
        self.reach_m = self.reach_m.max(expected.translation_m.norm());
    }
}

/// Compares at `vectors` random joint vectors within the joint limits; the same every time.
///
/// # Errors
/// [`BoardError`].
pub fn verify_kinematics(
    link: &mut BoardLink,
    kinematics: &Kinematics<f64>,
    limits: &[JointLimits],
    set: WhichSet,
    vectors: usize,
    mut on_vector: impl FnMut(),
) -> Result<KinematicsDifference, BoardError> {
    let mut difference = KinematicsDifference::default();
    for (q, approach, expected) in random_poses(kinematics, limits, vectors) {
        difference.take(&board_pose(link, set, q, approach)?, &expected);
        on_vector();
    }
    Ok(difference)
}

/// What single precision alone makes of the poses: the same comparison with the board's own arithmetic, done here.
pub fn rounding_of_kinematics(
    kinematics: &Kinematics<f64>,
    limits: &[JointLimits],
    compiled: &CompiledParameters,
    vectors: usize,
) -> KinematicsDifference {
    let mut difference = KinematicsDifference::default();
    for (q, approach, expected) in random_poses(kinematics, limits, vectors) {
        let mut vector = JointVector::zero();
        vector.as_array_mut()[..q.len()].copy_from_slice(&q);
        difference.take(&ToolPose::from(&compiled.kinematics.base_from_tool_approached(&vector, approach)), &expected);
    }
    difference
}

/// RMS distance, metres, between the tool's position as the board computes it with its stored parameters and as `truth` has it, at
/// `vectors` random joint vectors.
///
/// # Errors
/// [`BoardError`].
pub fn rms_kinematics(link: &mut BoardLink, truth: &Robot, vectors: usize) -> Result<f64, BoardError> {
    let mut squares = 0.0;
    for (q, approach, expected) in random_poses(&truth.kinematics(), &truth.limits, vectors) {
        let pose = board_pose(link, WhichSet::Active, q, approach)?;
        squares += (wide(pose.position_m) - expected.translation_m).norm_squared();
    }
    Ok((squares / vectors as f64).sqrt())
}

/// Encoder outputs as they travel.
type WireVector = heapless::Vec<f32, MAX_JOINTS>;

/// Random joint vectors within the limits, from where each was approached, and the poses there.
fn random_poses(
    kinematics: &Kinematics<f64>,
    limits: &[JointLimits],
    vectors: usize,
) -> impl Iterator<Item = (WireVector, Approach, Pose<f64>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    (0..vectors).map(move |number| {
        // Rounded first: the joint values are the same for both.
        let q: WireVector = limits.iter().map(|limits| rng.random_range(limits.min..=limits.max) as f32).collect();
        let mut vector = JointVector::zero();
        for (exact, rounded) in vector.as_array_mut().iter_mut().zip(&q) {
            *exact = f64::from(*rounded);
        }
        let approach = approach_of(number);
        (q, approach, kinematics.base_from_tool_approached(&vector, approach))
    })
}

/// Every mixture of joints that rose and joints that fell, one after the other.
fn approach_of(number: usize) -> Approach {
    let direction = |joint| if number >> joint & 1 == 0 { Direction::Rising } else { Direction::Falling };
    (0..MAX_JOINTS).fold(Approach::UNKNOWN, |approach, joint| approach.with(joint, Some(direction(joint))))
}

fn board_pose(link: &mut BoardLink, set: WhichSet, q: WireVector, approach: Approach) -> Result<ToolPose, BoardError> {
    match link.request(Command::ForwardKinematics { set, q, approach })? {
        Answer::Pose(pose) => Ok(pose),
        _ => Err(BoardError::WrongAnswer { command: "forward kinematics" }),
    }
}

/// What is not a number is larger than any: `f64::max` would pass over it.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) }
}

fn wide(v: [f32; 3]) -> Vector3<f64> {
    Vector3::from(v.map(f64::from))
}

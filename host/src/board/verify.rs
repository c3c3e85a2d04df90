//! Whether the board computes what the host computes.

use ballbar::wire::{Answer, Command, ToolPose, WhichSet};
use ballbar::{JointVector, Kinematics, MAX_JOINTS, Pose, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::errors::BoardError;
use super::link::BoardLink;
use crate::files::Robot;

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
}

/// Compares at `vectors` random joint vectors within the joint limits; the same every time.
///
/// # Errors
/// [`BoardError`].
pub fn verify_kinematics(
    link: &mut BoardLink,
    robot: &Robot,
    set: WhichSet,
    vectors: usize,
    mut on_vector: impl FnMut(),
) -> Result<KinematicsDifference, BoardError> {
    let mut difference = KinematicsDifference { vectors, ..KinematicsDifference::default() };
    for (pose, expected) in poses_of_both(link, robot, set, vectors) {
        let pose = pose?;
        let axis = |found: [f32; 3], i: usize| (wide(found) - expected.rotation.column(i)).norm();
        let position_m = (wide(pose.position_m) - expected.translation_m).norm();
        difference.position_m = larger(difference.position_m, position_m);
        difference.axis_rad = larger(difference.axis_rad, larger(axis(pose.x_axis, 0), axis(pose.y_axis, 1)));
        difference.reach_m = difference.reach_m.max(expected.translation_m.norm());
        on_vector();
    }
    Ok(difference)
}

/// RMS distance, metres, between the tool's position as the board computes it with its stored parameters and as `truth` has it, at
/// `vectors` random joint vectors.
///
/// # Errors
/// [`BoardError`].
pub fn rms_kinematics(link: &mut BoardLink, truth: &Robot, vectors: usize) -> Result<f64, BoardError> {
    let mut squares = 0.0;
    for (pose, expected) in poses_of_both(link, truth, WhichSet::Active, vectors) {
        squares += (wide(pose?.position_m) - expected.translation_m).norm_squared();
    }
    Ok((squares / vectors as f64).sqrt())
}

/// The board's pose and the robot's at random joint vectors within the robot's limits.
fn poses_of_both<'a>(
    link: &'a mut BoardLink,
    robot: &'a Robot,
    set: WhichSet,
    vectors: usize,
) -> impl Iterator<Item = (Result<ToolPose, BoardError>, Pose<f64>)> + 'a {
    let kinematics = Kinematics::new(&robot.chain);
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    (0..vectors).map(move |_| {
        // Rounded first: the joint values are the same for both.
        let q: heapless::Vec<f32, MAX_JOINTS> =
            robot.limits.iter().map(|limits| rng.random_range(limits.min..=limits.max) as f32).collect();
        let mut vector = JointVector::zero();
        for (exact, rounded) in vector.as_array_mut().iter_mut().zip(&q) {
            *exact = f64::from(*rounded);
        }
        let expected = kinematics.base_from_tool(&vector);
        let pose = match link.request(Command::ForwardKinematics { set, q }) {
            Ok(Answer::Pose(pose)) => Ok(pose),
            Ok(_) => Err(BoardError::WrongAnswer { command: "forward kinematics" }),
            Err(error) => Err(error),
        };
        (pose, expected)
    })
}

/// What is not a number is larger than any: `f64::max` would pass over it.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) }
}

fn wide(v: [f32; 3]) -> Vector3<f64> {
    Vector3::from(v.map(f64::from))
}

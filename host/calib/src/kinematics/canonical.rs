//! The same robot in frames of its own, however its frames were written.
//!
//! A frame may slide and turn along its own joint axis, and a prismatic joint's anywhere, without changing the robot. What depends on
//! frames, the rounding of a far origin, a tolerance of a parameter or the picture of a link, must not depend on that choice. Canonical
//! frames follow from what the robot does alone: from its axes and its tool while all encoders read zero.
//!
//! - **Origins**, from the tool inwards: of a revolute joint the foot of the perpendicular from the next frame's origin (the tool's for the
//!   last joint) on its axis; of a prismatic joint the next frame's origin, at encoder zero. Unique and near for parallel and intersecting
//!   axes alike, which common normals are not (S. A. Hayati, "Robot arm geometric link parameter estimation", IEEE CDC 1983).
//! - **Turns**, from the base outwards: each link's rotation is `Rz(alpha) · Rx(gamma)`, so that beta is zero; where two axes are nearly
//!   parallel or antiparallel, and alpha would be anything, the smallest rotation from one to the other, behind a half turn about x in the
//!   second case.
//! - **Encoders**: offsets are zero; scales and the joints' senses stay.

mod returning;

use std::f64::consts::{PI, TAU};

use ballbar::{Body, Chain, Joint, JointKind, JointTerms, Matrix3, PARAMETERS_PER_JOINT, ParameterKind, Pose, Vector3};
use nalgebra::DMatrix;

use self::returning::UserFrames;
use super::frames::{compose, from_link, inverse, link_angles, link_angles_about};
use super::skeleton::Axis;

/// A robot in canonical frames, and the way back to the frames it was written in.
///
/// ```
/// use ballbar_calib::kinematics::{CanonicalFrames, apart};
/// use ballbar_calib::{Kinematics, designs};
///
/// // The frame of axis 2 ten metres along that axis: another file, the same robot.
/// let puma = designs::puma560().chain;
/// let mut slid = puma.clone();
/// slid.parameters_mut()[8] -= 10.0; // x2: axis 2 points against x of the frame before it
/// slid.parameters_mut()[18] -= 10.0; // z3
/// let q = puma.joint_vector(&[0.3, -0.5, 0.4, 0.2, -0.6, 1.0])?;
/// let pose = |chain| Kinematics::new(chain).base_from_tool(&q);
/// assert!(apart(&pose(&puma), &pose(&slid)).0 < 1e-12);
///
/// let frames = CanonicalFrames::new(&slid);
/// let canonical = CanonicalFrames::new(&puma).chain().clone();
/// assert!(frames.chain().parameters().iter().zip(canonical.parameters()).all(|(a, b)| (a - b).abs() < 1e-12));
/// assert_eq!(frames.in_user_frames(frames.chain()), slid);
/// # Ok::<(), ballbar_calib::ChainError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CanonicalFrames {
    canonical: Chain<f64>,
    user: UserFrames,
    /// What the way back makes of the canonical chain: the user's own, but for rounding.
    returned: Chain<f64>,
    own: UserFrames,
}

/// Sine of the angle below which two axes count as nearly parallel: 11.5°, which no robot is designed with.
const NEARLY_PARALLEL: f64 = 0.2;

impl CanonicalFrames {
    /// Of a chain in any frames.
    pub fn new(chain: &Chain<f64>) -> Self {
        let canonical = canonical(chain);
        let user = UserFrames::of(chain);
        let returned = user.of_chain(&canonical);
        Self { user, returned, own: UserFrames::of(&canonical), canonical }
    }

    /// The same robot in canonical frames: the same pose at all encoder outputs, to rounding.
    pub fn chain(&self) -> &Chain<f64> {
        &self.canonical
    }

    /// Joint terms as they are in canonical frames: the masses' centres seen from there. Coefficients are of encoder outputs and loads, which
    /// have no frame, and so has the payload, which is in the tool's.
    pub fn terms(&self, terms: &JointTerms<f64>) -> JointTerms<f64> {
        let mut canonical = *terms;
        let (user, own) = (AtZero::of(self.user.chain()), AtZero::of(&self.canonical));
        for ((body, user), own) in canonical.masses.links.iter_mut().zip(user.behind_joints()).zip(own.behind_joints()) {
            body.center_m = seen_from(own, user, &body.center_m);
        }
        canonical
    }

    /// The user's joint terms for a chain that [`CanonicalFrames::in_user_frames`] has given: a frame a hundred metres away moves by centimetres where
    /// its link is found to be turned by next to nothing, and the masses stay with their links.
    pub fn terms_in_user_frames(&self, chain: &Chain<f64>, terms: &JointTerms<f64>) -> JointTerms<f64> {
        if chain == self.user.chain() {
            return *terms;
        }
        let mut moved = self.terms(terms);
        let (user, own) = (AtZero::of(chain), AtZero::of(&self.in_canonical_frames(chain)));
        for ((body, user), own) in moved.masses.links.iter_mut().zip(user.behind_joints()).zip(own.behind_joints()) {
            *body = Body { center_m: seen_from(user, own, &body.center_m), ..*body };
        }
        moved
    }

    /// The same with lengths in whole nanometres and angles in whole 2⁻³³ of a turn (0.7 nrad): the same bits however the robot is written,
    /// unless a value lies at the edge of a step, for what would otherwise hang on the last bit of a comparison.
    pub fn rounded_chain(&self) -> Chain<f64> {
        const STEPS_PER_METRE: f64 = 1e9;
        const STEPS_PER_TURN: f64 = 8_589_934_592.0;
        let mut rounded = self.canonical.clone();
        for (index, value) in rounded.parameters_mut().iter_mut().enumerate() {
            // Without the sign of a zero.
            *value = match index % PARAMETERS_PER_JOINT {
                0..3 => (*value * STEPS_PER_METRE).round() / STEPS_PER_METRE + 0.0,
                3..6 => (*value / TAU * STEPS_PER_TURN).round() / STEPS_PER_TURN * TAU + 0.0,
                _ => *value,
            };
        }
        rounded
    }

    /// A chain of the same joints, in any frames, as the user writes it: the same robot to rounding, its redundant parameters (those of
    /// [`Chain::is_conventionally_held`]) at the user's values. A chain that is [`CanonicalFrames::chain`] comes back bit for bit.
    ///
    /// Where the user's beta is nearly a right angle, alpha and gamma turn about one axis, and no small change of beta and gamma alone tilts
    /// the next axis in every direction. There gamma stays at the user's value besides alpha, and the next link's alpha gives way. The
    /// tool's link has no next, nor does a link whose gamma is nearly a right angle, too, tilt in both directions: then alpha and gamma come
    /// out as they must, which may be far from the user's, though the rotation is near.
    ///
    /// # Panics
    /// When the chain's joints are not the user's.
    pub fn in_user_frames(&self, chain: &Chain<f64>) -> Chain<f64> {
        assert_eq!(chain.joint_kinds(), self.canonical.joint_kinds(), "a chain of the same joints");
        self.user.moved_from(&self.returned, &self.user.of_chain(chain))
    }

    /// A chain of the same joints, in any frames, as it is in these canonical ones: the same robot to rounding, its redundant parameters those
    /// of [`CanonicalFrames::chain`]. So two robots are compared, such as a design and what was fitted to it.
    ///
    /// # Panics
    /// When the chain's joints are not these.
    pub fn in_canonical_frames(&self, chain: &Chain<f64>) -> Chain<f64> {
        assert_eq!(chain.joint_kinds(), self.canonical.joint_kinds(), "a chain of the same joints");
        self.own.of_chain(chain)
    }

    /// `∂user/∂canonical` at a chain in (nearly) canonical frames: P × P for P parameters, SI units, by which a covariance comes to the
    /// user's frames as `D C Dᵀ`. Central differences of [`CanonicalFrames::in_user_frames`] with steps of 1e-5.
    ///
    /// # Panics
    /// When the chain's joints are not the user's.
    pub fn user_by_canonical(&self, chain: &Chain<f64>) -> DMatrix<f64> {
        const STEP: f64 = 1e-5;
        let count = chain.parameter_count();
        let mut derivative = DMatrix::zeros(count, count);
        for (index, mut column) in derivative.column_iter_mut().enumerate() {
            let stepped = |step: f64| {
                let mut chain = chain.clone();
                chain.parameters_mut()[index] += step;
                self.in_user_frames(&chain)
            };
            let (ahead, behind) = (stepped(STEP), stepped(-STEP));
            for (row, (ahead, behind)) in ahead.parameters().iter().zip(behind.parameters()).enumerate() {
                let is_angle = matches!(row % PARAMETERS_PER_JOINT, 3..6);
                let difference = ahead - behind;
                column[row] = if is_angle { within_half_turn(difference) } else { difference } / (2.0 * STEP);
            }
        }
        derivative
    }
}

/// Poses of the joints' frames, before each joint's motion, and behind them that of the tool, at encoders zero: base frame.
pub(super) struct AtZero {
    frames: Vec<Pose<f64>>,
    /// The same behind each joint's motion: they move with it.
    behind: Vec<Pose<f64>>,
    pub(super) base_from_tool: Pose<f64>,
}

impl AtZero {
    pub(super) fn of(chain: &Chain<f64>) -> Self {
        let mut base_from_last = from_link(Vector3::zeros(), [0.0; 3]);
        let (mut frames, mut behind) = (Vec::new(), Vec::new());
        for i in 0..=chain.joints() {
            if let Some(link) = chain.link(i) {
                let angles = [link.alpha_rad, link.beta_rad, link.gamma_rad];
                base_from_last = compose(&base_from_last, &from_link(link.translation_m, angles));
            }
            if let Some(joint) = chain.joint(i) {
                frames.push(base_from_last);
                base_from_last = compose(&base_from_last, &joint_at_zero(joint.kind, joint.offset));
                behind.push(base_from_last);
            }
        }
        Self { frames, behind, base_from_tool: base_from_last }
    }

    /// The joints' axes through the origins that the chain gives them.
    pub(super) fn axes(&self, chain: &Chain<f64>) -> Vec<Axis> {
        let joints = (0..chain.joints()).filter_map(|i| chain.joint(i)).zip(&self.frames);
        let axis = |(joint, frame): (Joint<f64>, &Pose<f64>)| Axis {
            kind: joint.kind,
            point_m: frame.translation_m,
            direction: frame.rotation.column(2).into(),
            scale: joint.scale,
        };
        joints.map(axis).collect()
    }

    fn behind_joints(&self) -> &[Pose<f64>] {
        &self.behind
    }

    fn direction(&self, joint: usize) -> Vector3<f64> {
        self.frames[joint].rotation.column(2).into()
    }
}

/// A point of frame `of`, metres, in frame `to`.
fn seen_from(to: &Pose<f64>, of: &Pose<f64>, point_m: &Vector3<f64>) -> Vector3<f64> {
    let to_from_of = compose(&inverse(to), of);
    to_from_of.rotation * point_m + to_from_of.translation_m
}

/// What a joint does at encoder zero.
fn joint_at_zero(kind: JointKind, offset: f64) -> Pose<f64> {
    match kind {
        JointKind::Revolute => from_link(Vector3::zeros(), [offset, 0.0, 0.0]),
        JointKind::Prismatic => from_link(Vector3::new(0.0, 0.0, offset), [0.0; 3]),
    }
}

/// The same robot in canonical frames.
pub(super) fn canonical(chain: &Chain<f64>) -> Chain<f64> {
    let zero = AtZero::of(chain);
    let origins_m = origins(chain.joint_kinds(), &zero);
    let mut written = chain.clone();
    let mut last = from_link(Vector3::zeros(), [0.0; 3]);
    for (i, parameters) in written.parameters_mut().chunks_mut(PARAMETERS_PER_JOINT).enumerate() {
        let (origin_m, angles) = match zero.frames.get(i) {
            Some(_) => (origins_m[i], angles_towards(&last.rotation.tr_mul(&zero.direction(i)))),
            None => (zero.base_from_tool.translation_m, angles_of_tool(&last.rotation.tr_mul(&zero.base_from_tool.rotation))),
        };
        let mut translation_m = last.rotation.tr_mul(&(origin_m - last.translation_m));
        // What is zero by construction is zero to the bit.
        match i.checked_sub(1).map(|joint| chain.joint_kinds()[joint]) {
            Some(JointKind::Revolute) => translation_m.z = 0.0,
            Some(JointKind::Prismatic) => translation_m = Vector3::zeros(),
            None => {}
        }
        parameters[..3].copy_from_slice(translation_m.as_slice());
        parameters[3..6].copy_from_slice(&angles);
        if let Some(offset) = parameters.get_mut(ParameterKind::Offset as usize) {
            *offset = 0.0;
        }
        last = Pose { rotation: last.rotation * from_link(Vector3::zeros(), angles).rotation, translation_m: origin_m };
    }
    written
}

/// Origins of the joints' frames, base frame, at encoders zero.
fn origins(kinds: &[JointKind], zero: &AtZero) -> Vec<Vector3<f64>> {
    let mut origins_m = vec![zero.base_from_tool.translation_m; kinds.len()];
    let mut next_m = zero.base_from_tool.translation_m;
    for (joint, kind) in kinds.iter().enumerate().rev() {
        if *kind == JointKind::Revolute {
            let (direction, point_m) = (zero.direction(joint), zero.frames[joint].translation_m);
            next_m = point_m + direction * direction.dot(&(next_m - point_m));
        }
        origins_m[joint] = next_m;
    }
    origins_m
}

/// Alpha, beta, gamma of a link whose next axis lies along `direction` of the frame before it; the next frame's turn is free.
fn angles_towards(direction: &Vector3<f64>) -> [f64; 3] {
    let sine = direction.xy().norm();
    if sine < NEARLY_PARALLEL && direction.z > 0.0 {
        link_angles(&smallest_turn_to(direction))
    } else if sine < NEARLY_PARALLEL {
        // Rx(π) · Rz(a) · Ry(b) · Rx(c) = Rz(−a) · Ry(−b) · Rx(π + c)
        let [alpha, beta, gamma] = link_angles(&smallest_turn_to(&Vector3::new(direction.x, -direction.y, -direction.z)));
        [-alpha, -beta, PI + gamma]
    } else {
        // Rz(alpha) · Rx(gamma) · z = (sin γ sin α, −sin γ cos α, cos γ), and so does alpha half a turn on with −gamma.
        let alpha = direction.x.atan2(-direction.y);
        let turned = (alpha - LEAST_ALPHA).rem_euclid(TAU);
        let (alpha, side) = if turned < PI { (LEAST_ALPHA + turned, 1.0) } else { (LEAST_ALPHA + turned - PI, -1.0) };
        [alpha, 0.0, side * sine.atan2(direction.z)]
    }
}

/// Alpha lies within half a turn from here, radians: so that it jumps where next to no robot has it, and not at whole right angles.
const LEAST_ALPHA: f64 = -0.6;

/// The smallest rotation that turns z to a direction before it.
fn smallest_turn_to(direction: &Vector3<f64>) -> Matrix3<f64> {
    let skew = Vector3::z().cross(direction).cross_matrix();
    Matrix3::identity() + skew + skew * skew / (1.0 + direction.z)
}

/// Of the tool's link, which has no turn to choose.
fn angles_of_tool(rotation: &Matrix3<f64>) -> [f64; 3] {
    if is_upright(rotation) {
        return link_angles_about(rotation, 0.0);
    }
    // Half a turn is one angle, whatever the rounding.
    link_angles(rotation).map(|angle| if angle < ROUNDING - PI { angle + TAU } else { angle })
}

/// Whether beta of a rotation is a right angle to rounding, so that alpha and gamma cannot be told apart.
fn is_upright(rotation: &Matrix3<f64>) -> bool {
    rotation[(0, 0)].hypot(rotation[(1, 0)]) < ROUNDING
}

/// Of angles behind eight joints, radians.
const ROUNDING: f64 = 1e-12;

/// An angle less whole turns.
fn within_half_turn(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}

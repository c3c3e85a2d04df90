//! From any frames to those that a user has written.

use std::f64::consts::PI;

use ballbar::{Chain, Joint, JointKind, Link, Matrix3, PARAMETERS_PER_JOINT, Pose, Vector3};

use super::{AtZero, angles_towards, is_upright, joint_at_zero, within_half_turn};
use crate::kinematics::frames::{compose, from_link, inverse, link_angles, link_angles_about};

/// Below this cosine of the user's beta, alpha alone is too coarse a handle on a frame's turn.
const STEEP: f64 = 0.1;

/// Frames as a user has written them.
#[derive(Clone, Debug)]
pub(super) struct UserFrames {
    chain: Chain<f64>,
    links: Vec<Link<f64>>,
    joints: Vec<Joint<f64>>,
}

/// What stays at the user's value of a link's angles, and so says how the frames on both sides are turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kept {
    /// Alpha: it says how the frame before the link is turned, given the frame behind.
    Alpha,
    /// Alpha and gamma: they say how both frames are turned, given both axes.
    AlphaAndGamma,
    /// None: the frame before the link is turned so that the whole rotation stays as near as it can.
    Rotation,
}

impl UserFrames {
    pub(super) fn of(chain: &Chain<f64>) -> Self {
        Self {
            chain: chain.clone(),
            links: (0..=chain.joints()).filter_map(|i| chain.link(i)).collect(),
            joints: (0..chain.joints()).filter_map(|i| chain.joint(i)).collect(),
        }
    }

    /// The chain as the user has written it.
    pub(super) fn chain(&self) -> &Chain<f64> {
        &self.chain
    }

    /// The user's own chain with the differences between two others, angles less whole turns. What both have alike, but for rounding, keeps
    /// the user's digits.
    pub(super) fn moved_from(&self, from: &Chain<f64>, to: &Chain<f64>) -> Chain<f64> {
        /// Metres and radians.
        const ROUNDING: f64 = 1e-14;
        let mut moved = self.chain.clone();
        let values = moved.parameters_mut().iter_mut().zip(from.parameters().iter().zip(to.parameters())).enumerate();
        for (index, (value, (from, to))) in values {
            let is_angle = matches!(index % PARAMETERS_PER_JOINT, 3..6);
            let change = if is_angle { within_half_turn(to - from) } else { to - from };
            *value += if change.abs() < ROUNDING { 0.0 } else { change };
        }
        moved
    }

    /// A chain of the same joints in these frames: redundant parameters are the user's.
    pub(super) fn of_chain(&self, chain: &Chain<f64>) -> Chain<f64> {
        let zero = AtZero::of(chain);
        let rotations = self.rotations(&zero);
        let origins_m = self.origins(&zero, &rotations);
        let mut written = chain.clone();
        let mut last = from_link(Vector3::zeros(), [0.0; 3]);
        for (i, parameters) in written.parameters_mut().chunks_mut(PARAMETERS_PER_JOINT).enumerate() {
            let frame = match self.joints.get(i) {
                Some(_) => Pose { rotation: rotations[i], translation_m: origins_m[i] },
                None => zero.base_from_tool,
            };
            let link = compose(&inverse(&last), &frame);
            parameters[..3].copy_from_slice(self.translation(i, &link).as_slice());
            parameters[3..6].copy_from_slice(&self.angles(i, &link.rotation));
            let Some(joint) = self.joints.get(i) else { continue };
            parameters[6] = joint.offset;
            last = compose(&frame, &joint_at_zero(joint.kind, joint.offset));
        }
        written
    }

    fn kept(&self, link: usize) -> Kept {
        let Link { beta_rad, gamma_rad, .. } = self.links[link];
        if beta_rad.cos().abs() > STEEP {
            Kept::Alpha
        } else if link < self.joints.len() && gamma_rad.cos().abs() > STEEP {
            Kept::AlphaAndGamma
        } else {
            Kept::Rotation
        }
    }

    /// Rotations of the joints' frames, before each joint's motion, at encoders zero: base frame.
    fn rotations(&self, zero: &AtZero) -> Vec<Matrix3<f64>> {
        let joints = self.joints.len();
        let mut turned: Vec<Option<Matrix3<f64>>> = vec![None; joints];
        // Outwards where two axes say how both of their frames are turned, and then inwards from what is known.
        for link in (0..joints).filter(|&link| self.kept(link) == Kept::AlphaAndGamma) {
            let Some(before) = link.checked_sub(1) else {
                turned[0] = Some(self.first_of_axis(&zero.direction(0)));
                continue;
            };
            let next = zero.direction(link);
            turned[link] = Some(match turned[before] {
                Some(rotation) => self.next_of_axis(link, &self.behind_joint(before, &rotation), &next),
                None => {
                    let (frame, next) = self.both_of_axes(link, &zero.direction(before), &next);
                    turned[before] = Some(frame);
                    next
                }
            });
        }
        let mut rotations = vec![zero.base_from_tool.rotation; joints + 1];
        for joint in (0..joints).rev() {
            let known = || self.before(joint, &zero.direction(joint), &rotations[joint + 1]);
            rotations[joint] = turned[joint].unwrap_or_else(known);
        }
        rotations.truncate(joints);
        rotations
    }

    /// The first frame, of whose link gamma is kept.
    fn first_of_axis(&self, axis: &Vector3<f64>) -> Matrix3<f64> {
        let link = self.links[0];
        let beta = self.beta_of(0, axis.z);
        let at_no_alpha = rotation([0.0, beta, link.gamma_rad]);
        rotation([azimuth(axis) - azimuth(&at_no_alpha.column(2).into()), beta, link.gamma_rad])
    }

    /// A frame by its axis and by the one before, behind its joint: alpha is kept.
    fn next_of_axis(&self, link: usize, before: &Matrix3<f64>, axis: &Vector3<f64>) -> Matrix3<f64> {
        let alpha = self.links[link].alpha_rad;
        // Ry(beta) · Rx(gamma) · z = (sin β cos γ, −sin γ, cos β cos γ)
        let axis = rotation([alpha, 0.0, 0.0]).tr_mul(&before.tr_mul(axis));
        let side = self.links[link].gamma_rad.cos().signum();
        let beta = (side * axis.x).atan2(side * axis.z);
        let gamma = (-axis.y).atan2(side * axis.x.hypot(axis.z));
        before * rotation([alpha, beta, gamma])
    }

    /// Both frames by their axes: alpha and gamma are kept. The first is before its joint's motion.
    fn both_of_axes(&self, link: usize, axis: &Vector3<f64>, next: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
        let Link { alpha_rad, gamma_rad, .. } = self.links[link];
        let between = self.turn_of_joint(link - 1) * rotation([alpha_rad, self.beta_of(link, axis.dot(next)), gamma_rad]);
        let frame = frame_about(axis, next, azimuth(&between.column(2).into()));
        (frame, frame * between)
    }

    /// Beta of a link whose gamma is kept, on the user's side of zero, by the cosine between the axes.
    fn beta_of(&self, link: usize, cosine: f64) -> f64 {
        let Link { beta_rad, gamma_rad, .. } = self.links[link];
        (cosine / gamma_rad.cos()).clamp(-1.0, 1.0).acos() * beta_rad.sin().signum()
    }

    /// The frame of a joint, before its motion, by its axis and the rotation of the next frame.
    fn before(&self, joint: usize, axis: &Vector3<f64>, next: &Matrix3<f64>) -> Matrix3<f64> {
        let Link { alpha_rad, beta_rad, gamma_rad, .. } = self.links[joint + 1];
        let turn = self.turn_of_joint(joint);
        if self.kept(joint + 1) == Kept::Rotation {
            let wanted = next * (turn * rotation([alpha_rad, beta_rad, gamma_rad])).transpose();
            let any = frame_about(axis, &wanted.column(0).into(), 0.0);
            let off = any.tr_mul(&wanted);
            let angle = (off[(1, 0)] - off[(0, 1)]).atan2(off[(0, 0)] + off[(1, 1)]);
            return any * rotation([angle, 0.0, 0.0]);
        }
        let x_axis: Vector3<f64> = next.column(0).into();
        let along_alpha = turn * rotation([alpha_rad, 0.0, 0.0]);
        frame_about(axis, &(x_axis * beta_rad.cos().signum()), azimuth(&along_alpha.column(0).into()))
    }

    /// Origins of the joints' frames, before each joint's motion, at encoders zero: base frame, metres.
    fn origins(&self, zero: &AtZero, rotations: &[Matrix3<f64>]) -> Vec<Vector3<f64>> {
        let mut origins_m = vec![Vector3::zeros(); rotations.len()];
        let mut next_m = zero.base_from_tool.translation_m;
        for (joint, Joint { kind, offset, .. }) in self.joints.iter().enumerate().rev() {
            let (axis, translation_m) = (zero.direction(joint), self.links[joint + 1].translation_m);
            next_m = match kind {
                JointKind::Revolute => {
                    let point_m = zero.frames[joint].translation_m;
                    point_m + axis * (axis.dot(&(next_m - point_m)) - translation_m.z)
                }
                JointKind::Prismatic => next_m - rotations[joint] * translation_m - axis * *offset,
            };
            origins_m[joint] = next_m;
        }
        origins_m
    }

    /// The user's own where it is redundant.
    fn translation(&self, link: usize, found: &Pose<f64>) -> Vector3<f64> {
        let user_m = self.links[link].translation_m;
        match link.checked_sub(1).map(|joint| self.joints[joint].kind) {
            Some(JointKind::Revolute) => Vector3::new(found.translation_m.x, found.translation_m.y, user_m.z),
            Some(JointKind::Prismatic) => user_m,
            None => found.translation_m,
        }
    }

    /// Alpha, beta, gamma of a link's rotation: alpha the user's where it is kept, else those of the two ways to write a rotation that are
    /// nearer to the user's.
    fn angles(&self, link: usize, found: &Matrix3<f64>) -> [f64; 3] {
        let Link { alpha_rad, beta_rad, gamma_rad, .. } = self.links[link];
        if self.is_alpha_kept(link) || is_upright(found) {
            return link_angles_about(found, alpha_rad);
        }
        let [alpha, beta, gamma] = link_angles(found);
        let far = |angles: &[f64; 3]| -> f64 {
            angles.iter().zip([alpha_rad, beta_rad, gamma_rad]).map(|(angle, user)| within_half_turn(angle - user).abs()).sum()
        };
        let ways = [[alpha, beta, gamma], [alpha + PI, PI - beta, gamma + PI]];
        if far(&ways[1]) < far(&ways[0]) { ways[1] } else { ways[0] }
    }

    /// Whether the frame before a link is turned so that its alpha is the user's.
    fn is_alpha_kept(&self, link: usize) -> bool {
        link > 0
            && match self.kept(link) {
                Kept::Alpha => self.kept(link - 1) != Kept::AlphaAndGamma,
                Kept::AlphaAndGamma => true,
                Kept::Rotation => false,
            }
    }

    fn behind_joint(&self, joint: usize, frame: &Matrix3<f64>) -> Matrix3<f64> {
        frame * self.turn_of_joint(joint)
    }

    fn turn_of_joint(&self, joint: usize) -> Matrix3<f64> {
        let Joint { kind, offset, .. } = self.joints[joint];
        joint_at_zero(kind, offset).rotation
    }
}

fn rotation(angles: [f64; 3]) -> Matrix3<f64> {
    from_link(Vector3::zeros(), angles).rotation
}

/// Angle about z from x, radians.
fn azimuth(direction: &Vector3<f64>) -> f64 {
    direction.y.atan2(direction.x)
}

/// The frame with z along `axis` in which `other` has an azimuth, radians.
fn frame_about(axis: &Vector3<f64>, other: &Vector3<f64>, azimuth_rad: f64) -> Matrix3<f64> {
    let across = other - axis * axis.dot(other);
    // Along the axis itself it has none: any frame will do.
    let across = across.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(|| rotation(angles_towards(axis)).column(0).into());
    let towards = Matrix3::from_columns(&[across, axis.cross(&across), *axis]);
    towards * rotation([-azimuth_rad, 0.0, 0.0])
}

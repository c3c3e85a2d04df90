//! Axes and links of a robot at one joint vector, whatever frames its file is written in.

use ballbar::{Approach, Chain, Joint, JointKind, JointTerms, JointVector, Kinematics, MAX_JOINTS, Matrix3, Pose, Vector3};

use super::axis::Axis;
use super::canonical::CanonicalFrames;
use super::frames::from_link;
use crate::model::Robot;

/// A robot made ready for questions about its links: in canonical frames ([`super::CanonicalFrames`]), so that nothing here depends on
/// where along its axis a frame was put.
#[derive(Clone, Debug)]
pub struct Skeleton {
    chain: Chain<f64>,
    links: Vec<LinkTransform>,
    encoders: Vec<Joint<f64>>,
    /// Of joints that have any, with what their loads are computed by.
    terms: Option<Box<(JointTerms<f64>, Kinematics<f64>)>>,
}

#[derive(Clone, Copy, Debug)]
struct LinkTransform {
    translation_m: Vector3<f64>,
    rotation: Matrix3<f64>,
    /// Where the link's end comes to the next axis, by its height along that above the next origin; zero before the tool.
    end_height_m: f64,
}

/// Where the links stand at one joint vector; base frame, metres. Links are counted from 0 at the base.
#[derive(Clone, Debug)]
pub struct Posture {
    joints: usize,
    axes: [Axis; MAX_JOINTS],
    starts_m: [Vector3<f64>; MAX_JOINTS + 1],
    corners_m: [Vector3<f64>; MAX_JOINTS + 1],
    ends_m: [Vector3<f64>; MAX_JOINTS + 1],
    /// Pose of the tool.
    pub base_from_tool: Pose<f64>,
}

impl Posture {
    /// The joints' axes, from the base.
    pub fn axes(&self) -> &[Axis] {
        &self.axes[..self.joints]
    }

    /// Where link `link` starts, from 0: on the axis of the joint before it, behind that joint's motion, where the link before it comes to
    /// that axis.
    pub fn start_m(&self, link: usize) -> Vector3<f64> {
        self.starts_m[link]
    }

    /// Where link `link` leaves the axis of the joint before it: at that joint's canonical origin, behind its motion.
    pub fn corner_m(&self, link: usize) -> Vector3<f64> {
        self.corners_m[link]
    }

    /// Where link `link` ends: at the foot of the perpendicular from its corner on the next axis, before that joint's motion, or at the tool's
    /// origin.
    pub fn end_m(&self, link: usize) -> Vector3<f64> {
        self.ends_m[link]
    }

    /// A point of the tool in the base frame, metres.
    pub fn point_in_base(&self, point_tool_m: &Vector3<f64>) -> Vector3<f64> {
        self.base_from_tool.rotation * point_tool_m + self.base_from_tool.translation_m
    }
}

impl Skeleton {
    /// Prepares a chain.
    pub fn new(chain: &Chain<f64>) -> Self {
        Self::of_canonical(CanonicalFrames::new(chain).chain())
    }

    fn of_canonical(chain: &Chain<f64>) -> Self {
        let chain = chain.clone();
        let link = |i: usize| {
            let link = chain.link(i)?;
            let Pose { rotation, translation_m } = from_link(link.translation_m, [link.alpha_rad, link.beta_rad, link.gamma_rad]);
            let end_height_m = if i < chain.joints() { -translation_m.dot(&rotation.column(2)) } else { 0.0 };
            Some(LinkTransform { translation_m, rotation, end_height_m })
        };
        Self {
            links: (0..=chain.joints()).filter_map(link).collect(),
            encoders: (0..chain.joints()).filter_map(|i| chain.joint(i)).collect(),
            terms: None,
            chain,
        }
    }

    /// Prepares a robot: its chain, with the terms of its joints. Of backlash the middle is taken.
    pub fn of(robot: &Robot) -> Self {
        let frames = CanonicalFrames::new(&robot.chain);
        let of_joints = || Box::new((frames.terms(&robot.terms), Kinematics::new(frames.chain())));
        Self { terms: (!robot.terms.are_zero()).then(of_joints), ..Self::of_canonical(frames.chain()) }
    }

    /// The robot in canonical frames.
    pub fn chain(&self) -> &Chain<f64> {
        &self.chain
    }

    /// Whether the joints' angles are more than offset and scale make them.
    pub fn has_terms(&self) -> bool {
        self.terms.is_some()
    }

    fn displacements(&self, q: &JointVector<f64>) -> JointVector<f64> {
        self.terms.as_ref().map_or(JointVector::zero(), |of_joints| {
            let (terms, rigid) = &**of_joints;
            terms.displacements(q, &terms.loads(rigid, q), Approach::UNKNOWN)
        })
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.encoders.len()
    }

    /// The joints' encoder models, of canonical frames: without offsets.
    pub fn encoders(&self) -> &[Joint<f64>] {
        &self.encoders
    }

    /// Translation of link `link`, from 0, in the canonical frame before it, metres.
    ///
    /// # Panics
    /// When there is no such link.
    pub fn translation_m(&self, link: usize) -> Vector3<f64> {
        self.links[link].translation_m
    }

    /// Where the links stand at encoder outputs `q`.
    pub fn at(&self, q: &JointVector<f64>) -> Posture {
        let nowhere = Axis { kind: JointKind::Revolute, point_m: Vector3::zeros(), direction: Vector3::z(), scale: 0.0 };
        let mut posture = Posture {
            joints: self.encoders.len(),
            axes: [nowhere; MAX_JOINTS],
            starts_m: [Vector3::zeros(); MAX_JOINTS + 1],
            corners_m: [Vector3::zeros(); MAX_JOINTS + 1],
            ends_m: [Vector3::zeros(); MAX_JOINTS + 1],
            base_from_tool: Pose { rotation: Matrix3::identity(), translation_m: Vector3::zeros() },
        };
        let displacements = self.displacements(q);
        let (mut rotation, mut origin_m) = (Matrix3::identity(), Vector3::zeros());
        let mut start_height_m = 0.0;
        for (i, link) in self.links.iter().enumerate() {
            posture.starts_m[i] = origin_m + rotation.column(2) * start_height_m;
            posture.corners_m[i] = origin_m;
            origin_m += rotation * link.translation_m;
            rotation *= link.rotation;
            let direction: Vector3<f64> = rotation.column(2).into();
            posture.ends_m[i] = origin_m + direction * link.end_height_m;
            start_height_m = link.end_height_m;
            let Some(encoder) = self.encoders.get(i) else { continue };
            posture.axes[i] = Axis { kind: encoder.kind, point_m: origin_m, direction, scale: encoder.scale };
            let theta = encoder.offset + encoder.scale * q.as_array()[i] + displacements.as_array()[i];
            match encoder.kind {
                JointKind::Revolute => turn_about_z(&mut rotation, theta),
                JointKind::Prismatic => origin_m += direction * theta,
            }
        }
        posture.base_from_tool = Pose { rotation, translation_m: origin_m };
        posture
    }
}

/// `rotation · Rz(angle)`.
fn turn_about_z(rotation: &mut Matrix3<f64>, angle_rad: f64) {
    let (sin, cos) = angle_rad.sin_cos();
    let (x, y): (Vector3<f64>, Vector3<f64>) = (rotation.column(0).into(), rotation.column(1).into());
    rotation.set_column(0, &(x * cos + y * sin));
    rotation.set_column(1, &(y * cos - x * sin));
}

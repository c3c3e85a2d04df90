//! Forward kinematics, the length of the bar and its gradient, in sweeps of vectors along the chain.
//!
//! No 4×4 products and no numerical differences. One sweep from the tool to the base carries the sphere; one sweep from the
//! base to the tool carries the wrench of a unit force along the bar, and each parameter's column is one component of it.

use serde::{Deserialize, Serialize};

use crate::{
    Approach, Chain, Configuration, Force, Joint, JointKind, JointTerms, JointVector, Link, MAX_JOINTS, Matrix3, Measurement,
    Number, PARAMETERS_OF_LAST_LINK, PARAMETERS_PER_JOINT, Pairing, Quantity, Real, Row, Vector3,
};

/// A rigid pose: `point_base = rotation · point_tool + translation_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "S: Real + Serialize", deserialize = "S: Real + Deserialize<'de>"))]
pub struct Pose<S> {
    /// Rotation from the tool's axes to the base's.
    pub rotation: Matrix3<S>,
    /// Origin of the tool frame in the base frame, metres.
    pub translation_m: Vector3<S>,
}

/// How far the tool's origin lies from other frames at a pose. Not a number, or infinite, where it cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent<S> {
    /// From the base's origin, metres.
    pub reach_m: S,
    /// From the farthest origin of all links' frames, metres. Each of these positions is rounded on the way to the base, so this is
    /// what the error of the pose grows with; frames of nearly parallel axes may lie half a kilometre from a small robot.
    pub span_m: S,
}

/// A chain made ready for many poses: all that depends on the parameters alone, computed once.
#[derive(Clone, Debug)]
pub struct Kinematics<S> {
    joints: usize,
    links: [LinkGeometry<S>; MAX_JOINTS + 1],
    encoders: [Joint<S>; MAX_JOINTS],
    /// None where they add nothing, so that who has none does not pay for them.
    terms: Option<JointTerms<S>>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkGeometry<S> {
    pub(crate) translation_m: Vector3<S>,
    /// `Rz(alpha) · Ry(beta) · Rx(gamma)`.
    pub(crate) rotation: Matrix3<S>,
    sin_alpha: S,
    cos_alpha: S,
}

/// What a joint does at one pose.
#[derive(Clone, Copy)]
pub(crate) enum Motion<S> {
    Turn { sin: S, cos: S },
    Slide { distance_m: S },
}

impl<S: Number> Kinematics<S> {
    /// Prepares `chain`: the sines, cosines and rotation of every link.
    pub fn new(chain: &Chain<S>) -> Self {
        let mut links = [LinkGeometry::identity(); MAX_JOINTS + 1];
        for (i, geometry) in links.iter_mut().enumerate() {
            if let Some(link) = chain.link(i) {
                *geometry = LinkGeometry::new(link);
            }
        }
        let mut encoders = [Joint { kind: JointKind::Revolute, offset: S::zero(), scale: S::zero() }; MAX_JOINTS];
        for (i, encoder) in encoders.iter_mut().enumerate() {
            if let Some(joint) = chain.joint(i) {
                *encoder = joint;
            }
        }
        Self { joints: chain.joints(), links, encoders, terms: None }
    }

    /// The same with what the joints' terms add to their angles. Where no approach is given, none is known.
    pub fn with_terms(chain: &Chain<S>, terms: &JointTerms<S>) -> Self {
        let mut kinematics = Self::new(chain);
        if !terms.are_zero() {
            kinematics.terms = Some(*terms);
        }
        kinematics
    }

    /// The chain at encoder outputs `q`, approached so: for whoever knows the approach, or asks for more than one thing.
    pub fn configuration<'a>(&'a self, q: &'a JointVector<S>, approach: Approach) -> Configuration<'a, S> {
        Configuration::new(self, q, approach)
    }

    /// Number of the chain's parameters, 8·J + 6.
    pub fn parameter_count(&self) -> usize {
        self.joints * PARAMETERS_PER_JOINT + PARAMETERS_OF_LAST_LINK
    }

    /// Pose of the tool at encoder outputs `q`.
    pub fn base_from_tool(&self, q: &JointVector<S>) -> Pose<S> {
        self.base_from_tool_approached(q, Approach::UNKNOWN)
    }

    /// Pose of the tool at encoder outputs `q` that were approached so.
    pub fn base_from_tool_approached(&self, q: &JointVector<S>, approach: Approach) -> Pose<S> {
        match self.terms {
            None => self.tool_pose(&self.rigid_motions(q)),
            Some(_) => self.displaced_tool_pose(q, approach),
        }
    }

    /// Not inlined, so that the way without terms stays as short as it can be.
    #[inline(never)]
    fn displaced_tool_pose(&self, q: &JointVector<S>, approach: Approach) -> Pose<S> {
        self.tool_pose(&self.motions_approached(q, approach))
    }

    pub(crate) fn tool_pose(&self, motions: &[Motion<S>; MAX_JOINTS]) -> Pose<S> {
        let last = &self.links[self.joints];
        // Two columns of the rotation and the origin travel to the base; the third column is their cross product.
        let mut x_axis: Vector3<S> = last.rotation.column(0).into();
        let mut y_axis: Vector3<S> = last.rotation.column(1).into();
        let mut origin_m = last.translation_m;
        for (link, motion) in self.links[..self.joints].iter().zip(&motions[..self.joints]).rev() {
            x_axis = link.rotation * motion.direction(x_axis);
            y_axis = link.rotation * motion.direction(y_axis);
            origin_m = link.point(motion.point(origin_m));
        }
        Pose { rotation: Matrix3::from_columns(&[x_axis, y_axis, x_axis.cross(&y_axis)]), translation_m: origin_m }
    }

    /// Position in the base frame of a point of the tool, metres.
    pub fn point_in_base(&self, q: &JointVector<S>, point_tool_m: &Vector3<S>) -> Vector3<S> {
        self.sweep_out(&self.motions(q), point_tool_m)
    }

    /// Computed length `d = |T(q)·s − c|`, metres.
    pub fn length(&self, q: &JointVector<S>, pairing: &Pairing<S>) -> S {
        self.configuration(q, Approach::UNKNOWN).length(pairing)
    }

    /// A quantity at a pairing's sphere, metres, and its gradient by the chain's parameters into `row`, in metres per metre, radian or
    /// one (of a length: the paper's eq. 9 with the sign that descends). Entries beyond the chain's parameters are left as they are. What
    /// else it depends on is in the force that is returned.
    #[inline]
    pub fn gradient(&self, quantity: Quantity, q: &JointVector<S>, pairing: &Pairing<S>, row: &mut Row<S>) -> Force<S> {
        match self.terms {
            None => self.gradient_at(&self.rigid_motions(q), quantity, q, pairing, row),
            Some(_) => self.configuration(q, Approach::UNKNOWN).gradient(quantity, pairing, row),
        }
    }

    /// The same where the joints do this.
    pub(crate) fn gradient_at(
        &self,
        motions: &[Motion<S>; MAX_JOINTS],
        quantity: Quantity,
        q: &JointVector<S>,
        pairing: &Pairing<S>,
        row: &mut Row<S>,
    ) -> Force<S> {
        let bar_m = self.sweep_out(motions, &pairing.sphere_tool_m) - pairing.chuck_base_m;
        let (value_m, force_base) = match quantity {
            Quantity::Length => {
                let length_m = bar_m.dot(&bar_m).square_root();
                (length_m, bar_m * length_m.inverse())
            }
            Quantity::X | Quantity::Y | Quantity::Z => {
                let axis = quantity as usize;
                (bar_m[axis], Vector3::ith(axis, S::one()))
            }
        };
        // The force acts at the sphere. Along a bar its line passes through the chuck as well, which is the exact one of the two.
        let at_m = match quantity {
            Quantity::Length => pairing.chuck_base_m,
            Quantity::X | Quantity::Y | Quantity::Z => bar_m + pairing.chuck_base_m,
        };
        let force_tool = self.sweep_wrench(q, motions, force_base, at_m.cross(&force_base), row);
        Force { value_m, base: force_base, tool: force_tool }
    }

    /// Position in the base frame of a point of the tool, metres, and the gradients of its three coordinates into `rows`.
    pub fn position_gradient(&self, q: &JointVector<S>, point_tool_m: &Vector3<S>, rows: &mut [Row<S>; 3]) -> Vector3<S> {
        let from_origin = Pairing { chuck_base_m: Vector3::zeros(), sphere_tool_m: *point_tool_m };
        let mut position_m = Vector3::zeros();
        for ((coordinate, quantity), row) in position_m.iter_mut().zip(Quantity::COORDINATES).zip(rows) {
            *coordinate = self.gradient(quantity, q, &from_origin, row).value_m;
        }
        position_m
    }

    /// Residual `f = d_measured − d_computed`, metres, and the gradient of the computed length into `row`: one row of the equations.
    pub fn residual_row(&self, measurement: &Measurement<S>, row: &mut Row<S>) -> (S, Force<S>) {
        let Measurement { q, joint_terms, pairing, length_m, .. } = measurement;
        let force = if joint_terms.are_zero() {
            self.gradient_at(&self.rigid_motions(q), Quantity::Length, q, pairing, row)
        } else {
            Configuration::displaced(self, q, joint_terms).gradient(Quantity::Length, pairing, row)
        };
        (*length_m - force.value_m, force)
    }

    /// Residual `f = d_measured − d_computed`, metres.
    pub fn residual(&self, measurement: &Measurement<S>) -> S {
        measurement.length_m
            - Configuration::displaced(self, &measurement.q, &measurement.joint_terms).length(&measurement.pairing)
    }

    pub(crate) fn joints(&self) -> usize {
        self.joints
    }

    pub(crate) fn joint_kind(&self, i: usize) -> JointKind {
        self.encoders[i].kind
    }

    pub(crate) fn links(&self) -> &[LinkGeometry<S>; MAX_JOINTS + 1] {
        &self.links
    }

    fn motions(&self, q: &JointVector<S>) -> [Motion<S>; MAX_JOINTS] {
        self.motions_approached(q, Approach::UNKNOWN)
    }

    /// What the joints do at `q`, when they came from these sides. An arm without terms pays for no more than one comparison.
    pub(crate) fn motions_approached(&self, q: &JointVector<S>, approach: Approach) -> [Motion<S>; MAX_JOINTS] {
        match &self.terms {
            None => self.rigid_motions(q),
            Some(terms) => self.motions_with_terms(terms, q, approach),
        }
    }

    #[cold]
    #[inline(never)]
    fn motions_with_terms(&self, terms: &JointTerms<S>, q: &JointVector<S>, approach: Approach) -> [Motion<S>; MAX_JOINTS] {
        self.displaced_motions(q, &terms.displacements(q, &terms.loads(self, q), approach))
    }

    /// What the joints do at `θ = offset + scale · q`.
    pub(crate) fn rigid_motions(&self, q: &JointVector<S>) -> [Motion<S>; MAX_JOINTS] {
        self.motions_of(&self.encoders, q)
    }

    /// What the joints do at `θ = offset + scale · q + displacement`: a change of the offsets, so that an arm without any does not pay for
    /// an addition more.
    pub(crate) fn displaced_motions(&self, q: &JointVector<S>, displacements: &JointVector<S>) -> [Motion<S>; MAX_JOINTS] {
        let mut encoders = self.encoders;
        for (encoder, &displacement) in encoders.iter_mut().zip(&displacements.0) {
            encoder.offset += displacement;
        }
        self.motions_of(&encoders, q)
    }

    fn motions_of(&self, encoders: &[Joint<S>; MAX_JOINTS], q: &JointVector<S>) -> [Motion<S>; MAX_JOINTS] {
        let mut motions = [Motion::Slide { distance_m: S::zero() }; MAX_JOINTS];
        for ((motion, encoder), q) in motions.iter_mut().zip(&encoders[..self.joints]).zip(&q.0) {
            *motion = Motion::new(encoder, *q);
        }
        motions
    }

    pub(crate) fn sweep_out(&self, motions: &[Motion<S>; MAX_JOINTS], point_tool_m: &Vector3<S>) -> Vector3<S> {
        let mut point_m = self.links[self.joints].point(*point_tool_m);
        for (link, motion) in self.links[..self.joints].iter().zip(&motions[..self.joints]).rev() {
            point_m = link.point(motion.point(point_m));
        }
        point_m
    }

    /// Pushes a wrench from the base down the chain. In each frame on its way the wrench's components are the columns:
    /// a translation's column is the force, a rotation's its moment about that rotation's axis, an offset's the z moment
    /// (revolute) or z force (prismatic), and the scale's is `q` times the offset's. The force as the tool frame has it is returned.
    pub(crate) fn sweep_wrench(
        &self,
        q: &JointVector<S>,
        motions: &[Motion<S>; MAX_JOINTS],
        mut force: Vector3<S>,
        mut moment: Vector3<S>,
        row: &mut Row<S>,
    ) -> Vector3<S> {
        // Whole arrays, so that no entry's place has to be looked at; the longest chain's last link stands behind them.
        let (of_joints, of_longest) = row.as_chunks_mut::<PARAMETERS_PER_JOINT>();
        let before_joints = self.links.iter().zip(motions).zip(&q.0).take(self.joints);
        for (columns, ((link, motion), &q)) in of_joints.iter_mut().zip(before_joints) {
            let [x, y, z, alpha, beta, gamma] = link.push_wrench(&mut force, &mut moment);
            let offset = match motion {
                Motion::Turn { .. } => moment.z,
                Motion::Slide { .. } => force.z,
            };
            *columns = [x, y, z, alpha, beta, gamma, offset, offset * q];
            motion.push_wrench(&mut force, &mut moment);
        }
        let columns = self.links[self.joints].push_wrench(&mut force, &mut moment);
        let last = of_joints.get_mut(self.joints).map_or(of_longest, |of_joint| &mut of_joint[..PARAMETERS_OF_LAST_LINK]);
        last.copy_from_slice(&columns);
        force
    }
}

impl<S: Real> Kinematics<S> {
    /// How far the tool's origin lies from the base and from the frames between, at encoder outputs `q`.
    pub fn extent(&self, q: &JointVector<S>) -> Extent<S> {
        let motions = self.motions(q);
        let mut origin_m = self.links[self.joints].translation_m;
        let mut span_m = origin_m.norm();
        for (link, motion) in self.links[..self.joints].iter().zip(&motions[..self.joints]).rev() {
            origin_m = link.point(motion.point(origin_m));
            span_m = span_m.max(origin_m.norm());
        }
        Extent { reach_m: origin_m.norm(), span_m }
    }
}

impl<S: Number> LinkGeometry<S> {
    fn new(link: Link<S>) -> Self {
        let (sa, ca) = link.alpha_rad.sine_cosine();
        let (sb, cb) = link.beta_rad.sine_cosine();
        let (sg, cg) = link.gamma_rad.sine_cosine();
        let rotation = Matrix3::new(
            ca * cb,
            ca * sb * sg - sa * cg,
            ca * sb * cg + sa * sg, //
            sa * cb,
            sa * sb * sg + ca * cg,
            sa * sb * cg - ca * sg, //
            -sb,
            cb * sg,
            cb * cg,
        );
        Self { translation_m: link.translation_m, rotation, sin_alpha: sa, cos_alpha: ca }
    }

    fn identity() -> Self {
        Self { translation_m: Vector3::zeros(), rotation: Matrix3::identity(), sin_alpha: S::zero(), cos_alpha: S::one() }
    }

    /// A point of the distal frame in the proximal one.
    fn point(&self, point_m: Vector3<S>) -> Vector3<S> {
        self.rotation * point_m + self.translation_m
    }

    /// Turns a wrench from the proximal frame into the distal one; the columns of the link's `x y z alpha beta gamma`.
    fn push_wrench(&self, force: &mut Vector3<S>, moment: &mut Vector3<S>) -> [S; PARAMETERS_OF_LAST_LINK] {
        let [x, y, z] = [force.x, force.y, force.z];
        *moment -= self.translation_m.cross(force);
        let alpha = moment.z;
        // The axis of beta is y turned by alpha; that of gamma is the x axis that the whole rotation leaves behind.
        let beta = self.cos_alpha * moment.y - self.sin_alpha * moment.x;
        *force = self.rotation.tr_mul(force);
        *moment = self.rotation.tr_mul(moment);
        [x, y, z, alpha, beta, moment.x]
    }
}

impl<S: Number> Motion<S> {
    /// What a joint does at encoder output `q`.
    fn new(joint: &Joint<S>, q: S) -> Self {
        let theta = joint.offset + joint.scale * q;
        match joint.kind {
            JointKind::Revolute => {
                let (sin, cos) = theta.sine_cosine();
                Self::Turn { sin, cos }
            }
            JointKind::Prismatic => Self::Slide { distance_m: theta },
        }
    }

    /// A direction behind the joint, seen from before it.
    fn direction(&self, v: Vector3<S>) -> Vector3<S> {
        match *self {
            Self::Turn { sin, cos } => Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z),
            Self::Slide { .. } => v,
        }
    }

    /// A point behind the joint, seen from before it.
    fn point(&self, p: Vector3<S>) -> Vector3<S> {
        match *self {
            Self::Turn { .. } => self.direction(p),
            Self::Slide { distance_m } => Vector3::new(p.x, p.y, p.z + distance_m),
        }
    }

    /// A direction before the joint, seen from behind it.
    pub(crate) fn direction_behind(&self, v: Vector3<S>) -> Vector3<S> {
        match *self {
            Self::Turn { sin, cos } => Self::Turn { sin: -sin, cos }.direction(v),
            Self::Slide { .. } => v,
        }
    }

    /// A first moment of mass (kg m) behind the joint, seen from before it.
    pub(crate) fn moved_moment(&self, first_kg_m: Vector3<S>, mass_kg: S) -> Vector3<S> {
        match *self {
            Self::Turn { .. } => self.direction(first_kg_m),
            Self::Slide { distance_m } => Vector3::new(first_kg_m.x, first_kg_m.y, first_kg_m.z + distance_m * mass_kg),
        }
    }

    /// Turns a wrench from the frame before the joint into the one behind it.
    fn push_wrench(&self, force: &mut Vector3<S>, moment: &mut Vector3<S>) {
        match *self {
            Self::Turn { sin, cos } => {
                let back = Self::Turn { sin: -sin, cos };
                *force = back.direction(*force);
                *moment = back.direction(*moment);
            }
            Self::Slide { distance_m } => {
                moment.x += distance_m * force.y;
                moment.y -= distance_m * force.x;
            }
        }
    }
}

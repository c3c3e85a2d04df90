//! The same robot written otherwise, and robots at random to do it with.

use std::f64::consts::{FRAC_PI_2, PI};

use ballbar::{Chain, JointKind, PARAMETERS_PER_JOINT};
use ballbar_calib::kinematics::link_angles;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

type V = Vector3<f64>;

fn about_z(angle: f64) -> Isometry3<f64> {
    Isometry3::rotation(V::z() * angle)
}

fn transform(p: &[f64]) -> Isometry3<f64> {
    let turn = |axis: V, angle: f64| UnitQuaternion::new(axis * angle);
    Isometry3::from_parts(Translation3::new(p[0], p[1], p[2]), turn(V::z(), p[3]) * turn(V::y(), p[4]) * turn(V::x(), p[5]))
}

/// The chain with every frame slid along its axis by up to `slide_m` (a prismatic joint's across it, too) and turned about it by any
/// angle, the turn made up for by the joint's offset and the next link in a random ratio; angles in either way of writing a rotation.
pub fn rewritten(chain: &Chain<f64>, slide_m: f64, rng: &mut ChaCha8Rng) -> Chain<f64> {
    let mut written = chain.clone();
    let kinds = chain.joint_kinds().to_vec();
    let mut back = Isometry3::identity();
    for (i, p) in written.parameters_mut().chunks_mut(PARAMETERS_PER_JOINT).enumerate() {
        let mut link = back * transform(p);
        if let Some(kind) = kinds.get(i) {
            let mut slide = || rng.random_range(-slide_m..=slide_m);
            let along = V::new(0.0, 0.0, slide());
            let across = if *kind == JointKind::Prismatic { V::new(slide(), slide(), 0.0) } else { V::zeros() };
            let shift = Isometry3::from_parts(Translation3::from(along + across), UnitQuaternion::identity());
            let moved = shift * about_z(rng.random_range(-PI..=PI));
            link *= moved;
            // What the offset takes over is taken back behind the joint, along or about the same axis.
            let taken = match kind {
                JointKind::Revolute => rng.random_range(-PI..=PI),
                JointKind::Prismatic => rng.random_range(-slide_m..=slide_m),
            };
            p[6] += taken;
            let offset = match kind {
                JointKind::Revolute => about_z(taken),
                JointKind::Prismatic => Isometry3::translation(0.0, 0.0, taken),
            };
            back = (moved * offset).inverse();
        }
        // Those of nalgebra lose half of their digits where beta is a right angle.
        let [alpha, beta, gamma] = link_angles(link.rotation.to_rotation_matrix().matrix());
        let angles = if rng.random() { [alpha, beta, gamma] } else { [alpha + PI, PI - beta, gamma - PI] };
        p[..3].copy_from_slice(link.translation.vector.as_slice());
        p[3..6].copy_from_slice(&angles);
    }
    written
}

/// A chain whose axes are at random, parallel, antiparallel, at right angles, crossing, prismatic.
pub fn random_chain(joints: usize, rng: &mut ChaCha8Rng) -> Chain<f64> {
    let kind = |rng: &mut ChaCha8Rng| if rng.random_bool(0.2) { JointKind::Prismatic } else { JointKind::Revolute };
    let kinds: Vec<_> = (0..joints).map(|_| kind(rng)).collect();
    let mut parameters = Vec::new();
    for joint in 0..=joints {
        let crosses = rng.random_bool(0.3);
        let mut length = || if crosses { 0.0 } else { rng.random_range(-0.4..0.4) };
        parameters.extend([length(), length(), length()]);
        let any = rng.random_range(-PI..PI);
        // The tool's beta is whatever the tool is: not at a right angle, where its alpha and gamma fall together.
        let beta =
            if joint == joints { rng.random_range(-1.2..1.2) } else { [0.0, 0.001, FRAC_PI_2, any][rng.random_range(0..4)] };
        let gamma = [0.0, PI, FRAC_PI_2, -FRAC_PI_2, rng.random_range(-0.01..0.01), any][rng.random_range(0..6)];
        parameters.extend([[0.0, FRAC_PI_2, any][rng.random_range(0..3)], beta, gamma]);
        if joint < joints {
            let side = if rng.random() { 1.0 } else { -1.0 };
            parameters.extend([rng.random_range(-0.5..0.5), side * rng.random_range(0.99..1.01)]);
        }
    }
    Chain::new(&kinds, &parameters).expect("a chain")
}

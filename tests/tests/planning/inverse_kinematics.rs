//! Inverse kinematics: every branch leads to the pose, and none is missed.

use std::f64::consts::TAU;

use ballbar::{Chain, JointKind, JointVector, Pose};
use ballbar_calib::kinematics::{InverseKinematics, Thoroughness};
use ballbar_calib::plan::{Cell, Margins, Pace};
use ballbar_tests::solids::base_from_tool;
use host_cal::files::{ROBOTS, open_rig, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Largest difference of a joint, whole turns apart counting as none.
fn apart(chain: &Chain<f64>, a: &JointVector<f64>, b: &JointVector<f64>) -> f64 {
    let difference = |i: usize| {
        let (joint, off) = (chain.joint(i).unwrap(), a.as_array()[i] - b.as_array()[i]);
        match joint.kind {
            JointKind::Revolute => {
                let turn = TAU / joint.scale.abs();
                off.rem_euclid(turn).min(turn - off.rem_euclid(turn))
            }
            JointKind::Prismatic => off.abs(),
        }
    };
    (0..chain.joints()).map(difference).fold(0.0, f64::max)
}

#[test]
fn every_branch_reproduces_the_pose_and_the_one_that_made_it_is_among_them() {
    const POSES: usize = 60;
    /// Nearer to a singularity two branches are one.
    const SINGULAR: f64 = 0.01;
    let rig = open_rig("triangles").unwrap();
    for (name, _) in ROBOTS {
        let robot = open_robot(name).unwrap();
        let inverse = InverseKinematics::new(&robot);
        let cell = Cell::new(&robot, &rig, 0.075, Margins::default(), Pace::default()).unwrap();
        let (mut rng, mut asked, mut missed) = (ChaCha8Rng::seed_from_u64(5), 0, 0);
        let poses = if inverse.is_closed_form() { 20 * POSES } else { POSES };
        for _ in 0..poses {
            let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
            let wanted = base_from_tool(&robot.chain, &q);
            let pose =
                Pose { rotation: wanted.fixed_view::<3, 3>(0, 0).into(), translation_m: wanted.fixed_view::<3, 1>(0, 3).into() };
            let branches = inverse.branches(&pose, Thoroughness::ALL, &mut rng);
            for branch in &branches.within_limits {
                let reached = base_from_tool(&robot.chain, &branch.as_array()[..q.len()]);
                assert!((reached - wanted).norm() < 1e-8, "{name}: off by {:e}", (reached - wanted).norm());
                assert!(robot.limits.iter().zip(branch.as_array()).all(|(limits, &q)| limits.contain(q)), "{name}");
            }
            let q = robot.chain.joint_vector(&q).unwrap();
            if robot.chain.joints() == 6 && cell.singularity(&cell.posture(&q)) < SINGULAR {
                continue;
            }
            asked += 1;
            missed += usize::from(branches.within_limits.iter().all(|branch| apart(&robot.chain, branch, &q) > 1e-5));
        }
        assert!(asked > poses / 2, "{name}: {asked}");
        let most = if inverse.is_closed_form() { 0 } else { POSES / 30 };
        assert!(missed <= most, "{name}: {missed} of {asked} poses without the branch that made them");
    }
}

#[test]
fn the_closed_form_has_the_branches_that_a_search_finds() {
    for name in ["puma560", "irb120"] {
        let robot = open_robot(name).unwrap();
        let inverse = InverseKinematics::new(&robot);
        assert!(inverse.is_closed_form(), "{name}");
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        for _ in 0..200 {
            let pose = inverse.skeleton().at(&inverse.random_start(&mut rng)).base_from_tool;
            let closed = inverse.branches(&pose, Thoroughness::ALL, &mut rng).within_limits;
            for found in inverse.numeric_branches(&pose, Thoroughness::ALL, &mut rng).within_limits {
                let nearest = closed.iter().map(|branch| apart(&robot.chain, branch, &found)).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-5, "{name}: {nearest}");
            }
        }
    }
}

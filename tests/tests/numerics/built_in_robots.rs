//! The built-in robots: which kinds of arm they are, that what walks their links agrees with the chain, and how far a plan takes them to
//! be off.

use ballbar::{Kinematics, Vector3};
use ballbar_calib::kinematics::{Opw, Skeleton};
use ballbar_calib::model::PairingId;
use ballbar_calib::plan::{Cell, Margins, Pace, RESERVED_DEVIATIONS};
use host_cal::files::{ROBOTS, open_rig, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn arms_with_a_closed_form_are_recognised_and_no_others() {
    let is_opw = |name| Opw::recognise(&Skeleton::new(&open_robot(name).unwrap().chain)).is_some();
    assert!(is_opw("puma560") && is_opw("irb120"));
    assert!(!is_opw("puma560-optimised"), "its axes do not quite meet");
    assert!(!is_opw("ur5e") && !is_opw("stanford") && !is_opw("scara"));
}

#[test]
fn the_skeleton_ends_where_the_kinematics_says() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (name, _) in ROBOTS {
        let robot = open_robot(name).unwrap();
        let (skeleton, kinematics) = (Skeleton::new(&robot.chain), Kinematics::new(&robot.chain));
        for _ in 0..50 {
            let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
            let q = robot.chain.joint_vector(&q).unwrap();
            let (ours, theirs) = (skeleton.at(&q).base_from_tool, kinematics.base_from_tool(&q));
            assert!((ours.translation_m - theirs.translation_m).norm() < 1e-12, "{name}");
            assert!((ours.rotation - theirs.rotation).norm() < 1e-12, "{name}");
        }
    }
}

#[test]
fn columns_are_derivatives() {
    const STEP: f64 = 1e-6;
    let robot = open_robot("stanford").unwrap();
    let skeleton = Skeleton::new(&robot.chain);
    let q = robot.chain.joint_vector(&[0.3, -0.5, 0.7, 1.0, 0.4, -0.2]).unwrap();
    let point_tool_m = Vector3::new(0.03, -0.05, 0.08);
    let posture = skeleton.at(&q);
    let point_m = posture.point_in_base(&point_tool_m);
    for (i, axis) in posture.axes().iter().enumerate() {
        let mut stepped = q;
        stepped.as_array_mut()[i] += STEP;
        let moved_m = skeleton.at(&stepped).point_in_base(&point_tool_m);
        assert!(((moved_m - point_m) / STEP - axis.point_column(&point_m)).norm() < 1e-5, "joint {}", i + 1);
    }
}

#[test]
fn plausible_robots_are_off_as_far_as_linear_theory_says() {
    const ROBOTS: usize = 2000;
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let cell = Cell::new(&robot, &rig, 0.075, Margins::default(), Pace::default()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..5 {
        let q = cell.inverse.random_start(&mut rng);
        let pairing = rig.pairing(PairingId { chuck: 0, sphere: 1 });
        let (length_m, reserve_m) = cell.length(&q, &pairing);
        let off = |_| Kinematics::new(&cell.plausible_robot(&mut rng)).length(&q, &pairing) - length_m;
        let offs: Vec<f64> = (0..ROBOTS).map(off).collect();
        let deviation_m = (offs.iter().map(|off| off * off).sum::<f64>() / ROBOTS as f64).sqrt();
        let expected_m = reserve_m / RESERVED_DEVIATIONS;
        assert!((deviation_m / expected_m - 1.0).abs() < 0.06, "{deviation_m} {expected_m}");
    }
}

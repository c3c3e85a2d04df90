//! The same robot in other frames is planned alike.

use std::f64::consts::FRAC_PI_2;

use ballbar::{Kinematics, PARAMETERS_PER_JOINT, Vector3};
use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Cell, CheckedPlan, Plan, PlanOptions, PlanRow, RowKind, plan};
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::frames::rewritten;
use ballbar_tests::plans::{options, planned, plausible_robot};
use host_cal::files::{ROBOTS, open_rig, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Poses to measure, and the least of each margin: travel, clearance, singularity.
fn in_short(plan: &Plan) -> (usize, [f64; 3]) {
    let mut least = [f64::INFINITY; 3];
    for row in &plan.rows {
        let margins = row.margins.as_ref().expect("margins of a planned row");
        let here = [margins.travel_m.unwrap_or(f64::INFINITY), margins.clearance_m, margins.singularity];
        least.iter_mut().zip(here).for_each(|(least, here)| *least = least.min(here));
    }
    (plan.rows.iter().filter(|row| row.kind == RowKind::Measure).count(), least)
}

/// Whether a robot may go where a plan leads.
fn is_safe(robot: &Robot, rig: &Rig, options: &PlanOptions, rows: &[PlanRow]) -> bool {
    let cell = Cell::new(robot, rig, options.travel_m, options.margins, options.pace).unwrap();
    CheckedPlan::new(&cell, rows).is_ok()
}

fn is_planned_alike(one: &Robot, other: &Robot, rig: &Rig, options: &PlanOptions) {
    are_alike([one, other], [one, other].map(|robot| planned(robot, rig, options)), rig, options);
}

fn are_alike([one, other]: [&Robot; 2], plans: [Plan; 2], rig: &Rig, options: &PlanOptions) {
    const SAME_M: f64 = 1e-6;
    let [(poses, least), (other_poses, other_least)] = plans.each_ref().map(in_short);
    assert!(poses > 0 && poses == other_poses, "{}: {poses} and {other_poses}", one.name);
    for (least, other_least) in least.iter().zip(other_least) {
        assert!((least - other_least).abs() < SAME_M, "{}: {least} and {other_least}", one.name);
    }
    let verdicts = plans.each_ref().map(|plan| [one, other].map(|robot| is_safe(robot, rig, options, &plan.rows)));
    assert_eq!(verdicts, [[true; 2]; 2], "{}", one.name);
}

#[test]
fn a_robot_in_far_and_turned_frames_is_planned_as_it_is_in_its_own() {
    const SLIDE_M: f64 = 100.0;
    let rig = open_rig("triangles").unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for (name, _) in ROBOTS.iter().cycle().take(at_length(ROBOTS.len())) {
        // With axes that are exactly parallel or crossing, and with such as only nearly are.
        let design = open_robot(name).unwrap();
        let built = Robot { chain: plausible_robot(&design.chain, &mut rng), ..design.clone() };
        for (robot, pairing) in [(design, ("A", "1")), (built, ("B", "2"))] {
            let other = Robot { chain: rewritten(&robot.chain, SLIDE_M, &mut rng), ..robot.clone() };
            is_planned_alike(&robot, &other, &rig, &options(&rig, &[pairing], &[0.46], 6));
        }
    }
}

/// A robot like a built-in one, with other lengths and other twists: axes that are exactly or nearly parallel, cross, or slide, and some of
/// which are neither. Few arms that are wholly at random reach a rig.
fn like(design: &Robot, rng: &mut ChaCha8Rng) -> Robot {
    let mut chain = design.chain.clone();
    let joints = chain.joints();
    for (i, link) in chain.parameters_mut().chunks_mut(PARAMETERS_PER_JOINT).enumerate() {
        for length in &mut link[..3] {
            // Axes that cross may do so no more, and those that do not may.
            let is_other = rng.random_bool(0.15);
            *length = match (*length == 0.0, is_other) {
                (true, true) => rng.random_range(-0.05..0.05),
                (false, true) if length.abs() < 0.1 => 0.0,
                _ => *length * rng.random_range(0.85..1.15),
            };
        }
        for angle in &mut link[3..6] {
            *angle += match rng.random_range(0..8) {
                0 => rng.random_range(-0.3..0.3),
                1 | 2 => rng.random_range(-0.01..0.01),
                3 if i < joints => [FRAC_PI_2, -FRAC_PI_2][rng.random_range(0..2)],
                _ => 0.0,
            };
        }
    }
    Robot { chain, ..design.clone() }
}

/// A rig with a shell about a place that the robot's tool comes to.
fn within_reach(robot: &Robot, rng: &mut ChaCha8Rng) -> Rig {
    let mut rig = open_rig("triangles").unwrap();
    let kinematics = Kinematics::new(&robot.chain);
    let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
    let tool = kinematics.base_from_tool(&robot.chain.joint_vector(&q).unwrap());
    let sphere_m = tool.rotation * rig.spheres[0].position_m + tool.translation_m;
    let away_m = sphere_m - Vector3::new(0.0, 0.0, 0.4) - rig.chucks[0].position_m;
    rig.chucks.iter_mut().for_each(|chuck| chuck.position_m += away_m);
    rig
}

#[test]
fn any_robot_in_far_and_turned_frames_is_planned_as_it_is_in_its_own() {
    let mut rng = ChaCha8Rng::seed_from_u64(53);
    let (wanted, mut found, mut tried) = (at_length(6), 0, 0);
    while found < wanted {
        let (name, _) = ROBOTS[tried % ROBOTS.len()];
        tried += 1;
        assert!(tried < 20 * wanted, "{found} of {tried} robots reach a rig");
        let robot = like(&open_robot(name).unwrap(), &mut rng);
        let rig = within_reach(&robot, &mut rng);
        let other = Robot { chain: rewritten(&robot.chain, 100.0, &mut rng), ..robot.clone() };
        let options = options(&rig, &[("A", "1")], &[0.46], 6);
        match [&robot, &other].map(|robot| plan(robot, &rig, &options, &|_| ())) {
            [Ok(one), Ok(far)] => {
                are_alike([&robot, &other], [one, far], &rig, &options);
                found += 1;
            }
            [Err(one), Err(other)] => assert_eq!(one.to_string(), other.to_string(), "{name}"),
            [one, other] => panic!("{name}: {:?} and {:?}", one.map(|_| ()), other.map(|_| ())),
        }
    }
    println!("{found} of {tried} robots reach a rig");
}

#[test]
fn a_ur5_by_its_own_table_is_planned_as_it_is_in_near_frames() {
    let Some(folder) = real_data("cases/far_frames") else { return };
    let [near, far] = ["near.toml", "far2.toml"].map(|name| open_robot(folder.join(name).to_str().unwrap()).unwrap());
    let rig = open_rig("triangles").unwrap();
    is_planned_alike(&near, &far, &rig, &options(&rig, &[("A", "1"), ("B", "2"), ("C", "3")], &[0.46], 9));
}

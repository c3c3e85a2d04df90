//! The same robot in other frames is planned alike.

use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Cell, CheckedPlan, Plan, PlanOptions, PlanRow, RowKind};
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::frames::rewritten;
use ballbar_tests::plans::{options, planned, plausible_robot};
use host_cal::files::{ROBOTS, open_rig, open_robot};
use rand::SeedableRng;
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
    const SAME_M: f64 = 1e-6;
    let plans = [one, other].map(|robot| planned(robot, rig, options));
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

#[test]
fn a_ur5_by_its_own_table_is_planned_as_it_is_in_near_frames() {
    let Some(folder) = real_data("cases/far_frames") else { return };
    let [near, far] = ["near.toml", "far2.toml"].map(|name| open_robot(folder.join(name).to_str().unwrap()).unwrap());
    let rig = open_rig("triangles").unwrap();
    is_planned_alike(&near, &far, &rig, &options(&rig, &[("A", "1"), ("B", "2"), ("C", "3")], &[0.46], 9));
}

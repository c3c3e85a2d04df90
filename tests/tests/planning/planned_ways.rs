//! What a plan's ways keep away from: by an independent scene, in a thousand robots that are not nominal, in fitted and in imported ones.

use std::collections::HashMap;
use std::path::Path;

use ballbar::{JointKind, Kinematics};
use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::{Rig, Robot};
use ballbar_calib::plan::{Cell, CheckedPlan, Margins, Pace, PlanOptions, PlanRow, RowKind, Swing, UnsafePlan};
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::plans::{fitted, least_by_naive_cell, options, planned, plausible_robot};
use ballbar_tests::solids::NaiveCell;
use ballbar_tests::workbench::{self, Workbench};
use host_cal::files::{ROBOTS, UrdfEnds, open_rig, open_robot, read_poses, read_urdf};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Plans for robots of all kinds keep every margin, by solids and lengths that share no code with the planner.
fn keeps_margins(name: &str, pairings: &[(&str, &str)], bars_m: &[f64], poses_per_shell: usize) {
    const STEP: f64 = 0.02;
    const ROBOTS: usize = 1000;
    let robots = at_length(ROBOTS);
    let (robot, rig) = (open_robot(name).unwrap(), open_rig("triangles").unwrap());
    let options = options(&rig, pairings, bars_m, poses_per_shell);
    let margins = options.margins;
    let plan = planned(&robot, &rig, &options);
    assert!(
        plan.shells.iter().all(|shell| shell.measured > poses_per_shell / 3 && shell.is_approach_clear),
        "{name}: {:?}",
        plan.shells
    );
    let measured = plan.rows.iter().filter(|row| row.kind == RowKind::Measure).count();
    assert_eq!(measured, plan.shells.iter().map(|shell| shell.measured).sum::<usize>());

    let ((gap_m, between), travel_m) = least_by_naive_cell(&robot, &rig, &plan.rows, STEP);
    assert!(gap_m >= margins.clearance_m - 1e-5, "{name}: {gap_m} m, {between}");
    assert!(travel_m >= margins.travel_m, "{name}: {travel_m} m of travel");
    for row in &plan.rows {
        for ((limits, kind), &q) in robot.limits.iter().zip(robot.chain.joint_kinds()).zip(row.q.as_array()) {
            let margin = if *kind == JointKind::Revolute { margins.limit_rad } else { margins.limit_m };
            assert!(q >= limits.min + margin - 1e-12 && q <= limits.max - margin + 1e-12, "{name}: {q}");
        }
    }

    // Every row with the bar on, and a place on the way to it, in a thousand robots that are not nominal.
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let mut least_m = f64::INFINITY;
    for _ in 0..robots {
        let kinematics = Kinematics::new(&plausible_robot(&robot.chain, &mut rng));
        for (i, row) in plan.rows.iter().enumerate().filter(|(_, row)| row.bar.is_some()) {
            let mut between = row.q;
            if let Some(before) = i
                .checked_sub(1)
                .map(|i| &plan.rows[i])
                .filter(|before| before.bar.is_some() && before.pairing == row.pairing && before.bar_m == row.bar_m)
            {
                let share = rng.random_range(0.0..1.0);
                between.as_array_mut().iter_mut().zip(before.q.as_array()).for_each(|(q, before)| *q += share * (before - *q));
            }
            for q in [row.q, between] {
                let length_m = kinematics.length(&q, &rig.pairing(row.pairing));
                least_m = least_m.min(0.0375 - (length_m - row.bar_m).abs());
            }
        }
    }
    assert!(least_m >= margins.travel_m, "{name}: {least_m} m of travel in the worst of {robots} robots");
}

#[test]
fn a_plan_of_a_puma_keeps_its_margins() {
    keeps_margins("puma560", &[("A", "1"), ("B", "3"), ("C", "2")], &[0.46, 0.61], 15);
}

#[test]
fn a_plan_of_an_arm_with_another_wrist_keeps_its_margins() {
    keeps_margins("irb120", &[("A", "2"), ("B", "1")], &[0.46], 9);
}

#[test]
fn a_plan_without_a_closed_form_keeps_its_margins() {
    keeps_margins("ur5e", &[("B", "2")], &[0.46], 5);
}

#[test]
fn a_plan_with_a_slide_keeps_its_margins() {
    keeps_margins("stanford", &[("A", "1"), ("C", "3")], &[0.46], 9);
}

#[test]
fn a_plan_of_four_joints_keeps_its_margins() {
    keeps_margins("scara", &[("A", "1"), ("A", "3")], &[0.46], 9);
}

#[test]
fn a_plan_without_its_via_points_keeps_no_margins() {
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let mut rows = planned(&robot, &rig, &options(&rig, &[("A", "1")], &[0.46], 9)).rows;
    rows.retain(|row| row.kind == RowKind::Measure);
    let ((gap_m, _), travel_m) = least_by_naive_cell(&robot, &rig, &rows, 0.02);
    assert!(gap_m < 0.0 || travel_m < 0.0, "{gap_m} m, {travel_m} m: the test cannot fail");
}

/// Plans a robot's way, looks at it in the independent scene, and counts what it measures.
fn measured_clear_of_all(robot: &Robot, rig: &Rig, options: &PlanOptions) -> usize {
    let plan = planned(robot, rig, options);
    let ((gap_m, between), travel_m) = least_by_naive_cell(robot, rig, &plan.rows, 0.02);
    assert!(gap_m >= options.margins.clearance_m - 2e-5, "{}: {gap_m} m, {between}", robot.name);
    assert!(travel_m >= options.margins.travel_m, "{}: {travel_m} m of travel", robot.name);
    plan.shells.iter().map(|shell| shell.measured).sum()
}

#[test]
fn a_fitted_robot_is_planned_with_as_many_poses_as_its_design() {
    let rig = open_rig("triangles").unwrap();
    for (name, _) in ROBOTS {
        let design = open_robot(name).unwrap();
        let options = options(&rig, &[("B", "2"), ("A", "1")], &[0.46], 18);
        let before = measured_clear_of_all(&design, &rig, &options);
        let after = measured_clear_of_all(&fitted(&design, &rig, 5), &rig, &options);
        // One point in thirty hangs on the last digits: from which of its postures a shell's family grows.
        assert!(after + 1 >= before, "{name}: {after} of {before}");
    }
}

#[test]
fn imported_robots_and_what_is_fitted_to_them_are_planned() {
    let near = open_rig("triangles").unwrap();
    let far = {
        let mut rig = near.clone();
        rig.chucks.iter_mut().for_each(|chuck| chuck.position_m.x += 0.6);
        rig
    };
    for (urdf, tip, rig) in [("cobot", "tool0", &near), ("seven_axes", "ee", &near), ("palletiser", "tool0", &far)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("urdf/{urdf}.urdf"));
        let design = read_urdf(&path, UrdfEnds { tip: Some(tip), ..UrdfEnds::default() }).unwrap().robot;
        let options = options(rig, &[("A", "1"), ("C", "3")], &[0.46], 12);
        let before = measured_clear_of_all(&design, rig, &options);
        let after = measured_clear_of_all(&fitted(&design, rig, 2), rig, &options);
        assert!(before == 24 && after >= before, "{urdf}: {after} of {before}");
    }
}

#[test]
fn robots_fitted_to_real_lengths_are_planned() {
    let Some(mukca) = real_data("mukca") else { return };
    let rig = open_rig("triangles").unwrap();
    for (name, place) in [("panda_2", "front_left"), ("panda_6", "front"), ("kuka_14", "front")] {
        let file = |name: String| mukca.join(name).display().to_string();
        let design = open_robot(&file(format!("{name}/robot.toml"))).unwrap();
        let of_poses = open_rig(&file(format!("{name}/rig_{place}.toml"))).unwrap();
        let poses = read_poses([Path::new(&file(format!("{name}/poses_{place}.csv")))], &design, &of_poses).unwrap();
        let mut robot = design.clone();
        robot.chain = fit(&design, &poses, &FitOptions::default()).unwrap().solution.chain;
        let options = options(&rig, &[("A", "1"), ("B", "2")], &[0.46], 12);
        let before = measured_clear_of_all(&design, &rig, &options);
        let after = measured_clear_of_all(&robot, &rig, &options);
        assert!(before == 24 && after >= before, "{name}: {after} of {before}");
    }
}

#[test]
fn an_offset_of_a_quarter_of_a_millimetre_makes_no_link() {
    let (design, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let options = options(&rig, &[("A", "1")], &[0.46], 6);
    let poses = |robot: &Robot| planned(robot, &rig, &options).shells[0].measured;
    let before = poses(&design);
    for (link, by_m) in
        [(0, [0.0, 0.24e-3, 0.0]), (6, [2e-6, 0.0, 0.0]), (6, [0.24e-3, 0.0, 0.0]), (5, [0.0, 0.0, 1e-6]), (6, [0.0, 4e-3, 0.0])]
    {
        let mut robot = design.clone();
        for (axis, by_m) in by_m.into_iter().enumerate() {
            robot.chain.parameters_mut()[link * ballbar::PARAMETERS_PER_JOINT + axis] += by_m;
        }
        assert_eq!(poses(&robot), before, "link {} by {by_m:?}", link + 1);
    }
}

#[test]
fn a_gap_that_motion_cannot_change_blocks_no_path() {
    let robot = open_robot("puma560").unwrap();
    let bench = Workbench::new();
    // A PUMA's third link passes its first 149.09 mm off, in every posture; a bar's end is 35 mm before its own plate.
    let cases = [("links", "link_radius_mm = 69.0"), ("plate", "sphere_plate_behind_mm = 26.0"), ("bar", "bar_radius_mm = 24.0")];
    for (name, size) in cases {
        let file = format!("{name}.toml");
        bench.put(&file, format!("{}\n[solids]\n{size}\n", workbench::RIG));
        let rig = open_rig(bench.path(&file).to_str().unwrap()).unwrap();
        let plan = planned(&robot, &rig, &options(&rig, &[("A", "1")], &[0.46], 9));
        assert_eq!(plan.shells[0].measured, 9, "{name}: {:?}", plan.shells[0].hindrances);
        let gaps: Vec<f64> = plan.rows.iter().filter_map(|row| Some(row.margins.as_ref()?.clearance_m)).collect();
        let same = |gap: f64| gaps.iter().filter(|other| (*other - gap).abs() < 1e-5).count();
        assert!(gaps.iter().all(|&gap| same(gap) < gaps.len() / 3), "{name}: {gaps:?}");
    }
}

#[test]
fn the_check_sees_the_gaps_that_an_independent_library_sees() {
    const POSTURES: usize = 160_000;
    /// The library's distances of a plate, to it a cylinder without thickness, are true to some 10 µm.
    const SAME_M: f64 = 2e-5;
    let rig = open_rig("triangles").unwrap();
    let designs = ROBOTS.map(|(name, _)| open_robot(name).unwrap());
    let fitted = ["puma560", "ur5e"].map(|name| fitted(&open_robot(name).unwrap(), &rig, 6));
    let robots: Vec<Robot> = designs.into_iter().chain(fitted).collect();
    let mut seen = HashMap::<String, usize>::new();
    for robot in &robots {
        let naive = NaiveCell::new(robot, &rig, Margins::default().clearance_m);
        let cell = Cell::new(robot, &rig, 0.075, Margins::default(), Pace::default()).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for i in 0..at_length(POSTURES) / robots.len() {
            let q = naive.random_posture(&mut rng);
            let attached = rig.all_pairings().get(i % 10).copied();
            let (gap_m, between) = naive.gap_m(&q, attached);
            let ours = cell.nearest(&cell.posture(&robot.chain.joint_vector(&q).unwrap()), attached);
            assert!((ours.gap_m - gap_m).abs() < SAME_M, "{} at {q:?}: {ours:?}, {gap_m} m, {between}", robot.name);
            *seen.entry(ours.contact.to_string()).or_default() += 1;
        }
    }
    for what in ["sphere near link 3", "tool near link 3", "bar near sphere plate", "bar near link 3", "link 2 near link 4"] {
        assert!(seen.contains_key(what), "no {what} in {seen:?}");
    }
}

#[test]
fn what_stays_clear_for_certain_is_clear_wherever_the_joints_go() {
    const PLACES: usize = 40;
    let rig = open_rig("triangles").unwrap();
    for name in ["puma560", "stanford", "scara"] {
        let robot = open_robot(name).unwrap();
        let cell = Cell::new(&robot, &rig, 0.075, Margins::default(), Pace::default()).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let (mut certain, mut asked) = (0, 0);
        while certain < at_length(300) {
            asked += 1;
            assert!(asked < at_length(100_000), "{name}: {certain}");
            let a = cell.inverse.random_start(&mut rng);
            let step = 10_f64.powf(rng.random_range(-3.0..-0.5));
            let mut b = a;
            b.as_array_mut()[..robot.chain.joints()].iter_mut().for_each(|q| *q += step * rng.random_range(-1.0..1.0));
            let attached = rig.all_pairings().get(asked % 10).copied();
            let swing = Swing::between(cell.inverse.skeleton(), &a, &b);
            let gap_m = cell.margins.clearance_m;
            if !cell.scene.keeps_apart(&cell.posture(&a), attached, gap_m, &swing) {
                continue;
            }
            certain += 1;
            for _ in 0..PLACES {
                let share = rng.random_range(-1.0..1.0);
                let mut q = a;
                q.as_array_mut().iter_mut().zip(b.as_array()).for_each(|(q, b)| *q += share * (b - *q));
                let nearest = cell.nearest(&cell.posture(&q), attached);
                assert!(nearest.gap_m >= gap_m - 1e-9, "{name}: {nearest:?}, share {share} of a step of {step}");
            }
        }
    }
}

#[test]
fn nothing_moves_along_a_plan_that_leads_into_something() {
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let options = options(&rig, &[("A", "1")], &[0.46], 6);
    let cell = Cell::new(&robot, &rig, options.travel_m, options.margins, options.pace).unwrap();
    let rows = planned(&robot, &rig, &options).rows;
    let refused = |change: &dyn Fn(&mut Vec<PlanRow>)| {
        let mut rows = rows.clone();
        change(&mut rows);
        CheckedPlan::new(&cell, &rows).map(|plan| plan.rows().len())
    };
    assert_eq!(refused(&|_| ()), Ok(rows.len()));
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(refused(&|rows| rows[3].q.as_array_mut()[2] = number), Err(UnsafePlan::NotFinite { row: 4 }));
        assert_eq!(refused(&|rows| rows[0].bar_m = number), Err(UnsafePlan::NotFinite { row: 1 }));
    }
    assert_eq!(refused(&|rows| rows[5].pairing.sphere = 7), Err(UnsafePlan::OtherRig { row: 6 }));
    assert_eq!(refused(&|rows| rows[3].q.as_array_mut()[5] += 10.0), Err(UnsafePlan::Limits));
    assert_eq!(refused(&|rows| rows.retain(|row| row.kind == RowKind::Measure)), Err(UnsafePlan::Travel));
    // Without the bar, through a posture in which something is in something.
    let naive = NaiveCell::new(&robot, &rig, options.margins.clearance_m);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..20 {
        let q = std::iter::repeat_with(|| naive.random_posture(&mut rng)).find(|q| naive.gap_m(q, None).0 < -0.01).unwrap();
        let into_something = refused(&|rows| {
            rows.iter_mut().for_each(|row| row.bar = None);
            rows[2].q.as_array_mut()[..6].copy_from_slice(&q);
        });
        assert!(matches!(into_something, Err(UnsafePlan::Contact { .. })), "{into_something:?} by {q:?}");
    }
}

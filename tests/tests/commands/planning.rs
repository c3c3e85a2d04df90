//! Plans: margins by an independent scene and by a thousand robots that are not nominal, inverse kinematics, the choice of poses, and
//! what `host-cal plan` says and refuses.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fs;
use std::sync::Mutex;

use ballbar::{Chain, JointKind, JointVector, Kinematics, Measurement, ParameterUnit, Pose};
use ballbar_tests::experiment::{Puma, dataset};
use ballbar_tests::solids::{NaiveCell, base_from_tool};
use ballbar_tests::workbench::{self, Workbench};
use host_cal::files::{PlanRow, PoseRow, ROBOTS, Rig, Robot, RowKind};
use host_cal::identify::{FitOptions, fit};
use host_cal::kinematics::{InverseKinematics, Thoroughness};
use host_cal::plan::{
    Cell, CheckedPlan, Expectation, Grid, Margins, Pace, Plan, PlanError, PlanOptions, Progress, Quality, Stage, Swing,
    UnsafePlan, check, d_optimal, plan,
};
use host_cal::simulate::tool_error;
use rand::seq::index::sample;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const LATITUDES_DEG: [f64; 3] = [20.0, 45.0, 70.0];

fn options(rig: &Rig, pairings: &[(&str, &str)], bars_m: &[f64], poses_per_shell: usize) -> PlanOptions {
    let id = |(chuck, sphere): &(&str, &str)| host_cal::files::PairingId {
        chuck: rig.chuck(chuck).unwrap(),
        sphere: rig.sphere(sphere).unwrap(),
    };
    PlanOptions {
        pairings: pairings.iter().map(id).collect(),
        bars_m: bars_m.to_vec(),
        travel_m: 0.075,
        grid: Grid::of(&LATITUDES_DEG, poses_per_shell),
        poses_per_shell,
        optimal: None,
        margins: Margins::default(),
        pace: Pace::default(),
        seed: 0,
    }
}

fn planned(robot: &Robot, rig: &Rig, options: &PlanOptions) -> Plan {
    plan(robot, rig, options, &|_| ()).unwrap()
}

/// Joint vectors from the row before to a row, at most `step` of a joint apart, the row's own among them; and whether the bar is on.
fn way<'a>(rows: &'a [PlanRow], i: usize, joints: usize, step: f64) -> impl Iterator<Item = (Vec<f64>, bool)> + 'a {
    let to = rows[i].q.as_array()[..joints].to_vec();
    let before = if i > 0 { &rows[i - 1] } else { &rows[i] };
    let from = before.q.as_array()[..joints].to_vec();
    let stays_on =
        before.bar.is_some() && rows[i].bar.is_some() && before.pairing == rows[i].pairing && before.bar_m == rows[i].bar_m;
    let farthest = from.iter().zip(&to).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let pieces = (farthest / step).ceil().max(1.0) as usize;
    (1..=pieces).map(move |piece| {
        let share = piece as f64 / pieces as f64;
        let q = from.iter().zip(&to).map(|(a, b)| a + (b - a) * share).collect();
        (q, if piece == pieces { rows[i].bar.is_some() } else { stays_on })
    })
}

/// The least gap, metres, and the least rest of travel, metres, over all rows and fine steps between them.
fn least_by_naive_cell(robot: &Robot, rig: &Rig, rows: &[PlanRow], step: f64) -> ((f64, String), f64) {
    let cell = NaiveCell::new(robot, rig, Margins::default().clearance_m);
    assert!(cell.pairs() > 0);
    let (mut gap, mut travel_m) = ((f64::INFINITY, String::new()), f64::INFINITY);
    for (i, row) in rows.iter().enumerate() {
        for (q, is_on) in way(rows, i, robot.chain.joints(), step) {
            let here = cell.gap_m(&q, is_on.then_some(row.pairing));
            if here.0 < gap.0 {
                gap = (here.0, format!("{} before row {}", here.1, i + 1));
            }
            if is_on {
                travel_m = travel_m.min(0.0375 - (cell.length_m(&q, row.pairing) - row.bar_m).abs());
            }
        }
    }
    (gap, travel_m)
}

fn plausible_deviation(unit: ParameterUnit) -> f64 {
    match unit {
        ParameterUnit::Metre => 5e-3 / 3.0,
        ParameterUnit::Radian => 0.5_f64.to_radians() / 3.0,
        ParameterUnit::One => 0.5e-2 / 3.0,
    }
}

/// A robot as it may be when `design` is what was meant. Parameters that only do what others do keep their value.
fn plausible_robot(design: &Chain<f64>, rng: &mut ChaCha8Rng) -> Chain<f64> {
    let mut chain = design.clone();
    for i in 0..design.parameter_count() {
        let parameter = ballbar::Parameter::from_index(i);
        if !design.is_conventionally_held(parameter) {
            chain.parameters_mut()[i] += Normal::new(0.0, plausible_deviation(design.unit(parameter))).unwrap().sample(rng);
        }
    }
    chain
}

/// Plans for robots of all kinds keep every margin, by solids and lengths that share no code with the planner.
fn keeps_margins(name: &str, pairings: &[(&str, &str)], bars_m: &[f64], poses_per_shell: usize) {
    const STEP: f64 = 0.02;
    const ROBOTS: usize = 1000;
    let (robot, rig) = (Robot::open(name).unwrap(), Rig::open("triangles").unwrap());
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
    for _ in 0..ROBOTS {
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
    assert!(least_m >= margins.travel_m, "{name}: {least_m} m of travel in the worst of {ROBOTS} robots");
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
    let (robot, rig) = (Robot::open("puma560").unwrap(), Rig::open("triangles").unwrap());
    let mut rows = planned(&robot, &rig, &options(&rig, &[("A", "1")], &[0.46], 9)).rows;
    rows.retain(|row| row.kind == RowKind::Measure);
    let ((gap_m, _), travel_m) = least_by_naive_cell(&robot, &rig, &rows, 0.02);
    assert!(gap_m < 0.0 || travel_m < 0.0, "{gap_m} m, {travel_m} m: the test cannot fail");
}

/// The robot with parameters off as far as a design plausibly is: what a fit finds.
fn fitted(design: &Robot, rig: &Rig, seed: u64) -> Robot {
    const SIGMA_M: f64 = 0.084e-3;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let truth = Kinematics::new(&plausible_robot(&design.chain, &mut rng));
    let noise = Normal::new(0.0, SIGMA_M).unwrap();
    let pose = |number: usize| {
        let q: Vec<f64> = design.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let id = rig.all_pairings()[number % rig.all_pairings().len()];
        let (pairing, q) = (rig.pairing(id), design.chain.joint_vector(&q).unwrap());
        let length_m = truth.length(&q, &pairing) + noise.sample(&mut rng);
        PoseRow {
            pairing: id,
            measurement: Measurement { pairing, q, length_m, weight: 1.0 },
            sigma_m: None,
            set: None,
            t_s: None,
            bar_m: None,
            motion: None,
            file: 0,
            line: number,
            number,
        }
    };
    let rows = (1..=200).map(pose).collect();
    let found = fit(design, &dataset(rows), &FitOptions::default()).unwrap();
    let mut robot = design.clone();
    robot.chain = found.solution.chain;
    robot
}

#[test]
fn a_fitted_robot_is_planned_with_as_many_poses_as_its_design() {
    let rig = Rig::open("triangles").unwrap();
    for (name, _) in ROBOTS {
        let design = Robot::open(name).unwrap();
        let options = options(&rig, &[("B", "2"), ("A", "1")], &[0.46], 18);
        let before = planned(&design, &rig, &options).shells.iter().map(|shell| shell.measured).sum::<usize>();
        let plan = planned(&fitted(&design, &rig, 5), &rig, &options);
        let measured = plan.shells.iter().map(|shell| shell.measured).sum::<usize>();
        assert!(measured >= before, "{name}: {measured} of {before}");
    }
}

#[test]
fn an_offset_of_a_quarter_of_a_millimetre_makes_no_link() {
    let (design, rig) = (Robot::open("puma560").unwrap(), Rig::open("triangles").unwrap());
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
    let robot = Robot::open("puma560").unwrap();
    let bench = Workbench::new();
    // A PUMA's third link passes its first 149.09 mm off, in every posture; a bar's end is 35 mm before its own plate.
    let cases = [("links", "link_radius_mm = 69.0"), ("plate", "sphere_plate_behind_mm = 26.0"), ("bar", "bar_radius_mm = 24.0")];
    for (name, size) in cases {
        let file = format!("{name}.toml");
        bench.put(&file, format!("{}\n[solids]\n{size}\n", workbench::RIG));
        let rig = Rig::open(bench.path(&file).to_str().unwrap()).unwrap();
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
    let rig = Rig::open("triangles").unwrap();
    let designs = ROBOTS.map(|(name, _)| Robot::open(name).unwrap());
    let fitted = ["puma560", "ur5e"].map(|name| fitted(&Robot::open(name).unwrap(), &rig, 6));
    let robots: Vec<Robot> = designs.into_iter().chain(fitted).collect();
    let mut seen = HashMap::<String, usize>::new();
    for robot in &robots {
        let naive = NaiveCell::new(robot, &rig, Margins::default().clearance_m);
        let cell = Cell::new(robot, &rig, 0.075, Margins::default(), Pace::default()).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for i in 0..POSTURES / robots.len() {
            let q = naive.random_posture(&mut rng);
            let attached = rig.all_pairings().get(i % 10).copied();
            let (gap_m, between) = naive.gap_m(&q, attached);
            let ours = cell.nearest(&cell.posture(&robot.chain.joint_vector(&q).unwrap()), attached);
            assert!((ours.gap_m - gap_m).abs() < SAME_M, "{} at {q:?}: {ours:?}, {gap_m} m, {between}", robot.name);
            *seen.entry(ours.contact.to_string()).or_default() += 1;
        }
    }
    for what in ["sphere near link 3", "tool near link 3", "bar near sphere plate", "bar near link 3", "link 1 near link 4"] {
        assert!(seen.contains_key(what), "no {what} in {seen:?}");
    }
}

#[test]
fn what_stays_clear_for_certain_is_clear_wherever_the_joints_go() {
    const PLACES: usize = 40;
    let rig = Rig::open("triangles").unwrap();
    for name in ["puma560", "stanford", "scara"] {
        let robot = Robot::open(name).unwrap();
        let cell = Cell::new(&robot, &rig, 0.075, Margins::default(), Pace::default()).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let (mut certain, mut asked) = (0, 0);
        while certain < 300 {
            asked += 1;
            assert!(asked < 100_000, "{name}: {certain}");
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
    let (robot, rig) = (Robot::open("puma560").unwrap(), Rig::open("triangles").unwrap());
    let options = options(&rig, &[("A", "1")], &[0.46], 6);
    let cell = Cell::new(&robot, &rig, options.travel_m, options.margins, options.pace).unwrap();
    let rows = planned(&robot, &rig, &options).rows;
    let refused = |change: &dyn Fn(&mut Vec<PlanRow>)| {
        let mut rows = rows.clone();
        change(&mut rows);
        CheckedPlan::new(&cell, &rows).map(|plan| plan.rows().len())
    };
    assert_eq!(refused(&|_| ()), Ok(rows.len()));
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

#[test]
fn a_refusal_points_to_its_cause() {
    let bench = Workbench::new();
    let help = |solids: &str, chucks: [&str; 2], change: &dyn Fn(&mut PlanOptions), spheres: [&str; 2]| {
        let text = workbench::RIG
            .replace("[565.0, 0.0, 0.0]", chucks[0])
            .replace("[392.0, 100.0, 0.0]", chucks[1])
            .replace("[57.0, 0.0, 50.0]", spheres[0])
            .replace("[-28.0, 50.0, 50.0]", spheres[1]);
        bench.put(
            "cause.toml",
            format!(
                "{text}\n[[spheres]]\nname = \"3\"\nposition_mm = {}\n[solids]\n{solids}\n",
                spheres[1].replace("50.0,", "-50.0,")
            ),
        );
        let rig = Rig::open(bench.path("cause.toml").to_str().unwrap()).unwrap();
        let mut options = options(&rig, &[("A", "1")], &[0.46], 6);
        change(&mut options);
        match plan(&Robot::open("puma560").unwrap(), &rig, &options, &|_| ()) {
            Ok(plan) => format!("{:?}", plan.shells),
            Err(PlanError::OutOfReach { remedy, .. }) => remedy,
            Err(_) => {
                let args = ["plan", "--robot", "puma560", "--rig", "cause.toml", "--pairings", "A:1", "--bar", "460"];
                bench.fails(2, &args).replace('│', "").split_whitespace().collect::<Vec<_>>().join(" ")
            }
        }
    };
    const FRONT: [&str; 2] = ["[565.0, 0.0, 0.0]", "[392.0, 100.0, 0.0]"];
    const HIGH: [&str; 2] = ["[500.0, 0.0, 800.0]", "[327.0, 100.0, 800.0]"];
    const AHEAD: [&str; 2] = ["[57.0, 0.0, 80.0]", "[-28.0, 50.0, 80.0]"];
    /// Turned by 90° about the tool's y.
    const ACROSS: [&str; 2] = ["[80.0, 0.0, -57.0]", "[80.0, 50.0, 28.0]"];
    let table = help("link_radius_mm = 90.0", HIGH, &|options| options.bars_m = vec![0.3], AHEAD);
    assert!(table.contains("table_below_chucks_mm"), "{table}");
    let travel = help("", FRONT, &|options| options.margins.travel_m = 0.034, AHEAD);
    assert!(travel.contains("--travel-margin-mm"), "{travel}");
    let far = help("", FRONT, &|options| options.bars_m = vec![2.5], AHEAD);
    assert!(far.contains("--bar"), "{far}");
    let across = help("", FRONT, &|_| (), ACROSS);
    assert!(across.contains("turn the spheres' positions"), "{across}");
}

#[test]
fn links_too_thick_for_their_joint_are_not_looked_at_beside_one_another() {
    // A PUMA's third link passes its first 149 mm off, in every posture.
    let bench = Workbench::new();
    bench.put("thick.toml", format!("{}\n[solids]\nlink_radius_mm = 70.0\n", workbench::RIG));
    let (robot, rig) = (Robot::open("puma560").unwrap(), Rig::open(bench.path("thick.toml").to_str().unwrap()).unwrap());
    let plan = planned(&robot, &rig, &options(&rig, &[("A", "1")], &[0.46], 6));
    assert_eq!(plan.shells[0].measured, 6, "{:?}", plan.shells[0].hindrances);
}

#[test]
fn the_same_seed_gives_the_same_plan_and_another_gives_another() {
    let (robot, rig) = (Robot::open("stanford").unwrap(), Rig::open("triangles").unwrap());
    let mut options = options(&rig, &[("A", "1"), ("B", "2")], &[0.46], 6);
    let rows = |options: &PlanOptions| planned(&robot, &rig, options).rows;
    let first = rows(&options);
    assert_eq!(first, rows(&options));
    options.seed = 1;
    assert_ne!(first, rows(&options));
}

#[test]
fn progress_names_its_stage_and_grows_to_the_end_of_each() {
    let (robot, rig) = (Robot::open("puma560").unwrap(), Rig::open("triangles").unwrap());
    let pairings = [("A", "1"), ("B", "2"), ("C", "3")];
    for optimal in [None, Some(38)] {
        let told = Mutex::new(Vec::<Progress>::new());
        let tell = |now| told.lock().unwrap().push(now);
        let options = PlanOptions { optimal, ..options(&rig, &pairings, &[0.46], 14) };
        let rows = plan(&robot, &rig, &options, &tell).unwrap().rows;
        let cell = Cell::new(&robot, &rig, options.travel_m, options.margins, options.pace).unwrap();
        check(&cell, &rows, 0.1, 10, 0, &tell);
        let told = told.into_inner().unwrap();
        let stages: Vec<&[Progress]> = told.chunk_by(|a, b| a.stage == b.stage).collect();
        assert_eq!(stages.iter().map(|stage| stage[0].stage).collect::<Vec<_>>(), Stage::ALL);
        for stage in stages {
            let (first, last) = (stage[0], stage[stage.len() - 1]);
            assert_eq!((first.done, last.done), (0, first.total), "{first:?} {last:?}");
            assert!(stage.windows(2).all(|pair| pair[1].total == first.total && pair[1].done >= pair[0].done), "{stage:?}");
        }
    }
}

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
    let rig = Rig::open("triangles").unwrap();
    for (name, _) in ROBOTS {
        let robot = Robot::open(name).unwrap();
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
        let robot = Robot::open(name).unwrap();
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

/// Poses of a PUMA, their gradients times plausible deviations over what they tell, and which parameters these are.
struct Pool {
    poses: Vec<PoseRow>,
    rows: Vec<Vec<f64>>,
    subset: Vec<usize>,
}

fn pool(puma: &Puma) -> Pool {
    let poses = puma.shells(0.46, 40, 0.0, 4).rows;
    let measurements: Vec<Measurement<f64>> = poses.iter().map(|pose| pose.measurement).collect();
    let subset = Expectation::new(&puma.design.chain, &measurements, &puma.design.limits).identified;
    let cell = Cell::new(&puma.design, &puma.rig, 0.075, Margins::default(), Pace::default()).unwrap();
    let row = |pose: &PoseRow| {
        let row = cell.plausible_row(&pose.measurement.q, &pose.measurement.pairing);
        subset.iter().map(|&column| row[column]).collect()
    };
    Pool { rows: poses.iter().map(row).collect(), poses, subset }
}

/// RMS error of the tool, metres, that noise leaves after fits to these poses of the pool.
fn recovered_m(puma: &Puma, pool: &Pool, chosen: &[usize], fits: u64) -> f64 {
    const SIGMA_M: f64 = 0.084e-3;
    let square = |seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noise = Normal::new(0.0, SIGMA_M).unwrap();
        let mut rows: Vec<PoseRow> = chosen.iter().map(|&i| pool.poses[i].clone()).collect();
        rows.iter_mut().for_each(|row| row.measurement.length_m += noise.sample(&mut rng));
        let hold = FitOptions { hold: "paper".parse().unwrap(), ..FitOptions::default() };
        let found = fit(&puma.design, &dataset(rows), &hold).unwrap();
        tool_error(&puma.truth.chain, &found.solution.chain, &puma.truth.limits, 300, seed).rms_m.powi(2)
    };
    ((0..fits).map(square).sum::<f64>() / fits as f64).sqrt()
}

#[test]
fn d_optimal_poses_recover_the_tool_better_than_random_ones() {
    const POSES: usize = 60;
    let puma = Puma::default();
    let pool = pool(&puma);
    let best = d_optimal(&pool.rows, POSES);
    let by_best_m = recovered_m(&puma, &pool, &best, 12);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let by_random_m: Vec<f64> = (0..6)
        .map(|_| {
            let any: Vec<usize> = sample(&mut rng, pool.poses.len(), POSES).into_iter().collect();
            recovered_m(&puma, &pool, &any, 12)
        })
        .collect();
    let mean_m = by_random_m.iter().sum::<f64>() / by_random_m.len() as f64;
    println!("D-optimal {:.3} mm, random {:?} mm", by_best_m * 1e3, by_random_m.iter().map(|m| m * 1e3).collect::<Vec<_>>());
    assert!(by_random_m.iter().all(|&random_m| by_best_m < random_m), "{by_best_m} {by_random_m:?}");
    assert!(by_best_m < 0.8 * mean_m, "{by_best_m} {mean_m}");
}

#[test]
fn noise_at_the_tool_is_what_was_expected() {
    const SIGMA_MM: f64 = 0.084;
    let puma = Puma::default();
    let pool = pool(&puma);
    let chosen = d_optimal(&pool.rows, 90);
    let measurements: Vec<Measurement<f64>> = chosen.iter().map(|&i| pool.poses[i].measurement).collect();
    let quality = Quality::new(&puma.design.chain, &measurements, &puma.design.limits, &pool.subset).unwrap();
    let (expected_mm, found_mm) = (quality.amplification * SIGMA_MM, recovered_m(&puma, &pool, &chosen, 100) * 1e3);
    println!("expected {expected_mm:.3} mm, found {found_mm:.3} mm");
    assert!((found_mm / expected_mm - 1.0).abs() < 0.2, "{found_mm} {expected_mm}");
}

const PLAN: [&str; 7] = ["plan", "--robot", "puma560", "--rig", "triangles", "--bar", "460"];
/// Tells all parameters.
const ENOUGH: [&str; 4] = ["--per-pair", "15", "--pairings", "A:1,B:2,C:3"];

#[test]
fn a_plan_is_written_checked_and_told_as_json() {
    let bench = Workbench::new();
    let run = bench.run(&[&PLAN[..], &ENOUGH, &["--out", "plan.csv"]].concat());
    assert_eq!(run.code, 0, "{}", run.transcript());
    let written = fs::read_to_string(bench.path("plan.csv")).unwrap();

    let json = bench.run(&[&PLAN[..], &ENOUGH, &["--json"]].concat());
    let rows = json.json()["rows"].as_array().unwrap().clone();
    assert_eq!((json.code, rows.len()), (0, written.lines().count() - 1));
    for (row, line) in rows.iter().zip(written.lines().skip(1)) {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!((row["kind"].as_str(), row["chuck"].as_str()), (Some(fields[0]), Some(fields[1])));
        assert!((row["q"][5].as_f64().unwrap() - fields[9].parse::<f64>().unwrap()).abs() < 1e-8);
    }
    let summary = bench.run(&[&PLAN[..], &ENOUGH, &["--out", "plan.csv", "--json"]].concat()).json();
    assert!(summary.get("rows").is_none() && summary["out"] == "plan.csv" && summary["poses"] == 45);

    let check = ["plan", "--robot", "puma560", "--rig", "triangles", "--check"];
    let whole = bench.run(&[&check[..], &["plan.csv", "--json"]].concat());
    assert_eq!((whole.code, whole.json()["is_kept"].as_bool()), (0, Some(true)), "{}", whole.transcript());
    let measured: String = written.lines().filter(|line| !line.starts_with("via")).map(|line| line.to_owned() + "\n").collect();
    bench.put("measured.csv", measured);
    let without_vias = bench.run(&[&check[..], &["measured.csv", "--json"]].concat());
    assert_eq!((without_vias.code, without_vias.json()["is_kept"].as_bool()), (1, Some(false)));
}

#[test]
fn a_d_optimal_plan_is_shown_beside_the_grid() {
    let bench = Workbench::new();
    let more = ["--bar", "460", "--per-pair", "12", "--pairings", "A:1,B:2,C:3,A:3,B:1,C:2", "--optimal", "50", "--json"];
    let found = bench.run(&[&PLAN[..5], &more].concat()).json();
    let optimal = &found["optimal"];
    let of = |set: &str, what: &str| optimal[set][what].as_f64().unwrap();
    assert_eq!((found["poses"].as_u64(), optimal["chosen"]["poses"].as_u64()), (Some(50), Some(50)));
    assert!(of("chosen", "log10_determinant") > of("grid_of_same_size", "log10_determinant") + 1.0, "{optimal}");
    for what in ["condition", "smallest_singular_mm", "noise_amplification_index_mm", "amplification"] {
        assert!(of("chosen", what) > 0.0 && of("grid_of_same_size", what) > 0.0);
    }
}

#[test]
fn a_plan_that_no_fit_could_use_says_so() {
    let bench = Workbench::new();
    let plan = |more: &[&str]| bench.run(&[&PLAN[..], more, &["--out", "plan.csv", "--json"]].concat());
    let cases: [(&[&str], &str); 4] = [
        (&["--pairings", "A:1,B:2,C:3", "--per-pair", "13", "--latitudes-deg", "20,70"], "noise of the lengths reaches the tool"),
        (&["--per-pair", "3", "--latitudes-deg", "45"], "27 poses for 36 parameters"),
        (&["--per-pair", "4", "--latitudes-deg", "30,60"], "36 poses for 36 parameters"),
        (&["--pairings", "A:1,A:2", "--per-pair", "20"], "identify 32 of 36 parameters"),
    ];
    for (more, why) in cases {
        let run = plan(more);
        assert_eq!(run.code, 1, "{}", run.transcript());
        assert!(run.stderr.contains(why), "{}", run.stderr);
        assert!(run.json()["warnings"][0].as_str().is_some_and(|said| said.contains(why)), "{}", run.transcript());
        assert!(bench.path("plan.csv").exists());
        if why.contains("identify") {
            // A figure that leaves the errors of some parameters out is none.
            assert!(run.json()["quality"]["amplification"].is_null() && run.stderr.contains("one chuck"), "{}", run.transcript());
        }
    }
}

#[test]
fn what_cannot_be_planned_is_refused() {
    const PUMA: [&str; 6] = ["plan", "--robot", "puma560", "--out", "old.toml", "--force"];
    let bench = Workbench::new();
    let rig = workbench::RIG;
    bench.put("solids.toml", format!("{rig}\n[solids]\nlink_radius_mm = -3.0\n"));
    bench.put("misspelt.toml", format!("{rig}\n[solids]\nlink_diameter_mm = 90.0\n"));
    bench.put("chucks.toml", rig.replace("[392.0, 100.0, 0.0]", "[560.0, 20.0, 0.0]"));
    bench.put("foot.toml", rig.replace("[392.0, 100.0, 0.0]", "[60.0, 20.0, 0.0]"));
    bench.put("no-bar.toml", rig.split_once("[bar]").unwrap().0);
    let cases: [(&str, &str, &[&str]); 15] = [
        ("plan_with_solids_below_zero", "solids.toml", &[]),
        ("plan_with_solids_misspelt", "misspelt.toml", &[]),
        ("plan_with_chucks_in_one_another", "chucks.toml", &[]),
        ("plan_with_a_chuck_in_the_foot", "foot.toml", &[]),
        ("plan_without_travel", "no-bar.toml", &["--bar", "460"]),
        ("plan_beyond_reach", "rig.toml", &["--pairings", "A:1", "--bar", "2500", "--per-pair", "6"]),
        ("plan_bar_twice", "rig.toml", &["--bar", "460,610,460"]),
        ("plan_bar_of_zero", "rig.toml", &["--bar", "0"]),
        ("plan_latitude_below_the_table", "rig.toml", &["--latitudes-deg=-10,20"]),
        ("plan_margin_beyond_travel", "rig.toml", &["--travel-margin-mm", "37.5"]),
        ("plan_speed_of_zero", "rig.toml", &["--speed-deg-s", "0"]),
        ("plan_of_an_unknown_pairing", "rig.toml", &["--pairings", "A:7"]),
        ("plan_optimal_of_nothing", "rig.toml", &["--optimal", "0"]),
        ("plan_optimal_of_too_many", "rig.toml", &["--pairings", "A:1", "--bar", "460", "--per-pair", "4", "--optimal", "900"]),
        ("plan_optimal_of_too_few", "rig.toml", &["--pairings", "A:1", "--bar", "460", "--per-pair", "6", "--optimal", "4"]),
    ];
    for (name, rig, more) in cases {
        bench.refuses(name, &[&PUMA[..], &["--rig", rig], more].concat());
    }
    let said = bench.fails(3, &[&PUMA[..4], &["missing/plan.csv", "--rig", "rig.toml"]].concat());
    workbench::snapshot("write_a_plan_to_a_missing_folder", &["plan", "--out", "missing/plan.csv"], &said);
}

#[test]
fn a_plan_that_is_not_of_this_robot_or_is_damaged_is_refused() {
    let bench = Workbench::new();
    // Too few poses for a fit, but a plan.
    let run = bench.run(&[&PLAN[..], &["--per-pair", "5", "--pairings", "A:1", "--out", "plan.csv"]].concat());
    assert_eq!(run.code, 1, "{}", run.transcript());
    let text = fs::read_to_string(bench.path("plan.csv")).unwrap();
    bench.put("kind.csv", text.replacen("\nvia,", "\npass,", 1));
    bench.put("chuck.csv", text.replacen("\nmeasure,A,", "\nmeasure,Q,", 1));
    bench.put("header.csv", text.replacen("kind,", "sort,", 1));
    bench.put("empty.csv", "");
    let cases = [
        ("check_a_plan_of_another_robot", "irb120", "plan.csv"),
        ("check_a_plan_of_other_joints", "scara", "plan.csv"),
        ("check_a_plan_of_an_unknown_kind", "puma560", "kind.csv"),
        ("check_a_plan_with_an_unknown_chuck", "puma560", "chuck.csv"),
        ("check_a_plan_without_kind", "puma560", "header.csv"),
        ("check_an_empty_plan", "puma560", "empty.csv"),
        ("check_a_missing_plan", "puma560", "missing.csv"),
    ];
    for (name, robot, file) in cases {
        bench.refuses(name, &["plan", "--robot", robot, "--rig", "triangles", "--check", file]);
    }
}

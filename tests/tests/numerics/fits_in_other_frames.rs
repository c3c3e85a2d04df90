//! The same robot in other frames is fitted alike.

use ballbar::{Body, Chain, Kinematics, TermKind, Vector3};
use ballbar_calib::assess::{Assessment, Evidence};
use ballbar_calib::identify::{Fit, FitOptions, fit};
use ballbar_calib::kinematics::CanonicalFrames;
use ballbar_calib::model::{Dataset, JointLimits, NamedPoint, PairingId, PoseRow, Rig, Robot};
use ballbar_calib::unknowns::Kind;
use ballbar_tests::at_length::at_length;
use ballbar_tests::command::host_cal_in;
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::{Cell, Puma};
use ballbar_tests::frames::{random_chain, rewritten};
use ballbar_tests::plans::plausible_robot;
use host_cal::files::{open_rig, open_robot, read_poses};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// A millionth of a millimetre.
const SAME_M: f64 = 1e-9;

/// The farthest that the tool's origin is off in one of two robots, metres.
fn apart_m(a: &Chain<f64>, b: &Chain<f64>, robot: &Robot) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let kinematics = [a, b].map(Kinematics::new);
    let one = |rng: &mut ChaCha8Rng| {
        let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let [a, b] = kinematics.each_ref().map(|robot| robot.base_from_tool(&a.joint_vector(&q).unwrap()).translation_m);
        (a - b).norm()
    };
    (0..200).map(|_| one(&mut rng)).fold(0.0, f64::max)
}

/// Fits with both, and their verdicts.
fn fits<'a>(robots: [&Robot; 2], rig: &Rig, dataset: &Dataset) -> [(Fit, &'a str, usize); 2] {
    robots.map(|robot| {
        let found = fit(robot, dataset, &FitOptions::default()).unwrap();
        let told = Assessment::new(&Evidence::new(robot, rig, dataset, &found));
        (found, told.answer.name(), told.reasons.len())
    })
}

#[test]
fn a_robot_in_far_and_turned_frames_is_fitted_as_it_is_in_its_own() {
    const SLIDE_M: f64 = 100.0;
    let rig = open_rig("triangles").unwrap();
    let pairings = rig.all_pairings();
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let names = ["puma560", "ur5e", "stanford", "irb120"];
    let cases = [20, 8];
    for (i, name) in names.into_iter().cycle().take(at_length(2 * names.len())).enumerate() {
        let design = open_robot(name).unwrap();
        let per_pairing = cases[i / names.len() % 2];
        // A design that is not special, and what was built.
        let robot = Robot { chain: plausible_robot(&design.chain, &mut rng), ..design };
        let truth = Robot { chain: plausible_robot(&robot.chain, &mut rng), ..robot.clone() };
        let cell = Cell { design: robot.clone(), truth, rig: rig.clone() };
        let poses = cell.measured_at(&pairings, 0.46, per_pairing, 84e-6, i as u64);
        let other = Robot { chain: rewritten(&robot.chain, SLIDE_M, &mut rng), ..robot.clone() };
        let [(one, answer, reasons), (far, far_answer, far_reasons)] = fits([&robot, &other], &rig, &poses);
        assert!(apart_m(&one.solution.chain, &cell.truth.chain, &robot) < 5e-3, "{name}");
        let off_m = apart_m(&one.solution.chain, &far.solution.chain, &robot);
        assert!(off_m < SAME_M, "{name}: {off_m} m");
        assert_eq!((answer, reasons), (far_answer, far_reasons), "{name}");
        assert!((one.fitted.rms_m - far.fitted.rms_m).abs() < 1e-12, "{name}");
        // What is redundant stays as it was written.
        for (index, parameter) in far.parameters.iter().enumerate() {
            if parameter.held.is_some() {
                assert!((parameter.fitted - other.chain.parameters()[index]).abs() < 1e-9, "{name}: {}", parameter.name);
            }
        }
    }
}

/// Lengths from anywhere to anywhere near the tool, since few random arms reach a rig.
#[test]
fn any_chain_in_far_and_turned_frames_is_fitted_as_it_is_in_its_own() {
    const LENGTHS: usize = 240;
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let end = |name: &str, reach_m: f64, rng: &mut ChaCha8Rng| {
        NamedPoint::new(name, std::array::from_fn(|_| rng.random_range(-reach_m..reach_m)))
    };
    for run in 0..at_length(8) {
        let joints = rng.random_range(4..=7);
        let chain = random_chain(joints, &mut rng);
        let limits = vec![JointLimits { min: -2.5, max: 2.5 }; chain.joints()];
        let robot = Robot::new("any", chain, limits).unwrap();
        let truth = plausible_robot(&robot.chain, &mut rng);
        let chucks = ["A", "B", "C"].map(|name| end(name, 1.0, &mut rng));
        let spheres = ["1", "2", "3"].map(|name| end(name, 0.2, &mut rng));
        let rig = Rig::new(chucks.into(), spheres.into(), None).unwrap();
        let kinematics = Kinematics::new(&truth);
        let row = |i: usize, rng: &mut ChaCha8Rng| {
            let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
            let q = robot.chain.joint_vector(&q).unwrap();
            let pairing = PairingId { chuck: i % 3, sphere: i / 3 % 3 };
            let noise_m = rng.random_range(-0.1e-3..0.1e-3);
            PoseRow::new(&rig, pairing, q, kinematics.length(&q, &rig.pairing(pairing)) + noise_m).unwrap()
        };
        let rows = (0..LENGTHS).map(|i| row(i, &mut rng)).collect();
        let poses = Dataset::new("anywhere", rows).unwrap();
        let other = Robot { chain: rewritten(&robot.chain, 100.0, &mut rng), ..robot.clone() };
        let [(one, answer, reasons), (far, far_answer, far_reasons)] = fits([&robot, &other], &rig, &poses);
        assert!(one.fitted.rms_m < 0.1e-3, "{run}: {} m", one.fitted.rms_m);
        let off_m = apart_m(&one.solution.chain, &far.solution.chain, &robot);
        assert!(off_m < SAME_M, "{run}: {off_m} m, {:?}", robot.chain);
        assert_eq!((answer, reasons), (far_answer, far_reasons), "{run}");
    }
}

/// Masses stay with their links where a fit moves a far frame by centimetres, so that gravity bends the robot as it does in near frames.
#[test]
fn what_gravity_does_to_the_joints_is_the_same_in_all_frames() {
    const RAD_PER_NM: f64 = 1e-5;
    let rig = open_rig("triangles").unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(15);
    let mut design = open_robot("puma560").unwrap();
    for (link, mass_kg) in design.terms.masses.links.iter_mut().zip([12.0, 17.0, 6.0, 1.0, 0.5, 0.2]) {
        *link = Body { mass_kg, center_m: Vector3::new(0.1, 0.0, 0.05) };
    }
    let mut truth = Robot { chain: plausible_robot(&design.chain, &mut rng), ..design.clone() };
    (0..6).for_each(|joint| truth.terms.set_coefficient(joint, TermKind::Compliance, RAD_PER_NM));
    let cell = Cell { design: design.clone(), truth, rig };
    let (poses, rig) = (cell.measured(0.46, 20, 20e-6, 3), &cell.rig);
    let chain = rewritten(&design.chain, 100.0, &mut rng);
    let mut far = Robot { chain, ..design.clone() };
    // The masses of the same robot, seen from its far frames: back by the way of the canonical ones.
    let canonical = CanonicalFrames::new(&design.chain).terms(&design.terms);
    let frames = CanonicalFrames::new(&far.chain);
    for joint in 0..6 {
        let at = |center_m: Vector3<f64>| {
            let mut terms = design.terms;
            terms.masses.links[joint].center_m = center_m;
            frames.terms(&terms).masses.links[joint].center_m
        };
        // A rigid motion: its columns and its origin, turned about.
        let origin_m = at(Vector3::zeros());
        let turn = nalgebra::Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| at(axis) - origin_m));
        far.terms.masses.links[joint].center_m = turn.transpose() * (canonical.masses.links[joint].center_m - origin_m);
    }
    let found = [&design, &far].map(|robot| {
        let unknowns = vec![Kind::Compliance.block(robot, rig, &poses).unwrap()];
        fit(robot, &poses, &FitOptions { unknowns, ..FitOptions::default() }).unwrap()
    });
    let robots = [found[0].robot(&design), found[1].robot(&far)];
    let kept = Robot { terms: found[1].terms(&far), ..robots[1].clone() };
    let most_apart = |other: &Robot| {
        let load = |robot: &Robot, q: &_| Kinematics::new(&robot.chain).gravity_loads(&robot.terms.masses, q);
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let apart = |rng: &mut ChaCha8Rng| {
            let q: Vec<f64> = design.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
            let q = design.chain.joint_vector(&q).unwrap();
            let (near_nm, other_nm) = (load(&robots[0], &q), load(other, &q));
            let loads = near_nm.as_array().iter().zip(other_nm.as_array());
            let loads_nm = loads.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let tool = |robot: &Robot| robot.kinematics().base_from_tool(&q).translation_m;
            (loads_nm, (tool(&robots[0]) - tool(other)).norm())
        };
        (0..200).map(|_| apart(&mut rng)).fold((0.0_f64, 0.0_f64), |most, one| (most.0.max(one.0), most.1.max(one.1)))
    };
    let (moved, stayed) = (most_apart(&robots[1]), most_apart(&kept));
    println!("{moved:?} (Nm, m) with masses that stay with their links, {stayed:?} with their frames");
    assert!(moved.0 < 1e-6 && moved.1 < 1e-9, "{moved:?}");
    assert!(stayed.0 > 0.5 && stayed.1 > 1e-5, "{stayed:?}");
}

#[test]
fn deviations_say_the_same_of_the_tool_in_all_frames() {
    let puma = Puma::default();
    let (poses, design) = (puma.shells(0.46, 20, 84e-6, 2), puma.design);
    let other = Robot { chain: rewritten(&design.chain, 0.5, &mut ChaCha8Rng::seed_from_u64(4)), ..design.clone() };
    // The standard deviation of the tool along x: J C Jᵀ by the fit's own parameters.
    let deviations_m = [&design, &other].map(|robot| {
        let found = fit(robot, &poses, &FitOptions::default()).unwrap();
        let kinematics = Kinematics::new(&found.solution.chain);
        let q = robot.chain.joint_vector(&[0.3, -0.8, 0.5, 0.4, -0.6, 1.0]).unwrap();
        let mut rows = [[0.0; ballbar::MAX_PARAMETERS]; 3];
        kinematics.position_gradient(&q, &nalgebra::Vector3::zeros(), &mut rows);
        let moved = found.parameters.iter().enumerate().filter(|(_, parameter)| parameter.held.is_none());
        let row = nalgebra::DVector::from_iterator(found.uncertainty.covariance.nrows(), moved.map(|(index, _)| rows[0][index]));
        (row.transpose() * &found.uncertainty.covariance * &row)[(0, 0)].sqrt()
    });
    assert!(deviations_m[0] > 1e-5 && (deviations_m[1] / deviations_m[0] - 1.0).abs() < 1e-5, "{deviations_m:?}");
}

#[test]
fn a_ur5_by_its_own_table_is_fitted_as_it_is_in_near_frames() {
    let Some(folder) = real_data("cases/far_frames") else { return };
    let open = |name: &str| open_robot(folder.join(name).to_str().unwrap()).unwrap();
    let (near, far, truth) = (open("near.toml"), open("far2.toml"), open("true.toml"));
    let rig = open_rig("triangles").unwrap();
    let poses = read_poses([folder.join("s.csv").as_path()], &near, &rig).unwrap();
    let [(one, answer, _), (other, far_answer, _)] = fits([&near, &far], &rig, &poses);
    assert_eq!(answer, far_answer);
    for (found, name) in [(&one, "near"), (&other, "far")] {
        let off_m = apart_m(&found.solution.chain, &truth.chain, &near);
        assert!(off_m < 0.5e-3, "{name}: {off_m} m");
    }
    let off_m = apart_m(&one.solution.chain, &other.solution.chain, &near);
    assert!(off_m < 1e-6, "{off_m} m");
}

#[test]
fn what_poses_tell_of_a_ur5_is_the_same_by_its_own_table() {
    let Some(folder) = real_data("cases/far_frames") else { return };
    let [near, far] = ["near.toml", "far2.toml"].map(|name| {
        let run = host_cal_in(&folder, &["rank", "--robot", name, "--rig", "triangles", "s.csv", "--json"]);
        assert_eq!(run.code, 0, "{}", run.transcript());
        run.json()
    });
    for key in ["poses", "rank", "parameters", "bound_by_pairings", "not_identified", "remarks", "warnings"] {
        assert_eq!(near[key], far[key], "{key}");
    }
    let values = |json: &Value| -> Vec<f64> {
        let values = json["singular_values"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap());
        values.take(json["rank"].as_u64().unwrap() as usize).collect()
    };
    for (near, far) in values(&near).into_iter().zip(values(&far)) {
        assert!((near / far - 1.0).abs() < 1e-6, "{near} {far}");
    }
}

//! The same robot in other frames is fitted alike.

use ballbar::{Chain, Kinematics};
use ballbar_calib::assess::{Assessment, Evidence};
use ballbar_calib::identify::{Fit, FitOptions, fit};
use ballbar_calib::model::{Dataset, JointLimits, NamedPoint, PairingId, PoseRow, Rig, Robot};
use ballbar_calib::simulate::Shells;
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::dataset;
use ballbar_tests::frames::{random_chain, rewritten};
use ballbar_tests::plans::plausible_robot;
use host_cal::files::{open_rig, open_robot, read_poses};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
        let shells = Shells {
            planned_with: &robot,
            truth: &truth,
            rig: &rig,
            pairings: &pairings,
            bar_m: 0.46,
            per_pairing,
            sigma_m: 84e-6,
            seed: i as u64,
        };
        let poses = dataset(shells.simulate(|| ()).unwrap().into_iter().map(|pose| pose.row).collect());
        let other = Robot { chain: rewritten(&robot.chain, SLIDE_M, &mut rng), ..robot.clone() };
        let [(one, answer, reasons), (far, far_answer, far_reasons)] = fits([&robot, &other], &rig, &poses);
        assert!(apart_m(&one.solution.chain, &truth.chain, &robot) < 5e-3, "{name}");
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

#[test]
fn deviations_say_the_same_of_the_tool_in_all_frames() {
    let rig = open_rig("triangles").unwrap();
    let (design, truth) = (open_robot("puma560").unwrap(), open_robot("puma560-optimised").unwrap());
    let shells = Shells {
        planned_with: &design,
        truth: &truth,
        rig: &rig,
        pairings: &rig.all_pairings(),
        bar_m: 0.46,
        per_pairing: 20,
        sigma_m: 84e-6,
        seed: 2,
    };
    let poses = dataset(shells.simulate(|| ()).unwrap().into_iter().map(|pose| pose.row).collect());
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

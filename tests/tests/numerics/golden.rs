//! The library against numbers of another implementation: `golden/generate.py`, with 50 digits (mpmath) for the kinematics and
//! SciPy's least squares for the fit.

use ballbar::{
    Chain, Damping, FreeParameters, JointKind, Kinematics, MAX_PARAMETERS, Matrix3, Measurement, Pairing, Quantity, Real, Vector3,
};
use ballbar_calib::identify::{LmOptions, Observation, Solution, Spectrum, Uncertainty, solve_lengths};
use ballbar_tests::data::golden;
use serde::Deserialize;

#[derive(Deserialize)]
struct KinematicsFile {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    joints: String,
    parameters: Vec<f64>,
    poses: Vec<CasePose>,
}

#[derive(Deserialize)]
struct CasePose {
    q: Vec<f64>,
    chuck_m: [f64; 3],
    sphere_m: [f64; 3],
    base_from_tool: [[f64; 4]; 3],
    length_m: f64,
    gradient: Vec<f64>,
}

#[derive(Deserialize)]
struct FitFile {
    robot: FitRobot,
    chucks_m: Vec<[f64; 3]>,
    spheres_m: Vec<[f64; 3]>,
    poses: Vec<FitPose>,
    rms_initial_m: f64,
    rms_m: f64,
    parameters: Vec<f64>,
    std: Vec<f64>,
    singular_values_all_scaled: Vec<f64>,
    condition_free_scaled: f64,
}

#[derive(Deserialize)]
struct FitRobot {
    joints: String,
    initial: Vec<f64>,
    free: Vec<usize>,
}

#[derive(Deserialize)]
struct FitPose {
    chuck: usize,
    sphere: usize,
    q: Vec<f64>,
    length_m: f64,
}

fn kinds(letters: &str) -> Vec<JointKind> {
    letters.chars().map(|letter| if letter == 'P' { JointKind::Prismatic } else { JointKind::Revolute }).collect()
}

/// The largest `|a − b| / max(1, |b|)`.
fn worst_relative(pairs: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    // `f64::max` would drop a NaN, and with it a failure.
    let worse = |worst: f64, error: f64| if error <= worst { worst } else { error };
    pairs.into_iter().map(|(a, b)| (a - b).abs() / b.abs().max(1.0)).fold(0.0, worse)
}

/// Pose, length and gradient in the precision of `S`, all beside the golden ones; the worst relative error.
fn worst_of_pose<S: Real>(chain: &Chain<f64>, pose: &CasePose) -> f64 {
    let vector = |v: [f64; 3]| Vector3::from(v.map(S::nearest));
    let kinematics = Kinematics::new(&chain.cast::<S>());
    let q = chain.joint_vector(&pose.q).unwrap().cast::<S>();
    let pairing = Pairing { chuck_base_m: vector(pose.chuck_m), sphere_tool_m: vector(pose.sphere_m) };

    let found = kinematics.base_from_tool(&q);
    let rotation: Matrix3<f64> = found.rotation.map(S::widen);
    let of_pose = (0..3).flat_map(|row| {
        let golden = &pose.base_from_tool[row];
        let turned = (0..3).map(move |column| (rotation[(row, column)], golden[column]));
        turned.chain([(found.translation_m[row].widen(), golden[3])])
    });

    let mut gradient = [S::zero(); MAX_PARAMETERS];
    let length_with_gradient = kinematics.gradient(Quantity::Length, &q, &pairing, &mut gradient).value_m;
    assert_eq!(pose.gradient.len(), chain.parameter_count());
    let of_gradient = gradient.iter().zip(&pose.gradient).map(|(a, &b)| (a.widen(), b));
    let lengths = [kinematics.length(&q, &pairing), length_with_gradient].map(|length| (length.widen(), pose.length_m));
    worst_relative(of_pose.chain(of_gradient).chain(lengths))
}

fn assert_kinematics<S: Real>(tolerance: f64) {
    let file: KinematicsFile = golden("kinematics.json");
    assert_eq!(file.cases.len(), 26);
    let mut worst = 0.0_f64;
    for case in &file.cases {
        let chain = Chain::new(&kinds(&case.joints), &case.parameters).unwrap();
        assert!(!case.poses.is_empty());
        for (i, pose) in case.poses.iter().enumerate() {
            let error = worst_of_pose::<S>(&chain, pose);
            assert!(error <= tolerance, "{}, pose {i}: off by {error:e}", case.name);
            worst = worst.max(error);
        }
    }
    println!("worst error {worst:e}");
}

#[test]
fn kinematics_and_gradients_in_f64_agree_with_fifty_digits() {
    assert_kinematics::<f64>(1e-12);
}

/// The largest error is 9.8e-7, in f32 roundings (6e-8) sixteen: joint values of 3 rad turn levers of metres, eight in a row.
#[test]
fn kinematics_and_gradients_in_f32_agree_with_fifty_digits() {
    assert_kinematics::<f32>(2e-6);
}

struct FitProblem {
    file: FitFile,
    chain: Chain<f64>,
    measurements: Vec<Measurement<f64>>,
    free: FreeParameters,
}

impl FitProblem {
    fn load() -> Self {
        let file: FitFile = golden("fit.json");
        let chain = Chain::new(&kinds(&file.robot.joints), &file.robot.initial).unwrap();
        let measurement = |pose: &FitPose| {
            Measurement::new(
                Pairing { chuck_base_m: file.chucks_m[pose.chuck].into(), sphere_tool_m: file.spheres_m[pose.sphere].into() },
                chain.joint_vector(&pose.q).unwrap(),
                pose.length_m,
            )
        };
        let measurements = file.poses.iter().map(measurement).collect();
        let free = FreeParameters::from_indices(file.robot.free.iter().copied()).unwrap();
        Self { chain, measurements, free, file }
    }

    fn solve(&self, free: &FreeParameters, damping: Damping) -> Solution {
        let solution = solve_lengths(&self.chain, &self.measurements, free, &LmOptions { damping, ..LmOptions::default() });
        assert!(solution.status.is_minimum(), "{damping:?} ended as {:?}", solution.status);
        solution
    }
}

fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found:e}, expected {expected:e} within {tolerance:e}");
}

const DAMPINGS: [Damping; 2] = [Damping::Identity, Damping::Diagonal];

#[test]
fn the_fit_ends_where_scipy_ends_under_both_dampings() {
    let problem = FitProblem::load();
    for damping in DAMPINGS {
        let solution = problem.solve(&problem.free, damping);
        let history = &solution.rms_history_m;
        assert_close("rms at the start", history[0], problem.file.rms_initial_m, 1e-12);
        assert_close("rms at the end", history[history.len() - 1], problem.file.rms_m, 1e-12);
        // Held parameters are in the file as well, at their initial values.
        for (i, (&found, &expected)) in solution.chain.parameters().iter().zip(&problem.file.parameters).enumerate() {
            let tolerance = if problem.free.contains(i) { 1e-10 } else { 0.0 };
            assert_close(&format!("{damping:?}, parameter {i}"), found, expected, tolerance);
        }
    }
}

#[test]
fn standard_deviations_and_condition_are_those_of_the_reference() {
    let problem = FitProblem::load();
    for damping in DAMPINGS {
        let fitted = problem.solve(&problem.free, damping).chain;
        let free: Vec<usize> = problem.free.indices().collect();
        let uncertainty = Uncertainty::new(&Observation::new(&fitted, &problem.measurements), &free);
        assert_eq!(uncertainty.std.len(), problem.file.std.len());
        for (i, (found, &expected)) in uncertainty.std.iter().zip(&problem.file.std).enumerate() {
            assert_close(&format!("deviation {i}"), found.unwrap(), expected, 1e-7 * expected);
        }
        let condition = problem.file.condition_free_scaled;
        assert_close("condition", uncertainty.spectrum.condition(), condition, 1e-7 * condition);
    }
}

#[test]
fn thirty_six_singular_values_agree_and_eighteen_vanish() {
    let problem = FitProblem::load();
    let fitted = problem.solve(&problem.free, Damping::Identity).chain;
    let spectrum = Spectrum::new(&Observation::new(&fitted, &problem.measurements).jacobian);
    let expected = &problem.file.singular_values_all_scaled;
    assert_eq!((spectrum.rank, spectrum.singular_values.len(), expected.len()), (36, 54, 54));
    for (i, (&found, &expected)) in spectrum.singular_values.iter().zip(expected).enumerate().take(36) {
        assert_close(&format!("singular value {i}"), found, expected, 1e-9 * expected);
    }
    for (i, &null) in spectrum.singular_values.iter().enumerate().skip(36) {
        assert!(null < 1e-12 * spectrum.singular_values[0], "singular value {i} is {null:e}");
    }
}

#[test]
fn all_parameters_free_reach_the_same_cost_elsewhere() {
    let problem = FitProblem::load();
    for damping in DAMPINGS {
        let solution = problem.solve(&FreeParameters::all(problem.chain.parameter_count()), damping);
        assert_close("rms", *solution.rms_history_m.last().unwrap(), problem.file.rms_m, 1e-12);
        // The redundant directions let it wander: here a parameter that the other fit holds has moved.
        let apart = solution.chain.parameters().iter().zip(&problem.file.parameters).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) > 1e-4, "{damping:?}: the same parameters");
    }
}

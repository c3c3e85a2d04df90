//! How far `f32` kinematics, which is what the board computes, are from `f64` ones: over random poses of the PUMA 560 within
//! its limits, at the same `f32` joint values, so that the encoders' own resolution stays out of it.

use ballbar::{Chain, JointVector, Kinematics, MAX_PARAMETERS, PARAMETERS_PER_JOINT, Pairing, ParameterKind, Vector3};
use host_cal::files::{Rig, Robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ROBOTS: [&str; 2] = ["puma560", "puma560-optimised"];

/// Both precisions of a robot.
struct Both {
    f64: Kinematics<f64>,
    f32: Kinematics<f32>,
    chain: Chain<f64>,
}

/// Random poses of a robot within its limits: the same joint vector in both precisions.
fn for_random_poses(name: &str, poses: usize, mut check: impl FnMut(&Both, JointVector<f64>, JointVector<f32>)) {
    let Robot { chain, limits, .. } = Robot::open(name).unwrap();
    let both = Both { f64: Kinematics::new(&chain), f32: Kinematics::new(&chain.cast::<f32>()), chain };
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    for _ in 0..poses {
        let q: Vec<f64> = limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let rounded = both.chain.joint_vector(&q).unwrap().cast::<f32>();
        check(&both, rounded.cast(), rounded);
    }
}

/// The larger one; unlike `f64::max` it keeps a NaN, so that one fails the test.
fn worse(worst: f64, error: f64) -> f64 {
    if error <= worst { worst } else { error }
}

fn widen(point: Vector3<f32>) -> Vector3<f64> {
    point.map(f64::from)
}

/// Measured over the million poses: at most 0.98 µm and 2.0e-6 rad; half a micrometre is typical of the worst in ten thousand.
#[test]
fn the_tool_pose_in_f32_is_within_a_micrometre() {
    for name in ROBOTS {
        let (mut worst_m, mut worst_rotation) = (0.0, 0.0);
        for_random_poses(name, 500_000, |both, q64, q32| {
            let (exact, rounded) = (both.f64.base_from_tool(&q64), both.f32.base_from_tool(&q32));
            worst_m = worse(worst_m, (widen(rounded.translation_m) - exact.translation_m).norm());
            worst_rotation = worse(worst_rotation, (rounded.rotation.map(f64::from) - exact.rotation).norm());
        });
        println!("{name}: {:.3} µm, rotation {worst_rotation:.2e}", worst_m * 1e6);
        assert!(worst_m <= 1e-6, "{name}: {:.3} µm", worst_m * 1e6);
        assert!(worst_rotation <= 2.5e-6, "{name}: {worst_rotation:e}");
    }
}

#[test]
fn a_sphere_in_f32_is_within_a_micrometre() {
    let rig = Rig::open("triangles").unwrap();
    for name in ROBOTS {
        let mut worst_m = 0.0;
        for_random_poses(name, 100_000, |both, q64, q32| {
            for sphere in &rig.spheres {
                let exact = both.f64.point_in_base(&q64, &sphere.position_m);
                let rounded = both.f32.point_in_base(&q32, &sphere.position_m.cast::<f32>());
                worst_m = worse(worst_m, (widen(rounded) - exact).norm());
            }
        });
        println!("{name}: sphere {:.3} µm", worst_m * 1e6);
        assert!(worst_m <= 1.2e-6, "{name}: {:.3} µm", worst_m * 1e6);
    }
}

#[test]
fn gradient_rows_in_f32_are_close_to_those_in_f64() {
    let rig = Rig::open("triangles").unwrap();
    for name in ROBOTS {
        let (mut worst, mut worst_scale, mut worst_length_m) = (0.0, 0.0, 0.0);
        for_random_poses(name, 50_000, |both, q64, q32| {
            for id in rig.all_pairings() {
                let pairing = rig.pairing(id);
                let rounded = Pairing { chuck_base_m: pairing.chuck_base_m.cast(), sphere_tool_m: pairing.sphere_tool_m.cast() };
                let (mut row64, mut row32) = ([0.0; MAX_PARAMETERS], [0.0_f32; MAX_PARAMETERS]);
                let length_m = both.f64.length_gradient(&q64, &pairing, &mut row64);
                let length_m_32 = both.f32.length_gradient(&q32, &rounded, &mut row32);
                if length_m < 0.3 { continue; }
                worst_length_m = worse(worst_length_m, (f64::from(length_m_32) - length_m).abs());
                for i in 0..both.chain.parameter_count() {
                    let error = (f64::from(row32[i]) - row64[i]).abs();
                    if i % PARAMETERS_PER_JOINT == ParameterKind::Scale as usize { worst_scale = worse(worst_scale, error) } else { worst = worse(worst, error) }
                }
            }
        });
        println!("{name}: rows {worst:.2e}, scale columns {worst_scale:.2e}, lengths {:.3} µm", worst_length_m * 1e6);
    }
}

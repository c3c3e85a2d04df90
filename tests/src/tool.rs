//! How far a tool's spheres are from where a chain says they are: what a calibration is for.

use ballbar::{Chain, Kinematics, Vector3};
use ballbar_calib::model::{Rig, Robot};
use nalgebra::Matrix3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// RMS distance of the spheres over random joint vectors, metres.
pub fn at_spheres_m(truth: &Chain<f64>, found: &Chain<f64>, robot: &Robot, rig: &Rig) -> f64 {
    let pairs = spheres(truth, robot, rig).into_iter().zip(spheres(found, robot, rig));
    rms(pairs.map(|(a, b)| a - b))
}

/// The same after the best rigid motion of the whole robot (W. Kabsch, Acta Crystallographica A32, 1976): what is the robot's own.
pub fn at_spheres_aligned_m(truth: &Chain<f64>, found: &Chain<f64>, robot: &Robot, rig: &Rig) -> f64 {
    let (truth, found) = (spheres(truth, robot, rig), spheres(found, robot, rig));
    let centre = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (centre_a, centre_b) = (centre(&truth), centre(&found));
    let covariance: Matrix3<f64> = truth.iter().zip(&found).map(|(a, b)| (b - centre_b) * (a - centre_a).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v) = (svd.u.expect("asked for"), svd.v_t.expect("asked for").transpose());
    let side = (v * u.transpose()).determinant().signum();
    let turn = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, side)) * u.transpose();
    rms(truth.iter().zip(&found).map(|(a, b)| (a - centre_a) - turn * (b - centre_b)))
}

fn spheres(chain: &Chain<f64>, robot: &Robot, rig: &Rig) -> Vec<Vector3<f64>> {
    const POSES: usize = 300;
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let kinematics = Kinematics::new(chain);
    let mut points_m = Vec::new();
    for _ in 0..POSES {
        let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let tool = kinematics.base_from_tool(&chain.joint_vector(&q).expect("as many as joints"));
        points_m.extend(rig.spheres.iter().map(|sphere| tool.rotation * sphere.position_m + tool.translation_m));
    }
    points_m
}

fn rms(differences: impl Iterator<Item = Vector3<f64>>) -> f64 {
    let squares: Vec<f64> = differences.map(|by| by.norm_squared()).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

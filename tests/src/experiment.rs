//! Simulated experiments on a PUMA 560 for the tests of identification.

use ballbar::Chain;
use ballbar_calib::model::{Dataset, PoseRow, Rig, Robot};
use ballbar_calib::simulate::Shells;
use host_cal::files::{open_rig, open_robot};

/// Design, truth and rig of the paper's experiment.
pub struct Puma {
    /// Table II, design.
    pub design: Robot,
    /// Table II, optimised.
    pub truth: Robot,
    /// The built-in triangles.
    pub rig: Rig,
}

impl Default for Puma {
    fn default() -> Self {
        let open = |name| open_robot(name).expect("built in");
        Self { design: open("puma560"), truth: open("puma560-optimised"), rig: open_rig("triangles").expect("built in") }
    }
}

impl Puma {
    /// Poses of all nine pairings on shells of one radius.
    pub fn shells(&self, radius_m: f64, per_pairing: usize, sigma_m: f64, seed: u64) -> Dataset {
        let pairings = self.rig.all_pairings();
        let shells = Shells {
            planned_with: &self.design,
            truth: &self.truth,
            rig: &self.rig,
            pairings: &pairings,
            bar_m: radius_m,
            per_pairing,
            sigma_m,
            seed,
        };
        let poses = shells.simulate(|| ()).expect("within reach");
        dataset(poses.into_iter().map(|pose| pose.row).collect())
    }
}

/// Rows as if they had been read from one file.
pub fn dataset(rows: Vec<PoseRow>) -> Dataset {
    Dataset { rows, files: vec!["simulated".to_owned()] }
}

/// Largest difference of two chains' parameters, SI.
pub fn worst_parameter_difference(a: &Chain<f64>, b: &Chain<f64>) -> f64 {
    a.parameters().iter().zip(b.parameters()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

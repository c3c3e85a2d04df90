//! Simulated experiments on a PUMA 560 for the tests of identification.

use ballbar::Chain;
use ballbar_calib::model::{Dataset, PairingId, PoseRow, Rig, Robot};
use ballbar_calib::simulate::Shells;
use host_cal::files::{open_rig, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
        let Self { design, truth, rig } = self;
        let cell = Cell { design: design.clone(), truth: truth.clone(), rig: rig.clone() };
        cell.measured(radius_m, per_pairing, sigma_m, seed)
    }
}

/// Any built-in robot that is not quite as designed, and a rig that it is measured with.
pub struct Cell {
    /// As its file says.
    pub design: Robot,
    /// As it is.
    pub truth: Robot,
    /// The built-in triangles, until another is put here.
    pub rig: Rig,
}

impl Cell {
    /// Of a built-in robot: off by up to 2 mm, 0.17° and 3e-4 in each parameter.
    pub fn new(robot: &str, seed: u64) -> Self {
        let design = open_robot(robot).expect("built in");
        let mut truth = design.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for (i, value) in truth.chain.parameters_mut().iter_mut().enumerate() {
            // Millimetres, tenths of a degree, and of a scale what gears are off.
            let most = match i % 8 {
                0..3 => 2e-3,
                3..7 => 3e-3,
                _ => 3e-4,
            };
            *value += rng.random_range(-most..most);
        }
        Self { design, truth, rig: open_rig("triangles").expect("built in") }
    }

    /// Lengths of all pairings.
    pub fn measured(&self, bar_m: f64, per_pairing: usize, sigma_m: f64, seed: u64) -> Dataset {
        self.measured_at(&self.rig.all_pairings(), bar_m, per_pairing, sigma_m, seed)
    }

    /// Lengths of some pairings.
    pub fn measured_at(&self, pairings: &[PairingId], bar_m: f64, per_pairing: usize, sigma_m: f64, seed: u64) -> Dataset {
        let shells = Shells {
            planned_with: &self.design,
            truth: &self.truth,
            rig: &self.rig,
            pairings,
            bar_m,
            per_pairing,
            sigma_m,
            seed,
        };
        dataset(shells.simulate(|| ()).expect("within reach").into_iter().map(|pose| pose.row).collect())
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

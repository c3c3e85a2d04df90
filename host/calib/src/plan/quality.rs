//! How well a set of poses will tell the parameters, before any is measured.

use std::fmt;

use ballbar::{Chain, Kinematics, Measurement, Parameter, Vector3};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cell::plausible_deviation;
use super::experience::NOISE_M;
use super::information::information_of;
use crate::identify::{Identifiability, Observation, Spectrum};
use crate::kinematics::position_jacobian;
use crate::model::JointLimits;
use crate::units::mm_from_m;

/// Indices of observability of a set of poses, from the singular values `σ` of its Jacobian over an independent subset of parameters,
/// each column times the parameter's plausible deviation: millimetres of length a deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Quality {
    /// Poses.
    pub poses: usize,
    /// Parameters of the subset.
    pub parameters: usize,
    /// `log10 det(JᵀJ)`, with lengths in millimetres. Largest for D-optimal sets.
    pub log10_determinant: f64,
    /// `(Π σ)^(1/k) / √poses`, which does not grow with the poses (J.-H. Borm and C.-H. Menq, Int. J. Robotics Research 10(1), 1991).
    pub mean_sensitivity_mm: f64,
    /// Largest over smallest singular value.
    pub condition: f64,
    /// Smallest singular value, millimetres a deviation.
    pub smallest_singular_mm: f64,
    /// `σ_min² / σ_max`, the noise amplification index (A. Nahvi and J. M. Hollerbach, IEEE ICRA 1996); the larger the better.
    pub noise_amplification_index_mm: f64,
    /// RMS error of the tool over the workspace that independent noise of the lengths leaves, as a multiple of that noise.
    pub amplification: f64,
}

/// Which parameters a set of poses tells, and how independently.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Expectation {
    /// Parameters that can be told.
    pub rank: usize,
    /// The most that the chain has (eq. 1).
    pub independent: usize,
    /// Largest over smallest singular value of the identified columns, scaled to unit norm.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub condition: f64,
    /// Indices of an independent subset, ascending.
    pub identified: Vec<usize>,
}

impl Expectation {
    /// Judges poses by the chain's Jacobian there.
    pub fn new(chain: &Chain<f64>, measurements: &[Measurement<f64>], limits: &[JointLimits]) -> Self {
        let found = Identifiability::new(chain, measurements, limits, &[]);
        let identified = found.identified();
        let jacobian = Observation::new(chain, measurements).jacobian;
        Self {
            rank: found.spectrum.rank,
            independent: chain.independent_parameters(),
            condition: Spectrum::of_columns(&jacobian, &identified).condition(),
            identified,
        }
    }
}

impl Quality {
    /// Judges poses over a subset of the parameters; `None` when they do not tell all of it.
    pub fn new(chain: &Chain<f64>, measurements: &[Measurement<f64>], limits: &[JointLimits], subset: &[usize]) -> Option<Self> {
        const MM: f64 = 1e3;
        let scales: Vec<f64> =
            subset.iter().map(|&index| MM * plausible_deviation(chain.unit(Parameter::from_index(index)))).collect();
        let count = subset.len();
        let eigen = information_of(chain, measurements, subset, &scales).symmetric_eigen();
        let (least, most) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
        // Below this an eigenvalue of JᵀJ is rounding.
        if count == 0 || least <= 1e-13 * most {
            return None;
        }
        let log10_determinant = eigen.eigenvalues.iter().map(|value| value.log10()).sum::<f64>();
        let covariance = {
            let inverse = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| 1.0 / value));
            &eigen.eigenvectors * inverse * eigen.eigenvectors.transpose()
        };
        let poses = measurements.len();
        Some(Self {
            poses,
            parameters: count,
            log10_determinant,
            mean_sensitivity_mm: 10.0_f64.powf(log10_determinant / (2.0 * count as f64)) / (poses as f64).sqrt(),
            condition: (most / least).sqrt(),
            smallest_singular_mm: least.sqrt(),
            noise_amplification_index_mm: least / most.sqrt(),
            amplification: amplification(chain, limits, subset, &scales, &covariance),
        })
    }
}

/// Why no fit to some poses could be trusted, whatever is measured at them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Unfit {
    /// No more poses than parameters: lengths can be met exactly, noise and all.
    FewPoses {
        /// Poses.
        poses: usize,
        /// Parameters to be told.
        parameters: usize,
    },
    /// Some parameters change no length, or only as others do.
    Rank {
        /// Parameters that can be told.
        rank: usize,
        /// Parameters to be told.
        parameters: usize,
    },
    /// Noise alone would move the tool farther than a design is plausibly off.
    Noise {
        /// RMS error of the tool as a multiple of the noise.
        amplification: f64,
        /// RMS error of the tool by usual noise, metres.
        tool_m: f64,
        /// RMS error of the tool by what a design is plausibly off, metres.
        design_m: f64,
    },
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::FewPoses { poses, parameters } => write!(
                f,
                "{poses} poses for {parameters} parameters: a fit would take noise for parameters, expected three times as many poses"
            ),
            Self::Rank { rank, parameters } => write!(
                f,
                "these poses identify {rank} of {parameters} parameters: a fit would leave the others at their design values"
            ),
            Self::Noise { amplification, tool_m, design_m } => write!(
                f,
                "noise of the lengths reaches the tool {amplification:.0} times as large, {:.1} mm by usual noise; that is more than a design \
                 is plausibly off, {:.1} mm, and a fit would do harm",
                mm_from_m(tool_m),
                mm_from_m(design_m)
            ),
        }
    }
}

impl Unfit {
    /// Judges poses; `quality` is over [`Expectation::identified`].
    pub fn of(
        chain: &Chain<f64>,
        limits: &[JointLimits],
        poses: usize,
        expectation: &Expectation,
        quality: Option<&Quality>,
    ) -> Option<Self> {
        let parameters = expectation.independent;
        if poses <= parameters {
            return Some(Self::FewPoses { poses, parameters });
        }
        let quality = quality.filter(|_| expectation.rank >= parameters);
        let Some(quality) = quality else { return Some(Self::Rank { rank: expectation.rank, parameters }) };
        let tool_m = quality.amplification * NOISE_M;
        let design_m = design_error_m(chain, limits, &expectation.identified);
        (tool_m > design_m).then_some(Self::Noise { amplification: quality.amplification, tool_m, design_m })
    }
}

/// RMS error of the tool over the workspace when every parameter of an independent subset is off by its plausible deviation, metres.
fn design_error_m(chain: &Chain<f64>, limits: &[JointLimits], subset: &[usize]) -> f64 {
    let scales: Vec<f64> = subset.iter().map(|&index| plausible_deviation(chain.unit(Parameter::from_index(index)))).collect();
    amplification(chain, limits, subset, &scales, &DMatrix::identity(subset.len(), subset.len()))
}

/// `√(mean trace(P C Pᵀ))` over random poses, `P` the tool's position by the scaled parameters.
fn amplification(chain: &Chain<f64>, limits: &[JointLimits], subset: &[usize], scales: &[f64], covariance: &DMatrix<f64>) -> f64 {
    const POSES: usize = 200;
    let kinematics = Kinematics::new(chain);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut sum = 0.0;
    for _ in 0..POSES {
        let q: Vec<f64> = limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let Ok(q) = chain.joint_vector(&q) else { continue };
        let (_, jacobian) = position_jacobian(&kinematics, &q, &Vector3::zeros());
        let mut scaled = jacobian.select_columns(subset);
        scaled.column_iter_mut().zip(scales).for_each(|(mut column, scale)| column *= *scale);
        sum += (&scaled * covariance).dot(&scaled);
    }
    (sum / POSES as f64).sqrt()
}

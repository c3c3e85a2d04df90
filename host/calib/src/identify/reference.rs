//! An experiment that excites whatever can be excited: what is dependent there is dependent in every experiment.

use ballbar::{Chain, Kinematics, LANES, LengthRows, Measurement, Pairing, Parameter, Vector3};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pivoting::PivotedColumns;
use super::spectrum::{RANK_THRESHOLD, Spectrum, column_scales};
use crate::model::JointLimits;

/// Random poses within the limits, random pairings of three chucks and three spheres.
#[derive(Clone, Debug)]
struct Reference {
    measurements: Vec<Measurement<f64>>,
}

impl Reference {
    /// Of a chain: the same poses for every way to write it.
    fn new(chain: &Chain<f64>, limits: &[JointLimits]) -> Self {
        const ROWS_PER_PARAMETER: usize = 4;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut point = |reach_m: f64| Vector3::from_fn(|_, _| rng.random_range(-reach_m..reach_m));
        let chucks: [Vector3<f64>; 3] = std::array::from_fn(|_| point(1.0));
        let spheres: [Vector3<f64>; 3] = std::array::from_fn(|_| point(0.2));
        let measurement = |i: usize| {
            let q: Vec<f64> = limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
            let pairing = Pairing { chuck_base_m: chucks[i % 3], sphere_tool_m: spheres[i / 3 % 3] };
            let q = chain.joint_vector(&q).ok()?;
            Some(Measurement::new(pairing, q, 0.0))
        };
        Self { measurements: (0..ROWS_PER_PARAMETER * chain.parameter_count()).filter_map(measurement).collect() }
    }

    /// `∂computed/∂parameter` of all parameters of a chain, a row a pose.
    fn jacobian(&self, chain: &Chain<f64>) -> DMatrix<f64> {
        let kinematics = Kinematics::new(chain);
        let mut swept = LengthRows::default();
        let mut jacobian = DMatrix::zeros(self.measurements.len(), chain.parameter_count());
        for (block, measurements) in self.measurements.chunks(LANES).enumerate() {
            swept.compute(&kinematics, measurements);
            for (index, mut column) in jacobian.column_iter_mut().enumerate() {
                let lanes = swept.chain(index).iter().take(measurements.len());
                lanes.enumerate().for_each(|(lane, &value)| column[block * LANES + lane] = value);
            }
        }
        jacobian
    }
}

/// What of a chain's parameters is dependent in every experiment.
#[derive(Clone, Debug)]
pub(super) struct Dependence {
    /// The parameters that the paper holds.
    held_in_paper: Vec<bool>,
    /// Of the reference, a column a parameter.
    pub(super) jacobian: DMatrix<f64>,
    rank: usize,
}

impl Dependence {
    /// Of a chain as it is written, its joints within these limits.
    pub(super) fn new(chain: &Chain<f64>, limits: &[JointLimits]) -> Self {
        let jacobian = Reference::new(chain, limits).jacobian(chain);
        let rank = Spectrum::new(&jacobian).rank;
        let held_in_paper = (0..chain.parameter_count()).map(|index| chain.is_conventionally_held(Parameter::from_index(index)));
        Self { held_in_paper: held_in_paper.collect(), jacobian, rank }
    }

    /// Independent parameters, ascending: those at `first` before those that the paper frees, and these before the others; none of those
    /// that are set `apart`.
    pub(super) fn independent(&self, first: &[usize], apart: &[usize]) -> Vec<usize> {
        let others = (0..self.held_in_paper.len()).filter(|index| !first.contains(index) && !apart.contains(index));
        let (last, usual): (Vec<usize>, Vec<usize>) = others.partition(|&index| self.held_in_paper[index]);
        independent_columns(&[first.to_vec(), usual, last], &self.jacobian, self.rank)
    }
}

/// A largest independent subset of the columns at `groups` (which together name each index at most once), ascending: as many as possible
/// of the first group, then of the next after what those before it explain. In each group in the order of what the scaled columns add.
pub(super) fn independent_columns(groups: &[Vec<usize>], jacobian: &DMatrix<f64>, rank: usize) -> Vec<usize> {
    let scales = column_scales(jacobian);
    let scaled = |&index: &usize| jacobian.column(index) / scales[index];
    let mut basis = DMatrix::zeros(jacobian.nrows(), 0);
    let mut chosen: Vec<usize> = Vec::new();
    for group in groups.iter().filter(|group| !group.is_empty()) {
        let columns = DMatrix::from_columns(&group.iter().map(scaled).collect::<Vec<_>>());
        let unexplained = &columns - &basis * basis.tr_mul(&columns);
        // Scaled columns have unit norm, so pivots compare with 1.
        let added = PivotedColumns::new(unexplained, RANK_THRESHOLD);
        chosen.extend(added.order.iter().map(|&k| group[k]));
        basis = DMatrix::from_fn(basis.nrows(), basis.ncols() + added.basis.ncols(), |row, column| {
            column.checked_sub(basis.ncols()).map_or_else(|| basis[(row, column)], |beyond| added.basis[(row, beyond)])
        });
    }
    chosen.truncate(rank);
    chosen.sort_unstable();
    chosen
}

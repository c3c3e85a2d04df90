//! Residuals of a set of poses: in all, by pairing, and those that stand out.

use ballbar::{Chain, Kinematics};

use crate::files::{Dataset, PairingId};

/// Size of a set of residuals, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualSummary {
    /// How many.
    pub count: usize,
    /// Root of the mean square.
    pub rms_m: f64,
    /// Mean.
    pub mean_m: f64,
    /// Largest size.
    pub max_abs_m: f64,
}

impl ResidualSummary {
    /// Summarises residuals (unweighted).
    pub fn new(residuals_m: &[f64]) -> Self {
        let count = residuals_m.len() as f64;
        Self {
            count: residuals_m.len(),
            rms_m: (residuals_m.iter().map(|f| f * f).sum::<f64>() / count).sqrt(),
            mean_m: residuals_m.iter().sum::<f64>() / count,
            max_abs_m: residuals_m.iter().fold(0.0, |largest, f| largest.max(f.abs())),
        }
    }
}

/// Residuals of one pairing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairingResiduals {
    /// Which.
    pub pairing: PairingId,
    /// Their size.
    pub summary: ResidualSummary,
}

/// Residuals `f = d_measured − d_computed` of all rows, metres.
pub fn residuals_m(chain: &Chain<f64>, dataset: &Dataset) -> Vec<f64> {
    let kinematics = Kinematics::new(chain);
    dataset.rows.iter().map(|row| kinematics.residual(&row.measurement)).collect()
}

/// Summaries by pairing, in the rig's order.
pub fn by_pairing(dataset: &Dataset, residuals_m: &[f64]) -> Vec<PairingResiduals> {
    let of = |pairing: PairingId| -> Vec<f64> {
        dataset.rows.iter().zip(residuals_m).filter(|(row, _)| row.pairing == pairing).map(|(_, &f)| f).collect()
    };
    let summarise = |pairing| PairingResiduals { pairing, summary: ResidualSummary::new(&of(pairing)) };
    dataset.pairings().into_iter().map(summarise).collect()
}

/// Which test an outlier failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutlierTest {
    /// It is far from all residuals.
    All,
    /// It is far from those measured just before and after it: an outlier that a drift would hide.
    Neighbours,
}

/// A row whose residual stands out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// Row index, from 0.
    pub row: usize,
    /// Distance from the median, in robust standard deviations.
    pub score: f64,
    /// The test that shows it most clearly.
    pub test: OutlierTest,
}

/// Residuals beyond this many robust standard deviations stand out: one in 1.7 million of normal ones.
const OUTLIER_SCORE: f64 = 5.0;
/// Neighbours on either side (Hampel's identifier).
const NEIGHBOURS: usize = 5;
/// Below this spread residuals are rounding, and nothing stands out.
const SMALLEST_SPREAD_M: f64 = 1e-12;

/// Rows that stand out from all others or from their neighbours of the same pairing, the worst first.
pub fn outliers(dataset: &Dataset, residuals_m: &[f64]) -> Vec<Outlier> {
    let middle = median(residuals_m.to_vec());
    let global = scores(&residuals_m.iter().map(|f| f - middle).collect::<Vec<_>>());
    let local = scores(&deviations_from_neighbours(dataset, residuals_m));
    let rows = global.iter().zip(&local).enumerate();
    let mut outliers: Vec<Outlier> = rows
        .map(|(row, (&all, &neighbours))| {
            if all.abs() >= neighbours.abs() {
                Outlier { row, score: all, test: OutlierTest::All }
            } else {
                Outlier { row, score: neighbours, test: OutlierTest::Neighbours }
            }
        })
        .filter(|outlier| outlier.score.abs() > OUTLIER_SCORE)
        .collect();
    outliers.sort_by(|a, b| b.score.abs().total_cmp(&a.score.abs()));
    outliers
}

/// Correlation of each residual with the next one of the same pairing, in the order of measurement; `None` for fewer than
/// twenty such neighbours. Independent noise gives `0 ± 1/√n`.
pub fn neighbour_correlation(dataset: &Dataset, residuals_m: &[f64]) -> Option<f64> {
    const FEWEST: usize = 20;
    let (mut products, mut squares, mut count) = (0.0, 0.0, 0);
    for pairing in dataset.pairings() {
        let rows = (0..residuals_m.len()).filter(|&i| dataset.rows[i].pairing == pairing);
        let of_pairing: Vec<f64> = rows.map(|i| residuals_m[i]).collect();
        products += of_pairing.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
        squares += of_pairing.iter().map(|f| f * f).sum::<f64>();
        count += of_pairing.len().saturating_sub(1);
    }
    (count >= FEWEST && squares > 0.0).then(|| products / squares)
}

/// Each residual less the median of those around it, pairing by pairing, in the order of measurement.
fn deviations_from_neighbours(dataset: &Dataset, residuals_m: &[f64]) -> Vec<f64> {
    let mut deviations = vec![0.0; residuals_m.len()];
    for pairing in dataset.pairings() {
        let rows: Vec<usize> = (0..residuals_m.len()).filter(|&i| dataset.rows[i].pairing == pairing).collect();
        for (k, &row) in rows.iter().enumerate() {
            let window = rows[k.saturating_sub(NEIGHBOURS)..rows.len().min(k + NEIGHBOURS + 1)].iter();
            let around: Vec<f64> = window.filter(|&&other| other != row).map(|&other| residuals_m[other]).collect();
            if !around.is_empty() {
                deviations[row] = residuals_m[row] - median(around);
            }
        }
    }
    deviations
}

/// Deviations in units of their robust spread: 1.4826 times the median of their sizes, which is σ where they are normal.
fn scores(deviations_m: &[f64]) -> Vec<f64> {
    let spread = 1.4826 * median(deviations_m.iter().map(|d| d.abs()).collect());
    if spread < SMALLEST_SPREAD_M {
        return vec![0.0; deviations_m.len()];
    }
    deviations_m.iter().map(|d| d / spread).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[n / 2],
        n => (values[n / 2 - 1] + values[n / 2]) / 2.0,
    }
}

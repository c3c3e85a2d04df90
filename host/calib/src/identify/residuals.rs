//! Residuals of a set of poses: in all, by pairing, and those that stand out.

use ballbar::Kinematics;

use super::residual::{Residual, ResidualSummary, median};
use super::trend::correlation_of_neighbours;
use crate::model::{Dataset, PairingId, PoseRow};

/// Residuals of one pairing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PairingResiduals {
    /// Which.
    pub pairing: PairingId,
    /// Their size.
    pub summary: ResidualSummary,
}

/// Residuals of all rows, in their order, by kinematics that may have joint terms.
pub fn residuals(kinematics: &Kinematics<f64>, dataset: &Dataset) -> Vec<Residual> {
    let of = |row: &PoseRow| {
        let measurement = &row.measurement;
        let computed_m = kinematics.configuration(&measurement.q, row.approach).length(&measurement.pairing);
        Residual { value_m: measurement.length_m - computed_m, weight: measurement.weight }
    };
    dataset.rows.iter().map(of).collect()
}

/// Summaries by pairing, in the rig's order.
pub fn by_pairing(dataset: &Dataset, residuals: &[Residual]) -> Vec<PairingResiduals> {
    let summarise = |pairing| {
        let of_pairing: Vec<Residual> = dataset.rows_of(pairing).map(|row| residuals[row]).collect();
        PairingResiduals { pairing, summary: ResidualSummary::new(&of_pairing) }
    };
    dataset.pairings().into_iter().map(summarise).collect()
}

/// Which test an outlier failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum OutlierTest {
    /// It is far from all residuals.
    All,
    /// It is far from those measured just before and after it: an outlier that a drift would hide.
    Neighbours,
}

/// A row whose residual stands out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Outlier {
    /// Row index, from 0.
    pub row: usize,
    /// Distance from the median, in robust standard deviations.
    pub score: f64,
    /// The test that shows it most clearly.
    pub test: OutlierTest,
}

/// Neighbours in the order of measurement that are alike beyond this correlation drift together.
pub const ALIKE: f64 = 0.5;
/// Residuals beyond this many robust standard deviations stand out: one in 1.7 million of normal ones.
const OUTLIER_SCORE: f64 = 5.0;
/// Neighbours on either side, as in Hampel's identifier; the spread is that of all rows, since eleven give a poor one.
const NEIGHBOURS: usize = 5;
/// Below this spread, a nanometre, residuals are the rounding of a file's digits, and nothing stands out.
const SMALLEST_SPREAD_M: f64 = 1e-9;

/// Rows that stand out from all others or from their neighbours of the same pairing, the worst first: by the median and the median absolute
/// deviation (F. R. Hampel, J. American Statistical Association 69, 1974). `residuals` has one entry a row.
pub fn outliers(dataset: &Dataset, residuals: &[Residual]) -> Vec<Outlier> {
    let residuals_m: &[f64] = &residuals.iter().map(|f| f.whitened_m()).collect::<Vec<_>>();
    let counts = |row: usize| residuals[row].weight > 0.0;
    let stated_m = dataset.stated_sigma_m().unwrap_or_default();
    let middle = median((0..residuals.len()).filter(|&row| counts(row)).map(|row| residuals_m[row]).collect());
    let off = |row: usize| counts(row).then(|| residuals_m[row] - middle);
    let global = scores(&(0..residuals.len()).map(off).collect::<Vec<_>>(), stated_m);
    let local = scores(&deviations_from_neighbours(dataset, residuals), stated_m);
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

/// Correlation of each residual with the next one of the same pairing, both less the pairing's mean, in the order of measurement;
/// `None` for fewer than twenty such neighbours. Independent noise gives `0 ± 1/√n`. `residuals` has one entry a row.
pub fn neighbour_correlation(dataset: &Dataset, residuals: &[Residual]) -> Option<f64> {
    let of_pairing = |pairing| dataset.rows_of(pairing).map(|row| residuals[row]).filter(|f| f.weight > 0.0).collect();
    let groups: Vec<Vec<Residual>> = dataset.pairings().into_iter().map(of_pairing).collect();
    correlation_of_neighbours(&groups)
}

/// Each residual less the median of those around it, pairing by pairing, in the order of measurement; `None` for a row with
/// fewer than [`NEIGHBOURS`] around it.
fn deviations_from_neighbours(dataset: &Dataset, residuals: &[Residual]) -> Vec<Option<f64>> {
    let residuals_m: Vec<f64> = residuals.iter().map(|f| f.whitened_m()).collect();
    let mut deviations = vec![None; residuals_m.len()];
    for pairing in dataset.pairings() {
        let rows: Vec<usize> = dataset.rows_of(pairing).filter(|&row| residuals[row].weight > 0.0).collect();
        for (k, &row) in rows.iter().enumerate() {
            let window = rows[k.saturating_sub(NEIGHBOURS)..rows.len().min(k + NEIGHBOURS + 1)].iter();
            let around: Vec<f64> = window.filter(|&&other| other != row).map(|&other| residuals_m[other]).collect();
            if around.len() >= NEIGHBOURS {
                deviations[row] = Some(residuals_m[row] - median(around));
            }
        }
    }
    deviations
}

/// Deviations in units of their robust spread: 1.4826 times the median of their sizes, which is σ where they are normal, but no
/// less than what is stated. Rows without a deviation score 0 and do not count.
fn scores(deviations_m: &[Option<f64>], stated_m: f64) -> Vec<f64> {
    let spread = stated_m.max(1.4826 * median(deviations_m.iter().flatten().map(|d| d.abs()).collect()));
    let score = |deviation: &Option<f64>| if spread < SMALLEST_SPREAD_M { 0.0 } else { deviation.unwrap_or(0.0) / spread };
    deviations_m.iter().map(score).collect()
}

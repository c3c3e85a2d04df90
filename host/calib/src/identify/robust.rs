//! Wrong rows, found and left out.
//!
//! ```text
//! start ─ Huber, then Tukey weights ─▶ rows without weight ─▶ estimate from the others ─▶ studentised residuals of all rows
//!                                           ▲                                                  │ others stand out
//!                                           └──────────────────────────────────────────────────┘
//! ```
//!
//! The last estimate is least squares of the rows that are left: where none is left out, it is what it would be without all this.

use ballbar::LmOptions;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::beliefs::Beliefs;
use super::estimate::{Estimate, Estimator};
use super::lm::{Objective, solve_from};
use super::observation::Observation;
use super::residual::{Residual, median};
use crate::model::PoseRow;
use crate::unknowns::Unknowns;

/// A row that was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WrongRow {
    /// Its index, from 0.
    pub row: usize,
    /// Measured less computed, metres.
    pub residual_m: f64,
    /// The same in standard deviations of what a good row would be off by there.
    pub deviations: f64,
}

/// Of a thousand clean datasets one loses a row.
const FALSE_ALARMS: f64 = 1e-3;
/// Fewer degrees of freedom tell no deviation.
const FEW: f64 = 3.0;
/// Below it residuals are the rounding of a file's digits, and nothing stands out.
const LEAST_SIGMA_M: f64 = 1e-9;

/// Estimates from the rows that no others contradict; which were left out, ascending.
///
/// Among few rows some wrong ones can be met by all parameters together, so that good ones look wrong. So where rows are left out, or the others
/// deviate by more than lengths do, a second start holds the robot nearer its design for as long as the rows look wild, and the likelier end counts.
pub(super) fn estimate_robustly(estimator: &Estimator<'_>, rows: &[&PoseRow], start: &Beliefs) -> (Estimate, Vec<WrongRow>) {
    let first = settled(estimator, rows, without_weight(estimator, rows, start, Trust::Rows));
    if estimator.is_hopeless(rows, &first.estimate) || !first.is_doubtful(estimator) {
        return (first.estimate, first.wrong);
    }
    let second = settled(estimator, rows, without_weight(estimator, rows, start, Trust::Design));
    let best = if second.log_likelihood(rows.len()) > first.log_likelihood(rows.len()) { second } else { first };
    (best.estimate, best.wrong)
}

/// An estimate from rows that agree, and what was left out.
struct Settled {
    estimate: Estimate,
    wrong: Vec<WrongRow>,
    /// Deviation of the rows that were kept, metres.
    seen_m: f64,
}

impl Settled {
    /// Whether another start may end better.
    fn is_doubtful(&self, estimator: &Estimator<'_>) -> bool {
        /// Rows that deviate by more than so many times what is stated or usual may be good ones and wrong ones mixed.
        const TIMES: f64 = 10.0;
        !self.wrong.is_empty() || self.seen_m > TIMES * estimator.stated_m.unwrap_or(estimator.usual_m)
    }

    /// Of all rows: those kept are normal, a wrong one is off by anything from a tenth of a millimetre to a metre, each factor of e alike.
    fn log_likelihood(&self, rows: usize) -> f64 {
        const FACTORS: f64 = 9.2;
        let kept = (rows - self.wrong.len()) as f64;
        let of_wrong = |wrong: &WrongRow| (2.0 * FACTORS * wrong.residual_m.abs().max(self.seen_m)).ln();
        -kept * (self.seen_m.ln() + 0.5 * (std::f64::consts::TAU.ln() + 1.0)) - self.wrong.iter().map(of_wrong).sum::<f64>()
    }
}

/// Leaves out these rows, and then others for as long as that changes what stands out.
fn settled(estimator: &Estimator<'_>, rows: &[&PoseRow], mut out: Vec<usize>) -> Settled {
    const ROUNDS: usize = 10;
    for round in 0.. {
        let is_out = |row: usize| out.binary_search(&row).is_ok();
        let kept: Vec<usize> = (0..rows.len()).filter(|&row| !is_out(row)).collect();
        let of_kept: Vec<&PoseRow> = kept.iter().map(|&row| rows[row]).collect();
        let estimate = estimator.estimate(&of_kept);
        let Studentised { all, most, seen_m } = Studentised::new(estimator, rows, &kept, &estimate);
        let next: Vec<usize> = all.iter().filter(|row| row.deviations.abs() > most).map(|wrong| wrong.row).collect();
        let is_over = round > ROUNDS || round > 0 && estimator.is_hopeless(&of_kept, &estimate);
        if next == out || is_over {
            return Settled { estimate, wrong: out.iter().map(|&row| all[row]).collect(), seen_m };
        }
        // What goes round in circles is wrong only where it is so seen from both sides.
        out = if round < ROUNDS { next } else { next.into_iter().filter(|&row| is_out(row)).collect() };
    }
    unreachable!("the last round returns")
}

/// What decides while rows look wild.
#[derive(Clone, Copy, PartialEq)]
enum Trust {
    /// Beliefs are weighed as beside good rows.
    Rows,
    /// They are weighed as beside rows that deviate as these do.
    Design,
}

/// The rows that Tukey's biweight (A. E. Beaton and J. W. Tukey, Technometrics 16, 1974) gives no weight, from a start by Huber's (P. J. Huber, Annals
/// of Mathematical Statistics 35, 1964), which has one minimum only near a design.
fn without_weight(estimator: &Estimator<'_>, rows: &[&PoseRow], beliefs: &Beliefs, trust: Trust) -> Vec<usize> {
    const HUBER: f64 = 1.345;
    const TUKEY: f64 = 4.685;
    const STEPS_OF_HUBER: usize = 12;
    const STEPS_OF_TUKEY: usize = 25;
    /// Changes of weights below which Huber's have done what they can, and Tukey's are settled.
    const NEAR: f64 = 0.05;
    const SETTLED: f64 = 1e-3;
    let huber = |scaled: f64| (HUBER / scaled.abs()).min(1.0);
    let tukey = |scaled: f64| if scaled.abs() < TUKEY { (1.0 - (scaled / TUKEY).powi(2)).powi(2) } else { 0.0 };
    let unknowns = estimator.unknowns;
    let spent = beliefs.free().len().min(rows.len() / 2);
    let steps = |max_iterations: usize| LmOptions { max_iterations, ..estimator.lm };
    let sigma_m = estimator.stated_m.unwrap_or(estimator.usual_m);
    let mut weighted: Vec<PoseRow> = rows.iter().map(|&row| row.clone()).collect();
    let mut values = unknowns.start();
    let mut weights = vec![1.0; rows.len()];
    let mut is_tukey = false;
    let mut left = STEPS_OF_HUBER;
    while left > 0 {
        left -= 1;
        let whitened: Vec<f64> =
            Residual::of_rows(unknowns, &values, rows.iter().copied()).iter().map(|residual| residual.whitened_m()).collect();
        let scale_m = scale_m(&whitened, spent).max(LEAST_SIGMA_M);
        let next: Vec<f64> = whitened.iter().map(|f| if is_tukey { tukey(f / scale_m) } else { huber(f / scale_m) }).collect();
        let change = next.iter().zip(&weights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        weights = next;
        if is_tukey && change < SETTLED {
            break;
        }
        if !is_tukey && (left == 0 || change < NEAR) {
            (is_tukey, left) = (true, STEPS_OF_TUKEY);
        }
        for ((weighted, row), weight) in weighted.iter_mut().zip(rows).zip(&weights) {
            weighted.measurement.weight = row.measurement.weight * weight;
        }
        let rows: Vec<&PoseRow> = weighted.iter().collect();
        let sigma_m = if trust == Trust::Rows { sigma_m } else { scale_m.max(sigma_m) };
        let objective = Objective { unknowns, rows: &rows, beliefs, sigma_m };
        let mut solution = solve_from(&objective, values.clone(), &steps(1));
        if solution.steps() == 0 {
            // The full step was too long.
            solution = solve_from(&objective, values, &steps(8));
        }
        values = solution.values;
    }
    let without: Vec<usize> = (0..rows.len()).filter(|&row| weights[row] == 0.0).collect();
    // Where every other contradicts the rest, there is no rest.
    if 2 * without.len() >= rows.len() { Vec::new() } else { without }
}

/// Robust standard deviation: of the sizes, so many smallest of which the fit has brought to nothing, the median.
fn scale_m(whitened_m: &[f64], spent: usize) -> f64 {
    const OF_NORMAL: f64 = 1.482_602_218_505_602;
    let mut sizes: Vec<f64> = whitened_m.iter().map(|f| f.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    OF_NORMAL * median(sizes.split_off(spent))
}

/// Studentised residuals of all rows: of rows that were fitted by what is left without them ("externally" studentised: R. D. Cook and S. Weisberg,
/// "Residuals and Influence in Regression", 1982), of others by how well they are predicted.
struct Studentised {
    all: Vec<WrongRow>,
    /// What is larger than chance makes one of so many, in standard deviations.
    most: f64,
    /// Deviation of the rows that were kept, metres.
    seen_m: f64,
}

impl Studentised {
    fn new(estimator: &Estimator<'_>, rows: &[&PoseRow], kept: &[usize], estimate: &Estimate) -> Self {
        let Estimator { unknowns, stated_m, .. } = *estimator;
        let values = &estimate.solution.values;
        let leverage = leverages(unknowns, rows, kept, estimate);
        let residuals = Residual::of_rows(unknowns, values, rows.iter().copied());
        let square_m2: f64 = kept.iter().map(|&row| residuals[row].whitened_m().powi(2)).sum();
        let told: f64 = kept.iter().map(|&row| leverage[row]).sum();
        let freedom = kept.len() as f64 - told - 1.0;
        // Residuals that are nearly all met say nothing of what lengths deviate by: what the estimate weighed them with does.
        let is_nearly_met = freedom < FEW;
        let freedom = if is_nearly_met { (kept.len() as f64 - 1.0).max(1.0) } else { freedom };
        const MET: f64 = 1.0 - 1e-6;
        let floor_m = stated_m.or(is_nearly_met.then_some(estimate.sigma_m)).unwrap_or_default().max(LEAST_SIGMA_M);
        let mut is_kept = vec![false; rows.len()];
        kept.iter().for_each(|&row| is_kept[row] = true);
        let studentise = |row: usize| {
            let (whitened_m, leverage) = (residuals[row].whitened_m(), leverage[row]);
            let (own_m2, spread) = if is_kept[row] {
                // A row that is met whatever it says cannot be told to be wrong.
                let left = if leverage < MET { 1.0 - leverage } else { f64::INFINITY };
                (whitened_m * whitened_m / left, left)
            } else {
                (0.0, 1.0 + leverage)
            };
            let freedom = if is_kept[row] { freedom } else { freedom + 1.0 };
            let seen_m = ((square_m2 - own_m2).max(0.0) / freedom).sqrt();
            let deviations = whitened_m / (seen_m.max(floor_m) * spread.sqrt());
            WrongRow { row, residual_m: residuals[row].value_m, deviations }
        };
        let chance = FALSE_ALARMS / rows.len() as f64;
        let most = StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - chance / 2.0));
        let seen_m = (square_m2 / (freedom + 1.0)).sqrt().max(floor_m);
        Self { all: (0..rows.len()).map(studentise).collect(), most, seen_m }
    }
}

/// `w J (JᵀWJ + σ²Λ)⁻¹ Jᵀ` of each row, the inverse by the rows that were kept.
fn leverages(unknowns: &Unknowns, rows: &[&PoseRow], kept: &[usize], estimate: &Estimate) -> Vec<f64> {
    let Estimate { beliefs, sigma_m, solution, .. } = estimate;
    let of_kept: Vec<&PoseRow> = kept.iter().map(|&row| rows[row]).collect();
    let observation = Observation::of(unknowns, &solution.values, &of_kept, Some((beliefs, *sigma_m)));
    let columns = observation.columns(beliefs.free());
    let scales = columns.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect::<Vec<_>>();
    let scaled = DMatrix::from_fn(columns.nrows(), columns.ncols(), |row, column| columns[(row, column)] / scales[column]);
    let mut square = scaled.tr_mul(&scaled);
    for i in 0..square.nrows() {
        square[(i, i)] += 1e-13;
    }
    let Some(square) = square.cholesky() else { return vec![0.0; rows.len()] };
    let mut leverages = Vec::with_capacity(rows.len());
    unknowns.for_each_block(&solution.values, rows, beliefs.free(), |block| {
        for lane in 0..block.count {
            let row = DVector::from_fn(scales.len(), |k, _| block.columns[k][lane] / scales[k]);
            let half = square.l_dirty().solve_lower_triangular(&row).unwrap_or(row);
            leverages.push(block.weight[lane] * half.norm_squared());
        }
    });
    leverages
}

//! By how much the LVDT's signal comes late, from poses of an arm that moved.
//!
//! What is measured at `t` is the length of `t − τ`: `d_measured = d(q) − τ·ḋ`, to first order. `τ` is one more unknown beside the
//! robot's parameters, with the column `−ḋ`: lengths that grow and lengths that shrink at the same place tell it from all of them.

use ballbar::{Chain, Kinematics, MAX_PARAMETERS, Measurement, Parameter};
use ballbar_calib::identify::{FitError, FitOptions, Identifiability, fit};
use ballbar_calib::model::{Dataset, Rig, Robot};
use nalgebra::{DMatrix, DVector};

use super::errors::CollectError;
use crate::files::{Problem, read_poses};
use crate::session::{POSES_NAME, PoseFile, RecordError, SessionLock};

/// The LVDT's lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// Seconds.
    pub lag_s: f64,
    /// Its standard deviation, seconds.
    pub std_s: f64,
}

/// A lag that is not known better than this is left in the lengths: at 10 mm/s it makes 0.01 mm.
const WORTH_REMOVING_S: f64 = 1e-3;
/// The fit is good to first order, so the second round changes next to nothing.
const ROUNDS: usize = 3;

/// Estimates the lag of the poses that have a rate; `None` when there is none with one, or they cannot tell. Lengths are taken as
/// measured, without the lag that was removed before.
///
/// # Errors
/// [`FitError`] as of a fit.
pub fn estimate_lag(robot: &Robot, dataset: &Dataset) -> Result<Option<Lag>, FitError> {
    let rates: Vec<f64> = dataset.rows.iter().map(|row| row.motion.map_or(0.0, |motion| motion.rate_m_s)).collect();
    if rates.iter().all(|rate| *rate == 0.0) {
        return Ok(None);
    }
    let mut lag = Lag { lag_s: 0.0, std_s: f64::INFINITY };
    for _ in 0..ROUNDS {
        let corrected = dataset.with_lag_removed(lag.lag_s);
        let solution = fit(robot, &corrected, &FitOptions::default())?;
        let chain = &solution.solution.chain;
        let measurements = corrected.measurements();
        let held: [Parameter; 0] = [];
        let subset = Identifiability::new(chain, &measurements, &robot.limits, &held).identified();
        let (columns, residual_m) = weighted_rows(chain, &measurements, &subset);
        let late = measurements.iter().zip(&rates).map(|(measurement, rate)| -measurement.weight.sqrt() * rate);
        let late = DVector::from_iterator(measurements.len(), late);
        let Some((more_s, std_s)) = solve_for_last(&columns, &late, &residual_m) else { return Ok(None) };
        lag = Lag { lag_s: lag.lag_s + more_s, std_s };
    }
    Ok(Some(lag))
}

/// Estimates the lag of a session's poses and removes it from their lengths; nothing changes when the poses cannot tell it.
///
/// # Errors
/// [`CollectError::Poses`] when the poses cannot be read, [`CollectError::Record`] when they cannot be written.
pub fn remove_lag(lock: &SessionLock, robot: &Robot, rig: &Rig) -> Result<Option<Lag>, CollectError> {
    let path = lock.session().join(POSES_NAME);
    if !path.is_file() {
        return Ok(None);
    }
    let dataset = match read_poses([path.as_path()], robot, rig) {
        Ok(dataset) => dataset,
        Err(error) if matches!(error.problem(), Problem::NoRows(_)) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    // Poses that no fit can be made of cannot tell a lag either.
    let Ok(Some(lag)) = estimate_lag(robot, &dataset) else { return Ok(None) };
    if lag.std_s > WORTH_REMOVING_S {
        return Ok(None);
    }
    let mut file = PoseFile::open(&path, robot.chain.joint_kinds()).map_err(RecordError::from)?;
    file.remove_lag(lag.lag_s).map_err(RecordError::from)?;
    Ok(Some(lag))
}

/// `√w J`, some of its columns, and `√w f`.
fn weighted_rows(chain: &Chain<f64>, measurements: &[Measurement<f64>], subset: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
    let kinematics = Kinematics::new(chain);
    let mut columns = DMatrix::zeros(measurements.len(), subset.len());
    let mut residual_m = DVector::zeros(measurements.len());
    let mut row = [0.0; MAX_PARAMETERS];
    for (i, measurement) in measurements.iter().enumerate() {
        let root_weight = measurement.weight.sqrt();
        residual_m[i] = root_weight * kinematics.residual_row(measurement, &mut row);
        for (entry, &parameter) in columns.row_mut(i).iter_mut().zip(subset) {
            *entry = root_weight * row[parameter];
        }
    }
    (columns, residual_m)
}

/// Least squares over the columns and one more; the value of the latter and its standard deviation.
fn solve_for_last(columns: &DMatrix<f64>, late: &DVector<f64>, residual: &DVector<f64>) -> Option<(f64, f64)> {
    let (rows, parameters) = columns.shape();
    let freedom = rows.checked_sub(parameters + 1).filter(|&freedom| freedom > 0)?;
    // What of it no parameter explains, and with it the lag alone: the same solution as of all unknowns together.
    let basis = columns.clone().qr().q();
    let rest = late - &basis * basis.tr_mul(late);
    let square = rest.norm_squared();
    if square <= 1e-12 * late.norm_squared() {
        return None;
    }
    let unexplained = residual - &basis * basis.tr_mul(residual);
    let lag_s = rest.dot(&unexplained) / square;
    let noise = (&unexplained - &rest * lag_s).norm_squared() / freedom as f64;
    Some((lag_s, (noise / square).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_unknown_is_found_beside_the_others() {
        let columns = DMatrix::from_fn(40, 3, |row, column| ((row * (column + 2)) as f64 * 0.7).sin());
        let late = DVector::from_fn(40, |row, _| ((row * row) as f64).cos());
        let residual = &columns * DVector::from_vec(vec![0.3, -2.0, 1.0]) + &late * 0.004;
        let (lag_s, std_s) = solve_for_last(&columns, &late, &residual).unwrap();
        assert!((lag_s - 0.004).abs() < 1e-12 && std_s < 1e-12, "{lag_s} {std_s}");
    }

    #[test]
    fn rates_that_a_parameter_mimics_tell_nothing() {
        let columns = DMatrix::from_fn(10, 1, |row, _| row as f64);
        let late = DVector::from_fn(10, |row, _| 2.0 * row as f64);
        assert_eq!(solve_for_last(&columns, &late, &DVector::zeros(10)), None);
    }
}

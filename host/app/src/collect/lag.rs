//! By how much the LVDT's signal comes late, from poses of an arm that moved: one more unknown of a fit.

use ballbar_calib::identify::{FitError, FitOptions, fit};
use ballbar_calib::model::{Dataset, Rig, Robot};
use ballbar_calib::unknowns::{AnyBlock, Latency};

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

/// Estimates the lag of the poses that have a rate; `None` when there is none with one, or they cannot tell. Lengths are taken as
/// measured, without the lag that was removed before.
///
/// # Errors
/// [`FitError`] as of a fit.
pub fn estimate_lag(robot: &Robot, dataset: &Dataset) -> Result<Option<Lag>, FitError> {
    let Ok(latency) = Latency::new(dataset) else { return Ok(None) };
    let options = FitOptions { unknowns: vec![AnyBlock::Latency(latency)], ..FitOptions::default() };
    // The block's only unknown stands behind the chain's.
    let found = fit(robot, dataset, &options)?.parameters.pop();
    Ok(found.and_then(|latency| Some(Lag { lag_s: latency.fitted, std_s: latency.std? })))
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

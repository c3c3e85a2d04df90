//! The order of measurement, and the residuals by pairing: whether they change, or are off as a whole.

use super::evidence::Evidence;
use crate::identify::{Offset, Residual, Trend, farthest_offset};

const SECONDS_PER_MINUTE: f64 = 60.0;

/// Where each pose lies in the order of measurement.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Order {
    /// Whether times order the poses. Those of several sessions may start anew; then the order says more.
    pub is_timed: bool,
    /// Minutes since the first where times order them, otherwise 1, 2, 3.
    pub places: Vec<f64>,
}

impl Order {
    /// Of poses in the order of their files, with times in seconds where these are known.
    pub fn new(times_s: &[Option<f64>]) -> Self {
        let is_timed = times_s.iter().all(Option::is_some) && times_s.windows(2).all(|pair| pair[0] <= pair[1]);
        let first_s = times_s.first().copied().flatten().unwrap_or_default();
        let place = |(i, t_s): (usize, &Option<f64>)| match t_s {
            Some(t_s) if is_timed => (t_s - first_s) / SECONDS_PER_MINUTE,
            _ => (i + 1) as f64,
        };
        Self { is_timed, places: times_s.iter().enumerate().map(place).collect() }
    }
}

/// Residuals of the fitted rows by pairing, in the order of `Dataset::pairings`, each with its place in the order of measurement.
pub(super) fn by_pairing(evidence: &Evidence<'_>, order: &Order) -> Vec<Vec<(f64, Residual)>> {
    let placed = |row: usize| (order.places[row], evidence.fit.residuals[row]);
    let of_pairing = |pairing| evidence.dataset.rows_of(pairing).map(placed).filter(|(_, f)| f.weight > 0.0).collect();
    evidence.dataset.pairings().into_iter().map(of_pairing).collect()
}

/// How the residuals change from the first length to the last, apart from what each pairing is off by; `None` where these poses
/// do not tell. [`Trend::is_significant`] says whether by more than chance.
pub(super) fn trend(evidence: &Evidence<'_>, by_pairing: &[Vec<(f64, Residual)>]) -> Option<Trend> {
    Trend::new(by_pairing, evidence.fit.uncertainty.spectrum.rank)
}

/// The pairing whose mean residual is the farthest from zero, an index into `Dataset::pairings`, and whether chance would take it
/// there; `None` where the fit leaves no scatter to judge by. A drift looks like that where pairings do not take turns.
pub(super) fn offset(evidence: &Evidence<'_>, by_pairing: &[Vec<(f64, Residual)>]) -> Option<Offset> {
    let uncertainty = &evidence.fit.uncertainty;
    let groups: Vec<Vec<Residual>> = by_pairing.iter().map(|group| group.iter().map(|placed| placed.1).collect()).collect();
    farthest_offset(&groups, uncertainty.sigma_m?, evidence.dataset.rows.len().saturating_sub(uncertainty.spectrum.rank))
}

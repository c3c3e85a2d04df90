//! The fitted poses in the order of measurement and by pairing: whether their residuals change, or are off as a whole.

use super::facts::{Facts, RowFact};
use crate::identify::{Offset, Residual, Trend, farthest_offset};

const SECONDS_PER_MINUTE: f64 = 60.0;

impl RowFact {
    /// The residual with the fit, and its weight.
    pub(super) fn residual(&self) -> Residual {
        Residual { value_m: self.after_m, weight: self.weight }
    }
}

impl Facts {
    /// Whether times order the poses. Those of several sessions may start anew; then the order says more.
    pub(super) fn is_timed(&self) -> bool {
        self.rows.iter().all(|row| row.t_s.is_some()) && self.rows.windows(2).all(|pair| pair[0].t_s <= pair[1].t_s)
    }

    /// Where each pose lies in the order of measurement: minutes since the first where times order them, otherwise 1, 2, 3.
    pub(super) fn places(&self) -> Vec<f64> {
        let is_timed = self.is_timed();
        let first_s = self.rows.first().and_then(|row| row.t_s).unwrap_or_default();
        let place = |(i, row): (usize, &RowFact)| match row.t_s {
            Some(t_s) if is_timed => (t_s - first_s) / SECONDS_PER_MINUTE,
            _ => (i + 1) as f64,
        };
        self.rows.iter().enumerate().map(place).collect()
    }

    /// How the residuals change from the first length to the last, apart from what each pairing is off by; `None` where these
    /// poses do not tell. [`Trend::is_significant`] says whether by more than chance.
    pub fn trend(&self) -> Option<Trend> {
        let mut groups = vec![Vec::new(); self.pairings.len()];
        for (row, place) in self.rows.iter().zip(self.places()) {
            groups[row.pairing].push((place, row.residual()));
        }
        Trend::new(&groups, self.told)
    }

    /// Residuals of each pairing, in the order of [`Facts::pairings`].
    pub(super) fn residuals_by_pairing(&self) -> Vec<Vec<Residual>> {
        let mut groups = vec![Vec::new(); self.pairings.len()];
        for row in &self.rows {
            groups[row.pairing].push(row.residual());
        }
        groups
    }

    /// The pairing whose mean residual is the farthest from zero, an index into [`Facts::pairings`], and whether chance would take
    /// it there; `None` where the fit leaves no scatter to judge by. A drift looks like that where pairings do not take turns.
    pub fn farthest_offset(&self) -> Option<Offset> {
        farthest_offset(&self.residuals_by_pairing(), self.sigma_m?, self.rows.len().saturating_sub(self.told))
    }
}

//! Whether residuals follow one another or change steadily in the order of measurement.

use super::residual::Residual;

/// A straight change of residuals over a measurement, apart from what each pairing is off by as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trend {
    /// From the first to the last length, metres.
    pub change_m: f64,
    /// Its standard error, metres.
    pub error_m: f64,
}

impl Trend {
    /// Changes beyond this many standard errors are more than chance: one in 370 of normal residuals.
    const TOO_FAR: f64 = 3.0;
    /// Fewer degrees of freedom tell too little of the scatter.
    const FEWEST: usize = 12;
    /// Below this scatter, a nanometre, residuals are the rounding of a file's digits.
    const SMALLEST_SPREAD_M: f64 = 1e-9;

    /// Weighted least squares with a mean for each group (pairing) and one slope for all. Each residual comes with its place in
    /// time or order, of any unit; `spent` is how many degrees of freedom the fit took. `None` where too little is left, or
    /// where each group was measured at one time.
    pub fn new(groups: &[Vec<(f64, Residual)>], spent: usize) -> Option<Self> {
        let places = || groups.iter().flatten().map(|place| place.0);
        let length = places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min);
        let freedom = places().count().checked_sub(groups.len() + spent + 1).filter(|&freedom| freedom >= Self::FEWEST)?;
        let centred: Vec<(f64, f64, f64)> = groups.iter().flat_map(|group| centred(group)).collect();
        let spread: f64 = centred.iter().map(|(at, _, weight)| weight * at * at).sum();
        let slope = centred.iter().map(|(at, f, weight)| weight * at * f).sum::<f64>() / spread;
        let squares: f64 = centred.iter().map(|(at, f, weight)| weight * (f - slope * at).powi(2)).sum();
        let sigma_m = (squares / freedom as f64).sqrt();
        // What rounding leaves of places that are all alike in their group is no spread.
        let is_told = spread > 1e-12 * length * length && sigma_m > Self::SMALLEST_SPREAD_M;
        is_told.then(|| Self { change_m: slope * length, error_m: sigma_m / spread.sqrt() * length })
    }

    /// Size of the change in standard errors.
    pub fn errors(self) -> f64 {
        self.change_m.abs() / self.error_m
    }

    /// Whether the change is more than chance gives.
    pub fn is_significant(self) -> bool {
        self.errors() > Self::TOO_FAR
    }
}

/// Place and residual less the weighted means of their group, and the weight.
fn centred(group: &[(f64, Residual)]) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
    let weight: f64 = group.iter().map(|(_, f)| f.weight).sum();
    let at = group.iter().map(|(at, f)| f.weight * at).sum::<f64>() / weight;
    let mean = group.iter().map(|(_, f)| f.weight * f.value_m).sum::<f64>() / weight;
    group.iter().map(move |(place, f)| (place - at, f.value_m - mean, f.weight))
}

/// Correlation of each residual with the next of its group (pairing), both less the group's mean; `None` for fewer than twenty
/// such neighbours. Independent noise gives `0 ± 1/√n`, whatever its groups are off by.
pub(super) fn correlation_of_neighbours(groups: &[Vec<Residual>]) -> Option<f64> {
    const FEWEST: usize = 20;
    let (mut products, mut squares, mut bias, mut freedom) = (0.0, 0.0, 0.0, 0);
    for group in groups.iter().filter(|group| group.len() > 1) {
        let placed: Vec<(f64, Residual)> = group.iter().map(|&f| (0.0, f)).collect();
        let whitened: Vec<f64> = centred(&placed).map(|(_, f, weight)| weight.sqrt() * f).collect();
        products += whitened.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>();
        squares += whitened.iter().map(|f| f * f).sum::<f64>();
        freedom += group.len() - 1;
        // Taking the mean away makes neighbours of pure noise correlate by −1/n.
        bias += (group.len() - 1) as f64 / group.len() as f64;
    }
    (freedom >= FEWEST && squares > 0.0).then(|| products / squares + bias / freedom as f64)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const SIGMA_M: f64 = 1e-4;
    const PAIRINGS: usize = 9;
    const RUNS: u64 = 300;

    /// Lengths of nine pairings in turn: noise, what each pairing is off by, and a change from first to last; all in sigmas.
    fn measured(seed: u64, rows: usize, offsets: f64, change: f64) -> Vec<Vec<(f64, Residual)>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let off: Vec<f64> = (0..PAIRINGS).map(|_| offsets * normal()).collect();
        let mut groups = vec![Vec::new(); PAIRINGS];
        for row in 0..rows {
            // Every third length is half as sure.
            let weight: f64 = if row % 3 == 0 { 0.25 } else { 1.0 };
            let at = row as f64 / (rows - 1) as f64;
            let sigmas = off[row % PAIRINGS] + change * (at - 0.5) + normal() / weight.sqrt();
            groups[row % PAIRINGS].push((60.0 * at, Residual { value_m: SIGMA_M * sigmas, weight }));
        }
        groups
    }

    /// Share of runs that something is said of.
    fn share(said: impl Fn(u64) -> bool) -> f64 {
        (0..RUNS).filter(|&seed| said(seed)).count() as f64 / RUNS as f64
    }

    fn correlation(groups: &[Vec<(f64, Residual)>]) -> f64 {
        let residuals: Vec<Vec<Residual>> = groups.iter().map(|group| group.iter().map(|placed| placed.1).collect()).collect();
        correlation_of_neighbours(&residuals).unwrap()
    }

    #[test]
    fn pairings_that_are_off_are_no_drift() {
        for rows in [36, 180, 810] {
            let beyond = |sigmas: f64| share(|seed| correlation(&measured(seed, rows, 1.2, 0.0)) > sigmas / (rows as f64).sqrt());
            assert!(beyond(2.0) < 0.05, "{rows} rows: {}", beyond(2.0));
            assert!((0.4..0.6).contains(&beyond(0.0)), "{rows} rows: biased, {}", beyond(0.0));
            let false_alarms = share(|seed| Trend::new(&measured(seed, rows, 1.2, 0.0), 0).unwrap().is_significant());
            assert!(false_alarms < 0.02, "{rows} rows: {false_alarms}");
        }
    }

    #[test]
    fn a_steady_drift_is_found_and_its_error_is_what_it_scatters_by() {
        let trends: Vec<Trend> = (0..RUNS).map(|seed| Trend::new(&measured(seed, 810, 1.2, 1.0), 0).unwrap()).collect();
        assert!(trends.iter().all(|trend| trend.is_significant()));
        let mean = trends.iter().map(|trend| trend.change_m).sum::<f64>() / RUNS as f64;
        let scatter = (trends.iter().map(|trend| (trend.change_m - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64).sqrt();
        assert!((mean / SIGMA_M - 1.0).abs() < 0.03, "{mean}");
        assert!((scatter / trends[0].error_m - 1.0).abs() < 0.15, "{scatter} {}", trends[0].error_m);
    }

    #[test]
    fn what_cannot_be_told_from_pairings_is_not_told() {
        assert_eq!(Trend::new(&measured(1, 21, 0.0, 1.0), 0), None, "eleven degrees of freedom are too few");
        assert_eq!(Trend::new(&measured(1, 60, 0.0, 1.0), 40), None, "so are those that a fit leaves");
        let at_once = |group: Vec<(f64, Residual)>| group.into_iter().map(|(_, f)| (f.value_m.signum(), f)).collect();
        let mut each_at_one_time: Vec<Vec<(f64, Residual)>> = measured(1, 90, 0.0, 1.0).into_iter().map(at_once).collect();
        for (i, group) in each_at_one_time.iter_mut().enumerate() {
            group.iter_mut().for_each(|placed| placed.0 = 0.1 * i as f64);
        }
        assert_eq!(Trend::new(&each_at_one_time, 0), None);
    }
}

//! Whether the mean residual of a pairing is farther from zero than chance takes it.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::residual::{Residual, ResidualSummary};

/// How far the mean of a group of residuals is from zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Offset {
    /// Index of the group.
    pub group: usize,
    /// Its mean, weighted, metres.
    pub mean_m: f64,
    /// In standard errors, by the scatter of all residuals.
    pub errors: f64,
    /// Whether chance takes the worst of so many means as far in less than one of a hundred measurements.
    pub is_beyond_chance: bool,
}

/// The mean that is the most standard errors from zero, by Student's t with Bonferroni's correction. `sigma_m` is the deviation of a length of weight 1 by the fit, which has
/// `freedom` degrees of freedom left; a group of three has too few of its own to judge by. `None` without scatter or groups.
pub fn farthest_offset(groups: &[Vec<Residual>], sigma_m: f64, freedom: usize) -> Option<Offset> {
    /// Chance that any group is said to be off while none is; shared among them (Bonferroni).
    const FALSE_ALARMS: f64 = 0.01;
    /// Below this scatter, a nanometre, residuals are the rounding of a file's digits.
    const SMALLEST_SPREAD_M: f64 = 1e-9;
    let offset = |(group, residuals): (usize, &Vec<Residual>)| {
        let weight: f64 = residuals.iter().map(|f| f.weight).sum();
        let mean_m = ResidualSummary::new(residuals).mean_m;
        let errors = mean_m.abs() * weight.sqrt() / sigma_m;
        let is_beyond_chance = two_tails(errors, freedom) < FALSE_ALARMS / groups.len() as f64;
        Offset { group, mean_m, errors, is_beyond_chance }
    };
    let filled = groups.iter().enumerate().filter(|(_, residuals)| !residuals.is_empty());
    let farthest = filled.map(offset).max_by(|a, b| a.errors.total_cmp(&b.errors));
    farthest.filter(|_| sigma_m > SMALLEST_SPREAD_M && freedom > 0)
}

/// Probability that Student's t is farther from zero than `t`, on either side; 1 without degrees of freedom.
fn two_tails(t: f64, freedom: usize) -> f64 {
    StudentsT::new(0.0, 1.0, freedom as f64).map_or(1.0, |students| 2.0 * students.sf(t))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn tails_are_those_of_printed_tables() {
        // Quantiles of Student's t as any table has them.
        let table =
            [(12.706_205, 1, 0.05), (4.302_653, 2, 0.05), (5.840_909, 3, 0.01), (2.776_445, 4, 0.05), (3.169_273, 10, 0.01)];
        for (t, freedom, p) in table {
            assert!((two_tails(t, freedom) - p).abs() < 1e-6, "{freedom}: {}", two_tails(t, freedom));
        }
        // Of many degrees of freedom, it is the normal distribution.
        assert!((two_tails(2.575_829, 1_000_001) - 0.01).abs() < 1e-5, "{}", two_tails(2.575_829, 1_000_001));
    }

    /// Groups of normal residuals, and their deviation as a fit without parameters would estimate it. Every other group is surer.
    fn measured(seed: u64, groups: usize, per_group: usize) -> (Vec<Vec<Residual>>, f64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut residual = |weight: f64| {
            let sigmas: f64 = StandardNormal.sample(&mut rng);
            Residual { value_m: 1e-4 * sigmas / weight.sqrt(), weight }
        };
        let weight = |group: usize| if group.is_multiple_of(2) { 0.5 } else { 2.0 };
        let groups: Vec<Vec<Residual>> =
            (0..groups).map(|group| (0..per_group).map(|_| residual(weight(group))).collect()).collect();
        let squares: f64 = groups.iter().flatten().map(|f| f.whitened_m().powi(2)).sum();
        let n = groups.iter().flatten().count() as f64;
        (groups, (squares / n).sqrt())
    }

    #[test]
    fn chance_alone_is_seldom_taken_for_an_offset_however_small_the_groups() {
        const RUNS: u64 = 1000;
        for (groups, per_group) in [(9, 3), (9, 10), (2, 5), (30, 4)] {
            let is_accused = |seed: &u64| {
                let (residuals, sigma_m) = measured(*seed, groups, per_group);
                farthest_offset(&residuals, sigma_m, groups * per_group).unwrap().is_beyond_chance
            };
            let accused = (0..RUNS).filter(is_accused).count();
            // One in a hundred are ten; twenty or more come by chance in one of three hundred such tests.
            assert!(accused < 20, "{groups} of {per_group}: {accused} of {RUNS}");
        }
    }

    #[test]
    fn a_group_that_is_off_is_found() {
        for seed in 0..100 {
            let (mut residuals, sigma_m) = measured(seed, 9, 20);
            residuals[5].iter_mut().for_each(|f| f.value_m -= 1.5e-4);
            let offset = farthest_offset(&residuals, sigma_m, 180).unwrap();
            assert!(offset.is_beyond_chance && offset.group == 5 && offset.mean_m < 0.0, "{seed}: {offset:?}");
        }
    }
}

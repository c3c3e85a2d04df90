//! Whether residuals look like a normal distribution.

/// The Anderson-Darling test of normality with mean and deviation estimated from the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AndersonDarling {
    /// The statistic A², corrected for the sample size.
    pub statistic: f64,
    /// Probability of a statistic at least this large for a normal sample.
    pub p_value: f64,
}

/// Tests a sample, of any unit and order; `None` for fewer than eight values or a sample without spread.
///
/// Statistic and p-value by Stephens, in D'Agostino and Stephens, "Goodness-of-Fit Techniques" (1986), section 4.8.5, table 4.9.
pub fn anderson_darling(sample: &[f64]) -> Option<AndersonDarling> {
    let n = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / n;
    let deviation = (sample.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    if sample.len() < 8 || !deviation.is_normal() {
        return None;
    }
    let mut z: Vec<f64> = sample.iter().map(|x| (x - mean) / deviation).collect();
    z.sort_by(f64::total_cmp);
    let terms = z.iter().zip(z.iter().rev()).enumerate().map(|(i, (&low, &high))| {
        // ln Φ(low) + ln(1 − Φ(high)), both from the tail that keeps its digits.
        (2 * i + 1) as f64 * (upper_tail(-low).ln() + upper_tail(high).ln())
    });
    let a2 = -n - terms.sum::<f64>() / n;
    let statistic = a2 * (1.0 + 0.75 / n + 2.25 / (n * n));
    Some(AndersonDarling { statistic, p_value: p_value(statistic) })
}

/// 1 − Φ(z).
fn upper_tail(z: f64) -> f64 {
    (0.5 * libm::erfc(z / std::f64::consts::SQRT_2)).max(f64::MIN_POSITIVE)
}

fn p_value(a: f64) -> f64 {
    let p = if a >= 0.6 {
        (1.2937 - 5.709 * a + 0.0186 * a * a).exp()
    } else if a >= 0.34 {
        (0.9177 - 4.279 * a - 1.38 * a * a).exp()
    } else if a >= 0.2 {
        1.0 - (-8.318 + 42.796 * a - 59.938 * a * a).exp()
    } else {
        1.0 - (-13.436 + 101.14 * a - 223.73 * a * a).exp()
    };
    // Beyond its range the fitted parabola of the first branch would turn up again.
    if a > 13.0 { 0.0 } else { p.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the normal distribution: as normal as a sample can be.
    fn normal_quantiles(n: u32) -> Vec<f64> {
        let quantile = |p: f64| {
            let (mut low, mut high) = (-10.0, 10.0);
            for _ in 0..80 {
                let middle = (low + high) / 2.0;
                if 1.0 - upper_tail(middle) < p { low = middle } else { high = middle }
            }
            low
        };
        (0..n).map(|i| quantile((f64::from(i) + 0.5) / f64::from(n))).collect()
    }

    #[test]
    fn normal_samples_pass_and_uniform_ones_fail() {
        let normal = anderson_darling(&normal_quantiles(500)).unwrap();
        assert!(normal.p_value > 0.99, "{normal:?}");
        let uniform: Vec<f64> = (0..500).map(f64::from).collect();
        let uniform = anderson_darling(&uniform).unwrap();
        assert!(uniform.p_value < 1e-6, "{uniform:?}");
    }

    #[test]
    fn the_statistic_agrees_with_scipy() {
        // scipy.stats.anderson([1, 2, 4, 7, 11, 16, 22, 29, 37, 46]).statistic , before the size correction.
        let sample = [1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0, 29.0, 37.0, 46.0];
        let test = anderson_darling(&sample).unwrap();
        let uncorrected = test.statistic / (1.0 + 0.075 + 0.0225);
        assert!((uncorrected - SCIPY_STATISTIC).abs() < 1e-9, "{uncorrected}");
    }

    const SCIPY_STATISTIC: f64 = 0.356_888_697_481_823_06;

    #[test]
    fn a_sample_without_spread_has_no_answer() {
        assert_eq!(anderson_darling(&[1.0; 20]), None);
        assert_eq!(anderson_darling(&[1.0, 2.0]), None);
    }
}

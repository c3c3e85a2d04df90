//! Probabilities far out in a tail, by their logarithms: a bar zero that is off by fifty standard deviations has one of 1e-500.

/// Terms of a series or a continued fraction; a hundred are enough beyond ten thousand degrees of freedom.
const TERMS: usize = 2000;
const EXACT: f64 = 1e-15;

/// `ln P(χ² > x)` of a chi-square with `freedom` degrees of freedom, which need not be whole: `ln Q(freedom/2, x/2)`.
pub(super) fn ln_chi2_tail(x: f64, freedom: f64) -> f64 {
    let (a, x) = (0.5 * freedom, 0.5 * x);
    if x <= 0.0 {
        return 0.0;
    }
    let ln_front = a * x.ln() - x - libm::lgamma(a);
    if x < a + 1.0 {
        // P(a, x) by its series.
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for n in 1..TERMS {
            term *= x / (a + n as f64);
            sum += term;
            if term < EXACT * sum {
                break;
            }
        }
        return (-(ln_front + sum.ln()).exp().min(1.0)).ln_1p();
    }
    ln_front - continued_fraction(x + 1.0 - a, |n| (-(n * (n - a)), x + 2.0 * n + 1.0 - a)).ln()
}

/// `ln P(F > f)` of Fisher's F with `above` and `below` degrees of freedom: `ln I(below/2, above/2)` at `below / (below + above f)`.
pub(super) fn ln_f_tail(f: f64, above: f64, below: f64) -> f64 {
    if f <= 0.0 {
        return 0.0;
    }
    let all = below + above * f;
    ln_beta_share(0.5 * below, 0.5 * above, below / all, above * f / all)
}

/// `ln I_x(a, b)`, where `y = 1 − x` to all its digits.
fn ln_beta_share(a: f64, b: f64, x: f64, y: f64) -> f64 {
    let ln_front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * y.ln();
    let share = |a: f64, b: f64, x: f64| {
        let step = |n: f64| {
            let m = (n / 2.0).floor();
            let numerator = if n % 2.0 == 0.0 {
                m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
            } else {
                -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
            };
            (numerator, 1.0)
        };
        ln_front - a.ln() - continued_fraction(1.0, step).ln()
    };
    if x < (a + 1.0) / (a + b + 2.0) { share(a, b, x) } else { (-share(b, a, y).exp().min(1.0)).ln_1p() }
}

/// `b₀ + a₁ / (b₁ + a₂ / (b₂ + …))`, by W. J. Lentz (Applied Optics 15, 1976).
fn continued_fraction(first: f64, step: impl Fn(f64) -> (f64, f64)) -> f64 {
    const TINY: f64 = 1e-300;
    let not_zero = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut value = not_zero(first);
    let (mut c, mut d) = (value, 0.0);
    for n in 1..TERMS {
        let (a, b) = step(n as f64);
        d = 1.0 / not_zero(b + a * d);
        c = not_zero(b + a / c);
        value *= c * d;
        if (c * d - 1.0).abs() < EXACT {
            break;
        }
    }
    value
}

/// How many standard deviations a normal value is off, to either side, with the probability whose logarithm this is.
pub(super) fn deviations(ln_p: f64) -> f64 {
    if ln_p >= 0.0 {
        return 0.0;
    }
    // P(|z| > d) is below exp(−d²/2).
    let (mut low, mut high) = (0.0, (-2.0 * ln_p).sqrt());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if ln_chi2_tail(middle * middle, 1.0) > ln_p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_agree_with_closed_forms() {
        for x in [0.1, 1.0, 3.0, 30.0, 500.0_f64] {
            // Two degrees of freedom: exp(−x/2). Four: (1 + x/2) exp(−x/2).
            assert!((ln_chi2_tail(x, 2.0) + x / 2.0).abs() < 1e-12 * x.max(1.0));
            assert!((ln_chi2_tail(x, 4.0) - ((1.0 + x / 2.0).ln() - x / 2.0)).abs() < 1e-12 * x.max(1.0));
            assert!((ln_chi2_tail(x, 1.0) - libm::erfc((x / 2.0).sqrt()).ln()).abs() < 1e-9 || x > 400.0);
            for below in [1.0, 5.0, 300.0_f64] {
                // Two above: (1 + 2x/below)^(−below/2).
                let exact = -0.5 * below * (2.0 * x / below).ln_1p();
                assert!((ln_f_tail(x, 2.0, below) - exact).abs() < 1e-10 * exact.abs().max(1.0), "{x} {below}");
            }
            // One and one: 1 − 2/π·atan √x.
            assert!((ln_f_tail(x, 1.0, 1.0) - (1.0 - std::f64::consts::FRAC_2_PI * x.sqrt().atan()).ln()).abs() < 1e-12);
        }
        // Beyond what a probability can be, and of broken degrees of freedom: between those of whole ones.
        assert!((ln_chi2_tail(5000.0, 2.0) + 2500.0).abs() < 1e-9);
        assert!(ln_chi2_tail(9.0, 2.0) < ln_chi2_tail(9.0, 2.4) && ln_chi2_tail(9.0, 2.4) < ln_chi2_tail(9.0, 3.0));
        // With ever more degrees below, F is chi-square over its own.
        assert!((ln_f_tail(2.0, 3.0, 1e7) - ln_chi2_tail(6.0, 3.0)).abs() < 1e-5);
    }

    #[test]
    fn deviations_are_those_of_a_normal_value() {
        for d in [0.1, 1.0, 3.0, 12.0, 60.0_f64] {
            assert!((deviations(ln_chi2_tail(d * d, 1.0)) - d).abs() < 1e-9, "{d}");
        }
        assert!((deviations(0.05_f64.ln()) - 1.959_963_984_540_054).abs() < 1e-9);
        assert_eq!(deviations(0.0), 0.0);
    }
}

//! Medians, and quantiles and tails of distributions.

use std::sync::LazyLock;

use statrs::{
    distribution::{ContinuousCDF, StudentsT},
    function::{
        beta::checked_beta_reg,
        gamma::{checked_gamma_lr, checked_gamma_ur},
    },
};

/// Half of the 95 % interval of a normal distribution, in standard deviations: its quantile of 97.5 %.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;
/// Whole degrees of freedom below which Student's quantile is tabled: it is asked for order by order.
const TABLED: usize = 200;

/// Student's quantiles of 97.5 % for whole degrees of freedom from 1.
static STUDENT_95: LazyLock<Vec<f64>> = LazyLock::new(|| (1..TABLED).map(|freedom| quantile(freedom as f64)).collect());

/// Half of the 95 % interval of Student's distribution, in standard deviations; the normal one's for 0 degrees of freedom, which
/// here mean a standard deviation that is taken as exact.
///
/// ```
/// use runout_numerics::statistics::student_95;
///
/// assert!((student_95(1.0) - 12.706204736).abs() < 1e-9);
/// assert!((student_95(10.0) - 2.228138852).abs() < 1e-9);
/// ```
#[must_use]
pub fn student_95(freedom: f64) -> f64 {
    if freedom.is_nan() || freedom <= 0.0 {
        return NORMAL_95;
    }
    if freedom < TABLED as f64 {
        let whole = freedom.fract() == 0.0;
        let tabled = if whole { STUDENT_95.get(freedom as usize - 1).copied() } else { None };
        return tabled.unwrap_or_else(|| quantile(freedom));
    }
    // Abramowitz, Stegun 26.7.5, right to 1e-11 here; the incomplete beta function behind the quantile loses digits where
    // one of its parameters is large.
    let (z, square) = (NORMAL_95, NORMAL_95 * NORMAL_95);
    let terms = [
        (square + 1.0) / 4.0,
        ((5.0 * square + 16.0) * square + 3.0) / 96.0,
        (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / 384.0,
        ((((79.0 * square + 776.0) * square + 1482.0) * square - 1920.0) * square - 945.0) / 92160.0,
    ];
    z + z * terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom)
}

fn quantile(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(NORMAL_95, |student| student.inverse_cdf(0.975))
}

/// Chance that an F-distributed number with `a` and `b` degrees of freedom is above `f`: the regularised incomplete beta
/// function I_x(b/2, a/2) at x = b/(b + a f) (DLMF 8.17); 1 where `f` or `b` is not above 0.
///
/// ```
/// use runout_numerics::statistics::f_tail;
///
/// // With 2 degrees above it is (1 + 2f/b)^(−b/2).
/// assert!((f_tail(3.0, 2.0, 7.0) - (13.0_f64 / 7.0).powf(-3.5)).abs() < 1e-12);
/// ```
#[must_use]
pub fn f_tail(f: f64, a: f64, b: f64) -> f64 {
    if !(f > 0.0 && b > 0.0) {
        return 1.0;
    }
    checked_beta_reg(0.5 * b, 0.5 * a, b / (b + a * f)).unwrap_or(1.0)
}

/// Chance that χ² with some degrees of freedom is above `chi2`: the regularised incomplete gamma function Q(k/2, χ²/2) (DLMF 8.2);
/// 1 where either is not above 0.
///
/// ```
/// use runout_numerics::statistics::chi2_tail;
///
/// // With 2 degrees it is e^(−χ²/2).
/// assert!((chi2_tail(3.0, 2.0) - (-1.5_f64).exp()).abs() < 1e-12);
/// ```
#[must_use]
pub fn chi2_tail(chi2: f64, freedom: f64) -> f64 {
    if !(chi2 > 0.0 && freedom > 0.0) {
        return 1.0;
    }
    if chi2.is_infinite() {
        return 0.0;
    }
    checked_gamma_ur(0.5 * freedom, 0.5 * chi2).unwrap_or(1.0)
}

/// Chances that χ² with some degrees of freedom is above and below `chi2`.
#[must_use]
pub fn chi2_above_and_below(chi2: f64, freedom: f64) -> [f64; 2] {
    let above = chi2_tail(chi2, freedom);
    if !(chi2 > 0.0 && freedom > 0.0) {
        return [above, 0.0];
    }
    [above, checked_gamma_lr(0.5 * freedom, 0.5 * chi2).unwrap_or(1.0)]
}

/// Median, of an even number of values the mean of the two in the middle; NaN of nothing.
///
/// ```
/// use runout_numerics::statistics::median;
///
/// assert_eq!(median([4.0, 1.0, 2.0]), 2.0);
/// assert_eq!(median([4.0, 1.0]), 2.5);
/// assert!(median([]).is_nan());
/// ```
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        return f64::NAN;
    }
    let even = values.len().is_multiple_of(2);
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    match below.iter().copied().max_by(f64::total_cmp) {
        Some(lower) if even => 0.5 * (lower + *upper),
        _ => *upper,
    }
}

/// Median absolute deviation from the median; NaN of nothing. For a normal distribution it is 0.6745 standard deviations.
#[must_use]
pub fn median_absolute_deviation(values: &[f64]) -> f64 {
    let centre = median(values.iter().copied());
    median(values.iter().map(|value| (value - centre).abs()))
}

/// The upper one of the two values in the middle (of an odd number the median), in place: a value that occurs, without an
/// allocation. `None` of nothing.
#[must_use]
pub fn upper_median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of the F distribution, and closed forms: with 2 degrees above, (1 + 2f/b)^(−b/2).
    #[test]
    fn tails_of_the_f_distribution() {
        for (f, a, b, tail) in [(161.448, 1.0, 1.0, 0.05), (4.9646, 1.0, 10.0, 0.05), (2.7109, 5.0, 20.0, 0.05)] {
            // The tables give five digits.
            assert!((f_tail(f, a, b) - tail).abs() < 2e-5, "{f}: {}", f_tail(f, a, b));
        }
        for (f, b) in [(3.0, 7.0), (30.0, 600.0), (12.0, 6000.0), (9.0, 3e5)] {
            let closed = (-0.5 * b * (2.0_f64 * f / b).ln_1p()).exp();
            assert!((f_tail(f, 2.0, b) / closed - 1.0).abs() < 1e-9, "{f}, {b}");
        }
        for f in [0.0, -1.0, f64::NAN] {
            assert!((f_tail(f, 2.0, 5.0) - 1.0).abs() < 1e-15);
        }
        assert!(f_tail(f64::INFINITY, 2.0, 5.0).abs() < 1e-15);
    }

    /// A quantile is where both tails together are 5 %, and has no step where the expansion begins.
    #[test]
    fn students_quantile_leaves_five_percent() {
        for freedom in [0.7, 1.0, 2.0, 3.0, 5.0, 16.5, 40.0, 150.0, 199.0, 200.0, 1e3, 1e5] {
            let tail = f_tail(student_95(freedom).powi(2), 1.0, freedom);
            assert!((tail - 0.05).abs() < 1e-10, "{freedom}: {tail}");
        }
        for (freedom, expected) in [(2.0, 4.302_652_730), (5.0, 2.570_581_836), (100.0, 1.983_971_519)] {
            assert!((student_95(freedom) - expected).abs() < 1e-9, "{freedom}: {}", student_95(freedom));
        }
        assert!((student_95(199.999) - student_95(200.0)).abs() < 1e-7);
        for exact in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e12] {
            assert!((student_95(exact) - NORMAL_95).abs() < 1e-11, "{exact}");
        }
    }

    #[test]
    fn medians_of_few_values() {
        assert_eq!(upper_median(&mut []), None);
        assert_eq!(upper_median(&mut [4.0, 1.0]), Some(4.0));
        assert!((median([1.0, f64::INFINITY, 3.0, 2.0]) - 2.5).abs() < 1e-15);
        assert!((median_absolute_deviation(&[1.0, 1.1, 0.9, 1.05, -53.0]) - 0.1).abs() < 1e-12);
    }
}

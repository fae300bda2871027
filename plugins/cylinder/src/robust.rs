//! Statistics that a few wild points do not move.

use runout_core::numerics::statistics::{median, median_absolute_deviation};

/// What lies further from the median than so many median absolute deviations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fence {
    /// Median.
    pub centre: f64,
    /// Distance from it that is still accepted.
    pub distance: f64,
}

/// Rounding of decimal files and of the fit stays below a picometre, in µm: data without noise has no outliers.
pub(crate) const ROUNDING_UM: f64 = 1e-6;

impl Fence {
    /// For values in µm.
    #[must_use]
    pub(crate) fn around(values: &[f64], deviations: f64) -> Self {
        let centre = median(values.iter().copied());
        Self { centre, distance: (deviations * median_absolute_deviation(values)).max(ROUNDING_UM) }
    }

    /// Whether a value is accepted.
    #[must_use]
    pub(crate) fn holds(self, value: f64) -> bool {
        (value - self.centre).abs() <= self.distance
    }
}

/// Root mean square; NaN of nothing.
#[must_use]
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (count, sum) = values.into_iter().fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
    (sum / count as f64).sqrt()
}

/// By how much correlation along a trace raises the variance of a mean: 1 + 2 Σ ρₖ over the lags before the
/// autocorrelation ρₖ first falls to 0; at least 1.
///
/// n such values are worth n divided by it (Bartlett 1946, "On the theoretical specification and sampling properties
/// of autocorrelated time-series", J. R. Stat. Soc. Suppl. 8, 27-41).
#[must_use]
pub(crate) fn correlation_factor(values: &[f64]) -> f64 {
    let power: f64 = values.iter().map(|value| value * value).sum();
    let correlation = |lag: usize| {
        let sum: f64 = values.iter().zip(values.iter().skip(lag)).map(|(early, late)| early * late).sum();
        sum / power
    };
    1.0 + 2.0 * (1..values.len()).map(correlation).take_while(|correlation| *correlation > 0.0).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wild_value_is_fenced_off() {
        let values = [1.0, 1.1, 0.9, 1.05, -53.0];
        let fence = Fence::around(&values, 5.0);
        // Median 1.0, absolute deviations 0, 0.1, 0.1, 0.05, 54: their median is 0.1.
        assert!((fence.centre - 1.0).abs() < 1e-12 && (fence.distance - 0.5).abs() < 1e-12);
        assert!(fence.holds(0.9) && !fence.holds(-53.0));
        assert!(Fence::around(&[2.0, 2.0, 2.0 + 1e-9], 5.0).holds(2.0 + 1e-9));
    }

    #[test]
    fn correlation_of_an_autoregression() {
        // x' = φx + e has ρₖ = φᵏ, so the factor is (1 + φ)/(1 − φ) = 3 at φ = 0.5; the noise of 200 000 values and of
        // the lags beyond the true correlation leaves a few percent.
        let mut seed = 5_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut state = 0.0;
        let values: Vec<f64> = (0..200_000)
            .map(|_| {
                state = 0.5 * state + uniform();
                state
            })
            .collect();
        let factor = correlation_factor(&values);
        assert!((factor - 3.0).abs() < 0.2, "{factor}");
    }
}

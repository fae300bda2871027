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
}

//! Errors that the means of places share, where errors of readings depend on each other in time.

use runout_core::consistency::in_time::InTime;

/// Readings of each place, and how their errors depend on each other.
#[derive(Debug, Clone)]
pub struct SharedErrors {
    /// How they depend on each other.
    pub of: InTime,
    /// Times of each place's readings, each with its share in the mean.
    pub readings: Vec<Vec<(f64, f64)>>,
}

impl SharedErrors {
    /// Covariance of the means at two places, in µm².
    #[must_use]
    pub(crate) fn covariance_um2(&self, one: usize, other: usize) -> f64 {
        let pairs =
            self.readings[one].iter().flat_map(|one| self.readings[other].iter().map(move |other| (one, other)));
        pairs.map(|(one, other)| one.1 * other.1 * self.of.covariance(one.0, other.0)).sum()
    }

    /// Of some places.
    #[must_use]
    pub(crate) fn some(&self, places: &[usize]) -> Self {
        Self { of: self.of, readings: places.iter().map(|place| self.readings[*place].clone()).collect() }
    }
}

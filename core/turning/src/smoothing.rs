//! Over how many orders covariances are averaged.

/// Orders to each side over which [`smooth`](crate::profile::smooth) averages: the scatter's spectrum is smooth, its estimate is not.
pub const SMOOTHING: usize = 2;

/// Orders to each side over which [`smooth_by_order`](crate::profile::smooth_by_order) averages: a quarter of the order, [`SMOOTHING`] at most.
#[must_use]
pub fn orders_beside(order: usize) -> usize {
    (order / 4).min(SMOOTHING)
}

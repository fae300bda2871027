//! Weighted sums of power and noise over stretches of orders.

use super::signal::signal_at;

/// Sums over some orders, each weighted.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub weight: f64,
    pub power: f64,
    pub noise: f64,
    /// Variance of the sum of noise.
    pub variance: f64,
}

impl std::ops::Add for Sums {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            weight: self.weight + other.weight,
            power: self.power + other.power,
            noise: self.noise + other.noise,
            variance: self.variance + other.variance,
        }
    }
}

impl Sums {
    /// Power beyond the noise in the mean, 0 where there is less.
    pub(super) fn signal(&self) -> f64 {
        if self.weight > 0.0 { ((self.power - self.noise) / self.weight).max(0.0) } else { 0.0 }
    }

    /// A quantile of what the power beyond the noise may be.
    pub(super) fn likely_signal(&self, quantile: usize) -> f64 {
        let std = self.variance.sqrt();
        if std > 0.0 && self.weight > 0.0 {
            std / self.weight * signal_at(quantile, (self.power - self.noise) / std, std / self.noise)
        } else {
            0.0
        }
    }
}

/// Sums over any stretch of orders. Weights differ by many powers of ten, so that differences of sums from the first order on would have no
/// digits left: sums of pairs, of pairs of these, and so on are kept.
pub(super) struct SumTree {
    sums: Vec<Sums>,
    orders: usize,
}

impl SumTree {
    pub(super) fn new(orders: usize, of: impl Fn(usize) -> Sums) -> Self {
        let mut sums = vec![Sums::default(); 2 * orders];
        for order in 0..orders {
            sums[orders + order] = of(order);
        }
        for pair in (1..orders).rev() {
            sums[pair] = sums[2 * pair] + sums[2 * pair + 1];
        }
        Self { sums, orders }
    }

    /// Over the orders from one up to another.
    pub(super) fn over(&self, from: usize, to: usize) -> Sums {
        let (mut low, mut high, mut sum) = (from + self.orders, to.max(from) + self.orders, Sums::default());
        while low < high {
            if low % 2 == 1 {
                sum = sum + self.sums[low];
                low += 1;
            }
            if high % 2 == 1 {
                high -= 1;
                sum = sum + self.sums[high];
            }
            (low, high) = (low / 2, high / 2);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums over stretches are those of their orders, however their weights differ.
    #[test]
    fn sums_of_a_stretch_lose_no_digits() {
        let of = |order: usize| Sums { weight: if order < 20 { 1e20 } else { 1.0 + order as f64 }, ..Sums::default() };
        let tree = SumTree::new(77, of);
        for (from, to) in [(0, 77), (20, 77), (21, 22), (30, 30), (19, 21), (50, 76)] {
            let expected: f64 = (from..to).map(|order| of(order).weight).sum();
            assert!((tree.over(from, to).weight - expected).abs() <= 1e-12 * expected, "{from} {to}");
        }
    }
}

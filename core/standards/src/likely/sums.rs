//! Weighted sums of power and noise over stretches of orders.

use super::signal::{Quantiles, signals_at};

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

    /// Quantiles of what the power beyond the noise may be.
    pub(super) fn likely_signals(&self) -> Quantiles {
        let std = self.variance.sqrt();
        if std > 0.0 && self.weight > 0.0 {
            let scale = std / self.weight;
            signals_at((self.power - self.noise) / std, std / self.noise).map(|signal| scale * signal)
        } else {
            Quantiles::default()
        }
    }
}

/// Sums over stretches of orders of which none begins or ends before the last one. Weights differ by many powers of ten, so that sums less those of
/// what is left behind would have no digits left: those that begin at each order up to a middle are kept, and the one from there on.
pub(super) struct Sliding<'a> {
    all: &'a [Sums],
    /// From each order of some before `middle` up to it, the nearest first.
    up_to_middle: Vec<Sums>,
    middle: usize,
    /// From the middle up to `end`.
    from_middle: Sums,
    end: usize,
}

impl<'a> Sliding<'a> {
    pub(super) fn new(all: &'a [Sums]) -> Self {
        Self { all, up_to_middle: Vec::new(), middle: 0, from_middle: Sums::default(), end: 0 }
    }

    /// Over the orders from one up to another.
    pub(super) fn over(&mut self, from: usize, to: usize) -> Sums {
        let to = to.min(self.all.len());
        if from >= to {
            return Sums::default();
        }
        for sums in &self.all[self.end.min(to)..to] {
            self.from_middle = self.from_middle + *sums;
        }
        self.end = to;
        if from >= self.middle {
            self.up_to_middle.clear();
            let mut sum = Sums::default();
            for sums in self.all[from..to].iter().rev() {
                sum = sum + *sums;
                self.up_to_middle.push(sum);
            }
            (self.middle, self.from_middle) = (to, Sums::default());
        }
        self.up_to_middle[self.middle - from - 1] + self.from_middle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums over stretches are those of their orders, however their weights differ.
    #[test]
    fn sums_of_a_stretch_lose_no_digits() {
        let weight = |order: usize| if order < 20 { 1e20 } else { 1.0 + order as f64 };
        let all: Vec<Sums> = (0..77).map(|order| Sums { weight: weight(order), ..Sums::default() }).collect();
        let mut sliding = Sliding::new(&all);
        let stretches =
            [(2, 1), (0, 3), (0, 5), (2, 30), (19, 31), (20, 31), (21, 60), (30, 30), (40, 61), (59, 77), (76, 77)];
        for (from, to) in stretches {
            let expected: f64 = (from..to).map(weight).sum();
            assert!((sliding.over(from, to).weight - expected).abs() <= 1e-12 * expected, "{from} {to}");
        }
    }
}

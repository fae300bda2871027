//! Numbers drawn by chance.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Chance: the same seed and index give the same numbers.
pub struct Chance {
    random: ChaCha8Rng,
}

impl Chance {
    /// Of one campaign.
    #[must_use]
    pub fn new(seed: u64, index: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(index);
        Self { random }
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        self.random.random_range(0..count)
    }

    /// One of several.
    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    /// A number between two, all as likely.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    /// A number of a normal distribution with the standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// Every decade as likely.
    pub fn size(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// A size of either sign, every decade as likely; of pairs (`large`) only the upper half of the decades.
    pub fn signed(&mut self, low: f64, high: f64, large: bool) -> f64 {
        let low = if large { (low * high).sqrt() } else { low };
        let size = self.size(low, high);
        if self.below(2) == 0 { size } else { -size }
    }

    /// Some of several, in their order.
    pub fn some_of<T: Copy>(&mut self, all: &[T], count: usize) -> Vec<T> {
        let mut places: Vec<usize> = (0..all.len()).collect();
        while places.len() > count {
            let place = self.below(places.len());
            places.remove(place);
        }
        places.into_iter().map(|place| all[place]).collect()
    }
}

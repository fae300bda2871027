//! The range of a few normal numbers: its mean, and what a range found says of it.

use runout_core::draws::{Draw, Uncertainty};

/// Draws of a range.
const DRAWS: usize = 4000;

/// Ranges of so many normal numbers of standard deviation 1, ascending, and their mean.
pub(super) fn ranges(count: usize, seed: u64) -> (Vec<f64>, f64) {
    let mut draw = Draw::new(seed);
    let mut one = || {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for _ in 0..count {
            let number = draw.normal();
            (low, high) = (low.min(number), high.max(number));
        }
        high - low
    };
    let mut all: Vec<f64> = (0..DRAWS).map(|_| one()).collect();
    all.sort_by(f64::total_cmp);
    let mean = all.iter().sum::<f64>() / DRAWS as f64;
    (all, mean)
}

/// What is known of the range that so many numbers have on average, from one range of them: range/σ has a distribution that is known.
pub(super) fn of_range(range: f64, count: usize, seed: u64) -> Option<Uncertainty> {
    if range <= 0.0 {
        return None;
    }
    let (all, mean) = ranges(count, seed);
    let at = |share: f64| mean * range / all[(share * (DRAWS - 1) as f64).round() as usize];
    let squares = all.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64;
    Some(Uncertainty::new(range * squares.sqrt() / mean, [at(0.975), at(0.025)], DRAWS))
}

//! Values of anything that was measured, as functions of a draw: what may be true is measured again.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::uncertainty::{NORMAL_95, Uncertainty, student_95};

/// Draws of each truth measured again.
const DRAWS: usize = 200;

/// Normal numbers of one draw.
#[derive(Debug, Clone)]
pub struct Draw(ChaCha8Rng);

impl Draw {
    /// Those of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// The next number of mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// A true standard deviation over the one found from so many degrees of freedom: √(ν/χ²). It is at most what Student's interval of one degree
    /// of freedom is wider by than the normal one, 6.5: of one or two, intervals would say nothing.
    pub fn true_std_ratio(&mut self, freedom: usize) -> f64 {
        let squares: f64 = (0..freedom).map(|_| self.normal().powi(2)).sum();
        (freedom as f64 / squares).sqrt().min(student_95(1.0) / NORMAL_95)
    }
}

/// What may be true, and is measured again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// What was found, less what noise alone may have made: noise raises the rest most.
    Least,
    /// What was found, with its noise: what is there is raised least.
    Most,
    /// What was found with noise once more: noise may have hidden as much of what is there.
    Hidden,
}

impl Truth {
    const ALL: [Self; 3] = [Self::Least, Self::Most, Self::Hidden];
}

/// How far means are drawn together that have this variance, where noise has this share of it: what is left has the power without noise.
#[must_use]
pub fn without_noise(variance: f64, of_noise: f64) -> f64 {
    if variance > 0.0 { (1.0 - of_noise / variance).max(0.0).sqrt() } else { 0.0 }
}

/// A truth measured again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeasuredAgain {
    /// Its values.
    pub truth: Vec<f64>,
    /// What they are off by.
    pub error: Vec<f64>,
}

/// What is known of values. `measure` measures a truth again.
///
/// Noise has raised the value by the mean of the errors, which is subtracted from the interval (basic bootstrap: Davison, Hinkley,
/// *Bootstrap Methods*, 1997, section 2.4). It contains those of all truths, and what noise may have hidden itself: near 0, the size
/// of what is hidden is not that of an error.
pub fn measured_again(
    values: &[f64],
    seed: u64,
    measure: impl Fn(Truth, &mut Draw) -> MeasuredAgain,
) -> Vec<Uncertainty> {
    let mut draw = Draw::new(seed);
    let all = Truth::ALL.map(|truth| (0..DRAWS).map(|_| measure(truth, &mut draw)).collect::<Vec<MeasuredAgain>>());
    let known = |(index, value): (usize, &f64)| {
        let (mut std, mut interval) = (0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
        let mut widen = |ends: [f64; 2]| interval = [interval[0].min(ends[0]), interval[1].max(ends[1])];
        for (truth, measured) in Truth::ALL.into_iter().zip(&all) {
            let errors = Sorted::of(measured.iter().map(|one| one.error[index]));
            std = std.max(errors.std());
            let [low, high] = errors.interval_95();
            widen([value - high, value - low]);
            if truth == Truth::Hidden {
                let hidden = Sorted::of(measured.iter().map(|one| one.truth[index]));
                widen(hidden.interval_95().map(|end| end - errors.quantile(0.5)));
            }
        }
        Uncertainty::new(std, interval, Truth::ALL.len() * DRAWS)
    };
    values.iter().enumerate().map(known).collect()
}

/// Numbers of [`DRAWS`] draws, in order.
struct Sorted(Vec<f64>);

impl Sorted {
    fn of(numbers: impl Iterator<Item = f64>) -> Self {
        let mut numbers: Vec<f64> = numbers.collect();
        numbers.sort_by(f64::total_cmp);
        Self(numbers)
    }

    /// That of a normal distribution with the same interval: of few degrees of freedom the variance is infinite.
    fn std(&self) -> f64 {
        let [low, high] = self.interval_95();
        (high - low) / (2.0 * NORMAL_95)
    }

    fn interval_95(&self) -> [f64; 2] {
        [0.025, 0.975].map(|share| self.quantile(share))
    }

    fn quantile(&self, share: f64) -> f64 {
        self.0[(share * (self.0.len() - 1) as f64).round() as usize]
    }
}

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

    /// A true standard deviation over the one found from so many degrees of freedom: √(ν/χ²), as wide as 95 % of all at most.
    pub fn true_std_ratio(&mut self, freedom: usize) -> f64 {
        let squares: f64 = (0..freedom).map(|_| self.normal().powi(2)).sum();
        let widest = student_95(freedom as f64) / NORMAL_95;
        (freedom as f64 / squares).sqrt().min(widest)
    }
}

/// What may be true, and is measured again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Truth {
    /// What was found, less what noise alone may have made: what is left is raised most by noise.
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

/// What is known of values. `error` measures a truth again, and gives what the values are then off by.
///
/// What an error is on average, noise has raised the value by: the interval takes it back (basic bootstrap: Davison, Hinkley, *Bootstrap
/// Methods*, 1997, section 2.4). It contains those of all truths.
pub fn measured_again(values: &[f64], seed: u64, error: impl Fn(Truth, &mut Draw) -> Vec<f64>) -> Vec<Uncertainty> {
    let mut draw = Draw::new(seed);
    let errors = Truth::ALL.map(|truth| (0..DRAWS).map(|_| error(truth, &mut draw)).collect::<Vec<Vec<f64>>>());
    let known = |(index, value): (usize, &f64)| {
        let (mut std, mut interval) = (0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for errors in &errors {
            let mut of: Vec<f64> = errors.iter().map(|error| error[index]).collect();
            of.sort_by(f64::total_cmp);
            let mean = of.iter().sum::<f64>() / DRAWS as f64;
            std = std.max((of.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64).sqrt());
            let at = |share: f64| value - of[(share * (DRAWS - 1) as f64).round() as usize];
            interval = [interval[0].min(at(0.975)), interval[1].max(at(0.025))];
        }
        Uncertainty::new(std, interval, Truth::ALL.len() * DRAWS)
    };
    values.iter().enumerate().map(known).collect()
}

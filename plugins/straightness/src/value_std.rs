//! How uncertain a value of a whole profile is: less than a value at one position, where errors average out along it.

use runout_core::numerics::least_squares::Basis;

use crate::{
    contrasts::TraceErrors,
    grid::{Grid, Split},
};

/// Correlations along the profile below this are none.
const NONE: f64 = 0.1;

/// What errors of a profile are made of.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ProfileErrors {
    /// Standard deviation at each position of what the scatter of the traces shows, in µm.
    pub noise_um: Vec<f64>,
    /// Correlation of that over 0, 1, … positions.
    pub correlation: Vec<f64>,
    /// Degrees of freedom behind the standard deviation at one position; 0 where it holds them.
    pub freedom: f64,
    /// Changes of the whole profile, in µm, each with a factor of its own that has the standard deviation 1.
    pub common_um: Vec<Vec<f64>>,
}

impl ProfileErrors {
    /// Standard uncertainty of Σ gᵢ·pᵢ; NaN where the noise is not known.
    #[must_use]
    pub(crate) fn of(&self, weights: &[f64]) -> f64 {
        let scaled: Vec<f64> = weights.iter().zip(&self.noise_um).map(|(weight, std)| weight * std).collect();
        let own: f64 = scaled.iter().map(|value| value * value).sum();
        let at = |lag: usize| scaled.iter().zip(&scaled[lag.min(scaled.len())..]).map(|(a, b)| a * b).sum::<f64>();
        let beside: f64 = self.correlation.iter().enumerate().skip(1).map(|(lag, share)| 2.0 * share * at(lag)).sum();
        let along = |change: &Vec<f64>| weights.iter().zip(change).map(|(a, b)| a * b).sum::<f64>();
        let common: f64 = self.common_um.iter().map(|change| along(change).powi(2)).sum();
        // A covariance that is cut off is none by right: alternating weights may make it too small.
        ((own + beside).max(NONE * own) + common).sqrt()
    }

    /// Standard uncertainty at each position.
    pub(crate) fn std_um(&self) -> Vec<f64> {
        let common = |at: usize| self.common_um.iter().map(|change| change[at] * change[at]).sum::<f64>();
        self.noise_um.iter().enumerate().map(|(at, noise)| (noise * noise + common(at)).sqrt()).collect()
    }

    /// Adds what parameters of effects change, which are known with a covariance.
    pub(crate) fn add(&mut self, moves: &[&[f64]], covariance: &[Vec<f64>]) {
        // Cholesky's factor; a parameter that others determine adds nothing.
        let count = moves.len();
        let mut lower = vec![vec![0.0; count]; count];
        for row in 0..count {
            for column in 0..=row {
                let before: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
                let left = covariance[row][column] - before;
                lower[row][column] = if row == column {
                    left.max(0.0).sqrt()
                } else if lower[column][column] > 0.0 {
                    left / lower[column][column]
                } else {
                    0.0
                };
            }
        }
        for column in 0..count {
            let length = moves.first().map_or(0, |change| change.len());
            let sum = |at: usize| (column..count).map(|row| lower[row][column] * moves[row][at]).sum::<f64>();
            self.common_um.push((0..length).map(sum).collect());
        }
    }

    /// The errors at some of the positions.
    #[must_use]
    pub(crate) fn at(&self, kept: &[usize]) -> Self {
        let select = |values: &Vec<f64>| kept.iter().filter_map(|at| values.get(*at).copied()).collect::<Vec<f64>>();
        Self {
            noise_um: select(&self.noise_um),
            correlation: self.correlation.clone(),
            freedom: self.freedom,
            common_um: self.common_um.iter().map(select).collect(),
        }
    }
}

/// Correlation of the errors of a fit by some deviations, over 0, 1, … of so many positions: what a single error in the middle becomes.
pub(crate) fn correlation_of(smooth: &Basis, positions: usize) -> Vec<f64> {
    let middle = positions / 2;
    let mut left = vec![0.0; positions];
    left[middle] = 1.0;
    smooth.remove_from(&mut left);
    let own = 1.0 - left[middle];
    if own <= 0.0 {
        return vec![1.0];
    }
    std::iter::once(1.0).chain(left[middle + 1..].iter().map(|left| -left / own)).collect()
}

impl Grid {
    /// Errors of part and slide of the scatter about the setups' means, as it is at each position.
    pub(crate) fn scattered(&self, split: &Split, freedom: f64) -> [ProfileErrors; 2] {
        let of_slide = self.smooth.as_ref().map(|smooth| correlation_of(smooth, self.z_mm.len()));
        let correlations = [split.correlation.clone(), of_slide.unwrap_or_else(|| split.correlation.clone())];
        let (mut shares, mut correlations) = (split.shares.iter(), correlations.into_iter());
        [0, 1].map(|_| {
            let noise = split.variance.iter().zip(shares.next().into_iter().flatten());
            ProfileErrors {
                noise_um: noise.map(|(variance, share)| (variance * share).sqrt()).collect(),
                correlation: correlations.next().unwrap_or_default(),
                freedom,
                common_um: Vec::new(),
            }
        })
    }

    /// Errors of part and slide where those of each trace depend on each other along z.
    pub(crate) fn correlated(&self, split: &Split, errors: &TraceErrors) -> [ProfileErrors; 2] {
        let left = errors.at(&errors.left_um2, &self.z_mm);
        let mut both = split.shares.each_ref().map(|shares| {
            let noise = left.iter().zip(shares).map(|(left, share)| ((left + errors.independent_um2) * share).sqrt());
            ProfileErrors { noise_um: noise.collect(), correlation: vec![1.0], ..ProfileErrors::default() }
        });
        for change in &errors.changes_um {
            let change = errors.at(change, &self.z_mm);
            for setup in [0, 1] {
                let count = self.setups.iter().filter(|own| **own == setup).count() as f64;
                let of = |own: &usize| {
                    let share = if *own == setup { count.sqrt().recip() } else { 0.0 };
                    change.iter().map(|entry| share * entry).collect()
                };
                let moved = self.split(&self.setups.iter().map(of).collect::<Vec<Vec<f64>>>());
                both[0].common_um.push(moved.part_um);
                both[1].common_um.push(moved.slide_um);
            }
        }
        both
    }

    /// Correlation along the profile of what traces differ by from their setup's mean, over 0, 1, … positions, as far as there is one.
    pub(crate) fn correlation(&self, aligned: &[Vec<f64>], means: &[[f64; 2]]) -> Vec<f64> {
        let positions = means.len();
        let left = |trace: usize, at: usize| {
            if self.present[trace][at] { aligned[trace][at] - means[at][self.setups[trace]] } else { 0.0 }
        };
        let product = |lag: usize| -> f64 {
            let sum = |trace: usize| (lag..positions).map(|at| left(trace, at - lag) * left(trace, at)).sum::<f64>();
            (0..aligned.len()).map(sum).sum::<f64>() / (positions - lag).max(1) as f64
        };
        let own = product(0);
        let found = (0..positions / 4).map(|lag| if own > 0.0 { product(lag) / own } else { 0.0 });
        std::iter::once(1.0).chain(found.skip(1).take_while(|share| *share > NONE)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_errors_average_out_and_common_ones_do_not() {
        let mut errors = ProfileErrors { noise_um: vec![0.1; 100], correlation: vec![1.0], ..ProfileErrors::default() };
        let mean = vec![0.01; 100];
        assert!((errors.of(&mean) - 0.01).abs() < 1e-12);
        errors.correlation = vec![1.0, 0.5];
        // 1 + 2 · 0.5 · 99/100.
        assert!((errors.of(&mean) - 0.01 * 1.99_f64.sqrt()).abs() < 1e-12);
        let (level, slope) = (vec![1.0; 100], (0..100).map(|at| f64::from(at) - 49.5).collect::<Vec<f64>>());
        errors.add(&[&level, &slope], &[vec![0.04, 0.03], vec![0.03, 0.09]]);
        assert!((errors.of(&mean).powi(2) - (1.99e-4 + 0.04)).abs() < 1e-12);
        assert!(ProfileErrors { noise_um: vec![f64::NAN; 100], ..errors }.of(&mean).is_nan());
    }
}

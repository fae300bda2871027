//! Errors at a few points of a profile, drawn from their joint covariance.
//!
//! Which point of a profile is its highest is decided, with small errors, between the few that are nearly as high. Errors of a
//! separated form are stationary over the angle: at two points that are α apart they have the covariance ½ Σ σₙ² cos nα, which one
//! transform gives for all pairs. Independent normal numbers times the Cholesky factor of that covariance are errors at
//! these points. Pivots are taken by size, and what is left of the variance below a millionth is no number of its own:
//! neighbouring points have nearly the same error. Each draw is independent of all others, where a drawn profile serves for 25.

use crate::errors::{Draws, Noise};
use runout_numerics::{
    Complex64,
    fourier::Fourier,
    lanes::{NullaryFnOnce, vectorised},
};

/// Share of an error's variance that is left out: a thousandth of its standard deviation.
const NEGLIGIBLE: f64 = 1e-6;
/// Points whose errors are summed side by side.
const LANES: usize = 16;

/// Covariance of the errors of a profile on equal angles.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// Of two errors that are so many angles apart.
    by_step: Vec<f64>,
}

impl Covariance {
    /// From the variance E|δ|² of the harmonics by order from 0, on the angles that `fourier` has; orders without a known variance,
    /// and those below 2, are taken as exact. `None` where no variance is known.
    #[must_use]
    pub fn new(variance: &[f64], fourier: &mut Fourier) -> Option<Self> {
        let known = |(order, variance): (usize, &f64)| if order >= 2 && *variance > 0.0 { 0.5 * variance } else { 0.0 };
        let by_step = fourier.synthesise(variance.iter().enumerate().map(|pair| Complex64::from(known(pair)))).to_vec();
        (by_step.first().is_some_and(|variance| *variance > 0.0)).then_some(Self { by_step })
    }

    /// Standard deviation of an error at any one angle.
    #[must_use]
    pub fn std_um(&self) -> f64 {
        self.by_step[0].sqrt()
    }
}

/// Draws of the errors at some points.
#[derive(Debug, Clone)]
pub struct ErrorsAt {
    draws: Draws,
    /// Independent numbers of a draw.
    numbers: Vec<f64>,
    /// What each of them adds to each point: groups of [`LANES`] points, in each group number by number.
    shares: Vec<f64>,
    points: usize,
    /// Whole groups.
    errors_um: Vec<f64>,
}

impl ErrorsAt {
    /// At these angles by their numbers, from the numbers of a seed.
    #[must_use]
    pub fn new(covariance: &Covariance, points: &[usize], noise: &Noise) -> Self {
        let between = |i: usize, j: usize| covariance.by_step[points[i].abs_diff(points[j])];
        let enough = NEGLIGIBLE * covariance.by_step[0];
        let mut left = vec![covariance.by_step[0]; points.len()];
        let mut columns: Vec<Vec<f64>> = Vec::new();
        while columns.len() < points.len() {
            let pivot = (0..left.len()).fold(0, |best, point| if left[point] > left[best] { point } else { best });
            if left[pivot] <= enough {
                break;
            }
            let root = left[pivot].sqrt();
            let mut column: Vec<f64> = (0..points.len()).map(|point| between(point, pivot)).collect();
            for other in &columns {
                let share = other[pivot];
                column.iter_mut().zip(other).for_each(|(value, other)| *value -= share * other);
            }
            for (value, left) in column.iter_mut().zip(&mut left) {
                *value /= root;
                *left -= *value * *value;
            }
            left[pivot] = 0.0;
            columns.push(column);
        }
        let (rank, groups) = (columns.len(), points.len().div_ceil(LANES));
        let share = |place: usize| {
            let (group, number, lane) = (place / (LANES * rank), place / LANES % rank, place % LANES);
            columns[number].get(group * LANES + lane).copied().unwrap_or(0.0)
        };
        Self {
            draws: Draws::new(noise, rank.div_ceil(2)),
            numbers: vec![0.0; rank],
            shares: (0..groups * LANES * rank).map(share).collect(),
            points: points.len(),
            errors_um: vec![0.0; groups * LANES],
        }
    }

    /// The next errors, independent of all before.
    pub fn draw(&mut self) -> &[f64] {
        let pairs = self.draws.next(self.numbers.len().div_ceil(2)).flatten();
        let drawn = pairs.flat_map(|pair| [pair.re, pair.im]);
        self.numbers.iter_mut().zip(drawn).for_each(|(number, drawn)| *number = drawn);
        vectorised(Sums { numbers: &self.numbers, shares: &self.shares, errors_um: &mut self.errors_um });
        &self.errors_um[..self.points]
    }
}

/// What all numbers add to all points.
struct Sums<'a> {
    numbers: &'a [f64],
    shares: &'a [f64],
    errors_um: &'a mut [f64],
}

impl NullaryFnOnce for Sums<'_> {
    type Output = ();

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "what is not inlined is compiled for narrow registers")]
    fn call(self) {
        let groups = self.shares.chunks_exact((LANES * self.numbers.len()).max(1));
        for (errors, shares) in self.errors_um.chunks_exact_mut(LANES).zip(groups) {
            let mut sums = [0.0; LANES];
            for (number, shares) in self.numbers.iter().zip(shares.chunks_exact(LANES)) {
                sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += number * share);
            }
            errors.copy_from_slice(&sums);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::uncertainty::Errors;

    /// Products of errors at three points, two of them neighbours, beside those of whole drawn profiles and closed forms.
    #[test]
    fn errors_at_points_have_the_covariance_of_profiles() {
        let variance: Vec<f64> = (0..60).map(|order| 1e-4 / (1.0 + f64::from(order))).collect();
        let (mut fourier, points, draws) = (Fourier::new(512), [100, 101, 400], 4000);
        let covariance = Covariance::new(&variance, &mut fourier).unwrap();
        let mut at = ErrorsAt::new(&covariance, &points, &Noise::new(60, 3));
        let mut whole = Errors::new(&variance, 2, 3).unwrap();
        let (mut profile, mut sums) = (vec![0.0; 512], [[[0.0; 3]; 3]; 2]);
        for _ in 0..draws {
            let errors = at.draw().to_vec();
            whole.fresh(&mut fourier, &mut profile);
            for (i, j) in (0..9).map(|pair| (pair / 3, pair % 3)) {
                sums[0][i][j] += errors[i] * errors[j];
                sums[1][i][j] += profile[points[i]] * profile[points[j]];
            }
        }
        let power = 0.5 * variance[2..].iter().sum::<f64>();
        assert!((covariance.std_um().powi(2) / power - 1.0).abs() < 1e-12);
        for (i, j) in (0..9).map(|pair| (pair / 3, pair % 3)) {
            let apart = std::f64::consts::TAU * points[i].abs_diff(points[j]) as f64 / 512.0;
            let expected: f64 = (2..60).map(|order| 0.5 * variance[order] * (order as f64 * apart).cos()).sum();
            for sum in sums {
                // 4000 draws: √2/√4000 of the variance, four of them.
                assert!((sum[i][j] / f64::from(draws) - expected).abs() < 0.09 * power, "{i} {j} {sum:?} {expected}");
            }
        }
        assert!(Covariance::new(&[f64::NAN; 9], &mut fourier).is_none());
        // A point beside itself needs no number of its own.
        assert_eq!(ErrorsAt::new(&covariance, &[7, 7], &Noise::new(60, 3)).numbers.len(), 1);
    }
}

//! Independent blocks against each other: sums over blocks must scatter as the noise model says.
//!
//! A value is Σ aᵢyᵢ. With r what the fit leaves, the block's sum is u_b = Σ_{i∈b} aᵢrᵢ, and K its covariance over the blocks under
//! the noise model, K = Wᵀ M V M W. κ² = Σ u²/tr K has ν = (tr K)²/‖K‖² degrees of freedom (Satterthwaite, Biometrics Bull. 2
//! (1946) 110): Birge's ratio (Phys. Rev. 40 (1932) 207) for sums, unbiased for any leverage as CR2 is (Bell, McCaffrey, Surv.
//! Methodol. 28 (2002) 169), without roots of matrices.

use nalgebra::DMatrix;
use runout_numerics::{
    least_squares::dot,
    statistics::{chi2_tail, f_tail},
};

use crate::{check::widening, order::Correlated};

/// How the errors of the readings are taken to be.
#[derive(Debug, Clone, Copy)]
pub enum Errors<'a> {
    /// Independent, of one variance; from so many degrees of freedom, or known.
    White {
        /// Variance of one reading.
        variance: f64,
        /// Degrees of freedom that it is known from; infinite where it is known.
        dof: f64,
    },
    /// Correlated within series.
    Correlated(&'a Correlated),
}

/// How far blocks scatter, against what the noise model says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dispersion {
    /// Observed over expected variance of the blocks' sums, κ².
    pub ratio: f64,
    /// Its degrees of freedom ν.
    pub freedom: f64,
    /// Degrees of freedom of the variance that it is compared with.
    pub below: f64,
    /// Chance of as much scatter.
    pub p: f64,
}

impl Errors<'_> {
    /// aᵀ·V·a.
    #[must_use]
    pub fn variance_of(&self, weights: &[f64]) -> f64 {
        match self {
            Self::White { variance, .. } => variance * dot(weights, weights),
            Self::Correlated(errors) => errors.variance_of(weights),
        }
    }

    /// Degrees of freedom that the size of the errors is known from.
    #[must_use]
    pub fn freedom(&self) -> f64 {
        match self {
            Self::White { dof, .. } => *dof,
            Self::Correlated(errors) => errors.freedom(),
        }
    }
}

/// The dispersion of all values together, and of each: `weights` `[value][reading]`, `basis` the orthonormal columns of the fit that left
/// `residual`, `members` the readings of each block. `None` where the fit leaves the blocks nothing to differ in.
#[must_use]
pub fn dispersion(
    weights: &[Vec<f64>],
    basis: &[Vec<f64>],
    residual: &[f64],
    members: &[Vec<usize>],
    errors: Errors,
) -> Option<(Dispersion, Vec<Dispersion>)> {
    let scaled: Vec<Vec<f64>> = (weights.iter())
        .filter_map(|one| {
            let std = errors.variance_of(one).sqrt();
            (std > 0.0).then(|| one.iter().map(|weight| weight / std).collect())
        })
        .collect();
    let members: Vec<&Vec<usize>> = members.iter().filter(|block| !block.is_empty()).collect();
    if members.len() < 2 || scaled.is_empty() {
        return None;
    }
    let sums = Sums::of(&scaled, basis, residual, &members, errors);
    let whole = sums.dispersion(0, 1, errors)?;
    let each = (0..scaled.len()).filter_map(|value| sums.dispersion(value, scaled.len(), errors)).collect();
    Some((whole, each))
}

/// Sums over blocks, block by block and value by value, with their covariance.
struct Sums {
    sums: Vec<f64>,
    covariance: DMatrix<f64>,
}

impl Sums {
    fn of(weights: &[Vec<f64>], basis: &[Vec<f64>], residual: &[f64], members: &[&Vec<usize>], errors: Errors) -> Self {
        let (readings, values) = (residual.len(), weights.len());
        let count = members.len() * values;
        // Column `block · values + value` of W holds the weights of one value at the readings of one block.
        let entries = |column: usize| {
            let weights = &weights[column % values];
            members[column / values].iter().map(move |reading| (*reading, weights[*reading]))
        };
        let along =
            |column: usize, of: &[f64]| entries(column).map(|(reading, weight)| weight * of[reading]).sum::<f64>();
        let sums = (0..count).map(|column| along(column, residual)).collect();
        let covariance = match errors {
            // WᵀMMW is WᵀW, of which different blocks have nothing, less the part in the span of the basis.
            Errors::White { variance, .. } => {
                let inside = DMatrix::from_fn(basis.len(), count, |row, column| along(column, &basis[row]));
                let mut covariance = -inside.transpose() * inside;
                for block in 0..members.len() {
                    for (one, weights) in weights.iter().enumerate() {
                        let column = block * values + one;
                        for other in 0..values {
                            covariance[(block * values + other, column)] += along(block * values + other, weights);
                        }
                    }
                }
                covariance * variance
            }
            Errors::Correlated(errors) => {
                let mut covariance = DMatrix::zeros(count, count);
                let places: Vec<usize> = (0..count).collect();
                // Some columns at once: all of them are as many as the square of the blocks.
                for some in places.chunks(AT_ONCE) {
                    let mut spread = DMatrix::zeros(readings, some.len());
                    for (place, column) in some.iter().enumerate() {
                        entries(*column).for_each(|(reading, weight)| spread[(reading, place)] = weight);
                    }
                    remove(basis, &mut spread);
                    let mut spread = errors.times(&spread);
                    remove(basis, &mut spread);
                    for (place, column) in some.iter().enumerate() {
                        let spread = spread.column(place);
                        (0..count).for_each(|other| covariance[(other, *column)] = along(other, spread.as_slice()));
                    }
                }
                covariance
            }
        };
        Self { sums, covariance }
    }

    /// Of every `step`-th sum from `first` on.
    fn dispersion(&self, first: usize, step: usize, errors: Errors) -> Option<Dispersion> {
        let places: Vec<usize> = (first..self.sums.len()).step_by(step).collect();
        let expected: f64 = places.iter().map(|place| self.covariance[(*place, *place)]).sum();
        let square = |a: usize| places.iter().map(move |b| self.covariance[(a, *b)].powi(2)).sum::<f64>();
        let squares: f64 = places.iter().map(|place| square(*place)).sum();
        // Each sum is in units of its value's standard uncertainty: below this, a fit absorbs the blocks.
        if expected < ABSORBED * places.len() as f64 || squares <= 0.0 {
            return None;
        }
        let ratio = places.iter().map(|place| self.sums[*place].powi(2)).sum::<f64>() / expected;
        let freedom = expected * expected / squares;
        let below = errors.freedom();
        let p = if below.is_finite() && matches!(errors, Errors::White { .. }) {
            f_tail(ratio, freedom, (below - freedom).max(1.0))
        } else {
            chi2_tail(ratio * freedom, freedom)
        };
        Some(Dispersion { ratio, freedom, below, p })
    }
}

/// Columns whose covariance is computed together.
const AT_ONCE: usize = 16;

/// Takes orthonormal columns out of others.
fn remove(basis: &[Vec<f64>], columns: &mut DMatrix<f64>) {
    for mut column in columns.column_iter_mut() {
        for known in basis {
            let share = dot(known, column.as_slice());
            column.as_mut_slice().iter_mut().zip(known).for_each(|(entry, known)| *entry -= share * known);
        }
    }
}

/// Share of a value's variance below which the sum over a block has none of its own.
const ABSORBED: f64 = 1e-9;

/// Chance that blocks agree so well on an effect that is not there, with F and its degrees of freedom below; `None` where they are too
/// few to say. `columns` are the effect's, orthonormal and outside `basis`, which is that of the fit that left `residual`.
///
/// The effect's size is set against the scatter of its sums over the blocks, F = (|Cᵀr|²/q)/(Σ u²/tr K) with (q, ν). Blocks that are few
/// know their scatter badly: where it agrees with the noise of single readings, that noise with all its degrees of freedom takes its place.
#[must_use]
pub fn agreement(
    columns: &[Vec<f64>],
    basis: &[Vec<f64>],
    residual: &[f64],
    members: &[Vec<usize>],
) -> Option<(f64, f64, f64)> {
    let members: Vec<&Vec<usize>> = members.iter().filter(|block| !block.is_empty()).collect();
    if members.len() < 2 || columns.is_empty() {
        return None;
    }
    let sizes: Vec<f64> = columns.iter().map(|column| dot(column, residual)).collect();
    let mut left = residual.to_vec();
    for (column, size) in columns.iter().zip(&sizes) {
        left.iter_mut().zip(column).for_each(|(entry, column)| *entry -= size * column);
    }
    let joint: Vec<Vec<f64>> = basis.iter().chain(columns).cloned().collect();
    let dof = left.len().saturating_sub(joint.len()).max(1) as f64;
    let noise = Errors::White { variance: dot(&left, &left) / dof, dof };
    let scatter = Sums::of(columns, &joint, &left, &members, noise).dispersion(0, 1, noise)?;
    if scatter.freedom < LEAST_FREEDOM {
        return None;
    }
    let is_noise = scatter.freedom < FEW_FREEDOM && scatter.p > widening(members.len());
    let (ratio, freedom) = if is_noise { (1.0, dof) } else { (scatter.ratio, scatter.freedom) };
    let parameters = columns.len() as f64;
    let expected = parameters * ratio * dot(&left, &left) / dof;
    let f = sizes.iter().map(|size| size * size).sum::<f64>() / expected.max(f64::MIN_POSITIVE);
    Some((f_tail(f, parameters, freedom), f, freedom))
}

/// Degrees of freedom of the blocks' scatter from which they can check an effect.
const LEAST_FREEDOM: f64 = 1.5;
/// Degrees of freedom below which blocks are few: with them, F at a chance of 0.001 asks for 6 standard deviations.
const FEW_FREEDOM: f64 = 6.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use runout_numerics::least_squares::Basis;

    fn blocks(count: usize, each: usize) -> Vec<Vec<usize>> {
        (0..count).map(|block| (block * each..(block + 1) * each).collect()).collect()
    }

    /// A mean and a slope of noise: the share of p below 0.05 and 0.005 is that, from three blocks on.
    #[test]
    fn the_size_of_the_test_is_what_it_says() {
        let mut random = Random::new(1);
        for count in [3, 5, 8] {
            let readings = 12 * count;
            let line = vec![vec![1.0; readings], (0..readings).map(|place| place as f64 - 17.0).collect()];
            let basis = Basis::of(line);
            let (trials, mut below) = (2000, [0; 2]);
            for _ in 0..trials {
                let mut residual: Vec<f64> = (0..readings).map(|_| random.normal()).collect();
                basis.remove_from(&mut residual);
                let dof = (readings - 2) as f64;
                let errors = Errors::White { variance: dot(&residual, &residual) / dof, dof };
                let found = dispersion(&basis.weights(), basis.columns(), &residual, &blocks(count, 12), errors);
                let (whole, each) = found.unwrap();
                assert_eq!(each.len(), 2);
                below[0] += usize::from(whole.p < 0.05);
                below[1] += usize::from(whole.p < 0.005);
            }
            let shares = below.map(|below| below as f64 / f64::from(trials));
            assert!((0.02..0.07).contains(&shares[0]) && shares[1] < 0.009, "{count} blocks: {shares:?}");
        }
    }

    /// Blocks that are offset by as much as the noise are found; an effect in all blocks is one, of a single block it is not.
    #[test]
    fn blocks_that_differ_are_found_and_effects_need_their_agreement() {
        let mut random = Random::new(2);
        let (count, each) = (8, 20);
        let level = Basis::of(vec![vec![1.0; count * each]]);
        let column: Vec<f64> = (0..count * each).map(|place| (place as f64 * 1.7).sin()).collect();
        let own = level.extended(vec![column.clone()]);
        let effect = &own.columns()[1..];
        let (mut offset_found, mut agreed, mut single) = (0, 0, 0);
        for _ in 0..100 {
            let noise: Vec<f64> = (0..count * each).map(|_| random.normal()).collect();
            let offsets: Vec<f64> = (0..count).map(|_| random.normal()).collect();
            let shifted: Vec<f64> = noise.iter().enumerate().map(|(at, value)| value + offsets[at / each]).collect();
            let left = |mut values: Vec<f64>| {
                level.remove_from(&mut values);
                values
            };
            let shifted = left(shifted);
            let variance = dot(&shifted, &shifted) / (count * each - 1) as f64;
            let errors = Errors::White { variance, dof: (count * each - 1) as f64 };
            let found = dispersion(&level.weights(), level.columns(), &shifted, &blocks(count, each), errors).unwrap();
            offset_found += usize::from(found.0.p < 0.005 && found.0.ratio > 2.0);
            let with = |share: &dyn Fn(usize) -> f64| {
                left((0..count * each).map(|at| noise[at] + share(at / each) * column[at]).collect())
            };
            let p = |values: &[f64]| agreement(effect, level.columns(), values, &blocks(count, each)).unwrap().0;
            agreed += usize::from(p(&with(&|_| 1.0)) < 0.01);
            single += usize::from(p(&with(&|block| if block == 0 { 8.0 } else { 0.0 })) < 0.01);
        }
        assert!(offset_found > 90 && agreed > 95 && single < 5, "{offset_found} {agreed} {single}");
    }

    #[test]
    fn blocks_that_the_fit_absorbs_say_nothing() {
        let levels: Vec<Vec<f64>> =
            (0..3).map(|block| (0..9).map(|at| f64::from(u8::from(at / 3 == block))).collect()).collect();
        let basis = Basis::of(levels);
        let errors = Errors::White { variance: 1.0, dof: f64::INFINITY };
        assert!(dispersion(&basis.weights(), basis.columns(), &[0.0; 9], &blocks(3, 3), errors).is_none());
        assert!(agreement(&[vec![0.5; 4]], &[], &[1.0; 4], &blocks(1, 4)).is_none());
        // Two equal halves have one degree of freedom.
        assert!(agreement(&[vec![0.5; 4]], &[], &[1.0; 4], &blocks(2, 2)).is_none());
    }
}

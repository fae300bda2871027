//! Errors that depend on each other along a declared order: of time, of angle, of place.
//!
//! Within a series the covariance is σ²·[(1 − s)·1 + s·e^(−d/ℓ)] at the distance d: independent errors and an Ornstein-Uhlenbeck process,
//! whose limits are independent errors and a random walk. 72 shares s and lengths ℓ, and independent errors, are weighed by their restricted
//! likelihood (Patterson, Thompson, Biometrika 58 (1971) 545), independent errors with even odds before. Whitening is a scalar
//! Kalman filter, of n steps a column.
//!
//! Long because the models, their likelihood and the filter that whitens for them read as one derivation.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use runout_numerics::{
    least_squares::{Basis, dot},
    statistics::{chi2_tail, f_tail, median},
};

use crate::structure::Order;

/// Shares of the variance that are correlated.
const SHARES: [f64; 8] = [0.1, 0.25, 0.5, 0.75, 0.9, 0.97, 0.99, 1.0];
/// Lengths of the correlation, in median steps of the order.
const LENGTHS: [f64; 9] = [0.7, 1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0, 400.0];
/// Share of the variance that stays independent: whitening stays possible where places are equal.
const LEAST_INDEPENDENT: f64 = 1e-6;
/// Twice the gain in log likelihood from which errors are called correlated: a chance of about 0.005 with two parameters at the edge.
const CORRELATED: f64 = 9.2;
/// Of shares and of lengths, every so many is tried at first; half of that gain at one of these asks for all.
const SCREENED: usize = 2;
/// Weight of a model below which it is left out of a mean.
const NEGLIGIBLE: f64 = 1e-4;
/// Readings of a series at most; more are averaged with their neighbours.
const MOST_READINGS: usize = 200;
/// Share of the variance that changes of a whole series leave beside them.
const UNNOTICED: f64 = 0.02;

/// The models of a fit's errors along an order, with their weights.
#[derive(Debug, Clone)]
pub struct OrderModels {
    series: Vec<Series>,
    models: Vec<Weighed>,
    /// Twice the gain in log likelihood of the best correlated model.
    pub gain: f64,
    /// Degrees of freedom of the residual on the averaged readings.
    dof: usize,
    /// Averaged residual and basis.
    residual: Vec<f64>,
    basis: Vec<Vec<f64>>,
    /// Readings that each averaged one is of.
    averaged: Vec<Vec<usize>>,
}

/// Averaged readings of one series, in its order.
#[derive(Debug, Clone)]
struct Series {
    /// Indices of averaged readings.
    readings: Vec<usize>,
    /// Distance of each to the one before, in median steps; 0 of the first.
    steps: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Weighed {
    share: f64,
    length: f64,
    weight: f64,
    variance: f64,
}

/// The covariance of errors along an order, averaged over the models.
#[derive(Debug, Clone)]
pub struct Correlated {
    blocks: Vec<(Vec<usize>, DMatrix<f64>)>,
    freedom: f64,
    /// Variance of the share that is independent from reading to reading.
    pub independent: f64,
    /// Correlation length of the likeliest model, in median steps, and its share of the variance.
    pub length: f64,
    /// Share of the variance that is correlated in the likeliest model.
    pub share: f64,
}

impl OrderModels {
    /// Of a fit that left `residual` and has the orthonormal columns `basis`. `None` where too few readings are left to decide.
    #[must_use]
    pub fn of(order: &Order, residual: &[f64], basis: &[Vec<f64>]) -> Option<Self> {
        let (averaged, mut series) = condensed(order, residual.len());
        let mean = |values: &[f64]| mean_of(&averaged, values);
        let step = median(series.iter().flat_map(|one| one.steps.iter().skip(1)).copied().filter(|step| *step > 0.0));
        if !step.is_finite() {
            return None;
        }
        series.iter_mut().flat_map(|one| &mut one.steps).for_each(|at| *at /= step);
        let basis = Basis::of(basis.iter().map(|column| mean(column)).collect());
        let residual = mean(residual);
        let dof = residual.len().saturating_sub(basis.rank());
        if dof < FEWEST {
            return None;
        }
        let mut models =
            Self { series, models: Vec::new(), gain: 0.0, dof, residual, basis: basis.columns().to_vec(), averaged };
        models.weigh(&[]);
        Some(models)
    }

    /// Whether the errors are correlated beyond chance.
    #[must_use]
    pub fn is_correlated(&self) -> bool {
        self.gain > CORRELATED
    }

    /// Chance of the gain in likelihood without correlation.
    #[must_use]
    pub fn p(&self) -> f64 {
        chi2_tail(self.gain, 2.0)
    }

    /// Restricted likelihoods, with more columns in the fit, to weights: of few models at first, and of all where one of these is likely.
    fn weigh(&mut self, columns: &[Vec<f64>]) {
        let every = |step: usize| {
            let lengths = move |share: &f64| {
                LENGTHS.iter().skip(step / 2).step_by(step).map(|length| (*share, *length)).collect::<Vec<_>>()
            };
            SHARES.iter().skip(step / 2).step_by(step).flat_map(lengths).collect::<Vec<(f64, f64)>>()
        };
        self.weigh_models(columns, &every(SCREENED));
        if self.gain > 0.5 * CORRELATED {
            self.weigh_models(columns, &every(1));
        }
    }

    fn weigh_models(&mut self, columns: &[Vec<f64>], correlated: &[(f64, f64)]) {
        let mut logs = Vec::new();
        self.models.clear();
        for (share, length) in std::iter::once((0.0, 1.0)).chain(correlated.iter().copied()) {
            let (basis, residual, log_determinant) = self.whitened(share, length, columns);
            let dof = (residual.len() - basis.rank()).max(1) as f64;
            let variance = dot(&residual, &residual) / dof;
            let log = -0.5 * (log_determinant + 2.0 * basis.log_determinant() + dof * variance.max(1e-300).ln());
            logs.push(log);
            self.models.push(Weighed { share, length, weight: 1.0, variance });
        }
        let best = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        self.gain = 2.0 * (best - logs[0]);
        let others = (logs.len() - 1) as f64;
        let mut sum = 0.0;
        for (index, (model, log)) in self.models.iter_mut().zip(&logs).enumerate() {
            model.weight = (log - best).exp() / if index == 0 { 1.0 } else { others };
            sum += model.weight;
        }
        self.models.iter_mut().for_each(|model| model.weight /= sum);
    }

    /// The whitened basis with more columns, what it leaves of the whitened residual, and ln det V.
    fn whitened(&self, share: f64, length: f64, columns: &[Vec<f64>]) -> (Basis, Vec<f64>, f64) {
        let filter = Filter::new(&self.series, share, length);
        let whiten = |column: &Vec<f64>| filter.whitened(&self.series, column);
        let basis = Basis::of(self.basis.iter().chain(columns).map(whiten).collect());
        let mut residual = whiten(&self.residual);
        basis.remove_from(&mut residual);
        basis.remove_from(&mut residual);
        (basis, residual, filter.log_determinant)
    }

    /// Evidence for an effect along the order: chance and change of the information criterion, averaged over the models of the errors
    /// with the effect in the fit. `columns` are the effect's, `[parameter][reading]`.
    #[must_use]
    pub fn evidence(&self, columns: &[Vec<f64>]) -> Option<(f64, f64)> {
        let columns: Vec<Vec<f64>> = columns.iter().map(|column| mean_of(&self.averaged, column)).collect();
        let mut with = self.clone();
        with.weigh(&columns);
        let (mut p, mut bic) = (0.0, 0.0);
        for model in with.models.iter().filter(|model| model.weight > NEGLIGIBLE) {
            let (declared, without, _) = self.whitened(model.share, model.length, &[]);
            let (joint, left, _) = self.whitened(model.share, model.length, &columns);
            let parameters = joint.rank().saturating_sub(declared.rank()) as f64;
            let dof = left.len().saturating_sub(joint.rank()) as f64;
            if parameters < 1.0 || dof < 1.0 {
                return None;
            }
            let unit = (dot(&left, &left) / dof).max(f64::MIN_POSITIVE);
            let gain = (dot(&without, &without) - dot(&left, &left)).max(0.0) / unit;
            p += model.weight * f_tail(gain / parameters, parameters, dof);
            bic += model.weight * (parameters * (left.len() as f64).ln() - gain);
        }
        Some((p, bic))
    }

    /// χ² that columns explain beside the errors of the likeliest model; they are as in [`evidence`](Self::evidence).
    #[must_use]
    pub fn explained(&self, columns: &[Vec<f64>]) -> f64 {
        let Some(model) = self.models.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)) else { return 0.0 };
        let columns: Vec<Vec<f64>> = columns.iter().map(|column| mean_of(&self.averaged, column)).collect();
        let (_, without, _) = self.whitened(model.share, model.length, &[]);
        let (_, left, _) = self.whitened(model.share, model.length, &columns);
        (dot(&without, &without) - dot(&left, &left)).max(0.0) / model.variance.max(f64::MIN_POSITIVE)
    }

    /// The covariance of the readings' errors, averaged over the models.
    #[must_use]
    pub fn covariance(&self) -> Correlated {
        let used: Vec<&Weighed> = self.models.iter().filter(|model| model.weight > NEGLIGIBLE).collect();
        let (mut trace, mut squares) = (0.0, 0.0);
        let mut blocks = Vec::new();
        for series in &self.series {
            let places: Vec<f64> = series
                .steps
                .iter()
                .scan(0.0, |at, step| {
                    *at += step;
                    Some(*at)
                })
                .collect();
            let count = places.len();
            let entry = |row: usize, column: usize| {
                let distance = (places[row] - places[column]).abs();
                let of = |model: &&Weighed| {
                    let own = if row == column { 1.0 - model.share + LEAST_INDEPENDENT } else { 0.0 };
                    model.weight * model.variance * (own + model.share * (-distance / model.length).exp())
                };
                used.iter().map(of).sum::<f64>()
            };
            let block = DMatrix::from_fn(count, count, entry);
            trace += block.trace();
            squares += block.norm_squared();
            blocks.push((series.readings.clone(), block));
        }
        let correlated = self.models.iter().skip(1);
        let likeliest = correlated.max_by(|a, b| a.weight.total_cmp(&b.weight));
        Correlated {
            independent: used.iter().map(|model| model.weight * model.variance * (1.0 - model.share)).sum(),
            blocks,
            freedom: trace * trace / squares.max(f64::MIN_POSITIVE),
            length: likeliest.map_or(0.0, |model| model.length),
            share: likeliest.map_or(0.0, |model| model.share),
        }
    }

    /// The fit on the averaged readings: residual and orthonormal columns.
    #[must_use]
    pub fn averaged(&self) -> (&[f64], &[Vec<f64>]) {
        (&self.residual, &self.basis)
    }

    /// Weights of values on the averaged readings: sums of those of the readings.
    #[must_use]
    pub fn summed(&self, weights: &[f64]) -> Vec<f64> {
        let of = |readings: &Vec<usize>| readings.iter().map(|reading| weights[*reading]).sum();
        self.averaged.iter().map(of).collect()
    }

    /// Parts of the readings on the averaged ones: each belongs where its first reading does.
    #[must_use]
    pub fn parts(&self, level: &[usize]) -> Vec<usize> {
        self.averaged.iter().map(|readings| readings.first().map_or(usize::MAX, |first| level[*first])).collect()
    }

    /// Degrees of freedom on the averaged readings.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof
    }
}

/// Degrees of freedom from which correlation is observable.
const FEWEST: usize = 6;

impl Correlated {
    /// aᵀ·V·a on averaged readings.
    #[must_use]
    pub fn variance_of(&self, weights: &[f64]) -> f64 {
        let of = |(readings, block): &(Vec<usize>, DMatrix<f64>)| {
            let own = DMatrix::from_fn(readings.len(), 1, |row, _| weights[readings[row]]);
            (own.tr_mul(block) * &own)[(0, 0)]
        };
        self.blocks.iter().map(of).sum()
    }

    /// Degrees of freedom (tr V)²/tr V².
    #[must_use]
    pub fn freedom(&self) -> f64 {
        self.freedom
    }

    /// What the correlated errors of one series are made of once a fit has taken `columns` (orthonormal, of its averaged readings) out of
    /// them: changes of the whole series, each with a factor of its own of variance 1, the largest first, and the variance that is left
    /// beside them at each reading. Changes that hold less than 2 % of the variance together are left out, and those beyond `most`.
    #[must_use]
    pub fn principal(&self, series: usize, columns: &[Vec<f64>], most: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
        let Some((_, block)) = self.blocks.get(series) else { return (Vec::new(), Vec::new()) };
        let count = block.nrows();
        let mut covariance = block - DMatrix::identity(count, count) * self.independent;
        for column in columns {
            let column = DVector::from_column_slice(column);
            let along = &covariance * &column;
            let own = column.dot(&along);
            covariance +=
                &column * column.transpose() * own - &along * column.transpose() - &column * along.transpose();
        }
        let mut left: Vec<f64> = covariance.diagonal().iter().map(|variance| variance.max(0.0)).collect();
        let all: f64 = left.iter().sum();
        let eigen = SymmetricEigen::new(covariance);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let mut changes = Vec::new();
        for place in order.into_iter().take(most) {
            if left.iter().sum::<f64>() < UNNOTICED * all {
                break;
            }
            let size = eigen.eigenvalues[place].max(0.0).sqrt();
            let change: Vec<f64> = eigen.eigenvectors.column(place).iter().map(|entry| size * entry).collect();
            left.iter_mut().zip(&change).for_each(|(left, change)| *left = (*left - change * change).max(0.0));
            changes.push(change);
        }
        (changes, left)
    }

    pub(crate) fn times(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(columns.nrows(), columns.ncols());
        for (readings, block) in &self.blocks {
            let own = DMatrix::from_fn(readings.len(), columns.ncols(), |row, column| columns[(readings[row], column)]);
            let made = block * own;
            for (row, reading) in readings.iter().enumerate() {
                product.set_row(*reading, &made.row(row));
            }
        }
        product
    }
}

/// Means of values over the readings of each averaged one.
fn mean_of(averaged: &[Vec<usize>], values: &[f64]) -> Vec<f64> {
    let of =
        |readings: &Vec<usize>| readings.iter().map(|reading| values[*reading]).sum::<f64>() / readings.len() as f64;
    averaged.iter().map(of).collect()
}

/// The Kalman filter of one model: gains and standard deviations of the innovations, which are the same for every column.
struct Filter {
    /// A reading's (φ to it, gain at the one before, 1/√S), series after series.
    steps: Vec<[f64; 3]>,
    log_determinant: f64,
}

impl Filter {
    fn new(series: &[Series], share: f64, length: f64) -> Self {
        let independent = 1.0 - share + LEAST_INDEPENDENT;
        let mut steps = Vec::new();
        let mut log_determinant = 0.0;
        for one in series {
            // Variance of the correlated part before a reading is known, and the gain at the reading before.
            let (mut before, mut gain) = (share, 0.0);
            for (index, step) in one.steps.iter().enumerate() {
                let decay = if share > 0.0 && index > 0 { (-step / length).exp() } else { 0.0 };
                if index > 0 {
                    before = decay * decay * (1.0 - gain) * before + share * (1.0 - decay * decay);
                }
                let innovation = before + independent;
                steps.push([decay, gain, innovation.sqrt().recip()]);
                log_determinant += innovation.ln();
                gain = before / innovation;
            }
        }
        Self { steps, log_determinant }
    }

    fn whitened(&self, series: &[Series], column: &[f64]) -> Vec<f64> {
        let mut whitened = vec![0.0; column.len()];
        let mut steps = self.steps.iter();
        for one in series {
            let (mut state, mut innovation) = (0.0, 0.0);
            for (reading, [decay, gain, scale]) in one.readings.iter().zip(&mut steps) {
                state = decay * (state + gain * innovation);
                innovation = column[*reading] - state;
                whitened[*reading] = innovation * scale;
            }
        }
        whitened
    }
}

/// Readings of each averaged reading, and the series of these in their order with the distances between them.
fn condensed(order: &Order, count: usize) -> (Vec<Vec<usize>>, Vec<Series>) {
    let mut sorted: Vec<usize> = (0..count.min(order.series.len())).collect();
    sorted.sort_by(|a, b| order.series[*a].cmp(&order.series[*b]).then(order.at[*a].total_cmp(&order.at[*b])));
    let (mut averaged, mut all) = (Vec::new(), Vec::new());
    for readings in sorted.chunk_by(|a, b| order.series[*a] == order.series[*b]) {
        let each = readings.len().div_ceil(MOST_READINGS).max(1);
        let first = averaged.len();
        averaged.extend(readings.chunks(each).map(<[usize]>::to_vec));
        let place = |readings: &Vec<usize>| {
            readings.iter().map(|reading| order.at[*reading]).sum::<f64>() / readings.len() as f64
        };
        let places: Vec<f64> = averaged[first..].iter().map(place).collect();
        let steps = std::iter::once(0.0).chain(places.windows(2).map(|pair| pair[1] - pair[0])).collect();
        all.push(Series { readings: (first..averaged.len()).collect(), steps });
    }
    (averaged, all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn order(series: usize, each: usize) -> Order {
        Order {
            name: "z".into(),
            series: (0..series * each).map(|at| at / each).collect(),
            at: (0..series * each).map(|at| (at % each) as f64).collect(),
        }
    }

    /// An autoregression of length ℓ, white noise beside it.
    fn errors(random: &mut Random, series: usize, each: usize, share: f64, length: f64) -> Vec<f64> {
        let decay = (-1.0 / length).exp();
        let mut all = Vec::new();
        for _ in 0..series {
            let mut state = random.normal();
            for _ in 0..each {
                all.push(share.sqrt() * state + (1.0 - share).sqrt() * random.normal());
                state = decay * state + (1.0 - decay * decay).sqrt() * random.normal();
            }
        }
        all
    }

    #[test]
    fn whitening_is_that_of_the_covariance() {
        let mut random = Random::new(3);
        let order = order(2, 30);
        let values = errors(&mut random, 2, 30, 0.7, 5.0);
        let (averaged, series) = condensed(&order, 60);
        assert_eq!(averaged.len(), 60);
        let filter = Filter::new(&series, 0.7, 5.0);
        let whitened = filter.whitened(&series, &values);
        let (mut squares, mut determinant) = (0.0, 0.0);
        for start in [0, 30] {
            let entry = |row: usize, column: usize| {
                let own = if row == column { 0.3 + LEAST_INDEPENDENT } else { 0.0 };
                own + 0.7 * (-(row as f64 - column as f64).abs() / 5.0).exp()
            };
            let covariance = DMatrix::from_fn(30, 30, entry);
            determinant += covariance.determinant().ln();
            let column = DMatrix::from_fn(30, 1, |row, _| values[start + row]);
            squares += (column.transpose() * covariance.try_inverse().unwrap() * &column)[(0, 0)];
        }
        assert!((dot(&whitened, &whitened) - squares).abs() < 1e-9 * squares);
        assert!((filter.log_determinant - determinant).abs() < 1e-9);
    }

    /// Correlation is found where there is some and in 1 % at most where there is none; a slope's standard uncertainty is then right,
    /// and no false slope is found.
    #[test]
    fn correlated_errors_are_found_and_carried() {
        let mut random = Random::new(4);
        let (series, each) = (4, 100);
        let order = order(series, each);
        let level: Vec<Vec<f64>> = (0..series)
            .map(|one| (0..series * each).map(|at| f64::from(u8::from(at / each == one))).collect())
            .collect();
        let slope: Vec<f64> = (0..series * each).map(|at| (at % each) as f64 / each as f64 - 0.5).collect();
        let with_slope = Basis::of(level.iter().cloned().chain([slope.clone()]).collect());
        let level = Basis::of(level);
        for (share, length, correlated) in [(0.0, 1.0, false), (0.9, 10.0, true), (1.0, 60.0, true)] {
            let (trials, mut found, mut held, mut false_slopes) = (100, 0, 0, 0);
            for _ in 0..trials {
                let values = errors(&mut random, series, each, share, length);
                let mut left = values.clone();
                with_slope.remove_from(&mut left);
                let models = OrderModels::of(&order, &left, with_slope.columns()).unwrap();
                found += usize::from(models.is_correlated());
                let weights = with_slope.weights();
                let of_slope = weights.last().unwrap();
                let covariance = models.covariance();
                let std = covariance.variance_of(&models.summed(of_slope)).sqrt();
                held += usize::from(dot(of_slope, &values).abs() < 2.2 * std);
                let mut left = values;
                level.remove_from(&mut left);
                let models = OrderModels::of(&order, &left, level.columns()).unwrap();
                let (p, bic) = models.evidence(std::slice::from_ref(&slope)).unwrap();
                false_slopes += usize::from(p < 1e-3 && bic < -6.0);
            }
            assert!(if correlated { found > 97 } else { found < 4 }, "{share} {length}: {found}");
            assert!(held > 87 && false_slopes < 3, "{share} {length}: held {held}, false {false_slopes}");
        }
    }

    #[test]
    fn long_series_are_averaged_with_their_neighbours() {
        let (averaged, series) = condensed(&order(2, 1001), 2002);
        assert_eq!((averaged.len(), averaged[0].len(), series.len()), (2 * 167, 6, 2));
        assert!((series[1].steps[1] - 6.0).abs() < 1e-12);
        assert!(OrderModels::of(&order(1, 4), &[1.0, -1.0, 1.0, -1.0], &[]).is_none());
    }
}

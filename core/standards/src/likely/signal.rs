//! What the power of a form may be beside noise, given what was found of it.

use std::sync::OnceLock;

/// What S may be is looked at here, each as likely as the others but for the first, which is for the least that it may be.
pub(super) const QUANTILES: [f64; 6] = [0.01, 0.1, 0.3, 0.5, 0.7, 0.9];
/// Largest S that is likely before anything is found, in standard deviations of the noise's mean.
const MOST: f64 = 10.0;

/// Steps of the table of [`signals_at`] and its range.
const STEP: f64 = 0.1;
const TABLED: [f64; 2] = [-4.0, 12.0];
/// Columns of the table: 1/√k in eighths, from normal numbers to a single square.
const ROOTS: usize = 9;
/// Logarithm of a share of the largest likelihood below which it is nothing: 4e-18.
const LEAST_LOG: f64 = -40.0;
/// Steps of an integral.
const STEPS_OF_SIGNAL: usize = 400;

/// One number for each quantile.
pub(super) type Quantiles = [f64; QUANTILES.len()];

/// Quantiles of S in standard deviations of the noise's mean, by 1/√k of it and by what was found of S in the same unit. A run needs few
/// columns, each of which takes some milliseconds.
static SIGNALS: [OnceLock<Vec<Quantiles>>; ROOTS] = [const { OnceLock::new() }; ROOTS];

fn column(number: usize) -> &'static [Quantiles] {
    SIGNALS[number].get_or_init(|| {
        let steps = ((TABLED[1] - TABLED[0]) / STEP).round() as usize;
        let root = number as f64 / (ROOTS - 1) as f64;
        (0..=steps).map(|step| signals_of(TABLED[0] + STEP * step as f64, root)).collect()
    })
}

/// Quantiles of S from the table, for what was found of it and for 1/√k of the noise's mean.
pub(super) fn signals_at(found: f64, root: f64) -> Quantiles {
    let place = root.clamp(0.0, 1.0) * (ROOTS - 1) as f64;
    let (first, share) = (place as usize, place.fract());
    let of = |number: usize| in_column(column(number), found, number as f64 / (ROOTS - 1) as f64);
    if share > 0.0 { between(&of(first), &of(first + 1), share) } else { of(first) }
}

fn between(low: &Quantiles, high: &Quantiles, share: f64) -> Quantiles {
    std::array::from_fn(|quantile| low[quantile] + (high[quantile] - low[quantile]) * share)
}

fn in_column(column: &[Quantiles], found: f64, root: f64) -> Quantiles {
    let place = (found.max(TABLED[0]) - TABLED[0]) / STEP;
    let below = place.min(column.len() as f64) as usize;
    if let (Some(low), Some(high)) = (column.get(below), column.get(below + 1)) {
        return between(low, high, place.fract());
    }
    // Far above, power and noise together are in proportion to what was found of them.
    let last = column.last().copied().unwrap_or_default();
    last.map(|last| last + (found - TABLED[1]) * (1.0 + last * root) / (1.0 + TABLED[1] * root))
}

/// The quantiles of S: even odds for 0 and for all up to the largest, times the likelihood of what was found. The mean of k squares over its
/// expectation has the density of a χ² of 2k, of many squares that of a normal number.
fn signals_of(found: f64, root: f64) -> Quantiles {
    // Far above, the limit is none.
    let most = MOST.max(found + MOST);
    let log_likelihood = |signal: f64| {
        if root == 0.0 {
            return -0.5 * (found - signal).powi(2);
        }
        let ratio = (1.0 + found * root).max(1e-3) / (1.0 + signal * root);
        (ratio.ln() - ratio + 1.0) / (root * root)
    };
    let step = most / STEPS_OF_SIGNAL as f64;
    let largest = log_likelihood(found.max(0.0));
    let likelihood = |index: usize| match log_likelihood(step * index as f64) - largest {
        log if log > LEAST_LOG => log.exp(),
        _ => 0.0,
    };
    let at: Vec<f64> = (0..=STEPS_OF_SIGNAL).map(likelihood).collect();
    let mut up_to = vec![at[0]];
    for pair in at.windows(2) {
        let last = up_to[up_to.len() - 1];
        up_to.push(last + 0.5 * (pair[0] + pair[1]) * step / MOST);
    }
    let all = up_to[STEPS_OF_SIGNAL];
    QUANTILES.map(|quantile| {
        let share = quantile * all;
        let after = up_to.partition_point(|sum| *sum < share);
        if after == 0 {
            return 0.0;
        }
        let (before, next) = (up_to[after - 1], up_to[after.min(STEPS_OF_SIGNAL)]);
        step * (after as f64 - 1.0 + if next > before { (share - before) / (next - before) } else { 0.0 })
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Of powers drawn from what is likely before anything is found, those that give nearly the same: of normal noise, and of the mean of four
    /// squares.
    #[test]
    fn quantiles_of_power_are_those_of_draws() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for (found, root) in
            [(-0.5, 0.0), (1.0, 0.0), (2.5, 0.0), (4.0, 0.0), (7.0, 0.0), (-0.5, 0.5), (1.5, 0.5), (5.0, 0.5)]
        {
            let mut of: Vec<f64> = Vec::new();
            while of.len() < 20_000 {
                // Even odds for 0 and for all up to MOST; what was found moves the limit.
                let most = MOST.max(found + MOST);
                let is_none = random.random::<f64>() * (1.0 + most / MOST) < 1.0;
                let power = if is_none { 0.0 } else { most * random.random::<f64>() };
                let seen = if root == 0.0 {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    power + noise
                } else {
                    let squares: f64 = (0..4).map(|_| -(1.0 - random.random::<f64>()).ln()).sum();
                    ((1.0 + power * root) * squares / 4.0 - 1.0) / root
                };
                if (seen - found).abs() < 0.05 {
                    of.push(power);
                }
            }
            of.sort_by(f64::total_cmp);
            for (index, quantile) in QUANTILES.into_iter().enumerate() {
                let [low, high] =
                    [-0.02, 0.02].map(|by| of[((quantile + by) * 20_000.0).clamp(0.0, 19_999.0) as usize]);
                let signal = signals_at(found, root)[index];
                // Shares of 20 000 are known to 0.0035; of equal shares the window of 0.1 moves them by less than 0.05.
                assert!(
                    low - 0.05 <= signal && signal <= high + 0.05,
                    "{found} {root} {quantile}: {low} {signal} {high}"
                );
            }
        }
        // Far above, S is what was found; any size of it has its place.
        assert!(signals_at(1e300, 0.0)[3] >= 1e300 && signals_at(1e300, 1.0)[3].is_finite());
        assert!((signals_at(100.0, 0.0)[3] - 100.0).abs() < 0.01);
        // A power in proportion: the median of 1 + S over what was found is the same from there on.
        let ratio = |found: f64| (1.0 + 0.5 * signals_at(found, 0.5)[3]) / (1.0 + 0.5 * found);
        assert!((ratio(60.0) / ratio(12.0) - 1.0).abs() < 1e-9);
    }
}

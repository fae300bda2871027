//! Variances of many things, each known from few degrees of freedom, that learn from each other.
//!
//! G. K. Smyth, "Linear models and empirical Bayes methods", Stat. Appl. Genet. Mol. Biol. 3 (2004), article 3: true variances scatter
//! about s₀² as if that were known from d₀ degrees of freedom, which the scatter of the logarithms gives. A variance s² of d degrees of
//! freedom becomes (d₀ s₀² + d s²)/(d₀ + d), with d₀ + d degrees of freedom. Where all true variances are the same, d₀ has no bound.

use statrs::function::gamma::digamma;

/// Variances below this share of their mean are taken as this share of it where logarithms are: readings that repeat to the last digit.
const LEAST: f64 = 1e-5;
/// Fewer variances than this do not show how variances scatter.
const FEWEST: usize = 10;
/// d₀ from which on variances are taken as the same.
const MANY: f64 = 1e4;

/// Variances and their degrees of freedom.
#[derive(Debug, Clone, PartialEq)]
pub struct Moderated {
    /// One for each, in the squared unit of what they are of.
    pub variance: Vec<f64>,
    /// Degrees of freedom of each; infinite where all are taken as the same.
    pub freedom: f64,
}

/// Moderates variances of `freedom` degrees of freedom each. Those of 0 degrees of freedom, which are exact, stay; so do fewer than 10.
///
/// ```
/// use runout_numerics::moderated::moderated;
///
/// let found = moderated(&[1.0, 2.0, 3.0], 4.0);
/// assert_eq!((found.variance, found.freedom), (vec![1.0, 2.0, 3.0], 4.0));
/// ```
#[must_use]
pub fn moderated(variance: &[f64], freedom: f64) -> Moderated {
    let count = variance.len() as f64;
    let mean = variance.iter().sum::<f64>() / count;
    let exact = freedom.is_nan() || freedom <= 0.0;
    if exact || variance.len() < FEWEST || mean.is_nan() || mean <= 0.0 {
        let freedom = if exact { f64::INFINITY } else { freedom };
        return Moderated { variance: variance.to_vec(), freedom };
    }
    let half = 0.5 * freedom;
    let logs: Vec<f64> = variance.iter().map(|one| one.max(LEAST * mean).ln()).collect();
    let centre = logs.iter().sum::<f64>() / count;
    let scatter = logs.iter().map(|log| (log - centre).powi(2)).sum::<f64>() / (count - 1.0);
    let prior = 2.0 * trigamma_inverse(scatter - trigamma(half));
    if prior > MANY {
        return Moderated { variance: vec![mean; variance.len()], freedom: f64::INFINITY };
    }
    let expected = centre - digamma(half) + half.ln() + digamma(0.5 * prior) - (0.5 * prior).ln();
    let all = prior + freedom;
    let shrunk = variance.iter().map(|one| (prior * expected.exp() + freedom * one) / all);
    Moderated { variance: shrunk.collect(), freedom: all }
}

/// ψ'(x), x above 0: the asymptotic series (DLMF 5.15.8) behind the recurrence (DLMF 5.15.5), right to 1e-12.
fn trigamma(mut x: f64) -> f64 {
    let mut sum = 0.0;
    while x < 10.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    let series = 1.0 / 6.0 - y * (1.0 / 30.0 - y * (1.0 / 42.0 - y * (1.0 / 30.0 - y * 5.0 / 66.0)));
    sum + 1.0 / x + 0.5 * y + y / x * series
}

/// Where ψ' is `value`; infinite for 0 and less.
fn trigamma_inverse(value: f64) -> f64 {
    if value <= 0.5 / MANY {
        return f64::INFINITY;
    }
    // It falls everywhere: between two ends, by bisection of the logarithm.
    let (mut low, mut high) = (1e-6_f64, MANY);
    for _ in 0..100 {
        let middle = (low * high).sqrt();
        if trigamma(middle) > value { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trigamma_has_its_known_values() {
        let pi2 = std::f64::consts::PI.powi(2);
        let of_30 = pi2 / 6.0 - (1..30).map(|k| 1.0 / f64::from(k * k)).sum::<f64>();
        for (x, expected) in [(1.0, pi2 / 6.0), (0.5, pi2 / 2.0), (2.0, pi2 / 6.0 - 1.0), (30.0, of_30)] {
            assert!((trigamma(x) - expected).abs() < 1e-9, "{x}: {}", trigamma(x));
            assert!((trigamma_inverse(trigamma(x)) / x - 1.0).abs() < 1e-9);
        }
    }

    /// Variances of 4 degrees of freedom (sums of exponentials) of one true variance, and of two that differ by a factor of 25.
    #[test]
    fn variances_of_one_kind_are_pooled_and_others_are_not() {
        // Two sequences that fill the unit square evenly stand for chance.
        let exponential = |at: u32, step: f64| -(1.0 - (0.5 + f64::from(at) * step).fract()).ln();
        let drawn = |at: u32, truth: f64| {
            truth * (exponential(at, 0.754_877_666_246_693) + exponential(at, 0.569_840_290_998_053)) / 2.0
        };
        let same: Vec<f64> = (0..200).map(|at| drawn(at, 1.0)).collect();
        let found = moderated(&same, 4.0);
        assert!(found.freedom > 100.0, "{}", found.freedom);
        // 800 degrees of freedom: 5 % of one standard deviation.
        assert!(found.variance.iter().all(|one| (one - 1.0).abs() < 0.25), "{:?}", found.variance);
        let two: Vec<f64> = (0..200).map(|at| drawn(at / 2, if at % 2 == 0 { 1.0 } else { 25.0 })).collect();
        let found = moderated(&two, 4.0);
        assert!(found.freedom < 8.0, "{}", found.freedom);
        let mean = |odd: usize| found.variance.iter().skip(odd).step_by(2).sum::<f64>() / 100.0;
        assert!(mean(1) > 5.0 * mean(0), "{} {}", mean(0), mean(1));
    }
}

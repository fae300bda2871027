//! Evidence for an effect: how much it explains, and how likely noise alone would do as much.

use runout_numerics::statistics::f_tail;

/// How a model with more parameters compares with one with fewer.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Evidence {
    /// Change of the Bayesian information criterion; negative speaks for the larger model (Schwarz, Ann. Statist. 6
    /// (1978) 461).
    pub delta_bic: f64,
    /// Chance of as much improvement by noise (F test), times the number of candidates (Bonferroni).
    pub p_value: f64,
}

impl Evidence {
    /// From χ² without and with `parameters` more, `dof` degrees of freedom left with them.
    ///
    /// χ² counts in units of what remains unexplained, χ²/dof with the larger model, and at least of the noise where that
    /// is known (1): the evidence for an effect counts against what it does not explain.
    #[must_use]
    pub fn new(
        before: f64,
        after: f64,
        parameters: usize,
        dof: usize,
        candidates: usize,
        noise_is_known: bool,
    ) -> Self {
        let left = after / dof.max(1) as f64;
        let unit = if noise_is_known { left.max(1.0) } else { left };
        Self::in_units_of(unit, before - after, parameters, [(dof + parameters) as f64, dof as f64], candidates)
    }

    /// Evidence for an effect that data show which nothing else bears on, and whose noise is known ([`Model::is_seen_besides`]).
    /// The residual of all other data does not count.
    ///
    /// [`Model::is_seen_besides`]: crate::Model::is_seen_besides
    #[must_use]
    pub fn seen_besides(before: f64, after: f64, parameters: usize, dof: usize, candidates: usize) -> Self {
        Self::in_units_of(1.0, before - after, parameters, [(dof + parameters) as f64, KNOWN], candidates)
    }

    fn in_units_of(unit: f64, lowered: f64, parameters: usize, [data, dof]: [f64; 2], candidates: usize) -> Self {
        let gain = lowered.max(0.0) / unit.max(f64::MIN_POSITIVE);
        let count = parameters as f64;
        Self {
            delta_bic: count * data.ln() - gain,
            p_value: (f_tail(gain / count, count, dof) * candidates as f64).min(1.0),
        }
    }
}

/// Degrees of freedom of a noise that is known.
const KNOWN: f64 = 1e6;

/// A group of data, for [`far_worse`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Group {
    /// Sum of squares of what the fit leaves of it.
    pub squares: f64,
    /// Its degrees of freedom: its points less what they decide of the fit.
    pub freedom: f64,
}

/// A group is far worse than the others from this ratio of its mean square to the median one (twice in rms): neighbouring
/// points are correlated, so that a ratio which is certain by their number alone says little.
const FAR: f64 = 4.0;
/// Chance of one group in all being so by noise, below which it is.
const FAR_CHANCE: f64 = 1e-3;

/// Groups of which far more is left than of the median group, worst first. Nothing with less than three groups: of two, either
/// may be the wrong one.
#[must_use]
pub fn far_worse(groups: &[Group]) -> Vec<usize> {
    let mut judged: Vec<(usize, f64, f64)> = (groups.iter().enumerate())
        .filter(|(_, group)| group.freedom > 0.5)
        .map(|(index, group)| (index, group.squares / group.freedom, group.freedom))
        .collect();
    judged.sort_by(|a, b| b.1.total_cmp(&a.1));
    let count = judged.len();
    if count < FEWEST_GROUPS {
        return Vec::new();
    }
    let upper_half = judged[count / 2 - usize::from(count.is_multiple_of(2))..=count / 2].iter();
    let (sum, freedoms, size) = upper_half.fold((0.0, 0.0, 0.0), |(sum, freedoms, size), (_, mean, freedom)| {
        (sum + mean, freedoms + freedom, size + 1.0)
    });
    // The median of χ²/k is below 1 by about this factor (Wilson, Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684).
    let median = sum / size / (1.0 - 2.0 / (9.0 * (freedoms / size).max(1.0))).powi(3);
    let all: f64 = judged.iter().map(|(_, _, freedom)| freedom).sum();
    let is_far = |mean: f64, freedom: f64| {
        let ratio = mean / median.max(f64::MIN_POSITIVE);
        ratio > FAR && f_tail(ratio, freedom, all - freedom) * (count as f64) < FAR_CHANCE
    };
    judged.into_iter().filter(|(_, mean, freedom)| is_far(*mean, *freedom)).map(|(index, ..)| index).collect()
}

/// Groups of which one can be called worse than the others, at least.
const FEWEST_GROUPS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups of normal noise of 0.7, of which one is twelve times as large.
    #[test]
    fn a_group_far_above_the_median_is_found() {
        let mut seed = 3_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut group = |points: usize, size: f64| {
            // Twelve uniform numbers have the variance 1.
            let mut normal = || (0..12).map(|_| uniform()).sum::<f64>();
            let squares = (0..points).map(|_| (size * normal()).powi(2)).sum();
            Group { squares, freedom: points as f64 }
        };
        for points in [3, 30, 300] {
            for count in [2, 3, 8, 100] {
                let mut groups: Vec<Group> = (0..count).map(|_| group(points, 0.7)).collect();
                assert_eq!(far_worse(&groups), [0; 0], "{points} points, {count} groups");
                groups[1] = group(points, 0.7 * 12.0);
                groups[0].freedom = if count > 3 { 0.0 } else { groups[0].freedom };
                let expected: &[usize] = if count > 2 { &[1] } else { &[] };
                assert_eq!(far_worse(&groups), expected, "{points} points, {count} groups");
            }
        }
        // Certain, but not far.
        let groups = [1.0, 1.1, 0.9, 3.0].map(|mean| Group { squares: 1e4 * mean, freedom: 1e4 });
        assert_eq!(far_worse(&groups), [0; 0]);
        // No noise at all is no reason for a division by 0.
        assert_eq!(far_worse(&[Group { squares: 0.0, freedom: 5.0 }; 4]), [0; 0]);
    }

    #[test]
    fn evidence_counts_against_the_residual() {
        let clean = Evidence::new(1040.0, 1000.0, 1, 1000, 50, true);
        assert!(clean.delta_bic < -10.0 && clean.p_value < 1e-6);
        // The same gain beside ten times the misfit says little.
        let misfit = Evidence::new(10_040.0, 10_000.0, 1, 1000, 50, true);
        assert!(misfit.delta_bic > 0.0 && misfit.p_value > 0.5);
    }
}

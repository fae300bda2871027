//! By how much single turns are turned against each other, and what their average loses by it.
//!
//! Marks whose time scatters, and a speed that changes between two of them, turn each turn by an angle δ: its harmonic of order n is c e^{inδ}.
//! Of normal δ with variance s², an average has c e^{−n²s²/2}. To first order a turn is off by i·n·δ·c, which is at a right angle to c in the
//! complex plane, where noise has no direction: with d what turns are off their mean m by, E[d²] = −(1 − e^{−n²s²}) m².

use runout_core::Complex64;

use super::passed;
use crate::low_pass::significant;

/// The variance of angles is accepted from so many standard deviations of it in noise alone, also without the order that is the strongest evidence.
const BELIEVED: f64 = 4.0;
/// Orders from which angles are known: what moves an eccentricity has a direction too.
const FROM_ORDER: usize = 2;
/// Errors of marks that are independent turn a turn by their mean over both ends; an angle within it lies on the line between them, with 4/3 of that
/// variance on average. Errors that last for several turns have 1.
const OF_MARKS: [f64; 2] = [4.0 / 3.0, 1.0];
/// Share of the highest order from which what is lost is said.
const SAID: f64 = 0.01;
/// Steps of the solution, which converges from below.
const STEPS: usize = 30;

/// Variance of the angles of single turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct AngleScatter {
    variance_rad2: f64,
    std_rad2: f64,
    by_marks: bool,
}

/// What single turns are off their mean by.
pub(super) struct Deviations<'a> {
    /// Mean, `[order][channel]`.
    pub mean: &'a [Complex64],
    /// Mean of d², likewise.
    pub squares: &'a [Complex64],
    /// Mean of |d|², likewise.
    pub powers: &'a [f64],
    pub channels: usize,
    /// Turns that were evaluated, and all.
    pub turns: [usize; 2],
}

impl AngleScatter {
    /// `None` where noise alone may have made it.
    pub(super) fn of(deviations: &Deviations, by_marks: bool) -> Option<Self> {
        let Deviations { channels, turns: [looked_at, all], .. } = *deviations;
        let Sums { by_order } = deviations.sums(0.0);
        let [most, _] = by_order.iter().copied().max_by(|one, other| one[0].total_cmp(&other[0]))?;
        let [(gain, weight), (rest, rest_weight)] = [None, Some(most)].map(|without: Option<f64>| {
            let kept = by_order.iter().filter(|[gain, _]| without.is_none_or(|most| *gain < most));
            kept.fold((0.0, 0.0), |(gains, weights), [gain, weight]| (gains + gain, weights + weight))
        });
        // Channels may show the same noise.
        let in_noise = |weight: f64| (channels as f64 / (looked_at as f64 * weight)).sqrt();
        let is_believed = |gain: f64, weight: f64| weight > 0.0 && gain / weight > BELIEVED * in_noise(weight);
        if !(is_believed(gain, weight) && is_believed(rest, rest_weight)) {
            return None;
        }
        let mut variance_rad2 = gain / weight;
        for _ in 0..STEPS {
            let [gain, weight] = deviations.sums(variance_rad2).total();
            variance_rad2 += gain / weight;
        }
        // The other turns' angles are not known.
        let drawn = 2.0 * variance_rad2.powi(2) * (1.0 / looked_at as f64 - 1.0 / all as f64);
        let of_marks = if by_marks { (OF_MARKS[0] - OF_MARKS[1]) / OF_MARKS[0] / 12.0_f64.sqrt() } else { 0.0 };
        let std_rad2 = (in_noise(weight).powi(2) + drawn + (of_marks * variance_rad2).powi(2)).sqrt();
        (variance_rad2.is_finite() && variance_rad2 > 0.0).then_some(Self { variance_rad2, std_rad2, by_marks })
    }

    /// Standard deviation of the angles, in rad.
    pub(super) fn std_rad(&self) -> f64 {
        self.variance_rad2.sqrt()
    }

    /// −ln of the share that an average has of an order, and its standard uncertainty.
    fn loss(&self, order: usize) -> [f64; 2] {
        let times = if self.by_marks { OF_MARKS[0] } else { OF_MARKS[1] };
        [self.variance_rad2, self.std_rad2].map(|angle| 0.5 * times * (order as f64).powi(2) * angle)
    }

    /// Share that an average has of each order from 0.
    pub(super) fn passed(&self, orders: usize) -> Vec<Complex64> {
        (0..orders).map(|order| Complex64::from((-self.loss(order)[0]).exp())).collect()
    }

    /// What an average of so many orders, from 0, loses, where that matters.
    pub(super) fn said(&self, orders: usize, object: &str) -> Option<String> {
        let held = passed::held(&self.passed(orders));
        let highest = held.saturating_sub(1);
        let lost = 1.0 - (-self.loss(highest)[0]).exp();
        let ends = if held < orders { "; the orders above it are lost" } else { "" };
        (lost >= SAID).then(|| {
            format!(
                "{object}: turns are turned against each other by {}° (std): marks whose time scatters, or a speed that changes between them. The \
                 average loses {} % of order {highest} by it, which is put right{ends}",
                significant(self.std_rad().to_degrees(), 2),
                significant(100.0 * lost, 2),
            )
        })
    }

    /// Adds to the covariance of a mean, `[order][channel][channel]`, what the shares are not known to.
    pub(super) fn add_to(&self, covariance: &mut [Complex64], mean: &[Complex64], channels: usize) {
        let matrices = covariance.chunks_exact_mut(channels * channels);
        for (order, (matrix, mean)) in matrices.zip(mean.chunks_exact(channels)).enumerate() {
            let square = self.loss(order)[1].powi(2);
            for (row, one) in matrix.chunks_exact_mut(channels).zip(mean) {
                row.iter_mut().zip(mean).for_each(|(entry, other)| *entry += square * one * other.conj());
            }
        }
    }
}

/// By order: what the data say beyond a variance, weighted, and the weight.
struct Sums {
    by_order: Vec<[f64; 2]>,
}

impl Sums {
    fn total(&self) -> [f64; 2] {
        self.by_order.iter().fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
    }
}

impl Deviations<'_> {
    /// About a variance.
    fn sums(&self, variance_rad2: f64) -> Sums {
        let orders = self.mean.chunks_exact(self.channels).zip(self.squares.chunks_exact(self.channels));
        let orders = orders.zip(self.powers.chunks_exact(self.channels)).enumerate().skip(FROM_ORDER);
        let by_order = orders.map(|(order, ((mean, squares), powers))| {
            let squared = (order as f64).powi(2);
            let left = (-squared * variance_rad2).exp();
            let each = mean.iter().zip(squares).zip(powers).filter(|(_, power)| **power > 0.0);
            each.fold([0.0; 2], |[gain, weight], ((mean, square), power)| {
                let size = mean.norm_sqr();
                if size <= 0.0 {
                    return [gain, weight];
                }
                let turned = -(square * (mean.conj() * mean.conj())).re / size - size * (1.0 - left);
                let rate = squared * size * left / power;
                [gain + turned * rate / power, weight + rate * rate]
            })
        });
        Sums { by_order: by_order.collect() }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// Harmonics of turns: a form of some orders, turned by marks whose errors have this standard deviation, with noise.
    fn found(
        seed: u64,
        mark_std_rad: f64,
        noise: f64,
        amplitudes: &[(usize, f64)],
    ) -> (Option<AngleScatter>, Vec<f64>) {
        const TURNS: usize = 60;
        const ANGLES: usize = 256;
        const ORDERS: usize = 40;
        let mut uniform = crate::testing::scatter(seed);
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() / 2.0;
        let errors: Vec<f64> = (0..=TURNS).map(|_| mark_std_rad * normal()).collect();
        let at = |turn: usize, angle: usize| {
            let share = angle as f64 / ANGLES as f64;
            TAU * share + errors[turn] * (1.0 - share) + errors[turn + 1] * share
        };
        let turns: Vec<Vec<Complex64>> = (0..TURNS)
            .map(|turn| {
                let heights: Vec<f64> = (0..ANGLES)
                    .map(|angle| {
                        let of = |(order, size): &(usize, f64)| size * (*order as f64 * at(turn, angle) + 0.3).cos();
                        amplitudes.iter().map(of).sum::<f64>() + noise * normal()
                    })
                    .collect();
                let harmonic = |order: usize| {
                    let turned = |(angle, height): (usize, &f64)| {
                        height * Complex64::cis(TAU * (order * angle) as f64 / ANGLES as f64)
                    };
                    heights.iter().enumerate().map(turned).sum::<Complex64>() * (2.0 / ANGLES as f64)
                };
                (0..ORDERS).map(harmonic).collect()
            })
            .collect();
        let over = |of: &dyn Fn(&Vec<Complex64>, usize) -> Complex64| -> Vec<Complex64> {
            let mean = |order| turns.iter().map(|turn| of(turn, order)).sum::<Complex64>() / TURNS as f64;
            (0..ORDERS).map(mean).collect()
        };
        let mean = over(&|turn, order| turn[order]);
        let squares = over(&|turn, order| (turn[order] - mean[order]).powi(2));
        let powers = over(&|turn, order| Complex64::from((turn[order] - mean[order]).norm_sqr()));
        let powers: Vec<f64> = powers.iter().map(|power| power.re).collect();
        let turns = [TURNS; 2];
        let deviations = Deviations { mean: &mean, squares: &squares, powers: &powers, channels: 1, turns };
        let scatter = AngleScatter::of(&deviations, true);
        let passed = scatter.map_or_else(|| vec![Complex64::ONE; ORDERS], |scatter| scatter.passed(ORDERS));
        let ratios = amplitudes.iter().map(|(order, size)| (mean[*order] / passed[*order]).norm() / size);
        (scatter, ratios.collect())
    }

    #[test]
    fn an_average_of_turns_that_are_turned_has_its_amplitudes_again() {
        let form = [(2, 3.0), (3, 1.0), (7, 0.5), (15, 0.4), (25, 0.3)];
        for mark_std_rad in [0.01, 0.03] {
            let mut off = vec![0.0; form.len()];
            for seed in 0..20 {
                let (scatter, ratios) = found(seed, mark_std_rad, 0.05, &form);
                let ratio = scatter.map_or(0.0, |scatter| scatter.std_rad() / (mark_std_rad * 0.5_f64.sqrt()));
                assert!((ratio - 1.0).abs() < 0.35, "{seed}: {ratio}");
                off.iter_mut().zip(&ratios).for_each(|(off, ratio)| *off += (ratio - 1.0) / 20.0);
            }
            // Without it, order 25 of the larger ones has 0.83 of its amplitude.
            println!("marks of {mark_std_rad} rad: {off:.4?}");
            assert!(off.iter().all(|off| off.abs() < 0.02), "{mark_std_rad}: {off:?}");
        }
    }

    #[test]
    fn noise_turns_nothing() {
        let form = [(2, 3.0), (3, 1.0), (7, 0.5), (15, 0.4), (25, 0.3)];
        let said = (0..100).filter(|seed| found(*seed, 0.0, 0.2, &form).0.is_some()).count();
        assert_eq!(said, 0);
    }
}

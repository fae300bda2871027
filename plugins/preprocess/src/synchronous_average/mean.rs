//! Mean over turns, and its covariance across channels, in one pass.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    numerics::lanes::{NullaryFnOnce, load, vectorised},
};

use super::slow::{PHASES, Slow};

/// Orders that are worked on at once.
const LANES: usize = 4;
/// Turns that are summed together at most: the sums are then read and written once for all of them.
const TOGETHER: usize = 8;
/// Memory that turns may take up which wait for others, in numbers.
const WAITING: usize = 1 << 17;

/// Sums over turns, taken from the first one: what is left is the turns' scatter, so that no digits are lost where the
/// scatter is far below the signal.
///
/// Real and imaginary parts stand apart, in planes `[channel][re, im][order]`.
pub(super) struct Mean {
    channels: usize,
    orders: usize,
    /// Length of a plane: the orders, and as many zeros as fill the last lanes.
    plane: usize,
    turns: usize,
    /// The first turn, `[order][channel]`.
    pivot: Vec<Complex64>,
    /// Turns less the pivot that are in no sum yet, a set of planes each, and the phases of each.
    waiting: Vec<f64>,
    phases: Vec<[f64; PHASES]>,
    together: usize,
    /// Σ d.
    sum: Vec<f64>,
    slow: Slow,
    /// Σ d dᴴ on and below the diagonal, `[row][column ≤ row][re, im][order]`.
    products: Vec<f64>,
}

impl Mean {
    /// For `planned` turns at most.
    pub(super) fn new(orders: usize, channels: usize, planned: usize) -> Self {
        let plane = orders.next_multiple_of(LANES);
        let values = 2 * channels * plane;
        let together = (WAITING / values.max(1)).clamp(1, TOGETHER);
        Self {
            channels,
            orders,
            plane,
            turns: 0,
            pivot: Vec::new(),
            waiting: vec![0.0; together * values],
            phases: Vec::with_capacity(together),
            together,
            sum: vec![0.0; values],
            slow: Slow::new(values, planned),
            products: vec![0.0; 2 * triangle(channels) * plane],
        }
    }

    pub(super) fn turns(&self) -> usize {
        self.turns
    }

    pub(super) fn channels(&self) -> usize {
        self.channels
    }

    /// Takes one turn's harmonics, `[order][channel]`.
    pub(super) fn add(&mut self, turn: &[Complex64]) {
        self.turns += 1;
        let phases = self.slow.phases(self.turns - 1);
        if self.pivot.is_empty() {
            self.pivot.extend_from_slice(turn);
            return;
        }
        let first = self.phases.len() * self.sum.len();
        let planes = &mut self.waiting[first..first + self.sum.len()];
        let pairs = turn.chunks_exact(self.channels).zip(self.pivot.chunks_exact(self.channels));
        for (order, (turn, pivot)) in pairs.enumerate() {
            for (pair, (turn, pivot)) in planes.chunks_exact_mut(2 * self.plane).zip(turn.iter().zip(pivot)) {
                pair[order] = turn.re - pivot.re;
                pair[self.plane + order] = turn.im - pivot.im;
            }
        }
        self.phases.push(phases);
        if self.phases.len() == self.together {
            self.sum_up();
        }
    }

    /// Takes the turns that wait into the sums; to be called after the last one.
    pub(super) fn sum_up(&mut self) {
        vectorised(Summing(self));
        self.phases.clear();
    }

    /// Mean over the turns, `[order][channel]`.
    pub(super) fn mean(&self) -> Vec<Complex64> {
        let scale = 1.0 / self.turns.max(1) as f64;
        let places = (0..self.orders).flat_map(|order| (0..self.channels).map(move |channel| (order, channel)));
        let means = self.pivot.iter().zip(places);
        means.map(|(pivot, (order, channel))| pivot + at(&self.sum, self.plane, order, channel) * scale).collect()
    }

    /// Covariance of the mean, `[order][channel][channel]`; `None` below two turns. See [`Slow`].
    pub(super) fn covariance(&self) -> Option<Vec<Complex64>> {
        self.slow.covariance(&self.sum, self.turns, self.orders, self.channels).or_else(|| self.scatter())
    }

    /// What the covariance of the mean would be with independent turns, 1/(T(T−1)) Σ (cₜ − mean)(cₜ − mean)ᴴ,
    /// `[order][channel][channel]`; `None` below two turns.
    pub(super) fn scatter(&self) -> Option<Vec<Complex64>> {
        if self.turns < 2 {
            return None;
        }
        let (channels, turns) = (self.channels, self.turns as f64);
        let mut covariance = vec![Complex64::ZERO; self.orders * channels * channels];
        for (order, covariance) in covariance.chunks_exact_mut(channels * channels).enumerate() {
            let sum = |channel| at(&self.sum, self.plane, order, channel);
            for row in 0..channels {
                for column in 0..=row {
                    let products = at(&self.products, self.plane, order, triangle(row) + column);
                    let about_mean = products - sum(row) * sum(column).conj() / turns;
                    let value = about_mean / (turns * (turns - 1.0));
                    covariance[column * channels + row] = value.conj();
                    covariance[row * channels + column] = value;
                }
                covariance[row * channels + row].im = 0.0;
            }
        }
        Some(covariance)
    }
}

/// A number of a pair of planes.
pub(super) fn at(planes: &[f64], plane: usize, order: usize, pair: usize) -> Complex64 {
    let re = 2 * pair * plane + order;
    Complex64::new(planes[re], planes[re + plane])
}

/// The turns that wait, on their way into the sums.
struct Summing<'a>(&'a mut Mean);

impl NullaryFnOnce for Summing<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Mean { channels, plane, waiting, phases, sum, slow, products, .. } = self.0;
        let values = sum.len();
        // A few orders of all turns at a time, which the first cache holds.
        for order in (0..*plane).step_by(LANES) {
            for first in (order..values).step_by(*plane) {
                slow.add::<LANES>(first, sum, waiting, phases);
            }
            let mut pair = 0;
            for row in 0..*channels {
                for column in 0..=row {
                    let [a, b] = [row, column].map(|channel| 2 * channel * *plane + order);
                    let (re, im) = (2 * pair * *plane + order, (2 * pair + 1) * *plane + order);
                    let mut product: [[f64; LANES]; 2] = [load(products, re), load(products, im)];
                    for turn in waiting.chunks_exact(values).take(phases.len()) {
                        let [a, b] =
                            [a, b].map(|re| -> [[f64; LANES]; 2] { [load(turn, re), load(turn, re + *plane)] });
                        for lane in 0..LANES {
                            product[0][lane] += a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane];
                            product[1][lane] += a[1][lane] * b[0][lane] - a[0][lane] * b[1][lane];
                        }
                    }
                    products[re..re + LANES].copy_from_slice(&product[0]);
                    products[im..im + LANES].copy_from_slice(&product[1]);
                    pair += 1;
                }
            }
        }
    }
}

/// Entries on and below the diagonal of a square matrix.
fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

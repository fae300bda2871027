//! Mean over turns, and its covariance across channels, in one pass.

use runout_core::Complex64;

use super::slow::Slow;

/// Sums over turns, taken from the first one: what is left is the turns' scatter, so that no digits are lost where the
/// scatter is far below the signal.
pub(super) struct Mean {
    channels: usize,
    turns: usize,
    /// The first turn, `[order][channel]`.
    pivot: Vec<Complex64>,
    sum: Vec<Complex64>,
    slow: Slow,
    /// Σ d dᴴ on and below the diagonal, `[order][row][column ≤ row]`.
    products: Vec<Complex64>,
    /// One order's distance from the pivot.
    difference: Vec<Complex64>,
}

impl Mean {
    /// For `planned` turns at most.
    pub(super) fn new(orders: usize, channels: usize, planned: usize) -> Self {
        Self {
            channels,
            turns: 0,
            pivot: Vec::new(),
            sum: vec![Complex64::ZERO; orders * channels],
            slow: Slow::new(orders * channels, planned),
            products: vec![Complex64::ZERO; orders * triangle(channels)],
            difference: vec![Complex64::ZERO; channels],
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
        self.slow.begin_turn(self.turns - 1);
        if self.pivot.is_empty() {
            self.pivot.extend_from_slice(turn);
            return;
        }
        self.slow.add(turn, &self.pivot);
        // A number of channels that the compiler knows makes straight code of the inner loops.
        match self.channels {
            1 => self.add_known::<1>(turn),
            2 => self.add_known::<2>(turn),
            3 => self.add_known::<3>(turn),
            4 => self.add_known::<4>(turn),
            5 => self.add_known::<5>(turn),
            6 => self.add_known::<6>(turn),
            7 => self.add_known::<7>(turn),
            8 => self.add_known::<8>(turn),
            channels => {
                let mut difference = std::mem::take(&mut self.difference);
                self.add_any(turn, channels, &mut difference);
                self.difference = difference;
            }
        }
    }

    fn add_known<const C: usize>(&mut self, turn: &[Complex64]) {
        self.add_any(turn, C, &mut [Complex64::ZERO; C]);
    }

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "the callers' constants are the point")]
    fn add_any(&mut self, turn: &[Complex64], channels: usize, difference: &mut [Complex64]) {
        let turn = turn.chunks_exact(channels).zip(self.pivot.chunks_exact(channels));
        let sums = self.sum.chunks_exact_mut(channels).zip(self.products.chunks_exact_mut(triangle(channels)));
        for ((turn, pivot), (sum, products)) in turn.zip(sums) {
            let mut at = 0;
            for row in 0..channels {
                difference[row] = turn[row] - pivot[row];
                sum[row] += difference[row];
                for column in 0..=row {
                    products[at] += difference[row] * difference[column].conj();
                    at += 1;
                }
            }
        }
    }

    /// Mean over the turns, `[order][channel]`.
    pub(super) fn mean(&self) -> Vec<Complex64> {
        let scale = 1.0 / self.turns.max(1) as f64;
        self.pivot.iter().zip(&self.sum).map(|(pivot, sum)| pivot + sum * scale).collect()
    }

    /// Covariance of the mean, `[order][channel][channel]`; `None` below two turns. See [`Slow`].
    pub(super) fn covariance(&self) -> Option<Vec<Complex64>> {
        self.slow.covariance(&self.sum, self.turns, self.channels).or_else(|| self.scatter())
    }

    /// What the covariance of the mean would be with independent turns, 1/(T(T−1)) Σ (cₜ − mean)(cₜ − mean)ᴴ,
    /// `[order][channel][channel]`; `None` below two turns.
    pub(super) fn scatter(&self) -> Option<Vec<Complex64>> {
        if self.turns < 2 {
            return None;
        }
        let (channels, turns) = (self.channels, self.turns as f64);
        let mut covariance = vec![Complex64::ZERO; self.sum.len() * channels];
        let orders = self.sum.chunks_exact(channels).zip(self.products.chunks_exact(triangle(channels)));
        for ((sum, products), covariance) in orders.zip(covariance.chunks_exact_mut(channels * channels)) {
            for row in 0..channels {
                for column in 0..=row {
                    let about_mean = products[triangle(row) + column] - sum[row] * sum[column].conj() / turns;
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

/// Entries on and below the diagonal of a square matrix.
fn triangle(size: usize) -> usize {
    size * (size + 1) / 2
}

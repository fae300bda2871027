//! Mean over turns, and its covariance across channels, in one pass.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    neighbours::Neighbours,
    numerics::{
        fourier::Fourier,
        lanes::{Arithmetic, FusedWork, fused},
    },
};

use super::{
    angle_scatter::{AngleScatter, Deviations},
    scatter::Scatter,
    size::Size,
    slow::Slow,
};

/// Turns from which on the neighbours hold a tenth of the scatter or less: it is known well enough without them.
const MANY_TURNS: usize = 40;

/// The highest orders that are kept, whose noise is that of those above.
const HIGHEST: usize = 5;
/// So many times the power of noise, and this share of the amplitudes that are kept, what is above them has at least.
const ABOVE_NOISE: f64 = 4.0;
const LEAST_ABSENT: f64 = 1e-3;

/// Sums over turns, taken from the first one, so that turns that are all alike have exactly no covariance.
///
/// Sums are taken angle by angle: they are transformed, not every turn. Only what is not linear in the turns, their
/// [scatter](Scatter), needs harmonics of single turns.
pub(super) struct Mean {
    size: Size,
    turns: usize,
    /// The first turn, `[channel][angle]` as all that follows.
    pivot: Vec<f64>,
    /// Sum of the turns less the pivot.
    sum: Vec<f64>,
    slow: Slow,
    scatter: Scatter,
}

impl Mean {
    /// For `planned` turns at most.
    pub(super) fn new(size: Size, planned: usize) -> Self {
        let values = size.readings();
        Self {
            size,
            turns: 0,
            pivot: Vec::new(),
            sum: vec![0.0; values],
            slow: Slow::new(values, planned),
            scatter: Scatter::new(size.orders, size.channels),
        }
    }

    pub(super) fn turns(&self) -> usize {
        self.turns
    }

    /// Takes the readings of several turns, `[turn][channel][angle]`.
    pub(super) fn add(&mut self, turns: &[f64]) {
        if self.pivot.is_empty() {
            self.pivot.extend_from_slice(&turns[..self.sum.len()]);
        }
        fused(Summing { mean: self, turns });
    }

    /// Takes a turn's harmonics, `[channel][order]`, into the scatter.
    pub(super) fn look_at(&mut self, turn: &[Complex64]) {
        self.scatter.add(turn);
    }

    /// Mean over the turns, `[order][channel]`.
    pub(super) fn mean(&self) -> Vec<Complex64> {
        let Size { channels, orders, .. } = self.size;
        let mut mean = vec![Complex64::ZERO; orders * channels];
        if self.turns == 0 {
            return mean;
        }
        for (channel, harmonics) in self.harmonics(orders).chunks_exact(orders).enumerate() {
            mean[channel..].iter_mut().step_by(channels).zip(harmonics).for_each(|(to, harmonic)| *to = *harmonic);
        }
        mean
    }

    /// Those of the mean to an order that its angles hold, `[channel][order]`.
    fn harmonics(&self, orders: usize) -> Vec<Complex64> {
        let scale = 1.0 / self.turns as f64;
        let readings: Vec<f64> = self.pivot.iter().zip(&self.sum).map(|(pivot, sum)| pivot + sum * scale).collect();
        let mut harmonics = vec![Complex64::ZERO; orders * self.size.channels];
        Analysis::new(self.size.angles, orders).take_apart(&readings, &mut harmonics);
        harmonics
    }

    /// What the mean has above the orders that are kept, to `held` of them, beyond the noise of the highest ones: root mean square in µm of the channel
    /// that has most of it; 0 where noise explains it.
    pub(super) fn absent_um(&self, covariance: Option<&[Complex64]>, held: usize) -> f64 {
        let Size { channels, angles, orders } = self.size;
        let held = held.min(angles / 2);
        let Some(covariance) = covariance.filter(|_| held > orders && orders > HIGHEST && self.turns > 0) else {
            return 0.0;
        };
        let harmonics = self.harmonics(held);
        let of_channel = |(channel, harmonics): (usize, &[Complex64])| {
            let matrices = covariance.chunks_exact(channels * channels).skip(orders - HIGHEST);
            let noise = matrices.map(|matrix| matrix[channel * (channels + 1)].re).sum::<f64>() / HIGHEST as f64;
            let power = |harmonics: &[Complex64]| harmonics.iter().map(Complex64::norm_sqr).sum::<f64>();
            let (kept, above) = (power(&harmonics[2..orders]), power(&harmonics[orders..]));
            beyond_noise(above, noise * (held - orders) as f64, kept)
        };
        harmonics.chunks_exact(held).enumerate().map(of_channel).fold(0.0, f64::max)
    }

    /// Covariance of the mean, `[order][channel][channel]`, from its neighbours; `None` below two turns. See [`Slow`].
    pub(super) fn covariance(&self, neighbours: Option<&Neighbours>) -> Option<Vec<Complex64>> {
        neighbours.map(Neighbours::covariance).or_else(|| self.scatter())
    }

    /// What the covariance of the mean is taken from; `None` below three turns.
    pub(super) fn neighbours(&self) -> Option<Neighbours> {
        self.slow.neighbours(&self.sum, self.turns, self.size)
    }

    /// What the covariance of the mean would be with independent turns, `[order][channel][channel]`; `None` below two
    /// turns evaluated.
    pub(super) fn scatter(&self) -> Option<Vec<Complex64>> {
        let mut covariance = self.scatter.covariance()?;
        for entry in &mut covariance {
            *entry /= self.turns as f64;
        }
        Some(covariance)
    }

    /// By how much the turns evaluated are turned against each other, about their [mean](Self::mean).
    pub(super) fn angle_scatter(&self, mean: &[Complex64], by_marks: bool) -> Option<AngleScatter> {
        let (squares, powers) = self.scatter.deviations()?;
        let turns = [self.scatter.turns(), self.turns];
        let deviations = Deviations { mean, squares: &squares, powers: &powers, channels: self.size.channels, turns };
        AngleScatter::of(&deviations, by_marks)
    }

    /// The [scatter](Self::scatter) without the neighbours that [`covariance`](Self::covariance) is taken from; `None` below
    /// [`MANY_TURNS`], and where not all planned turns are there and evaluated.
    ///
    /// (T − 1) S = T Σ Cₖ Cₖᴴ over the T − 1 transforms Cₖ of the turns' harmonics, of which the neighbours are left out.
    pub(super) fn scatter_beside(&self) -> Option<Vec<Complex64>> {
        if self.scatter.turns() < self.turns.max(MANY_TURNS) {
            return None;
        }
        let mut covariance = self.scatter()?;
        let neighbours = self.slow.of_turns(&self.sum, self.turns, self.size)?;
        let (channels, turns) = (self.size.channels, self.turns as f64);
        let left = turns - 1.0 - neighbours.len() as f64;
        for (order, matrix) in covariance.chunks_exact_mut(channels * channels).enumerate() {
            for entry in matrix.iter_mut() {
                *entry *= (turns - 1.0) / left;
            }
            for side in &neighbours {
                let values = &side[order * channels..(order + 1) * channels];
                for (row, value) in matrix.chunks_exact_mut(channels).zip(values) {
                    let scaled = value / left;
                    row.iter_mut().zip(values).for_each(|(entry, other)| *entry -= scaled * other.conj());
                }
            }
            // Rounding.
            matrix.iter_mut().step_by(channels + 1).for_each(|entry| *entry = Complex64::from(entry.re.max(0.0)));
        }
        Some(covariance)
    }
}

/// Root mean square in µm of orders of so much power that are left out, beyond their noise and beside those that are kept; 0 where it is not above these.
pub(super) fn beyond_noise(above: f64, noise: f64, kept: f64) -> f64 {
    let is_form = above > ABOVE_NOISE * noise && above - noise > LEAST_ABSENT * LEAST_ABSENT * kept;
    if is_form { (0.5 * (above - noise)).sqrt() } else { 0.0 }
}

/// Turns on their way into the sums.
struct Summing<'a> {
    mean: &'a mut Mean,
    turns: &'a [f64],
}

impl FusedWork for Summing<'_> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        /// Readings that are worked on at once.
        const LANES: usize = 8;
        let Mean { size, turns, pivot, sum, slow, .. } = self.mean;
        let values = size.readings();
        let phases: Vec<_> = (0..self.turns.len() / values).map(|turn| slow.phases(*turns + turn)).collect();
        *turns += phases.len();
        let whole = values - values % LANES;
        for first in (0..whole).step_by(LANES) {
            slow.add::<A, LANES>(first, pivot, sum, self.turns, &phases);
        }
        for first in whole..values {
            slow.add::<A, 1>(first, pivot, sum, self.turns, &phases);
        }
    }
}

/// Takes turns apart.
pub(super) struct Analysis {
    fourier: Fourier,
    orders: usize,
    /// One channel's readings, which the transform uses up.
    readings: Vec<f64>,
}

impl Analysis {
    pub(super) fn new(angles: usize, orders: usize) -> Self {
        Self { fourier: Fourier::new(angles), orders, readings: vec![0.0; angles] }
    }

    /// Readings on equal angles, `[channel][angle]`, as harmonics, `[channel][order]`.
    pub(super) fn take_apart(&mut self, readings: &[f64], turn: &mut [Complex64]) {
        for (readings, harmonics) in readings.chunks_exact(self.readings.len()).zip(turn.chunks_exact_mut(self.orders))
        {
            self.readings.copy_from_slice(readings);
            // Profiles are Re Σ cₙ e^{−inΦ}.
            self.fourier.analyse_reversed_in_place(&mut self.readings, harmonics);
        }
    }
}

//! Covariance of a mean over turns that depend on each other.
//!
//! Asynchronous motion is made of tones. Each leaks into the mean at order n as it would into a Fourier transform of the
//! whole record at frequency n (in cycles per turn), and nearly as much at n ± k/T for small k. The power of these
//! neighbours, which hold nothing synchronous, is therefore the variance of the mean: for independent noise as for tones
//! far from a whole order, which a mean takes out faster than independent noise. (Welch's estimate of a spectrum's density
//! at a frequency, from the frequencies beside it; Percival, Walden, *Spectral Analysis for Physical Applications*,
//! 1993, section 6.)

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::{cell::RefCell, f64::consts::TAU};

use runout_core::{Complex64, numerics::lanes::load};
use rustfft::FftPlanner;

use super::mean::at;

/// Neighbours to each side. With covariances averaged over five orders they make 20 complex degrees of freedom.
const NEIGHBOURS: usize = 2;

/// cos and sin for each of them.
pub(super) const PHASES: usize = 2 * NEIGHBOURS;

/// Sums over turns times cos and sin of 2πkm/T, k = 1, 2, for the m-th of T turns.
pub(super) struct Slow {
    planned: usize,
    /// Neighbours to each side that there are.
    neighbours: usize,
    /// Sum of the phases over the turns.
    phase_sums: [f64; PHASES],
    /// Sums of the turns less the pivot, in planes as [`Mean`](super::mean::Mean) has them.
    sums: [Vec<f64>; PHASES],
}

impl Slow {
    /// For `planned` turns at most, each of so many numbers.
    pub(super) fn new(values: usize, planned: usize) -> Self {
        // Beyond half of the turns the same frequencies come again.
        let neighbours = NEIGHBOURS.min(planned.saturating_sub(1) / 2);
        Self {
            planned,
            neighbours,
            phase_sums: [0.0; PHASES],
            sums: std::array::from_fn(|index| if index < 2 * neighbours { vec![0.0; values] } else { Vec::new() }),
        }
    }

    /// The phases of the m-th turn, which has to be taken in with them unless it is the pivot.
    pub(super) fn phases(&mut self, turn: usize) -> [f64; PHASES] {
        let mut phases = [0.0; PHASES];
        for neighbour in 0..self.neighbours {
            let cycles = ((neighbour + 1) * turn % self.planned) as f64 / self.planned as f64;
            let (sine, cosine) = (TAU * cycles).sin_cos();
            phases[2 * neighbour..2 * neighbour + 2].copy_from_slice(&[cosine, sine]);
        }
        self.phase_sums.iter_mut().zip(phases).for_each(|(sum, phase)| *sum += phase);
        phases
    }

    /// Takes the numbers `first..first + C` of several turns into the sums here, and into the plain `sum`.
    #[inline(always)]
    pub(super) fn add<const C: usize>(
        &mut self,
        first: usize,
        sum: &mut [f64],
        turns: &[f64],
        phases: &[[f64; PHASES]],
    ) {
        let values = sum.len();
        let mut plain: [f64; C] = load(sum, first);
        let mut slow = [[0.0; C]; PHASES];
        for (turn, phases) in turns.chunks_exact(values).zip(phases) {
            let turn: [f64; C] = load(turn, first);
            for lane in 0..C {
                plain[lane] += turn[lane];
            }
            for (sum, phase) in slow.iter_mut().zip(phases) {
                for lane in 0..C {
                    sum[lane] += phase * turn[lane];
                }
            }
        }
        sum[first..first + C].copy_from_slice(&plain);
        for (sums, slow) in self.sums[..2 * self.neighbours].iter_mut().zip(slow) {
            sums[first..first + C].iter_mut().zip(slow).for_each(|(sum, slow)| *sum += slow);
        }
    }

    /// Covariance of the mean, `[order][channel][channel]`; `sum` is that of the turns less the pivot, in planes. `None`
    /// where there are too few turns to have neighbours.
    pub(super) fn covariance(
        &self,
        sum: &[f64],
        turns: usize,
        orders: usize,
        channels: usize,
    ) -> Option<Vec<Complex64>> {
        if self.neighbours == 0 || turns < 3 {
            return None;
        }
        let plane = sum.len() / (2 * channels);
        let mut covariance = vec![Complex64::ZERO; orders * channels * channels];
        let scale = 1.0 / (2.0 * self.neighbours as f64 * (turns * turns) as f64);
        let mut record = Record::new(orders);
        for neighbour in 0..self.neighbours {
            let [cosine, sine] = [2 * neighbour, 2 * neighbour + 1];
            let cycles = (neighbour + 1) as f64 / self.planned as f64;
            // Both neighbours, `[side][order × channel]`.
            let mut sides = [vec![Complex64::ZERO; orders * channels], vec![Complex64::ZERO; orders * channels]];
            for channel in 0..channels {
                let about_mean = |order: usize| {
                    let mean = at(sum, plane, order, channel) / turns as f64;
                    [cosine, sine]
                        .map(|index| at(&self.sums[index], plane, order, channel) - mean * self.phase_sums[index])
                };
                record.neighbours(about_mean, cycles, |order, neighbours| {
                    let at = order * channels + channel;
                    sides.iter_mut().zip(neighbours).for_each(|(side, value)| side[at] = value);
                });
            }
            for side in &sides {
                let each = side.chunks_exact(channels).zip(covariance.chunks_exact_mut(channels * channels));
                for (values, covariance) in each {
                    for (row, target) in values.iter().zip(covariance.chunks_exact_mut(channels)) {
                        target.iter_mut().zip(values).for_each(|(to, column)| *to += row * column.conj() * scale);
                    }
                }
            }
        }
        Some(covariance)
    }
}

thread_local! {
    /// Keeps the plans that it has made: captures of one recording mostly ask for the same.
    static PLANNER: RefCell<FftPlanner<f64>> = RefCell::new(FftPlanner::new());
}

/// One channel's sums over turns as a function of angle, to take the phase on within the turns.
struct Record {
    orders: usize,
    signal: Vec<Complex64>,
    scratch: Vec<Complex64>,
    synthesis: std::sync::Arc<dyn rustfft::Fft<f64>>,
    analysis: std::sync::Arc<dyn rustfft::Fft<f64>>,
}

impl Record {
    fn new(orders: usize) -> Self {
        let length = (2 * orders + 2).next_power_of_two();
        let (synthesis, analysis) =
            PLANNER.with_borrow_mut(|planner| (planner.plan_fft_forward(length), planner.plan_fft_inverse(length)));
        let scratch = synthesis.get_inplace_scratch_len().max(analysis.get_inplace_scratch_len());
        Self {
            orders,
            signal: vec![Complex64::ZERO; length],
            scratch: vec![Complex64::ZERO; scratch],
            synthesis,
            analysis,
        }
    }

    /// The record's transform at n + k/T and n − k/T, from Σ cₙ(m) cos 2πkm/T and Σ cₙ(m) sin 2πkm/T.
    ///
    /// Between the marks the phase goes on: with Uₖ(Φ) = Σ e^{−2πikm/T} u_m(Φ), the transform is that of Uₖ e^{−ikΦ/T},
    /// and u real makes U₋ₖ its conjugate.
    fn neighbours(
        &mut self,
        sums: impl Fn(usize) -> [Complex64; 2],
        cycles: f64,
        mut take: impl FnMut(usize, [Complex64; 2]),
    ) {
        let length = self.signal.len();
        self.signal.fill(Complex64::ZERO);
        for order in 0..self.orders {
            let [cosine, sine] = sums(order);
            let (below, above) = (cosine - Complex64::I * sine, cosine + Complex64::I * sine);
            if order == 0 {
                self.signal[0] = below;
            } else {
                self.signal[order] = 0.5 * below;
                self.signal[length - order] = 0.5 * above.conj();
            }
        }
        self.synthesis.process_with_scratch(&mut self.signal, &mut self.scratch);
        let step = Complex64::cis(-TAU * cycles / length as f64);
        let mut phase = Complex64::new(1.0 / length as f64, 0.0);
        for value in &mut self.signal {
            *value *= phase;
            phase *= step;
        }
        self.analysis.process_with_scratch(&mut self.signal, &mut self.scratch);
        for order in 0..self.orders {
            let below = self.signal[order];
            let above = self.signal[(length - order) % length].conj();
            let scale = if order == 0 { 1.0 } else { 2.0 };
            take(order, [scale * below, scale * above]);
        }
    }
}

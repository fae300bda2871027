//! Covariance of a mean over turns that depend on each other.
//!
//! Asynchronous motion is made of tones. Each leaks into the mean at order n as it would into a Fourier transform of the
//! whole record at frequency n (in cycles per turn), and nearly as much at n ± k/T for small k. The power of these
//! neighbours, which hold nothing synchronous, is therefore the variance of the mean: for independent noise as for tones
//! far from a whole order, which a mean takes out faster than independent noise. (Welch's estimate of a spectrum's density
//! at a frequency, from the frequencies beside it; Percival, Walden, *Spectral Analysis for Physical Applications*,
//! 1993, section 6.)

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    neighbours::Neighbours,
    numerics::{
        fourier::complex_inverse,
        lanes::{Arithmetic, load},
    },
    profile::NEIGHBOURS,
};

use super::size::Size;

/// cos and sin for each of them.
pub(super) const PHASES: usize = 2 * NEIGHBOURS;

/// Sums over turns times cos and sin of 2πkm/T, k = 1, 2, for the m-th of T turns.
pub(super) struct Slow {
    planned: usize,
    /// Neighbours to each side that there are.
    neighbours: usize,
    /// Sum of the phases over the turns.
    phase_sums: [f64; PHASES],
    /// Sums of the turns less the pivot, `[channel][angle]`.
    sums: [Vec<f64>; PHASES],
}

impl Slow {
    /// For `planned` turns at most, each of so many readings.
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

    /// The phases of the m-th turn, which has to be taken in with them.
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

    /// Takes the readings `first..first + C` of several turns, less the pivot, into the sums here and into the plain `sum`.
    #[inline(always)]
    pub(super) fn add<A: Arithmetic, const C: usize>(
        &mut self,
        first: usize,
        pivot: &[f64],
        sum: &mut [f64],
        turns: &[f64],
        phases: &[[f64; PHASES]],
    ) {
        let pivot: [f64; C] = load(pivot, first);
        let mut plain: [f64; C] = load(sum, first);
        let mut slow = [[0.0; C]; PHASES];
        for (turn, phases) in turns.chunks_exact(sum.len()).zip(phases) {
            let mut turn: [f64; C] = load(turn, first);
            for lane in 0..C {
                turn[lane] -= pivot[lane];
                plain[lane] += turn[lane];
            }
            for (sum, phase) in slow.iter_mut().zip(phases) {
                for lane in 0..C {
                    sum[lane] = A::mul_add(*phase, turn[lane], sum[lane]);
                }
            }
        }
        sum[first..first + C].copy_from_slice(&plain);
        for (sums, slow) in self.sums[..2 * self.neighbours].iter_mut().zip(slow) {
            sums[first..first + C].iter_mut().zip(slow).for_each(|(sum, slow)| *sum += slow);
        }
    }

    /// What the covariance of the mean is taken from; `sum` is that of the turns less the pivot. `None` where there
    /// are too few turns to have neighbours.
    ///
    /// Between the marks the phase goes on: with Uₖ(Φ) = Σ e^{−2πikm/T} u_m(Φ), the record's transforms at n + k/T and
    /// n − k/T are those of Uₖ e^{−ikΦ/T} at n and −n, as u real makes U₋ₖ its conjugate.
    pub(super) fn neighbours(&self, sum: &[f64], turns: usize, size: Size) -> Option<Neighbours> {
        let coefficients = self.transforms(sum, turns, size, 1.0)?;
        Some(Neighbours { period: self.planned, channels: size.channels, angles: size.angles, coefficients })
    }

    /// What these neighbours are of the turns' own harmonics c_m: Σ e^{∓2πikm/T} c_m / T, as
    /// [`Neighbours::coefficients`] are laid out. With all T planned turns they are at right angles to each other and
    /// to the rest of the turns' scatter; `None` with fewer turns.
    pub(super) fn of_turns(&self, sum: &[f64], turns: usize, size: Size) -> Option<Vec<Vec<Complex64>>> {
        if turns < self.planned { None } else { self.transforms(sum, turns, size, 0.0) }
    }

    /// Transforms of Uₖ e^{−isk Φ/T} over the turns, s being `within` a turn: 1 where the phase goes on, 0 where each
    /// turn has one.
    fn transforms(&self, sum: &[f64], turns: usize, size: Size, within: f64) -> Option<Vec<Vec<Complex64>>> {
        if self.neighbours == 0 || turns < 3 {
            return None;
        }
        let Size { channels, angles, orders } = size;
        let transform = complex_inverse(angles);
        let mut scratch = vec![Complex64::ZERO; transform.get_inplace_scratch_len()];
        let mut signal = vec![Complex64::ZERO; angles];
        let mut coefficients = Vec::with_capacity(2 * self.neighbours);
        for neighbour in 0..self.neighbours {
            let [cosine, sine] = [2 * neighbour, 2 * neighbour + 1];
            let step = Complex64::cis(-TAU * within * (neighbour + 1) as f64 / (self.planned * angles) as f64);
            // Both neighbours, `[side][order × channel]`.
            let mut sides = [vec![Complex64::ZERO; orders * channels], vec![Complex64::ZERO; orders * channels]];
            for channel in 0..channels {
                let range = channel * angles..(channel + 1) * angles;
                let sums = self.sums[cosine][range.clone()].iter().zip(&self.sums[sine][range.clone()]);
                let mut phase = Complex64::from(1.0 / (angles * turns) as f64);
                for (value, (sum, (in_phase, quadrature))) in signal.iter_mut().zip(sum[range].iter().zip(sums)) {
                    let mean = sum / turns as f64;
                    let [re, im] = [(in_phase, cosine), (quadrature, sine)].map(|(s, i)| s - mean * self.phase_sums[i]);
                    *value = Complex64::new(re, -im) * phase;
                    phase *= step;
                }
                transform.process_with_scratch(&mut signal, &mut scratch);
                for order in 0..orders.min(angles) {
                    let scale = if order == 0 { 1.0 } else { 2.0 };
                    sides[0][order * channels + channel] = scale * signal[order];
                    sides[1][order * channels + channel] = scale * signal[(angles - order) % angles].conj();
                }
            }
            coefficients.extend(sides);
        }
        Some(coefficients)
    }
}

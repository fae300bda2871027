//! Covariance of a mean over turns that depend on each other.
//!
//! Asynchronous motion is made of tones. Each leaks into the mean at order n as it would into a Fourier transform of the
//! whole record at frequency n (in cycles per turn), and nearly as much at n ± k/T for small k. The power of these
//! neighbours, which hold nothing synchronous, is therefore the variance of the mean: for independent noise as for tones
//! far from a whole order, which a mean takes out faster than independent noise. (Welch's estimate of a spectrum's density
//! at a frequency, from the frequencies beside it; Percival, Walden, *Spectral Analysis for Physical Applications*,
//! 1993, section 6.)

use std::f64::consts::TAU;

use runout_core::Complex64;
use rustfft::FftPlanner;

/// Neighbours to each side. With covariances averaged over five orders they make 20 complex degrees of freedom.
const NEIGHBOURS: usize = 2;

/// Sums over turns times cos and sin of 2πkm/T, k = 1, 2, for the m-th of T turns.
pub(super) struct Slow {
    planned: usize,
    /// cos and sin of this turn, for each k.
    phases: Vec<[f64; 2]>,
    /// Sum of the phases over the turns.
    phase_sums: Vec<[f64; 2]>,
    /// Sums of the turns less the pivot, `[k][cos, sin][order × channel]`.
    sums: Vec<[Vec<Complex64>; 2]>,
}

impl Slow {
    /// For `planned` turns at most, each of `length` coefficients.
    pub(super) fn new(length: usize, planned: usize) -> Self {
        // Beyond half of the turns the same frequencies come again.
        let count = NEIGHBOURS.min(planned.saturating_sub(1) / 2);
        Self {
            planned,
            phases: vec![[1.0, 0.0]; count],
            phase_sums: vec![[0.0; 2]; count],
            sums: vec![[vec![Complex64::ZERO; length], vec![Complex64::ZERO; length]]; count],
        }
    }

    /// Sets the phases of the m-th turn.
    pub(super) fn begin_turn(&mut self, turn: usize) {
        for (index, (phases, sums)) in self.phases.iter_mut().zip(&mut self.phase_sums).enumerate() {
            let cycles = ((index + 1) * turn % self.planned) as f64 / self.planned as f64;
            let (sine, cosine) = (TAU * cycles).sin_cos();
            *phases = [cosine, sine];
            sums[0] += cosine;
            sums[1] += sine;
        }
    }

    /// Takes one turn's coefficients, `[order][channel]`, less those of the pivot.
    pub(super) fn add(&mut self, turn: &[Complex64], pivot: &[Complex64]) {
        for (phases, sums) in self.phases.iter().zip(&mut self.sums) {
            for (phase, sum) in phases.iter().zip(sums) {
                for ((sum, turn), pivot) in sum.iter_mut().zip(turn).zip(pivot) {
                    *sum += (turn - pivot) * *phase;
                }
            }
        }
    }

    /// Covariance of the mean, `[order][channel][channel]`; `sum` is that of the turns less the pivot. `None` where there
    /// are too few turns to have neighbours.
    pub(super) fn covariance(&self, sum: &[Complex64], turns: usize, channels: usize) -> Option<Vec<Complex64>> {
        if self.sums.is_empty() || turns < 3 {
            return None;
        }
        let orders = sum.len() / channels;
        let mut covariance = vec![Complex64::ZERO; sum.len() * channels];
        let scale = 1.0 / (2.0 * self.sums.len() as f64 * (turns * turns) as f64);
        let mut record = Record::new(orders);
        for (index, ([cosines, sines], phases)) in self.sums.iter().zip(&self.phase_sums).enumerate() {
            let cycles = (index + 1) as f64 / self.planned as f64;
            // Both neighbours, `[side][order × channel]`.
            let mut sides = [vec![Complex64::ZERO; sum.len()], vec![Complex64::ZERO; sum.len()]];
            for channel in 0..channels {
                let about_mean = |order: usize| {
                    let at = order * channels + channel;
                    let mean = sum[at] / turns as f64;
                    [cosines[at] - mean * phases[0], sines[at] - mean * phases[1]]
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
        let mut planner = FftPlanner::new();
        let (synthesis, analysis) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
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

//! Harmonics of periodic signals on equally spaced angles.

use std::{cell::RefCell, sync::Arc};

pub use realfft::{ComplexToReal, RealToComplex};
pub use rustfft::Fft;

use realfft::RealFftPlanner;
use rustfft::FftPlanner;

use crate::Complex64;

/// Buffers that a thread keeps for transforms to come.
const MOST_SPARE: usize = 8;

thread_local! {
    static REAL: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
    static COMPLEX: RefCell<FftPlanner<f64>> = RefCell::new(FftPlanner::new());
    static SPARE: RefCell<Vec<Buffers>> = const { RefCell::new(Vec::new()) };
}

// Plans are made here alone: their generic code is a third of what a crate compiles that makes one. A thread keeps those that it has made.

/// From real values to harmonics.
#[must_use]
pub fn real_forward(length: usize) -> Arc<dyn RealToComplex<f64>> {
    REAL.with_borrow_mut(|planner| planner.plan_fft_forward(length))
}

/// From harmonics to real values.
#[must_use]
pub fn real_inverse(length: usize) -> Arc<dyn ComplexToReal<f64>> {
    REAL.with_borrow_mut(|planner| planner.plan_fft_inverse(length))
}

/// Of complex values.
#[must_use]
pub fn complex_forward(length: usize) -> Arc<dyn Fft<f64>> {
    COMPLEX.with_borrow_mut(|planner| planner.plan_fft_forward(length))
}

/// Of complex values, back.
#[must_use]
pub fn complex_inverse(length: usize) -> Arc<dyn Fft<f64>> {
    COMPLEX.with_borrow_mut(|planner| planner.plan_fft_inverse(length))
}

/// Memory of a transform: asking the system for it each time costs as much as a transform.
#[derive(Default)]
struct Buffers {
    signal: Vec<f64>,
    spectrum: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Buffers {
    /// Those of an earlier transform of the length, or new ones.
    fn of(forward: &dyn RealToComplex<f64>, inverse: &dyn ComplexToReal<f64>) -> Self {
        let spare = SPARE.with_borrow_mut(|spare| {
            let place = spare.iter().position(|buffers| buffers.signal.len() == forward.len())?;
            Some(spare.remove(place))
        });
        spare.unwrap_or_else(|| Self {
            signal: forward.make_input_vec(),
            spectrum: forward.make_output_vec(),
            scratch: vec![Complex64::ZERO; forward.get_scratch_len().max(inverse.get_scratch_len())],
        })
    }
}

impl Drop for Fourier {
    fn drop(&mut self) {
        let buffers = Buffers {
            signal: std::mem::take(&mut self.signal),
            spectrum: std::mem::take(&mut self.spectrum),
            scratch: std::mem::take(&mut self.scratch),
        };
        // A thread that ends keeps nothing.
        let _ = SPARE.try_with(|spare| {
            let mut spare = spare.borrow_mut();
            spare.truncate(MOST_SPARE - 1);
            spare.insert(0, buffers);
        });
    }
}

/// Transforms between one turn of equally spaced samples and its harmonics cₙ, signal = Re Σ cₙ e^{+inα}.
///
/// For a coefficient of e^{−inΦ} take the complex conjugate. The Nyquist order of an even length is left out: its
/// phase cannot be known.
pub struct Fourier {
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    signal: Vec<f64>,
    spectrum: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Fourier {
    /// Plans transforms of `length` samples, at least 2.
    #[must_use]
    pub fn new(length: usize) -> Self {
        let (forward, inverse) = (real_forward(length), real_inverse(length));
        let Buffers { signal, spectrum, scratch } = Buffers::of(&*forward, &*inverse);
        Self { forward, inverse, signal, spectrum, scratch }
    }

    /// Samples a turn.
    #[must_use]
    pub fn length(&self) -> usize {
        self.forward.len()
    }

    /// Highest order below Nyquist.
    #[must_use]
    pub fn max_order(&self) -> usize {
        max_order(self.length())
    }

    /// Harmonics of a turn from order 0 to as many as `harmonics` holds, at most [`max_order`](Self::max_order)+1.
    ///
    /// `signal` yields [`length`](Self::length) samples; missing ones count as 0.
    pub fn analyse(&mut self, signal: impl IntoIterator<Item = f64>, harmonics: &mut [Complex64]) {
        let mut samples = signal.into_iter();
        let mut own = std::mem::take(&mut self.signal);
        own.fill_with(|| samples.next().unwrap_or(0.0));
        self.analyse_in_place(&mut own, harmonics);
        self.signal = own;
    }

    /// Harmonics of a turn of [`length`](Self::length) samples, which are overwritten; all harmonics are 0 with another number.
    pub fn analyse_in_place(&mut self, signal: &mut [f64], harmonics: &mut [Complex64]) {
        self.scaled(signal, harmonics, 1.0);
    }

    /// Harmonics of a turn as coefficients of e^{−inΦ}, of [`length`](Self::length) samples, which are overwritten; all harmonics
    /// are 0 with another number.
    pub fn analyse_reversed_in_place(&mut self, signal: &mut [f64], harmonics: &mut [Complex64]) {
        self.scaled(signal, harmonics, -1.0);
    }

    /// Harmonics with their imaginary parts times a sign.
    fn scaled(&mut self, signal: &mut [f64], harmonics: &mut [Complex64], sign: f64) {
        let length = self.forward.len();
        let scratch = &mut self.scratch[..self.forward.get_scratch_len()];
        if self.forward.process_with_scratch(signal, &mut self.spectrum, scratch).is_err() {
            harmonics.fill(Complex64::ZERO);
            return;
        }
        let scale = 2.0 / length as f64;
        let kept = harmonics.len().min(max_order(length) + 1);
        for (harmonic, bin) in harmonics.iter_mut().zip(&self.spectrum[..kept]) {
            *harmonic = Complex64::new(scale * bin.re, sign * scale * bin.im);
        }
        harmonics[kept..].fill(Complex64::ZERO);
        if let Some(level) = harmonics.first_mut() {
            *level *= 0.5;
        }
    }

    /// One turn of the signal that has these harmonics from order 0; orders above Nyquist must not occur.
    pub fn synthesise(&mut self, harmonics: impl IntoIterator<Item = Complex64>) -> &[f64] {
        let mut signal = std::mem::take(&mut self.signal);
        self.synthesise_into(harmonics, &mut signal);
        self.signal = signal;
        &self.signal
    }

    /// Writes one turn of the signal that has these harmonics from order 0 to `signal`, which becomes a turn long; orders above
    /// Nyquist must not occur.
    pub fn synthesise_into(&mut self, harmonics: impl IntoIterator<Item = Complex64>, signal: &mut Vec<f64>) {
        let length = self.inverse.len();
        let mut filled = 0;
        for (bin, harmonic) in self.spectrum[..=max_order(length)].iter_mut().zip(harmonics) {
            *bin = 0.5 * harmonic;
            filled += 1;
        }
        self.spectrum[filled..].fill(Complex64::ZERO);
        self.spectrum[0] = Complex64::new(2.0 * self.spectrum[0].re, 0.0);
        signal.resize(length, 0.0);
        let scratch = &mut self.scratch[..self.inverse.get_scratch_len()];
        let _ = self.inverse.process_with_scratch(&mut self.spectrum, signal, scratch);
    }
}

/// A number of samples, at least so many, for a quick transform.
#[must_use]
pub fn quick_length(at_least: usize) -> usize {
    let power = at_least.next_power_of_two().max(8);
    [5 * (power / 8), 3 * (power / 4), power].into_iter().find(|count| *count >= at_least).unwrap_or(power)
}

/// Highest order below Nyquist on `length` samples a turn.
#[must_use]
pub fn max_order(length: usize) -> usize {
    length.saturating_sub(1) / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_of_a_known_sum_and_back() {
        for length in [31, 32, 2560] {
            let mut fourier = Fourier::new(length);
            let signal: Vec<f64> = (0..length)
                .map(|index| {
                    let angle = std::f64::consts::TAU * index as f64 / length as f64;
                    0.5 + 2.0 * (3.0 * angle + 0.7).cos() - 0.25 * (15.0 * angle).sin()
                })
                .collect();
            let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
            fourier.analyse(signal.iter().copied(), &mut harmonics);
            // 1e-14: rounding of a transform of values near 1.
            assert!((harmonics[0] - 0.5).norm() < 1e-14);
            assert!((harmonics[3] - Complex64::from_polar(2.0, 0.7)).norm() < 1e-14);
            assert!((harmonics[15] - Complex64::new(0.0, 0.25)).norm() < 1e-14);
            let back = fourier.synthesise(harmonics.iter().copied());
            let worst = back.iter().zip(&signal).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-14, "length {length}: {worst:e}");
        }
    }
}

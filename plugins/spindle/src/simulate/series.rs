//! Trigonometric sums at several angles at once.

use runout_core::Complex64;

/// Samples that are worked on side by side.
pub(super) const LANES: usize = 8;

/// Complex numbers, one a lane: mostly points of the unit circle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phasor<const L: usize> {
    pub re: [f64; L],
    pub im: [f64; L],
}

impl<const L: usize> Phasor<L> {
    /// e^{i·2π·turns}; exact to rounding while |turns| stays near 1.
    pub(crate) fn of_turns(turns: &[f64; L]) -> Self {
        let mut phasor = Self::ZERO;
        for lane in 0..L {
            (phasor.im[lane], phasor.re[lane]) = (std::f64::consts::TAU * turns[lane]).sin_cos();
        }
        phasor
    }

    pub(crate) const ZERO: Self = Self { re: [0.0; L], im: [0.0; L] };

    pub(crate) fn conj(mut self) -> Self {
        for value in &mut self.im {
            *value = -*value;
        }
        self
    }

    pub(crate) fn times(&self, factor: Complex64) -> Self {
        let mut product = Self::ZERO;
        for lane in 0..L {
            product.re[lane] = self.re[lane] * factor.re - self.im[lane] * factor.im;
            product.im[lane] = self.re[lane] * factor.im + self.im[lane] * factor.re;
        }
        product
    }
}

/// Something periodic, given by harmonics from order 0.
pub(super) trait Series<const L: usize> {
    /// Re Σ cₙ zⁿ, by Horner's rule, whose rounding grows with n only where |cₙ| does.
    fn sum(&self, z: &Phasor<L>) -> [f64; L];
}

/// Harmonics that all lanes have in common.
impl<const L: usize> Series<L> for [Complex64] {
    fn sum(&self, z: &Phasor<L>) -> [f64; L] {
        let (mut re, mut im) = ([0.0; L], [0.0; L]);
        for harmonic in self.iter().rev() {
            for lane in 0..L {
                let (a, b) = (re[lane], im[lane]);
                re[lane] = a * z.re[lane] - b * z.im[lane] + harmonic.re;
                im[lane] = a * z.im[lane] + b * z.re[lane] + harmonic.im;
            }
        }
        re
    }
}

/// Harmonics of its own in each lane.
impl<const L: usize> Series<L> for [Phasor<L>] {
    fn sum(&self, z: &Phasor<L>) -> [f64; L] {
        let (mut re, mut im) = ([0.0; L], [0.0; L]);
        for harmonic in self.iter().rev() {
            for lane in 0..L {
                let (a, b) = (re[lane], im[lane]);
                re[lane] = a * z.re[lane] - b * z.im[lane] + harmonic.re[lane];
                im[lane] = a * z.im[lane] + b * z.re[lane] + harmonic.im[lane];
            }
        }
        re
    }
}

/// Re Σ cₙ zⁿ on `count` equally spaced angles from 0, z = e^{iα} or, `backwards`, e^{−iα}.
pub(super) fn turn(harmonics: &[Complex64], count: usize, backwards: bool) -> Vec<f64> {
    let at = |index: usize| {
        let phasor = Phasor::of_turns(&[index as f64 / count as f64]);
        harmonics.sum(&if backwards { phasor.conj() } else { phasor })[0]
    };
    (0..count).map(at).collect()
}

/// Root mean square of Re Σ cₙ zⁿ over a turn, orders from 1.
pub(super) fn rms(harmonics: &[Complex64]) -> f64 {
    (0.5 * harmonics.iter().skip(1).map(Complex64::norm_sqr).sum::<f64>()).sqrt()
}

/// No value of the sum is larger.
pub(super) fn bound(harmonics: &[Complex64]) -> f64 {
    harmonics.iter().map(|harmonic| harmonic.norm()).sum()
}

/// No derivative by the angle is larger, per rad.
pub(super) fn slope_bound(harmonics: &[Complex64]) -> f64 {
    harmonics.iter().enumerate().map(|(order, harmonic)| order as f64 * harmonic.norm()).sum()
}

/// Adds a harmonic, making room for its order.
pub(super) fn add(harmonics: &mut Vec<Complex64>, order: usize, value: Complex64) {
    if harmonics.len() <= order {
        harmonics.resize(order + 1, Complex64::ZERO);
    }
    harmonics[order] += value;
}

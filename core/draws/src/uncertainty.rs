//! What is known of a value's error.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use runout_numerics::Complex64;
pub use runout_numerics::statistics::{NORMAL_95, student_95};

/// The largest error of a few hundred drawn profiles is about so many standard deviations.
pub const LARGEST: f64 = 5.0;
/// Amplitude of noise that 5 % of all are above, in standard deviations of its real part as they are known from so many real
/// degrees of freedom: √(ν (20^{2/ν} − 1)), of Rayleigh's distribution √(2 ln 20) for 0, where they are taken as exact.
#[must_use]
pub fn noise_95(freedom: f64) -> f64 {
    let tail = 20.0_f64.ln();
    if freedom > 0.0 { (freedom * (2.0 * tail / freedom).exp_m1()).sqrt() } else { (2.0 * tail).sqrt() }
}

/// What is known of a value's error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Uncertainty {
    /// Standard uncertainty, in the value's unit.
    pub std: f64,
    /// Where the truth lies with 95 % probability. A peak-to-valley grows with noise; the interval takes that back, and so
    /// need not lie evenly about the value.
    pub interval_95: [f64; 2],
    /// Draws of the Monte Carlo; 0 where none was needed.
    pub draws: usize,
    /// What the interval contains.
    #[serde(default)]
    pub kind: IntervalKind,
}

/// What an interval contains with its probability.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntervalKind {
    /// The true value: a coverage interval (VIM 2.36).
    #[default]
    Coverage,
    /// The value of another capture of the same: a prediction interval. It is wider than twice the standard uncertainty where that scatter is
    /// known from few captures.
    Prediction,
}

impl IntervalKind {
    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Coverage => "coverage",
            Self::Prediction => "prediction",
        }
    }
}

impl Uncertainty {
    /// With an interval that contains the true value.
    #[must_use]
    pub fn new(std: f64, interval_95: [f64; 2], draws: usize) -> Self {
        Self { std, interval_95, draws, kind: IntervalKind::Coverage }
    }

    /// Of a value whose error is normal.
    #[must_use]
    pub fn normal(value: f64, std: f64) -> Self {
        Self::new(std, [value - NORMAL_95 * std, value + NORMAL_95 * std], 0)
    }

    /// Of an amplitude, from the standard uncertainty of its part along the phasor, known from so many real degrees of
    /// freedom (0 where it is taken as exact). An amplitude that noise alone exceeds in more than [5 % of all
    /// cases](noise_95) may be noise: its interval begins at 0.
    #[must_use]
    pub fn of_amplitude(value: f64, std: f64, freedom: usize) -> Self {
        let reach = student_95(freedom as f64) * std;
        let low = if value < noise_95(freedom as f64) * std { 0.0 } else { (value - reach).max(0.0) };
        Self::new(std, [low, value + reach], 0)
    }

    /// Makes the interval `factor` times as wide about its middle.
    #[must_use]
    pub fn widened(mut self, factor: f64) -> Self {
        let [low, high] = self.interval_95;
        let (middle, half) = (0.5 * (low + high), 0.5 * factor * (high - low));
        let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        // An end at 0 stays there.
        self.interval_95 = [if low == 0.0 { low } else { (middle - half).max(floor) }, middle + half];
        self
    }

    /// The uncertainty of a value that is larger by `by`: the interval moves as far; an interval that is not below 0 stays so.
    #[must_use]
    pub fn moved(mut self, by: f64) -> Self {
        let floor = if self.interval_95[0] >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        self.interval_95 = self.interval_95.map(|end| (end + by).max(floor));
        self
    }

    /// The uncertainty where the data do not decide between `value` and `equivalents`: the largest distance from `value` is added
    /// to the standard uncertainty, and the interval reaches as far beyond each of them as beyond `value`.
    #[must_use]
    pub fn with_equivalents(mut self, value: f64, equivalents: &[f64]) -> Self {
        let distances = || equivalents.iter().map(|other| other - value).filter(|distance| distance.is_finite());
        let [low, high] = &mut self.interval_95;
        let floor = if *low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        *low = (*low + distances().fold(0.0, f64::min)).max(floor);
        *high += distances().fold(0.0, f64::max);
        self.std = self.std.hypot(distances().map(f64::abs).fold(0.0, f64::max));
        self
    }
}

/// A harmonic stands out where noise has its power in one of 8000 cases, e⁻⁹.
const LINE: f64 = 9.0;

/// Whether a harmonic stands out from its noise of this variance; not where that is not known.
#[must_use]
pub fn stands_out(harmonic: Complex64, variance: f64) -> bool {
    variance > 0.0 && harmonic.norm_sqr() > LINE * variance
}

/// A seed that depends on names only, so that it is the same however the work is shared.
#[must_use]
pub fn seed(names: &[&str]) -> u64 {
    let mut hash = blake3::Hasher::new();
    for name in names {
        hash.update(name.as_bytes());
        hash.update(&[0]);
    }
    let bytes = hash.finalize();
    bytes.as_bytes()[..8].iter().fold(0, |seed, byte| (seed << 8) | u64::from(*byte))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Amplitudes of noise over a standard deviation from 2, 16 and 24 squares.
    #[test]
    fn noise_is_above_its_limit_in_one_of_twenty_cases() {
        assert!((noise_95(0.0) - noise_95(1e9)).abs() < 1e-6);
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut square = || -> f64 { Distribution::<f64>::sample(&StandardNormal, &mut random).powi(2) };
        for freedom in [2_u32, 16, 24] {
            let limit = noise_95(f64::from(freedom));
            let mut above = 0;
            for _ in 0..20_000 {
                let variance = (0..freedom).map(|_| square()).sum::<f64>() / f64::from(freedom);
                above += u32::from(square() + square() > limit * limit * variance);
            }
            // 1000 ± 31.
            assert!((880..=1120).contains(&above), "{freedom}: {above} of 20000");
        }
    }

    #[test]
    fn a_seed_is_that_of_its_names() {
        assert_ne!(seed(&["a", "b"]), seed(&["ab"]));
    }
}

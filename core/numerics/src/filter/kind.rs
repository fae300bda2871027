//! Filters of closed profiles by their transmission.

use schemars::JsonSchema;
use serde::Deserialize;

use super::transmission;
use crate::Complex64;

/// A kind of filter for roundness, as a weight on each order of a closed profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
pub enum Kind {
    /// ISO 16610-21: 50 % at the cut-off, no phase.
    #[default]
    #[serde(rename = "gaussian")]
    Gaussian,
    /// Cubic spline of a periodic profile (ISO/TS 16610-22, tension 0): 50 % at the cut-off, no phase.
    #[serde(rename = "spline")]
    Spline,
    /// Two RC stages (ISO 4291:1985): 75 % at the cut-off, with the phase of the analogue filter.
    #[serde(rename = "2rc")]
    TwoRc,
    /// The same amplitudes without phase.
    #[serde(rename = "2rc-phase-correct")]
    TwoRcPhaseCorrect,
}

impl Kind {
    /// As it stands in the name of a filter.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "Gaussian",
            Self::Spline => "spline",
            Self::TwoRc => "2RC",
            Self::TwoRcPhaseCorrect => "2RC phase correct",
        }
    }

    /// Transmission of the low-pass at an order, for coefficients of e^{+inα}; both in undulations per revolution, the cut-off
    /// above 0.
    ///
    /// Spline: 1/(1 + (f/f_c)⁴), the limit of ISO/TS 16610-22's [1 + α⁴·16 sin⁴(π Δx/λ)]⁻¹, α = 1/(2 sin(π Δx/λ_c)), for dense
    /// points. 2RC: (1 + j f/(√3 f_c))⁻², whose amplitude at f_c is 3/4; the profile lags.
    #[must_use]
    pub fn low_pass(self, order_upr: f64, cutoff_upr: f64) -> Complex64 {
        let ratio = order_upr / cutoff_upr;
        match self {
            Self::Gaussian => transmission(order_upr, cutoff_upr).into(),
            Self::Spline => (1.0 + ratio.powi(4)).recip().into(),
            Self::TwoRc => Complex64::new(1.0, ratio / 3_f64.sqrt()).powi(-2),
            Self::TwoRcPhaseCorrect => (1.0 + ratio * ratio / 3.0).recip().into(),
        }
    }

    /// Transmission of the high-pass: what the low-pass leaves, and of 2RC (1 − j f_c/(√3 f))⁻², the profile leading.
    #[must_use]
    pub fn high_pass(self, order_upr: f64, cutoff_upr: f64) -> Complex64 {
        match self {
            Self::Gaussian | Self::Spline => 1.0 - self.low_pass(order_upr, cutoff_upr),
            Self::TwoRc | Self::TwoRcPhaseCorrect if order_upr == 0.0 => Complex64::ZERO,
            // The same circuit with f and f_c exchanged and the phase turned round.
            Self::TwoRc | Self::TwoRcPhaseCorrect => self.low_pass(cutoff_upr, order_upr).conj(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The periodic smoothing spline with the least Σ (z − w)² + μ Σ (second difference)², solved as a linear system.
    #[test]
    fn the_spline_is_that_of_its_equations() {
        use nalgebra::{DMatrix, DVector};
        const COUNT: usize = 180;
        let cutoff = 15.0;
        let alpha = (2.0 * (std::f64::consts::PI * cutoff / COUNT as f64).sin()).recip();
        let mut second = DMatrix::<f64>::zeros(COUNT, COUNT);
        for row in 0..COUNT {
            second[(row, row)] = -2.0;
            second[(row, (row + 1) % COUNT)] = 1.0;
            second[(row, (row + COUNT - 1) % COUNT)] = 1.0;
        }
        let system = DMatrix::identity(COUNT, COUNT) + alpha.powi(4) * second.transpose() * &second;
        for order in [2_u32, 10, 15, 20] {
            let at = |point: usize| (std::f64::consts::TAU * f64::from(order) * point as f64 / COUNT as f64).cos();
            let wave = DVector::from_fn(COUNT, |point, _| at(point));
            let Some(filtered) = system.clone().lu().solve(&wave) else { panic!("a regular system") };
            let share = filtered.dot(&wave) / wave.dot(&wave);
            // The limit of dense points: (π·20/180)²/3 is 4 %, from which the cut-off's own share is subtracted.
            let expected = Kind::Spline.low_pass(f64::from(order), cutoff);
            assert!((share - expected.re).abs() < 0.01 && expected.im == 0.0, "{order}: {share} {expected}");
        }
    }

    #[test]
    fn the_cut_off_passes_half_and_of_2rc_three_quarters() {
        for (kind, share) in
            [(Kind::Gaussian, 0.5), (Kind::Spline, 0.5), (Kind::TwoRc, 0.75), (Kind::TwoRcPhaseCorrect, 0.75)]
        {
            assert!((kind.low_pass(50.0, 50.0).norm() - share).abs() < 1e-12, "{kind:?}");
            assert!((kind.high_pass(50.0, 50.0).norm() - share).abs() < 1e-12, "{kind:?}");
            assert!((kind.low_pass(0.0, 50.0) - 1.0).norm() < 1e-12 && kind.high_pass(0.0, 50.0).norm() < 1e-12);
        }
        // Two stages of 30° at the cut-off.
        assert!((Kind::TwoRc.low_pass(50.0, 50.0).arg().to_degrees() + 60.0).abs() < 1e-9);
        assert!((Kind::TwoRc.high_pass(50.0, 50.0).arg().to_degrees() - 60.0).abs() < 1e-9);
    }
}

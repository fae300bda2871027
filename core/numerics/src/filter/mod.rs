//! Gaussian filters (ISO 16610): closed profiles by their harmonics, open and gapped ones by local regression, maps.

mod areal;
mod areal_robust;
mod kind;
mod regression;
mod robust;

pub use areal::areal_gaussian;
pub use areal_robust::robust_areal_gaussian;
pub use kind::Kind;
pub use regression::{Degree, Smoother};
pub use robust::{Robust, robust_gaussian};

use crate::Complex64;

/// Transmission of the Gaussian low-pass of a closed profile (ISO 16610-21) at a frequency f: H = exp(−π (α f/f_c)²) with
/// α = √(ln 2/π), which is 2^−(f/f_c)². Both in undulations per revolution, the cut-off above 0.
fn transmission(order_upr: f64, cutoff_upr: f64) -> f64 {
    (-(order_upr / cutoff_upr).powi(2)).exp2()
}

/// Undulations per revolution that a wavelength along the circumference of a radius makes: 2πR/λ.
#[must_use]
pub fn upr(wavelength_mm: f64, radius_mm: f64) -> f64 {
    std::f64::consts::TAU * radius_mm / wavelength_mm
}

/// A Gaussian filter of closed profiles by its 50 % points, exact as weights on harmonics: circular, without ends.
///
/// With one cut-off a low-pass or a high-pass, with both a band, with none everything passes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Band {
    /// High-pass: undulations per revolution of which half passes, and less below.
    pub above_upr: Option<f64>,
    /// Low-pass: undulations per revolution of which half passes, and less above.
    pub below_upr: Option<f64>,
}

impl Band {
    /// What passes up to a cut-off.
    #[must_use]
    pub fn low_pass(cutoff_upr: f64) -> Self {
        Self { above_upr: None, below_upr: Some(cutoff_upr) }
    }

    /// What passes from a cut-off on: the profile minus its low-pass.
    #[must_use]
    pub fn high_pass(cutoff_upr: f64) -> Self {
        Self { above_upr: Some(cutoff_upr), below_upr: None }
    }

    /// Share of an order's amplitude that passes; the phase stays.
    #[must_use]
    pub fn weight(&self, order: usize) -> f64 {
        let low = |cutoff: Option<f64>, absent: f64| cutoff.map_or(absent, |cutoff| transmission(order as f64, cutoff));
        low(self.below_upr, 1.0) * (1.0 - low(self.above_upr, 0.0))
    }

    /// Filters harmonics, which go from order 0.
    pub fn apply(&self, harmonics: &mut [Complex64]) {
        for (order, harmonic) in harmonics.iter_mut().enumerate() {
            *harmonic *= self.weight(order);
        }
    }
}

#[cfg(test)]
mod tests;

//! From the numbers of a channel to displacements.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Unit of the numbers that a channel records.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[non_exhaustive]
pub enum Unit {
    /// Micrometres.
    #[default]
    #[serde(rename = "um")]
    Micrometre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// Nanometres.
    #[serde(rename = "nm")]
    Nanometre,
    /// Volts, with `um_per_volt`.
    #[serde(rename = "V")]
    Volt,
    /// Millivolts, with `um_per_volt`.
    #[serde(rename = "mV")]
    Millivolt,
}

impl Unit {
    /// µm (or V) of one unit, and whether it is one of voltage.
    pub(super) fn scale(self) -> (f64, bool) {
        match self {
            Self::Micrometre => (1.0, false),
            Self::Millimetre => (1e3, false),
            Self::Nanometre => (1e-3, false),
            Self::Volt => (1.0, true),
            Self::Millivolt => (1e-3, true),
        }
    }
}

/// How the numbers of a channel follow from displacements u in µm, the sign aside: number · `um_per_unit` = gain · (u + a·u² + b·u³).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Calibration {
    /// µm for one unit of the numbers.
    pub um_per_unit: f64,
    /// Reading over displacement.
    pub gain: f64,
    /// a, in 1/µm.
    pub quadratic_per_um: f64,
    /// b, in 1/µm².
    pub cubic_per_um2: f64,
}

impl Default for Calibration {
    fn default() -> Self {
        Self::NONE
    }
}

impl Calibration {
    /// Numbers that are displacements in µm.
    pub const NONE: Self = Self { um_per_unit: 1.0, gain: 1.0, quadratic_per_um: 0.0, cubic_per_um2: 0.0 };

    /// Displacement in µm; NaN where the characteristic turns back and no displacement is the only one that gives the number.
    #[must_use]
    pub fn displacement_um(&self, number: f64) -> f64 {
        let reading_um = number * self.um_per_unit / self.gain;
        if self.is_straight() {
            return reading_um;
        }
        straightened(reading_um, self.quadratic_per_um, self.cubic_per_um2).unwrap_or(f64::NAN)
    }

    /// Whether the characteristic is a straight line.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        self.quadratic_per_um == 0.0 && self.cubic_per_um2 == 0.0
    }

    /// The calibration of a sensor whose displacements were found to be (1 + gain)·(u + quadratic·u² + cubic·u³) by this one;
    /// to third order in u.
    #[must_use]
    pub fn corrected(&self, gain: f64, quadratic_per_um: f64, cubic_per_um2: f64) -> Self {
        let (ratio, a, b) = (1.0 + gain, self.quadratic_per_um, self.cubic_per_um2);
        Self {
            um_per_unit: self.um_per_unit,
            gain: self.gain * ratio,
            quadratic_per_um: quadratic_per_um + a * ratio,
            cubic_per_um2: cubic_per_um2 + 2.0 * a * ratio * quadratic_per_um + b * ratio * ratio,
        }
    }
}

/// u from u + quadratic·u² + cubic·u³ by Newton's method from the reading; nothing where the slope falls below a tenth.
#[must_use]
pub fn straightened(reading_um: f64, quadratic_per_um: f64, cubic_per_um2: f64) -> Option<f64> {
    let (a, b) = (quadratic_per_um, cubic_per_um2);
    let mut u = reading_um;
    // Four steps reach rounding for characteristics that are bent by a tenth.
    for _ in 0..4 {
        let slope = 1.0 + u * (2.0 * a + 3.0 * b * u);
        if slope.abs() < 0.1 {
            return None;
        }
        u -= (u * (1.0 + u * (a + b * u)) - reading_um) / slope;
    }
    Some(u)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_becomes_the_displacement_that_makes_it() {
        let known = Calibration { um_per_unit: 25.0, gain: 1.05, quadratic_per_um: 1e-3, cubic_per_um2: -2e-5 };
        for u in [-20.0_f64, -3.0, 0.0, 0.5, 17.0] {
            let number = 1.05 * (u + 1e-3 * u * u - 2e-5 * u * u * u) / 25.0;
            // Rounding of numbers of size 20.
            assert!((known.displacement_um(number) - u).abs() < 1e-12 * u.abs().max(1.0), "{u} µm");
        }
        // u − u²/20 has its highest point, 5, at u = 10.
        let turned_back = Calibration { quadratic_per_um: -0.05, ..Calibration::NONE };
        assert!(turned_back.displacement_um(5.5).is_nan());
    }

    /// What is left by one calibration is taken out by the corrected one; terms of fourth order are left.
    #[test]
    fn a_calibration_is_corrected_by_what_it_leaves() {
        let declared = Calibration { gain: 0.98, quadratic_per_um: 4e-4, cubic_per_um2: 1e-6, ..Calibration::NONE };
        let corrected = declared.corrected(0.02, -3e-4, 2e-6);
        for u in [-10.0_f64, -2.0, 1.0, 8.0] {
            let found_um = 1.02 * (u - 3e-4 * u * u + 2e-6 * u * u * u);
            let number = 0.98 * (found_um + 4e-4 * found_um.powi(2) + 1e-6 * found_um.powi(3));
            // Products such as 5·a·b·u⁴, 2·10⁻⁹·10⁴.
            assert!((corrected.displacement_um(number) - u).abs() < 5e-5, "{u}: {}", corrected.displacement_um(number));
        }
    }
}

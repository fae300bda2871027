//! Motion of the axis: what repeats from turn to turn, and what does not.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[motion]`: synchronous error motion, the same in every setup and at every station.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionConfig {
    /// Root mean square of the random motion along x, in µm.
    pub x_rms_um: f64,
    /// Along y, in µm.
    pub y_rms_um: f64,
    /// Along the axis, in µm.
    #[serde(skip_serializing_if = "is_zero")]
    pub z_rms_um: f64,
    /// Root mean square of the random tilt about x and about y, in µrad each.
    pub tilt_rms_urad: f64,
    /// The random motion has orders 2 to this one.
    pub max_order: usize,
    /// Amplitudes fall with order^-slope.
    pub slope: f64,
    /// Which orders the random motion has.
    pub orders: Orders,
    /// Harmonics of x in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub x: Vec<MotionHarmonic>,
    /// Harmonics of y in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub y: Vec<MotionHarmonic>,
    /// Harmonics of z in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub z: Vec<MotionHarmonic>,
    /// Harmonics of the tilt about x in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tilt_x: Vec<TiltHarmonic>,
    /// Harmonics of the tilt about y in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tilt_y: Vec<TiltHarmonic>,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            x_rms_um: 0.0,
            y_rms_um: 0.0,
            z_rms_um: 0.0,
            tilt_rms_urad: 0.0,
            max_order: 20,
            slope: 1.0,
            orders: Orders::default(),
            x: Vec::new(),
            y: Vec::new(),
            z: Vec::new(),
            tilt_x: Vec::new(),
            tilt_y: Vec::new(),
        }
    }
}

/// A choice of orders.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Orders {
    /// Every order.
    #[default]
    All,
    /// Odd orders only: motion that half a turn of the spindle reverses.
    Odd,
    /// Even orders only.
    Even,
}

/// amplitude · cos(order·Φ − phase), Φ the spindle's angle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionHarmonic {
    /// Per turn, 1 or more. Of order 1 only what turns against the spindle counts as error motion across the axis; the rest is
    /// clamping. Along the axis all of it counts.
    pub order: usize,
    /// In µm.
    pub amplitude_um: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
}

/// amplitude · cos(order·Φ − phase), Φ the spindle's angle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TiltHarmonic {
    /// Per turn, 1 or more.
    pub order: usize,
    /// In µrad.
    pub amplitude_urad: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
}

/// `[asynchronous]`: a Weierstrass-Mandelbrot function of time,
/// z(t) = G^(D−1) Σ γ^((D−2)n) cos(2π γⁿ t + φₙ), γ^n₁ = 1/L, with random phases for each direction and capture.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AsynchronousConfig {
    /// Root mean square along x and along y, in µm each.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_um: Option<f64>,
    /// Instead of `rms_um`: the scale G, with z in mm and t in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_mm: Option<f64>,
    /// Fractal dimension D, between 1 and 2.
    pub dimension: f64,
    /// Ratio γ of neighbouring frequencies, above 1.
    pub gamma: f64,
    /// Period L of the slowest term, in s; without it the length of the capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_period_s: Option<f64>,
    /// No term is faster, in Hz; without it half the sampling rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_frequency_hz: Option<f64>,
    /// Root mean square of the same kind of tilt about x and about y, in µrad each.
    pub tilt_rms_urad: f64,
    /// Root mean square of the same kind of motion along the axis, in µm.
    #[serde(skip_serializing_if = "is_zero")]
    pub z_rms_um: f64,
    /// Single lines in addition, at orders that are not whole.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<LineConfig>,
    /// The same along the axis.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub z_lines: Vec<AxialLineConfig>,
}

impl Default for AsynchronousConfig {
    fn default() -> Self {
        Self {
            rms_um: None,
            scale_mm: None,
            dimension: 1.5,
            gamma: 1.5,
            longest_period_s: None,
            max_frequency_hz: None,
            tilt_rms_urad: 0.0,
            z_rms_um: 0.0,
            lines: Vec::new(),
            z_lines: Vec::new(),
        }
    }
}

/// A bearing cage, a belt, mains hum: motion to and fro at an order that is not whole, its phase random in each capture.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineConfig {
    /// Periods per turn, not a whole number.
    pub order: f64,
    /// In µm.
    pub amplitude_um: f64,
    /// Direction of the motion about +z from x, in degrees.
    #[serde(default)]
    pub direction_deg: f64,
}

/// Motion to and fro along the axis at an order that is not whole, its phase random in each capture.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxialLineConfig {
    /// Periods per turn, not a whole number.
    pub order: f64,
    /// In µm.
    pub amplitude_um: f64,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

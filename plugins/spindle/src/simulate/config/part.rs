//! The part: its form, its keyways and its faces.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MotionHarmonic;

/// `[form]`: deviation of the part from a perfect cylinder, one function of angle and z.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FormConfig {
    /// Root mean square of the random form over all sections that are measured, in µm.
    pub rms_um: f64,
    /// The random form has orders 2 to this one.
    pub max_order: usize,
    /// Amplitudes fall with order^-slope.
    pub slope: f64,
    /// Part of the mean square that changes along z, 0 to 1; the rest is shared by all sections.
    pub own_share: f64,
    /// Wavelength of the changes along z, in mm.
    pub wavelength_mm: f64,
    /// Harmonics in addition.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub harmonics: Vec<FormHarmonic>,
    /// A measured profile in addition, the same at every z: a CSV file with columns `angle_deg` and `form_um`, relative to
    /// the scenario. Its orders 2 to `max_order` are taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<PathBuf>,
    /// Grooves along the part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keyways: Vec<Keyway>,
}

impl Default for FormConfig {
    fn default() -> Self {
        Self {
            rms_um: 0.0,
            max_order: 60,
            slope: 1.0,
            own_share: 0.3,
            wavelength_mm: 200.0,
            harmonics: Vec::new(),
            measured: None,
            keyways: Vec::new(),
        }
    }
}

/// A groove along the whole part: readings are lower by its depth while a sensor's line lies in it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Keyway {
    /// The part's own angle at which it begins, in degrees.
    pub from_deg: f64,
    /// The angle at which it ends, in degrees; with `from_deg` above, it passes through 0.
    pub to_deg: f64,
    /// In µm.
    pub depth_um: f64,
}

/// amplitude · cos(order·α + phase + twist·z), α the part's angle.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FormHarmonic {
    /// Undulations per turn, 2 or more.
    pub order: usize,
    /// In µm.
    pub amplitude_um: f64,
    /// In degrees.
    #[serde(default)]
    pub phase_deg: f64,
    /// How fast the phase advances along z, in degrees per mm.
    #[serde(default)]
    pub twist_deg_per_mm: f64,
}

/// `[[face]]`: deviation of a face from a plane square to the part's axis, along the circle under its axial sensors, positive
/// towards +z. On the axis it is what the spot there adds over a turn, which each clamping turns by an angle of its own.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceConfig {
    /// Id of its section in the rig.
    pub section: String,
    /// Root mean square of the random form, in µm.
    #[serde(default)]
    pub rms_um: f64,
    /// The random form has orders 2 to this one.
    #[serde(default = "usual_face_orders")]
    pub max_order: usize,
    /// Amplitudes fall with order^-slope.
    #[serde(default = "usual_slope")]
    pub slope: f64,
    /// Harmonics in addition, amplitude · cos(order·α + phase), α the part's angle; order 1 on the axis only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub harmonics: Vec<MotionHarmonic>,
}

impl Default for FaceConfig {
    fn default() -> Self {
        let (max_order, slope) = (usual_face_orders(), usual_slope());
        Self { section: String::new(), rms_um: 0.0, max_order, slope, harmonics: Vec::new() }
    }
}

fn usual_face_orders() -> usize {
    20
}

fn usual_slope() -> f64 {
    1.0
}

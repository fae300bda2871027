//! The part's surface: form over angle and z, from sections at many stations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Error, Result, pipeline::error::Fault, pipeline::run::StationResult};

/// `[surface]`: how sections become a surface.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceConfig {
    /// Equally spaced angles around the part.
    #[serde(default = "default_angles")]
    pub angles: usize,
    /// Distance of the surface's rings along z, in mm; without it the sections themselves are the rings.
    #[serde(default)]
    pub step_mm: Option<f64>,
}

fn default_angles() -> usize {
    720
}

impl Default for SurfaceConfig {
    fn default() -> Self {
        Self { angles: default_angles(), step_mm: None }
    }
}

impl SurfaceConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn check(self) -> std::result::Result<Self, Fault> {
        if !(8..=36_000).contains(&self.angles) {
            return Err(Fault::at("angles", format!("expected 8 to 36000 angles, found {}", self.angles)));
        }
        match self.step_mm {
            Some(step) if !(step.is_finite() && step > 0.0) => {
                Err(Fault::at("step_mm", format!("the step must be above 0 mm, found {step}")))
            }
            _ => Ok(self),
        }
    }
}

/// Form over (angle, z), on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Nominal radius that the deviation is added to, in mm.
    pub radius_mm: f64,
    /// Equally spaced angles around the part, from 0 (the part's own angle).
    pub angles: usize,
    /// Ascending positions of the rings, in mm.
    pub z_mm: Vec<f64>,
    /// Deviation from the nominal radius in µm, `[ring][angle]`.
    pub deviation_um: Vec<f64>,
    /// How the rings were filled between the sections.
    pub interpolation: &'static str,
    /// Places where sections of different sensors meet.
    pub meetings: Vec<Meeting>,
}

/// Two sections that were measured at the same z by different sensors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Meeting {
    /// Where, in mm.
    pub z_mm: f64,
    /// Section ids with their stations, `a@s31`.
    pub sections: [String; 2],
    /// Root mean square of their difference, in µm.
    pub rms_um: f64,
    /// Largest difference, in µm.
    pub max_um: f64,
    /// What their uncertainties let expect of the rms, in µm; absent where unknown.
    pub expected_rms_um: Option<f64>,
}

impl Surface {
    /// Deviations of one ring.
    #[must_use]
    pub fn ring(&self, ring: usize) -> &[f64] {
        &self.deviation_um[ring * self.angles..(ring + 1) * self.angles]
    }
}

/// Collects sections as stations come in.
#[derive(Debug, Default)]
pub struct SurfaceBuilder {}

impl SurfaceBuilder {
    /// For one configuration.
    #[must_use]
    pub fn new(_config: &SurfaceConfig) -> Self {
        Self {}
    }

    /// Adds a station's sections.
    pub fn add(&mut self, _result: &StationResult) {}

    /// The surface.
    ///
    /// # Errors
    /// With fewer than two sections along z.
    pub fn build(self, _radius_mm: f64) -> Result<Surface> {
        Err(Error::new("build", "the surface", "not yet"))
    }
}

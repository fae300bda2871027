//! What error motion is evaluated about and at: centres of polar plots, places of a face.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error_motion::Centre;
use runout_error::fault::Fault;
use runout_standards::roundness::Reference;
use runout_turning::azimuth::FacePlace;

/// A place of a face.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FacePlaceConfig {
    /// Distance from the axis, in mm.
    pub radius_mm: f64,
    /// Angle from x towards y, in degrees.
    pub angle_deg: f64,
}

impl FacePlaceConfig {
    pub(super) fn check(&self) -> Result<FacePlace, Fault> {
        if !(self.radius_mm.is_finite() && self.radius_mm > 0.0) {
            let message = format!("a place of a face is above 0 mm from the axis, found {}", self.radius_mm);
            return Err(Fault::at("radius_mm", message).help("on the axis, face error motion is axial error motion"));
        }
        if !self.angle_deg.is_finite() || self.angle_deg.abs() >= 360.0 {
            let message = format!("the angle must lie between -360 and 360 degrees, found {}", self.angle_deg);
            return Err(Fault::at("angle_deg", message));
        }
        Ok(FacePlace::of(self.radius_mm, self.angle_deg.to_radians()))
    }
}

/// A centre of a polar plot (ISO 230-7) as it stands in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "UPPERCASE")]
#[non_exhaustive]
pub enum CentreConfig {
    /// The centre of the polar chart.
    Pc,
    /// Least squares.
    Lsc,
    /// Minimum zone; other texts call it MRS.
    Mzc,
    /// Maximum inscribed circle.
    Mic,
    /// Minimum circumscribed circle.
    Mcc,
}

impl From<CentreConfig> for Centre {
    fn from(centre: CentreConfig) -> Self {
        match centre {
            CentreConfig::Pc => Self::PolarChart,
            CentreConfig::Lsc => Self::Plot(Reference::LeastSquares),
            CentreConfig::Mzc => Self::Plot(Reference::MinimumZone),
            CentreConfig::Mic => Self::Plot(Reference::MaximumInscribed),
            CentreConfig::Mcc => Self::Plot(Reference::MinimumCircumscribed),
        }
    }
}

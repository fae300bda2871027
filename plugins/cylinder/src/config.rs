//! `[separate] plugin = "least-squares-cylinder"` of a file.

use runout_core::fault::{Fault, within};
use schemars::JsonSchema;
use serde::Deserialize;

/// `[separate] plugin = "least-squares-cylinder"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeastSquaresCylinderConfig {
    /// Nominal radius that the deviations are measured from, in mm.
    pub radius_mm: f64,
    /// Traces to use, by kind or id; each must go round the part. Without it those of the kinds circle and helix.
    #[serde(default, rename = "use")]
    pub used: Option<Vec<String>>,
    /// Traces to hold out although `use` names them, by kind or id. The surface has to predict whatever is not used.
    #[serde(default)]
    pub hold_out: Vec<String>,
    /// Highest order (undulations per revolution) fitted to each circle. An arc without points, or few points, may limit it
    /// further.
    #[serde(default = "default_max_order")]
    pub max_order: usize,
    /// Leaves out points further than this many median absolute deviations from the fit of their circle, and counts them. Without it
    /// every point stays, and those that are not like the others are named.
    #[serde(default)]
    pub outlier_mad: Option<f64>,
    /// Highest order of the fit that points are compared with where `outlier_mad` leaves some out, whatever `max_order` is.
    #[serde(default = "default_outlier_order")]
    pub outlier_order: usize,
    /// Highest order of lobes that `diagnose` may add.
    #[serde(default = "default_max_lobes")]
    pub max_lobes: usize,
}

fn default_max_order() -> usize {
    50
}

fn default_outlier_order() -> usize {
    50
}

fn default_max_lobes() -> usize {
    8
}

/// Above this, one circle's matrix alone would take gigabytes.
const HIGHEST_ORDER: usize = 2_000;
/// Each order of lobes is a candidate of its own for `diagnose`.
const HIGHEST_LOBES: usize = 100;

impl LeastSquaresCylinderConfig {
    /// The first value that cannot be, with its key.
    pub(crate) fn check_values(&self) -> Result<(), Fault> {
        if !(self.radius_mm.is_finite() && self.radius_mm > 0.0) {
            return Err(Fault::at("radius_mm", format!("the radius must be above 0 mm, found {}", self.radius_mm)));
        }
        if self.used.as_ref().is_some_and(Vec::is_empty) {
            return Err(Fault::at("use", "expected at least one kind or trace").help("use = [\"circle\"]"));
        }
        within("max_order", "an order", self.max_order, 2..=HIGHEST_ORDER)?;
        within("outlier_order", "an order", self.outlier_order, 2..=HIGHEST_ORDER)?;
        within("max_lobes", "an order", self.max_lobes, 2..=HIGHEST_LOBES)?;
        if let Some(outlier_mad) = self.outlier_mad.filter(|deviations| !(deviations.is_finite() && *deviations >= 1.0))
        {
            let message = format!("expected at least 1 (half of the points lie nearer), found {outlier_mad}");
            return Err(Fault::at("outlier_mad", message).help("without the key every point is kept"));
        }
        Ok(())
    }
}

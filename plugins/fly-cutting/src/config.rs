//! `[separate] plugin = "fly-cutting"`.

use runout_core::fault::Fault;
use schemars::JsonSchema;
use serde::Deserialize;

/// `[separate] plugin = "fly-cutting"`: how the surface was cut. x runs along the feed, y = 0 below the spindle's axis.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlyCuttingConfig {
    /// Radius of the tool's nose, in mm.
    pub nose_radius_mm: f64,
    /// Feed, in µm per revolution.
    pub feed_um_per_rev: f64,
    /// Distance of the tool from the spindle's axis, in mm.
    pub cutter_radius_mm: f64,
    /// Speed, in revolutions per minute: gives lines their frequency in Hz.
    pub speed_rpm: f64,
    /// Standard uncertainty of a height, in nm, where it is not that of the file.
    #[serde(default)]
    pub std_nm: Option<f64>,
    /// Highest frequency of a line, in periods per turn. A line at y = 0 looks the same at all ratios that differ by whole numbers.
    #[serde(default = "default_highest_ratio")]
    pub max_frequency_ratio: usize,
}

fn default_highest_ratio() -> usize {
    10
}

/// Highest value of `max_frequency_ratio`.
const HIGHEST_RATIO: usize = 200;

impl FlyCuttingConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub(crate) fn checked(&self) -> Result<(), Fault> {
        let positive = |key: &str, unit: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(Fault::at(key, format!("expected a number above 0 {unit}, found {value}")))
        };
        positive("nose_radius_mm", "mm", self.nose_radius_mm)?;
        positive("feed_um_per_rev", "µm", self.feed_um_per_rev)?;
        positive("cutter_radius_mm", "mm", self.cutter_radius_mm)?;
        positive("speed_rpm", "rpm", self.speed_rpm)?;
        if let Some(std_nm) = self.std_nm {
            positive("std_nm", "nm", std_nm)?;
        }
        if 1e-3 * self.feed_um_per_rev >= self.nose_radius_mm {
            let problem = format!(
                "a feed of {} µm is not below the nose radius of {} mm: is it in µm per revolution?",
                self.feed_um_per_rev, self.nose_radius_mm
            );
            return Err(Fault::at("feed_um_per_rev", problem));
        }
        if !(1..=HIGHEST_RATIO).contains(&self.max_frequency_ratio) {
            let problem = format!("expected 1 to {HIGHEST_RATIO}, found {}", self.max_frequency_ratio);
            return Err(Fault::at("max_frequency_ratio", problem));
        }
        Ok(())
    }
}

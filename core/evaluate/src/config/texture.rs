//! `[evaluate.texture]`: what texture values are of.

use schemars::JsonSchema;
use serde::Deserialize;

use super::once_each;
use runout_error::fault::Fault;
use runout_standards::texture::Kind;

/// `[evaluate.texture]`: which profiles have texture values, and what the standard leaves to the one who evaluates.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct TextureConfig {
    /// Profiles: R (roughness, λs to λc), P (primary, from λs on), W (waviness, λc to λf). Without it R. R and W need λc.
    pub profiles: Option<Vec<Kind>>,
    /// λf, the longest wavelength of W, in mm; without it W has all that is longer than λc.
    pub lambda_f_mm: Option<f64>,
    /// Heights above the mean line, in µm, at which the material ratio Rmr(c), Pmr(c), Wmr(c) is given.
    pub heights_um: Option<Vec<f64>>,
    /// Material ratios p and q of Rdc, Pdc, Wdc, in %; without it 20 and 80.
    pub rdc_percent: Option<[f64; 2]>,
    /// Angles of the part, in degrees, at which the profiles are taken along the axis too, from section to section.
    pub generatrices_deg: Option<Vec<f64>>,
}

impl TextureConfig {
    pub(super) fn check(self, lambda_s_mm: Option<f64>, lambda_c_mm: Option<f64>) -> Result<Texture, Fault> {
        let usual = Texture::default();
        let profiles = once_each(self.profiles.unwrap_or_else(|| usual.profiles.clone()));
        if profiles.is_empty() {
            return Err(Fault::at("profiles", "expected at least one of R, P, W"));
        }
        if lambda_c_mm.is_none() && profiles.contains(&Kind::W) {
            return Err(Fault::at("profiles", "a waviness profile needs λc").help("add `lambda_c_mm` to [evaluate]"));
        }
        if lambda_s_mm.is_some() && lambda_c_mm.is_none() && !profiles.contains(&Kind::P) {
            let help = "add `lambda_c_mm`, or P to `profiles` in [evaluate.texture]";
            return Err(Fault::here("λs alone makes no roughness profile").help(help));
        }
        if let Some(longest) = self.lambda_f_mm {
            let shortest = lambda_c_mm.unwrap_or(0.0);
            if !(longest.is_finite() && longest > shortest) {
                let message = format!("λf must be longer than λc = {shortest} mm, found {longest}");
                return Err(Fault::at("lambda_f_mm", message));
            }
        }
        let heights_um = self.heights_um.unwrap_or_default();
        if let Some((index, height)) = heights_um.iter().enumerate().find(|(_, height)| !height.is_finite()) {
            let fault = Fault::here(format!("expected a finite height in µm, found {height}"));
            return Err(fault.under_item("heights_um", index));
        }
        let generatrices_deg = once_each(self.generatrices_deg.unwrap_or_default());
        if let Some((index, angle)) = generatrices_deg.iter().enumerate().find(|(_, angle)| !angle.is_finite()) {
            let fault = Fault::here(format!("expected an angle in degrees, found {angle}"));
            return Err(fault.under_item("generatrices_deg", index));
        }
        let difference_percent = self.rdc_percent.unwrap_or(usual.difference_percent);
        let [upper, lower] = difference_percent;
        if !(upper >= 0.0 && upper < lower && lower <= 100.0) {
            let message = format!("expected two material ratios from 0 to 100 %, ascending, found {upper} and {lower}");
            return Err(Fault::at("rdc_percent", message));
        }
        Ok(Texture { profiles, lambda_f_mm: self.lambda_f_mm, heights_um, difference_percent, generatrices_deg })
    }
}

/// What texture values are of, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Texture {
    pub profiles: Vec<Kind>,
    pub lambda_f_mm: Option<f64>,
    pub heights_um: Vec<f64>,
    pub difference_percent: [f64; 2],
    pub generatrices_deg: Vec<f64>,
}

impl Default for Texture {
    fn default() -> Self {
        let (heights_um, generatrices_deg) = (Vec::new(), Vec::new());
        Self {
            profiles: vec![Kind::R],
            lambda_f_mm: None,
            heights_um,
            difference_percent: [20.0, 80.0],
            generatrices_deg,
        }
    }
}

//! `[evaluate.areal]`: how areal values are made of a surface.

use schemars::JsonSchema;
use serde::Deserialize;

use runout_error::fault::Fault;

/// `[evaluate.areal]`: form removal, filter and material ratios of areal values.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct ArealConfig {
    /// F-operator: what is taken off before the filters; without it `cylinder`.
    pub form: Option<FormRemoval>,
    /// Degree of `polynomial` along the axis, 0 to 8; without it 2.
    pub degree: Option<usize>,
    /// The filter of λs and λc; without it `gaussian`.
    pub filter: Option<ArealFilter>,
    /// Heights above the mean, in µm, at which the material ratio Smr(c) is given.
    pub heights_um: Option<Vec<f64>>,
    /// Material ratios, in %, at which the height Smc(p) above the mean is given.
    pub ratios_percent: Option<Vec<f64>>,
}

/// What the F-operator takes off a wall, by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FormRemoval {
    /// Nothing but the mean.
    None,
    /// A line along the axis, the same all around: radius and taper. Of a height map its plane, without the key.
    Plane,
    /// A cylinder: radius, place and tilt of its axis.
    Cylinder,
    /// A cone: a cylinder and its taper.
    Cone,
    /// A body whose radius and centre are polynomials along the axis. Of a height map a polynomial in x and y of a total degree.
    Polynomial,
}

/// The filter of areal values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ArealFilter {
    /// ISO 16610-61.
    #[default]
    Gaussian,
    /// ISO 16610-71: scratches and grooves do not pull it. It states no uncertainty.
    RobustGaussian,
}

impl ArealConfig {
    pub(super) fn check(self) -> Result<Areal, Fault> {
        let usual = Areal::default();
        let degree = self.degree.unwrap_or(usual.degree);
        if degree > HIGHEST_DEGREE {
            return Err(Fault::at("degree", format!("expected a degree from 0 to {HIGHEST_DEGREE}, found {degree}")));
        }
        if self.degree.is_some() && self.form != Some(FormRemoval::Polynomial) {
            return Err(Fault::at("degree", "only a polynomial has a degree").help("set `form = \"polynomial\"`"));
        }
        let (heights_um, ratios_percent) =
            (self.heights_um.unwrap_or_default(), self.ratios_percent.unwrap_or_default());
        if let Some((index, height)) = heights_um.iter().enumerate().find(|(_, height)| !height.is_finite()) {
            let fault = Fault::here(format!("expected a finite height in µm, found {height}"));
            return Err(fault.under_item("heights_um", index));
        }
        if let Some((index, ratio)) =
            ratios_percent.iter().enumerate().find(|(_, ratio)| !(0.0..=100.0).contains(*ratio))
        {
            let fault = Fault::here(format!("expected a material ratio from 0 to 100 %, found {ratio}"));
            return Err(fault.under_item("ratios_percent", index));
        }
        let (form, filter) = (self.form.unwrap_or(usual.form), self.filter.unwrap_or_default());
        Ok(Areal { form, degree, filter, heights_um, ratios_percent })
    }
}

/// Highest degree of a polynomial form.
const HIGHEST_DEGREE: usize = 8;

/// How areal values are made of the surface, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Areal {
    pub form: FormRemoval,
    pub degree: usize,
    pub filter: ArealFilter,
    pub heights_um: Vec<f64>,
    pub ratios_percent: Vec<f64>,
}

impl Default for Areal {
    fn default() -> Self {
        let (heights_um, ratios_percent) = (Vec::new(), Vec::new());
        Self { form: FormRemoval::Cylinder, degree: 2, filter: ArealFilter::Gaussian, heights_um, ratios_percent }
    }
}

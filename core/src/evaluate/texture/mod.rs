//! Profile surface texture (ISO 21920-2:2021), around the part and along z.
//!
//! A profile is filtered by λs and λc (Gaussian, ISO 16610-21 and -28), referred to the mean of what is left, and
//! evaluated over its whole length: the circumference, or a generatrix from its first to its last point. Ra, Rq, Rt, Rsk
//! and Rku are of the evaluation length; Rp, Rv and Rz are means over the section lengths, as in the edition of 2021
//! (ISO 4287:1997 defined them, and Ra and Rq, on one sampling length). Missing points (NaN) are left out and counted.

mod elements;
mod profile;

use super::parameter::Parameter;
use crate::numerics::filter::{Degree, Smoother, upr};
use profile::Profile;

/// Nesting indices and section length.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// λs, the S-filter's cut-off: shorter wavelengths are left out. `None`: none are.
    pub lambda_s_mm: Option<f64>,
    /// λc, the L-filter's cut-off: longer wavelengths are left out. `None`: only the mean is.
    pub lambda_c_mm: Option<f64>,
    /// Section length lsc; `None`: λc, as ISO 21920-3 has it, or without λc a fifth of the length.
    pub section_mm: Option<f64>,
}

/// Texture of one profile. Heights in µm about the mean line; NaN where the profile does not have the value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    /// Arithmetic mean of |z|.
    pub ra: f64,
    /// Root mean square.
    pub rq: f64,
    /// Mean over the sections of the highest peak.
    pub rp: f64,
    /// Mean over the sections of the deepest pit, positive.
    pub rv: f64,
    /// Mean over the sections of their height.
    pub rz: f64,
    /// Height over the whole length.
    pub rt: f64,
    /// Skewness.
    pub rsk: f64,
    /// Kurtosis.
    pub rku: f64,
    /// Mean spacing of the profile elements, in mm: a hill and the dale beside it, from one crossing of the mean line to
    /// the next but one, mean of both directions. Hills lower than 10 % of Rp and dales less deep than 10 % of Rv are
    /// none (ISO 21920-2), nor are those narrower than 1 % of a section (ISO 4287:1997).
    pub rsm_mm: f64,
    /// Root mean square gradient, by differences over seven points; on equal distances only.
    pub rdq: f64,
    /// Points evaluated.
    pub points: usize,
    /// Points missing.
    pub missing: usize,
    /// Sections of equal length, each at least the section length asked for where the profile is as long.
    pub sections: usize,
    /// Their length.
    pub section_mm: f64,
}

/// Symbol, unit and clause of every value, in the order of [`Texture::parameters`].
pub const PARAMETERS: [(&str, &str, &str); 10] = [
    ("Ra", "µm", "field parameters"),
    ("Rq", "µm", "field parameters"),
    ("Rsk", "", "field parameters"),
    ("Rku", "", "field parameters"),
    ("Rt", "µm", "field parameters"),
    ("Rdq", "", "field parameters"),
    ("Rp", "µm", "feature parameters"),
    ("Rv", "µm", "feature parameters"),
    ("Rz", "µm", "feature parameters"),
    ("Rsm", "mm", "feature parameters"),
];

/// Texture of a closed profile on equal angles of a part with a radius.
#[must_use]
pub fn around(form_um: &[f64], radius_mm: f64, settings: &Settings) -> Texture {
    let smoother = |wavelength_mm: f64| Smoother::closed(form_um.len(), upr(wavelength_mm, radius_mm), Degree::One);
    let heights = filtered(form_um, settings, smoother);
    let length_mm = std::f64::consts::TAU * radius_mm;
    let spacing = length_mm / form_um.len() as f64;
    let positions: Vec<f64> = (0..form_um.len()).map(|point| point as f64 * spacing).collect();
    Profile::new(&positions, heights, Some(length_mm)).texture(settings)
}

/// Texture along a line on ascending positions, such as a generatrix on a surface's rings. Spacings may differ: a point
/// then counts as much as it stands for.
#[must_use]
pub fn along(z_mm: &[f64], profile_um: &[f64], settings: &Settings) -> Texture {
    let count = z_mm.len().min(profile_um.len());
    let (z_mm, profile_um) = (&z_mm[..count], &profile_um[..count]);
    let heights = filtered(profile_um, settings, |wavelength_mm| Smoother::open(z_mm, wavelength_mm, Degree::One));
    Profile::new(z_mm, heights, None).texture(settings)
}

fn filtered(profile_um: &[f64], settings: &Settings, smoother: impl Fn(f64) -> Smoother) -> Vec<f64> {
    let mut heights = match settings.lambda_s_mm {
        Some(wavelength) => smoother(wavelength).low_pass(profile_um, None),
        None => profile_um.to_vec(),
    };
    if let Some(wavelength) = settings.lambda_c_mm {
        let waviness = smoother(wavelength).low_pass(&heights, None);
        heights.iter_mut().zip(waviness).for_each(|(height, waviness)| *height -= waviness);
    }
    heights
}

impl Texture {
    /// Every value with symbol, unit and clause.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let values = [self.ra, self.rq, self.rsk, self.rku, self.rt, self.rdq, self.rp, self.rv, self.rz, self.rsm_mm];
        let named = PARAMETERS.iter().zip(values);
        named.map(|((symbol, unit, clause), value)| Parameter::new(symbol, unit, clause, value)).collect()
    }
}

/// Arithmetic mean deviation Ra in µm: the mean absolute deviation of the unfiltered circumferential profile about its
/// mean line, as Qiao, Xu, Zhao (2024) compute it. It is not ISO 21920-2's Ra, which is taken after λs and λc. Missing
/// points (NaN) are left out.
#[must_use]
pub fn ra_um(form_um: &[f64]) -> f64 {
    let sum = sum_of(form_um, |value| value);
    if sum.is_finite() {
        let count = form_um.len() as f64;
        let mean = sum / count;
        return sum_of(form_um, |value| (value - mean).abs()) / count;
    }
    let there = || form_um.iter().filter(|value| !value.is_nan());
    let count = there().count() as f64;
    let mean = there().sum::<f64>() / count;
    there().map(|value| (value - mean).abs()).sum::<f64>() / count
}

/// A sum over lanes that do not wait for each other: Monte Carlo asks for this many thousand times.
fn sum_of(values: &[f64], term: impl Fn(f64) -> f64) -> f64 {
    let mut sums = [0.0; 8];
    for chunk in values.chunks(8) {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += term(*value);
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests;

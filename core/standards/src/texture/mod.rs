//! Profile surface texture (ISO 21920-2:2021), around the part and along z.
//!
//! A profile is filtered by λs and λc (Gaussian, ISO 16610-21 and -28), referred to the mean of what is left, and
//! evaluated over its whole length: the circumference, or a generatrix without the ends at which a filter is incomplete.
//! Ra, Rq, Rt, Rsk and Rku are of the evaluation length; Rp, Rv and Rz are means over the section lengths, as in the edition
//! of 2021 (ISO 4287:1997 defined them, and Ra and Rq, on one sampling length). Missing points (NaN) are left out and counted. A gap of a
//! line is no length: stretches beside it are lines of their own.

#![allow(clippy::inline_always, reason = "see crate::numerics::lanes")]

mod elements;
mod line;
mod profile;
mod values;

use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{areal::MaterialRatio, parameter::Parameter};
use line::Line;
use profile::{AT_AN_END, Profile, Stretch};
use runout_numerics::{
    filter::{Degree, Smoother, upr},
    lanes::{NullaryFnOnce, vectorised},
};

/// Which wavelengths a profile has (ISO 21920-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
pub enum Kind {
    /// The primary profile: all wavelengths from λs on.
    P,
    /// The waviness profile: from λc to λf.
    W,
    /// The roughness profile: from λs to λc.
    #[default]
    R,
}

/// Nesting indices and section length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which profile is made of the one given, where the evaluation filters it.
    pub kind: Kind,
    /// λs, the S-filter's cut-off: shorter wavelengths are left out. `None`: none are.
    pub lambda_s_mm: Option<f64>,
    /// λc, the L-filter's cut-off: longer wavelengths are left out of R, shorter ones of W. `None`: only the mean is.
    pub lambda_c_mm: Option<f64>,
    /// λf, the cut-off of W's L-filter: longer wavelengths are left out of W. `None`: only the mean is.
    pub lambda_f_mm: Option<f64>,
    /// Section length lsc; `None`: λc, as ISO 21920-3 has it, or without λc a fifth of the length.
    pub section_mm: Option<f64>,
    /// Material ratios p and q of Rdc, in %.
    pub difference_percent: [f64; 2],
}

impl Default for Settings {
    fn default() -> Self {
        let (kind, lambda_s_mm, lambda_c_mm, lambda_f_mm, section_mm) = (Kind::R, None, None, None, None);
        Self { kind, lambda_s_mm, lambda_c_mm, lambda_f_mm, section_mm, difference_percent: [20.0, 80.0] }
    }
}

/// Texture of one profile. Heights in µm about the mean line; NaN where the profile does not have the value. Named for the
/// roughness profile; of the others, the first letter is P or W.
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
    /// The largest of the sections' heights.
    pub rz1max: f64,
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
    /// Mean height of the same elements: the hill's height and the dale's depth.
    pub rc: f64,
    /// Root mean square gradient, by differences over seven points; on equal distances only.
    pub rdq: f64,
    /// Of the material ratio curve: core height, reduced peak height, reduced pit depth (ISO 21920-2; Rk, Rpk, Rvk of
    /// ISO 13565-2, on the profile as it is filtered here).
    pub rk: f64,
    /// Reduced peak height.
    pub rpk: f64,
    /// Reduced pit depth.
    pub rvk: f64,
    /// Material ratio of the hills in % (Mr1 of ISO 13565-2).
    pub rmrk1_percent: f64,
    /// Material ratio of the dales in % (Mr2 of ISO 13565-2).
    pub rmrk2_percent: f64,
    /// Difference of the heights at two material ratios.
    pub rdc: f64,
    /// Points evaluated.
    pub points: usize,
    /// Points missing.
    pub missing: usize,
    /// Sections of equal length, each at least the section length asked for where the profile is as long.
    pub sections: usize,
    /// Their length.
    pub section_mm: f64,
    /// Length at each end that was left out, because the filter lacks half of its Gaussian there (ISO 16610-28).
    pub cropped_mm: f64,
}

/// Number of [`Texture::parameters`].
pub const COUNT: usize = 19;

/// Symbol, unit and clause of every value of a profile with this letter.
macro_rules! parameters {
    ($letter:literal) => {
        [
            (concat!($letter, "a"), "µm", "field parameters"),
            (concat!($letter, "q"), "µm", "field parameters"),
            (concat!($letter, "sk"), "", "field parameters"),
            (concat!($letter, "ku"), "", "field parameters"),
            (concat!($letter, "t"), "µm", "field parameters"),
            (concat!($letter, "dq"), "", "field parameters"),
            (concat!($letter, "p"), "µm", "feature parameters"),
            (concat!($letter, "v"), "µm", "feature parameters"),
            (concat!($letter, "z"), "µm", "feature parameters"),
            (concat!($letter, "sm"), "mm", "feature parameters"),
            (concat!($letter, "z1max"), "µm", "feature parameters"),
            (concat!($letter, "c"), "µm", "feature parameters"),
            (concat!($letter, "Pc"), "1/cm", "feature parameters"),
            (concat!($letter, "k"), "µm", "material ratio curve"),
            (concat!($letter, "pk"), "µm", "material ratio curve"),
            (concat!($letter, "vk"), "µm", "material ratio curve"),
            (concat!($letter, "mrk1"), "%", "material ratio curve"),
            (concat!($letter, "mrk2"), "%", "material ratio curve"),
            (concat!($letter, "dc"), "µm", "material ratio curve"),
        ]
    };
}

/// Symbol, unit and clause of every value of a roughness profile, in the order of [`Texture::parameters`].
pub const PARAMETERS: [(&str, &str, &str); COUNT] = parameters!("R");
const OF_PRIMARY: [(&str, &str, &str); COUNT] = parameters!("P");
const OF_WAVINESS: [(&str, &str, &str); COUNT] = parameters!("W");

impl Kind {
    /// Symbol, unit and clause of every value, in the order of [`Texture::parameters`].
    #[must_use]
    pub fn parameters(self) -> &'static [(&'static str, &'static str, &'static str); COUNT] {
        match self {
            Self::P => &OF_PRIMARY,
            Self::W => &OF_WAVINESS,
            Self::R => &PARAMETERS,
        }
    }

    /// The first letter of its symbols.
    #[must_use]
    pub fn letter(self) -> char {
        match self {
            Self::P => 'P',
            Self::W => 'W',
            Self::R => 'R',
        }
    }

    /// Symbol of the material ratio at a height.
    #[must_use]
    pub fn material_ratio_symbol(self) -> &'static str {
        match self {
            Self::P => "Pmr(c)",
            Self::W => "Wmr(c)",
            Self::R => "Rmr(c)",
        }
    }
}

/// Texture of a closed profile on equal angles of a part with a radius.
#[must_use]
pub fn around(form_um: &[f64], radius_mm: f64, settings: &Settings) -> Texture {
    closed(form_um, radius_mm, settings, true)
}

/// Texture of a closed profile on equal angles of a part with a radius, without what elements and the material ratio curve give
/// (Rsm, Rc, Rk, Rpk, Rvk, Rmrk1, Rmrk2, Rdc are NaN), in a fraction of the time.
#[must_use]
pub fn heights_around(form_um: &[f64], radius_mm: f64, settings: &Settings) -> Texture {
    closed(form_um, radius_mm, settings, false)
}

/// All values of a closed profile, or those of its heights.
fn closed(form_um: &[f64], radius_mm: f64, settings: &Settings, all: bool) -> Texture {
    let smoother = |wavelength_mm: f64| Smoother::closed(form_um.len(), upr(wavelength_mm, radius_mm), Degree::One);
    let heights = filtered(form_um, settings, smoother);
    let length_mm = std::f64::consts::TAU * radius_mm;
    let spacing = length_mm / form_um.len() as f64;
    let positions: Vec<f64> = (0..form_um.len()).map(|point| point as f64 * spacing).collect();
    let profile = Profile::closed(&positions, heights, length_mm);
    if all { profile.texture(settings) } else { profile.heights(settings) }
}

/// Texture along a line on ascending positions, such as a generatrix on a surface's rings. Spacings may differ: a point
/// then counts as much as it stands for. Half of the longest cut-off is left out at each end where half of the line
/// remains: there the filter has only a part of its Gaussian. Of a line with [gaps](runout_numerics::stretches) longer than a tenth of a
/// section, each stretch that has a whole section between such ends is a line of its own, and the others are left out: without any, all
/// values are NaN.
#[must_use]
pub fn along(z_mm: &[f64], profile_um: &[f64], settings: &Settings) -> Texture {
    let line = Line::new(z_mm, profile_um, settings);
    let half_mm = half_cut_off_mm(settings);
    let cropped_mm = if line.has_gaps() { half_mm } else { end_effect_mm(z_mm, half_mm) };
    let stretch = |points: &Range<usize>| {
        let positions = &z_mm[points.clone()];
        let smoother = |wavelength_mm: f64| Smoother::open(positions, wavelength_mm, Degree::One);
        let heights = filtered(&profile_um[points.clone()], settings, smoother);
        let (first, last) = (positions.first().copied().unwrap_or(0.0), positions.last().copied().unwrap_or(0.0));
        let off_mm = AT_AN_END * (last - first) / positions.len().max(1) as f64;
        let from = positions.partition_point(|z| *z < first + cropped_mm - off_mm);
        let to = positions.partition_point(|z| *z <= last - cropped_mm + off_mm);
        Stretch { positions_mm: positions[from..to].to_vec(), heights_um: heights[from..to].to_vec() }
    };
    let found = Profile::open(line.long_enough().iter().map(stretch).collect()).texture(settings);
    Texture { cropped_mm, ..found }
}

/// What the values of a line with gaps are of; `None` of a line without.
#[must_use]
pub fn over_gaps(z_mm: &[f64], profile_um: &[f64], settings: &Settings) -> Option<String> {
    let line = Line::new(z_mm, profile_um, settings);
    if !line.has_gaps() {
        return None;
    }
    let gap = |pair: &[Range<usize>]| format!("{} to {} mm", z_mm[pair[0].end - 1], z_mm[pair[1].start]);
    let gaps: Vec<String> = line.stretches.windows(2).map(gap).collect();
    let kept = line.long_enough();
    let of = match kept.len() {
        0 => "no stretch is as long as a section and the ends where the filter is incomplete: there are no values"
            .to_owned(),
        count => {
            let long_mm: f64 = kept.iter().map(|points| line.length_mm(points)).sum();
            format!("values are of {count} of {} stretches, {long_mm:.3} mm long", line.stretches.len())
        }
    };
    Some(format!("nothing was measured from {}; {of}", gaps.join(", from ")))
}

/// Half of the longest cut-off.
fn half_cut_off_mm(settings: &Settings) -> f64 {
    let longest = match settings.kind {
        Kind::P => None,
        Kind::R => settings.lambda_c_mm,
        Kind::W => settings.lambda_f_mm.or(settings.lambda_c_mm),
    };
    0.5 * longest.or(settings.lambda_s_mm).unwrap_or(0.0)
}

/// Length at each end of a line over which the filters lack more than 1 % of their Gaussian: half of the longest cut-off
/// (ISO 16610-28). 0 without filters, and where less than half of the line would be left.
fn end_effect_mm(z_mm: &[f64], half: f64) -> f64 {
    let [first, .., last] = *z_mm else { return 0.0 };
    if last - first >= 4.0 * half { half } else { 0.0 }
}

fn filtered(profile_um: &[f64], settings: &Settings, smoother: impl Fn(f64) -> Smoother) -> Vec<f64> {
    let low_pass = |heights: &[f64], wavelength_mm: f64| smoother(wavelength_mm).low_pass(heights, None);
    let without = |heights: &mut [f64], longer: Vec<f64>| {
        heights.iter_mut().zip(longer).for_each(|(height, longer)| *height -= longer);
    };
    let mut heights = match settings.lambda_s_mm {
        Some(wavelength) => low_pass(profile_um, wavelength),
        None => profile_um.to_vec(),
    };
    match (settings.kind, settings.lambda_c_mm) {
        (Kind::R, Some(wavelength)) => {
            let waviness = low_pass(&heights, wavelength);
            without(&mut heights, waviness);
        }
        (Kind::W, Some(wavelength)) => heights = low_pass(&heights, wavelength),
        _ => {}
    }
    if let (Kind::W, Some(wavelength)) = (settings.kind, settings.lambda_f_mm) {
        let form = low_pass(&heights, wavelength);
        without(&mut heights, form);
    }
    heights
}

impl Texture {
    /// Every value with symbol, unit and clause, of a roughness profile.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        self.parameters_of(Kind::R)
    }

    /// Every value with symbol, unit and clause.
    #[must_use]
    pub fn parameters_of(&self, kind: Kind) -> Vec<Parameter> {
        let named = kind.parameters().iter().zip(self.values());
        named.map(|((symbol, unit, clause), value)| Parameter::new(symbol, unit, clause, value)).collect()
    }

    /// The numbers of [`Texture::parameters`].
    #[must_use]
    pub fn values(&self) -> [f64; COUNT] {
        [
            self.ra,
            self.rq,
            self.rsk,
            self.rku,
            self.rt,
            self.rdq,
            self.rp,
            self.rv,
            self.rz,
            self.rsm_mm,
            self.rz1max,
            self.rc,
            10.0 / self.rsm_mm,
            self.rk,
            self.rpk,
            self.rvk,
            self.rmrk1_percent,
            self.rmrk2_percent,
            self.rdc,
        ]
    }
}

/// Material ratio Rmr(c) in % of a profile at a height in µm above its mean line, 0 to 100; NaN of nothing.
#[must_use]
pub fn material_ratio_percent(profile_um: &[f64], height_um: f64) -> f64 {
    let known = || profile_um.iter().copied().filter(|height| height.is_finite());
    let mean = known().sum::<f64>() / known().count() as f64;
    if mean.is_nan() { f64::NAN } else { MaterialRatio::of_heights(known()).smr_percent(mean + height_um) }
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
    vectorised(SumOf(values, term))
}

struct SumOf<'a, F>(&'a [f64], F);

impl<F: Fn(f64) -> f64> NullaryFnOnce for SumOf<'_, F> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let mut sums = [0.0; 8];
        let (whole, rest) = self.0.as_chunks::<8>();
        for values in whole {
            for lane in 0..8 {
                sums[lane] += (self.1)(values[lane]);
            }
        }
        sums.iter().sum::<f64>() + rest.iter().map(|value| (self.1)(*value)).sum::<f64>()
    }
}

#[cfg(test)]
mod tests;

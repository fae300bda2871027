//! Areal surface texture (ISO 25178-2:2021) of a height map, after form removal and filtering.
//!
//! Heights are referred to the mean of the points that were measured. Missing points are left out of every value; what
//! that means for each family is said there.

mod bridge;
mod correlation;
mod direction;
mod features;
mod form;
mod height;
mod hybrid;
mod material_ratio;
mod spatial;
mod spatial_draws;

pub use features::Features;
pub use form::{without_cylinder, without_polynomial, without_taper, without_turned_body};
pub use height::Height;
pub use hybrid::Hybrid;
pub(super) use hybrid::derivative;
pub use material_ratio::{Functional, MaterialRatio};
pub use spatial::Spatial;
pub use spatial_draws::SpatialDraws;

pub use super::parameter::Parameter;
pub use runout_numerics::height_map::HeightMap;
use runout_numerics::threads::both;

/// What the standard leaves to the one who evaluates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Value s that the autocorrelation falls to for Sal and Str; ISO 25178-3: 0.2.
    pub decay: f64,
    /// Wolf pruning of hills and dales, in % of Sz; ISO 25178-3: 5.
    pub pruning_percent: f64,
    /// Material ratios p and q of Sdc, in %.
    pub difference_percent: [f64; 2],
    /// Material ratios of the volumes Vmp, Vmc, Vvc, Vvv, in %; ISO 25178-3: 10 and 80.
    pub volume_percent: [f64; 2],
}

impl Default for Settings {
    fn default() -> Self {
        Self { decay: 0.2, pruning_percent: 5.0, difference_percent: [2.5, 50.0], volume_percent: [10.0, 80.0] }
    }
}

/// Symbol, unit and clause of every value, in the order of [`Areal::parameters`].
pub const PARAMETERS: [(&str, &str, &str); 39] = [
    ("Sq", "µm", "4.2.2"),
    ("Ssk", "", "4.2.3"),
    ("Sku", "", "4.2.4"),
    ("Sp", "µm", "4.2.5"),
    ("Sv", "µm", "4.2.6"),
    ("Sz", "µm", "4.2.7"),
    ("Sa", "µm", "4.2.8"),
    ("Sal", "mm", "4.3.2"),
    ("Str", "", "4.3.3"),
    ("Std", "°", "4.3.4"),
    ("Ssw", "mm", "4.3.5"),
    ("Sdq", "", "4.4.2"),
    ("Sdr", "%", "4.4.3"),
    ("Sdc", "µm", "4.5.3"),
    ("Sxp", "µm", "peak extreme height"),
    ("Sk", "µm", "4.5.4"),
    ("Spk", "µm", "4.5.4"),
    ("Svk", "µm", "4.5.4"),
    ("Spkx", "µm", "4.5.4"),
    ("Svkx", "µm", "4.5.4"),
    ("Smrk1", "%", "4.5.4"),
    ("Smrk2", "%", "4.5.4"),
    ("Sak1", "µm·%", "4.5.4"),
    ("Sak2", "µm·%", "4.5.4"),
    ("Vmp", "µm³/µm²", "4.5.6"),
    ("Vmc", "µm³/µm²", "4.5.6"),
    ("Vvv", "µm³/µm²", "4.5.7"),
    ("Vvc", "µm³/µm²", "4.5.7"),
    ("Spd", "1/mm²", "5.8.2"),
    ("Svd", "1/mm²", "5.8.3"),
    ("Spc", "1/mm", "5.8.4"),
    ("Svc", "1/mm", "5.8.5"),
    ("S5p", "µm", "5.8.6"),
    ("S5v", "µm", "5.8.7"),
    ("S10z", "µm", "5.8.8"),
    ("Sda", "mm²", "5.8"),
    ("Sha", "mm²", "5.8"),
    ("Sdv", "mm³", "5.8"),
    ("Shv", "mm³", "5.8"),
];

/// All values of one surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Areal {
    /// Points measured.
    pub points: usize,
    /// Points missing.
    pub missing: usize,
    /// Clause 4.2.
    pub height: Height,
    /// Clause 4.3.
    pub spatial: Spatial,
    /// Clause 4.4.
    pub hybrid: Hybrid,
    /// Clause 4.5.
    pub functional: Functional,
    /// Clause 5.8.
    pub features: Features,
}

/// Height parameters alone (clause 4.2), about the mean of the points measured.
#[must_use]
pub fn heights(map: &HeightMap) -> Height {
    Height::of(&map.with(height::centred(map.heights_um())))
}

/// Evaluates a map. Form is removed before, by [`without_cylinder`] or [`without_polynomial`], and wavelengths by
/// [`areal_gaussian`](runout_numerics::filter::areal_gaussian).
#[must_use]
pub fn areal(map: &HeightMap, settings: &Settings) -> Areal {
    let centred = map.with(height::centred(map.heights_um()));
    let Height { sz, .. } = Height::of(&centred);
    let functional = || MaterialRatio::of(&centred).functional(settings.difference_percent, settings.volume_percent);
    let (functional, (features, found)) = both(functional, || {
        let features = Features::of(&centred, settings.pruning_percent / 100.0 * sz);
        (features, of_centred(&centred, settings))
    });
    Areal { functional, features, ..found }
}

/// Heights, lengths and slopes alone, in a part of the time: what the material ratio curve, hills and dales give is NaN.
#[must_use]
pub fn without_curve_and_features(map: &HeightMap, settings: &Settings) -> Areal {
    of_centred(&map.with(height::centred(map.heights_um())), settings)
}

/// A map with mean 0.
#[must_use]
pub fn centred(map: &HeightMap) -> HeightMap<'static> {
    map.with(height::centred(map.heights_um()))
}

/// Heights, lengths and slopes of a map with mean 0.
#[must_use]
pub fn of_centred(centred: &HeightMap, settings: &Settings) -> Areal {
    heights_and_slopes(centred, Spatial::of(centred, settings.decay))
}

/// Heights and slopes of a map with mean 0, beside spatial parameters that are known.
#[must_use]
pub fn heights_and_slopes(centred: &HeightMap, spatial: Spatial) -> Areal {
    let missing = centred.missing();
    Areal {
        points: centred.heights_um().len() - missing,
        missing,
        height: Height::of(centred),
        spatial,
        hybrid: Hybrid::of(centred),
        functional: Functional::NONE,
        features: Features::NONE,
    }
}

impl Areal {
    /// Every value with symbol, unit and clause.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let Self { height, spatial, hybrid, functional, features, .. } = self;
        let values = [
            height.sq,
            height.ssk,
            height.sku,
            height.sp,
            height.sv,
            height.sz,
            height.sa,
            spatial.sal_mm,
            spatial.str,
            spatial.std_deg,
            spatial.ssw_mm,
            hybrid.sdq,
            hybrid.sdr_percent,
            functional.sdc,
            functional.sxp,
            functional.sk,
            functional.spk,
            functional.svk,
            functional.spkx,
            functional.svkx,
            functional.smrk1_percent,
            functional.smrk2_percent,
            functional.sak1,
            functional.sak2,
            functional.vmp,
            functional.vmc,
            functional.vvv,
            functional.vvc,
            features.spd_per_mm2,
            features.svd_per_mm2,
            features.spc_per_mm,
            features.svc_per_mm,
            features.s5p,
            features.s5v,
            features.s10z,
            features.sda_mm2,
            features.sha_mm2,
            features.sdv_mm3,
            features.shv_mm3,
        ];
        let named = PARAMETERS.iter().zip(values);
        named.map(|((symbol, unit, clause), value)| Parameter::new(symbol, unit, clause, value)).collect()
    }
}

#[cfg(test)]
mod tests;

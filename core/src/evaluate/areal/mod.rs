//! Areal surface texture (ISO 25178-2:2021) of a height map, after form removal and filtering.
//!
//! Heights are referred to the mean of the points that were measured. Missing points are left out of every value; what
//! that means for each family is said there.

mod correlation;
mod features;
mod form;
mod height;
mod hybrid;
mod material_ratio;
mod spatial;

pub use features::Features;
pub use form::{without_cylinder, without_polynomial};
pub use height::Height;
pub use hybrid::Hybrid;
pub(super) use hybrid::derivative;
pub use material_ratio::{Functional, MaterialRatio};
pub use spatial::Spatial;

pub use super::parameter::Parameter;
pub use crate::numerics::height_map::HeightMap;

/// What the standard leaves to the one who evaluates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Value s that the autocorrelation falls to for Sal and Str; ISO 25178-3: 0.2.
    pub decay: f64,
    /// Wolf pruning of hills and dales, in % of Sz; ISO 25178-3: 5.
    pub pruning_percent: f64,
    /// Material ratios p and q of Sdc and Sxp, in %; ISO 25178-3 for Sxp: 2.5 and 50.
    pub difference_percent: [f64; 2],
    /// Material ratios of the volumes Vmp, Vmc, Vvc, Vvv, in %; ISO 25178-3: 10 and 80.
    pub volume_percent: [f64; 2],
}

impl Default for Settings {
    fn default() -> Self {
        Self { decay: 0.2, pruning_percent: 5.0, difference_percent: [2.5, 50.0], volume_percent: [10.0, 80.0] }
    }
}

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

/// Evaluates a map. Form is removed before, by [`without_cylinder`] or [`without_polynomial`], and wavelengths by
/// [`areal_gaussian`](crate::numerics::filter::areal_gaussian).
#[must_use]
pub fn areal(map: &HeightMap, settings: &Settings) -> Areal {
    let centred = map.with(height::centred(map.heights_um()));
    let height = Height::of(&centred);
    let curve = MaterialRatio::of(&centred);
    let missing = centred.missing();
    Areal {
        points: centred.heights_um().len() - missing,
        missing,
        height,
        spatial: Spatial::of(&centred, settings.decay),
        hybrid: Hybrid::of(&centred),
        functional: curve.functional(settings.difference_percent, settings.volume_percent),
        features: Features::of(&centred, settings.pruning_percent / 100.0 * height.sz),
    }
}

impl Areal {
    /// Every value with symbol, unit and clause.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let Self { height, spatial, hybrid, functional, features, .. } = self;
        [
            ("Sq", "µm", "4.2.2", height.sq),
            ("Ssk", "", "4.2.3", height.ssk),
            ("Sku", "", "4.2.4", height.sku),
            ("Sp", "µm", "4.2.5", height.sp),
            ("Sv", "µm", "4.2.6", height.sv),
            ("Sz", "µm", "4.2.7", height.sz),
            ("Sa", "µm", "4.2.8", height.sa),
            ("Sal", "mm", "4.3.2", spatial.sal_mm),
            ("Str", "", "4.3.3", spatial.str),
            ("Std", "°", "4.3.4", spatial.std_deg),
            ("Ssw", "mm", "4.3.5", spatial.ssw_mm),
            ("Sdq", "", "4.4.2", hybrid.sdq),
            ("Sdr", "%", "4.4.3", hybrid.sdr_percent),
            ("Sdc", "µm", "4.5.3", functional.sdc),
            ("Sk", "µm", "4.5.4", functional.sk),
            ("Spk", "µm", "4.5.4", functional.spk),
            ("Svk", "µm", "4.5.4", functional.svk),
            ("Spkx", "µm", "4.5.4", functional.spkx),
            ("Svkx", "µm", "4.5.4", functional.svkx),
            ("Smrk1", "%", "4.5.4", functional.smrk1_percent),
            ("Smrk2", "%", "4.5.4", functional.smrk2_percent),
            ("Sak1", "µm·%", "4.5.4", functional.sak1),
            ("Sak2", "µm·%", "4.5.4", functional.sak2),
            ("Vmp", "µm³/µm²", "4.5.6", functional.vmp),
            ("Vmc", "µm³/µm²", "4.5.6", functional.vmc),
            ("Vvv", "µm³/µm²", "4.5.7", functional.vvv),
            ("Vvc", "µm³/µm²", "4.5.7", functional.vvc),
            ("Spd", "1/mm²", "5.8.2", features.spd_per_mm2),
            ("Svd", "1/mm²", "5.8.3", features.svd_per_mm2),
            ("Spc", "1/mm", "5.8.4", features.spc_per_mm),
            ("Svc", "1/mm", "5.8.5", features.svc_per_mm),
            ("S5p", "µm", "5.8.6", features.s5p),
            ("S5v", "µm", "5.8.7", features.s5v),
            ("S10z", "µm", "5.8.8", features.s10z),
        ]
        .map(|(symbol, unit, clause, value)| Parameter::new(symbol, unit, clause, value))
        .to_vec()
    }
}

#[cfg(test)]
mod tests;

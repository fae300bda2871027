//! All values of a profile: those of its heights, its elements and its material ratio curve.

use super::{Settings, Texture, elements, profile::Profile};
use crate::areal::MaterialRatio;

/// Hills and dales below this share of Rp and Rv are none (ISO 21920-2).
const LOWEST: f64 = 0.1;
/// Hills and dales narrower than this share of a section are none (ISO 4287:1997, 3.2.7).
const NARROWEST: f64 = 0.01;

impl Profile<'_> {
    /// All values.
    pub(super) fn texture(&self, settings: &Settings) -> Texture {
        let heights = self.heights(settings);
        if heights.points == 0 {
            return heights;
        }
        let lowest = [LOWEST * heights.rp, LOWEST * heights.rv];
        let elements = elements::mean(self, lowest, NARROWEST * heights.section_mm);
        let curve = MaterialRatio::of_heights(self.heights_um.iter().copied().filter(|height| height.is_finite()));
        // The volumes of a surface are not asked for: any material ratios will do.
        let found = curve.functional(settings.difference_percent, settings.difference_percent);
        Texture {
            rsm_mm: elements.spacing_mm,
            rc: elements.height_um,
            rk: found.sk,
            rpk: found.spk,
            rvk: found.svk,
            rmrk1_percent: found.smrk1_percent,
            rmrk2_percent: found.smrk2_percent,
            rdc: found.sdc,
            ..heights
        }
    }
}

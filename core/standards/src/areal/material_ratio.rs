//! The areal material ratio curve and what is read from it (ISO 25178-2:2021, 4.5).

use super::HeightMap;

/// Width of the core's secant, as a share of the material ratio (ISO 25178-2, annex B).
const SECANT: f64 = 0.4;
/// Material ratios of Sxp (ISO 25178-3).
const EXTREME_PERCENT: [f64; 2] = [2.5, 50.0];

/// The material ratio curve: all measured heights from the highest down, at equal steps of the material ratio from 0 to
/// 100 %, with straight lines in between. No classes are formed.
#[derive(Debug, Clone)]
pub struct MaterialRatio {
    /// Descending, µm.
    heights: Vec<f64>,
}

/// Values of the material ratio curve. Heights in µm, volumes in µm³/µm² (which is ml/m²).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Functional {
    /// Difference of the heights at two material ratios.
    pub sdc: f64,
    /// Peak extreme height: the same at 2.5 % and 50 %.
    pub sxp: f64,
    /// Core height.
    pub sk: f64,
    /// Reduced peak height.
    pub spk: f64,
    /// Reduced pit depth.
    pub svk: f64,
    /// Highest peak above the core.
    pub spkx: f64,
    /// Deepest pit below the core.
    pub svkx: f64,
    /// Material ratio of the hills (Smr1 in the edition of 2012), in %.
    pub smrk1_percent: f64,
    /// Material ratio of the dales (Smr2 in the edition of 2012), in %.
    pub smrk2_percent: f64,
    /// Area of the hills, µm · %.
    pub sak1: f64,
    /// Area of the dales, µm · %.
    pub sak2: f64,
    /// Material volume of the peaks.
    pub vmp: f64,
    /// Material volume of the core.
    pub vmc: f64,
    /// Void volume of the core.
    pub vvc: f64,
    /// Void volume of the dales.
    pub vvv: f64,
}

impl Functional {
    /// Where no curve was made.
    pub(super) const NONE: Self = Self {
        sdc: f64::NAN,
        sxp: f64::NAN,
        sk: f64::NAN,
        spk: f64::NAN,
        svk: f64::NAN,
        spkx: f64::NAN,
        svkx: f64::NAN,
        smrk1_percent: f64::NAN,
        smrk2_percent: f64::NAN,
        sak1: f64::NAN,
        sak2: f64::NAN,
        vmp: f64::NAN,
        vmc: f64::NAN,
        vvc: f64::NAN,
        vvv: f64::NAN,
    };
}

impl MaterialRatio {
    /// Of the points measured, with heights as they are in the map.
    #[must_use]
    pub fn of(map: &HeightMap) -> Self {
        Self::of_heights(map.heights_um().iter().copied().filter(|height| height.is_finite()))
    }

    /// Of the points measured, with heights above their mean.
    #[must_use]
    pub fn about_mean(map: &HeightMap) -> Self {
        let centred = super::height::centred(map.heights_um());
        Self::of_heights(centred.into_iter().filter(|height| height.is_finite()))
    }

    /// Of heights in µm in any order, all of which are finite.
    #[must_use]
    pub fn of_heights(heights_um: impl Iterator<Item = f64>) -> Self {
        let mut heights: Vec<f64> = heights_um.collect();
        heights.sort_unstable_by(|a, b| b.total_cmp(a));
        Self { heights }
    }

    /// Steps of the curve.
    fn steps(&self) -> f64 {
        self.heights.len().saturating_sub(1) as f64
    }

    fn at(&self, index: usize) -> f64 {
        self.heights.get(index).or(self.heights.last()).copied().unwrap_or(f64::NAN)
    }

    /// Smc: height in µm at a material ratio of 0 to 100 % (4.5.2).
    #[must_use]
    pub fn smc_um(&self, ratio_percent: f64) -> f64 {
        let position = (ratio_percent / 100.0).clamp(0.0, 1.0) * self.steps();
        let (low, high) = (self.at(position as usize), self.at(position as usize + 1));
        low + (high - low) * position.fract()
    }

    /// Smr: material ratio in % at a height in µm (4.5.1).
    #[must_use]
    pub fn smr_percent(&self, height_um: f64) -> f64 {
        let below = self.heights.partition_point(|height| *height > height_um);
        if below == 0 {
            return 0.0;
        }
        if below == self.heights.len() {
            return 100.0;
        }
        let (high, low) = (self.at(below - 1), self.at(below));
        100.0 * ((below - 1) as f64 + (high - height_um) / (high - low)) / self.steps()
    }

    /// ∫ Smc over material ratios from 0 to one in %, in µm · share.
    fn integral(&self, ratio_percent: f64) -> f64 {
        let position = (ratio_percent / 100.0).clamp(0.0, 1.0) * self.steps();
        let whole = position as usize;
        let ends = 0.5 * (self.at(0) + self.at(whole));
        let full = if whole == 0 { 0.0 } else { ends + self.heights[1..whole].iter().sum::<f64>() };
        let part = 0.5 * position.fract() * (self.at(whole) + self.smc_um(ratio_percent));
        (full + part) / self.steps()
    }

    /// Vm(p): material volume above the height at a material ratio, in µm³/µm² (4.5.6).
    #[must_use]
    pub fn vm(&self, ratio_percent: f64) -> f64 {
        self.integral(ratio_percent) - ratio_percent / 100.0 * self.smc_um(ratio_percent)
    }

    /// Vv(p): void volume below the height at a material ratio, in µm³/µm² (4.5.7).
    #[must_use]
    pub fn vv(&self, ratio_percent: f64) -> f64 {
        let below = self.integral(100.0) - self.integral(ratio_percent);
        (1.0 - ratio_percent / 100.0) * self.smc_um(ratio_percent) - below
    }

    /// Heights of the core's straight line at 0 and 100 %: the least-squares line through the 40 % of the curve whose
    /// secant is the flattest, the first one of equals (annex B).
    fn core(&self) -> [f64; 2] {
        let width = SECANT * self.steps();
        let (whole, part) = (width as usize, width.fract());
        let last = (self.steps() - width) as usize;
        let drop = |start: usize| {
            let (high, low) = (self.at(start + whole), self.at(start + whole + 1));
            self.at(start) - (high + part * (low - high))
        };
        let mut start = (0, f64::INFINITY);
        for candidate in 0..=last {
            let drop = drop(candidate);
            if drop < start.1 {
                start = (candidate, drop);
            }
        }
        let region = self.heights.get(start.0..=start.0 + whole).unwrap_or_default();
        let middle = 0.5 * whole as f64;
        let mean = region.iter().sum::<f64>() / region.len() as f64;
        let (mut product, mut square) = (0.0, 0.0);
        for (index, height) in region.iter().enumerate() {
            let x = index as f64 - middle;
            product += x * (height - mean);
            square += x * x;
        }
        let slope = if square > 0.0 { product / square } else { 0.0 };
        let line = |index: f64| mean + slope * (index - middle - start.0 as f64);
        [line(0.0), line(self.steps())]
    }

    /// All values, with the material ratios of Sdc and of the volumes, in %.
    #[must_use]
    pub fn functional(&self, difference_percent: [f64; 2], volume_percent: [f64; 2]) -> Functional {
        let [upper, lower] = self.core();
        let [smrk1, smrk2] = [upper, lower].map(|height| self.smr_percent(height));
        // Between the curve and the core's limit; nothing where the curve does not pass it.
        let hills = (self.integral(smrk1) - smrk1 / 100.0 * upper).max(0.0);
        let below = self.integral(100.0) - self.integral(smrk2);
        let dales = ((1.0 - smrk2 / 100.0) * lower - below).max(0.0);
        let reduced = |area: f64, base: f64| if base > 0.0 { 200.0 * area / base } else { 0.0 };
        let [p, q] = volume_percent;
        Functional {
            sdc: self.smc_um(difference_percent[0]) - self.smc_um(difference_percent[1]),
            sxp: self.smc_um(EXTREME_PERCENT[0]) - self.smc_um(EXTREME_PERCENT[1]),
            sk: upper - lower,
            spk: reduced(hills, smrk1),
            svk: reduced(dales, 100.0 - smrk2),
            spkx: self.at(0) - upper,
            svkx: lower - self.at(self.heights.len()),
            smrk1_percent: smrk1,
            smrk2_percent: smrk2,
            sak1: 100.0 * hills,
            sak2: 100.0 * dales,
            vmp: self.vm(p),
            vmc: self.vm(q) - self.vm(p),
            vvc: self.vv(p) - self.vv(q),
            vvv: self.vv(q),
        }
    }
}

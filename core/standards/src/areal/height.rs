//! Height parameters (ISO 25178-2:2021, 4.2).

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use super::HeightMap;
use runout_numerics::lanes::{NullaryFnOnce, vectorised};

const LANES: usize = 8;

/// Heights about the mean of the points measured, in µm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Height {
    /// Arithmetic mean of |z|.
    pub sa: f64,
    /// Root mean square.
    pub sq: f64,
    /// Highest peak.
    pub sp: f64,
    /// Deepest pit, positive.
    pub sv: f64,
    /// Sp + Sv.
    pub sz: f64,
    /// Skewness, mean z³ / Sq³.
    pub ssk: f64,
    /// Kurtosis, mean z⁴ / Sq⁴.
    pub sku: f64,
}

impl Height {
    /// Of a map with mean 0.
    pub(super) fn of(centred: &HeightMap) -> Self {
        let mut sums = [0.0; 4];
        let (mut low, mut high, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for row in centred.heights_um().chunks_exact(centred.columns()) {
            // Sums of rows of sums: rounding does not grow with the number of points.
            let part = vectorised(Row(row));
            sums.iter_mut().zip(part.sums).for_each(|(sum, part)| *sum += part);
            (low, high) = (low.min(part.low), high.max(part.high));
            count += part.count;
        }
        let [sa, variance, third, fourth] = sums.map(|sum| sum / count);
        let sq = variance.sqrt();
        Self {
            sa,
            sq,
            sp: high,
            sv: -low,
            sz: high - low,
            ssk: third / (variance * sq),
            sku: fourth / (variance * variance),
        }
    }
}

/// What a row of heights comes to.
struct Part {
    /// Of |z|, z², z³, z⁴.
    sums: [f64; 4],
    low: f64,
    high: f64,
    count: f64,
}

struct Row<'a>(&'a [f64]);

impl NullaryFnOnce for Row<'_> {
    type Output = Part;

    #[inline(always)]
    fn call(self) -> Part {
        let (mut sums, mut count) = ([[0.0; LANES]; 4], [0.0; LANES]);
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let mut add = |heights: [f64; LANES]| {
            for l in 0..LANES {
                let there = heights[l].abs() < f64::INFINITY;
                let height = if there { heights[l] } else { 0.0 };
                let square = height * height;
                sums[0][l] += height.abs();
                sums[1][l] += square;
                sums[2][l] += square * height;
                sums[3][l] += square * square;
                count[l] += if there { 1.0 } else { 0.0 };
                low[l] = if there && height < low[l] { height } else { low[l] };
                high[l] = if there && height > high[l] { height } else { high[l] };
            }
        };
        let (whole, rest) = self.0.as_chunks::<LANES>();
        for heights in whole {
            add(*heights);
        }
        let mut last = [f64::NAN; LANES];
        last[..rest.len()].copy_from_slice(rest);
        add(last);
        Part {
            sums: sums.map(|lanes| lanes.iter().sum()),
            low: low.into_iter().fold(f64::INFINITY, f64::min),
            high: high.into_iter().fold(f64::NEG_INFINITY, f64::max),
            count: count.iter().sum(),
        }
    }
}

/// Heights minus their mean; missing ones NaN.
pub(super) fn centred(heights_um: &[f64]) -> Vec<f64> {
    // A second round corrects the rounding of the first.
    let first = vectorised(Mean(heights_um, 0.0));
    let mean = first + vectorised(Mean(heights_um, first));
    heights_um.iter().map(|height| if height.is_finite() { height - mean } else { f64::NAN }).collect()
}

/// Mean of the heights that are there, less an offset.
struct Mean<'a>(&'a [f64], f64);

impl NullaryFnOnce for Mean<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let (mut sums, mut count) = ([0.0; LANES], [0.0; LANES]);
        let mut add = |heights: [f64; LANES]| {
            for l in 0..LANES {
                let there = heights[l].abs() < f64::INFINITY;
                sums[l] += if there { heights[l] - self.1 } else { 0.0 };
                count[l] += if there { 1.0 } else { 0.0 };
            }
        };
        let (whole, rest) = self.0.as_chunks::<LANES>();
        for heights in whole {
            add(*heights);
        }
        let mut last = [f64::NAN; LANES];
        last[..rest.len()].copy_from_slice(rest);
        add(last);
        sums.iter().sum::<f64>() / count.iter().sum::<f64>()
    }
}

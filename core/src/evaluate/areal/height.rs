//! Height parameters (ISO 25178-2:2021, 4.2).

use super::HeightMap;

/// Heights about the mean of the points measured, in µm.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        let (mut low, mut high, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0_usize);
        for row in centred.heights_um().chunks_exact(centred.columns()) {
            // Sums of rows of sums: rounding does not grow with the number of points.
            let mut partial = [0.0; 4];
            for height in row.iter().filter(|height| height.is_finite()) {
                let square = height * height;
                partial[0] += height.abs();
                partial[1] += square;
                partial[2] += square * height;
                partial[3] += square * square;
                low = low.min(*height);
                high = high.max(*height);
                count += 1;
            }
            sums.iter_mut().zip(partial).for_each(|(sum, part)| *sum += part);
        }
        let [sa, variance, third, fourth] = sums.map(|sum| sum / count as f64);
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

/// Heights minus their mean; missing ones NaN.
pub(super) fn centred(heights_um: &[f64]) -> Vec<f64> {
    let known = || heights_um.iter().filter(|height| height.is_finite());
    let count = known().count() as f64;
    let mean = |offset: f64| known().map(|height| height - offset).sum::<f64>() / count;
    // A second round takes back the rounding of the first.
    let first = mean(0.0);
    let mean = first + mean(first);
    heights_um.iter().map(|height| if height.is_finite() { height - mean } else { f64::NAN }).collect()
}

//! Straightness (ISO 12780-1) of a profile along a line.

/// Deviations of a profile about its least-squares line LSLI (ISO 12780-1), in µm: distances along the reading, which
/// those at right angles to the line equal up to terms of deviation · slope².
#[must_use]
pub fn about_lsli_um(z_mm: &[f64], profile_um: &[f64]) -> Vec<f64> {
    let count = z_mm.len() as f64;
    let (z_mean, level) = (z_mm.iter().sum::<f64>() / count, profile_um.iter().sum::<f64>() / count);
    let points = || z_mm.iter().zip(profile_um).map(|(z, value)| (z - z_mean, value - level));
    let spread: f64 = points().map(|(z, _)| z * z).sum();
    // One position has no slope.
    let slope = if spread > 0.0 { points().map(|(z, value)| z * value).sum::<f64>() / spread } else { 0.0 };
    points().map(|(z, value)| value - slope * z).collect()
}

/// Peak-to-valley straightness deviation STRt about the least-squares reference line LSLI (ISO 12780-1), in µm; NaN of
/// nothing.
#[must_use]
pub fn strt_lsli_um(z_mm: &[f64], profile_um: &[f64]) -> f64 {
    super::roundness::ront_lsci_um(&about_lsli_um(z_mm, profile_um))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_on_uneven_positions() {
        // z² at 0, 1, 2, 4 has the line −2 + 4.142857 z: slope Σ(z−z̄)(y−ȳ)/Σ(z−z̄)² = 36.25/8.75, by hand.
        let z = [0.0, 1.0, 2.0, 4.0];
        let slope = 36.25 / 8.75;
        let left = [0.0, 1.0, 4.0, 16.0].iter().zip(z).map(|(y, z)| y - 5.25 - slope * (z - 1.75));
        let left: Vec<f64> = left.collect();
        let tilted: Vec<f64> = z.iter().map(|z| z * z + 1e3 - 50.0 * z).collect();
        for (found, expected) in about_lsli_um(&z, &tilted).iter().zip(&left) {
            // 1e-11: rounding of readings near 1000.
            assert!((found - expected).abs() < 1e-11, "{found} instead of {expected}");
        }
        // Highest at 0: 2; lowest at 2: −2.2857 (both by hand).
        assert!((strt_lsli_um(&z, &tilted) - (left[0] - left[2])).abs() < 1e-11);
        assert!((left[0] - 2.0).abs() < 1e-12 && (left[2] + 2.285_714_285_714).abs() < 1e-9, "{left:?}");
        assert!(strt_lsli_um(&[], &[]).is_nan());
    }
}

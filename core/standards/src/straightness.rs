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

/// Peak-to-valley straightness deviation STRt about the minimum zone reference lines MZLI (ISO 12780-1), in µm: the least distance, along
/// the reading, of two parallel lines that hold the profile. Positions ascend; NaN of nothing.
///
/// The distance max (y − a z) − min (y − a z) is convex in the slope a and bends where an edge of the upper or of the lower hull has this
/// slope. It is least where the point that touches above and the one that touches below change sides.
///
/// ```
/// use runout_standards::straightness::{strt_lsli_um, strt_mzli_um};
///
/// // A step: LSLI takes a part of it for slope, MZLI more.
/// let (z, step) = ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 1.0]);
/// assert!((strt_mzli_um(&z, &step) - 0.5).abs() < 1e-12);
/// assert!((strt_lsli_um(&z, &step) - 0.6).abs() < 1e-12);
/// ```
#[must_use]
pub fn strt_mzli_um(z_mm: &[f64], profile_um: &[f64]) -> f64 {
    let points = || z_mm.iter().copied().zip(profile_um.iter().copied());
    let upper = hull(points(), 1.0);
    let lower = hull(points(), -1.0);
    let (Some(mut above), Some(_)) = (upper.len().checked_sub(1), lower.first()) else { return f64::NAN };
    let mut below = 0;
    let mut slope = 0.0;
    while upper[above].0 > lower[below].0 {
        let of = |(from, to): ((f64, f64), (f64, f64))| (to.1 - from.1) / (to.0 - from.0);
        let of_upper = above.checked_sub(1).map_or(f64::INFINITY, |before| of((upper[before], upper[above])));
        let of_lower = lower.get(below + 1).map_or(f64::INFINITY, |next| of((lower[below], *next)));
        slope = of_upper.min(of_lower);
        if of_upper <= of_lower {
            above -= 1;
        } else {
            below += 1;
        }
    }
    let [(z, high), (other_z, low)] = [upper[above], lower[below]];
    (high - low) - slope * (z - other_z)
}

/// Points of the upper hull (`sign` 1), or of the lower one (−1), of points whose first coordinate ascends.
fn hull(points: impl Iterator<Item = (f64, f64)>, sign: f64) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for next in points {
        if let Some(last) = kept.last()
            && last.0 >= next.0
        {
            // At one position the outermost counts.
            if sign * last.1 >= sign * next.1 {
                continue;
            }
            kept.pop();
        }
        while let [.., before, last] = kept[..] {
            let turn = (last.0 - before.0) * (next.1 - before.1) - (last.1 - before.1) * (next.0 - before.0);
            if sign * turn < 0.0 {
                break;
            }
            kept.pop();
        }
        kept.push(next);
    }
    kept
}

/// Straightness deviations of a profile (ISO 12780-1), in µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Straightness {
    /// Peak to valley about LSLI, STRt.
    pub strt_lsli_um: f64,
    /// Highest deviation above LSLI, STRp.
    pub strp_um: f64,
    /// Lowest deviation below LSLI, positive, STRv.
    pub strv_um: f64,
    /// Root mean square about LSLI over the points, STRq.
    pub strq_um: f64,
    /// Peak to valley about MZLI, STRt.
    pub strt_mzli_um: f64,
}

impl Straightness {
    /// Of a profile on ascending positions; NaN of nothing. Missing points (NaN) are left out.
    #[must_use]
    pub fn of(z_mm: &[f64], profile_um: &[f64]) -> Self {
        let there = || z_mm.iter().zip(profile_um).filter(|(_, value)| value.is_finite());
        let (z_mm, profile_um): (Vec<f64>, Vec<f64>) = there().map(|(z, value)| (*z, *value)).unzip();
        let about = about_lsli_um(&z_mm, &profile_um);
        let none = if about.is_empty() { f64::NAN } else { f64::NEG_INFINITY };
        let strp_um = about.iter().copied().fold(none, f64::max);
        let strv_um = about.iter().map(|value| -value).fold(none, f64::max);
        let squares: f64 = about.iter().map(|value| value * value).sum();
        Self {
            strt_lsli_um: strp_um + strv_um,
            strp_um,
            strv_um,
            strq_um: (squares / about.len() as f64).sqrt(),
            strt_mzli_um: strt_mzli_um(&z_mm, &about),
        }
    }
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
        // The chord 0…4 has the slope 4; z² − 4z is lowest at 2, −4.
        assert!((strt_mzli_um(&z, &tilted) - 4.0).abs() < 1e-11);
    }

    /// Every line through two points, tried: the zone of the least one.
    fn by_brute_force(z: &[f64], y: &[f64]) -> f64 {
        let zone = |slope: f64| {
            let over = z.iter().zip(y).map(|(z, y)| y - slope * z);
            over.clone().fold(f64::NEG_INFINITY, f64::max) - over.fold(f64::INFINITY, f64::min)
        };
        let pairs = (0..z.len()).flat_map(|one| (0..one).map(move |other| (one, other)));
        pairs.map(|(one, other)| zone((y[one] - y[other]) / (z[one] - z[other]))).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_minimum_zone_is_that_of_all_pairs_of_points() {
        for count in [2, 3, 4, 5, 17, 60] {
            for seed in 0..40 {
                let wave = |at: usize, by: f64| (by * at as f64 + f64::from(seed)).sin();
                let z: Vec<f64> = (0..count).map(|at| at as f64 + 0.3 * wave(at, 1.7)).collect();
                let rough = f64::from(seed % 3);
                let y: Vec<f64> =
                    z.iter().enumerate().map(|(at, z)| 0.2 * z + wave(at, 0.21) + rough * wave(at, 2.9)).collect();
                let (found, expected) = (strt_mzli_um(&z, &y), by_brute_force(&z, &y));
                assert!((found - expected).abs() < 1e-12, "{count} {seed}: {found} instead of {expected}");
                let all = Straightness::of(&z, &y);
                assert!(all.strt_mzli_um <= all.strt_lsli_um + 1e-12 && (all.strt_mzli_um - found).abs() < 1e-12);
                assert!(
                    (all.strt_lsli_um - strt_lsli_um(&z, &y)).abs() < 1e-12
                        && all.strq_um <= all.strp_um.max(all.strv_um)
                );
            }
        }
        assert!(strt_mzli_um(&[], &[]).is_nan() && strt_mzli_um(&[1.0], &[2.0]).abs() < 1e-300);
        assert!(strt_mzli_um(&[1.0, 1.0, 2.0], &[2.0, 5.0, 0.0]) > 2.9, "a jump at one position stays");
    }

    #[test]
    fn missing_points_are_left_out() {
        let (z, y) = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, f64::NAN, 1.0, 0.0]);
        let found = Straightness::of(&z, &y);
        let expected = Straightness::of(&[0.0, 1.0, 3.0, 4.0], &[0.0, 1.0, 1.0, 0.0]);
        assert_eq!(found, expected);
        assert!((found.strt_mzli_um - 1.0).abs() < 1e-12 && (found.strq_um - 0.5).abs() < 1e-12);
        assert!(Straightness::of(&[1.0], &[f64::NAN]).strt_lsli_um.is_nan());
    }
}

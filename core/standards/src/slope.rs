//! The steepest slope of a closed profile, from its harmonics.

use std::{borrow::Cow, f64::consts::TAU};

use crate::gaps::Gaps;
use runout_numerics::{
    Complex64,
    fourier::{Fourier, quick_length},
    interpolation::Curve,
};

/// Angles a wave of the highest order at which the slope is evaluated first.
const POINTS_A_WAVE: usize = 16;
/// Peaks nearer to the largest than this share of it are refined: the largest slope between two of those angles exceeds both by
/// less, 1 − cos(π/16).
const NEAR: f64 = 0.02;
/// Orders whose amplitudes together are below this share of all are rounding.
const ROUNDING: f64 = 1e-15;
/// Newton's steps from the nearest angle: each doubles the digits.
const STEPS: usize = 6;

/// The largest |dr/dα| of Re Σ cₙ e^{inα} outside the gaps, in µm/rad: the largest over equal angles, refined by Newton's method on the
/// series, and both ends of each gap. NaN where nothing is outside.
#[must_use]
pub fn steepest_um_per_rad(harmonics: &[Complex64], gaps: &Gaps) -> f64 {
    let slopes: Vec<Complex64> =
        harmonics.iter().enumerate().map(|(order, value)| Complex64::I * order as f64 * value).collect();
    let highest = highest_that_counts(&slopes);
    let count = quick_length(POINTS_A_WAVE * highest.max(1));
    let mut fourier = Fourier::new(count);
    let on_angles = fourier.synthesise(slopes.iter().copied());
    let curve = Curve::new(&slopes, on_angles);
    let mut blanked = Cow::Borrowed(on_angles);
    if !gaps.is_empty() {
        gaps.blank(blanked.to_mut());
    }
    let largest = largest_of(&blanked);
    let step = TAU / count as f64;
    let mut steepest = largest;
    for (index, slope) in blanked.iter().enumerate().filter(|(_, slope)| slope.abs() >= (1.0 - NEAR) * largest) {
        let beside = [blanked[(index + count - 1) % count], blanked[(index + 1) % count]];
        if beside.iter().all(|other| slope.abs() >= other.abs()) {
            let found = peak_near(&curve, index as f64 * step, step);
            if !gaps.hold(found) {
                steepest = steepest.max(curve.at(found)[0].abs());
            }
        }
    }
    let ends = gaps.stretches().flat_map(|[from, length]| [from, from + length]);
    ends.map(|end| curve.at(end)[0].abs()).fold(steepest, f64::max)
}

/// The highest order that is no rounding beside the others.
fn highest_that_counts(series: &[Complex64]) -> usize {
    let size = |value: &Complex64| value.norm_sqr().sqrt();
    let all: f64 = series.iter().map(size).sum();
    let above = series.iter().rev().scan(0.0, |sum, value| {
        *sum += size(value);
        Some(*sum)
    });
    let below = above.take_while(|above| *above <= ROUNDING * all).count();
    series.len().saturating_sub(below + 1)
}

/// The largest of some numbers, without sign; NaN of nothing but NaN.
fn largest_of(values: &[f64]) -> f64 {
    // Lanes that do not wait for each other.
    let mut largest = [f64::NEG_INFINITY; 8];
    for chunk in values.chunks(8) {
        for (largest, value) in largest.iter_mut().zip(chunk) {
            // Comparisons with NaN are false.
            *largest = if value.abs() > *largest { value.abs() } else { *largest };
        }
    }
    let largest = largest.into_iter().fold(f64::NEG_INFINITY, f64::max);
    if largest >= 0.0 { largest } else { f64::NAN }
}

/// Where the slope of a curve is 0 within a step of an angle; the angle itself where there is none.
fn peak_near(curve: &Curve, start: f64, step: f64) -> f64 {
    let mut angle = start;
    for _ in 0..STEPS {
        let [_, first, second] = curve.at(angle);
        let next = angle - first / second;
        if next.is_nan() || (next - start).abs() > step {
            break;
        }
        angle = next;
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(waves: &[(usize, f64, f64)], highest: usize) -> Vec<Complex64> {
        let mut harmonics = vec![Complex64::ZERO; highest + 1];
        for (order, amplitude, phase) in waves {
            harmonics[*order] += Complex64::from_polar(*amplitude, *phase);
        }
        harmonics
    }

    /// n·A of one wave, and brute force on a million angles of three.
    #[test]
    fn the_steepest_slope_is_that_of_the_series() {
        let whole = Gaps::default();
        for order in [2, 3, 17, 200] {
            let found = steepest_um_per_rad(&series(&[(order, 2.0, 0.7)], 255), &whole);
            assert!((found / (2.0 * order as f64) - 1.0).abs() < 1e-12, "{order}: {found}");
        }
        let waves = [(3, 2.0, 0.1), (50, 0.21, 1.3), (131, 0.11, -0.4)];
        let slope = |angle: f64| -> f64 {
            waves.iter().map(|(order, size, phase)| -size * *order as f64 * (*order as f64 * angle + phase).sin()).sum()
        };
        let mut gaps = Gaps::default();
        gaps.add(1.0, 3.0);
        for gaps in [&whole, &gaps] {
            let angles = (0..1_000_000).map(|step| TAU * f64::from(step) * 1e-6).filter(|angle| !gaps.hold(*angle));
            let expected = angles.map(|angle| slope(angle).abs()).fold(0.0, f64::max);
            let found = steepest_um_per_rad(&series(&waves, 255), gaps);
            // Between two of a million angles at 131 waves: (π·131·1e-6)²/2.
            assert!((found / expected - 1.0).abs() < 1e-6, "{found}, not {expected}");
        }
        let mut all = Gaps::default();
        all.add(0.0, TAU);
        assert!(steepest_um_per_rad(&series(&waves, 255), &all).is_finite(), "its two ends");
        assert!(steepest_um_per_rad(&series(&[], 5), &whole).abs() < 1e-300);
    }
}

//! The steepest slope of a closed profile, from its harmonics.

use std::f64::consts::TAU;

use crate::{Complex64, numerics::fourier::Fourier, rig::Gaps};

/// Angles a wave of the highest order at which the slope is looked at first.
const POINTS_A_WAVE: usize = 16;
/// Peaks nearer to the largest than this share of it are refined: the largest slope between two of those angles exceeds both by
/// less, 1 − cos(π/16).
const NEAR: f64 = 0.02;
/// Newton's steps from the nearest angle: each doubles the digits.
const STEPS: usize = 6;

/// The largest |dr/dα| of Re Σ cₙ e^{inα} outside the gaps, in µm/rad: the largest over equal angles, refined by Newton's method on the
/// series, and both ends of each gap. NaN where nothing is outside.
#[must_use]
pub fn steepest_um_per_rad(harmonics: &[Complex64], gaps: &Gaps) -> f64 {
    let slopes: Vec<Complex64> =
        harmonics.iter().enumerate().map(|(order, value)| Complex64::I * order as f64 * value).collect();
    let highest = slopes.iter().rposition(|value| value.norm_sqr() > 0.0).unwrap_or(0);
    let count = (POINTS_A_WAVE * highest.max(1)).next_power_of_two();
    let mut fourier = Fourier::new(count);
    let mut on_angles = fourier.synthesise(slopes.iter().copied()).to_vec();
    gaps.blank(&mut on_angles);
    let series = &slopes[..slopes.len().min(highest + 1)];
    // Of numbers and NaN the larger number.
    let largest = on_angles.iter().map(|slope| slope.abs()).fold(f64::NAN, f64::max);
    let step = TAU / count as f64;
    let mut steepest = largest;
    for (index, slope) in on_angles.iter().enumerate() {
        let beside = [on_angles[(index + count - 1) % count], on_angles[(index + 1) % count]];
        let peak = beside.iter().all(|other| slope.abs() >= other.abs());
        if peak && slope.abs() >= (1.0 - NEAR) * largest {
            let start = index as f64 * step;
            let found = peak_near(series, start, step);
            if !gaps.hold(found) {
                steepest = steepest.max(value_at(series, found).abs());
            }
        }
    }
    let ends = gaps.stretches().flat_map(|[from, length]| [from, from + length]);
    ends.map(|end| value_at(series, end).abs()).fold(steepest, f64::max)
}

/// Where the slope of a series is 0 within a step of an angle; the angle itself where there is none.
fn peak_near(series: &[Complex64], start: f64, step: f64) -> f64 {
    let mut angle = start;
    for _ in 0..STEPS {
        let (mut first, mut second) = (0.0, 0.0);
        for (order, value) in series.iter().enumerate() {
            let turned = value * Complex64::cis(order as f64 * angle);
            first -= order as f64 * turned.im;
            second -= (order * order) as f64 * turned.re;
        }
        let next = angle - first / second;
        if next.is_nan() || (next - start).abs() > step {
            break;
        }
        angle = next;
    }
    angle
}

fn value_at(series: &[Complex64], angle: f64) -> f64 {
    series.iter().enumerate().map(|(order, value)| (value * Complex64::cis(order as f64 * angle)).re).sum()
}

/// The same on equal angles, with a parabola through the three angles about the largest: what many draws are compared by.
#[must_use]
pub fn largest_on_angles(slopes: &[f64]) -> f64 {
    let count = slopes.len();
    let largest = slopes.iter().enumerate().fold((0, f64::NAN), |best, (index, slope)| {
        if slope.abs() > best.1 || (best.1.is_nan() && !slope.is_nan()) { (index, slope.abs()) } else { best }
    });
    let (index, peak) = largest;
    let beside = |step: usize| slopes[(index + step) % count].abs();
    if count < 3 || peak.is_nan() {
        return peak;
    }
    let [before, after] = [beside(count - 1), beside(1)];
    let bend = 2.0 * peak - before - after;
    // At a gap's end there is no parabola.
    if bend > 0.0 { peak + (after - before).powi(2) / (8.0 * bend) } else { peak }
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

    #[test]
    fn a_parabola_meets_a_peak_between_angles() {
        let slopes: Vec<f64> = (0..16).map(|step| (TAU * (f64::from(step) - 0.4) / 16.0).cos()).collect();
        assert!((largest_on_angles(&slopes) - 1.0).abs() < 1e-3);
        assert!(
            largest_on_angles(&[f64::NAN; 4]).is_nan()
                && (largest_on_angles(&[f64::NAN, -2.0, 1.0]) - 2.0).abs() < 1e-15
        );
    }
}

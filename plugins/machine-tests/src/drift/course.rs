//! A course of means over windows: range, noise, and when it comes to rest.

use std::f64::consts::SQRT_2;

use runout_core::numerics::statistics::{median, median_absolute_deviation};

/// Share of the test at its end that says where an axis is.
const END: f64 = 0.1;
/// Median of the distance of normal numbers from 0, in standard deviations.
const NORMAL_MEDIAN: f64 = 0.674_489_75;
/// What a mean of second differences has of the variance of single means: 1 + 1/4 + 1/4.
pub(super) const OF_SECOND_DIFFERENCES: f64 = 1.5;

/// Readings so many standard deviations from the median of their window are no part of its course.
const FAR: f64 = 7.0;

/// Means of windows, and how many readings are left out of them since they are far from the others, by the spread of their own window and of
/// the usual one.
pub(super) fn levels(windows: &[&[f64]]) -> (Vec<f64>, usize) {
    let spreads: Vec<f64> = windows.iter().map(|window| median_absolute_deviation(window) / NORMAL_MEDIAN).collect();
    // Of few readings the spread about their median is too small: what follows each other shows it too.
    let changes = windows.iter().flat_map(|window| window.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    let usual = median(spreads.iter().copied()).max(median(changes) / (SQRT_2 * NORMAL_MEDIAN));
    let mut left_out = 0;
    let level = |(window, spread): (&&[f64], &f64)| {
        let (center, far) = (median(window.iter().copied()), FAR * spread.max(usual));
        // Where most are equal, as of a coarse resolution, nothing says what is far.
        let kept: Vec<f64> =
            window.iter().copied().filter(|reading| far <= 0.0 || (reading - center).abs() <= far).collect();
        left_out += window.len() - kept.len();
        kept.iter().sum::<f64>() / kept.len() as f64
    };
    let means = windows.iter().zip(&spreads).map(level).collect();
    (means, left_out)
}

/// Highest less lowest.
pub(super) fn range(course: &[f64]) -> f64 {
    let ends = |(low, high): (f64, f64), one: &f64| (low.min(*one), high.max(*one));
    let (low, high) = course.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    high - low
}

/// By how much a course goes on within its first and last window where it is farthest out there: half of the change from the next one.
pub(super) fn within_ends(course: &[f64]) -> f64 {
    let [.., before_last, last] = course else { return 0.0 };
    let [first, second, ..] = course else { return 0.0 };
    let lowest_and_highest = |(low, high): (f64, f64), one: &f64| (low.min(*one), high.max(*one));
    let (low, high) = course.iter().fold((f64::INFINITY, f64::NEG_INFINITY), lowest_and_highest);
    let beyond = |end: f64, next: f64| {
        let is_farthest = if end > next { end >= high } else { end <= low };
        if is_farthest { 0.5 * (end - next).abs() } else { 0.0 }
    };
    beyond(*first, *second) + beyond(*last, *before_last)
}

/// Means over neighbours on both sides.
pub(super) fn smoothed(means: &[f64], beside: usize) -> Vec<f64> {
    let around = |place: usize| {
        let beside = beside.min(place).min(means.len() - 1 - place);
        let own = &means[place - beside..=place + beside];
        own.iter().sum::<f64>() / own.len() as f64
    };
    (0..means.len()).map(around).collect()
}

/// Standard deviation of the noise of means, from the median of their second differences: steps are few of them. Where most are 0, as of a
/// coarse resolution, their root mean square.
pub(super) fn noise_of(means: &[f64]) -> f64 {
    let sizes: Vec<f64> = means.windows(3).map(|three| (three[1] - 0.5 * (three[0] + three[2])).abs()).collect();
    let median = median(sizes.iter().copied()) / NORMAL_MEDIAN;
    let rms = (sizes.iter().map(|size| size * size).sum::<f64>() / sizes.len().max(1) as f64).sqrt();
    (if median > 0.0 { median } else { rms }) / OF_SECOND_DIFFERENCES.sqrt()
}

/// Half of the step of readings most of which are equal to the one before: noise does not show what lies between two steps. 0 of others.
pub(super) fn rounding_of(readings: &[f64]) -> f64 {
    let mut changes: Vec<f64> = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    changes.sort_by(f64::total_cmp);
    if changes.get(changes.len() / 2).is_none_or(|usual| *usual > 0.0) {
        return 0.0;
    }
    0.5 * changes.into_iter().find(|change| *change > 0.0).unwrap_or_default()
}

/// The first place from which on a course stays within a band about its mean over the last tenth; nothing where it leaves it there.
pub(super) fn stable_after(course: &[f64], band_um: f64) -> Option<usize> {
    let end = course.len() - ((END * course.len() as f64) as usize).max(1);
    let last = course[end..].iter().sum::<f64>() / (course.len() - end) as f64;
    let after = course.iter().rposition(|one| (one - last).abs() > band_um).map_or(0, |place| place + 1);
    (after <= end).then_some(after)
}

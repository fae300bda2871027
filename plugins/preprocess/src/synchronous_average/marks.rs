//! How well marks that are known to a part of a sample give the spindle angle.

use std::f64::consts::TAU;

use runout_core::measurement::Capture;

/// Half of a sample.
const HALF: f64 = 0.5;
/// Places of a sample that differ by less, in samples, are one: marks are written with so many digits.
const ONE_PLACE: f64 = 1e-6;

/// To how many samples the marks of a capture are known: as it says, or to half a sample where turns differ in length and all marks are at one
/// place of a sample, as a counter gives them.
pub(super) fn known_within(capture: &Capture) -> f64 {
    let marks = &capture.marks;
    let Some(first) = marks.first() else { return capture.marks_within_samples };
    let is_one_place = marks.iter().all(|mark| ((mark - first) - (mark - first).round()).abs() < ONE_PLACE);
    let differ = marks.windows(3).any(|three| (three[0] - 2.0 * three[1] + three[2]).abs() > HALF);
    if is_one_place && differ { capture.marks_within_samples.max(HALF) } else { capture.marks_within_samples }
}

/// Standard uncertainty of the angle that the turns between marks are counted from, in rad; 0 for marks that are timed
/// (`within` 0), and without a turn.
///
/// Each mark lies within ±w samples of its place, evenly, with a variance of w²/3. Two shares of it differ. Where the marks scatter about even
/// turns, the sampling has met them at different phases, and that share averages out over the turns. The rest is one
/// offset of all marks. At exactly 500 samples a turn nothing scatters, and the offset may be anything within ±w; at 500.5 the
/// marks scatter by half of a sample, and ±w/2 is left.
pub(super) fn angle_std_rad(marks: &[f64], within: f64) -> f64 {
    let ([first, .., last], true) = (marks, within > 0.0) else { return 0.0 };
    let turns = (marks.len() - 1) as f64;
    let turn_samples = (last - first) / turns;
    let whole = within * within / 3.0;
    let common = (whole - scatter(marks)).max(whole / turns);
    common.sqrt() * TAU / turn_samples
}

/// Standard deviation by which marks that are known to ±`within` samples turn single turns, in rad: no more than they scatter about even
/// turns.
pub(super) fn turn_angle_std_rad(marks: &[f64], within: f64) -> f64 {
    let ([first, .., last], true) = (marks, within > 0.0) else { return 0.0 };
    let turn_samples = (last - first) / (marks.len() - 1) as f64;
    (within * within / 3.0).min(scatter(marks)).sqrt() * TAU / turn_samples
}

/// Mean square of ascending numbers about their least-squares line; 0 of fewer than three.
fn scatter(marks: &[f64]) -> f64 {
    if marks.len() < 3 {
        return 0.0;
    }
    let count = marks.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = marks.iter().sum::<f64>() / count;
    let (mut across, mut along) = (0.0, 0.0);
    for (turn, mark) in marks.iter().enumerate() {
        let step = turn as f64 - middle;
        across += step * (mark - mean);
        along += step * step;
    }
    let rise = across / along;
    let left = |(turn, mark): (usize, &f64)| (mark - mean - rise * (turn as f64 - middle)).powi(2);
    marks.iter().enumerate().map(left).sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks of an even speed, rounded up to the next sample and taken half a sample earlier, as a column of 0 and 1 shows them: their
    /// mean error, over all phases of the first one, has the standard deviation that is stated.
    #[test]
    fn the_mean_error_of_rounded_marks_is_as_stated() {
        for turn_samples in [500.0, 500.5, 500.0 + 1.0 / 3.0, 500.013, 500.237, 499.618] {
            let (mut squares, mut stated) = (0.0, 0.0);
            for phase in 0..1000 {
                let places =
                    (0..=60).map(|turn| 17.0 + 1e-3 * (f64::from(phase) + 0.5) + f64::from(turn) * turn_samples);
                let places: Vec<f64> = places.collect();
                let marks: Vec<f64> = places.iter().map(|place| place.ceil() - 0.5).collect();
                let off =
                    marks.iter().zip(&places).map(|(mark, place)| mark - place).sum::<f64>() / places.len() as f64;
                squares += off * off;
                stated += (angle_std_rad(&marks, 0.5) * turn_samples / TAU).powi(2);
            }
            let ratio = (squares / stated).sqrt();
            // Not above: at worst the stated one is that of marks at random phases, which even turns stay below.
            assert!(ratio < 1.1, "{turn_samples}: {ratio}");
            if [500.0, 500.5].contains(&turn_samples) {
                assert!(ratio > 0.9, "{turn_samples}: {ratio}");
            }
        }
    }

    /// By how much single turns are off their mean, at the angles between the marks: nothing where all marks are off alike, else at most what is
    /// stated and not much less.
    #[test]
    fn single_turns_are_off_by_what_is_stated() {
        for turn_samples in [500.0, 500.5, 500.0 + 1.0 / 3.0, 500.237, 499.618] {
            let places: Vec<f64> = (0..=2000).map(|turn| 17.3 + f64::from(turn) * turn_samples).collect();
            let marks: Vec<f64> = places.iter().map(|place| place.ceil() - 0.5).collect();
            let off: Vec<f64> = marks.iter().zip(&places).map(|(mark, place)| mark - place).collect();
            // Halfway and at quarters between two marks, and at the first.
            let squares = [0.0, 0.25, 0.5, 0.75].map(|share| {
                let of_turns: Vec<f64> = off.windows(2).map(|pair| pair[0] + share * (pair[1] - pair[0])).collect();
                let mean = of_turns.iter().sum::<f64>() / of_turns.len() as f64;
                of_turns.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / of_turns.len() as f64
            });
            let found = (0.25 * squares.iter().sum::<f64>()).sqrt();
            let stated = turn_angle_std_rad(&marks, 0.5) * turn_samples / TAU;
            assert!(found <= 1.01 * stated + 1e-9 && stated <= 2.0 * found + 1e-9, "{turn_samples}: {found} {stated}");
        }
    }

    #[test]
    fn marks_that_are_timed_are_certain() {
        let marks: Vec<f64> = (0..10).map(|turn| 500.0 * f64::from(turn)).collect();
        assert!(angle_std_rad(&marks, 0.0).abs() < f64::MIN_POSITIVE);
        assert!(angle_std_rad(&[], 0.5).abs() < f64::MIN_POSITIVE);
        assert!((angle_std_rad(&marks, 0.5) / (TAU / 500.0 / 12.0_f64.sqrt()) - 1.0).abs() < 1e-12);
    }
}

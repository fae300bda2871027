//! A groove in the form of a section: a keyway or a cross hole that the rig does not declare.

use runout_numerics::statistics::{median, median_absolute_deviation};

/// Depth of a groove over the scatter of the form beside it (from its median absolute deviation): form alone stays below half of it.
const DEEP: f64 = 8.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;
/// A groove takes up less of the turn than this, in degrees.
const WIDEST_DEG: f64 = 40.0;
/// A wall takes this many angles at most from a fifth to four fifths of the depth, or this part of the groove's width.
const STEEP_ANGLES: usize = 3;
const STEEP_SHARE: f64 = 0.25;

/// A groove.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Groove {
    /// Where it begins, in degrees of the part, 0 to 360.
    pub from_deg: f64,
    /// Where it ends; below `from_deg` where it holds 0.
    pub to_deg: f64,
    /// Below the median of the form, in µm.
    pub depth_um: f64,
}

/// The groove in a form over equal angles of the part from 0, where there clearly is one and no other: all that is deeper than half of the
/// deepest place lies within one short arc with steep walls. Angles without a value are no groove.
#[must_use]
pub fn groove(form_um: &[f64]) -> Option<Groove> {
    let count = form_um.len();
    let known: Vec<f64> = form_um.iter().copied().filter(|value| value.is_finite()).collect();
    if known.len() < count || count < 16 {
        return None;
    }
    let level = median(known.iter().copied());
    let depth = |index: usize| level - form_um[index % count];
    let deepest = (0..count).max_by(|a, b| depth(*a).total_cmp(&depth(*b)))?;
    let depth_um = depth(deepest);
    if depth_um <= DEEP * NORMAL * median_absolute_deviation(&known) {
        return None;
    }
    // Steps from the deepest place to both sides.
    let steps = |share: f64, ahead: bool| {
        let at = |step: usize| if ahead { deepest + step } else { deepest + count - step };
        (1..count).find(|step| depth(at(*step)) < share * depth_um)
    };
    let walls = [false, true].map(|ahead| Some([steps(0.8, ahead)?, steps(0.5, ahead)?, steps(0.2, ahead)?]));
    let [Some(before), Some(after)] = walls else { return None };
    let width = before[1] + after[1] - 1;
    let deep = (0..count).filter(|index| depth(*index) >= 0.5 * depth_um).count();
    let steep = STEEP_ANGLES.max((STEEP_SHARE * width as f64) as usize);
    let is_groove = 360.0 * width as f64 <= WIDEST_DEG * count as f64
        && deep == width
        && [before, after].iter().all(|wall| wall[2] - wall[1].min(wall[0]) <= steep);
    let degrees = |index: usize| 360.0 * (index % count) as f64 / count as f64;
    // The first angles that are outside.
    let (from_deg, to_deg) = (degrees(deepest + count - before[2]), degrees(deepest + after[2]));
    is_groove.then_some(Groove { from_deg, to_deg, depth_um })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use runout_numerics::{Complex64, fourier::Fourier};

    use super::*;

    const ANGLES: usize = 1024;

    /// A form of orders 2 to 40 that fall with 1/order, 4 µm rms or so, and a groove, of orders to 127.
    fn form(seed: u64, depth_um: f64, from_deg: f64, to_deg: f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let waves: Vec<(f64, f64, f64)> = (2..=40_u32)
            .map(|order| {
                (f64::from(order), random.random_range(0.0..12.0) / f64::from(order), random.random_range(0.0..TAU))
            })
            .collect();
        let value = |index: usize| {
            let angle = TAU * index as f64 / ANGLES as f64;
            let inside = (angle.to_degrees() - from_deg).rem_euclid(360.0) < (to_deg - from_deg).rem_euclid(360.0);
            let wave = |(order, size, phase): &(f64, f64, f64)| size * (order * angle + phase).cos();
            waves.iter().map(wave).sum::<f64>() - if inside { depth_um } else { 0.0 }
        };
        let mut fourier = Fourier::new(ANGLES);
        let mut harmonics = vec![Complex64::ZERO; 128];
        fourier.analyse((0..ANGLES).map(value), &mut harmonics);
        fourier.synthesise(harmonics).to_vec()
    }

    #[test]
    fn a_groove_is_found_with_its_edges() {
        for (seed, depth_um, from_deg, to_deg) in
            [(1, 100.0, 76.0, 84.0), (2, 300.0, 352.0, 5.0), (3, 80.0, 200.0, 203.0)]
        {
            let found = groove(&form(seed, depth_um, from_deg, to_deg)).unwrap();
            // An order 127 resolves a wall to 360/127 degrees.
            let off = |found: f64, truth: f64| ((found - truth + 180.0).rem_euclid(360.0) - 180.0).abs();
            assert!(off(found.from_deg, from_deg) < 2.9 && off(found.to_deg, to_deg) < 2.9, "{found:?}");
            assert!((found.depth_um / depth_um - 1.0).abs() < 0.4, "{found:?}");
        }
    }

    #[test]
    fn forms_without_a_groove_have_none() {
        for seed in 0..300 {
            assert_eq!(groove(&form(seed, 0.0, 0.0, 1.0)), None, "{seed}");
        }
        // Half of the turn, a smooth dent, two grooves, and no form at all.
        assert_eq!(groove(&form(1, 100.0, 0.0, 180.0)), None);
        let dent = |index: usize| -100.0 * (-((index as f64 - 500.0) / 60.0).powi(2)).exp();
        assert_eq!(groove(&(0..ANGLES).map(dent).collect::<Vec<_>>()), None);
        let (one, other) = (form(1, 100.0, 10.0, 20.0), form(1, 100.0, 200.0, 210.0));
        let both: Vec<f64> = one.iter().zip(&other).map(|(one, other)| one + other).collect();
        assert_eq!(groove(&both), None);
        for nothing in [vec![], vec![0.0; 8], vec![0.0; 64], vec![f64::NAN; 64]] {
            assert_eq!(groove(&nothing), None);
        }
    }
}

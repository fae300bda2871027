//! Crests between the angles at which a profile is known: each highest and lowest of three neighbours is moved to the top of the parabola
//! through them. At six angles a wave, what is left of a crest's error is at most 2.6 % of the wave (1 % in the
//! mean), where its highest point is up to 13 % below it.

use super::{Angles, Points};

/// By how much, in parts of the largest of some errors, they change a crest more than a height: within half a step, the weights of the three heights
/// in a parabola are 1.25 together, without sign. A crest exceeds its highest point by an eighth of the step to one beside it at most, half of this.
pub(super) const LIFT: f64 = 0.25;

/// A height at the top of the parabola through it and its neighbours, where it is no lower (no higher) than both, and how far aside that is in
/// steps; else itself.
pub(super) fn crest([before, here, after]: [f64; 3]) -> (f64, f64) {
    let (ahead, behind) = (here - after, here - before);
    let (bend, rise) = (ahead + behind, behind - ahead);
    // Comparisons with NaN are false: at a gap's end there is no parabola.
    if ahead * behind >= 0.0 && bend != 0.0 {
        (here + rise * rise / (8.0 * bend), 0.5 * rise / bend)
    } else {
        (here, 0.0)
    }
}

/// The height of [`crest`].
pub(super) fn lifted(heights: [f64; 3]) -> f64 {
    crest(heights).0
}

/// Heights with their crests, and how far aside of its angle each is, in rad.
#[derive(Debug, Clone, Default)]
pub(super) struct Crests {
    pub heights: Vec<f64>,
    aside: Vec<f64>,
    angles: Angles,
}

impl Crests {
    /// Of heights and the neighbours of each, steps of so many rad apart.
    pub(crate) fn set(&mut self, heights: impl Iterator<Item = [f64; 3]>, step_rad: f64) {
        self.heights.clear();
        self.aside.clear();
        for heights in heights {
            let (height, aside) = crest(heights);
            self.heights.push(height);
            self.aside.push(step_rad * aside);
        }
    }

    /// Of all heights of a turn.
    pub(crate) fn set_all(&mut self, heights: &[f64]) {
        let count = heights.len();
        let each = (0..count).map(|index| around(index, count).map(|index| heights[index]));
        self.set(each, std::f64::consts::TAU / count as f64);
    }

    /// Puts them among points, at their angles beside these.
    pub(crate) fn set_profile(&mut self, angles: &Angles, points: &mut Points, radius_mm: f64) {
        self.angles.set_aside(angles, &self.aside);
        points.set_profile(&self.angles, &self.heights, radius_mm);
    }
}

/// An angle's number between those of its neighbours.
pub(super) fn around(index: usize, count: usize) -> [usize; 3] {
    [if index == 0 { count - 1 } else { index - 1 }, index, if index + 1 == count { 0 } else { index + 1 }]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// At six angles a wave, wherever they lie beside its crests.
    #[test]
    fn a_crest_between_angles_is_that_of_the_wave() {
        for step in 0..20 {
            let wave: Vec<f64> =
                (0..6).map(|index| (TAU * (f64::from(index) + 0.05 * f64::from(step)) / 6.0).cos()).collect();
            let mut all = Crests::default();
            all.set_all(&wave);
            let (low, high) =
                all.heights.iter().fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(*value), high.max(*value)));
            assert!((high - 1.0).abs() < 0.027 && (low + 1.0).abs() < 0.027, "{step}: {low} {high}");
        }
        let gap = [1.0, 2.0, f64::NAN, 3.0];
        let mut all = Crests::default();
        all.set_all(&gap);
        assert!((all.heights[1] - 2.0).abs() < 1e-15 && all.heights[2].is_nan());
        // A parabola's top is where it is, also as an angle.
        all.set_all(&[0.0, 0.91, 0.99, 0.0]);
        all.set_profile(&Angles::equal(4), &mut Points::default(), 1.0);
        let (sin, cos) = all.angles.sin_cos().nth(2).unwrap_or_default();
        let aside = crest([0.91, 0.99, 0.0]).1 * TAU / 4.0;
        assert!(aside < -0.1 && (sin.atan2(cos).rem_euclid(TAU) - (TAU / 2.0 + aside)).abs() < 0.05);
    }
}

//! Where around a circle there is no surface.

use std::f64::consts::TAU;

/// A stretch is shorter than a circle by more than rounding.
const ROUNDING_RAD: f64 = 1e-9;

/// Stretches of a circle that are left out: a keyway, a cross hole.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gaps {
    /// First angle, 0 to below 2π, and length, both in rad.
    stretches: Vec<[f64; 2]>,
}

impl Gaps {
    /// Leaves out one stretch more, of a length below 2π.
    pub fn add(&mut self, from_rad: f64, length_rad: f64) {
        self.stretches.push([from_rad.rem_euclid(TAU), length_rad]);
    }

    /// First angle, 0 to below 2π, and length of each stretch, both in rad.
    pub fn stretches(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.stretches.iter().copied()
    }

    /// The gaps, each longer by `by_rad` at both ends, and shorter than a circle.
    #[must_use]
    pub fn widened(&self, by_rad: f64) -> Self {
        let mut wider = Self::default();
        for [from, length] in self.stretches() {
            let room = (0.5 * (TAU - length) - ROUNDING_RAD).max(0.0);
            let by_rad = by_rad.clamp(0.0, room);
            wider.add(from - by_rad, length + 2.0 * by_rad);
        }
        wider
    }

    /// Whether nothing is left out.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stretches.is_empty()
    }

    /// The longest stretch, in rad.
    #[must_use]
    pub fn longest_rad(&self) -> f64 {
        self.stretches.iter().map(|[_, length]| *length).fold(0.0, f64::max)
    }

    /// Whether an angle is left out.
    #[must_use]
    pub fn hold(&self, angle_rad: f64) -> bool {
        self.hold_all(angle_rad, 0.0)
    }

    /// Whether everything from an angle on is left out, over a length.
    #[must_use]
    pub fn hold_all(&self, angle_rad: f64, length_rad: f64) -> bool {
        self.stretches.iter().any(|[from, length]| (angle_rad - from).rem_euclid(TAU) + length_rad <= *length)
    }

    /// Of equal angles from 0, whether each is left out.
    pub fn of_equal(&self, angles: usize) -> impl Iterator<Item = bool> + '_ {
        (0..angles).map(move |angle| self.hold(angle as f64 * TAU / angles as f64))
    }

    /// Share of equal angles from 0 that are there.
    #[must_use]
    pub fn coverage(&self, angles: usize) -> f64 {
        if self.is_empty() { 1.0 } else { self.of_equal(angles).filter(|gap| !gap).count() as f64 / angles as f64 }
    }

    /// Takes out of values on equal angles from 0 what is left out: NaN.
    pub fn blank(&self, values: &mut [f64]) {
        if !self.is_empty() {
            let count = values.len();
            values
                .iter_mut()
                .zip(self.of_equal(count))
                .filter(|(_, gap)| *gap)
                .for_each(|(value, _)| *value = f64::NAN);
        }
    }

    /// The gaps on a circle whose angle is `origin_rad` where this one's is 0, running forwards or (−1) backwards.
    #[must_use]
    pub fn seen_from(&self, origin_rad: f64, direction: f64) -> Self {
        let mut seen = Self::default();
        for [from, length] in &self.stretches {
            let first = if direction < 0.0 { from + length } else { *from };
            seen.add(origin_rad + direction * first, *length);
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keyway() -> Gaps {
        let mut gaps = Gaps::default();
        gaps.add(350_f64.to_radians(), 20_f64.to_radians());
        gaps
    }

    #[test]
    fn stretches_pass_through_zero() {
        let gaps = keyway();
        for (angle_deg, inside) in
            [(349.9, false), (350.1, true), (0.0, true), (9.9, true), (10.1, false), (-5.0, true)]
        {
            assert_eq!(gaps.hold(f64::to_radians(angle_deg)), inside, "{angle_deg}°");
        }
        assert!(gaps.hold_all(355_f64.to_radians(), 0.2) && !gaps.hold_all(355_f64.to_radians(), 0.3));
        assert!((gaps.coverage(3600) - 340.0 / 360.0).abs() < 1e-3);
    }

    #[test]
    fn widened_stretches_hold_what_is_beside_them() {
        let gaps = keyway().widened(1_f64.to_radians());
        for (angle_deg, inside) in [(348.9, false), (349.1, true), (10.9, true), (11.1, false)] {
            assert_eq!(gaps.hold(f64::to_radians(angle_deg)), inside, "{angle_deg}°");
        }
        assert!(keyway().widened(9.0).longest_rad() < TAU);
        assert_eq!(keyway().widened(0.0), keyway());
    }

    #[test]
    fn values_there_are_no_numbers() {
        let mut values = [1.0; 36];
        keyway().blank(&mut values);
        let missing: Vec<usize> = (0..36).filter(|angle| values[*angle].is_nan()).collect();
        assert_eq!(missing, [0, 1, 35]);
    }

    #[test]
    fn a_sensor_sees_them_when_the_part_has_turned() {
        // α = θ − Φ at θ = 90°: part angles 350° to 10° come by at Φ = 80° to 100°.
        let seen = keyway().seen_from(90_f64.to_radians(), -1.0);
        for (angle_deg, inside) in [(79.9, false), (80.1, true), (99.9, true), (100.1, false)] {
            assert_eq!(seen.hold(f64::to_radians(angle_deg)), inside, "{angle_deg}°");
        }
    }
}

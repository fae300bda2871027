//! What a reading has of the form under its sensor: all of it, or its mean over the arc of the sensor's spot.

use runout_core::Complex64;

use super::{Layout, Reading, View};
use crate::alterations::{Pattern, PatternOf};

impl Reading {
    /// Share of a form's order that the reading has: sinc(n·w/2R) of a spot as wide as w. At order 1, form is how the part is clamped, which
    /// moves all of the arc.
    #[must_use]
    pub fn form_share(&self, order: usize) -> f64 {
        if self.spot_rad2 == 0.0 || order < 2 { 1.0 } else { spot(order, self.spot_rad2)[0] }
    }

    /// ∂ln(share)/∂(squared width of the spot in rad²).
    #[must_use]
    pub fn form_share_slope(&self, order: usize) -> f64 {
        if order < 2 {
            return 0.0;
        }
        let [share, slope] = spot(order, self.spot_rad2);
        slope / share
    }

    /// Whether it sees the section's form in a way of its own.
    #[must_use]
    pub fn has_own_profile(&self) -> bool {
        self.spot_rad2 != 0.0 || self.patterns.iter().any(|pattern| pattern.is_form)
    }
}

/// What a reading has besides the form of its section and the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPattern {
    /// Per turn.
    pub order: usize,
    /// As it is on the part under the reading, as a form's unknown.
    pub value: Complex64,
    /// Whether it is on the surface: where the axis moves across the sensor, it sees another place of it.
    pub is_form: bool,
}

/// Radial sensors of a section from which on motion does not absorb what each of them sees of its own.
pub(crate) const ENOUGH: usize = 3;

impl Layout {
    /// Radial sensors of a section.
    #[must_use]
    pub(crate) fn radial_sensors(&self, section: usize) -> usize {
        let radial = |reading: &&Reading| reading.setup == 0 && !reading.view.is_axial();
        self.readings.iter().filter(radial).filter(|reading| reading.section == section).count()
    }

    /// A pattern as it is on the part under a reading, as a form's unknown; 0 where the reading does not have it.
    pub(crate) fn on_part(&self, reading: &Reading, pattern: &Pattern) -> Complex64 {
        let along = |share: f64| {
            let moves = self.motion_sign(reading.setup, pattern.order) * reading.motion_ratio * share;
            Complex64::new(pattern.cosine, pattern.sine) * moves / self.part_phase(reading, pattern.order)
        };
        if reading.view.is_axial() {
            return Complex64::ZERO;
        }
        // A chuck is at β less on the part than on the spindle.
        let on_spindle = reading.angle_rad - reading.part_angle_rad;
        let turned_rad = match pattern.of {
            PatternOf::Spindle => on_spindle,
            PatternOf::Setup(setup) if setup == reading.setup => 0.0,
            PatternOf::Sensor(sensor) if sensor == reading.sensor => 0.0,
            PatternOf::SensorOnSpindle(sensor) if sensor == reading.sensor => on_spindle,
            PatternOf::MotionX(setup) if setup == reading.setup => return along(reading.angle_rad.cos()),
            PatternOf::MotionY(setup) if setup == reading.setup => return along(reading.angle_rad.sin()),
            _ => return Complex64::ZERO,
        };
        self.of_part(Complex64::new(pattern.cosine, -pattern.sine) * Complex64::cis(pattern.order as f64 * turned_rad))
    }

    /// Takes out of displacements, `[order][reading]`, what readings have besides form.
    pub(crate) fn take_out_patterns(&self, displacements: &mut [Complex64]) {
        let count = self.readings.len();
        for (index, reading) in self.readings.iter().enumerate() {
            for SeenPattern { order, value, .. } in &reading.patterns {
                if let Some(displacement) = displacements.get_mut(order * count + index) {
                    *displacement -= value * self.part_phase(reading, *order);
                }
            }
        }
    }

    /// What a reading sees of a unit of its section's form: the [phase](Self::part_phase) with the share of its spot, 1 on the axis.
    #[must_use]
    pub fn form_phase(&self, reading: &Reading, order: usize) -> Complex64 {
        if reading.view == View::OnAxis {
            Complex64::ONE
        } else {
            self.part_phase(reading, order) * reading.form_share(order)
        }
    }
}

/// Mean of cos(nδ) over an arc of the squared width q, and its derivative by q: sin x / x with x² = n²q/4. Of a negative q it is the
/// continuation sinh x / x, which a fit passes through on its way to a small width.
fn spot(order: usize, squared_rad2: f64) -> [f64; 2] {
    let times = 0.25 * (order * order) as f64;
    let square = times * squared_rad2;
    let x = square.abs().sqrt();
    let [share, slope] = if x < 0.1 {
        // What the series leave out is below 1e-14.
        let share = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)));
        let slope = -1.0 / 6.0 + square / 60.0 * (1.0 - square / 28.0 * (1.0 - square / 54.0));
        [share, slope]
    } else if square > 0.0 {
        let share = x.sin() / x;
        [share, (x.cos() - share) / (2.0 * square)]
    } else {
        let share = x.sinh() / x;
        [share, (x.cosh() - share) / (2.0 * square)]
    };
    [share, slope * times]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the mean itself, and the derivative against differences, on both sides of where the series ends.
    #[test]
    fn a_share_is_the_mean_over_the_arc() {
        for (order, width_rad) in [(2, 0.01), (5, 0.039), (5, 0.041), (40, 0.1), (60, 0.1), (100, 0.1)] {
            let count = 20_000;
            let at = |index: i32| f64::from(order) * width_rad * ((f64::from(index) + 0.5) / f64::from(count) - 0.5);
            let mean = (0..count).map(|index| at(index).cos()).sum::<f64>() / f64::from(count);
            let of = |squared: f64| spot(order as usize, squared)[0];
            let squared = width_rad * width_rad;
            // The rule of the mean is good to x²/6 over the square of its points.
            assert!((of(squared) - mean).abs() < 1e-8, "{order} {width_rad}");
            let step = 1e-4 * squared;
            let slope = (of(squared + step) - of(squared - step)) / (2.0 * step);
            let stated = spot(order as usize, squared)[1];
            assert!((slope / stated - 1.0).abs() < 1e-5, "{order} {width_rad}: {slope} {stated}");
        }
        let [before, after] = [-1e-12, 1e-12].map(|squared| spot(300, squared));
        assert!((before[0] - after[0]).abs() < 1e-7 && (before[1] / after[1] - 1.0).abs() < 1e-7);
    }
}

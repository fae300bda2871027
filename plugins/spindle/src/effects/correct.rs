//! Readings converted to displacements, with the effects that are applied.

use runout_core::{Complex64, numerics::fourier::Fourier};

use crate::{
    alterations::{Alterations, CrossTalk, SensorAlteration, SetupAlteration},
    layout::{Layout, Reading},
    solve::{OVERSAMPLING, Readings, interpolate},
};

impl Alterations {
    /// Everything as declared.
    #[must_use]
    pub fn none(layout: &Layout) -> Self {
        let count = |of: fn(&Reading) -> usize| layout.readings.iter().map(of).max().map_or(0, |m| m + 1);
        Self {
            sensors: vec![SensorAlteration::NONE; count(|reading| reading.sensor)],
            setups: vec![SetupAlteration::default(); count(|reading| reading.setup)],
            places: (0..count(|reading| reading.sensor)).collect(),
            swapped_in: Vec::new(),
            clampings: (0..count(|reading| reading.setup)).collect(),
            declared_signs: layout.declared_signs(),
            curvature: 0.0,
            rotation_reversed: false,
            part_angles_reversed: false,
            sensor_angles_reversed: false,
            axial_um: Vec::new(),
            patterns: Vec::new(),
            cross_talk: Vec::new(),
            lines: Vec::new(),
            even_order_motion: false,
            exact_geometry: false,
        }
    }

    /// Reading over displacement at an order.
    #[must_use]
    pub fn response(&self, reading: &Reading, order: usize) -> Complex64 {
        self.sensors[reading.sensor].response(reading.setup, order)
    }

    /// Slope of the characteristic, reading over displacement, in the mean over the turn, `[reading]`: what noise of a reading is in its
    /// displacement. `displacements` are `[order][reading]` from order 0.
    pub(crate) fn slopes(&self, layout: &Layout, displacements: &[Complex64]) -> Vec<f64> {
        let count = layout.readings.len();
        let of = |(index, reading): (usize, &Reading)| {
            let sensor = &self.sensors[reading.sensor];
            if sensor.quadratic_per_um == 0.0 && sensor.cubic_per_um2 == 0.0 {
                return 1.0;
            }
            let mut orders = displacements.iter().skip(index).step_by(count);
            let level = orders.next().map_or(0.0, |level| level.re);
            let square = level * level + 0.5 * orders.map(Complex64::norm_sqr).sum::<f64>();
            1.0 + 2.0 * sensor.quadratic_per_um * level + 3.0 * sensor.cubic_per_um2 * square
        };
        layout.readings.iter().enumerate().map(of).collect()
    }

    /// What displacements of an order are recorded as, `[reading]`.
    pub(crate) fn recorded(&self, layout: &Layout, order: usize, displacements: &[Complex64]) -> Vec<Complex64> {
        let mut recorded = displacements.to_vec();
        let sensors = self.sensors.len();
        for readings in recorded.chunks_exact_mut(sensors) {
            let last_first = self.cross_talk.iter().rev();
            last_first.for_each(|CrossTalk { from, to, share }| readings[*to] += readings[*from] * *share);
        }
        recorded.iter_mut().zip(&layout.readings).for_each(|(value, reading)| {
            if self.setups[reading.setup].backwards {
                *value = value.conj();
            }
            *value *= self.response(reading, order);
        });
        recorded
    }

    /// Takes averaged readings (`[order][reading]`, orders from 0) back to displacements: creep, gain and
    /// low-pass, characteristic, angle.
    pub(crate) fn correct(&self, layout: &Layout, readings: &mut Readings) {
        let count = layout.readings.len();
        let mut curve = Curve::new(readings.samples_per_rev);
        let (mean, turn_angles) = (&mut readings.mean, &readings.turn_angles);
        for (index, reading) in layout.readings.iter().enumerate() {
            let sensor = &self.sensors[reading.sensor];
            let angles = turn_angles.get(reading.setup).copied().unwrap_or_default();
            let share = sensor.creep_share(reading.setup);
            for (order, row) in mean.chunks_exact_mut(count).enumerate() {
                let value = &mut row[index];
                *value -= sensor.creep_um * share * creep(order, angles);
                *value /= self.response(reading, order);
                if self.setups[reading.setup].backwards {
                    *value = value.conj();
                }
            }
            let curved = sensor.quadratic_per_um != 0.0 || sensor.cubic_per_um2 != 0.0;
            let setup = &self.setups[reading.setup];
            if curved || !setup.ripples.is_empty() {
                let harmonics = mean.iter().skip(index).step_by(count).copied();
                let harmonics: Vec<Complex64> = if setup.ripples.is_empty() {
                    curve.mapped(harmonics, |_, value| sensor.straightened(value))
                } else {
                    let straight = curve.mapped(harmonics, |_, value| sensor.straightened(value));
                    curve.at_angles(&straight, |angle| setup.recorded_at(angle))
                };
                mean.iter_mut().skip(index).step_by(count).zip(harmonics).for_each(|(to, from)| *to = from);
            }
        }
        self.take_out_cross_talk(&mut readings.mean);
        layout.take_out_patterns(&mut readings.mean);
        let slopes = self.slopes(layout, &readings.mean);
        self.correct_covariance(readings, &slopes);
    }

    /// Takes what channels read of others out of displacements (`[order][reading]`). What cross-talk of cross-talk is, a share of a share, is
    /// taken out one after the other.
    fn take_out_cross_talk(&self, mean: &mut [Complex64]) {
        if self.cross_talk.is_empty() {
            return;
        }
        for readings in mean.chunks_exact_mut(self.sensors.len()) {
            self.cross_talk.iter().for_each(|CrossTalk { from, to, share }| readings[*to] -= readings[*from] * *share);
        }
    }

    /// E[δ δᴴ] of displacements: that of the readings over what they respond with, without shares of others.
    fn correct_covariance(&self, readings: &mut Readings, slopes: &[f64]) {
        let sensors = self.sensors.len();
        for (setup, matrices) in readings.covariance.iter_mut().flatten().enumerate() {
            for (order, matrix) in matrices.chunks_exact_mut(sensors * sensors).enumerate() {
                let of_sensors = self.sensors.iter().zip(&slopes[setup * sensors..]);
                let responses: Vec<Complex64> =
                    of_sensors.map(|(sensor, slope)| sensor.response(setup, order) * slope).collect();
                for (row, one) in matrix.chunks_exact_mut(sensors).zip(&responses) {
                    row.iter_mut().zip(&responses).for_each(|(entry, other)| *entry /= one * other.conj());
                }
                if self.setups[setup].backwards {
                    matrix.iter_mut().for_each(|entry| *entry = entry.conj());
                }
                for CrossTalk { from, to, share } in &self.cross_talk {
                    (0..sensors)
                        .for_each(|other| matrix[to * sensors + other] -= matrix[from * sensors + other] * *share);
                    (0..sensors)
                        .for_each(|other| matrix[other * sensors + to] -= matrix[other * sensors + from] * *share);
                }
            }
        }
    }
}

/// Harmonic of Φ/2π − ½ over a turn, of Re Σ c e^{−inΦ}, taken at L equal angles from 0: −(1 + i·cot(πn/L))/L. Many angles make
/// it −i/(πn), the saw-tooth's; few fold its higher orders onto all others, as if the first of them were read too low by half
/// of the step.
#[must_use]
pub fn creep(order: usize, angles: usize) -> Complex64 {
    if order == 0 || angles < 2 * order {
        return Complex64::ZERO;
    }
    let count = angles as f64;
    -Complex64::new(1.0, (std::f64::consts::PI * order as f64 / count).tan().recip()) / count
}

/// One reading over the turn, for what is not linear in its harmonics.
pub(crate) struct Curve {
    turn: Fourier,
    fine: Fourier,
}

impl Curve {
    /// On as many angles as the readings have, or four times as many.
    #[must_use]
    pub(crate) fn new(samples_per_rev: usize) -> Self {
        Self { turn: Fourier::new(samples_per_rev), fine: Fourier::new(samples_per_rev * OVERSAMPLING) }
    }

    /// Harmonics of a function of angle and value; products of two orders do not fold, since the grid is fine.
    pub(crate) fn mapped(
        &mut self,
        harmonics: impl ExactSizeIterator<Item = Complex64>,
        map: impl Fn(f64, f64) -> f64,
    ) -> Vec<Complex64> {
        let mut found = vec![Complex64::ZERO; harmonics.len()];
        let values = self.fine.synthesise(harmonics.map(|value| value.conj())).to_vec();
        let step = std::f64::consts::TAU / values.len() as f64;
        let mapped = values.iter().enumerate().map(|(index, value)| map(index as f64 * step, *value));
        self.fine.analyse(mapped, &mut found);
        found.into_iter().map(|value| value.conj()).collect()
    }

    /// Harmonics of the same curve at other angles.
    fn at_angles(&mut self, harmonics: &[Complex64], angle: impl Fn(f64) -> f64) -> Vec<Complex64> {
        let table = self.fine.synthesise(harmonics.iter().map(Complex64::conj)).to_vec();
        let samples = self.turn.length();
        let mut found = vec![Complex64::ZERO; harmonics.len()];
        let step = std::f64::consts::TAU / samples as f64;
        self.turn.analyse((0..samples).map(|index| interpolate(&table, angle(index as f64 * step))), &mut found);
        found.into_iter().map(|value| value.conj()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the transform of the ramp itself, as the average makes it of every turn.
    #[test]
    fn a_creep_is_what_a_ramp_at_equal_angles_is_taken_apart_into() {
        for angles in [64, 90, 512] {
            let mut found = vec![Complex64::ZERO; angles / 2];
            Fourier::new(angles).analyse((0..angles).map(|angle| angle as f64 / angles as f64 - 0.5), &mut found);
            for (order, value) in found.iter().enumerate().skip(1) {
                // Rounding of a sum of that many numbers below 1.
                assert!((value.conj() - creep(order, angles)).norm() < 1e-14, "order {order} of {angles}");
            }
        }
        let saw_tooth = Complex64::new(0.0, -1.0 / (7.0 * std::f64::consts::PI));
        assert!((creep(7, 1_000_000) - saw_tooth).norm() < 2e-6);
    }
}

//! What effects change: where sensors and part truly are, how readings follow from displacements.

use std::{fmt, sync::Arc};

use runout_core::{Complex64, numerics::fourier::Fourier, rig};

use crate::{
    layout::Layout,
    separators::{OVERSAMPLING, Readings, interpolate},
};

/// Everything that effects change, at its declared value until one does.
#[derive(Debug, Clone)]
#[allow(clippy::struct_excessive_bools, reason = "each is an effect that is there or not")]
pub struct Alterations {
    /// One entry a sensor.
    pub sensors: Vec<SensorAlteration>,
    /// One entry a setup.
    pub setups: Vec<SetupAlteration>,
    /// Motion along the axis, in µm.
    pub axial_um: Vec<Harmonic>,
    /// Lines of the turns' spectrum that are taken out of the averages, by number: of a sensor (the first of those that have it), or of
    /// the axis.
    pub lines: Vec<(usize, Option<usize>)>,
    /// Of each channel, the sensor whose declared place it has.
    pub places: Vec<usize>,
    /// Of each setup, the one whose declared clamping it has.
    pub clampings: Vec<usize>,
    /// As the rig declares them, one a sensor: ±1.
    pub declared_signs: Vec<f64>,
    /// Whether the part turns the other way than declared.
    pub rotation_reversed: bool,
    /// Whether the part's angles count the other way than declared.
    pub part_angles_reversed: bool,
    /// Whether motion keeps the sign of even orders, where the separator assumes otherwise.
    pub even_order_motion: bool,
    /// Whether geometry is exact, where the separator leaves it linear.
    pub exact_geometry: bool,
}

/// One sensor.
#[derive(Debug, Clone)]
pub struct SensorAlteration {
    /// −1 where readings have the opposite sign to that declared, else +1.
    pub sign: f64,
    /// Relative gain less 1.
    pub gain: f64,
    /// True less declared angle, in rad.
    pub angle_rad: f64,
    /// True less declared axial position, in mm.
    pub z_mm: f64,
    /// The same, as far as the sensor sees another circle of the part there, in mm.
    pub circle_mm: f64,
    /// Reading = u + quadratic·u² + cubic·u³, in 1/µm.
    pub quadratic_per_um: f64,
    /// In 1/µm².
    pub cubic_per_um2: f64,
    /// Creep over the averaged turn, in µm.
    pub creep_um: f64,
    /// In each setup, creep over the turns at hand, over that which `creep_um` is meant for; 1 without it.
    pub creep_shares: Vec<f64>,
    /// Reciprocal of the order at which a first-order low-pass is −3 dB.
    pub inverse_cutoff: f64,
    /// What a channel does besides, order by order: for effects of other crates.
    pub transfers: Vec<Transfer>,
}

/// Reading over displacement at an order, never 0: any linear change of a channel.
#[derive(Clone)]
pub struct Transfer(Arc<dyn Fn(usize) -> Complex64 + Send + Sync>);

impl Transfer {
    /// By a function of the order.
    pub fn new(of: impl Fn(usize) -> Complex64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(of))
    }
}

impl fmt::Debug for Transfer {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "Transfer(… {} at order 1 …)", (self.0)(1))
    }
}

/// One setup.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SetupAlteration {
    /// True less declared angle of the part, in rad.
    pub part_rad: f64,
    /// True less declared angle of all sensors, in rad.
    pub sensors_rad: f64,
    /// Motion over that of the first setup, less 1.
    pub motion: f64,
    /// Uneven speed within the turn.
    pub ripples: Vec<Harmonic>,
}

/// cosine·cos(order·Φ) + sine·sin(order·Φ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Per turn.
    pub order: usize,
    /// Amplitude of the cosine.
    pub cosine: f64,
    /// Amplitude of the sine.
    pub sine: f64,
}

impl Harmonic {
    /// Its value.
    #[must_use]
    pub fn at(&self, angle_rad: f64) -> f64 {
        let (sine, cosine) = (self.order as f64 * angle_rad).sin_cos();
        self.cosine * cosine + self.sine * sine
    }
}

impl Alterations {
    /// Everything as declared.
    #[must_use]
    pub fn none(layout: &Layout) -> Self {
        let count =
            |of: fn(&crate::layout::Reading) -> usize| layout.readings.iter().map(of).max().map_or(0, |m| m + 1);
        Self {
            sensors: vec![SensorAlteration::NONE; count(|reading| reading.sensor)],
            setups: vec![SetupAlteration::default(); count(|reading| reading.setup)],
            places: (0..count(|reading| reading.sensor)).collect(),
            clampings: (0..count(|reading| reading.setup)).collect(),
            declared_signs: layout.declared_signs(),
            rotation_reversed: false,
            part_angles_reversed: false,
            axial_um: Vec::new(),
            lines: Vec::new(),
            even_order_motion: false,
            exact_geometry: false,
        }
    }

    /// Whether all values are such that readings can be taken back to displacements.
    #[must_use]
    pub fn are_possible(&self) -> bool {
        let sensor = |sensor: &SensorAlteration| {
            sensor.gain.abs() < 0.9 && sensor.angle_rad.abs() < 0.5 && sensor.inverse_cutoff > -0.1
        };
        let steepness = |setup: &SetupAlteration| -> f64 {
            setup.ripples.iter().map(|ripple| ripple.order as f64 * ripple.cosine.hypot(ripple.sine)).sum()
        };
        let setup = |setup: &SetupAlteration| {
            let angles = [setup.part_rad, setup.sensors_rad];
            angles.iter().all(|angle| angle.abs() < 0.5) && setup.motion > -0.95 && steepness(setup) < 0.5
        };
        let numbers = self.sensors.iter().flat_map(|s| [s.quadratic_per_um, s.cubic_per_um2, s.creep_um, s.z_mm]);
        self.sensors.iter().all(sensor) && self.setups.iter().all(setup) && numbers.into_iter().all(f64::is_finite)
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
                *value /= sensor.response(order);
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
    }
}

impl SetupAlteration {
    /// The angle at which the recording believes to be when the spindle is at this one: φ + ε(φ) = Φ, with ε 0 at the marks.
    fn recorded_at(&self, angle_rad: f64) -> f64 {
        let early = |angle: f64| self.ripples.iter().map(|ripple| ripple.at(angle) - ripple.cosine).sum::<f64>();
        let mut recorded = angle_rad;
        // A contraction by order·amplitude a round: 0.01 or so.
        for _ in 0..6 {
            recorded = angle_rad - early(recorded);
        }
        recorded
    }
}

impl SensorAlteration {
    /// A sensor as declared.
    pub const NONE: Self = Self {
        sign: 1.0,
        gain: 0.0,
        angle_rad: 0.0,
        z_mm: 0.0,
        circle_mm: 0.0,
        quadratic_per_um: 0.0,
        cubic_per_um2: 0.0,
        creep_um: 0.0,
        creep_shares: Vec::new(),
        inverse_cutoff: 0.0,
        transfers: Vec::new(),
    };

    /// Reading over displacement at an order: gain, low-pass and what else the channel does.
    #[must_use]
    pub fn response(&self, order: usize) -> Complex64 {
        let known = self.sign * (1.0 + self.gain) / Complex64::new(1.0, -(order as f64) * self.inverse_cutoff);
        self.transfers.iter().fold(known, |response, transfer| response * (transfer.0)(order))
    }

    /// Creep in a setup, over that which `creep_um` is meant for.
    #[must_use]
    pub fn creep_share(&self, setup: usize) -> f64 {
        self.creep_shares.get(setup).copied().unwrap_or(1.0)
    }

    /// u from u + quadratic·u² + cubic·u³; the reading itself where that cannot be had.
    fn straightened(&self, reading_um: f64) -> f64 {
        rig::straightened(reading_um, self.quadratic_per_um, self.cubic_per_um2).unwrap_or(reading_um)
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
pub struct Curve {
    turn: Fourier,
    fine: Fourier,
}

impl Curve {
    /// On as many angles as the readings have, or four times as many.
    #[must_use]
    pub fn new(samples_per_rev: usize) -> Self {
        Self { turn: Fourier::new(samples_per_rev), fine: Fourier::new(samples_per_rev * OVERSAMPLING) }
    }

    /// Harmonics of a function of angle and value; products of two orders do not fold, since the grid is fine.
    pub fn mapped(
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

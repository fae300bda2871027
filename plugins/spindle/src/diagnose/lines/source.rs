//! Where a line comes from: a motion of the axis, which all sensors see as one displacement and tilt, or single channels.

use runout_core::{Complex64, numerics::least_squares::orthonormal};

use crate::layout::{Layout, UM_PER_MM_URAD};

/// Share of a line by which sensors may read it wrongly: gains and angles are not known better before they are fitted.
const TOLERANCE: f64 = 0.05;
/// Square of what a source leaves, over its noise, up to which it fits.
const FITS: f64 = 4.0;
/// A channel has a line from this many standard deviations of its noise, and from this share of the largest channel's.
const SEEN: (f64, f64) = (4.0, 0.1);

/// A direction of motion that adds less than this to those before it, relative: sensors at nearly the same place and angle see
/// no tilt.
const DIRECTION: f64 = 1e-3;

/// Where a line comes from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    /// A motion of the axis; `common` where all channels have it with the same amplitude and phase, as by pick-up in all of them.
    Motion { common: bool },
    /// These channels; `motion` where a displacement along them would look the same.
    Sensors { channels: Vec<usize>, motion: bool },
}

/// A hypothesis on a line: columns `[column][reading]` of each setup.
struct Hypothesis {
    /// Sum of squares that it leaves, over their noise, in each setup.
    left: f64,
    /// Complex parameters, and observations.
    parameters: usize,
    observations: usize,
}

impl Hypothesis {
    fn fits(&self) -> bool {
        self.observations <= self.parameters || self.left <= FITS * (self.observations - self.parameters) as f64
    }

    /// Half of the Bayesian information criterion: noise is that of complex numbers.
    fn information(&self) -> f64 {
        self.left + self.parameters as f64 * ((2 * self.observations) as f64).ln()
    }
}

/// From the amplitudes of a line, `[setup][channel]`, and the variance of their noise in each channel; `signs` are those of the
/// sensors.
pub(super) fn source(found: &[Vec<Complex64>], noise: &[f64], layout: &Layout, signs: &[f64]) -> Source {
    let sensors = noise.len();
    let hypothesis = |columns: &dyn Fn(usize) -> Vec<Vec<f64>>| {
        let mut all = Hypothesis { left: 0.0, parameters: 0, observations: 0 };
        let mean_noise = noise.iter().sum::<f64>() / sensors.max(1) as f64;
        for (setup, amplitudes) in found.iter().enumerate() {
            let power = amplitudes.iter().map(Complex64::norm_sqr).sum::<f64>() / sensors.max(1) as f64;
            let basis = orthonormal(columns(setup), &[], DIRECTION);
            let mut left = amplitudes.clone();
            for column in &basis {
                let share: Complex64 = left.iter().zip(column).map(|(value, entry)| value * *entry).sum();
                left.iter_mut().zip(column).for_each(|(value, entry)| *value -= share * *entry);
            }
            let square = (mean_noise + TOLERANCE * TOLERANCE * power).max(f64::MIN_POSITIVE);
            all.left += left.iter().map(Complex64::norm_sqr).sum::<f64>() / square;
            all.parameters += basis.len();
            all.observations += sensors;
        }
        all
    };
    let readings = |setup: usize| layout.readings.iter().filter(move |reading| reading.setup == setup);
    let displacement = |setup: usize| {
        let across = |reading: &crate::layout::Reading, entry: f64| if reading.view.is_axial() { 0.0 } else { entry };
        let of = |part: fn(f64) -> f64| {
            readings(setup).map(|reading| across(reading, part(reading.angle_rad))).collect::<Vec<f64>>()
        };
        let mut columns = vec![of(f64::cos), of(f64::sin)];
        if readings(setup).any(|reading| reading.view.is_axial()) {
            columns.push(readings(setup).map(|reading| f64::from(reading.view.is_axial())).collect());
        }
        columns
    };
    let tilted = |setup: usize| {
        let tilt = |part: fn(f64) -> f64| {
            let of = |reading: &crate::layout::Reading| part(reading.angle_rad) * reading.lever_mm * UM_PER_MM_URAD;
            readings(setup).map(of).collect::<Vec<f64>>()
        };
        let mut columns = displacement(setup);
        columns.extend([tilt(f64::cos), tilt(f64::sin)]);
        columns
    };
    let alone = |channel: usize| {
        hypothesis(&|_| vec![(0..sensors).map(|other| if other == channel { 1.0 } else { 0.0 }).collect()])
    };
    let common = hypothesis(&|_| vec![signs.to_vec()]);
    let straight = hypothesis(&displacement);
    let motion = [hypothesis(&displacement), hypothesis(&tilted)];
    let best_motion = motion.into_iter().min_by(|a, b| a.information().total_cmp(&b.information()));
    let single = (0..sensors).map(|channel| (channel, alone(channel)));
    let single = single.min_by(|a, b| a.1.information().total_cmp(&b.1.information()));
    let (Some(best_motion), Some((channel, single))) = (best_motion, single) else {
        return Source::Motion { common: false };
    };
    // One sensor alone says nothing of what others would see.
    if single.fits() && (single.information() <= best_motion.information() || !best_motion.fits()) {
        return Source::Sensors { channels: vec![channel], motion: straight.fits() };
    }
    if best_motion.fits() {
        return Source::Motion { common: common.fits() };
    }
    let power: Vec<f64> = (0..sensors)
        .map(|channel| found.iter().map(|setup| setup[channel].norm_sqr()).sum::<f64>() / found.len().max(1) as f64)
        .collect();
    let largest = power.iter().copied().fold(0.0, f64::max);
    let has = |channel: &usize| {
        power[*channel] > (SEEN.0 * SEEN.0 * noise[*channel]).max(SEEN.1 * SEEN.1 * largest)
            || power[*channel] >= largest
    };
    Source::Sensors { channels: (0..sensors).filter(has).collect(), motion: false }
}

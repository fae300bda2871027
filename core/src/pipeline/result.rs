//! What a run knows of one station.

use super::evaluate::{Evaluate, missing_circles, section_values};
use crate::{
    Complex64,
    evaluate::Value,
    measurement::StationTruth,
    numerics::fourier::Fourier,
    profile::Profile,
    rig::Rig,
    separation::{Quantity, Separation, UM_PER_MM_URAD},
};

/// One station, done.
#[derive(Debug, Clone, PartialEq)]
pub struct StationResult {
    /// Its name.
    pub station: String,
    /// Carriage position, in mm.
    pub z_mm: f64,
    /// Equal angles on which form and motion are given.
    pub angles: usize,
    /// Form and motion.
    pub separation: Separation,
    /// The averages that it came from; empty for measured points.
    pub profiles: Vec<Profile>,
    /// The standards' values, section by section.
    pub values: Vec<Vec<Value>>,
    /// Error motion values of the axis; empty where no spread over the turns is known.
    pub motion_values: Vec<Value>,
    /// What the recording says is true.
    pub truth: Option<StationTruth>,
}

impl StationResult {
    /// The lowest order of which a filter before the averages passes half; `None` without one.
    #[must_use]
    pub fn half_power_upr(&self) -> Option<f64> {
        let of = |profile: &Profile| {
            let speed_rpm = profile.speed_rpm?;
            let orders = profile.responses.iter().map(|response| response.half_power_hz * 60.0 / speed_rpm);
            orders.reduce(f64::min)
        };
        self.profiles.iter().filter_map(of).reduce(f64::min)
    }

    /// Root mean square of a section's form over the orders from 2 that can be told, and its standard uncertainty, in µm.
    ///
    /// rms² = ½ Σ|c|², so that errors δ of no favoured phase give u² = Σ|c|² E|δ|² / (8 rms²); NaN where no variance is known.
    /// `None` where nothing can be told.
    #[must_use]
    pub fn form_rms_um(&self, section: usize) -> Option<(f64, f64)> {
        let separation = &self.separation;
        let unknown = separation.position(Quantity::Form(section)).filter(|unknown| !separation.is_lost(*unknown))?;
        let squares = || separation.coefficients(unknown).skip(2).map(|value| value.norm_sqr());
        let rms = (0.5 * squares().sum::<f64>()).sqrt();
        let variance = separation.variance.iter().skip(unknown).step_by(separation.unknowns.len()).skip(2);
        let errors = squares().zip(variance).filter(|(square, _)| *square > 0.0);
        let spread: f64 = errors.map(|(square, variance)| square * variance).sum();
        Some((rms, (spread / 8.0).sqrt() / rms))
    }

    /// One unknown on [`angles`](Self::angles) equal angles from 0: form over the part's, motion over the spindle's.
    /// Orders that the layout cannot tell are left out; where nothing is known, values are NaN.
    #[must_use]
    pub fn over_angle(&self, unknown: usize) -> Vec<f64> {
        let quantity = self.separation.unknowns[unknown];
        if self.separation.is_lost(unknown) {
            return vec![f64::NAN; self.angles];
        }
        let turned = |value: Complex64| if quantity.is_form() { value } else { value.conj() };
        let mut values =
            Fourier::new(self.angles).synthesise(self.separation.coefficients(unknown).map(turned)).to_vec();
        if let Quantity::Form(section) = quantity {
            self.separation.sections[section].gaps.blank(&mut values);
        }
        values
    }
}

/// Which of the standards' values a part of some nominal radius gets, and the rig that tells where it is interrupted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluation<'a> {
    pub evaluate: &'a Evaluate,
    pub radius_mm: f64,
    pub rig: Option<&'a Rig>,
}

/// Adds the standards' values to a separation.
pub(super) fn complete(
    station: String,
    z_mm: f64,
    angles: usize,
    mut separation: Separation,
    profiles: Vec<Profile>,
    truth: Option<StationTruth>,
    evaluation: Evaluation,
) -> StationResult {
    let (values, motion_values) = (Vec::new(), Vec::new());
    let Evaluation { evaluate, radius_mm, rig } = evaluation;
    if let Some(rig) = rig {
        let beyond_rad = profiles.iter().map(|profile| profile.bridged_beyond_rad).fold(0.0, f64::max);
        separation.sections.iter_mut().for_each(|section| section.gaps = rig.gaps_of(&section.id).widened(beyond_rad));
    }
    let mut result = StationResult { station, z_mm, angles, separation, profiles, values, motion_values, truth };
    let sections = 0..result.separation.sections.len();
    result.values = sections.clone().map(|section| section_values(&result, section, evaluate, radius_mm)).collect();
    let missing = sections.flat_map(|section| missing_circles(&result, section, evaluate, radius_mm));
    let missing: Vec<String> = missing.collect();
    result.separation.warnings.extend(missing);
    result
}

/// True motion [x, y, tilt about x, about y] as a separation reports it at a place along the spindle: x + z·ε_y, y − z·ε_x;
/// a curve that is not given is 0.
fn true_motion(motion: &[Vec<f64>; 4], quantity: Quantity, z_mm: f64) -> Vec<f64> {
    let parts = |quantity: Quantity| motion.iter().zip(quantity.cartesian()).filter(|(_, share)| *share != 0.0);
    let mut sum = vec![0.0; parts(quantity).map(|(curve, _)| curve.len()).max().unwrap_or(0)];
    let mut add = |quantity: Quantity, factor: f64| {
        for (curve, share) in parts(quantity) {
            sum.iter_mut().zip(curve).for_each(|(sum, value)| *sum += factor * share * value);
        }
    };
    add(quantity, 1.0);
    if let Some((tilt, factor)) = quantity.moved_by_tilt() {
        add(tilt, factor * z_mm * UM_PER_MM_URAD);
    }
    sum
}

/// Root mean square of estimate minus truth over the orders from 2 that could be told.
pub(super) fn true_error(result: &StationResult, quantity: Quantity) -> Option<f64> {
    let truth = result.truth.as_ref()?;
    let curve = match quantity {
        Quantity::Form(section) => truth.form_um.get(section)?.clone(),
        motion => true_motion(truth.motion.as_ref()?, motion, result.separation.motion_z_mm),
    };
    let unknown = result.separation.position(quantity)?;
    if curve.len() < 2 {
        return None;
    }
    let mut fourier = Fourier::new(curve.len());
    let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
    fourier.analyse(curve.iter().copied(), &mut harmonics);
    let width = result.separation.unknowns.len();
    let told = result.separation.observable.iter().skip(unknown).step_by(width);
    let squares =
        result.separation.coefficients(unknown).zip(told).enumerate().skip(2).filter(|(_, (_, told))| **told).map(
            |(order, (value, _))| {
                let truth = harmonics.get(order).copied().unwrap_or_default();
                let truth = if quantity.is_form() { truth } else { truth.conj() };
                (value - truth).norm_sqr()
            },
        );
    Some((0.5 * squares.sum::<f64>()).sqrt())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::separation::{Residual, SectionAt};

    /// Sensors in one plane tell the motion of that plane: 2 µm at the reference and 5 µrad 100 mm further are 2.5 µm.
    #[test]
    fn motion_is_compared_where_it_is_told() {
        let cosine = |amplitude: f64| -> Vec<f64> {
            (0..32).map(|step| amplitude * (3.0 * std::f64::consts::TAU * f64::from(step) / 32.0).cos()).collect()
        };
        let mut estimate = vec![Complex64::ZERO; 8];
        estimate[3 * 2] = Complex64::from(2.5);
        estimate[3 * 2 + 1] = Complex64::from(-0.7);
        let separation = Separation {
            sections: vec![SectionAt::whole("a", 100.0)],
            unknowns: vec![Quantity::X, Quantity::Y],
            estimate,
            variance: vec![0.0; 8],
            observable: vec![true; 8],
            motion_covariance: None,
            equivalents: Vec::new(),
            motion_z_mm: 100.0,
            residual: Residual::default(),
            warnings: Vec::new(),
        };
        let truth = StationTruth { form_um: Vec::new(), motion: Some([2.0, -0.5, 2.0, 5.0].map(cosine)) };
        let evaluation = Evaluation { evaluate: &Evaluate::nothing(), radius_mm: 30.0, rig: None };
        let result = complete("s1".into(), 0.0, 32, separation, Vec::new(), Some(truth), evaluation);
        for quantity in [Quantity::X, Quantity::Y] {
            // Rounding of transforms of values near 1.
            assert!(true_error(&result, quantity).unwrap() < 1e-14, "{quantity:?}");
        }
        assert!(true_error(&result, Quantity::TiltX).is_none(), "tilt was not told");
    }
}

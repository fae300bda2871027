//! Error of a result where the truth is known.

use runout_numerics::{Complex64, fourier::Fourier};
use runout_turning::{
    separation::{Quantity, UM_PER_MM_URAD},
    station::StationResult,
};

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

/// Root mean square of estimate minus truth over the observable orders from 2; along the axis from 1.
pub(super) fn true_error(result: &StationResult, quantity: Quantity) -> Option<f64> {
    let truth = result.truth.as_ref()?;
    let curve = match quantity {
        Quantity::Form(section) | Quantity::FaceForm(section) => truth.form_um.get(section)?.clone(),
        Quantity::Z => truth.z_um.clone()?,
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
    let observable = result.separation.observable.iter().skip(unknown).step_by(width);
    // Along the axis, the fundamental is error motion.
    let lowest = if quantity.is_axial() { 1 } else { 2 };
    let squares = result
        .separation
        .coefficients(unknown)
        .zip(observable)
        .enumerate()
        .skip(lowest)
        .filter(|(_, (_, seen))| **seen)
        .map(|(order, (value, _))| {
            let truth = harmonics.get(order).copied().unwrap_or_default();
            let truth = if quantity.is_form() { truth } else { truth.conj() };
            (value - truth).norm_sqr()
        });
    Some((0.5 * squares.sum::<f64>()).sqrt())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use runout_turning::{
        measurement::StationTruth,
        separation::{SectionAt, Separation},
    };

    /// Sensors in one plane measure the motion there: 2 µm at the reference and 5 µrad 100 mm further are 2.5 µm.
    #[test]
    fn motion_is_compared_where_it_is_observable() {
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
            motion_z_mm: 100.0,
            ..Separation::default()
        };
        let truth = StationTruth { form_um: Vec::new(), z_um: None, motion: Some([2.0, -0.5, 2.0, 5.0].map(cosine)) };
        let result = StationResult {
            station: "s1".into(),
            z_mm: 0.0,
            angles: 32,
            separation,
            profiles: Vec::new(),
            truth: Some(truth),
        };
        for quantity in [Quantity::X, Quantity::Y] {
            // Rounding of transforms of values near 1.
            assert!(true_error(&result, quantity).unwrap() < 1e-14, "{quantity:?}");
        }
        assert!(true_error(&result, Quantity::TiltX).is_none(), "tilt is not observable");
    }
}

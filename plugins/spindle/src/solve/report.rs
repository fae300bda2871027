//! A solution as a separation: motion at the spindle's reference, covariance, and what declared forms may move.

use runout_core::{
    Complex64,
    separation::{Residual, SectionAt, Separation},
    stage::Station,
};

use super::{
    consistency::noise_freedom, estimate::Estimate, operators::Operators, propagation::Propagation, solution::Solver,
};
use crate::layout::ToReference;

impl Solver<'_> {
    /// The solution of a station at the spindle's reference, with its covariance.
    #[must_use]
    pub(crate) fn report(
        &self,
        station: &Station,
        operators: &Operators,
        estimate: &Estimate,
        propagation: Option<&Propagation>,
        residual: Residual,
    ) -> Separation {
        let layout = self.layout;
        let (width, max_order) = (layout.unknowns.len(), operators.orders.len());
        let to_reference = layout.to_reference(layout.mean_z_mm + station.z_mm);
        let mut values = vec![Complex64::ZERO; (max_order + 1) * width];
        let mut variance = vec![0.0; values.len()];
        let mut observable = vec![true; values.len()];
        let motions: Vec<usize> = (0..width).filter(|unknown| !layout.unknowns[*unknown].is_form()).collect();
        let forms: Vec<usize> = layout.forms().collect();
        let mut form_covariance = propagation.map(|_| vec![Complex64::ZERO; forms.len() * forms.len()]);
        let mut motion_covariance = propagation.map(|_| vec![Complex64::ZERO; motions.len() * motions.len()]);
        for order in 1..=max_order {
            let row = order * width..(order + 1) * width;
            let mut solved = estimate.values[row.clone()].to_vec();
            to_reference.apply(&mut solved);
            let order_observable = &operators.observable(order);
            if layout.direction < 0.0 {
                let forms = layout.unknowns.iter().zip(&mut solved).filter(|(unknown, _)| unknown.is_form());
                forms.for_each(|(_, form)| *form = form.conj());
            }
            let spread = propagation.map(|propagation| {
                let mut covariance = propagation.covariance[order - 1].clone();
                if order == 1 {
                    covariance = about(&covariance, |rows, length| self.named_alike(rows, order, length));
                }
                to_reference.apply_about(&mut covariance);
                covariance
            });
            if let (Some(spread), Some(joint)) = (&spread, &mut form_covariance) {
                let entry = |row: &usize, column: &usize| {
                    let entry = spread[row * width + column];
                    if layout.direction < 0.0 { entry.conj() } else { entry }
                };
                joint.extend(forms.iter().flat_map(|row| forms.iter().map(move |column| entry(row, column))));
            }
            if let (Some(spread), Some(joint)) = (&spread, &mut motion_covariance) {
                let entry = |row: &usize, column: &usize| spread[row * width + column];
                joint.extend(motions.iter().flat_map(|row| motions.iter().map(move |column| entry(row, column))));
            }
            for unknown in 0..width {
                let index = row.start + unknown;
                observable[index] = order_observable[unknown];
                let lost = Complex64::new(f64::NAN, f64::NAN);
                values[index] = if order_observable[unknown] { solved[unknown] } else { lost };
                variance[index] = match &spread {
                    Some(spread) if order_observable[unknown] => spread[unknown * width + unknown].re.max(0.0),
                    _ => f64::NAN,
                };
            }
        }
        let rig = &self.selection.rig;
        let sections = (rig.sections.iter().enumerate())
            .map(|(index, id)| SectionAt::whole(id.clone(), rig.section_z_mm(index) + station.z_mm));
        let has_tilt = layout.unknowns.iter().any(|unknown| unknown.is_tilt());
        Separation {
            sections: sections.collect(),
            unknowns: layout.unknowns.clone(),
            estimate: values,
            variance,
            observable,
            motion_covariance,
            form_covariance,
            freedom: freedom(station, &self.selection.setups),
            form_bound: self.form_bound(operators, &to_reference),
            motion_z_mm: if has_tilt { 0.0 } else { layout.mean_z_mm + station.z_mm },
            residual,
            ..Separation::default()
        }
    }

    /// By how much forms declared within bounds may move each unknown, peak to valley: each reading of such a section by its bound, at
    /// the order where that moves the unknown most. Empty where none is declared.
    fn form_bound(&self, operators: &Operators, to_reference: &ToReference) -> Vec<f64> {
        let layout = self.layout;
        let bounds: Vec<f64> =
            layout.readings.iter().map(|reading| layout.form_bound_um(reading.section).unwrap_or(0.0)).collect();
        if bounds.iter().all(|bound| *bound <= 0.0) {
            return Vec::new();
        }
        let (width, count) = (layout.unknowns.len(), layout.readings.len());
        let mut largest = vec![0.0_f64; width];
        // At order 1 form is clamping, but for what is seen on the axis, which has the same share of z at every order.
        for order in 2..=operators.orders.len() {
            let mut rows = self.order_operator(operators, order, count);
            to_reference.apply(&mut rows);
            let unknowns = rows.chunks_exact(count).zip(&mut largest).zip(operators.observable(order));
            for ((row, largest), _) in unknowns.filter(|(_, observable)| **observable) {
                let moved: f64 = row.iter().zip(&bounds).map(|(entry, bound)| entry.norm() * bound).sum();
                *largest = largest.max(moved);
            }
        }
        largest
    }
}

/// Real degrees of freedom behind the covariance of one order of a station by itself.
fn freedom(station: &Station, setups: &[usize]) -> usize {
    let used = station.profiles.iter().filter(|profile| setups.contains(&profile.setup));
    noise_freedom(used.map(|profile| profile.turns.used))
}

/// M·C·Mᴴ for a covariance C, where `times` gives M·rows for rows of a length.
fn about(covariance: &[Complex64], times: impl Fn(&[Complex64], usize) -> Vec<Complex64>) -> Vec<Complex64> {
    let size = covariance.len().isqrt();
    let rows = times(covariance, size);
    let adjoint: Vec<Complex64> =
        (0..size).flat_map(|column| rows.iter().skip(column).step_by(size).map(Complex64::conj)).collect();
    times(&adjoint, rows.len() / size)
}

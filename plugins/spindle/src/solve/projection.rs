//! How motion of the axis follows from the readings of one setup alone, where form does not matter.

use runout_core::{numerics::least_squares::PivotedQr, separation::Quantity, spread::Projection};

use crate::{
    layout::{ALONG_AXIS, Layout, NULL_TOLERANCE, RANK_TOLERANCE, Reading},
    selection::Selection,
};

/// Least-squares inverse of what the sensors of a setup (an index into the whole rig's) see of motion, at their mean z;
/// `None` where none of it is observable.
pub(crate) fn projection(selection: &Selection, layout: &Layout, setup: usize) -> Option<Projection> {
    let setup = selection.setups.iter().position(|chosen| *chosen == setup)?;
    let readings: Vec<&Reading> = layout.readings.iter().filter(|reading| reading.setup == setup).collect();
    // Of odd orders, motion has its own sign in every setup.
    let coefficient = |reading: &Reading, quantity: Quantity| layout.coefficient(reading, quantity, 1);
    let seen = |quantity: &Quantity| {
        !quantity.is_form() && readings.iter().any(|reading| coefficient(reading, *quantity).norm() > ALONG_AXIS)
    };
    let motions: Vec<Quantity> = layout.unknowns.iter().copied().filter(seen).collect();
    if motions.is_empty() {
        return None;
    }
    let row = |reading| motions.iter().map(move |motion| coefficient(reading, *motion));
    let matrix: Vec<_> = readings.iter().flat_map(|reading| row(reading)).collect();
    let qr = PivotedQr::new(readings.len(), motions.len(), &matrix, RANK_TOLERANCE);
    let operator = qr.operator();
    let observable = qr.observable(NULL_TOLERANCE).into_iter();
    let rows =
        motions.iter().zip(operator.chunks_exact(readings.len())).zip(observable).filter(|(_, observable)| *observable);
    let rows: Vec<_> = rows
        .map(|((motion, weights), _)| {
            let weights = readings.iter().zip(weights).filter(|(_, weight)| weight.re.abs() > ALONG_AXIS);
            (*motion, weights.map(|(reading, weight)| (selection.sensors[reading.sensor], weight.re)).collect())
        })
        .collect();
    (!rows.is_empty()).then_some(Projection { rows, z_mm: layout.mean_z_mm, rotation: layout.direction })
}

//! What a fit leaves of the readings, and of the turns that are held out.

use std::sync::Arc;

use runout_core::{Complex64, closed_loop::Remainder, consistency::Structure};

use super::{
    data::{Shared, StationData},
    drift::Part,
    projection::project,
    solved::Solved,
};
use crate::{
    effects::Alterations,
    layout::Layout,
    solve::{Readings, apply},
};

/// Of all stations together.
pub(super) fn remainder(shared: &Shared, stations: &[Solved], layout: &Layout, alterations: &Alterations) -> Remainder {
    let (mut residual, mut stretches) = (Vec::new(), Vec::with_capacity(stations.len()));
    let (mut dof, mut squares, mut expected, mut readings) = (0, 0.0, 0.0, 0);
    let mut held = HeldOut { chi2: 0.0, squares: 0.0, expected: 0.0 };
    let (mut held_readings, mut disturbed) = (0, 0.0);
    for (solved, data) in stations.iter().zip(&shared.data) {
        let count = solved.corrected.count;
        project(solved.traced(), &solved.linear, count, |_, values| {
            residual.extend(values.iter().flat_map(|value| [value.re, value.im]));
        });
        let beside = data.beside_averages(alterations);
        dof += beside.len();
        residual.extend(beside);
        stretches.push(residual.len() - stretches.iter().sum::<usize>());
        for order in 1..=solved.signal_orders {
            dof += solved.freedom(order);
            disturbed += solved.freedom(order) as f64 * data.carried(order, alterations);
        }
        let level = &solved.residual;
        if level.dof > 0 {
            squares += level.rms_um.powi(2) * count as f64;
            expected += level.expected_rms_um.powi(2) * count as f64;
        }
        readings += count;
        if let Some(found) = held_out(data, solved, layout, alterations) {
            held.chi2 += found.chi2;
            held.squares += found.squares;
            held.expected += found.expected;
            held_readings += count;
        }
    }
    let known = shared.data.iter().all(|data| data.weights.is_some());
    let share = |sum: f64, count: usize| if count > 0 { (sum / count as f64).sqrt() } else { f64::NAN };
    Remainder {
        residual,
        structure: Arc::new(Structure::default().in_stretches("stations", &stretches)),
        dof,
        rms: share(squares, readings),
        noise_floor: if known { share(expected, readings) } else { f64::NAN },
        held_out_rms: share(0.5 * held.squares, held_readings),
        disturbed_chi2: if known { disturbed } else { 0.0 },
        held_out_expected_rms: if known { share(0.5 * held.expected, held_readings) } else { f64::NAN },
        held_out_chi2: if held_readings > 0 { held.chi2 } else { f64::NAN },
        unit: "um".into(),
    }
}

/// What shakes the eccentricity, order 1, is often more than all else, and shakes no other order: the plain squares leave it out.
const FORM_AND_MOTION: usize = 2;

/// Residual on the turns held out, summed over orders and readings.
struct HeldOut {
    /// Weighted squares.
    chi2: f64,
    /// Squares, in µm².
    squares: f64,
    /// Squares expected from noise, in µm²; NaN where it is not known.
    expected: f64,
}

fn held_out(data: &StationData, solved: &Solved, layout: &Layout, alterations: &Alterations) -> Option<HeldOut> {
    let mut held = data.held_out.clone()?;
    let later = data.altered(alterations, Part::HeldOut);
    let (mut chi2, mut squares) = (0.0, 0.0);
    for (number, line) in data.seen.lines.found.iter().enumerate() {
        let taken_out = alterations.lines.contains(&(number, line.row().0));
        chi2 += line.held_out()[usize::from(taken_out)];
        if taken_out {
            line.take_out(&line.leak(Part::HeldOut, held.max_order), layout, &mut held.mean);
        }
    }
    for (sensor, creeping) in alterations.sensors.iter().zip(&data.seen.creeping) {
        if let Some(creeping) = creeping.as_ref().filter(|creeping| creeping.certain()) {
            chi2 += creeping.held_out[usize::from(sensor.creep_um != 0.0)];
        }
    }
    later.correct(layout, &mut held);
    let count = held.count;
    for order in 1..=held.max_order.min(solved.corrected.max_order) {
        let at = order * count..(order + 1) * count;
        let operator = &solved.operators.orders[order - 1].operator;
        let system = &solved.operators.systems[order - 1];
        let solution = apply(operator, &solved.linear[at.clone()]);
        let predicted = apply(&system.matrix, &solution);
        let beyond = solved.corrected.mean[at.clone()].iter().zip(&solved.linear[at.clone()]).map(|(a, b)| a - b);
        let left: Vec<Complex64> = held.mean[at]
            .iter()
            .zip(beyond)
            .zip(predicted)
            .map(|((held, beyond), predicted)| held - beyond - predicted)
            .collect();
        if order >= FORM_AND_MOTION {
            let recorded = alterations.recorded(layout, order, &left);
            squares += recorded.iter().zip(&solved.slopes).map(|(left, slope)| (left * slope).norm_sqr()).sum::<f64>();
        }
        if order <= solved.signal_orders {
            let weighted = data.weights_of(order, layout, alterations, &solved.slopes).times(&left, 1);
            chi2 += weighted.iter().map(Complex64::norm_sqr).sum::<f64>() / solved.floor_std[order - 1].powi(2);
        }
    }
    let expected = held_out_expected(solved, &held);
    Some(HeldOut { chi2, squares, expected })
}

/// Squares expected from noise of what the fit leaves of the turns held out, in µm²: tr Σ of their mean, and tr(A·P·Σ·Pᴴ·Aᴴ) of
/// its prediction by the turns fitted. Both parts of a capture are taken as independent. NaN where their covariance is not known.
fn held_out_expected(solved: &Solved, held: &Readings) -> f64 {
    let (Some(propagation), Some(setups)) = (&solved.propagation, &held.covariance) else { return f64::NAN };
    let sensors = held.count / setups.len().max(1);
    let orders = FORM_AND_MOTION..=held.max_order.min(solved.corrected.max_order);
    let noise = orders.clone().flat_map(|order| {
        let block = order * sensors * sensors..(order + 1) * sensors * sensors;
        setups.iter().flat_map(move |setup| setup[block.clone()].iter().step_by(sensors + 1)).map(|entry| entry.re)
    });
    let predicted = orders.map(|order| {
        let width = solved.operators.systems[order - 1].columns;
        let covariance = &propagation.covariance[order - 1];
        let readings = solved.operators.systems[order - 1].matrix.chunks_exact(width);
        readings
            .map(|row| row.iter().zip(apply(covariance, &conjugated(row))).map(|(a, b)| (a * b).re).sum::<f64>())
            .sum::<f64>()
    });
    noise.sum::<f64>() + predicted.sum::<f64>()
}

fn conjugated(row: &[Complex64]) -> Vec<Complex64> {
    row.iter().map(Complex64::conj).collect()
}

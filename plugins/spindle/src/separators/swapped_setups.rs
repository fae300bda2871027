//! A look for setups that were recorded in another order than the rig says.

use runout_core::{Complex64, rig::Rig};

use super::{
    algebra::{apply, leftover},
    operators::Operators,
    readings::Readings,
};
use crate::layout::Layout;

/// Residuals are looked into above this weighted sum of squares per degree of freedom.
pub const SUSPICIOUS_CHI2: f64 = 4.0;
/// Another order of the setups is suspected when it leaves less than this share of the residual.
const SUSPICIOUS_SHARE: f64 = 0.5;
/// Form lives in the low orders; that is where a swap shows.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=50;
/// More setups than this would need too many permutations.
const MAX_SETUPS: usize = 5;

/// Says which permutation of the setups fits better by far, where one does. Where the rig is symmetric (a plain
/// reversal), a swap leaves no trace and nothing can be said.
pub fn suspect(rig: &Rig, layout: &Layout, operators: &Operators, readings: &Readings) -> Option<String> {
    let setups = rig.setups.len();
    if !(2..=MAX_SETUPS).contains(&setups) {
        return None;
    }
    let sensors = rig.sensors.len();
    let orders = *ORDERS.start()..=(*ORDERS.end()).min(readings.max_order);
    let left: Vec<_> = orders
        .clone()
        .map(|order| leftover(&layout.matrix(order), &operators.orders[order - 1].operator, readings.count))
        .collect();
    let rms = |permutation: &[usize]| {
        let squares = orders.clone().zip(&left).map(|(order, left)| {
            let recorded = readings.order(order);
            let permuted: Vec<Complex64> = permutation
                .iter()
                .flat_map(|setup| &recorded[setup * sensors..(setup + 1) * sensors])
                .copied()
                .collect();
            apply(left, &permuted).iter().map(Complex64::norm_sqr).sum::<f64>()
        });
        (0.5 * squares.sum::<f64>() / readings.count as f64).sqrt()
    };
    let declared: Vec<usize> = (0..setups).collect();
    let declared_rms = rms(&declared);
    let (best, best_rms) = permutations(setups).into_iter().map(|permutation| (rms(&permutation), permutation)).fold(
        (declared.clone(), declared_rms),
        |best, (rms, permutation)| {
            if rms < best.1 { (permutation, rms) } else { best }
        },
    );
    (best != declared && best_rms < SUSPICIOUS_SHARE * declared_rms).then(|| {
        let names: Vec<String> = rig
            .setups
            .iter()
            .zip(&best)
            .filter(|(setup, source)| setup.id != rig.setups[**source].id)
            .map(|(setup, source)| format!("`{}` holds what the rig calls `{}`", rig.setups[*source].id, setup.id))
            .collect();
        format!(
            "setups seem swapped: {}; the residual of orders {} to {} would fall from {declared_rms:.3} to {best_rms:.3} µm rms",
            names.join(", "),
            orders.start(),
            orders.end(),
        )
    })
}

fn permutations(count: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..count {
        all = all
            .into_iter()
            .flat_map(|prefix: Vec<usize>| {
                let free = (0..count).filter(|item| !prefix.contains(item)).collect::<Vec<_>>();
                free.into_iter().map(move |item| prefix.iter().copied().chain([item]).collect())
            })
            .collect();
    }
    all
}

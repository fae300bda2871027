//! Where something is that no effect explains: in which sensor and setup, at which orders, over which angles.

use std::collections::BTreeSet;

use runout_core::{
    Complex64,
    closed_loop::{diagnosis::Unexplained, evidence::Group},
    numerics::fourier::Fourier,
    rig::Rig,
};

use super::{projection::project, solved::Solved};
use crate::layout::Layout;

/// A reading is where it comes from when letting that reading be anything takes away this share of the residual.
const SHARE: f64 = 0.5;
/// Orders at which less than this share of its square lies are left out, at both ends.
const TAIL: f64 = 0.05;
/// Readings that explain this share of what the best one explains are as likely as it.
const ALIKE: f64 = 0.98;
/// It has a place within the turn where half of its square lies within this share of the turn.
const NARROW: f64 = 0.2;

/// What a station's residual shows of an unmodelled disturbance: only orders at which a reading is redundant show one, and only a reading that
/// explains it better than the others is named.
pub(crate) fn where_from(solved: &Solved, layout: &Layout, rig: &Rig) -> Option<Unexplained> {
    let count = solved.corrected.count;
    let mut total = 0.0;
    // What each reading would have to hold to explain the residual, and how much it would.
    let mut disturbance = vec![vec![Complex64::ZERO; solved.corrected.max_order + 1]; count];
    let mut explained = vec![0.0; count];
    let mut left = vec![0.0; solved.corrected.max_order + 1];
    let mut redundant = Vec::new();
    project(&solved.whitened, &solved.linear, count, |order, residual| {
        // Without a redundant reading, the residual is what rounding leaves.
        if solved.operators.orders[order - 1].rank >= count {
            return;
        }
        redundant.push(order);
        left[order] = residual.iter().map(Complex64::norm_sqr).sum::<f64>();
        total += left[order];
        let matrix = &solved.whitened[order - 1];
        for reading in 0..count {
            let column = || matrix.iter().skip(reading).step_by(count);
            let square: f64 = column().map(Complex64::norm_sqr).sum();
            if square > 0.0 {
                let dot: Complex64 = column().zip(residual).map(|(entry, value)| entry.conj() * value).sum();
                explained[reading] += dot.norm_sqr() / square;
                disturbance[reading][order] = dot / square;
            }
        }
    });
    let best = (0..count).max_by(|a, b| explained[*a].total_cmp(&explained[*b]))?;
    let by_sensor = |sensor: usize| -> f64 {
        (0..count).filter(|index| layout.readings[*index].sensor == sensor).map(|index| explained[index]).sum()
    };
    let by_setup = |setup: usize| -> f64 {
        (0..count).filter(|index| layout.readings[*index].setup == setup).map(|index| explained[index]).sum()
    };
    let reading = &layout.readings[best];
    let all: f64 = explained.iter().sum();
    let alike: Vec<usize> = (0..count).filter(|index| explained[*index] >= ALIKE * explained[best]).collect();
    let place_of = |index: &usize| (layout.readings[*index].sensor, layout.readings[*index].setup);
    if alike.iter().any(|index| place_of(index).0 != reading.sensor) {
        let sensors: BTreeSet<usize> = alike.iter().map(|index| place_of(index).0).collect();
        let one_setup = alike.iter().all(|index| place_of(index).1 == reading.setup);
        return Some(Unexplained {
            station: None,
            sensor: None,
            setup: one_setup.then(|| rig.setups[reading.setup].id.clone()),
            orders: held(&left),
            rms_um: solved.residual.rms_um,
            place: undecided(
                &redundant,
                &sensors.iter().map(|sensor| rig.sensors[*sensor].id.as_str()).collect::<Vec<_>>(),
            ),
        });
    }
    let (sensor, setup) = if explained[best] > SHARE * total {
        (Some(reading.sensor), Some(reading.setup))
    } else if by_sensor(reading.sensor) > SHARE * all {
        (Some(reading.sensor), None)
    } else if by_setup(reading.setup) > SHARE * all {
        (None, Some(reading.setup))
    } else {
        (None, None)
    };
    let harmonics = &disturbance[best];
    let squares: Vec<f64> = harmonics.iter().map(Complex64::norm_sqr).collect();
    Some(Unexplained {
        station: None,
        sensor: sensor.map(|index| rig.sensors[index].id.clone()),
        setup: setup.map(|index| rig.setups[index].id.clone()),
        orders: held(&squares),
        rms_um: (0.5 * squares.iter().sum::<f64>()).sqrt(),
        place: place(harmonics),
    })
}

/// Lowest and highest order that hold a sum of squares, `[order]`, but for its tails.
fn held(squares: &[f64]) -> [usize; 2] {
    let sum: f64 = squares.iter().sum();
    let lowest = beyond(squares.iter().copied().enumerate(), TAIL * sum);
    let highest = beyond(squares.iter().copied().enumerate().rev(), TAIL * sum);
    [lowest.min(highest), highest]
}

/// What a residual says that several sensors explain equally well.
fn undecided(redundant: &[usize], sensors: &[&str]) -> String {
    let which = format!("the residual does not show which of {}", sensors.join(", "));
    match redundant {
        [order] => format!("this layout shows contradictions at order {order} only; {which}"),
        _ => which,
    }
}

/// Squares (µm²) that an unweighted fit leaves of each setup's readings, and their complex degrees of freedom: the trace of
/// I − A·P over them.
pub(crate) fn captures(solved: &Solved, setups: usize) -> Vec<Group> {
    let count = solved.corrected.count;
    let sensors = (count / setups.max(1)).max(1);
    let mut groups = vec![Group { squares: 0.0, freedom: 0.0 }; setups];
    project(&solved.whitened, &solved.linear, count, |order, residual| {
        let matrix = &solved.whitened[order - 1];
        for (reading, value) in residual.iter().enumerate() {
            let group = &mut groups[reading / sensors];
            // Residuals carry √2, so that a real degree of freedom has the mean square of a complex one's noise.
            group.squares += 0.5 * value.norm_sqr();
            group.freedom += matrix[reading * (count + 1)].re / std::f64::consts::SQRT_2;
        }
    });
    groups
}

/// The order at which a sum from one end passes a limit.
fn beyond(squares: impl Iterator<Item = (usize, f64)>, limit: f64) -> usize {
    let mut passed = 0.0;
    for (order, square) in squares {
        passed += square;
        if passed > limit {
            return order;
        }
    }
    1
}

/// Where in the turn a curve of these harmonics has most of its square.
fn place(harmonics: &[Complex64]) -> String {
    let samples = (2 * harmonics.len() + 2).next_power_of_two();
    let curve = Fourier::new(samples).synthesise(harmonics.iter().map(Complex64::conj)).to_vec();
    let squares: Vec<f64> = curve.iter().map(|value| value * value).collect();
    let half = 0.5 * squares.iter().sum::<f64>();
    if half.is_nan() || half <= 0.0 {
        return "over the whole turn".into();
    }
    // The shortest arc that holds half of the square, by two pointers around the turn.
    let (mut end, mut sum, mut shortest) = (0, 0.0, (samples, 0));
    for start in 0..samples {
        while sum < half && end < start + samples {
            sum += squares[end % samples];
            end += 1;
        }
        if end - start < shortest.0 {
            shortest = (end - start, start);
        }
        // Rounding of sums, where next to nothing is left of the arc.
        (end, sum) = if end > start { (end, sum - squares[start]) } else { (start + 1, 0.0) };
    }
    let (length, start) = shortest;
    if length as f64 > NARROW * samples as f64 {
        return "over the whole turn".into();
    }
    let degrees = |sample: usize| (360.0 * (sample % samples) as f64 / samples as f64).round();
    format!("spindle angle {}…{}°", degrees(start), degrees(start + length))
}

//! The tests of measured circles on their own points.

use std::{f64::consts::TAU, ops::Range};

use runout_core::{
    Complex64,
    consistency::{Check, Kind, Structure, Test, check::FINDING, rows},
    numerics::{
        least_squares::{Basis, dot},
        number::significant,
        statistics::{f_tail, median},
    },
};

use crate::{
    robust::{ROUNDING_UM, rms},
    scan::{Scan, unwrapped},
};

/// Points on either side of a place through which lines are laid, and the fewest points of a circle that is judged by them.
const BESIDE: usize = 5;
const FEWEST: usize = 40;
/// Shares of a turn between which a trace goes round once.
const ONCE: [f64; 2] = [0.97, 1.03];
/// So many times its largest step elsewhere a circle has where it does not close: an edge is no drift.
const UNLIKE: f64 = 1.5;
/// Noise that no instrument is below, in µm.
const LEAST_NOISE_UM: f64 = 1e-4;
/// Ratio of the power in two ranges of orders from which a low-pass took noise away (a scanned surface falls by 7), and the fewest orders of each.
const FLAT: f64 = 30.0;
const FEWEST_ORDERS: f64 = 8.0;

/// Orders to each side that an order above those of the harmonics is compared with, the chance by which it stands out, and the share of the deviations that
/// it has at least.
const AROUND: usize = 32;
const ABSENT_CHANCE: f64 = 1e-6;
const LEAST_ABSENT: f64 = 1e-3;

/// What is declared of circles of these names: errors may depend on each other along the angle; circles are independent, have the same noise
/// and may be offset.
pub(crate) fn structure(scans: &[Scan], names: &[String]) -> Structure {
    let of_circle = |(circle, scan): (usize, &Scan)| {
        let name = &names[circle];
        scan.angle_rad.iter().map(|angle| format!("{name} at {:.1}°", angle.to_degrees())).collect::<Vec<String>>()
    };
    let circle: Vec<usize> = scans.iter().enumerate().flat_map(|(circle, scan)| vec![circle; scan.len()]).collect();
    let angle = scans.iter().flat_map(|scan| scan.angle_rad.iter().copied()).collect();
    let structure = Structure::default()
        .along("angle", circle.clone(), angle)
        .naming(scans.iter().enumerate().flat_map(of_circle).collect());
    if scans.len() < 2 {
        return structure;
    }
    structure
        .shifting("circles", &circle, names)
        .divided("circles", Kind::Blocks, circle.clone(), names.to_vec())
        .divided("circles", Kind::Alike, circle, names.to_vec())
}

/// Names points of a circle that are not like the others about them: `scan` about the axis, with the basis of its harmonics, and at its angles as
/// measured.
pub(crate) fn unlike(scan: &Scan, basis: &Basis, measured: &Scan, name: &str) -> Option<Check> {
    let mut left = scan.deviation_um.clone();
    basis.remove_from(&mut left);
    if rms(left.iter().copied()) < ROUNDING_UM {
        return None;
    }
    let declared = structure(std::slice::from_ref(measured), &[name.to_owned()]);
    Some(rows::unlike(&left, basis.columns())?.check(&declared, "µm"))
}

/// Why the residual beyond the harmonics of a circle does not show the noise within them: behind a low-pass, noise has less power at higher orders.
pub(crate) fn hidden_noise(scan: &Scan, basis: &Basis) -> Option<String> {
    let mut left = scan.deviation_um.clone();
    basis.remove_from(&mut left);
    let std_um = (dot(&left, &left) / left.len().saturating_sub(basis.rank()).max(1) as f64).sqrt();
    let hidden = |what: String| {
        Some(format!(
            "{what}: a low-pass of the instrument, or smoothing, took noise away that lower orders still have. No ± is stated; load the profile as \
             measured"
        ))
    };
    if std_um < LEAST_NOISE_UM {
        return hidden(format!(
            "its harmonics leave {} µm rms, less than the noise of any instrument",
            significant(std_um, 2)
        ));
    }
    // The upper half of what is beyond the harmonics, in two parts.
    let [from, to] = [usize::midpoint(basis.rank() / 2, scan.len() / 2), scan.len() / 2];
    let middle = usize::midpoint(from, to);
    let power = |orders: Range<usize>| {
        let count = orders.len() as f64;
        (powers(&left, &scan.angle_rad, orders).iter().sum::<f64>() / count, count)
    };
    let ([lower, count], [upper, _]) = (power(from..middle).into(), power(middle..to).into());
    let ratio = (lower / upper).max(upper / lower);
    let is_flat = count < FEWEST_ORDERS || ratio < FLAT || 2.0 * f_tail(ratio, 2.0 * count, 2.0 * count) > FINDING;
    if is_flat {
        return None;
    }
    hidden(format!(
        "the residual at orders {from} to {middle} has {} times the size of that at {middle} to {to}, where noise has the same",
        significant((lower / upper).sqrt(), 2)
    ))
}

/// Squares of the amplitudes of some orders of readings at these angles.
fn powers(readings: &[f64], angles: &[f64], orders: Range<usize>) -> Vec<f64> {
    let steps: Vec<Complex64> = angles.iter().map(|angle| Complex64::cis(*angle)).collect();
    let mut waves: Vec<Complex64> = angles.iter().map(|angle| Complex64::cis(orders.start as f64 * angle)).collect();
    let share = 2.0 / readings.len().max(1) as f64;
    let of_order = |_: usize| {
        let sum: Complex64 = waves.iter().zip(readings).map(|(wave, reading)| wave * reading).sum();
        waves.iter_mut().zip(&steps).for_each(|(wave, step)| *wave *= step);
        (share * sum).norm_sqr()
    };
    orders.map(of_order).collect()
}

/// The strongest order above those of a circle's harmonics that stands out from those about it, and its amplitude in µm: form that is in no value.
pub(crate) fn absent(scan: &Scan, basis: &Basis) -> Option<(usize, f64)> {
    let mut left = scan.deviation_um.clone();
    basis.remove_from(&mut left);
    let first = basis.rank() / 2 + 1;
    let all = powers(&left, &scan.angle_rad, first..scan.len() / 2);
    let (place, power) = all.iter().copied().enumerate().max_by(|one, other| one.1.total_cmp(&other.1))?;
    let around: Vec<f64> = all
        .iter()
        .enumerate()
        .filter(|(other, _)| (1..=AROUND).contains(&other.abs_diff(place)))
        .map(|(_, one)| *one)
        .collect();
    // Powers of noise fall off as e^−x, of which the median is ln 2 of the mean.
    let noise = median(around.iter().copied()) / std::f64::consts::LN_2;
    let least_um = LEAST_ABSENT * rms(scan.deviation_um.iter().copied());
    let stands_out = power > noise * ((all.len() as f64).ln() - ABSENT_CHANCE.ln());
    (around.len() >= AROUND && stands_out && power.sqrt() > least_um.max(LEAST_NOISE_UM))
        .then(|| (first + place, power.sqrt()))
}

/// Whether a circle of one turn ends where it began: lines through the points before and behind its beginning have to meet there as those at all
/// other places do. What drifts over the turn makes a step of it. `None` of other traces and of few points.
pub(crate) fn closes(scan: &Scan, name: &str) -> Option<Check> {
    let turned = unwrapped(&scan.angle_rad);
    let count = turned.len();
    let last = *turned.last()?;
    let turn = last.abs() * count as f64 / (count.max(2) - 1) as f64 / TAU;
    if count < FEWEST || !(ONCE[0]..ONCE[1]).contains(&turn) {
        return None;
    }
    let at = |place: usize| {
        (
            turned[place % count] + if place < count { 0.0 } else { last.signum() * TAU },
            scan.deviation_um[place % count],
        )
    };
    let step = |place: usize| {
        let between = 0.5 * (at(place - 1).0 + at(place).0);
        let level = |points: std::ops::Range<usize>| {
            let [angle, height] = points.clone().map(at).fold([0.0; 2], |[x, y], (a, b)| [x + a, y + b]);
            let [angle, height] = [angle, height].map(|sum| sum / BESIDE as f64);
            let (across, along) = points.map(at).fold((0.0, 0.0), |(across, along), (a, b)| {
                (across + (a - angle) * (b - height), along + (a - angle).powi(2))
            });
            height + across / along * (between - angle)
        };
        level(place..place + BESIDE) - level(place - BESIDE..place)
    };
    // From behind the lines at the beginning to before those at the end.
    let elsewhere: Vec<f64> = (2 * BESIDE..=count - BESIDE - BESIDE).map(step).collect();
    let square = elsewhere.iter().map(|step| step * step).sum::<f64>() / elsewhere.len() as f64;
    let largest = elsewhere.iter().fold(0.0_f64, |largest, step| largest.max(step.abs()));
    let own = step(count);
    // Steps whose lines share points depend on each other.
    let independent = elsewhere.len() as f64 / (2 * BESIDE) as f64;
    let ratio = own * own / square.max(f64::MIN_POSITIVE);
    let p = if own.abs() > UNLIKE * largest { f_tail(ratio, 1.0, independent) } else { 1.0 };
    Some(Check::new(Test::Order, format!("closure of {name}"), ratio, &[1.0, independent], p).finding(|| {
        let [own, largest] = [own.abs(), largest].map(|step| significant(step, 2));
        format!("it does not close: its end and its beginning are apart by {own} µm, and neighbours elsewhere by {largest} µm at most. Something drifts over the turn, or the part has an edge there")
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle of `count` points from 30° on, with waves, noise of 0.05 µm and a drift over the turn.
    fn circle(seed: u64, count: usize, drift_um: f64) -> Scan {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut scan = Scan::default();
        for point in 0..count {
            let share = point as f64 / count as f64;
            let angle = TAU * share + 0.52;
            let noise: f64 = 0.05 * (0..12).map(|_| uniform()).sum::<f64>();
            let wave = 2.0 * (2.0 * angle + 0.3).cos() + 0.4 * (7.0 * angle).sin() + 0.1 * (31.0 * angle).cos();
            scan.push(angle.rem_euclid(TAU), 0.0, wave + noise + drift_um * share);
        }
        scan
    }

    #[test]
    fn a_drift_over_a_turn_is_seen_where_the_circle_closes() {
        let said = |drift_um: f64, count: usize| {
            (0..200)
                .filter(|seed| closes(&circle(*seed, count, drift_um), "circle").is_some_and(|check| check.refutes()))
                .count()
        };
        assert!(said(0.0, 360) <= 2 && said(0.0, 72) <= 2, "{} {}", said(0.0, 360), said(0.0, 72));
        assert!(said(1.0, 360) > 190, "{}", said(1.0, 360));
        // Clockwise; an edge elsewhere is larger; half a turn and two turns do not close.
        let mut back = circle(1, 360, 2.0);
        back.angle_rad.iter_mut().for_each(|angle| *angle = -*angle);
        assert!(closes(&back, "circle").is_some_and(|check| check.finding.contains("does not close")));
        let mut edge = circle(1, 360, 1.0);
        edge.deviation_um[100..].iter_mut().for_each(|deviation| *deviation += 3.0);
        assert!(closes(&edge, "circle").is_some_and(|check| !check.refutes()));
        let half = circle(1, 720, 2.0).keep(&(0..720).map(|point| point < 360).collect::<Vec<bool>>());
        assert!(closes(&half, "circle").is_none());
    }

    /// Harmonics of a circle of 720 points, to an order.
    fn harmonics(orders: usize) -> Basis {
        let angles = circle(0, 720, 0.0).angle_rad;
        let waves = (1..=orders).flat_map(|order| [(order, 0.0), (order, 0.25 * TAU)]);
        let column =
            |(order, phase): (usize, f64)| angles.iter().map(|angle| (order as f64 * angle - phase).cos()).collect();
        Basis::of(std::iter::once(vec![1.0; 720]).chain(waves.map(column)).collect())
    }

    #[test]
    fn noise_that_a_low_pass_took_away_is_not_taken_for_none() {
        let fitted = harmonics(60);
        let said = (0..60).filter(|seed| hidden_noise(&circle(*seed, 720, 0.0), &fitted).is_some()).count();
        assert!(said <= 1, "{said} of 60 circles without a low-pass");
        let behind_low_pass = |orders: usize| {
            let mut scan = circle(1, 720, 0.0);
            let mut above = scan.deviation_um.clone();
            harmonics(orders).remove_from(&mut above);
            scan.deviation_um.iter_mut().zip(above).for_each(|(height, above)| *height -= above);
            hidden_noise(&scan, &fitted).unwrap_or_default()
        };
        let [nothing, falling] = [50, 250].map(behind_low_pass);
        assert!(nothing.contains("less than the noise of any instrument"), "{nothing}");
        assert!(falling.contains("times the size of that at"), "{falling}");
    }

    #[test]
    fn a_line_above_the_harmonics_is_absent_form() {
        let fitted = harmonics(60);
        let said = (0..100).filter(|seed| absent(&circle(*seed, 720, 0.0), &fitted).is_some()).count();
        assert_eq!(said, 0);
        for (order, amplitude_um) in [(80, 0.3), (200, 0.05)] {
            let mut scan = circle(1, 720, 0.0);
            let wave = scan.angle_rad.iter().map(|angle| amplitude_um * (f64::from(order) * angle + 0.7).cos());
            scan.deviation_um.iter_mut().zip(wave).for_each(|(height, wave)| *height += wave);
            let (found, size_um) = absent(&scan, &fitted).unwrap_or_default();
            assert!(found == order as usize && (size_um / amplitude_um - 1.0).abs() < 0.3, "{found} {size_um}");
        }
    }
}

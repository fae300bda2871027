//! Values side by side, and each method's difference from the first.

use super::{
    estimates::{Estimates, Scatter},
    report::{Difference, DifferenceOrders, Harmonics, MethodValue, QuantityComparison, Worst},
};
use crate::pipeline::true_error::true_error;
use runout_evaluate::EvaluatedStation;
use runout_numerics::Complex64;
use runout_turning::separation::Quantity;

/// Below this share of the methods' own values, and of their own uncertainties, two results are equal to rounding.
const ROUNDING: f64 = 1e-9;
/// Where two results follow alike from the readings (their difference scatters by less than this share of their own
/// uncertainties),
const ALIKE: f64 = 1e-6;
/// a difference below this share of those is none: an uncertainty has at most two significant digits (GUM 7.2.6). Methods of one
/// formula differ by so much where they share what no reading determines otherwise, and exact geometry depends on it.
const NEGLIGIBLE: f64 = 1e-2;
/// Scatter below this share of the values is rounding: turns that are all alike say nothing of the uncertainty.
const NO_SCATTER: f64 = 1e-12;

/// Every unknown of any method, the first method's first.
pub(super) fn quantities(
    names: &[String],
    stations: &[EvaluatedStation],
    estimates: Vec<Estimates>,
    scatter: &Scatter,
) -> Vec<QuantityComparison> {
    // Values stand side by side in one plane: that of the first method that cannot move to another.
    let fixed = estimates.iter().find(|one| one.has_motion() && !one.has_tilt());
    let plane_mm = fixed.or(estimates.first()).map_or(0.0, |one| one.motion_z_mm);
    let estimates: Vec<Estimates> =
        estimates.into_iter().map(|one| one.moved_to(plane_mm, scatter).unwrap_or(one)).collect();
    let mut wanted: Vec<Quantity> = Vec::new();
    for quantity in estimates.iter().flat_map(|one| &one.unknowns) {
        if !wanted.contains(quantity) {
            wanted.push(*quantity);
        }
    }
    wanted.sort_by_key(|quantity| match quantity {
        Quantity::Form(section) => (0, *section),
        Quantity::X => (1, 0),
        Quantity::Y => (2, 0),
        Quantity::Along(_) => (3, 0),
        Quantity::TiltX => (4, 0),
        Quantity::TiltY => (5, 0),
        Quantity::TiltAlong(_) => (6, 0),
        Quantity::FaceForm(section) => (7, *section),
        Quantity::Z => (8, 0),
        Quantity::FaceMotion(_) => (9, 0),
    });
    let compare = |quantity: Quantity| QuantityComparison {
        quantity: quantity.id().to_owned(),
        section: quantity.section().and_then(|section| {
            stations.iter().find_map(|station| Some(station.result.separation.sections.get(section)?.id.clone()))
        }),
        unit: quantity.unit().to_owned(),
        values: (names.iter().zip(stations).zip(&estimates))
            .filter_map(|((name, station), one)| value(name, quantity, station, one))
            .collect(),
        differences: (names.iter().zip(&estimates))
            .skip(1)
            .filter_map(|(name, other)| difference(name, quantity, [estimates.first()?, other], scatter))
            .collect(),
    };
    wanted.into_iter().map(compare).collect()
}

/// Level and centring are no form.
fn first_order(quantity: Quantity) -> usize {
    if quantity.is_form() { 2 } else { 1 }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A coefficient of size c is a wave of mean square c²/2.
fn rms(squares: f64) -> f64 {
    (0.5 * squares).sqrt()
}

fn value(name: &str, quantity: Quantity, station: &EvaluatedStation, one: &Estimates) -> Option<MethodValue> {
    let unknown = one.position(quantity)?;
    let section = match quantity {
        Quantity::Form(section) => Some(section),
        _ => None,
    };
    let observable: Vec<Option<(Complex64, f64)>> =
        (1..=one.max_order()).map(|order| one.observable_value(order, unknown)).collect();
    let counted = || observable.iter().skip(first_order(quantity) - 1).flatten();
    let result = &station.result;
    Some(MethodValue {
        method: name.to_owned(),
        z_mm: match quantity {
            Quantity::Form(section) | Quantity::FaceForm(section) => {
                result.separation.sections.get(section).map(|at| at.z_mm)
            }
            motion => motion.is_shift().then_some(one.motion_z_mm),
        },
        rms: rms(counted().map(|(value, _)| value.norm_sqr()).sum()),
        std: known(rms(counted().map(|(_, variance)| variance).sum())),
        ront_um: section.and_then(|section| station.ront(section)).map(|value| value.value),
        truth_rms_error_um: section.and_then(|_| true_error(result, quantity)),
        lost_orders: (1..).zip(&observable).filter(|(_, one)| one.is_none()).map(|(order, _)| order).collect(),
        harmonics: Harmonics {
            re: observable.iter().map(|one| one.map(|(value, _)| value.re)).collect(),
            im: observable.iter().map(|one| one.map(|(value, _)| value.im)).collect(),
            std: observable.iter().map(|one| one.and_then(|(_, variance)| known(variance.sqrt()))).collect(),
        },
    })
}

fn difference(name: &str, quantity: Quantity, pair: [&Estimates; 2], scatter: &Scatter) -> Option<Difference> {
    let unknowns = [pair[0].position(quantity)?, pair[1].position(quantity)?];
    let in_plane = quantity.is_shift();
    let mut moved = None;
    let mut pair = pair;
    if in_plane && !pair[0].in_plane(pair[1].motion_z_mm) {
        let planes = pair.map(|one| one.motion_z_mm);
        if let Some(reference) = pair[0].moved_to(planes[1], scatter) {
            pair[0] = moved.insert(reference);
        } else if let Some(other) = pair[1].moved_to(planes[0], scatter) {
            pair[1] = moved.insert(other);
        } else {
            let reason = format!(
                "given at z = {} mm and at z = {} mm, and tilt is observable by neither method",
                planes[0], planes[1]
            );
            return Some(Difference { method: name.to_owned(), not_compared: Some(reason), ..Difference::default() });
        }
    }
    let z_mm = in_plane.then_some(pair[1].motion_z_mm);
    Some(Difference { method: name.to_owned(), z_mm, ..compared(quantity, pair, unknowns, scatter) })
}

fn compared(quantity: Quantity, pair: [&Estimates; 2], unknowns: [usize; 2], scatter: &Scatter) -> Difference {
    let max_order = pair[0].max_order().min(pair[1].max_order());
    let both_observable = |order: usize| {
        let both = Some((pair[0].observable_value(order, unknowns[0])?, pair[1].observable_value(order, unknowns[1])?));
        both.filter(|_| order >= first_order(quantity))
    };
    let size =
        rms((1..=max_order).filter_map(both_observable).map(|((a, _), (b, _))| a.norm_sqr().max(b.norm_sqr())).sum());
    let mut by_order = DifferenceOrders::default();
    let (mut squares, mut variances, mut orders_compared) = (0.0, 0.0, 0);
    let mut worst: Option<Worst> = None;
    for order in 1..=max_order {
        let Some(((a, variance_a), (b, variance_b))) = both_observable(order) else {
            by_order.difference.push(None);
            by_order.std.push(None);
            by_order.e_n.push(None);
            continue;
        };
        let rows = pair[0].row(order, unknowns[0]).zip(pair[1].row(order, unknowns[1]));
        let variance = rows.map_or(f64::NAN, |(a, b)| {
            let between: Vec<Complex64> = b.iter().zip(a).map(|(b, a)| b - a).collect();
            scatter.variance(order, &between)
        });
        let distance = (b - a).norm();
        let e_n = normalised(distance, variance.sqrt(), variance_a.max(variance_b).sqrt(), size);
        orders_compared += 1;
        squares += distance * distance;
        variances += variance;
        if let Some(e_n) = e_n
            && worst.is_none_or(|worst| e_n > worst.e_n)
        {
            worst = Some(Worst { order, e_n });
        }
        by_order.difference.push(Some(distance));
        by_order.std.push(known(variance.sqrt()));
        by_order.e_n.push(e_n);
    }
    let e_n = by_order.e_n.iter().flatten();
    let within = e_n.clone().filter(|e_n| **e_n <= 1.0).count() as f64 / e_n.count() as f64;
    let of_orders = |value: f64| known(value).filter(|_| orders_compared > 0);
    Difference {
        orders_compared,
        rms: of_orders(rms(squares)),
        expected_rms: of_orders(rms(variances)),
        share_within: known(within),
        worst,
        by_order,
        ..Difference::default()
    }
}

/// E_n = |d| / (2 u), with `own` the larger of both methods' standard uncertainties and `size` their rms value.
///
/// Equal to rounding is 0, and so is a negligible difference of two that follow alike from the readings. Where these differ by
/// more, u is as small as rounding makes it, and E_n large. `None` without scatter.
fn normalised(distance: f64, std: f64, own: f64, size: f64) -> Option<f64> {
    if distance <= ROUNDING * size && (std <= ROUNDING * own || own <= NO_SCATTER * size) {
        return Some(0.0);
    }
    if own > NO_SCATTER * size && std <= ALIKE * own && distance <= NEGLIGIBLE * own {
        return Some(0.0);
    }
    (std.is_finite() && own > NO_SCATTER * size).then(|| distance / (2.0 * std.max(ROUNDING * own)))
}

#[cfg(test)]
mod tests {
    use super::normalised;

    #[test]
    fn rounding_is_no_difference_and_no_scatter_no_uncertainty() {
        assert_eq!(normalised(0.02, 0.01, 0.01, 4.0), Some(1.0));
        assert_eq!(normalised(0.0, 0.0, 0.01, 4.0), Some(0.0), "the same, not 0/0");
        assert_eq!(normalised(1e-12, 1e-16, 0.01, 4.0), Some(0.0));
        assert_eq!(normalised(1e-12, 0.0, 0.0, 4.0), Some(0.0), "turns that are all alike");
        assert_eq!(normalised(0.02, 0.0, 0.0, 4.0), None, "turns that are all alike say nothing of a difference");
        assert_eq!(normalised(0.02, f64::NAN, f64::NAN, 4.0), None, "one turn");
        assert_eq!(normalised(3e-7, 1e-17, 0.02, 4.0), Some(0.0), "three-point by formula and by least squares");
        let proven = normalised(3e-3, 1e-17, 0.02, 4.0).unwrap_or_default();
        assert!(proven > 1e6, "more than the two digits of an uncertainty: {proven}");
        assert_eq!(normalised(1e-4, 5e-5, 0.02, 4.0), Some(1.0), "scatter of their own");
        let systematic = normalised(0.02, 0.0, 0.01, 4.0).unwrap_or_default();
        assert!(systematic > 1e6 && systematic.is_finite(), "no scatter explains it");
    }
}

//! Harmonics of one measured circle, on the angles as they are.

use std::{
    f64::consts::{PI, TAU},
    ops::Range,
};

use runout_core::{
    Complex64,
    numerics::least_squares::{Basis, dot},
};

use crate::{
    robust::{Fence, correlation_factor, rms},
    scan::Scan,
};

/// Harmonics cₙ of a circle, deviation = Re Σ cₙ e^{+inα}.
#[derive(Debug, Clone)]
pub(crate) struct Harmonics {
    /// From order 0 to the highest that the points carry, in µm.
    pub coefficients: Vec<Complex64>,
    /// Variance E|δ|² of each, in µm².
    pub variance: Vec<f64>,
    /// Along a helix: a height, in mm, and about it the change along z of level, cosine and sine at 1/rev, in µm per mm, and the
    /// bend of the level, in µm per mm².
    pub slopes: Option<(f64, [f64; SLOPES])>,
    /// Variance of the level's slope in (µm/mm)², and of its bend in (µm/mm²)².
    pub level_variance: [f64; 2],
    /// Why orders above these are not observable, where more were asked for.
    pub limit: Option<String>,
    /// Root mean square of the residual, in µm.
    pub residual_rms_um: f64,
    /// Points less parameters.
    pub dof: usize,
}

/// Noise of a harmonic beside that of evenly spread points above which an order is not observable.
const WORST_NOISE_GAIN: f64 = 10.0;
/// The lowest order of roundness: a circle that does not carry it has no form.
const LOWEST_ORDER: usize = 2;
/// Slopes along z of level, cosine and sine, and the bend of the level.
const SLOPES: usize = 4;

impl Harmonics {
    /// Least squares of orders 0 to `max_order`, or to the highest order that the points carry: an arc without points makes
    /// high orders indistinguishable from low ones. Points measured twice, where a circle overlaps itself, count twice.
    /// On turns of a helix (`about_mm`), level and centre change along z about that height: the centre linearly, the level with a bend.
    ///
    /// The variance is the residual's, raised by its correlation along the trace. Errors that vary more slowly than
    /// the highest order (drift, thermal growth, the machine's own geometry) are inside the harmonics, where nothing
    /// separates them from form: they are not in the variance. A covariance fitted to the residual would have to be carried to lower
    /// orders than it has, and calls the part's own high orders noise.
    ///
    /// With them comes the basis of their columns.
    ///
    /// # Errors
    /// When the points carry no order of roundness, in words.
    pub(crate) fn fit(scan: &Scan, max_order: usize, about_mm: Option<f64>) -> Result<(Self, Basis), String> {
        let slopes = if about_mm.is_some() { SLOPES } else { 0 };
        let points = scan.len();
        let most = points.saturating_sub(slopes + 2) / 2;
        let highest = max_order.min(most);
        if highest < LOWEST_ORDER {
            return Err(format!("{points} points do not determine orders 0 to {LOWEST_ORDER}"));
        }
        let entry = |column: usize, row: usize| {
            let (angle, z) = (scan.angle_rad[row], scan.z_mm[row]);
            match about_mm {
                Some(about) if column < SLOPES => along(angle, z - about, column),
                _ => basis(angle, column - slopes),
            }
        };
        let columns = 0..slopes + 2 * highest + 1;
        let basis = Basis::of(columns.map(|column| (0..points).map(|row| entry(column, row)).collect()).collect());
        let (order, unit_variance) = carried(&basis, points, slopes).ok_or_else(|| {
            let [from, to] = widest_gap_deg(&scan.angle_rad);
            format!(
                "its points do not determine orders 0 to {LOWEST_ORDER}; there is none between {from:.2}° and {to:.2}°"
            )
        })?;
        let limit = (order < max_order).then(|| limit(scan, order, highest));
        let columns = slopes + 2 * order + 1;
        let basis = basis.first(columns);
        let values = basis.coefficients(&scan.deviation_um);
        let mut residual = scan.deviation_um.clone();
        basis.remove_from(&mut residual);
        let dof = points - columns;
        let variance = dot(&residual, &residual) / dof as f64 * correlation_factor(&residual);
        let (sloped, values) = values.split_at(slopes);
        let (sloped_unit, unit) = unit_variance.split_at(slopes);
        let level = (Complex64::from(values[0]), variance * unit[0]);
        let pairs = values[1..].chunks_exact(2).zip(unit[1..].chunks_exact(2));
        // a cos nα + b sin nα = Re (a − ib) e^{inα}.
        let orders = pairs.map(|(value, unit)| (Complex64::new(value[0], -value[1]), variance * (unit[0] + unit[1])));
        let (coefficients, order_variance) = std::iter::once(level).chain(orders).unzip();
        let found = Self {
            coefficients,
            variance: order_variance,
            slopes: about_mm.zip(<[f64; SLOPES]>::try_from(sloped).ok()),
            level_variance: [0, SLOPES - 1].map(|slope| variance * sloped_unit.get(slope).copied().unwrap_or(0.0)),
            limit,
            residual_rms_um: rms(residual.iter().copied()),
            dof,
        };
        Ok((found, basis))
    }

    /// The highest order.
    #[must_use]
    pub(crate) fn max_order(&self) -> usize {
        self.coefficients.len() - 1
    }

    /// Their sum at a place, in µm.
    #[must_use]
    pub(crate) fn value_um(&self, angle_rad: f64, z_mm: f64) -> f64 {
        let terms = self.coefficients.iter().enumerate();
        let at_height: f64 = terms.map(|(order, value)| (value * Complex64::cis(order as f64 * angle_rad)).re).sum();
        at_height + self.sloped_um(angle_rad, z_mm)
    }

    /// What the slopes add at a place, in µm.
    #[must_use]
    pub(crate) fn sloped_um(&self, angle_rad: f64, z_mm: f64) -> f64 {
        let Some((about_mm, slopes)) = self.slopes else { return 0.0 };
        slopes.iter().enumerate().map(|(column, slope)| slope * along(angle_rad, z_mm - about_mm, column)).sum()
    }
}

/// The highest order whose model has no harmonic of more than [`WORST_NOISE_GAIN`], and the unit variances of its columns: more orders never lower one.
fn carried(basis: &Basis, points: usize, slopes: usize) -> Option<(usize, Vec<f64>)> {
    let inverse = basis.inverse();
    let mut unit_variance = vec![0.0; inverse.len()];
    let mut best = None;
    for (column, entries) in inverse.iter().enumerate().take(basis.leading()) {
        unit_variance.iter_mut().zip(entries).for_each(|(sum, entry)| *sum += entry * entry);
        let Some(order) = column.checked_sub(slopes).filter(|waves| waves.is_multiple_of(2)).map(|waves| waves / 2)
        else {
            continue;
        };
        let worst = unit_variance[slopes..=column].iter().fold(0.0_f64, |worst, variance| worst.max(*variance));
        // Evenly spread points give each cosine and sine the variance 2/n.
        if worst * points as f64 / 2.0 > WORST_NOISE_GAIN * WORST_NOISE_GAIN {
            break;
        }
        if order >= LOWEST_ORDER {
            best = Some((order, unit_variance[..=column].to_vec()));
        }
    }
    best
}

/// Why orders above `order` are not observable.
fn limit(scan: &Scan, order: usize, highest: usize) -> String {
    if order == highest {
        return format!("orders above {order} are not observable: it has {} points", scan.len());
    }
    let [from, to] = widest_gap_deg(&scan.angle_rad);
    format!("orders above {order} are not observable: there is no point between {from:.2}° and {to:.2}°")
}

/// Columns t, t cos α, t sin α, t² of the height t from the middle.
fn along(angle_rad: f64, arm_mm: f64, column: usize) -> f64 {
    if column + 1 < SLOPES { arm_mm * basis(angle_rad, column) } else { arm_mm * arm_mm }
}

/// Columns 1, cos α, sin α, cos 2α, sin 2α …
fn basis(angle_rad: f64, column: usize) -> f64 {
    let phase = column.div_ceil(2) as f64 * angle_rad;
    if column.is_multiple_of(2) && column > 0 { phase.sin() } else { phase.cos() }
}

/// A circle with its wild points set aside.
#[derive(Debug, Clone)]
pub(crate) struct Cleaned {
    /// Whether each point is kept.
    pub kept: Vec<bool>,
    /// Distance of each point from the fit of those kept, in µm.
    pub distance_um: Vec<f64>,
    /// Distance from which points were left out, in µm.
    pub limit_um: f64,
    /// Highest order of that fit.
    pub max_order: usize,
}

/// With so many points to an order, half of them are redundant: fewer, and a wild point bends the fit so far that it takes its neighbours
/// with it.
const POINTS_AN_ORDER: usize = 4;
/// More rounds than any circle needs; one whose borderline points alternate stops here.
const ROUNDS: usize = 20;

impl Cleaned {
    /// Sets aside points that are further from the harmonics of the others than `deviations` median absolute
    /// deviations: where the probe swings in or lifts off, dust, ringing after a scratch. Repeated until the set stays;
    /// points may come back. Few points lower the highest order.
    ///
    /// # Errors
    /// What hinders the fit, in words.
    pub(crate) fn of(scan: &Scan, max_order: usize, about_mm: Option<f64>, deviations: f64) -> Result<Self, String> {
        Self::beginning_with(vec![true; scan.len()], scan, max_order, about_mm, deviations)
    }

    /// Sets aside points as [`of`](Self::of) does, beginning with the points in `kept`.
    ///
    /// # Errors
    /// What hinders the fit, in words.
    pub(crate) fn beginning_with(
        mut kept: Vec<bool>,
        scan: &Scan,
        max_order: usize,
        about_mm: Option<f64>,
        deviations: f64,
    ) -> Result<Self, String> {
        let max_order = max_order.min((scan.len() / POINTS_AN_ORDER).max(LOWEST_ORDER));
        for round in 1.. {
            let (fit, _) = Harmonics::fit(&scan.keep(&kept), max_order, about_mm)?;
            let distance_um: Vec<f64> =
                scan.iter().map(|(angle, z, deviation)| deviation - fit.value_um(angle, z)).collect();
            let fence = Fence::around(&distance_um, deviations);
            let next: Vec<bool> = distance_um.iter().map(|distance| fence.holds(*distance)).collect();
            if next == kept || round == ROUNDS {
                return Ok(Self { kept, distance_um, limit_um: fence.distance, max_order: fit.max_order() });
            }
            kept = next;
        }
        Err("its outliers never settle".into())
    }

    /// The result for some consecutive points.
    #[must_use]
    pub(crate) fn range(self, start: usize, count: usize) -> Self {
        let kept = self.kept.into_iter().skip(start).take(count).collect();
        let distance_um = self.distance_um.into_iter().skip(start).take(count).collect();
        Self { kept, distance_um, ..self }
    }

    /// Number of points left out.
    #[must_use]
    pub(crate) fn left_out(&self) -> usize {
        self.kept.iter().filter(|kept| !**kept).count()
    }

    /// Arcs that points were left out of: from the first of them to the last, and how many.
    #[must_use]
    pub(crate) fn arcs(&self) -> Vec<(Range<usize>, usize)> {
        // Ringing leaves out every other point; so many kept ones between do not end an arc.
        const BRIDGED: usize = 5;
        let mut arcs: Vec<(Range<usize>, usize)> = Vec::new();
        for (point, _) in self.kept.iter().enumerate().filter(|(_, kept)| !**kept) {
            match arcs.last_mut() {
                Some((arc, count)) if point < arc.end + BRIDGED => (arc.end, *count) = (point + 1, *count + 1),
                _ => arcs.push((point..point + 1, 1)),
            }
        }
        arcs
    }

    /// Arcs that points were left out of, as angles in degrees: from, to, how many.
    #[must_use]
    pub(crate) fn stretches(&self, scan: &Scan) -> Vec<(f64, f64, usize)> {
        let degrees = |point: usize| scan.angle_rad[point].to_degrees();
        let arcs = self.arcs().into_iter();
        arcs.map(|(arc, count)| (degrees(arc.start), degrees(arc.end - 1), count)).collect()
    }
}

/// Stretches of the circle from each point to the next one, in rad.
#[must_use]
pub(crate) fn empty_stretches(angle_rad: &[f64]) -> Vec<[f64; 2]> {
    let mut angles: Vec<f64> = angle_rad.iter().map(|angle| angle.rem_euclid(TAU)).collect();
    angles.sort_by(f64::total_cmp);
    let around = angles.first().map(|first| first + TAU);
    let next = angles.iter().copied().skip(1).chain(around);
    // The input runs from −180° to 180° as often as from 0° to 360°; the smaller numbers read better.
    let near_zero = |(from, to): (f64, f64)| if from > PI { [from - TAU, to - TAU] } else { [from, to] };
    angles.iter().copied().zip(next).map(near_zero).collect()
}

/// The widest stretch of the circle without a point, in degrees.
fn widest_gap_deg(angle_rad: &[f64]) -> [f64; 2] {
    let wider =
        |widest: [f64; 2], next: [f64; 2]| if next[1] - next[0] > widest[1] - widest[0] { next } else { widest };
    empty_stretches(angle_rad).into_iter().fold([0.0; 2], wider).map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle on uneven angles that overlaps its own beginning by 2°: level, eccentricity, three and eleven lobes.
    fn measured(noise: impl Fn(usize) -> f64) -> Scan {
        let mut scan = Scan::default();
        for index in 0..700 {
            let even = (362.0 / 700.0 * index as f64).to_radians();
            let angle = even + 0.002 * (17.0 * even).sin();
            let form = 0.4 + 0.3 * (angle - 1.0).cos() + 2.0 * (3.0 * angle + 0.5).cos() + 0.7 * (11.0 * angle).sin();
            scan.push(angle, 5.0, form + noise(index));
        }
        scan
    }

    #[test]
    fn harmonics_on_uneven_overlapping_angles() {
        let found = Harmonics::fit(&measured(|_| 0.0), 20, None).unwrap().0;
        let expected = |order: usize| match order {
            0 => Complex64::from(0.4),
            1 => Complex64::from_polar(0.3, -1.0),
            3 => Complex64::from_polar(2.0, 0.5),
            11 => Complex64::new(0.0, -0.7),
            _ => Complex64::ZERO,
        };
        for (order, value) in found.coefficients.iter().enumerate() {
            // 1e-12: rounding of 700 terms near 1.
            assert!((value - expected(order)).norm() < 1e-12, "order {order}: {value}");
        }
        assert_eq!(found.dof, 700 - 41);
    }

    #[test]
    fn the_variance_is_that_of_the_scatter() {
        // Many circles with independent uniform noise of variance 1/12: the mean square error of a coefficient, over
        // 40 circles and 15 orders (1200 squares), has a relative deviation of √(2/1200) = 4 %; four of them.
        let mut seed = 3_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let truth = Harmonics::fit(&measured(|_| 0.0), 20, None).unwrap().0;
        let (mut square, mut stated) = (0.0, 0.0);
        for _ in 0..40 {
            let noise: Vec<f64> = (0..700).map(|_| uniform()).collect();
            let found = Harmonics::fit(&measured(|index| noise[index]), 20, None).unwrap().0;
            for order in 4..19 {
                square += (found.coefficients[order] - truth.coefficients[order]).norm_sqr();
                stated += found.variance[order];
            }
        }
        // The correlation factor is at least 1, so what is stated may be some 10 % high.
        let ratio = square / stated;
        assert!((0.75..1.16).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_probe_that_swings_in_and_lifts_off_is_left_out() {
        let ripple = |index: usize| 0.05 * ((index * 7919 % 101) as f64 / 50.0 - 1.0);
        let scan = measured(|index| ripple(index) + if index < 4 || index == 699 { -30.0 } else { 0.0 });
        let cleaned = Cleaned::of(&scan, 20, None, 5.0).unwrap();
        assert_eq!(cleaned.left_out(), 5);
        let stretches = cleaned.stretches(&scan);
        assert_eq!(stretches.iter().map(|stretch| stretch.2).collect::<Vec<_>>(), [4, 1]);
        let clean = Cleaned::of(&measured(|_| 0.0), 20, None, 5.0).unwrap();
        assert_eq!(clean.left_out(), 0, "data without noise has no outliers");
    }

    /// 120 points and orders to 50: a wild point is left out, and none of the good ones.
    #[test]
    fn few_points_lose_a_wild_one_only() {
        let scan = measured(|index| 0.05 * ((index * 7919 % 101) as f64 / 50.0 - 1.0));
        let few: Vec<bool> = (0..700).map(|index| index % 6 == 0).collect();
        let mut scan = scan.keep(&few);
        assert_eq!(Cleaned::of(&scan, 50, None, 5.0).unwrap().left_out(), 0);
        scan.deviation_um[60] += 30.0;
        let cleaned = Cleaned::of(&scan, 50, None, 5.0).unwrap();
        assert_eq!((cleaned.left_out(), cleaned.kept[60]), (1, false));
    }

    #[test]
    fn an_arc_without_points_limits_the_orders() {
        let scan = measured(|_| 0.0);
        let fit = |from: f64, to: f64, max_order: usize| {
            let kept: Vec<bool> = scan.angle_rad.iter().map(|angle| (from..to).contains(angle)).collect();
            Harmonics::fit(&scan.keep(&kept), max_order, None).map(|(found, _)| found)
        };
        // A tenth of the circle without points carries fewer orders than 20, and the reason has its place.
        let most = fit(0.7, 6.2, 20).unwrap();
        let limit = most.limit.clone().unwrap();
        assert!((4..20).contains(&most.max_order()), "{limit}");
        assert!(limit.contains("between -4.") && limit.contains("and 40."), "{limit}");
        // It is the highest order of which no harmonic has more than ten times the noise of even points.
        let gain = |order: usize| {
            let columns = 2 * order + 1;
            let rows: Vec<f64> = scan.angle_rad.iter().copied().filter(|angle| (0.7..6.2).contains(angle)).collect();
            let matrix = nalgebra::DMatrix::from_fn(rows.len(), columns, |row, column| basis(rows[row], column));
            let inverse = (matrix.transpose() * &matrix).try_inverse().unwrap();
            (inverse.diagonal().max() * rows.len() as f64 / 2.0).sqrt()
        };
        assert!(gain(most.max_order()) <= 10.0 && gain(most.max_order() + 1) > 10.0);
        assert!(fit(0.7, 6.2, 3).unwrap().limit.is_none(), "three lobes are carried");
        let few: Vec<bool> = (0..700).map(|index| index % 24 == 0).collect();
        let few = Harmonics::fit(&scan.keep(&few), 20, None).unwrap().0;
        assert_eq!((few.max_order(), few.limit.unwrap().contains("it has 30 points")), (14, true));
        let message = fit(1.0, 2.0, 20).unwrap_err();
        assert!(message.contains("between 114.") && message.contains("and 417."), "{message}");
        assert!(Harmonics::fit(&Scan::default(), 20, None).is_err());
    }
}

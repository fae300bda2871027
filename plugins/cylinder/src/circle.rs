//! Harmonics of one measured circle, on the angles as they are.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use runout_core::Complex64;

use crate::{
    least_squares,
    robust::{Fence, correlation_factor, rms},
    scan::Scan,
};

/// Harmonics cₙ of a circle, deviation = Re Σ cₙ e^{+inα}.
#[derive(Debug, Clone)]
pub struct Harmonics {
    /// From order 0, in µm.
    pub coefficients: Vec<Complex64>,
    /// Variance E|δ|² of each, in µm².
    pub variance: Vec<f64>,
    /// Root mean square of what is left, in µm.
    pub residual_rms_um: f64,
    /// Points less parameters.
    pub dof: usize,
}

/// Noise of a harmonic beside that of evenly spread points at which a circle no longer bears it.
const WORST_NOISE_GAIN: f64 = 10.0;

impl Harmonics {
    /// Least squares of orders 0 to `max_order`; points measured twice, where a circle overlaps itself, count twice.
    ///
    /// The variance is the residual's, raised by its correlation along the trace. Errors that vary more slowly than
    /// the highest order (drift, thermal growth, the machine's own geometry) are inside the harmonics, where nothing
    /// tells them from form: they are not in the variance.
    ///
    /// # Errors
    /// What hinders the fit, in words.
    pub fn fit(scan: &Scan, max_order: usize) -> Result<Self, String> {
        let columns = 2 * max_order + 1;
        let points = scan.len();
        if points <= columns {
            return Err(format!(
                "{points} points cannot tell orders 0 to {max_order}, which have {columns} parameters"
            ));
        }
        let basis = DMatrix::from_fn(points, columns, |row, column| basis(scan.angle_rad[row], column));
        let right = DVector::from_column_slice(&scan.deviation_um);
        let unbearable = || {
            let [from, to] = widest_gap_deg(&scan.angle_rad);
            format!("its points cannot tell orders 0 to {max_order}; there is none between {from:.2}° and {to:.2}°")
        };
        let found = least_squares::solve(basis.clone(), right.clone()).ok_or_else(unbearable)?;
        // Evenly spread points give each cosine and sine the variance 2/n.
        let worst = found.unit_variance.iter().fold(0.0_f64, |worst, variance| worst.max(*variance));
        if worst * points as f64 / 2.0 > WORST_NOISE_GAIN * WORST_NOISE_GAIN {
            return Err(unbearable());
        }
        let residual = right - &basis * DVector::from_column_slice(&found.values);
        let dof = points - columns;
        let variance = residual.norm_squared() / dof as f64 * correlation_factor(residual.as_slice());
        let level = (Complex64::from(found.values[0]), variance * found.unit_variance[0]);
        let pairs = found.values[1..].chunks_exact(2).zip(found.unit_variance[1..].chunks_exact(2));
        // a cos nα + b sin nα = Re (a − ib) e^{inα}.
        let orders = pairs.map(|(value, unit)| (Complex64::new(value[0], -value[1]), variance * (unit[0] + unit[1])));
        let (coefficients, variance) = std::iter::once(level).chain(orders).unzip();
        Ok(Self { coefficients, variance, residual_rms_um: rms(residual.iter().copied()), dof })
    }

    /// Their sum at an angle, in µm.
    #[must_use]
    pub fn value_um(&self, angle_rad: f64) -> f64 {
        let terms = self.coefficients.iter().enumerate();
        terms.map(|(order, value)| (value * Complex64::cis(order as f64 * angle_rad)).re).sum()
    }
}

/// Columns 1, cos α, sin α, cos 2α, sin 2α …
fn basis(angle_rad: f64, column: usize) -> f64 {
    let phase = column.div_ceil(2) as f64 * angle_rad;
    if column.is_multiple_of(2) && column > 0 { phase.sin() } else { phase.cos() }
}

/// A circle with its wild points set aside.
#[derive(Debug, Clone)]
pub struct Cleaned {
    /// Whether each point is kept.
    pub kept: Vec<bool>,
    /// Distance of each point from the fit of those kept, in µm.
    pub distance_um: Vec<f64>,
    /// Distance from which points were left out, in µm.
    pub limit_um: f64,
}

/// More rounds than any circle needs; one whose borderline points alternate stops here.
const ROUNDS: usize = 20;

impl Cleaned {
    /// Sets aside points that are further from the harmonics of the others than `deviations` median absolute
    /// deviations: where the probe swings in or lifts off, dust, ringing after a scratch. Repeated until the set stays;
    /// points may come back.
    ///
    /// # Errors
    /// What hinders the fit, in words.
    pub fn of(scan: &Scan, max_order: usize, deviations: f64) -> Result<Self, String> {
        let mut kept = vec![true; scan.len()];
        for round in 1.. {
            let fit = Harmonics::fit(&scan.keep(&kept), max_order)?;
            let distance_um: Vec<f64> =
                scan.iter().map(|(angle, _, deviation)| deviation - fit.value_um(angle)).collect();
            let fence = Fence::around(&distance_um, deviations);
            let next: Vec<bool> = distance_um.iter().map(|distance| fence.holds(*distance)).collect();
            if next == kept || round == ROUNDS {
                return Ok(Self { kept, distance_um, limit_um: fence.distance });
            }
            kept = next;
        }
        Err("its outliers never settle".into())
    }

    /// Number of points left out.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.kept.iter().filter(|kept| !**kept).count()
    }

    /// Stretches of the trace that points were left out of, as angles in degrees: from, to, how many.
    #[must_use]
    pub fn stretches(&self, scan: &Scan) -> Vec<(f64, f64, usize)> {
        // Ringing leaves out every other point; so many kept ones between do not end a stretch.
        const BRIDGED: usize = 5;
        let mut stretches: Vec<(f64, f64, usize)> = Vec::new();
        let mut since = BRIDGED + 1;
        for (angle, kept) in scan.angle_rad.iter().zip(&self.kept) {
            since += 1;
            if *kept {
                continue;
            }
            match stretches.last_mut() {
                Some((_, to, count)) if since <= BRIDGED => (*to, *count) = (angle.to_degrees(), *count + 1),
                _ => stretches.push((angle.to_degrees(), angle.to_degrees(), 1)),
            }
            since = 0;
        }
        stretches
    }
}

/// Stretches of the circle from each point to the next one, in rad.
#[must_use]
pub fn empty_stretches(angle_rad: &[f64]) -> Vec<[f64; 2]> {
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
        let found = Harmonics::fit(&measured(|_| 0.0), 20).unwrap();
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
        let truth = Harmonics::fit(&measured(|_| 0.0), 20).unwrap();
        let (mut square, mut stated) = (0.0, 0.0);
        for _ in 0..40 {
            let noise: Vec<f64> = (0..700).map(|_| uniform()).collect();
            let found = Harmonics::fit(&measured(|index| noise[index]), 20).unwrap();
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
        let cleaned = Cleaned::of(&scan, 20, 5.0).unwrap();
        assert_eq!(cleaned.left_out(), 5);
        let stretches = cleaned.stretches(&scan);
        assert_eq!(stretches.iter().map(|stretch| stretch.2).collect::<Vec<_>>(), [4, 1]);
        let clean = Cleaned::of(&measured(|_| 0.0), 20, 5.0).unwrap();
        assert_eq!(clean.left_out(), 0, "data without noise has no outliers");
    }

    #[test]
    fn what_a_circle_cannot_tell_is_refused_with_the_place() {
        let scan = measured(|_| 0.0);
        let half: Vec<bool> = scan.angle_rad.iter().map(|angle| (1.0..5.0).contains(angle)).collect();
        let message = Harmonics::fit(&scan.keep(&half), 20).unwrap_err();
        // From 5 rad, 286.5° or −73.5°, to 1 rad, 57.3°, within one step of 0.5°.
        assert!(message.contains("between -73.") && message.contains("and 57."), "{message}");
        let few: Vec<bool> = (0..700).map(|index| index < 30).collect();
        assert!(Harmonics::fit(&scan.keep(&few), 20).unwrap_err().contains("30 points"));
        assert!(Harmonics::fit(&Scan::default(), 20).is_err());
    }
}

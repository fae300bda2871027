//! Circles that are tested on their own points: which stay, and what is stated where errors depend on each other.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::f64::consts::TAU;

use crate::simulator::{Part, Recording, around};
use runout_core::{Complex64, points::Points, separation::Separation};
use runout_cylinder::{LeastSquaresCylinder, LeastSquaresCylinderConfig};

fn separator(radius_mm: f64, max_order: usize) -> LeastSquaresCylinder {
    let config = LeastSquaresCylinderConfig {
        radius_mm,
        used: None,
        hold_out: Vec::new(),
        max_order,
        outlier_mad: None,
        outlier_order: 50,
        max_lobes: 8,
    };
    config.separator().unwrap()
}

/// Of the observable orders from 2 on, on 720 angles, with the standard deviation of the form at one angle.
fn peak_to_valley(section: &Separation) -> (f64, f64) {
    let orders = || (2..section.estimate.len()).filter(|order| section.observable[*order]);
    let at = |angle: f64| -> f64 {
        orders().map(|order| (section.estimate[order] * Complex64::cis(order as f64 * angle)).re).sum()
    };
    let form = (0..720).map(|step| at(TAU * f64::from(step) / 720.0));
    let [low, high] =
        form.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    (high - low, (orders().map(|order| 0.5 * section.variance[order]).sum::<f64>()).sqrt())
}

fn deviations(points: &mut Points) -> &mut Vec<f64> {
    &mut points.columns.iter_mut().find(|column| column.name == "deviation_um").unwrap().values
}

/// Circles of few points with lobes, of which one point is high: it is form as far as anybody knows, and stays in it.
#[test]
fn honest_points_of_few_stay() {
    let lobes = |angle: f64| 12.0 * (2.0 * angle).cos() + 3.0 * (4.0 * angle + 1.0).cos() + 2.0 * (5.0 * angle).sin();
    for (count, high, seed) in [(24, 3, 1), (30, 11, 2), (36, 20, 3), (48, 7, 4)] {
        let part =
            Part { radius_um: 30_000.0, through_um: [0.0; 2], slope: [0.0; 2], form_um: &|angle, _| lobes(angle) };
        let mut points = Recording::of(part, 30.0, 0.7, seed).circle("C1", 0.0, count).points();
        deviations(&mut points)[high] += 20.0;
        // Peak to valley of the points about their least-squares circle, by Fourier sums of even angles.
        let (values, angles) = (deviations(&mut points).clone(), around(0.0, count));
        let sum = |wave: fn(f64) -> f64| {
            let each = values.iter().zip(around(0.0, count)).map(|(value, (_, angle))| value * wave(angle));
            2.0 / count as f64 * each.sum::<f64>()
        };
        let (x, y) = (sum(f64::cos), sum(f64::sin));
        let about: Vec<f64> =
            values.iter().zip(angles).map(|(value, (_, a))| value - x * a.cos() - y * a.sin()).collect();
        let [low, high] = about.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
        let form = separator(30.0, 50).form(&points).unwrap();
        let (found, std) = peak_to_valley(&form.sections[0]);
        println!("{count} points: RONt {found:.2} ± {std:.2}, of the points {:.2}", high - low);
        assert!(found > 0.93 * (high - low) && found < 1.2 * (high - low), "{count}: {found} of {}", high - low);
        assert!(form.sections[0].warnings.iter().all(|warning| !warning.contains("left out")), "{form:?}");
    }
}

/// Harmonics of a circle whose errors are independent, or depend on each other along the angle: their squares are what is stated.
#[test]
#[ignore = "not met: with errors correlated by 0.7 from point to point the stated variance is 2.7 times too small"]
fn variances_hold_where_errors_depend_on_each_other() {
    let mut seed = 17_u64;
    let mut normal = || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..12).map(|_| uniform()).sum::<f64>()
    };
    for (decay, limits) in [(0.0_f64, [0.85, 1.15]), (0.7, [0.7, 1.5]), (0.85, [0.6, 1.7])] {
        let (mut square, mut stated, trials) = (0.0, 0.0, 30);
        for _ in 0..trials {
            let part = Part { radius_um: 20_000.0, through_um: [0.0; 2], slope: [0.0; 2], form_um: &|_, _| 0.0 };
            let mut points = Recording::of(part, 20.0, 0.0, 1).circle("C1", 0.0, 400).points();
            let mut state = normal();
            for value in deviations(&mut points) {
                *value += state;
                state = decay * state + (1.0 - decay * decay).sqrt() * normal();
            }
            let form = separator(20.0, 15).form(&points).unwrap();
            let section = &form.sections[0];
            for order in 2..=15 {
                square += section.estimate[order].norm_sqr();
                stated += section.variance[order];
            }
        }
        let ratio = square / stated;
        println!("{decay}: {ratio:.2}");
        assert!((limits[0]..limits[1]).contains(&ratio), "{decay}: {ratio}");
    }
}

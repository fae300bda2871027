#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "tests; the ends of a grid are exact")]

use std::f64::consts::TAU;

use proptest::prelude::*;

use super::{Surface, SurfaceBuilder, SurfaceConfig};
use crate::{
    separation::{Quantity, SectionAt, Separation},
    station::StationResult,
};
use runout_numerics::Complex64;

/// A station of sections (id, z in mm, coefficients by order), each order with this variance.
fn station(name: &str, sections: &[(&str, f64, &[Complex64])], variance: f64) -> StationResult {
    let width = sections.len();
    let orders = sections[0].2.len();
    let entries = || (0..orders).flat_map(|order| sections.iter().map(move |(_, _, form)| form[order]));
    StationResult {
        station: name.into(),
        z_mm: 0.0,
        angles: 64,
        separation: Separation {
            sections: sections.iter().map(|(id, z_mm, _)| SectionAt::whole(*id, *z_mm)).collect(),
            unknowns: (0..width).map(Quantity::Form).collect(),
            estimate: entries().collect(),
            variance: vec![variance; width * orders],
            observable: entries().map(|value| !value.re.is_nan()).collect(),
            ..Separation::default()
        },
        profiles: Vec::new(),
        truth: None,
    }
}

/// Only a mean level.
fn level(value: f64) -> [Complex64; 1] {
    [Complex64::new(value, 0.0)]
}

fn surface_of_levels(knots: &[(f64, f64)], config: &SurfaceConfig) -> Surface {
    let mut builder = SurfaceBuilder::new(config);
    for (index, (z_mm, value)) in knots.iter().enumerate() {
        builder.add(&station(&format!("s{index}"), &[("a", *z_mm, &level(*value))], f64::NAN));
    }
    builder.build(30.0).unwrap().0
}

fn config(angles: usize, step_mm: Option<f64>) -> SurfaceConfig {
    SurfaceConfig { angles, step_mm }
}

fn knots() -> impl Strategy<Value = Vec<(f64, f64)>> {
    // Gaps from 0.01 to 50 mm: very uneven stations.
    prop::collection::vec((0.01..50.0_f64, -20.0..20.0_f64), 2..12).prop_map(|steps| {
        let mut z = -100.0;
        steps
            .into_iter()
            .map(|(gap, value)| {
                z += gap;
                (z, value)
            })
            .collect()
    })
}

proptest! {
    #[test]
    fn between_two_sections_the_surface_stays_between_their_values(knots in knots(), fractions in prop::collection::vec(0.0..=1.0_f64, 20)) {
        let surface = surface_of_levels(&knots, &config(8, None));
        for pair in knots.windows(2) {
            let (low, high) = (pair[0].1.min(pair[1].1), pair[0].1.max(pair[1].1));
            let mut before = None;
            let mut ascending = fractions.clone();
            ascending.sort_by(f64::total_cmp);
            for fraction in ascending {
                let value = surface.sample(0.3, pair[0].0 + fraction * (pair[1].0 - pair[0].0)).unwrap();
                // 1e-12 µm: rounding of values up to 20 µm.
                prop_assert!(value >= low - 1e-12 && value <= high + 1e-12, "{value} outside {low}..{high}");
                let rises = (pair[1].1 - pair[0].1).signum();
                if let Some(before) = before {
                    prop_assert!(rises * (value - before) >= -1e-12, "turns back from {before} to {value}");
                }
                before = Some(value);
            }
        }
    }

    #[test]
    fn a_cone_stays_a_cone(knots in knots(), slope in -0.5..0.5_f64, step in 0.5..5.0_f64) {
        let cone: Vec<_> = knots.iter().map(|(z, _)| (*z, 3.0 + slope * z)).collect();
        let surface = surface_of_levels(&cone, &config(8, Some(step)));
        let (first, last) = (cone[0].0, cone[cone.len() - 1].0);
        prop_assert_eq!(surface.z_mm[0], first);
        prop_assert_eq!(surface.z_mm[surface.z_mm.len() - 1], last);
        for (ring, z) in surface.z_mm.iter().enumerate() {
            // 1e-11 µm: rounding of 600 mm times 0.5 µm/mm over gaps of 0.01 mm.
            prop_assert!((surface.ring(ring)[3] - (3.0 + slope * z)).abs() < 1e-11);
        }
        prop_assert!(surface.z_mm.windows(2).all(|pair| pair[0] < pair[1] && pair[1] - pair[0] < 1.0011 * step));
    }
}

#[test]
fn sections_come_back_at_their_own_angles_and_in_between() {
    // 31 and 32 angles hold orders up to 15.
    for angles in [31, 32] {
        let mut first = vec![Complex64::ZERO; 16];
        let mut second = first.clone();
        first[2] = Complex64::from_polar(4.0, 0.4);
        first[15] = Complex64::from_polar(1.0, -2.0);
        second[3] = Complex64::from_polar(2.5, 1.1);
        second[0] = Complex64::new(-7.0, 0.0);
        let mut builder = SurfaceBuilder::new(&config(angles, None));
        // Out of order: the builder sorts.
        builder.add(&station("far", &[("a", 50.0, &second)], f64::NAN));
        builder.add(&station("near", &[("a", 10.0, &first)], f64::NAN));
        let surface = builder.build(30.0).unwrap().0;
        assert_eq!(surface.z_mm, [10.0, 50.0]);
        let form = |orders: &[Complex64], angle: f64| -> f64 {
            let wave =
                |(order, value): (usize, &Complex64)| (value * Complex64::from_polar(1.0, order as f64 * angle)).re;
            orders.iter().enumerate().map(wave).sum()
        };
        for step in 0..400 {
            let angle = TAU * f64::from(step) / 173.0 - 3.0;
            let (near, far) = (form(&first, angle), form(&second, angle));
            // 1e-12 µm: rounding of sums near 10 µm.
            assert!((surface.sample(angle, 10.0).unwrap() - near).abs() < 1e-12);
            assert!((surface.sample(angle, 50.0).unwrap() - far).abs() < 1e-12);
            // Two sections: a straight line between them.
            assert!((surface.sample(angle, 20.0).unwrap() - (0.75 * near + 0.25 * far)).abs() < 1e-12);
        }
    }
}

#[test]
fn the_seam_is_a_place_like_any_other() {
    let form: Vec<_> =
        (0..12).map(|order| Complex64::from_polar(1.0 / f64::from(order + 1), f64::from(order))).collect();
    let mut builder = SurfaceBuilder::new(&config(40, None));
    builder.add(&station("s1", &[("a", 0.0, &form), ("b", 1.0, &form)], f64::NAN));
    let surface = builder.build(10.0).unwrap().0;
    let around = |turns: f64| surface.sample(TAU * turns, 0.5).unwrap();
    assert!((around(0.0) - surface.ring(0)[0]).abs() < 1e-12);
    assert!((around(0.0) - around(1.0)).abs() < 1e-12);
    assert!((around(-0.01) - around(0.99)).abs() < 1e-12);
    // Slope at most Σ n|c_n| < 12 µm/rad: over 2e-9 turns below 2e-7 µm.
    assert!((around(1e-9) - around(-1e-9)).abs() < 2e-7);
}

#[test]
fn nothing_is_said_beyond_the_ends() {
    let surface = surface_of_levels(&[(0.0, 1.0), (5.0, 2.0), (6.0, 4.0)], &config(8, None));
    assert_eq!(surface.sample(0.0, -1e-9), None);
    assert_eq!(surface.sample(0.0, 6.0 + 1e-9), None);
    assert_eq!(surface.sample(0.0, f64::NAN), None);
    assert_eq!(surface.sample(f64::INFINITY, 1.0), None);
    assert_eq!(surface.sample(0.0, 6.0), Some(4.0));
}

#[test]
fn sections_of_two_sensors_meet_and_are_averaged_by_their_variance() {
    let form = |amplitude: f64| vec![Complex64::ZERO, Complex64::ZERO, Complex64::new(amplitude, 0.0)];
    let mut builder = SurfaceBuilder::new(&config(64, None));
    // Section a at 230 mm (station s2) and b at 230 mm (station s1) differ by 0.3 µm at order 2.
    builder.add(&station("s1", &[("a", 200.0, &form(1.0)), ("b", 230.0, &form(2.0))], 0.01));
    builder.add(&station("s2", &[("a", 230.0004, &form(2.3)), ("b", 260.0, &form(1.0))], 0.03));
    // The same sensors once more: a repeat, not a meeting.
    builder.add(&station("s3", &[("a", 200.0, &form(1.0)), ("b", 300.0, &form(1.0))], 0.01));
    let surface = builder.build(30.0).unwrap().0;
    assert_eq!(surface.z_mm.len(), 4);
    assert!((surface.z_mm[1] - 230.0002).abs() < 1e-9);
    let [meeting] = surface.meetings.as_slice() else { panic!("{:?}", surface.meetings) };
    assert_eq!(meeting.sections, ["b@s1".to_owned(), "a@s2".to_owned()]);
    assert!((meeting.rms_um - 0.3 / 2_f64.sqrt()).abs() < 1e-12);
    assert!((meeting.max_um - 0.3).abs() < 1e-12);
    // Orders 1 and 2 of both: ½ (2·0.01 + 2·0.03) µm².
    assert!((meeting.expected_rms_um.unwrap() - 0.2).abs() < 1e-12);
    // Weights 100 and 33.3 per µm²: 3/4 of 2.0 and 1/4 of 2.3.
    assert!((surface.ring(1)[0] - 2.075).abs() < 1e-12);
}

#[test]
fn an_order_not_observable_in_one_section_comes_from_the_other() {
    let nan = Complex64::new(f64::NAN, f64::NAN);
    let lost = [Complex64::ZERO, Complex64::ZERO, nan, Complex64::new(1.0, 0.0)];
    let whole = [Complex64::ZERO, Complex64::ZERO, Complex64::new(4.0, 0.0), Complex64::new(3.0, 0.0)];
    let mut builder = SurfaceBuilder::new(&config(16, None));
    builder.add(&station("s1", &[("a", 0.0, &lost), ("b", 0.0, &whole), ("c", 9.0, &whole)], f64::NAN));
    let surface = builder.build(30.0).unwrap().0;
    // Order 2 from b alone, order 3 the plain mean.
    assert!((surface.ring(0)[0] - (4.0 + 2.0)).abs() < 1e-12);
    assert!((surface.meetings[0].max_um - 2.0).abs() < 1e-12);
    assert_eq!(surface.meetings[0].expected_rms_um, None);
}

#[test]
fn what_does_not_fit_on_the_grid_is_said() {
    let mut form = vec![Complex64::ZERO; 10];
    form[9] = Complex64::new(1.0, 0.0);
    let mut builder = SurfaceBuilder::new(&config(16, None));
    builder.add(&station("s1", &[("a", 0.0, &form), ("b", 9.0, &form)], f64::NAN));
    let surface = builder.build(30.0).unwrap().0;
    assert!(surface.interpolation.contains("left out"));
    assert!(surface.ring(0).iter().all(|value| value.abs() < 1e-12));
}

#[test]
fn one_circle_is_no_surface() {
    let mut builder = SurfaceBuilder::new(&SurfaceConfig::default());
    assert!(SurfaceBuilder::default().build(30.0).unwrap_err().to_string().contains("no section"));
    builder.add(&station("s1", &[("a", 5.0, &level(1.0)), ("b", 5.0005, &level(1.0))], f64::NAN));
    let error = builder.build(30.0).unwrap_err();
    assert!(error.to_string().contains("a surface needs two"), "{error}");
}

#[test]
fn a_step_too_small_to_hold_is_refused() {
    let mut builder = SurfaceBuilder::new(&config(720, Some(1e-9)));
    builder.add(&station("s1", &[("a", 0.0, &level(1.0)), ("b", 9.0, &level(1.0))], f64::NAN));
    assert!(builder.build(30.0).is_err());
}

#[test]
fn the_checksum_changes_with_every_number() {
    let surface = surface_of_levels(&[(0.0, 1.0), (5.0, 2.0)], &config(3000, None));
    let mut other = surface.clone();
    assert_eq!(surface.checksum(), other.checksum());
    other.deviation_um[5999] = 2.0 + f64::EPSILON * 2.0;
    assert_ne!(surface.checksum(), other.checksum());
}

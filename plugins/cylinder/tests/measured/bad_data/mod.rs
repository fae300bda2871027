//! The closed loop on made circles: one of them bad, placed far off, of a steep taper. The noise is not known from elsewhere.

use std::{f64::consts::TAU, fmt::Write};

use runout_core::closed_loop::diagnosis::{Diagnosis, Verdict};

use crate::trials::is_full;

/// Eight circles of 200 points, z 2 to 16 mm, with noise of 0.5 µm; `more` is what is added at (circle, angle, z).
fn diagnosed(more: impl Fn(usize, f64, f64) -> f64) -> Diagnosis {
    placed([0.0; 2], more)
}

/// Eight circles with noise as in [`diagnosed`], and the axis further off, in µm: distances of points from where the axis should
/// be, without any approximation.
fn placed(further: [f64; 2], more: impl Fn(usize, f64, f64) -> f64) -> Diagnosis {
    let mut seed = 11_u64;
    let mut normal = || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..12).map(|_| uniform()).sum::<f64>()
    };
    let mut rows = String::from("trace,kind,z_mm,angle_deg,deviation_um\n");
    for circle in 0..8 {
        let z = 2.0 + 2.0 * circle as f64;
        for point in 0..200 {
            let angle = TAU * f64::from(point) / 200.0;
            let centre = [
                further[0] + 8.0 * 0.2_f64.cos() + 0.15 * (z - 9.0) * 1.0_f64.cos(),
                further[1] - 8.0 * 0.2_f64.sin() + 0.15 * (z - 9.0) * 1.0_f64.sin(),
            ];
            let along = centre[0] * angle.cos() + centre[1] * angle.sin();
            let across = centre[1] * angle.cos() - centre[0] * angle.sin();
            let place = along + (15_000.0_f64.powi(2) - across * across).sqrt() - 15_000.0;
            let deviation = place + 0.4 * (2.0 * angle).cos() + 0.5 * normal() + more(circle, angle, z);
            writeln!(rows, "C{},circle,{z},{:.4},{deviation:.5}", circle + 1, angle.to_degrees()).unwrap();
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.csv");
    std::fs::write(&path, rows).unwrap();
    super::diagnosed(&format!(
        "load = {{ plugin = 'points', path = '{}' }}\n\
         separate = {{ plugin = 'least-squares-cylinder', radius_mm = 15.0 }}",
        path.display()
    ))
}

fn names(found: &Diagnosis) -> Vec<&str> {
    found.added.iter().map(|added| added.effect.as_str()).collect()
}

fn value(found: &Diagnosis, name: &str) -> f64 {
    let parameters = found.added.iter().flat_map(|added| &added.parameters);
    parameters.into_iter().find(|known| known.name == name).unwrap().value
}

#[test]
fn what_is_found_without_a_noise_level_is_an_improvement_and_no_explanation() {
    let found = diagnosed(|_, _, _| 0.0);
    assert_eq!(found.verdict, Verdict::Improved);
    assert_eq!(names(&found), ["part-eccentricity", "axis-tilt", "lobes-2"], "{found:?}");
    assert!(found.unexplained.is_empty(), "{:?}", found.unexplained);
    // Neither a noise floor nor what it makes of held-out data.
    assert_eq!((found.after.noise_floor_um, found.after.held_out_expected_rms_um), (None, None));
}

#[test]
fn a_bad_circle_is_named_whatever_is_wrong_with_it() {
    let wrong: [fn(f64) -> f64; 3] = [
        |angle| 8.0 * (angle - 1.0).cos(),
        |angle| 8.0 * (3.0 * angle).cos(),
        |angle| if angle < 3.0 { 6.0 } else { -6.0 },
    ];
    for (place, bad) in [0, 3, 7].into_iter().enumerate() {
        // In a usual run each place and each kind once.
        for (kind, wrong) in wrong.iter().enumerate().filter(|(kind, _)| is_full() || *kind == place) {
            let found = diagnosed(|circle, angle, _| if circle == bad { wrong(angle) } else { 0.0 });
            assert_eq!(found.verdict, Verdict::Improved);
            let named: Vec<&str> = found.unexplained.iter().map(|left| left.place.as_str()).collect();
            let circle = format!("circle C{}: ", bad + 1);
            assert!(named.first().is_some_and(|first| first.starts_with(&circle)), "{circle} {kind}: {named:?}");
            assert!(found.unexplained[0].rms_um > 3.0, "{found:?}");
        }
    }
}

/// 1.5 mm of eccentricity and 20 µm/mm of taper are in real data; nothing that is seen so clearly is refused for its size.
#[test]
fn large_effects_are_found() {
    // Small ones are in all campaigns here.
    for size in if is_full() { &[1.0, 30.0, 1500.0][..] } else { &[1500.0] } {
        let size: f64 = *size;
        let found = placed([size * 0.7_f64.cos(), size * 0.7_f64.sin()], |_, _, _| 0.0);
        assert!(names(&found).contains(&"part-eccentricity"), "{found:?}");
        let [x, y] = [size * 0.7_f64.cos() + 8.0 * 0.2_f64.cos(), size * 0.7_f64.sin() - 8.0 * 0.2_f64.sin()];
        // 0.5 µm over √800; six of them.
        assert!((value(&found, "x") - x).abs() < 0.1 && (value(&found, "y") - y).abs() < 0.1, "{size}: {found:?}");
    }
    for slope in if is_full() { &[0.3, 20.0, 400.0][..] } else { &[0.3, 400.0] } {
        let slope: f64 = *slope;
        let found = diagnosed(|_, _, z| slope * (z - 9.0));
        assert!((value(&found, "slope") - slope).abs() < 0.02, "{slope}: {found:?}");
    }
}

#[test]
fn a_list_that_ends_at_its_highest_order_says_so() {
    let ended = |found: &Diagnosis| found.warnings.iter().any(|warning| warning.contains("the data may contain more"));
    let all = |angle: f64| (2..=12).map(|order| (f64::from(order) * (angle - 0.1)).cos()).sum::<f64>();
    let found = diagnosed(|_, angle, _| all(angle));
    assert!(names(&found).contains(&"lobes-8") && ended(&found), "{found:?}");
    let few = diagnosed(|_, angle, _| (3.0 * angle).cos());
    assert!(names(&few).contains(&"lobes-3") && !ended(&few), "{few:?}");
}

#[test]
fn a_refusal_states_the_limit() {
    // A tilt that one bad circle alone asks for.
    let found = diagnosed(|circle, angle, _| if circle == 7 { 8.0 * (angle - 1.0).cos() } else { 0.0 });
    assert!(!found.refused.is_empty());
    for refused in &found.refused {
        let stated = ["above 1e-3", "above -10", "less than 0.05 %", "does not lower", "above 0.01"];
        assert!(stated.iter().any(|limit| refused.reason.contains(limit)), "{refused:?}");
    }
}

/// A chip, an edge, dirt: a few degrees of one circle, from hardly more than the noise to far more than all else.
#[test]
fn a_local_defect_is_set_aside_with_its_place() {
    let all = [(-8.0, 40.0_f64, 47.0_f64), (-500.0, 300.0, 312.0), (30.0, 100.0, 120.0)];
    for (size, from, to) in all.into_iter().take(if is_full() { 3 } else { 2 }) {
        let found = diagnosed(|circle, angle, _| {
            let within = (from.to_radians()..to.to_radians()).contains(&angle);
            if circle == 2 && within { size } else { 0.0 }
        });
        let place = &found.unexplained.first().unwrap_or_else(|| panic!("{size}: {found:?}")).place;
        assert!(place.starts_with("circle C3: a local defect from "), "{place}");
        let angles: Vec<f64> = place.split([' ', '°']).filter_map(|word| word.parse().ok()).collect();
        // Its edges, to a point of 1.8°.
        assert!((angles[0] - from).abs() < 2.0 && (angles[1] - to).abs() < 2.0, "{place}");
        assert_eq!(names(&found), ["part-eccentricity", "axis-tilt", "lobes-2"], "{size}");
        // 0.5 µm over √800, six times.
        assert!((value(&found, "x") - 8.0 * 0.2_f64.cos()).abs() < 0.15, "{found:?}");
        assert!((value(&found, "cosine") - 0.4).abs() < 0.15, "{found:?}");
    }
}

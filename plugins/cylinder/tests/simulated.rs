//! The separator on simulated points of exact geometry: single circles, circles at one height, helices, arcs.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{f64::consts::TAU, path::PathBuf};

use crate::simulator::{Part, Recording, around};
use runout_core::{
    closed_loop::diagnosis::Diagnosis,
    pipeline::{
        Pipeline, Registry,
        diagnose::diagnose,
        document::Sources,
        run::{Silent, run},
    },
    points::Points,
    summary::Summary,
};
use runout_cylinder::{LeastSquaresCylinder, LeastSquaresCylinderConfig};

/// Points as a CSV file.
fn csv(points: &Points) -> String {
    let column = |name: &str| points.column(name).unwrap();
    let (z, angle, deviation) = (column("z_mm"), column("angle_deg"), column("deviation_um"));
    let rows =
        points.traces.iter().flat_map(|trace| trace.points.clone().map(move |row| (&trace.id, &trace.kind, row)));
    let rows = rows.map(|(id, kind, row)| format!("{id},{kind},{},{},{}\n", z[row], angle[row], deviation[row]));
    std::iter::once("trace,kind,z_mm,angle_deg,deviation_um\n".to_owned()).chain(rows).collect()
}

fn pipeline(points: &Points, separate: &str) -> (Pipeline, tempfile::NamedTempFile) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), csv(points)).unwrap();
    let text = format!(
        "load = {{ plugin = 'points', path = '{}' }}\n\
         separate = {{ plugin = 'least-squares-cylinder', {separate} }}",
        file.path().display()
    );
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_cylinder::register(&mut registry);
    let sources = Sources::from_text("test.toml", &text, PathBuf::new(), &[], "rig").unwrap();
    (Pipeline::from_sources(&sources, &registry).unwrap(), file)
}

fn evaluated(points: &Points, separate: &str) -> Summary {
    let (pipeline, _file) = pipeline(points, separate);
    run(&pipeline, None, &Silent).unwrap()
}

fn diagnosed(points: &Points, separate: &str) -> Diagnosis {
    let (pipeline, _file) = pipeline(points, separate);
    diagnose(&pipeline, None, &Silent).unwrap()
}

fn separator(radius_mm: f64, max_order: usize) -> LeastSquaresCylinder {
    let config = LeastSquaresCylinderConfig {
        radius_mm,
        used: None,
        hold_out: Vec::new(),
        max_order,
        outlier_mad: Some(5.0),
        outlier_order: 50,
        max_lobes: 8,
    };
    config.separator().unwrap()
}

/// The unfiltered peak-to-valley roundness of a section about its least-squares circle.
fn ront(summary: &Summary, section: usize) -> (f64, f64) {
    let values = summary.stations[section].sections[0].values.iter();
    let value = values
        .clone()
        .find(|value| value.symbol == "RONt")
        .unwrap_or_else(|| panic!("{:?}", summary.stations[section]));
    (value.value, value.uncertainty.as_ref().map_or(f64::NAN, |known| known.std))
}

/// Peak to valley of a form that has no 1/rev, on many angles.
fn peak_to_valley(form: impl Fn(f64) -> f64) -> f64 {
    let values = (0..100_000).map(|step| form(TAU * f64::from(step) / 1e5));
    let [low, high] =
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    high - low
}

fn lobed(angle: f64) -> f64 {
    (3.0 * angle + 0.4).cos() + 0.6 * (5.0 * angle).sin() + 0.05 * (17.0 * angle).cos()
}

#[test]
fn a_single_circle_far_off_centre_has_its_own_roundness() {
    let truth = peak_to_valley(lobed);
    for (off_um, radius_mm) in [(70.0, 12.0), (500.0, 25.0), (2_000.0, 25.0)] {
        let part = Part {
            radius_um: 1e3 * radius_mm + 3.0,
            through_um: [0.6 * off_um, -0.8 * off_um],
            slope: [0.0; 2],
            form_um: &|angle, _| lobed(angle),
        };
        let points = Recording::of(part, radius_mm, 0.0, 1).circle("C1", 5.0, 720).points();
        let summary = evaluated(&points, &format!("radius_mm = {radius_mm}"));
        let (found, std) = ront(&summary, 0);
        println!("{off_um} µm off on R {radius_mm} mm: RONt {found:.6} ± {std:.1e}, truth {truth:.6}");
        // 0.2 nm: peaks between the angles of the evaluation.
        assert!((found - truth).abs() < 2e-4, "{found} instead of {truth}");
        assert!(summary.notes.iter().any(|note| note.contains("tilt of the axis is not observable")));
        assert!(summary.notes.iter().any(|note| note.contains("least-squares circle of 1 circle")));
    }
}

#[test]
fn circles_at_one_height_share_an_axis_and_ask_for_no_tilt() {
    let part =
        Part { radius_um: 12_004.0, through_um: [50.0, 49.0], slope: [0.0; 2], form_um: &|angle, _| lobed(angle) };
    // The height wavers by 0.5 µm, as a machine's does.
    let wavering = |phase: f64| around(5.0, 500).map(move |(z, angle)| (z + 5e-4 * (3.0 * angle + phase).sin(), angle));
    let recording = Recording::of(part, 12.0, 0.01, 2);
    let points = recording.trace("C1", "circle", wavering(0.0)).trace("C2", "circle", wavering(1.0)).points();
    let summary = evaluated(&points, "radius_mm = 12.0");
    assert_eq!(summary.stations.len(), 2);
    assert!(summary.part.is_none() && summary.surface.is_none(), "two circles at one height are no wall");
    for section in 0..2 {
        let (found, std) = ront(&summary, section);
        let truth = peak_to_valley(lobed);
        println!("RONt {found:.4} ± {std:.4}, truth {truth:.4}");
        // Peak to valley picks up noise: of 101 orders, 0.01·√(2/500·…) = 4 nm.
        assert!((found - truth).abs() < 0.02 && std > 1e-4 && std < 0.02, "{found} ± {std} instead of {truth}");
    }
    let cylinder = separator(12.0, 50).cylinder(&points).unwrap();
    assert!(!cylinder.tilted && cylinder.tilt_urad().iter().all(|tilt| tilt.abs() < f64::MIN_POSITIVE));
    // 0.01 µm over 1000 points.
    assert!((cylinder.x_um - 50.0).abs() < 3e-3 && (cylinder.radius_offset_um - 4.0).abs() < 3e-3, "{cylinder:?}");
}

#[test]
fn a_tilted_cylinder_far_off_centre_is_evaluated_about_its_axis() {
    let taper = |angle: f64, z: f64| lobed(angle) + 0.3 * (z - 9.0);
    let part = Part { radius_um: 25_000.0, through_um: [400.0, -300.0], slope: [2e-3, 1e-3], form_um: &taper };
    let mut recording = Recording::of(part, 25.0, 0.0, 3);
    for z in [2.0, 9.0, 16.0] {
        recording = recording.circle(&format!("Z{z}"), z, 720);
    }
    let points = recording.points();
    let separator = separator(25.0, 20);
    let tilt = separator.cylinder(&points).unwrap().tilt_urad();
    // Angles that are even about the machine's axis are uneven about the part's, by 500 µm over 25 mm, 2 %. The taper has 2.1 µm at
    // either end: its share of 2 % moves the centre of the least-squares cylinder there, by 0.042 µm over 7 mm, 6 µrad.
    let moved = (tilt[0] + 1e3).hypot(tilt[1] - 2e3);
    assert!((4.0..8.0).contains(&moved), "{tilt:?}");
    for section in separator.form(&points).unwrap().sections {
        let orders: Vec<_> = section.coefficients(0).collect();
        let found = |order: usize| (orders[order].norm(), orders[order].arg());
        // 1 nm: the taper over the height that a tilted circle goes through, 50 µm · 0.3 µm/mm, has 1/rev and 15 nm; what of
        // it reaches other orders is 2 % of that. An ellipse that is left would have 25 mm · (2² + 1²)·10⁻⁶/4 = 0.031 µm.
        assert!(found(2).0 < 1e-3, "2/rev of {:?}", orders[2]);
        assert!((found(3).0 - 1.0).abs() < 1e-3 && (found(3).1 - 0.4).abs() < 1e-3, "{:?}", orders[3]);
        assert!((found(5).0 - 0.6).abs() < 1e-3 && (found(17).0 - 0.05).abs() < 1e-3);
    }
}

/// Eight turns down a barrel-shaped, tapered, tilted part: what changes along z must not become form at the seam.
#[test]
fn a_helix_is_recognised_and_cut_into_its_turns() {
    let wall = |angle: f64, z: f64| lobed(angle) + 0.5 * (z - 8.0) - 0.04 * (z - 8.0).powi(2);
    let part = || Part { radius_um: 20_000.0, through_um: [30.0, 10.0], slope: [5e-4, -2e-4], form_um: &wall };
    let turns = |count: f64| {
        let points = (720.0 * count) as usize;
        (0..points).map(move |point| (2.0 * point as f64 / 720.0, TAU * (point % 720) as f64 / 720.0))
    };
    for kind in ["helix", "circle"] {
        let points = Recording::of(part(), 20.0, 0.01, 4).trace("H", kind, turns(8.3)).points();
        let sections = separator(20.0, 30).form(&points).unwrap().sections;
        let ids: Vec<&str> = sections.iter().map(|section| section.sections[0].id.as_str()).collect();
        assert_eq!(ids, ["H.1", "H.2", "H.3", "H.4", "H.5", "H.6", "H.7", "H.8"]);
        assert!(sections[0].warnings[0].contains("helix of 2.0000 mm a turn"), "{:?}", sections[0].warnings);
        for (turn, section) in sections.iter().enumerate() {
            let at = &section.sections[0];
            assert!((at.z_mm - (2.0 * turn as f64 + 1.0)).abs() < 0.02, "{}", at.z_mm);
            let orders: Vec<_> = section.coefficients(0).collect();
            // Taper and barrel move a turn by up to 2 µm from end to end: as form, order 2 would have 0.3 µm.
            for (order, value) in orders.iter().enumerate().skip(2) {
                let truth = match order {
                    3 => runout_core::Complex64::from_polar(1.0, 0.4),
                    5 => runout_core::Complex64::new(0.0, -0.6),
                    17 => runout_core::Complex64::from(0.05),
                    _ => runout_core::Complex64::ZERO,
                };
                assert!((value - truth).norm() < 5e-3, "turn {turn}, order {order}: {value}");
            }
        }
        // The levels are the wall's, about the fitted radius.
        let level = |index: usize| sections[index].coefficients(0).next().unwrap().re;
        let expected = |z: f64| 0.5 * (z - 8.0) - 0.04 * (z - 8.0).powi(2);
        let moved = (level(7) - level(0)) - (expected(15.0) - expected(1.0));
        assert!(moved.abs() < 0.02, "{moved}");
    }
    let summary =
        evaluated(&Recording::of(part(), 20.0, 0.01, 5).trace("H", "helix", turns(8.0)).points(), "radius_mm = 20.0");
    let truth = peak_to_valley(lobed);
    for section in 0..8 {
        let (found, std) = ront(&summary, section);
        println!("turn {section}: RONt {found:.4} ± {std:.4}, truth {truth:.4}");
        assert!((found - truth).abs() < 0.04, "{found} ± {std} instead of {truth}");
    }
}

#[test]
fn an_arc_without_points_limits_the_orders_and_says_so() {
    let part = Part {
        radius_um: 12_000.0,
        through_um: [20.0, 0.0],
        slope: [0.0; 2],
        form_um: &|angle, _| (3.0 * angle).cos(),
    };
    let arc = around(5.0, 720).filter(|(_, angle)| !(1.0..2.0).contains(angle));
    let points = Recording::of(part, 12.0, 0.01, 6).trace("C1", "circle", arc).points();
    let summary = evaluated(&points, "radius_mm = 12.0");
    let station = &summary.stations[0];
    let limited = station.warnings.iter().find(|warning| warning.contains("are not observable"));
    println!("{limited:?}");
    assert!(limited.unwrap().contains("there is no point between 57.") && limited.unwrap().contains("and 115."));
    let section = separator(12.0, 50).form(&points).unwrap().sections.remove(0);
    let highest = section.observable.iter().filter(|known| **known).count() - 1;
    assert!((3..20).contains(&highest), "{highest}");
    let mut orders = section.coefficients(0);
    assert!((orders.nth(3).unwrap().re - 1.0).abs() < 5.0 * section.variance[3].sqrt() + 1e-9);
    // Roundness over a band says which orders it lacks, and keeps the arc out.
    let value = station.sections[0].values.iter().find(|value| value.symbol == "RONt").unwrap();
    assert!(value.lost_orders.contains(&(highest + 1)) && value.coverage < 0.9, "{value:?}");
}

#[test]
fn the_highest_order_of_the_form_steers_neither_outliers_nor_candidates() {
    // Forty lobes of 2 µm are form, whatever order is asked for; 60 µm at three points are not.
    let rough = |angle: f64, _: f64| {
        lobed(angle) + 2.0 * (40.0 * angle).cos() + if (1.0..1.02).contains(&angle) { -60.0 } else { 0.0 }
    };
    let part = || Part { radius_um: 12_000.0, through_um: [70.0, 0.0], slope: [0.0; 2], form_um: &rough };
    let points = Recording::of(part(), 12.0, 0.05, 7).circle("C1", 5.0, 900).circle("C2", 9.0, 900).points();
    let left_out = |max_order: usize| -> Vec<f64> {
        let sections = separator(12.0, max_order).form(&points).unwrap().sections;
        sections.iter().map(|section| (900.0 * (1.0 - section.sections[0].used)).round()).collect()
    };
    assert_eq!(left_out(5), left_out(80));
    assert!(left_out(5).iter().all(|count| (2.0..6.0).contains(count)), "{:?}", left_out(5));
    let added = |separate: &str| -> Vec<String> {
        diagnosed(&points, separate).added.into_iter().map(|added| added.effect).collect()
    };
    assert_eq!(
        added("radius_mm = 12.0, outlier_mad = 5.0, max_order = 4"),
        added("radius_mm = 12.0, outlier_mad = 5.0, max_order = 60")
    );
}

#[test]
fn the_loop_finds_eccentricity_exactly_and_no_ellipse_beside_it() {
    let part = || Part {
        radius_um: 25_000.0,
        through_um: [300.0, -400.0],
        slope: [0.0; 2],
        form_um: &|angle, _| 0.5 * (3.0 * angle).cos(),
    };
    let one = Recording::of(part(), 25.0, 0.02, 8).circle("C1", 5.0, 720).points();
    let two = Recording::of(part(), 25.0, 0.02, 9).circle("C1", 5.0, 720).circle("C2", 25.0, 720).points();
    for points in [one, two] {
        let found = diagnosed(&points, "radius_mm = 25.0");
        let effects: Vec<&str> = found.added.iter().map(|added| added.effect.as_str()).collect();
        assert_eq!(effects, ["part-eccentricity", "lobes-3"], "{:?}", found.added);
        let place = &found.added[0].parameters;
        println!("{:?}", found.warnings);
        // 0.02 µm over 720 points, five times; lobes of 0.5 µm on angles that are uneven by 2 %: 0.01 µm.
        assert!((place[0].value - 300.0).abs() < 0.02 && (place[1].value + 400.0).abs() < 0.02, "{place:?}");
        assert!(found.after.residual_rms_um < 0.03, "{:?}", found.after);
    }
}

#[test]
fn a_list_that_ends_at_its_highest_order_says_so() {
    let part = Part {
        radius_um: 12_000.0,
        through_um: [0.0; 2],
        slope: [0.0; 2],
        form_um: &|angle, _| (4.0 * angle).cos() + 0.5 * (9.0 * angle).cos(),
    };
    let points = Recording::of(part, 12.0, 0.05, 10).circle("C1", 5.0, 720).circle("C2", 9.0, 720).points();
    let effects = |separate: &str| {
        let found = diagnosed(&points, separate);
        let ends = found.warnings.iter().any(|warning| warning.contains("`max_lobes`"));
        let mut added: Vec<String> = found.added.into_iter().map(|added| added.effect).collect();
        added.sort();
        (added, ends)
    };
    assert_eq!(effects("radius_mm = 12.0, max_lobes = 4"), (vec!["lobes-4".to_owned()], true));
    assert_eq!(effects("radius_mm = 12.0, max_lobes = 12"), (vec!["lobes-4".to_owned(), "lobes-9".to_owned()], false));
}

/// Issue 18, 3: a wave of order 400 is above half of the surface's 720 angles.
#[test]
fn texture_has_orders_above_half_the_angles_of_the_surface() {
    let part = Part {
        radius_um: 12_000.0,
        through_um: [5.0, 0.0],
        slope: [0.0; 2],
        form_um: &|angle, _| 0.5 * (400.0 * angle).cos(),
    };
    let points = Recording::of(part, 12.0, 0.001, 11).circle("C1", 5.0, 2_000).points();
    let summary = evaluated(&points, "radius_mm = 12.0, max_order = 450");
    let values = &summary.stations[0].sections[0].values;
    let ra = values.iter().find(|value| value.symbol == "Ra").unwrap();
    println!("Ra {} ± {:?}", ra.value, ra.uncertainty);
    // The mean of |cos| is 2/π; the filter's cut-off is far below order 400.
    assert!((ra.value - 0.5 * std::f64::consts::FRAC_2_PI).abs() < 5e-3, "{ra:?}");
}

/// A barrel of 3 µm over 40 mm, off centre and tilted: each generatrix is a parabola of that height. Its reference lines are parallel to its
/// chord, so that STRt is 3 µm about both. An unlike wave along one generatrix changes the values of no other.
#[test]
fn each_generatrix_has_its_own_straightness() {
    let barrel = |z: f64| -3.0 * ((z - 20.0) / 20.0).powi(2);
    let bent = |angle: f64, z: f64| barrel(z) + if angle.cos() < -0.9 { (TAU * z / 10.0).sin() } else { 0.0 };
    let part = Part { radius_um: 20_003.0, through_um: [40.0, -30.0], slope: [2e-4, -3e-4], form_um: &bent };
    let mut recording = Recording::of(part, 20.0, 0.0, 5);
    for (index, z) in [0.0, 10.0, 20.0, 30.0, 40.0].into_iter().enumerate() {
        recording = recording.circle(&format!("C{index}"), z, 360);
    }
    // The second one runs downwards.
    let along = |angle: f64, step: f64| (0..=80).map(move |point| (20.0 + step * (f64::from(point) - 40.0), angle));
    let points = recording
        .trace("G1", "generatrix", along(0.3, 0.5))
        .trace("G2", "generatrix", along(-1.2, -0.5))
        .trace("G3", "generatrix", along(3.1, 0.5))
        .points();
    let summary = evaluated(&points, "radius_mm = 20.0");
    let value = |of: &str, symbol: &str, line: &str| {
        let named = summary.values.iter().find(|value| {
            value.of.as_deref() == Some(of) && value.symbol == symbol && value.reference.as_deref() == Some(line)
        });
        named.unwrap_or_else(|| panic!("{of} {symbol} {line}: {:?}", summary.values)).clone()
    };
    for of in ["G1", "G2"] {
        for line in ["LSLI", "MZLI"] {
            let found = value(of, "STRt", line);
            // The ray at a constant angle about the machine's axis leaves the generatrix by 50 µm at most: below 1 nm.
            assert!((found.value - 3.0).abs() < 2e-3, "{of} {line}: {found:?}");
            assert!(found.uncertainty.is_none() && found.no_uncertainty.is_some(), "{found:?}");
        }
    }
    assert!(value("G3", "STRt", "LSLI").value > 3.5);
}

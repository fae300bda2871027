//! Points as programs write them: without a header, with blanks, in a sheet, in other units, as coordinates of a measuring machine.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{f64::consts::TAU, fmt::Write, fs, path::Path};

use runout_core::{
    pipeline::{Pipeline, Registry},
    summary::Summary,
};

fn run(load: &str, separate: &str) -> Result<Summary, String> {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_as_measured::register(&mut registry);
    let text = format!(
        "load = {{ plugin = 'points', {load} }}\nseparate = {{ plugin = 'as-measured', {separate} }}\nevaluate = {{ filter_upr = [] }}"
    );
    let pipeline =
        Pipeline::from_toml(&text, env!("CARGO_MANIFEST_DIR"), &registry).map_err(|error| error.to_string())?;
    pipeline.run().map_err(|error| format!("{error} ({})", error.advice().unwrap_or_default()))
}

fn rons(summary: &Summary) -> Vec<(Option<String>, f64)> {
    let placed = summary.placed_values();
    let ront = placed
        .iter()
        .filter(|placed| placed.value.symbol == "RONt" && placed.value.reference.as_deref() == Some("LSCI"));
    ront.map(|placed| (placed.section.map(str::to_owned), placed.value.value)).collect()
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    format!("path = '{}'", path.display())
}

/// Two lobes of 2.5 µm: 5 µm peak to valley.
fn near(found: &[(Option<String>, f64)], expected_um: f64) {
    assert!(!found.is_empty());
    for (section, ront) in found {
        assert!((ront / expected_um - 1.0).abs() < 1e-3, "{section:?}: {ront}");
    }
}

#[test]
fn a_sheet_with_units_in_its_header() {
    let of = |sheet: &str| {
        run(&format!("path = 'tests/data/circle.xlsx', {sheet}"), "object = 'roundness', radius_mm = 8.0")
    };
    near(&rons(&of("sheet = 'Readings'").unwrap()), 5.0);
    assert!(of("sheet = 'Reading'").unwrap_err().contains("no sheet `Reading`"));
    assert!(of("").unwrap_err().contains("angle_deg"));
}

#[test]
fn coordinates_of_a_measuring_machine() {
    let folder = tempfile::tempdir().unwrap();
    // A cylinder of radius 20 mm along y, leaning, with two lobes of 2.5 µm; three circles of 120 points.
    let mut lines = String::new();
    for height in [0.0, 12.0, 30.0] {
        for index in 0..120 {
            let angle = TAU * f64::from(index) / 120.0;
            let radius = 20.0 + 2.5e-3 * (2.0 * angle).cos();
            // Right-handed about y: z and x are the first and the second direction.
            let [x, y, z] = [radius * angle.sin() + 5.0 + 1e-4 * height, height - 7.0, radius * angle.cos() - 3.0];
            writeln!(lines, "{x:.7}   {y:.7} {z:.7}").unwrap();
        }
    }
    let path = written(folder.path(), "cmm.txt", &lines);
    let named = format!("{path}, names = ['x_mm', 'y_mm', 'z_mm']");
    for axis in ["", ", axis = 'y'"] {
        let summary = run(&format!("{named}{axis}"), "object = 'cylinder'").unwrap();
        assert_eq!(summary.stations.len(), 3);
        near(&rons(&summary), 5.0);
        let found = summary.warnings.iter().chain(&summary.notes).find(|said| said.contains("the axis is near y"));
        assert!(found.is_some_and(|said| said.contains("radius 20.0000")), "{:?}", summary.warnings);
    }
    let refused = run(&path, "object = 'cylinder'").unwrap_err();
    assert!(refused.contains("no names of columns"), "{refused}");
    let several = run(&named, "object = 'roundness'").unwrap_err();
    assert!(several.contains("3 circles"), "{several}");
}

#[test]
fn units_of_any_length_and_rounded_grids() {
    let folder = tempfile::tempdir().unwrap();
    // Steps of 24.691 µm, written with three decimals of a millimetre; heights in µm between blanks.
    let mut lines = "x_mm y_mm height [µm]\n".to_owned();
    for row in 0..20 {
        for column in 0..30 {
            let place = |number: i32| f64::from(number) * 0.024_691;
            let height = if (row + column) % 2 == 0 { 1.0 } else { -1.0 };
            writeln!(lines, "{:.3} {:.3} {height:.4}", place(column), place(row)).unwrap();
        }
    }
    let path = written(folder.path(), "map.txt", &lines);
    let summary = run(&path, "form = 'none'").unwrap();
    let sq = summary.values.iter().find(|value| value.symbol == "Sq").unwrap().value;
    assert!((sq - 1.0).abs() < 1e-9, "{sq}");
    let both = written(folder.path(), "both.csv", "x_mm,y_mm,height_um,height [mm]\n0,0,1,2\n");
    assert!(run(&both, "form = 'none'").unwrap_err().contains("could be `height_nm`"));
}

/// Heights without names of circles: those of three circles in any order, of a helix, scattered ones, and one height.
#[test]
fn heights_are_sections_or_a_helix() {
    let folder = tempfile::tempdir().unwrap();
    let of = |turn_points: usize, count: usize, height: &dyn Fn(usize) -> f64| {
        let mut text = String::from("angle_deg,z_mm,radius_mm\n");
        for index in 0..count {
            let angle = 360.0 * (index % turn_points) as f64 / turn_points as f64;
            let radius = 20.0 + 2.5e-3 * (2.0 * angle.to_radians()).cos();
            writeln!(text, "{angle:.6},{:.6},{radius:.7}", height(index)).unwrap();
        }
        run(&written(folder.path(), "wall.csv", &text), "object = 'cylinder'")
    };
    let names = |summary: &Summary| summary.stations.iter().map(|one| one.station.clone()).collect::<Vec<_>>();
    // Point by point another circle, each wavering by 0.1 µm.
    let three = of(120, 360, &|index| [5.0, 1.0, 9.0][index / 120] + 1e-4 * (index % 2) as f64).unwrap();
    assert_eq!(names(&three), ["z=1.000", "z=5.000", "z=9.000"]);
    near(&rons(&three), 5.0);
    // A part that leans by 9 mrad: one height of the machine is a plane that leans to the axis.
    let leaning =
        of(120, 360, &|index| [5.0, 1.0, 9.0][index / 120] + 0.18 * (TAU * (index % 120) as f64 / 120.0).cos());
    assert_eq!(names(&leaning.unwrap()), ["z=1.000", "z=5.000", "z=9.000"]);
    let helix = of(100, 500, &|index| 0.01 * index as f64).unwrap();
    assert!(names(&helix).iter().all(|name| name.contains("helix")), "{:?}", names(&helix));
    let scattered = of(100, 500, &|index| (index * 7919 % 500) as f64 * 0.01).unwrap_err();
    assert!(scattered.contains("scattered"), "{scattered}");
    let one = of(120, 120, &|_| 1.0).map(|summary| names(&summary));
    assert!(one.as_ref().is_ok_and(|names| *names == ["circle"]), "{one:?}");
}

/// 72 points whose arcs differ by a third have no gap; with a keyway of 20° they have one.
#[test]
fn uneven_points_are_no_gaps() {
    let folder = tempfile::tempdir().unwrap();
    let of = |keyway: bool| {
        let mut text = String::from("angle_deg,radius_mm\n");
        for index in 0..72 {
            let angle = 5.0 * f64::from(index) + 1.5 * (7.0 * f64::from(index)).sin();
            if keyway && (100.0..120.0).contains(&angle) {
                continue;
            }
            let radius = 20.0 + 2.5e-3 * (2.0 * angle.to_radians()).cos();
            writeln!(text, "{angle:.6},{radius:.7}").unwrap();
        }
        let summary = run(&written(folder.path(), "circle.csv", &text), "object = 'roundness'").unwrap();
        let ront = summary.placed_values().into_iter().find(|placed| placed.value.symbol == "RONt").unwrap();
        (ront.value.coverage, summary.warnings.iter().filter(|said| said.contains("left out of every value")).count())
    };
    let (all, none) = of(false);
    assert!(all > 0.999 && none == 0, "{all} {none}");
    let (most, one) = of(true);
    assert!((0.9..0.96).contains(&most) && one == 1, "{most} {one}");
}

/// Normal enough: twelve uniform numbers.
fn noise(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..12).map(|_| uniform()).sum()
}

/// RONt about LSCI of points of a circle, unfiltered, in µm: the summary, and the truth of all points without noise.
fn circle(seed: u64, separate: &str, form_um: impl Fn(f64) -> f64, noise_um: f64) -> (Summary, f64) {
    let mut state = seed;
    let angles = (0..720).map(|point| TAU * f64::from(point) / 720.0);
    let heights: Vec<f64> = angles.clone().map(&form_um).collect();
    // Its level and its first order are no form.
    let mean = |wave: &dyn Fn(f64) -> f64| {
        heights.iter().zip(angles.clone()).map(|(height, angle)| height * wave(angle)).sum::<f64>() / 720.0
    };
    let [level, cosine, sine] = [mean(&|_| 1.0), 2.0 * mean(&f64::cos), 2.0 * mean(&f64::sin)];
    let about = heights.iter().zip(angles.clone());
    let about = about.map(|(height, angle)| height - level - cosine * angle.cos() - sine * angle.sin());
    let (low, high) = about.fold((f64::MAX, f64::MIN), |(low, high), one| (low.min(one), high.max(one)));
    let mut text = "angle_deg,deviation_um\n".to_owned();
    for (angle, height) in angles.zip(&heights) {
        writeln!(text, "{},{}", angle.to_degrees(), height + noise_um * noise(&mut state)).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let load = written(folder.path(), "circle.csv", &text);
    (run(&load, &format!("object = 'roundness', radius_mm = 20.0, {separate}")).unwrap(), high - low)
}

/// How many intervals of RONt about LSCI contain the truth.
fn held(circles: u64, form_um: impl Fn(u64, f64) -> f64, noise_um: f64) -> usize {
    let holds = |seed: &u64| {
        let (summary, truth) = circle(*seed, "", |angle| form_um(*seed, angle), noise_um);
        let placed = summary.placed_values();
        let ront =
            placed.iter().find(|one| one.value.symbol == "RONt" && one.value.reference.as_deref() == Some("LSCI"));
        ront.unwrap().value.interval_95().is_some_and(|[low, high]| (low..=high).contains(&truth))
    };
    (0..circles).filter(holds).count()
}

/// A burr of one or two points is no noise: it is in the interval.
#[test]
fn intervals_cover_a_narrow_burr() {
    let form = |seed: u64, angle: f64| {
        let aside = (angle - TAU * (100.0 + seed as f64) / 720.0) / 0.3_f64.to_radians();
        0.25 * (2.0 * angle + 0.4).cos() + 0.2 * (3.0 * angle).cos() + 1.5 * (-0.5 * aside * aside).exp()
    };
    let held = held(12, form, 0.1);
    assert!(held >= 10, "{held} of 12");
}

/// Few points beyond the harmonics show the noise of all of them: it is then found too small or too large in all orders alike.
#[test]
fn intervals_cover_equal_lobes_in_noise_that_few_points_show() {
    let circles = if std::env::var_os("RUNOUT_TRIALS").is_some_and(|value| value == "full") { 400 } else { 40 };
    for (lobes, noise_um) in [(3.0, 0.1), (5.0, 0.3)] {
        let held = held(circles, |_, angle| (lobes * angle).cos(), noise_um);
        println!("{lobes} lobes, noise of {noise_um} µm: {held} of {circles}");
        assert!(held * 100 >= 90 * circles as usize, "{lobes} lobes: {held} of {circles}");
    }
}

/// Form above the highest order is in no value: what is unfiltered lacks it.
#[test]
fn form_above_the_highest_order_is_absent() {
    for (size_um, absent) in [(0.3, Some(50)), (0.0, None)] {
        let form = |angle: f64| (2.0 * angle).cos() + size_um * (80.0 * angle + 0.3).cos();
        let (summary, _) = circle(3, "max_order = 50", form, 0.02);
        let placed = summary.placed_values();
        let ront = placed.iter().find(|one| one.value.symbol == "RONt").unwrap();
        assert_eq!(ront.value.absent_above_upr, absent);
        let is_said = summary.warnings.iter().any(|warning| warning.contains("order 80 has 0.30 µm, above 50"));
        assert_eq!(is_said, absent.is_some(), "{:?}", summary.warnings);
    }
}

#[test]
fn angles_in_radians_and_texts_of_two_bytes_have_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "angle_deg,radius_mm\n".to_owned();
    (0..200).for_each(|point| writeln!(text, "{},{}", TAU * f64::from(point) / 200.0, 15.0).unwrap());
    let refused = |load: &str| run(load, "object = 'roundness'").unwrap_err();
    let found = refused(&written(folder.path(), "radians.csv", &text));
    assert!(found.contains("in radians or turns"), "{found}");
    let wide: Vec<u8> = std::iter::once(0xFEFF).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    fs::write(folder.path().join("wide.csv"), wide).unwrap();
    let found = refused(&format!("path = '{}'", folder.path().join("wide.csv").display()));
    assert!(found.contains("UTF-16"), "{found}");
}

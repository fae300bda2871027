//! The closed loop: what is there is found with its size, nothing else is, and unmodelled disturbances are unexplained.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::common;
use crate::common::{CUT, diagnose, listing, of, parameter, run, scenario, separator, value};
use runout_core::{closed_loop::diagnosis::Verdict, points::Points};

const SIDE: usize = 160;

#[test]
fn clean_surfaces_name_nothing() {
    for seed in 0..3 {
        let grid = scenario(SIDE, &format!("noise_nm = 0.2\nseed = {seed}")).heights().unwrap();
        let found = diagnose(grid, &separator(CUT));
        assert_eq!(found.diagnosis.verdict, Verdict::AtNoiseFloor, "{}", listing(&found.diagnosis));
        assert!(found.diagnosis.added.is_empty());
    }
}

/// Of ratios whose spectra look alike, the one is said that all rows ask for.
#[test]
fn a_line_has_the_ratio_that_all_rows_ask_for() {
    let cut = "nose_radius_mm = 10.0\nfeed_um_per_rev = 12.0\ncutter_radius_mm = 80.0\nspeed_rpm = 800.0\n";
    let grid = "[grid]\nrows = 160\ncolumns = 160\nstep_x_mm = 0.001453\nstep_y_mm = 0.029167\norigin_x_mm = -0.185\n";
    let line =
        "[[effect]]\nplugin = 'spindle-line'\nfrequency_ratio = 1.267388\namplitude_nm = 1.2535\nphase_deg = 142.26\n";
    let map = of(&format!("noise_nm = 0.1\nseed = 5\n{line}[cut]\n{cut}{grid}"));
    let found = diagnose(map.heights().unwrap(), &separator(cut)).diagnosis;
    let [added] = &found.added[..] else { panic!("{}", listing(&found)) };
    let [ratio, std] = parameter(added, "frequency_ratio");
    assert!((ratio - 1.267_388).abs() < 4.0 * std && std < 1e-4, "{ratio} ± {std}");
}

/// A line is found before the radius that is declared wrongly, and its ratio may make up for that: it is looked for once more beside it.
#[test]
fn a_line_beside_a_wrong_radius_has_its_ratio() {
    let cases = [
        (
            "nose_radius_mm = 3.0\nfeed_um_per_rev = 6.0\nspeed_rpm = 390.0\n",
            [300, 200],
            0.02365,
            250.0,
            -13.07,
            [3.30043, 4.76, 85.2],
        ),
        (
            "nose_radius_mm = 6.0\nfeed_um_per_rev = 8.3\nspeed_rpm = 390.0\n",
            [160, 200],
            0.0254,
            150.0,
            -5.29,
            [1.24748, 2.77, 140.8],
        ),
    ];
    for (cut, [columns, rows], step_y_mm, radius_mm, off_mm, [ratio, amplitude_nm, phase_deg]) in cases {
        let of_cut = |radius_mm: f64| format!("{cut}cutter_radius_mm = {radius_mm}\n");
        let step_x_mm = 1.4e-3;
        let grid = format!(
            "[grid]\nrows = {rows}\ncolumns = {columns}\nstep_x_mm = {step_x_mm}\nstep_y_mm = {step_y_mm}\norigin_y_mm = 3.0\n"
        );
        let line = format!(
            "[[effect]]\nplugin = 'spindle-line'\nfrequency_ratio = {ratio}\namplitude_nm = {amplitude_nm}\nphase_deg = {phase_deg}\n"
        );
        let map = of(&format!("noise_nm = 0.1\nseed = 5\n{line}[cut]\n{}{grid}", of_cut(radius_mm + off_mm)));
        let found = diagnose(map.heights().unwrap(), &separator(&of_cut(radius_mm))).diagnosis;
        println!("{}", listing(&found));
        let line = found.added.iter().find(|added| added.effect == "spindle-line").unwrap();
        let alias = format!("frequency_ratio {ratio:.3}");
        let is_found = (parameter(line, "frequency_ratio")[0] - ratio).abs() < 1e-3
            || line.confounded_with.iter().any(|other| other.contains(&alias));
        assert!(is_found && found.added.len() == 2, "{ratio}: {}", listing(&found));
    }
}

/// Passes at the edge of the map, and narrow ones, have fewer points.
#[test]
fn passes_of_unequal_width_are_no_finding() {
    let mut said = Vec::new();
    for seed in 0..6 {
        for line in [0.0, 20.0] {
            let effect = if line > 0.0 {
                format!(
                    "[[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 21.905\namplitude_nm = {line}\nphase_deg = 20.0\n"
                )
            } else {
                String::new()
            };
            let grid = "[grid]\nrows = 100\ncolumns = 500\nstep_x_mm = 0.0005\nstep_y_mm = 0.1\norigin_y_mm = -5\n";
            let map = of(&format!("noise_nm = 2.0\nseed = {seed}\n{effect}[cut]\n{CUT}{grid}"));
            let found = diagnose(map.heights().unwrap(), &separator(&format!("std_nm = 2.0\n{CUT}"))).diagnosis;
            if found.verdict == Verdict::Unexplained || found.added.len() != usize::from(line > 0.0) {
                said.push(format!("seed {seed}, line of {line} nm: {}", listing(&found)));
            }
        }
    }
    assert!(said.is_empty(), "{said:#?}");
}

#[test]
fn the_line_of_the_paper_is_found() {
    let line = "noise_nm = 0.1\n[[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 5.6235\namplitude_nm = 4.0\nphase_deg = 40.0\n";
    let found = diagnose(scenario(SIDE, line).heights().unwrap(), &separator(CUT));
    println!("{}", listing(&found.diagnosis));
    let [added] = &found.diagnosis.added[..] else { panic!("{}", listing(&found.diagnosis)) };
    assert_eq!((added.effect.as_str(), added.confounded_with.len()), ("spindle-line", 0));
    for (name, truth) in [("frequency_ratio", 5.6235 / 6.5), ("amplitude", 4.0), ("phase", 40.0)] {
        let [number, std] = parameter(added, name);
        assert!((number - truth).abs() < 4.0 * std, "{name}: {number} ± {std}");
    }
    assert_eq!(found.diagnosis.verdict, Verdict::Explained);
    let [before, after] = ["measured", "corrected"].map(|of| value(&found.after, "Sq", Some(of)));
    assert!(before > 2.0 && after < 0.6, "{before} {after}");
}

#[test]
fn every_effect_is_found_with_its_size() {
    #[allow(clippy::type_complexity, reason = "a table of cases")]
    let cases: [(&str, &str, &[(&str, f64)]); 9] = [
        // A·cos 3θ is A − 4.5·A·(y/r)²: over y from 0 to 3.975 mm −7.584 nm of P2 and a slope of −11.448 nm/mm.
        ("synchronous-motion", "", &[("order_2", -7.584), ("order_3", 0.0)]),
        ("workpiece-tilt", "x_urad = 3.0\ny_urad = -1.5", &[("x", 3.0), ("y", -1.5)]),
        ("table-straightness", "order = 3\namplitude_nm = 2.0", &[("order_3", 2.0), ("order_2", 0.0)]),
        ("feed-scale", "scale_um_per_m = 3000", &[("scale", 3000.0)]),
        ("nose-radius", "change_mm = 0.8", &[("change", 0.8)]),
        // Rows are shifted by a tenth of a feed, and by five feeds.
        ("map-rotation", "angle_urad = 200", &[("angle", 200.0)]),
        ("map-rotation", "angle_urad = -10000", &[("angle", -10_000.0)]),
        ("cutter-radius", "change_mm = 9", &[("change", 9.0)]),
        (
            "spindle-line",
            "frequency_ratio = 2.3\ndirection = 'tilt-x'\namplitude_urad = 0.8",
            &[("frequency_ratio", 2.3), ("amplitude", 0.8)],
        ),
    ];
    for (effect, keys, truth) in cases {
        let text = if keys.is_empty() {
            // Its slope is that of a work piece that is tilted.
            let slope = "[[effect]]\nplugin = 'workpiece-tilt'\ny_urad = 11.448\n";
            format!("noise_nm = 0.1\n[[harmonics]]\norder = 3\namplitude_nm = 4e4\n{slope}")
        } else {
            format!("noise_nm = 0.1\nseed = 4\n[[effect]]\nplugin = '{effect}'\n{keys}\n")
        };
        let found = diagnose(scenario(SIDE, &text).heights().unwrap(), &separator(CUT));
        println!("{}", listing(&found.diagnosis));
        let [added] = &found.diagnosis.added[..] else { panic!("{}", listing(&found.diagnosis)) };
        assert_eq!(added.effect, effect);
        for (name, truth) in truth {
            let [number, std] = parameter(added, name);
            assert!((number - truth).abs() < 4.0 * std, "{effect} {name}: {number} ± {std}");
        }
    }
}

/// Effects far beyond the usual, and two at once.
#[test]
fn large_and_joint_effects_are_found() {
    let text = "noise_nm = 0.5\n[[effect]]\nplugin = 'workpiece-tilt'\nx_urad = 800.0\n
        [[effect]]\nplugin = 'spindle-line'\nfrequency_ratio = 0.31\namplitude_nm = 30.0\n";
    let found = diagnose(scenario(100, text).heights().unwrap(), &separator(CUT));
    println!("{}", listing(&found.diagnosis));
    let names: Vec<&str> = found.diagnosis.added.iter().map(|added| added.effect.as_str()).collect();
    assert_eq!(names, ["workpiece-tilt", "spindle-line"]);
    assert_eq!(found.diagnosis.verdict, Verdict::Explained);
}

#[test]
fn unmodelled_disturbances_are_unexplained_with_their_place() {
    let cases = [
        ("plugin = 'pit'\nat_mm = [1.2, 2.5]\nradius_mm = 0.06\ndepth_nm = 8.0", [1.2, 2.5]),
        ("plugin = 'scratch'\nfrom_mm = [2.8, 1.0]\nto_mm = [3.2, 1.6]\nwidth_mm = 0.06\ndepth_nm = 5.0", [3.0, 1.3]),
    ];
    for (stranger, [x, y]) in cases {
        for line in ["", "[[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 5.6235\namplitude_nm = 3.0\n"] {
            let text = format!("noise_nm = 0.3\n[[effect]]\n{stranger}\n{line}");
            let found = diagnose(scenario(SIDE, &text).heights().unwrap(), &separator(CUT));
            println!("{}", listing(&found.diagnosis));
            assert_eq!(found.diagnosis.verdict, Verdict::Unexplained);
            assert_eq!(found.diagnosis.added.len(), usize::from(!line.is_empty()));
            let place = &found.diagnosis.unexplained[0].place;
            let numbers: Vec<f64> = place.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
            assert!(numbers[0] <= x && x <= numbers[1] && numbers[2] <= y && y <= numbers[3], "{place}");
        }
    }
}

/// Where rows do not reach far along y, ratios a whole number apart are a set.
#[test]
fn aliases_are_named_where_the_rows_do_not_separate_them() {
    let text = |rows: usize, noise: f64| {
        format!(
            "noise_nm = {noise}\n[cut]\n{CUT}[grid]\nrows = {rows}\ncolumns = 400\nstep_x_mm = 0.01\nstep_y_mm = 0.0087\n
             [[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 5.6235\namplitude_nm = 4.0\n"
        )
    };
    let found = diagnose(common::of(&text(400, 0.1)).heights().unwrap(), &separator(CUT));
    assert_eq!(found.diagnosis.added[0].confounded_with.len(), 0, "{}", listing(&found.diagnosis));
    let found = diagnose(common::of(&text(20, 1.0)).heights().unwrap(), &separator(CUT));
    println!("{}", listing(&found.diagnosis));
    let added = &found.diagnosis.added[0];
    assert!(!added.confounded_with.is_empty() && added.parameters.iter().all(|one| one.std.is_none()));
    let members = added.confounded_with.iter().filter_map(|name| name.rsplit(' ').next()?.parse::<f64>().ok());
    let mut ratios = members.chain([parameter(added, "frequency_ratio")[0]]);
    assert!(ratios.any(|ratio| (ratio - 5.6235 / 6.5).abs() < 1e-3), "{}", listing(&found.diagnosis));
}

/// Without a stated uncertainty nothing can be called explained.
#[test]
fn unknown_noise_is_said() {
    let text = "noise_nm = 0.2\nstated_std_nm = 0\n[[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 5.6235\namplitude_nm = 4.0\n";
    let found = diagnose(scenario(SIDE, text).heights().unwrap(), &separator(CUT));
    assert_eq!(found.diagnosis.verdict, Verdict::Improved, "{}", listing(&found.diagnosis));
    let clean = diagnose(scenario(SIDE, "noise_nm = 0.2\nstated_std_nm = 0").heights().unwrap(), &separator(CUT));
    assert_eq!(clean.diagnosis.verdict, Verdict::NothingFound, "{}", listing(&clean.diagnosis));
}

/// An instrument that reads row after row has an error of each: with it tilt across the rows and synchronous motion are known far worse, and it is said.
#[test]
fn errors_of_whole_rows_are_in_the_uncertainty() {
    let trials = crate::trials::trials(9) as u64;
    for (stated, row_nm) in [("", 0.06), ("", 0.5), ("stated_std_nm = 0\n", 0.5)] {
        let (mut outside, mut unsaid) = ([0; 2], 0);
        for seed in 0..trials {
            let text = format!(
                "noise_nm = 0.2\nseed = {seed}\n{stated}[[effect]]\nplugin = 'workpiece-tilt'\nx_urad = 5.0\ny_urad = -8.0\n"
            );
            let mut grid = scenario(SIDE, &text).heights().unwrap();
            let mut normal = normals(seed);
            for row in grid.height_nm.chunks_exact_mut(SIDE) {
                let error_nm = row_nm * normal();
                row.iter_mut().for_each(|height_nm| *height_nm += error_nm);
            }
            let found = diagnose(grid, &separator(CUT)).diagnosis;
            let of = |effect: &str| found.added.iter().find(|added| added.effect == effect);
            let is_off = |[value, std]: [f64; 2], truth: f64| usize::from((value - truth).abs() > 2.5 * std);
            outside[0] += of("workpiece-tilt").map_or(0, |tilt| is_off(parameter(tilt, "y"), -8.0));
            outside[1] += of("synchronous-motion").map_or(0, |motion| is_off(parameter(motion, "order_2"), 0.0));
            unsaid += usize::from(found.verdict == Verdict::Explained);
        }
        println!("{stated}{row_nm} nm: tilt and motion outside in {outside:?} of {trials}, unsaid in {unsaid}");
        assert!(outside.iter().all(|outside| 8 * outside <= trials as usize), "{stated}{row_nm} nm: {outside:?}");
        assert!(row_nm < 0.1 || unsaid == 0, "{stated}{row_nm} nm: {unsaid}");
    }
}

/// Normal numbers by the sum of twelve.
fn normals(seed: u64) -> impl FnMut() -> f64 {
    let mut state = 97 * seed + 5;
    move || {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..12).map(|_| uniform()).sum()
    }
}

#[test]
fn a_run_gives_the_surface_and_its_values() {
    let outcome = run(scenario(SIDE, "noise_nm = 0.1").heights().unwrap(), &separator(CUT));
    assert!((value(&outcome, "scallop", None) - 1.4352).abs() < 1e-3);
    assert!((value(&outcome, "scallop_rq", None) - 0.4279).abs() < 1e-3);
    assert!((value(&outcome, "Sq", Some("residual")) - 0.1).abs() < 0.003);
    assert!((value(&outcome, "Sq", Some("measured")) - 0.4279_f64.hypot(0.1)).abs() < 0.01);
    let rows: Vec<(&str, usize)> =
        outcome.tables.iter().map(|rows| (rows.table.as_str(), rows.rows.num_rows())).collect();
    assert_eq!(rows, [("surface", SIDE * SIDE), ("residual", SIDE * SIDE)]);
    assert!(value(&outcome, "scallop_phase", None).abs() < 0.1);
}

/// Noise of twice the line: the phases of line and scallops are that of the pass nearest to x = 0, whichever pass the fit counts from.
#[test]
fn the_phase_of_a_line_in_noise_counts_from_the_pass_at_the_origin() {
    for seed in 0..3 {
        let line = format!(
            "noise_nm = 8.0\nseed = {seed}\n[[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 5.6235\namplitude_nm = 30.0\nphase_deg = 60.0\n"
        );
        let found = diagnose(scenario(90, &line).heights().unwrap(), &separator(CUT));
        let added = &found.diagnosis.added[0];
        let [ratio, _] = parameter(added, "frequency_ratio");
        let [phase, std] = parameter(added, "phase");
        println!("{seed}: {ratio} {phase} ± {std}");
        let turn = |angle: f64| angle - 360.0 * (angle / 360.0).round();
        let is_own = (ratio - 5.6235 / 6.5).abs() < 1e-3;
        assert!(
            !is_own || turn(phase - 60.0).abs() < if std.is_finite() { 4.0 * std } else { 20.0 },
            "{phase} ± {std}"
        );
        assert!(value(&found.after, "scallop_phase", None).abs() <= 0.5 * 8.3 + 1e-9);
    }
}

#[test]
fn heights_in_another_unit_and_too_large_a_noise_are_never_explained() {
    let line = "noise_nm = 0.1\n[[effect]]\nplugin = 'spindle-line'\nfrequency_hz = 5.6235\namplitude_nm = 4.0\n";
    let mut in_um = scenario(90, line).heights().unwrap();
    in_um.height_nm.iter_mut().for_each(|height| *height *= 1e-3);
    in_um.std_nm = Some(0.1);
    let outcome = run(in_um.clone(), &separator(CUT));
    assert!(outcome.remarks.iter().any(|remark| remark.contains("Is `height_nm` in µm")), "{:?}", outcome.remarks);
    let settings = runout_core::closed_loop::Settings::default();
    let fly = separator(CUT);
    let model = runout_core::stage::PointSeparator::model(&fly).unwrap();
    let error = model.diagnose(&Points::of_grid(in_um, "map.h5".into()), &settings).unwrap_err();
    assert!(error.to_string().contains("no tool leaves a smoother surface"), "{error}");
    let mut loud = scenario(90, line).heights().unwrap();
    loud.std_nm = Some(1.0);
    let found = diagnose(loud, &fly).diagnosis;
    assert_eq!(found.verdict, Verdict::Improved, "{}", listing(&found));
    assert!(found.warnings.iter().any(|warning| warning.contains("far below 1")), "{:?}", found.warnings);
}

//! Reports: what is in the file, and what Chromium makes of it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{
    chromium::{in_chromium, say},
    folder::{self, Folder},
};

pub(crate) const SCENARIO: &str = r#"
plugin = "spindle"
output = "shaft.h5"
seed = 3
rig = "rig.toml"

[recording]
revolutions = 8
samples_per_rev = 128
stations = { count = 5, step_mm = 40 }

[form]
rms_um = 2
max_order = 12

[noise]
rms_um = 0.02
"#;

pub(crate) const EXPORT: &str = "\n[[export]]\nplugin = \"report\"\npath = \"out/report.html\"\n\n[[export]]\nplugin = \"hdf5\"\npath = \"out/result.h5\"\n";

/// A name that a page could stumble over, as TOML writes it.
const HOSTILE: &str = r#""</script><b>\"'&amp; <!-- %{y} \u05e9\u05dc\u05d5\u05dd Prüf\nling""#;

/// A simulated spindle with its report; sensors and title have hostile names when asked.
fn spindle(hostile: bool) -> Folder {
    let name = |text: String| {
        let named = text.replace("\"S1\"", HOSTILE).replace("title = \"Turned shaft\"", &format!("title = {HOSTILE}"));
        if hostile { named } else { text }
    };
    let limit = "\n[[limit]]\nsymbol = \"RONt\"\nupper = 30.0\nunit = \"um\"\n";
    let pipeline = name(folder::pipeline() + limit + EXPORT);
    let rig = name(folder::RIG.to_owned());
    let folder = Folder::with(&[("pipeline.toml", &pipeline), ("rig.toml", &rig), ("scenario.toml", SCENARIO)]);
    let simulated = folder.run(&["simulate", "scenario.toml"]);
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    folder
}

fn page(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// What of a page a browser reads as elements: everything but the scripts.
fn elements(page: &str) -> String {
    let mut rest = page;
    let mut kept = String::new();
    while let Some((before, after)) = rest.split_once("<script") {
        kept.push_str(before);
        rest = after.split_once("</script>").unwrap().1;
    }
    kept + rest
}

#[test]
fn a_run_writes_a_report_and_an_earlier_result_gives_the_same() {
    let folder = spindle(false);
    let ran = folder.run(&["run", "pipeline.toml"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let written = page(&folder.path().join("out/report.html"));
    assert!(written.starts_with("<!DOCTYPE html>") && written.len() < 8_000_000, "{} bytes", written.len());
    for part in [
        "Turned shaft",
        "The limit is undecided: RONt ≤ 30 µm",
        "Setup <bdi>reversed",
        "\"form\"",
        "data-map=\"surface\"",
        "BLAKE3",
    ] {
        assert!(written.contains(part), "{part}");
    }
    assert!(written.contains("default-src 'none'") && !elements(&written).contains("://"), "a request");
    let ran = folder.run(&["report", "out/result.h5", "--out", "again.html"]);
    assert_eq!((ran.status, ran.stdout.as_str()), (0, "again.html\n"), "{}", ran.stderr);
    // Numbers that were JSON in between may differ by their last bit.
    assert_eq!(elements(&page(&folder.path().join("again.html"))), elements(&written));
}

/// Machine, customer and logo are in the page's head, in the summary and in the page of an earlier result.
#[test]
fn the_head_says_what_was_measured_for_whom() {
    let folder = spindle(false);
    let head = "[report]\nmachine = \"VMC <5>\"\ncalibrated = 2026-03-01\nlogo = \"logo.svg\"\nfields = { Order = \"4711\" }\n\n[load]";
    let pipeline = page(&folder.path().join("pipeline.toml")).replacen("[load]", head, 1);
    fs::write(folder.path().join("pipeline.toml"), pipeline).unwrap();
    let missing = folder.run(&["run", "pipeline.toml"]);
    assert!(
        missing.status == 2 && missing.stderr.contains("cannot read") && missing.stderr.contains("logo.svg"),
        "{}",
        missing.stderr
    );
    fs::write(folder.path().join("logo.svg"), "<svg xmlns='http://www.w3.org/2000/svg'/>").unwrap();
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let written = elements(&page(&folder.path().join("out/report.html")));
    let (before, _) = written.split_once("role=\"status\"").unwrap();
    for part in ["VMC &lt;5&gt;", "Calibrated", "2026-03-01", "Order", "4711", "src=\"data:image/svg+xml;base64,"] {
        assert!(before.contains(part), "{part}");
    }
    let summary: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!([&summary["head"]["machine"], &summary["head"]["fields"]["Order"]], ["VMC <5>", "4711"]);
    let again = folder.run(&["report", "out/result.h5", "--out", "again.html"]);
    assert_eq!(again.status, 0, "{}", again.stderr);
    assert_eq!(elements(&page(&folder.path().join("again.html"))), written);
}

#[test]
fn hostile_names_stay_names() {
    let folder = spindle(true);
    let ran = folder.run(&["run", "pipeline.toml"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let written = page(&folder.path().join("out/report.html"));
    let shown = elements(&written);
    assert!(!shown.contains("<b>") && !shown.contains("<!-- %"), "a name became an element");
    assert!(shown.contains("&lt;/script&gt;&lt;b&gt;"), "the title is missing");
    // Canvas, charts, drawing and program, behind the data.
    assert_eq!(written.matches("</script>").count(), 5);
}

#[test]
fn a_diagnosis_has_its_report() {
    let folder = spindle(false);
    // What the rig declares of a sensor is not so.
    let wrong = page(&folder.path().join("pipeline.toml")).replace(
        "angle_deg = 0,  z_mm = 230, section = \"b\" }",
        "angle_deg = 0, z_mm = 230, section = \"b\", gain = 1.02 }",
    );
    fs::write(folder.path().join("pipeline.toml"), wrong).unwrap();
    let ran = folder.run(&["diagnose", "pipeline.toml"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let written = page(&folder.path().join("out/diagnosed/report.html"));
    for part in ["Closed loop", "effect by effect", "What the declared model lacks"] {
        assert!(written.contains(part), "{part}");
    }
    let ran = folder.run(&["report", "out/diagnosed/result.h5", "--out", "again.html"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert_eq!(elements(&page(&folder.path().join("again.html"))), elements(&written));
}

/// A simulated spindle whose pipeline has the same limit and exports, and a page of each command that has one.
fn pages_of_commands(hostile: bool) -> (Folder, [PathBuf; 3]) {
    let folder = spindle(hostile);
    let compared = folder.run(&["compare", "pipeline.toml", "--report", "compare.html", "--out", "compare.json"]);
    assert_eq!(compared.status, 0, "{}", compared.stderr);
    let planned = folder.run(&["plan", "rig.toml", "--orders", "2..60", "--report", "plan.html"]);
    assert_eq!(planned.status, 0, "{}", planned.stderr);
    let recordings = ["one.h5", "two.h5", "three.h5"];
    for (seed, name) in (1..).zip(recordings) {
        let ran = folder.run(&["simulate", "scenario.toml", "--out", name, "--set", &format!("seed={seed}")]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
    let batch = folder.run(&[&["batch", "pipeline.toml"], &recordings[..], &["--out", "many"]].concat());
    assert_eq!(batch.status, 0, "{}", batch.stderr);
    let pages = ["compare.html", "plan.html", "many/report.html"].map(|name| folder.path().join(name));
    (folder, pages)
}

#[test]
fn comparison_plan_and_batch_have_their_pages() {
    let (folder, [compared, planned, batch]) = pages_of_commands(false);
    let expected: [(&Path, &[&str]); 3] = [
        (&compared, &["Turned shaft", "compared with four-sensor-reversal", "E_n by order", "Methods", "BLAKE3"]),
        (
            &planned,
            &[
                "Plan of rig.toml",
                "Lost orders of form: none",
                "Noise gain of form, other layouts",
                "Setup <bdi>reversed",
            ],
        ),
        (&batch, &["3 recordings. ", "Limits, recordings that are proven", "Individuals", "Moving range"]),
    ];
    for (path, parts) in expected {
        let written = page(path);
        for part in parts {
            assert!(written.contains(part), "{}: {part}", path.display());
        }
        assert!(written.contains("default-src 'none'") && !elements(&written).contains("://"), "{}", path.display());
    }
    // The limit of the pipeline is in the control charts.
    assert!(page(&batch).contains("\"upper limit\""));
    for (arguments, said) in [
        (&["compare", "pipeline.toml", "--report", "pipeline.toml"][..], "is read as configuration"),
        (&["plan", "rig.toml", "--report", "./rig.toml"], "is read as configuration"),
        (&["compare", "pipeline.toml", "--report", "shaft.h5"], "it is what the run reads"),
    ] {
        let ran = folder.run(arguments);
        assert!(ran.status != 0 && ran.stderr.contains(said), "{arguments:?}: {}", ran.shown());
    }
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0, "the inputs are as they were");
}

#[test]
fn names_of_comparison_and_plan_stay_names() {
    let (_folder, pages) = pages_of_commands(true);
    for path in pages {
        let written = page(&path);
        let shown = elements(&written);
        assert!(!shown.contains("<b>") && !shown.contains("<!-- %"), "{}", path.display());
        assert_eq!(written.matches("</script>").count(), 5, "{}", path.display());
    }
}

#[test]
fn error_motion_has_all_turns_and_spectra() {
    let folder = spindle(false);
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
    let written = page(&folder.path().join("out/report.html"));
    for part in ["\"turns\"", "\"spectrum\"", "\"spectrum-hz\"", "\"tilt-turns\"", "outermost turn"] {
        assert!(written.contains(part), "{part}");
    }
    let result = hdf5_metno::File::open(folder.path().join("out/result.h5")).unwrap();
    let column = |name: &str| result.dataset(name).unwrap().read_raw::<f64>().unwrap();
    let [low, middle, high] = ["lowest", "synchronous", "highest"].map(|name| column(&format!("turns/{name}_um")));
    assert!(!middle.is_empty() && low.iter().zip(&middle).all(|(low, middle)| low <= middle));
    assert!(high.iter().zip(&middle).all(|(high, middle)| high >= middle));
    // Sensor noise of 0.02 µm: turns lie a few times that apart.
    let widest = low.iter().zip(&high).map(|(low, high)| high - low).fold(0.0, f64::max);
    assert!((0.02..0.5).contains(&widest), "{widest}");
    let orders = result.dataset("spectrum/order").unwrap().read_raw::<u32>().unwrap();
    assert_eq!(orders.iter().max(), Some(&63));
}

#[test]
fn what_is_no_result_is_refused() {
    let folder = spindle(false);
    for (arguments, status, said) in [
        (&["report", "shaft.h5"][..], 1, "expected a file of the format runout-result"),
        (&["report", "none.h5"], 1, "none.h5"),
        (&["report", "scenario.toml"], 1, "no HDF5 file"),
        (&["report", "."], 2, "is no result file"),
        (&["report", "shaft.h5", "--out", "./shaft.h5"], 2, "is the result itself"),
    ] {
        let ran = folder.run(arguments);
        assert!(ran.status == status && ran.stderr.contains(said), "{arguments:?}: {}", ran.shown());
    }
    assert!(!folder.path().join("shaft.html").exists(), "a half report");
}

/// What Chromium finds in a report.
fn look(report: &Path) -> Option<serde_json::Value> {
    in_chromium("look.mjs", report)
}

/// No console message, no request, nothing serious for people who do not see the page; sizes and times are printed.
fn assert_quiet(name: &str, found: &serde_json::Value) {
    assert_eq!(found["console"], serde_json::json!([]), "{name}");
    assert_eq!(found["requests"], serde_json::json!([]), "{name}");
    let serious = |one: &&serde_json::Value| one["impact"] == "serious" || one["impact"] == "critical";
    let axe: Vec<_> = found["axe"].as_array().unwrap().iter().filter(serious).collect();
    assert!(axe.is_empty(), "{name}: {axe:#?}");
    let [bytes, usable, complete] = ["bytes", "usable_ms", "complete_ms"].map(|key| &found[key]);
    say(&format!("{name}: {bytes} bytes, usable after {usable} ms, complete after {complete} ms"));
}

#[test]
fn chromium_draws_what_the_tables_hold_and_the_controls_work() {
    let folder = spindle(true);
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
    let Some(found) = look(&folder.path().join("out/report.html")) else { return };
    assert_quiet("spindle", &found);
    // The table in HDF5 holds the numbers of the one in Parquet.
    let result = hdf5_metno::File::open(folder.path().join("out/result.h5")).unwrap();
    let rows = result.dataset("form/form_um").unwrap().read_raw::<f64>().unwrap();
    // The first station's two sections, with the first angle once more at the end.
    let curves = found["plots"]["plot-form"].as_array().unwrap().iter().filter(|trace| trace["meta"] == "values");
    let drawn: Vec<f64> = curves.map(|trace| trace["sum"].as_f64().unwrap()).collect();
    let angles = rows.len() / 10;
    for (section, drawn) in drawn.iter().enumerate() {
        let curve = &rows[section * angles..(section + 1) * angles];
        let sum: f64 = curve.iter().sum::<f64>() + curve[0];
        // Numbers of the page are f32.
        assert!((sum - drawn).abs() < 1e-4, "section {section}: {sum} {drawn}");
    }
    assert_eq!(drawn.len(), 2);
    let of = |plot: &str| found["plots"][plot][0].clone();
    // The map has every height of the surface, the body in space those of the rings and angles that it draws, with the seam closed.
    let surface = result.dataset("surface_map/deviation_um").unwrap();
    let [rings, angles] = surface.shape()[..] else { panic!("a surface has two dimensions") };
    let heights = surface.read_raw::<f64>().unwrap();
    assert_eq!(of("map-surface")["count"].as_u64(), Some((rings * angles) as u64));
    let whole: f64 = heights.iter().sum();
    assert!((of("map-surface")["sum"].as_f64().unwrap() - whole).abs() < 1e-6 * heights.len() as f64, "{whole}");
    let drawn = (0..rings).step_by(rings.div_ceil(160_000 / angles)).flat_map(|ring| {
        let around = (0..angles).chain([0]);
        around.map(|angle| heights[ring * angles + angle]).collect::<Vec<_>>()
    });
    let drawn: Vec<f64> = drawn.collect();
    assert_eq!(of("solid-surface")["count"].as_u64(), Some(drawn.len() as u64));
    let sum: f64 = drawn.iter().sum();
    assert!((of("solid-surface")["sum"].as_f64().unwrap() - sum).abs() < 1e-6 * drawn.len() as f64, "{sum}");
    let controls = &found["controls"];
    for (plot, control) in
        [("plot-form", "panel"), ("plot-form", "filter"), ("plot-motion", "filter"), ("plot-form-harmonics", "panel")]
    {
        assert_eq!(controls[plot][control], true, "{plot} {control}");
    }
    circles_are_those_of_the_table(&controls["plot-form"], &result);
    assert_eq!(controls["slider"], true);
    assert!(found["pointed"].as_str().unwrap().contains("deviation") && found["ring"].is_array(), "{found:#}");
}

/// The sheet below a polar plot has RONt of the circle that is chosen, section by section, as the table has it.
fn circles_are_those_of_the_table(form: &serde_json::Value, result: &hdf5_metno::File) {
    let ront = result.dataset("circles/ront_um").unwrap().read_raw::<f64>().unwrap();
    let turned = result.dataset("circles/peak_deg").unwrap().read_raw::<f64>().unwrap();
    // Four circles behind each filter of a section; LSCI and MZCI without filter come first.
    let (stations, sections, circles) = (5, 2, 4);
    let of_section = ront.len() / (stations * sections);
    assert!(of_section.is_multiple_of(circles), "{of_section}");
    let is_near = |cell: &serde_json::Value, expected: f64| {
        let text = cell.as_str().unwrap().split(' ').next().unwrap();
        (text.parse::<f64>().unwrap() - expected).abs() < 1e-3 * expected
    };
    for (rows, circle) in [("sheet", 0), ("zone", 1)] {
        let rows = form[rows].as_array().unwrap();
        assert_eq!(rows.len(), 1 + sections, "a row of names, and one a section");
        for (section, row) in rows[1..].iter().enumerate() {
            // The look has gone on to the second station.
            let place = (sections + section) * of_section + circle;
            assert!(is_near(&row[1], ront[place]), "{row} {}", ront[place]);
            let angle = format!("at {:.1}°", turned[place]);
            assert!(row[2].as_str().unwrap().ends_with(&angle), "{row} {angle}");
        }
    }
    assert_eq!(
        (form["circle"].as_bool(), form["about"].as_str()),
        (Some(true), Some("About MZCI, filter: none; lengths in µm"))
    );
}

#[test]
fn chromium_draws_comparison_plan_and_batch() {
    let (folder, [compared, planned, batch]) = pages_of_commands(true);
    let Some(found) = look(&compared) else { return };
    assert_quiet("compare", &found);
    // The first panel has the first station's first quantity: E_n of every method but the reference.
    let document: serde_json::Value = serde_json::from_str(&page(&folder.path().join("compare.json"))).unwrap();
    let first = &document["stations"][0]["quantities"][0]["differences"];
    let expected: f64 = first
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|one| {
            one["by_order"]["e_n"].as_array().unwrap().iter().filter_map(serde_json::Value::as_f64).collect::<Vec<_>>()
        })
        .sum();
    let traces = found["plots"]["plot-e-n"].as_array().unwrap();
    let drawn: f64 =
        traces.iter().filter(|trace| trace["meta"] == "values").filter_map(|trace| trace["sum"].as_f64()).sum();
    assert!((expected - drawn).abs() < 1e-5 * expected.max(1.0), "{expected} {drawn}");
    for (name, path, plot) in [("plan", &planned, "plot-noise-gain"), ("batch", &batch, "plot-trend")] {
        let found = look(path).unwrap();
        assert_quiet(name, &found);
        assert_eq!(found["controls"][plot]["panel"], true, "{name}");
    }
}

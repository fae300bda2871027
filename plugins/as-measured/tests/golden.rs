//! Values of surfaces and profiles as measured beside those of surfalize, SurfaceTopography and SciPy on the same files (`golden/write.py`).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::path::Path;

use runout_core::{
    pipeline::{Pipeline, Registry},
    summary::Summary,
};
use serde_json::Value;

fn run(text: &str) -> Result<Summary, String> {
    let mut registry = Registry::default();
    runout_maps::register(&mut registry);
    runout_points::register(&mut registry);
    runout_as_measured::register(&mut registry);
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let pipeline = Pipeline::from_toml(text, base, &registry).map_err(|error| error.to_string())?;
    pipeline.run().map_err(|error| error.to_string())
}

fn of_file(file: &str, separate: &str, evaluate: &str) -> Summary {
    let text = format!(
        "load = {{ plugin = 'height-map', path = '{file}' }}\nseparate = {{ plugin = 'as-measured', {separate} }}\n{evaluate}"
    );
    run(&text).unwrap()
}

fn value(summary: &Summary, symbol: &str) -> f64 {
    let found = summary.values.iter().find(|value| value.symbol == symbol);
    found.unwrap_or_else(|| panic!("no {symbol} in {:?}", summary.values)).value
}

fn expected() -> Value {
    serde_json::from_str(include_str!("golden/values.json")).unwrap()
}

fn assert_near(what: &str, ours: f64, theirs: f64, share: f64) {
    println!("{what:22} {ours:16.10} {theirs:16.10} {:10.2e}", ours / theirs - 1.0);
    assert!((ours - theirs).abs() <= share * theirs.abs(), "{what}: {ours} instead of {theirs}");
}

#[test]
fn areal_values_are_those_of_surfalize() {
    let golden = expected();
    let stages = [
        ("plane", "form = 'plane'"),
        ("polynomial2", "form = 'polynomial'"),
        ("polynomial3", "form = 'polynomial', degree = 3"),
        ("sphere", "form = 'sphere'"),
        ("cylinder", "form = 'cylinder'"),
    ];
    for (name, stage) in stages {
        let summary = of_file("surface.x3p", stage, "");
        for symbol in ["Sa", "Sq", "Sp", "Sv", "Sz", "Ssk", "Sku"] {
            assert_near(
                &format!("{name} {symbol}"),
                value(&summary, symbol),
                golden[name][symbol].as_f64().unwrap(),
                1e-6,
            );
        }
        if ["sphere", "cylinder"].contains(&name) {
            // SciPy settles within 1e-7 of the radius, of which the sum of squares depends on the square.
            assert_near(
                &format!("{name} radius"),
                value(&summary, "radius"),
                1e-3 * golden[name]["radius"].as_f64().unwrap(),
                1e-5,
            );
        }
        assert!(
            summary.notes.iter().any(|note| note.contains("stages before the values") && note.contains("removed")),
            "{:?}",
            summary.notes
        );
        let sq = summary.values.iter().find(|value| value.symbol == "Sq").unwrap();
        assert!(sq.reference.as_deref().unwrap().starts_with("least-squares"), "{sq:?}");
        assert!(sq.no_uncertainty.as_deref().unwrap().contains("does not show its noise"), "{sq:?}");
    }
    let axis = value(&of_file("surface.x3p", "form = 'cylinder'", ""), "axis");
    assert!((axis - golden["cylinder"]["axis"].as_f64().unwrap()).abs() < 1e-3, "{axis}");
    let curved = of_file("surface.x3p", "form = 'polynomial'", "");
    assert_near(
        "SurfaceTopography Sq",
        value(&curved, "Sq"),
        golden["topography_curvature_Sq"].as_f64().unwrap(),
        1e-9,
    );
    // The plane is removed where nothing else is asked for.
    let plain = of_file("surface.x3p", "object = 'height-map'", "");
    assert_near("no stage, Sq", value(&plain, "Sq"), golden["plane"]["Sq"].as_f64().unwrap(), 1e-9);
    let bare = of_file("surface.x3p", "form = 'none'", "");
    assert!(value(&bare, "Sq") > 1.05 * value(&plain, "Sq"), "a tilt of 4 µm/mm is part of it");
}

#[test]
fn voids_are_masked_or_filled_and_the_result_says_so() {
    let golden = expected();
    let masked = of_file("voids.x3p", "form = 'plane'", "");
    assert_near("masked Sq", value(&masked, "Sq"), golden["topography_voids_plane_Sq"].as_f64().unwrap(), 1e-6);
    assert!(
        masked.warnings.iter().any(|warning| warning.contains("25 of 6720 points have no height")),
        "{:?}",
        masked.warnings
    );
    let filled = of_file("voids.x3p", "form = 'cylinder', voids = 'fill'", "");
    let whole = value(&of_file("surface.x3p", "form = 'cylinder'", ""), "Sq");
    let sq = filled.values.iter().find(|value| value.symbol == "Sq").unwrap();
    let said = filled.warnings.iter().find(|warning| warning.contains("the filled points alone")).unwrap();
    let std_um: f64 =
        said.split("uncertain by ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-3;
    // The heights under the voids are known here; three standard uncertainties.
    assert!((sq.value - whole).abs() < 3.0 * std_um, "{:?} {whole} {std_um}", sq.value);
    assert!(std_um > 0.0 && std_um < 0.01 * whole);
    assert!(
        filled.notes.iter().any(|note| note.contains("voids: filled") && note.contains("(25 points)")),
        "{:?}",
        filled.notes
    );
}

#[test]
fn crop_and_outliers_are_stages() {
    let cropped = of_file("surface.x3p", "crop = { x_mm = [0.05, 0.1], y_mm = [0.0, 0.05] }, outlier_mad = 30", "");
    let note = cropped.notes.iter().find(|note| note.contains("stages")).unwrap();
    // 21 columns and 21 rows of 2.5 µm.
    assert!(note.contains("crop: x from 0.05 to 0.1 mm, y from 0 to 0.05 mm (6279 points)"), "{note}");
    assert!(
        note.contains("outliers: further than 30 median absolute deviations") && note.contains("(0 points)"),
        "{note}"
    );
    let text = "load = { plugin = 'height-map', path = 'surface.x3p' }\nseparate = { plugin = 'as-measured', crop = { x_mm = [5.0, 6.0] } }";
    let refused = run(text).unwrap_err();
    assert!(refused.contains("x goes from 0.000000 to 0.237500 mm"), "{refused}");
}

#[test]
fn a_profile_has_straightness_and_texture() {
    let golden = expected();
    let evaluate = "[evaluate]\ntexture = { profiles = ['P'] }";
    let found = of_file("profile.x3p", "object = 'profile'", evaluate);
    for symbol in ["Pa", "Pq", "STRt", "STRq"] {
        assert_near(symbol, value(&found, symbol), golden["profile"][symbol].as_f64().unwrap(), 1e-6);
    }
    let circle = of_file("profile.x3p", "object = 'profile', form = 'cylinder'", evaluate);
    assert_near("circle Pq", value(&circle, "Pq"), golden["circle"]["Pq"].as_f64().unwrap(), 1e-3);
    assert_near("circle radius", value(&circle, "radius"), 1e-3 * golden["circle"]["radius"].as_f64().unwrap(), 1e-5);
    let map = run(
        "load = { plugin = 'height-map', path = 'surface.x3p' }\nseparate = { plugin = 'as-measured', object = 'profile' }",
    );
    assert!(map.unwrap_err().contains("it is a map and no profile"));
    let row = run("load = { plugin = 'height-map', path = 'profile.x3p' }\nseparate = { plugin = 'as-measured' }");
    assert!(row.unwrap_err().contains("the same y"));
}

/// A circle of three lobes and a cylinder of three circles, in the numbers that made them.
#[test]
fn circles_and_cylinders_have_their_form() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("circle.csv");
    let form = |angle: f64| 4.0 * (3.0 * angle).cos() + 0.5 * (7.0 * angle).sin();
    let angle = |index: usize| std::f64::consts::TAU * index as f64 / 720.0;
    let lines = (0..720).map(|index| format!("{},{}\n", angle(index).to_degrees(), form(angle(index))));
    std::fs::write(&path, format!("angle_deg,deviation_um\n{}", lines.collect::<String>())).unwrap();
    let of = |path: &Path, separate: &str| {
        run(&format!(
            "load = {{ plugin = 'points', path = '{}' }}\nseparate = {{ plugin = 'as-measured', {separate} }}\nevaluate = {{ filter_upr = [] }}",
            path.display()
        ))
    };
    let summary = of(&path, "object = 'roundness', radius_mm = 10.0").unwrap();
    let rounded = summary
        .placed_values()
        .iter()
        .find(|placed| placed.value.symbol == "RONt" && placed.value.reference.as_deref() == Some("LSCI"))
        .map(|placed| placed.value.value);
    let all: Vec<f64> = (0..7200).map(|index| form(0.1 * angle(index))).collect();
    let range =
        all.iter().copied().fold(f64::NEG_INFINITY, f64::max) - all.iter().copied().fold(f64::INFINITY, f64::min);
    assert_near("RONt", rounded.unwrap(), range, 1e-4);
    assert!(of(&path, "object = 'roundness'").unwrap_err().contains("which radius they count from"));
    let path = folder.path().join("cylinder.csv");
    let nodes = (0..720).flat_map(|index| [0.0, 5.0, 10.0].map(|z| (angle(index), z)));
    let rows = nodes.map(|(angle, z)| format!("{},{z},{}\n", angle.to_degrees(), 10.0 + 1e-3 * form(angle) + 1e-4 * z));
    let text = format!("angle_deg,z_mm,radius_mm\n{}", rows.collect::<String>());
    std::fs::write(&path, text).unwrap();
    let summary = of(&path, "object = 'cylinder'").unwrap();
    let symbols: Vec<&str> = summary.placed_values().iter().map(|placed| placed.value.symbol.as_ref()).collect();
    assert!(symbols.contains(&"CYLt") && summary.stations.len() == 3, "{symbols:?}");
    assert!(of(&path, "object = 'roundness'").unwrap_err().contains("3 circles"));
}

#[test]
fn keys_that_cannot_be_are_refused_with_their_place() {
    let refused = |separate: &str| {
        run(&format!("load = {{ plugin = 'height-map', path = 'surface.x3p' }}\nseparate = {{ plugin = 'as-measured', {separate} }}")).unwrap_err()
    };
    assert!(refused("degree = 3").contains("only a polynomial has a degree"));
    assert!(refused("object = 'roundness', form = 'plane'").contains("height maps and profiles"));
    assert!(refused("radius_mm = 3.0").contains("circles and cylinders"));
    assert!(refused("crop = { x_mm = [2.0, 1.0] }").contains("from below to"));
    assert!(refused("object = 'profile', voids = 'fill'").contains("only voids of a height map"));
}

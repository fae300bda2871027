//! A dial gauge: one sensor, one setup. Nothing is separated, and every command says so.

use std::{f64::consts::TAU, fmt::Write};

use serde_json::Value;

use crate::folder::Folder;

const PIPELINE: &str = r#"title = "Dial gauge"

[rig]
part_radius_mm = 20
sensors = [{ id = "S1", angle_deg = 0, z_mm = 10, section = "a" }]
setups = [{ id = "up" }]

[load]
plugin = "csv"
pattern = "dial.csv"
stations = [{ name = "shaft" }]
speed_rpm = 60

[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 256

[separate]
plugin = "harmonic-least-squares"

[[export]]
plugin = "parquet"
path = "out"
"#;

/// 12 µm of eccentricity, an oval and a lobed form, with noise, over 30 turns.
fn recording() -> String {
    let mut seed = 7_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut rows = String::from("angle_deg,S1\n");
    for sample in 0..30 * 256 {
        let angle = TAU * f64::from(sample) / 256.0;
        let reading =
            12.0 * (angle - 35_f64.to_radians()).cos() + 1.5 * (2.0 * angle - 0.4).cos() + 0.6 * (3.0 * angle).cos();
        writeln!(rows, "{:.6},{:.5}", angle.to_degrees(), reading + 0.3 * noise()).unwrap();
    }
    rows
}

#[test]
fn the_reading_is_given_as_a_reading() {
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("dial.csv", &recording())]);
    let ran = folder.run(&["run", "pipeline.toml"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(ran.stdout.contains("\nNothing is separated") && ran.stdout.contains("run-out TIR µm"), "{}", ran.stdout);
    assert!(!ran.stdout.contains("Form") && !ran.stdout.contains("RONt"), "{}", ran.stdout);
    let summary: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out/summary.json")).unwrap()).unwrap();
    let station = &summary["stations"][0];
    let reading = &station["readings"][0];
    assert_eq!((&reading["setup"], &reading["sensor"]), (&"up".into(), &"S1".into()));
    let number = |value: &Value| value.as_f64().unwrap();
    // 0.3 µm of uniform noise are 0.087 µm rms; over 29 turns of 256 points a harmonic has 0.0014 µm.
    assert!((number(&reading["once_per_rev"]["amplitude_um"]) - 12.0).abs() < 0.01, "{reading}");
    assert!((number(&reading["once_per_rev"]["phase_deg"]) - 35.0).abs() < 0.1, "{reading}");
    assert!((number(&reading["harmonics"][0]["amplitude_um"]) - 1.5).abs() < 0.01, "{reading}");
    let truth = |angle: f64| {
        12.0 * (angle - 35_f64.to_radians()).cos() + 1.5 * (2.0 * angle - 0.4).cos() + 0.6 * (3.0 * angle).cos()
    };
    let curve = (0..3600).map(|step| truth(TAU * f64::from(step) / 3600.0));
    let [low, high] = curve.fold([f64::MAX, f64::MIN], |[low, high], value| [low.min(value), high.max(value)]);
    // Noise of the mean, 0.016 µm at one angle, adds to a peak-to-valley.
    assert!((number(&reading["tir_um"]) - (high - low)).abs() < 0.1, "{reading} for {}", high - low);
    assert!((number(&reading["turns_std_um"]) - 0.087).abs() < 0.01, "{reading}");
    assert_eq!(station["sections"][0]["values"].as_array().unwrap().len(), 0);
    let table = folder.run(&["inspect", "out/reading.parquet", "--json"]);
    assert!(table.stdout.contains("\"rows\": 256") && table.stdout.contains("reading_um"), "{}", table.stdout);
    // With a second setup, form is separated: the table goes with the next run.
    let two = PIPELINE.replace(
        "setups = [{ id = \"up\" }]",
        "setups = [{ id = \"up\" }, { id = \"turned\", part_deg = 180, sensors_deg = 180 }]",
    );
    std::fs::write(folder.path().join("two.toml"), two.replace("pattern = \"dial.csv\"", "pattern = \"{setup}.csv\""))
        .unwrap();
    for name in ["up.csv", "turned.csv"] {
        std::fs::write(folder.path().join(name), recording()).unwrap();
    }
    let ran = folder.run(&["run", "two.toml"]);
    assert!(ran.status == 0 && ran.stdout.contains("Form"), "{}{}", ran.stdout, ran.stderr);
    assert!(!folder.path().join("out/reading.parquet").is_file());
}

#[test]
fn check_and_diagnose_say_that_nothing_is_separated() {
    let folder = Folder::with(&[("pipeline.toml", PIPELINE), ("dial.csv", &recording())]);
    let ran = folder.run(&["check", "pipeline.toml"]);
    assert!(ran.status == 0 && ran.stdout.contains("nothing is separated"), "{}{}", ran.stdout, ran.stderr);
    let ran = folder.run(&["diagnose", "pipeline.toml"]);
    assert!(ran.status == 0 && ran.stdout.contains("\nNothing is separated"), "{}{}", ran.stdout, ran.stderr);
    assert!(!ran.stdout.contains("RONt") && !ran.stdout.contains("noise only"), "{}", ran.stdout);
    let ran = folder.run(&["diagnose", "pipeline.toml", "--json"]);
    let found: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!((&found["verdict"], &found["nothing_separated"]), (&"nothing-found".into(), &true.into()));
    assert_eq!(found["before"]["degrees_of_freedom"], 0);
    assert!(found["before"]["chi2_per_dof"].is_null() && found["moved"].as_array().unwrap().is_empty(), "{found}");
}

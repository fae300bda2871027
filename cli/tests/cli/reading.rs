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
    // Values of the reading alone, the same numbers as those of the reading.
    let values = station["sections"][0]["values"].as_array().unwrap();
    let symbols: Vec<&str> = values.iter().map(|value| value["symbol"].as_str().unwrap()).collect();
    assert_eq!(symbols, ["TIR", "eccentricity", "eccentricity-angle"]);
    assert_eq!((&values[0]["value"], &values[0]["uncertainty"]["std"]), (&reading["tir_um"], &reading["tir_std_um"]));
    // The sensor stands at 0°: its highest reading comes when the part has turned by 35° against the centre's angle.
    assert!((number(&values[1]["value"]) - 12.0).abs() < 0.01 && (number(&values[2]["value"]) - 325.0).abs() < 0.1);
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

/// Three sensors in two setups, run-out with limits.
const ECCENTRIC: &str = r#"title = "Set-up"

[rig]
part_radius_mm = 20
rotation = "ROTATION"
sensors = [
  { id = "S1", angle_deg = 10, z_mm = 0, section = "a" },
  { id = "S2", angle_deg = 100, z_mm = 0, section = "a" },
  { id = "S3", angle_deg = 205, z_mm = 0, section = "a" },
]
setups = [{ id = "up", part_deg = 0 }, { id = "turned", part_deg = 70, sensors_deg = 15 }]

[load]
plugin = "csv"
pattern = "{setup}.csv"
stations = [{ name = "shaft" }]
speed_rpm = 60

[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 128

[separate]
plugin = "harmonic-least-squares"

[evaluate]
values = ["roundness", "run-out"]

[[limit]]
symbol = "eccentricity"
reference = "axis of rotation in turned"
upper = 5.0
unit = "um"

[[limit]]
symbol = "TIR"
reference = "reading"
upper = 30.0
unit = "um"

[[export]]
plugin = "csv"
path = "out/values.csv"

[[export]]
plugin = "parquet"
path = "out"
"#;

/// A round part whose centre goes around the axis: where it is at each instant, seen by each sensor, with 0.05 µm of noise.
fn eccentric(direction: f64, part_deg: f64, sensors_deg: f64, size_um: f64, centre_deg: f64) -> String {
    let mut seed = 11_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
    };
    let mut rows = String::from("angle_deg,S1,S2,S3\n");
    for sample in 0..40 * 128 {
        let turned_deg = 360.0 * f64::from(sample) / 128.0;
        let at = (centre_deg + part_deg + direction * turned_deg).to_radians();
        let [x, y] = [size_um * at.cos(), size_um * at.sin()];
        write!(rows, "{turned_deg:.6}").unwrap();
        for sensor_deg in [10.0, 100.0, 205.0] {
            let towards = f64::to_radians(sensor_deg + sensors_deg);
            write!(rows, ",{:.5}", x * towards.cos() + y * towards.sin() + 0.05 * noise()).unwrap();
        }
        rows.push('\n');
    }
    rows
}

#[test]
fn eccentricity_and_run_out_are_values_with_limits() {
    for (rotation, direction) in [("ccw", 1.0), ("cw", -1.0)] {
        let files = [eccentric(direction, 0.0, 0.0, 12.0, 40.0), eccentric(direction, 70.0, 15.0, 3.0, 290.0)];
        let pipeline = ECCENTRIC.replace("ROTATION", rotation);
        let folder = Folder::with(&[("pipeline.toml", &pipeline), ("up.csv", &files[0]), ("turned.csv", &files[1])]);
        let ran = folder.run(&["run", "pipeline.toml"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        assert!(ran.stdout.contains("Run-out and eccentricity"), "{}", ran.stdout);
        let csv = std::fs::read_to_string(folder.path().join("out/values.csv")).unwrap();
        let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
        let column = |name: &str| rows[0].iter().position(|known| *known == name).unwrap();
        let of = |symbol: &str, reference: &str| -> Vec<&Vec<&str>> {
            let is = |row: &&Vec<&str>| row[column("symbol")] == symbol && row[column("reference")] == reference;
            rows.iter().filter(is).collect()
        };
        let number = |row: &[&str], name: &str| row[column(name)].parse::<f64>().unwrap();
        for (setup, size_um, centre_deg) in [("up", 12.0, 40.0), ("turned", 3.0, 290.0)] {
            let reference = format!("axis of rotation in {setup}");
            for (symbol, truth) in [("eccentricity", size_um), ("eccentricity-angle", centre_deg)] {
                let [row] = of(symbol, &reference)[..] else { panic!("{symbol} of {setup}: {csv}") };
                let (found, std) = (number(row, "value"), number(row, "std"));
                assert!(
                    (found - truth).abs() < 4.0 * std,
                    "{rotation}, {symbol} of {setup}: {found} ± {std} for {truth}"
                );
                // 0.05 µm over 40·128 samples and three sensors, along one direction: 0.57 nm.
                let expected = 0.05 * (2.0_f64 / (40.0 * 128.0 * 3.0)).sqrt();
                let expected = if symbol == "eccentricity" { expected } else { (expected / size_um).to_degrees() };
                assert!((0.6..1.6).contains(&(std / expected)), "{symbol} of {setup}: {std} for {expected}");
            }
            for sensor in ["S1", "S2", "S3"] {
                let [row] = of("TIR", &format!("reading of {sensor} in {setup}"))[..] else { panic!("{csv}") };
                // Noise of the mean, 8 nm at one angle, adds to a peak-to-valley.
                assert!((number(row, "value") - 2.0 * size_um).abs() < 0.06, "{row:?}");
                assert_eq!(row[column("decision")], "conforms", "{row:?}");
            }
        }
        let [limited] = of("eccentricity", "axis of rotation in turned")[..] else { panic!("{csv}") };
        assert_eq!(limited[column("decision")], "conforms");
    }
}

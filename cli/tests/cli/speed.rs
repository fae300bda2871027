//! Error motion against speed: a series of recordings, one a speed.

use std::{f64::consts::TAU, fmt::Write, fs};

use serde_json::Value;

use crate::folder::Folder;

const PIPELINE: &str = r#"
title = "Spindle at twelve speeds"

[rig]
part_radius_mm = 12.7
sensors = [
  { id = "X", angle_deg = 0,  section = "ball", form_um = 0.02 },
  { id = "Y", angle_deg = 90, section = "ball" },
]
setups = [{ id = "only" }]

[load]
plugin = "csv"
stations = [{ name = "s" }]
files = [{ path = "500.csv", setup = "only", station = "s" }]

[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 64

[separate]
plugin = "harmonic-least-squares"

[evaluate]
values = ["error-motion"]

[[export]]
plugin = "figures"
path = "figures"
formats = ["svg"]

[[export]]
plugin = "report"
path = "report.html"
"#;

/// Amplitude of three waves a turn along x, in µm, and where the axis is, in µm.
fn truth(speed_rpm: f64) -> (f64, [f64; 2]) {
    let thousands = speed_rpm / 1000.0;
    (0.2 + 0.1 * thousands * thousands, [0.5 * thousands, -0.2 * thousands])
}

/// A ball 4 µm off centre on an axis that moves and shifts; noise of 0.01 µm.
fn recording(speed_rpm: f64) -> String {
    let (amplitude_um, shift_um) = truth(speed_rpm);
    let samples = 64;
    let mut seed = speed_rpm as u64 + 1;
    let mut noise = || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        0.01 * (0..12).map(|_| uniform()).sum::<f64>()
    };
    let mut text = "time_s,index,X,Y\n".to_owned();
    for sample in 0..=20 * samples {
        let turn = f64::from(sample) / f64::from(samples);
        let angle = TAU * turn;
        let x = 10.0 + shift_um[0] + 4.0 * angle.cos() + amplitude_um * (3.0 * angle).cos() + noise();
        let y = -5.0 + shift_um[1] + 4.0 * angle.sin() + noise();
        let (time, index) = (turn * 60.0 / speed_rpm, u8::from(sample % samples == 0));
        writeln!(text, "{time:.9},{index},{x:.6},{y:.6}").unwrap();
    }
    text
}

#[test]
fn twelve_speeds_give_values_over_rpm_and_the_shift_of_the_axis() {
    let folder = Folder::with(&[("pipeline.toml", PIPELINE)]);
    let speeds: Vec<f64> = (1..=12).map(|step| 500.0 * f64::from(step)).collect();
    let names: Vec<String> = speeds.iter().map(|speed| format!("{speed}.csv")).collect();
    for (name, speed) in names.iter().zip(&speeds) {
        fs::write(folder.path().join(name), recording(*speed)).unwrap();
    }
    // One without a clock has no speed.
    let timeless: String =
        recording(700.0).lines().map(|line| line.split_once(',').unwrap().1.to_owned() + "\n").collect();
    fs::write(folder.path().join("timeless.csv"), timeless).unwrap();
    let recordings: Vec<&str> = names.iter().map(String::as_str).chain(["timeless.csv"]).collect();
    let words = |more: &[&'static str]| [&["batch", "pipeline.toml", "--out", "out"], more, &recordings[..]].concat();
    let ran = folder.run(&words(&["--json"]));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let of = |name: &str| {
        let all = report["against_speed"].as_array().unwrap();
        all.iter()
            .find(|series| series["series"].as_str().unwrap().starts_with(name))
            .unwrap_or_else(|| panic!("{name}: {all:#?}"))
    };
    let at = |series: &Value, key: &str| [0, 1].map(|part| series[key][part].as_f64().unwrap());
    let motion = of("synchronous-radial-x");
    assert_eq!(motion["count"].as_u64(), Some(12));
    for (key, speed) in [("slowest", 500.0), ("fastest", 6000.0), ("largest", 6000.0)] {
        let [rpm, value] = at(motion, key);
        let expected = 2.0 * truth(speed).0;
        // Three waves are as high about any centre; noise of 0.01 µm in 20 turns raises the range by some 0.01 µm.
        assert!(
            (rpm / speed - 1.0).abs() < 1e-3 && (value - expected).abs() < 0.03,
            "{key}: {value} for {expected} at {rpm}"
        );
    }
    for (axis, name) in
        [(0, "axis-shift-x, section ball, setup only, s"), (1, "axis-shift-y, section ball, setup only, s")]
    {
        let shift = of(name);
        let expected = truth(6000.0).1[axis] - truth(500.0).1[axis];
        let [_, found] = at(shift, "fastest");
        assert!((found - expected).abs() < 2e-3, "{name}: {found} for {expected}");
        assert!(at(shift, "slowest")[1].abs() < 1e-12, "the slowest is the reference");
    }
    assert!(folder.path().join("out/speed.parquet").is_file());
    // Every series has its panel, though there are more than the panels that stations are thinned to.
    let series = report["against_speed"].as_array().unwrap().len();
    let picture = fs::read_to_string(folder.path().join("out/speed.svg")).unwrap();
    assert!(series > 12 && picture.starts_with("<svg") && !picture.contains(&format!("of {series})")), "{series}");
    assert!(
        fs::read_to_string(folder.path().join("out/report.html")).unwrap().contains("Error motion against the speed")
    );
    assert_eq!(report["without_speed"], serde_json::json!(["timeless"]));
    let shown = folder.run(&words(&[])).stdout;
    assert!(shown.contains("Speed not known, so in no row: timeless"), "{shown}");
    println!("{shown}");
    assert!(shown.contains("Error motion against the speed") && shown.contains("axis-shift-x"), "{shown}");
}

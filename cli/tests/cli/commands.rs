//! What the program says when all is well.

use crate::folder::{Folder, RIG, pipeline};
use insta::assert_snapshot;
use serde_json::{Value, json};

#[test]
fn list_of_plugins() {
    assert_snapshot!(Folder::with(&[]).run(&["plugins"]).shown());
}

#[test]
fn keys_of_a_plugin() {
    assert_snapshot!(Folder::with(&[]).run(&["plugins", "synchronous-average"]).shown());
}

/// Tables that name no plugin have keys too, and a stage is listed.
#[test]
fn keys_of_tables_without_a_plugin() {
    assert_snapshot!(Folder::with(&[]).run(&["plugins", "limit"]).shown());
    for (table, key) in
        [("rig", "sensors[].angle_deg"), ("evaluate", "filter_upr"), ("surface", "angles"), ("diagnose", "effects")]
    {
        let ran = Folder::with(&[]).run(&["plugins", table]);
        assert_eq!(ran.status, 0, "{table}: {}", ran.stderr);
        assert!(ran.stdout.starts_with(&format!("{table} ([{table}]): ")), "{}", ran.stdout);
        assert!(ran.stdout.contains(&format!("  {key}: ")), "{table}: {}", ran.stdout);
    }
    let stage = Folder::with(&[]).run(&["plugins", "preprocess"]).stdout;
    assert!(stage.contains("low-pass") && !stage.contains("parquet"), "{stage}");
}

#[test]
fn help() {
    assert_snapshot!(Folder::with(&[]).run(&["--help"]).shown());
}

/// The scripts are clap's; that they know the commands and options is what can go wrong here.
#[test]
fn completions_know_the_commands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let ran = Folder::with(&[]).run(&["completions", shell]);
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{shell}");
        for word in ["runout", "diagnose", "completions", "fail-on-limit"] {
            assert!(ran.stdout.contains(word), "{shell}: {word}");
        }
    }
    let ran = Folder::with(&[]).run(&["completions", "fish", "--json"]);
    let document: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(document["shell"], "fish");
    assert_eq!(Folder::with(&[]).run(&["completions", "cmd"]).status, 2);
}

#[test]
fn check_of_a_rig_with_everything_observable() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline())]);
    assert_snapshot!(folder.run(&["check", "pipeline.toml"]).shown());
}

/// The paper's own layout: with fixed sensors, even orders are not observable (physics of a half turn, not of a seed).
#[test]
fn check_names_the_orders_that_fixed_sensors_lose() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline())]);
    let fixed = ["check", "pipeline.toml", "--set", "rig.setups.1.sensors_deg=0"];
    assert_snapshot!(folder.run(&fixed).shown());

    let ran = folder.run(&[&fixed[..], &["--json"]].concat());
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let highest = report["orders"].as_array().unwrap().len();
    let even: Vec<usize> = (2..=highest).step_by(2).collect();
    assert_eq!(report["lost_orders"], json!({ "form": even, "motion": even }));
    assert_eq!(report["orders"][2]["order"], 3);
    assert_eq!(report["orders"][2]["residual_dof"], 2);
    assert_eq!(report["orders"][3]["residual_dof"], 4);
    assert_eq!(report["orders"][3]["noise_gain"][0], Value::Null);
}

pub(crate) const SCENARIO: &str = r#"title = "Small campaign"
plugin = "spindle"
output = "shaft.h5"
seed = 7
rig = "rig.toml"

[recording]
revolutions = 12
samples_per_rev = 128

[recording.stations]
first_z_mm = 0
step_mm = 30
count = 2

[form]
rms_um = 4
max_order = 20

[motion]
x_rms_um = 1.5
y_rms_um = 1.5
tilt_rms_urad = 5

[eccentricity]
offset_um = 8

[noise]
rms_um = 0.05
"#;

/// From a scenario to files, each step with one JSON document on stdout and nothing else anywhere.
#[test]
fn scenario_to_results() {
    let text = pipeline() + "\n[[export]]\nplugin = \"hdf5\"\npath = \"result.h5\"\n";
    let files = [("pipeline.toml", &*text), ("scenario.toml", SCENARIO), ("rig.toml", RIG)];
    let folder = Folder::with(&files);
    let document = |arguments: &[&str]| -> Value {
        let ran = folder.run(arguments);
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{arguments:?}");
        serde_json::from_str(&ran.stdout).unwrap()
    };

    let made = document(&["simulate", "scenario.toml", "--json"]);
    assert_eq!(made["output"], "shaft.h5");
    assert_eq!([&made["setups"], &made["stations"], &made["sensors"]], [2, 2, 4]);

    let held = document(&["inspect", "shaft.h5", "--json"]);
    assert_eq!(held["format"], "runout-measurement");
    assert_eq!(held["setups"], json!(["initial", "reversed"]));

    let summary = document(&["run", "pipeline.toml", "--json"]);
    assert_eq!(summary["title"], "Turned shaft");
    assert_eq!(summary["lost_orders"], json!({ "form": [], "motion": [] }));
    for station in summary["stations"].as_array().unwrap() {
        assert_eq!(station["captures"][0]["turns_used"], 12);
        for section in station["sections"].as_array().unwrap() {
            // Noise 0.05 µm over 12 turns, two setups and 128 samples a turn leaves about 0.01 µm; motion or
            // eccentricity left in the form would be above 0.1 µm.
            let error_um = section["truth_form_rms_error_um"].as_f64().unwrap();
            assert!(error_um < 0.05, "{error_um} µm");
        }
    }
    for output in summary["outputs"].as_array().unwrap() {
        assert!(folder.path().join(output.as_str().unwrap()).is_file(), "{output}");
    }

    assert_eq!(document(&["inspect", "result.h5", "--json"])["format"], "runout-result");
    let table = document(&["inspect", "out/form.parquet", "--json"]);
    assert_eq!(table["format"], "parquet");
    let names: Vec<&Value> = table["columns"].as_array().unwrap().iter().map(|column| &column["name"]).collect();
    assert_eq!(names, ["section", "station", "z_mm", "angle_deg", "form_um", "std_um"]);

    let shown = folder.run(&["run", "pipeline.toml"]);
    assert_eq!((shown.status, shown.stderr.as_str()), (0, ""), "no progress in a pipe");
    for word in ["Turned shaft", "Key values", "RONt", "true error", "--verbose adds: turns and filters"] {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }
    assert!(shown.stdout.lines().all(|line| line.chars().count() <= 100), "{}", shown.stdout);
    let verbose = folder.run(&["run", "pipeline.toml", "--verbose"]);
    for word in ["Turns", "out/form.parquet"] {
        assert!(!shown.stdout.contains(&format!("\n{word}")) && verbose.stdout.contains(word), "{}", verbose.stdout);
    }
}

const THREE_POINT: &str = r#"part_radius_mm = 30
sensors = [
  { id = "S1", angle_deg = 0 },
  { id = "S2", angle_deg = 99.844 },
  { id = "S3", angle_deg = 202.5 },
]
setups = [{ id = "initial" }]
"#;

#[test]
fn plan_of_a_three_point_rig() {
    let folder = Folder::with(&[("rig.toml", THREE_POINT)]);
    assert_snapshot!(folder.run(&["plan", "rig.toml", "--orders", "2..50"]).shown());
}

/// Fixed sensors, two setups: every even order is lost, and a setup with which they are observable is known.
#[test]
fn plan_of_a_rig_that_loses_orders() {
    let folder = Folder::with(&[("rig.toml", &RIG.replace("sensors_deg = 180", "sensors_deg = 0"))]);
    assert_snapshot!(folder.run(&["plan", "rig.toml", "--orders", "2..21"]).shown());
    let ran = folder.run(&["plan", "rig.toml", "--orders", "2..80", "--json"]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let even: Vec<usize> = (2..=80).step_by(2).collect();
    assert_eq!(report["lost_orders"], json!({ "form": even, "motion": even }));
    let gains = report["noise_gain"]["form"].as_array().unwrap();
    assert_eq!(gains.len(), 79);
    assert_eq!(gains[0], json!({ "order": 2, "gain": null }));
    assert_eq!([&gains[78]["order"], &report["residual_dof"][78]["order"]], [80, 80]);
    assert_eq!(report["residual_dof"][1], json!({ "order": 3, "dof": 2 }));
    let best = &report["suggestions"][0];
    assert_eq!([&best["before"]["lost_form_orders"], &best["after"]["lost_form_orders"]], [40, 0]);
    // Two sensors a section show only the ratio of their gains; a third one shows whose it is.
    let gains = json!(["sensor-gain S1", "sensor-gain S2"]);
    assert!(report["confounded"].as_array().unwrap().contains(&gains));
    let distinguishes = |entry: &&Value| entry["distinguishes"].as_array().unwrap().contains(&gains);
    let addition = report["suggestions"].as_array().unwrap().iter().find(distinguishes).unwrap();
    assert_eq!([&addition["add"], &addition["section"]], ["sensor", "a"]);
    // With the part reversed and nothing else, an angle that is off by a little looks like another form.
    let blind = |entry: &&Value| entry["effect"] == "reversal-angle" && entry["targets"] == json!(["reversed"]);
    let unseen = report["blind_to"].as_array().unwrap().iter().find(blind).unwrap();
    assert_eq!(unseen["bias_per_unit"]["unit"], "um/deg");
}

/// Better angles and the map, with nothing but the document on stdout and no progress in a pipe.
#[test]
fn plan_finds_better_angles_and_writes_the_map() {
    let folder = Folder::with(&[("rig.toml", THREE_POINT)]);
    let arguments =
        "plan rig.toml --orders 2..50 --optimise angles --clearance 20 --angle-tolerance 0.1deg --map map.csv --json";
    let ran = folder.run(&arguments.split(' ').collect::<Vec<_>>());
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    let worst = |arrangement: &Value| arrangement["within_tolerance"]["worst"].as_f64().unwrap();
    let optimised = &report["optimised"];
    let found = optimised["found"].as_array().unwrap();
    assert!(worst(&found[0]) < worst(&optimised["declared"]));
    for pair in found.windows(2) {
        assert!(worst(&pair[0]) <= worst(&pair[1]));
    }
    let map = std::fs::read_to_string(folder.path().join("map.csv")).unwrap();
    let mut lines = map.lines();
    assert_eq!(lines.next(), Some("layout,angles_deg,order,gain,lost"));
    assert!(lines.next().unwrap().starts_with("\"declared\",0 99.844 202.5,2,1.0"));
    let layouts = 1 + found.len() + report["suggestions"].as_array().unwrap().len();
    assert_eq!(map.lines().count(), 1 + 49 * layouts);
}

/// A check of a program that fails: a line, and status 1. Without a program there is nothing to test.
#[test]
#[cfg(unix)]
fn a_program_that_fails_a_check_is_named() {
    let folder = Folder::with(&[]);
    let ran = folder.run(&["plugins", "test", "--", "sh", "-c", "echo no licence >&2; exit 3"]);
    assert_eq!(ran.status, 1, "{}", ran.shown());
    assert!(ran.stdout.starts_with("fails       it starts and answers: "), "{}", ran.stdout);
    assert!(ran.stdout.contains("exit status: 3") && ran.stdout.contains("no licence"), "{}", ran.stdout);
    assert!(ran.stderr.contains("1 check failed"), "{}", ran.stderr);
    for words in [&["plugins", "test"][..], &["plugins", "hdf5", "--", "sh"]] {
        let refused = folder.run(words);
        assert!(refused.status == 2 && refused.stderr.contains("runout plugins test -- "), "{}", refused.shown());
    }
}

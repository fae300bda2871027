//! What a run must never do: write over what it reads, pass nonsense for a result, leave debris.

use std::fs;

use serde_json::Value;

use crate::{
    commands::SCENARIO,
    folder::{Folder, RIG, pipeline},
};

/// A folder with a small campaign.
fn campaign(pipeline: &str) -> Folder {
    let folder = Folder::with(&[("pipeline.toml", pipeline), ("scenario.toml", SCENARIO), ("rig.toml", RIG)]);
    assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
    folder
}

#[test]
fn nothing_is_written_over_what_is_read() {
    let folder = campaign(&(pipeline() + "\n[[export]]\nplugin = \"hdf5\"\npath = \"result.h5\"\n"));
    let before = ["shaft.h5", "pipeline.toml"].map(|name| fs::read(folder.path().join(name)).unwrap());
    for (path, status, word) in [
        ("./sub/../shaft.h5", 1, "what the run reads"),
        ("pipeline.toml", 2, "read as configuration"),
        ("out/summary.json", 2, "summary goes"),
        ("./out/../out/form.parquet", 2, "written by an exporter"),
    ] {
        fs::create_dir_all(folder.path().join("sub")).unwrap();
        let ran = folder.run(&["run", "pipeline.toml", "--set", &format!("export.1.path=\"{path}\"")]);
        assert_eq!(ran.status, status, "{path}: {}", ran.stderr);
        let flat = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(flat.contains(word), "{path}: {}", ran.stderr);
    }
    let after = ["shaft.h5", "pipeline.toml"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(before == after, "inputs were changed");

    let ran = folder.run(&["simulate", "scenario.toml", "--set", "output=scenario.toml"]);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    assert_eq!(fs::read_to_string(folder.path().join("scenario.toml")).unwrap(), SCENARIO);
}

#[test]
fn readings_that_contradict_the_rig_are_a_warning() {
    let folder = campaign(&pipeline());
    let warned = |arguments: &[&str]| {
        let ran = folder.run(arguments);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
        summary["warnings"].as_array().unwrap().iter().any(|text| text.as_str().unwrap().contains("contradict"))
    };
    assert!(!warned(&["run", "pipeline.toml", "--json"]));
    assert!(warned(&["run", "pipeline.toml", "--json", "--set", "rig.sensors.1.sign=-1"]));
}

#[test]
fn a_result_that_is_no_number_or_no_part_is_an_error() {
    let folder = campaign(&pipeline());
    // The eccentricity is larger than the part: no line meets it; and without lines, its form is no smaller.
    for (second_order, radius_mm, said) in [(true, 1e-3, "no number"), (false, 1e-6, "mm rms on 0.000001 mm radius")] {
        let radius = format!("rig.part_radius_mm={radius_mm}");
        let geometry = format!("separate.second_order={second_order}");
        let ran = folder.run(&["run", "pipeline.toml", "--set", &radius, "--set", &geometry]);
        assert_eq!(ran.status, 1, "{}", ran.stdout);
        assert!(ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ").contains(said), "{}", ran.stderr);
        assert!(!folder.path().join("out/form.parquet").exists());
    }
}

#[test]
fn the_stated_configuration_runs_again() {
    let folder = campaign(&pipeline().replace(&format!("[rig]\n{RIG}"), "rig = \"rig.toml\"\n"));
    let run = |arguments: &[&str]| -> Value {
        let ran = folder.run(&[&["run", "--json"], arguments].concat());
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        serde_json::from_str(&ran.stdout).unwrap()
    };
    let first = run(&["pipeline.toml", "--set", "rig.setups.1.sensors_deg=0", "--set", "title=Fixed sensors"]);
    let configuration = first["provenance"]["configuration"].as_str().unwrap();
    fs::write(folder.path().join("again.toml"), configuration).unwrap();
    let again = run(&["again.toml"]);
    assert_eq!(again["title"], "Fixed sensors");
    assert_eq!(again["stations"], first["stations"]);
    assert_eq!(again["lost_orders"], first["lost_orders"]);
}

#[test]
fn what_a_killed_run_left_goes_with_the_next() {
    let folder = campaign(&pipeline());
    let out = folder.path().join("out");
    fs::create_dir_all(&out).unwrap();
    // No process has this number: Linux counts to 4194304 at most.
    let debris = out.join(".form.parquet.4194305-0.partial");
    fs::write(&debris, "half").unwrap();
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
    assert!(!debris.exists() || !std::path::Path::new("/proc/self").exists());
    let left: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| !name.to_string_lossy().ends_with(".partial")), "{left:?}");
}

#[test]
#[cfg(target_os = "linux")]
fn an_interrupted_program_leaves_nothing() {
    use std::{
        process::{Command, Stdio},
        time::Duration,
    };

    let folder = campaign(&pipeline());
    let out = folder.path().join("out");
    let begun = || fs::read_dir(&out).is_ok_and(|mut entries| entries.next().is_some());
    // Long enough to be interrupted.
    let long = ["recording.stations={ first_z_mm = 0, step_mm = 0.001, count = 4000 }", "output=out/long.h5"];
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("runout"));
    let command =
        command.current_dir(folder.path()).args(["simulate", "scenario.toml", "--set", long[0], "--set", long[1]]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !begun() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted: what was not finished is taken away"), "{said}");
    assert!(!out.exists());
}

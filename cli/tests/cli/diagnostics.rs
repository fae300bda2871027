//! What the program says when something is wrong, with its exit status: reviewed text.

use crate::folder::{Folder, RIG, STAGES, pipeline};
use insta::assert_snapshot;

/// `runout check pipeline.toml` on the good pipeline with one text replaced by another.
fn check(good: &str, bad: &str) -> String {
    let text = pipeline();
    assert!(text.contains(good), "the pipeline has no {good:?}");
    Folder::with(&[("pipeline.toml", &text.replacen(good, bad, 1))]).run(&["check", "pipeline.toml"]).shown()
}

/// `runout check pipeline.toml` on the good pipeline with more arguments.
fn check_with(arguments: &[&str]) -> String {
    let all = [&["check", "pipeline.toml"], arguments].concat();
    Folder::with(&[("pipeline.toml", &pipeline())]).run(&all).shown()
}

#[test]
fn unknown_key_of_a_plugin() {
    assert_snapshot!(check("samples_per_rev = 128", "sample_per_rev = 128"));
}

#[test]
fn unknown_key_at_the_top() {
    assert_snapshot!(check("[separate]", "[seperate]"));
}

#[test]
fn values_that_cannot_be_are_refused_at_their_key() {
    for (line, words) in [
        ("datum = [\"a\", \"c\"]", "the rig has no section `c`"),
        ("harmonics_upr = 0", "from 2 on"),
        ("directions_deg = [45, 400]", "between -360 and 360 degrees"),
    ] {
        let shown = check("[[export]]", &format!("[evaluate]\n{line}\n\n[[export]]"));
        assert!(shown.starts_with("exit status: 2") && shown.contains(words) && shown.contains(line), "{shown}");
    }
}

#[test]
fn numbers_of_a_rig_that_no_rig_has_are_refused_at_their_key() {
    for (key, words) in [
        ("rig.sensors.0.angle_deg=1e308", "within ±36000°, found 1e308"),
        ("rig.sensors.0.angle_deg=-inf", "within ±36000°, found -inf"),
        ("rig.setups.0.part_deg=1e20", "within ±36000°"),
        ("rig.setups.0.sensors_deg=nan", "within ±36000°, found NaN"),
        ("rig.sensors.0.z_mm=1e300", "within ±1000000 mm"),
        ("rig.part_radius_mm=1e300", "up to 1000000 mm"),
    ] {
        let shown = check_with(&["--set", key]);
        let place = key.split('=').next().unwrap();
        assert!(shown.starts_with("exit status: 2"), "{shown}");
        assert!(shown.contains(words) && shown.contains(place), "{shown}");
    }
}

#[test]
fn unknown_plugin() {
    assert_snapshot!(check("\"four-sensor-reversal\"", "\"four-senser-reversal\""));
}

#[test]
fn missing_plugin() {
    assert_snapshot!(check("plugin = \"hdf5\"\n", ""));
}

#[test]
fn wrong_type() {
    assert_snapshot!(check("samples_per_rev = 128", "samples_per_rev = \"many\""));
}

#[test]
fn missing_key() {
    assert_snapshot!(check("path = \"shaft.h5\"\n", ""));
}

#[test]
fn missing_table() {
    assert_snapshot!(check("[separate]\nplugin = \"four-sensor-reversal\"\n", ""));
}

#[test]
fn value_out_of_range_in_the_rig() {
    assert_snapshot!(check("part_radius_mm = 30.0", "part_radius_mm = -30.0"));
}

#[test]
fn sensors_of_one_section_apart() {
    assert_snapshot!(check(
        "z_mm = 200, section = \"a\" },\n  { id = \"S3\"",
        "z_mm = 210, section = \"a\" },\n  { id = \"S3\""
    ));
}

#[test]
fn no_toml() {
    assert_snapshot!(check("plugin = \"hdf5\"", "plugin = hdf5"));
}

#[test]
fn turns_never_averaged() {
    assert_snapshot!(check("[[preprocess]]\nplugin = \"synchronous-average\"\nsamples_per_rev = 128\n", ""));
}

#[test]
fn empty_file() {
    assert_snapshot!(Folder::with(&[("pipeline.toml", "")]).run(&["check", "pipeline.toml"]).shown());
}

#[test]
fn missing_pipeline() {
    assert_snapshot!(Folder::with(&[]).run(&["check", "pipeline.toml"]).shown());
}

#[test]
fn fault_in_a_rig_file() {
    let text = format!("rig = \"rig.toml\"\n{STAGES}");
    let rig = RIG.replace("angle_deg = 90, z_mm = 230", "angle = 90, z_mm = 230");
    let folder = Folder::with(&[("pipeline.toml", &text), ("rig.toml", &rig)]);
    assert_snapshot!(folder.run(&["check", "pipeline.toml"]).shown());
}

#[test]
fn missing_rig_file() {
    let text = format!("rig = \"rig.toml\"\n{STAGES}");
    assert_snapshot!(Folder::with(&[("pipeline.toml", &text)]).run(&["check", "pipeline.toml"]).shown());
}

#[test]
fn set_to_an_unknown_plugin() {
    assert_snapshot!(check_with(&["--set", "separate.plugin=four-sensor"]));
}

#[test]
fn set_without_a_value() {
    assert_snapshot!(check_with(&["--set", "separate.plugin"]));
}

#[test]
fn set_to_nothing() {
    let said = check_with(&["--set", "title="]);
    assert!(said.contains("expected KEY=VALUE") && said.contains("--set title='\"\"'"), "{said}");
}

#[test]
fn set_beyond_the_last_stage() {
    assert_snapshot!(check_with(&["--set", "preprocess.7.samples_per_rev=64"]));
}

#[test]
fn set_an_unknown_key() {
    assert_snapshot!(check_with(&["--set", "load.file=other.h5"]));
}

#[test]
fn set_below_a_value() {
    assert_snapshot!(check_with(&["--set", "title.text=other"]));
}

#[test]
fn json_error_has_its_place() {
    assert_snapshot!(check_with(&["--json", "--set", "rig.part_radius_mm=0"]));
}

#[test]
fn json_error_of_the_command_line() {
    assert_snapshot!(Folder::with(&[]).run(&["run", "--json"]).shown());
}

#[test]
fn missing_measurement() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline())]);
    assert_snapshot!(folder.run(&["run", "pipeline.toml"]).shown());
    assert!(!folder.path().join("out").exists(), "a failed run leaves no output");
}

#[test]
fn measurement_that_is_none() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline()), ("shaft.h5", "not HDF5")]);
    assert_snapshot!(folder.run(&["run", "pipeline.toml"]).shown());
}

#[test]
fn json_error_of_the_work() {
    let folder = Folder::with(&[("pipeline.toml", &pipeline())]);
    assert_snapshot!(folder.run(&["run", "pipeline.toml", "--json"]).shown());
}

#[test]
fn scenario_without_output() {
    let text = format!("plugin = \"spindle\"\n\n[rig]\n{RIG}");
    assert_snapshot!(Folder::with(&[("scenario.toml", &text)]).run(&["simulate", "scenario.toml"]).shown());
}

#[test]
fn scenario_with_an_unknown_key() {
    let text = format!("plugin = \"spindle\"\noutput = \"shaft.h5\"\nsede = 4\n\n[rig]\n{RIG}");
    assert_snapshot!(Folder::with(&[("scenario.toml", &text)]).run(&["simulate", "scenario.toml"]).shown());
}

/// An effect's keys are known once its plugin is: the mistake is shown at the key all the same.
#[test]
fn scenario_with_a_mistake_in_an_effect() {
    let scenario = |effects: &str| {
        let text = format!("plugin = \"spindle\"\noutput = \"shaft.h5\"\n\n[rig]\n{RIG}\n{effects}");
        Folder::with(&[("scenario.toml", &text)]).run(&["simulate", "scenario.toml"])
    };
    let creep = "[[effect]]\nplugin = \"thermal-drift\"\ntargets = [\"S1\"]\nweight_kg = 1.0\nrate_um_per_rev = 0.1\n";
    let gain = "[[effect]]\nplugin = \"sensor-gain\"\ntargets = [\"S1\"]\n";
    assert_snapshot!(scenario(&format!("{gain}relative_gain = 0.1\nrelativ_gain = 0.05\n")).shown());
    for (effects, line, words) in [
        (format!("{gain}relative_gain = 0.1\n\n{gain}gain = 0.05\n"), 25, "unknown key `gain`"),
        (format!("{gain}relative_gain = \"much\"\n"), 20, "expected a number, found string \"much\""),
        (format!("{}relative_gain = 0.1\n", gain.replace("sensor-gain", "sensor-gian")), 18, "`sensor-gian`"),
        (creep.to_owned(), 20, "unknown key `weight_kg`"),
    ] {
        let ran = scenario(&effects);
        assert_eq!(ran.status, 2, "{}", ran.stdout);
        assert!(ran.stderr.contains(words), "{words}: {}", ran.stderr);
        assert!(ran.stderr.contains(&format!("scenario.toml:{line}:")), "{line}: {}", ran.stderr);
    }
}

#[test]
fn inspect_what_is_no_data() {
    assert_snapshot!(Folder::with(&[("notes.txt", "Hello")]).run(&["inspect", "notes.txt"]).shown());
}

#[test]
fn unknown_name_of_a_plugin() {
    assert_snapshot!(Folder::with(&[]).run(&["plugins", "low-pas"]).shown());
}

#[test]
fn ambiguous_name_of_a_schema() {
    assert_snapshot!(Folder::with(&[]).run(&["schema", "hdf5"]).shown());
}

/// `runout plan rig.toml` with more arguments.
fn plan_with(arguments: &[&str]) -> String {
    Folder::with(&[("rig.toml", RIG)]).run(&[&["plan", "rig.toml"], arguments].concat()).shown()
}

#[test]
fn plan_of_a_range_with_a_hyphen() {
    assert_snapshot!(plan_with(&["--orders", "2-80"]));
}

#[test]
fn plan_of_an_empty_range() {
    assert_snapshot!(plan_with(&["--orders", "80..2"]));
}

#[test]
fn plan_with_too_much_clearance() {
    assert_snapshot!(plan_with(&["--optimise", "angles", "--clearance", "181deg"]));
    assert_snapshot!(plan_with(&[
        "--optimise",
        "angles",
        "--set",
        "sensors.2.section=a",
        "--set",
        "sensors.2.z_mm=200",
        "--clearance",
        "150deg"
    ]));
}

#[test]
fn plan_with_a_tolerance_that_leaves_the_highest_order_open() {
    let arguments = ["--orders", "2..50", "--optimise", "angles", "--angle-tolerance", "1deg"];
    let shown = plan_with(&arguments);
    assert!(shown.contains("an angle tolerance of 1° turns order 50 by 50°, more than 45°"), "{shown}");
    assert!(shown.contains("lower --angle-tolerance to 0.90deg"), "{shown}");
}

#[test]
fn plan_of_a_clearance_in_radians() {
    assert_snapshot!(plan_with(&["--clearance", "0.3rad"]));
}

#[test]
fn plan_with_a_map_that_is_no_table() {
    assert_snapshot!(plan_with(&["--map", "map.png"]));
}

#[test]
fn plan_of_a_pipeline() {
    assert_snapshot!(Folder::with(&[("pipeline.toml", &pipeline())]).run(&["plan", "pipeline.toml"]).shown());
}

#[test]
fn plan_with_a_fault_in_the_rig() {
    assert_snapshot!(plan_with(&["--set", "sensors.1.angle=3"]));
}

//! What `runout diagnose` writes and prints: beside the run's files, with the effects in it, in the rig's units.

use std::fs;

use serde_json::{Value, json};

use crate::folder::Folder;

/// Example 6: in setup `b` the part went back 0.34° off; simulated.
pub(crate) const SCENARIO: &str = include_str!("../../../examples/06-closed-loop/scenario.toml");
pub(crate) const PIPELINE: &str = include_str!("../../../examples/06-closed-loop/pipeline.toml");
const MORE_EXPORTS: &str = r#"
[[export]]
plugin = "hdf5"
path = "result.h5"
[[export]]
plugin = "obj"
path = "mesh/shaft.obj"
"#;

fn campaign(more: &str) -> Folder {
    let folder = Folder::with(&[("scenario.toml", SCENARIO), ("pipeline.toml", &(PIPELINE.to_owned() + more))]);
    let ran = folder.run(&["simulate", "scenario.toml", "--out", "campaign.h5"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    folder
}

pub(crate) fn document(folder: &Folder, arguments: &[&str]) -> Value {
    let ran = folder.run(&[arguments, &["--json"]].concat());
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{arguments:?}");
    serde_json::from_str(&ran.stdout).unwrap()
}

fn written(folder: &Folder, path: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path().join(path)).unwrap()).unwrap()
}

pub(crate) fn value<'a>(section: &'a Value, symbol: &str) -> &'a Value {
    section["values"].as_array().unwrap().iter().find(|value| value["symbol"] == symbol).unwrap()
}

/// The values that a diagnosis prints are those that run and the exports have, to the last digit.
#[test]
fn a_value_is_one_number_wherever_it_stands() {
    let folder = campaign("");
    let run = document(&folder, &["run", "pipeline.toml"]);
    let diagnosis = document(&folder, &["diagnose", "pipeline.toml"]);
    let summary = written(&folder, "out/diagnosed/summary.json");
    let motion = summary["stations"][0]["motion_values"].as_array().unwrap();
    assert!(
        motion.iter().any(|value| value["symbol"] == "asynchronous-radial-x"),
        "error motion values as after a run: {motion:?}"
    );
    for (index, section) in ["a", "b"].into_iter().enumerate() {
        let [before, after] = [&run, &summary].map(|summary| &summary["stations"][0]["sections"][index]);
        let moved = |name: &str| {
            let all = diagnosis["moved"].as_array().unwrap().iter();
            all.clone().find(|moved| moved["value"] == name && moved["section"] == section).unwrap()
        };
        let (ront, rms) = (moved("RONt"), moved("form rms"));
        assert_eq!(ront["before"], value(before, "RONt")["value"]);
        assert_eq!(ront["after"], value(after, "RONt")["value"]);
        assert_eq!(ront["std"], value(after, "RONt")["uncertainty"]["std"]);
        assert_eq!((&ront["reference"], &ront["filter"]), (&json!("LSCI"), &json!("none")));
        assert_eq!((&rms["before"], &rms["after"]), (&before["form_rms_um"], &after["form_rms_um"]));
    }
    assert_ne!(diagnosis["moved"][0]["before"], diagnosis["moved"][0]["after"]);
    let error = |summary: &Value| summary["stations"][0]["sections"][0]["truth_form_rms_error_um"].as_f64().unwrap();
    assert!(error(&summary) < 0.2 * error(&run));
}

/// Corrected results lie below `diagnosed/`, name their effects, and leave those of the run as they are.
#[test]
fn corrected_results_are_recognisable() {
    let folder = campaign(MORE_EXPORTS);
    let run = document(&folder, &["run", "pipeline.toml"]);
    assert_eq!(run["effects"], json!([]));
    let files = ["out/form.parquet", "out/summary.json", "result.h5", "mesh/shaft.obj"];
    let read = |path: &str| fs::read(folder.path().join(path)).unwrap();
    let before = files.map(read);
    let diagnosis = document(&folder, &["diagnose", "pipeline.toml"]);
    assert_eq!(files.map(read), before, "those of the run");
    let mut outputs: Vec<&str> =
        diagnosis["outputs"].as_array().unwrap().iter().map(|path| path.as_str().unwrap()).collect();
    outputs.sort_unstable();
    let names = [
        "circles.parquet",
        "consistency.parquet",
        "corrections.parquet",
        "diagnosis.json",
        "form.parquet",
        "harmonics.parquet",
        "motion.parquet",
        "report.html",
        "residual_harmonics.parquet",
        "spectrum.parquet",
        "summary.json",
        "tilt_spectrum.parquet",
        "tilt_turns.parquet",
        "turns.parquet",
        "values.parquet",
    ];
    let mut expected: Vec<String> = names.map(|name| format!("out/diagnosed/{name}")).into();
    expected.extend(["diagnosed/result.h5".into(), "mesh/diagnosed/shaft.obj".into()]);
    expected.sort_unstable();
    assert_eq!(outputs, expected);
    assert!(outputs.iter().all(|path| folder.path().join(path).is_file()));

    let summary = written(&folder, "out/diagnosed/summary.json");
    let [effect] = &summary["effects"].as_array().unwrap()[..] else { panic!("{}", summary["effects"]) };
    assert_eq!((&effect["effect"], &effect["targets"]), (&json!("reversal-angle"), &json!(["b"])));
    let parameter = &effect["parameters"][0];
    assert_eq!((&parameter["name"], &parameter["unit"]), (&json!("angle"), &json!("deg")));
    assert!((parameter["value"].as_f64().unwrap() - 0.34).abs() < 0.003, "{parameter}");
    assert_eq!(written(&folder, "out/diagnosed/diagnosis.json"), diagnosis);
    let table = document(&folder, &["inspect", "out/diagnosed/form.parquet"]).to_string();
    assert!(table.contains("runout.effects") && table.contains("reversal-angle"), "{table}");
    let mesh = String::from_utf8(read("mesh/diagnosed/shaft.obj")).unwrap();
    assert!(
        mesh.lines().any(|line| line.starts_with("# corrected_for: reversal-angle b: angle 0.3")),
        "{}",
        &mesh[..900]
    );
    let shown = folder.run(&["diagnose", "pipeline.toml", "--verbose"]);
    for word in ["Written", "out/diagnosed/form.parquet", "setups.1.part_deg = 100.18", "RONt LSCI, unfiltered µm", "°"]
    {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }
}

/// `[diagnose] out` takes all files; two of one name are refused.
#[test]
fn the_folder_can_be_chosen() {
    let folder = campaign(MORE_EXPORTS);
    let set = ["diagnose", "pipeline.toml", "--set", "diagnose.out=corrected", "--set", "diagnose.path=said.json"];
    let diagnosis = document(&folder, &set);
    let outputs = diagnosis["outputs"].as_array().unwrap();
    for path in ["corrected/form.parquet", "corrected/result.h5", "corrected/shaft.obj", "said.json"] {
        assert!(outputs.contains(&json!(path)) && folder.path().join(path).is_file(), "{path}: {outputs:?}");
    }
    let twice = folder.run(&["check", "pipeline.toml", "--set", "diagnose.out=mesh"]);
    assert!(twice.status == 2 && twice.stderr.contains("mesh/shaft.obj is already"), "{}", twice.stderr);
}

/// A diagnosis does not stay beside results that it is not of; what only has its name does.
#[test]
fn an_outdated_diagnosis_goes() {
    let folder = campaign("");
    document(&folder, &["diagnose", "pipeline.toml"]);
    let earlier = folder.path().join("out/diagnosis.json");
    fs::copy(folder.path().join("out/diagnosed/diagnosis.json"), &earlier).unwrap();
    document(&folder, &["run", "pipeline.toml"]);
    assert!(!earlier.exists(), "an earlier version's");
    assert!(folder.path().join("out/diagnosed/diagnosis.json").exists(), "its results lie beside it");
    let beside = ["--set", "diagnose.path=out/mine.json"];
    document(&folder, &[&["diagnose", "pipeline.toml"], &beside[..]].concat());
    assert!(folder.path().join("out/mine.json").exists());
    document(&folder, &[&["run", "pipeline.toml"], &beside[..]].concat());
    assert!(!folder.path().join("out/mine.json").exists());
    fs::write(&earlier, "{ \"verdict\": \"guilty\" }").unwrap();
    document(&folder, &["run", "pipeline.toml"]);
    assert!(earlier.exists(), "no diagnosis");
}

/// `run` with the rig that a diagnosis writes gives the diagnosed form and motion.
#[test]
fn a_run_takes_the_corrected_rig() {
    let gain = r#"effect=[{plugin="sensor-gain",targets=["S2"],relative_gain=0.02}]"#;
    let bent = r#"effect=[{plugin="sensor-nonlinearity",targets=["S3"],quadratic_per_um=0.002}]"#;
    let angle = r#"effect=[{plugin="reversal-angle",targets=["b"],angle_deg=0.34}]"#;
    // A third sensor a section distinguishes gains.
    let more =
        r#"rig.sensors=[{id="S1",angle_deg=0,z_mm=100,section="a"},{id="S2",angle_deg=99.844,z_mm=100,section="a"},
        {id="S5",angle_deg=202.5,z_mm=100,section="a"},{id="S3",angle_deg=0,z_mm=130,section="b"},
        {id="S4",angle_deg=99.844,z_mm=130,section="b"},{id="S6",angle_deg=202.5,z_mm=130,section="b"}]"#
            .replace('\n', " ");
    for (effect, key) in [(angle, "part_deg"), (gain, "gain"), (bent, "quadratic_per_um")] {
        let folder = Folder::with(&[("scenario.toml", SCENARIO), ("pipeline.toml", PIPELINE)]);
        let made = folder.run(&["simulate", "scenario.toml", "--out", "campaign.h5", "--set", effect, "--set", &more]);
        assert_eq!(made.status, 0, "{}", made.stderr);
        let diagnosis = document(&folder, &["diagnose", "pipeline.toml", "--set", &more, "--write", "corrected.toml"]);
        let added = diagnosis["added"].as_array().unwrap();
        assert_eq!(added.len(), 1, "{added:?}");
        assert!(added[0]["change"].as_str().unwrap().contains(key), "{}", added[0]);
        assert!(diagnosis["outputs"].as_array().unwrap().contains(&json!("corrected.toml")));
        let run = document(&folder, &["run", "pipeline.toml", "--set", "rig=corrected.toml"]);
        let diagnosed = written(&folder, "out/diagnosed/summary.json");
        let sections = |summary: &Value| summary["stations"][0]["sections"].as_array().unwrap().clone();
        for (run, diagnosed) in sections(&run).iter().zip(&sections(&diagnosed)) {
            let [run_um, diagnosed_um] =
                [run, diagnosed].map(|section| value(section, "RONt")["value"].as_f64().unwrap());
            let std_um = value(diagnosed, "RONt")["uncertainty"]["std"].as_f64().unwrap();
            println!("simulated, {key}: RONt {run_um} with the rig, {diagnosed_um} µm diagnosed, ± {std_um}");
            // A tenth of its standard uncertainty: a sample is calibrated, not the average of its turns.
            assert!((run_um - diagnosed_um).abs() < 0.1 * std_um, "{key}: {run_um} and {diagnosed_um} ± {std_um}");
            let error = |section: &Value| section["truth_form_rms_error_um"].as_f64().unwrap();
            assert!((error(run) - error(diagnosed)).abs() < 1e-4, "{key}: {} and {}", error(run), error(diagnosed));
        }
        let chi2 = run["stations"][0]["chi2_per_dof"].as_f64().unwrap();
        assert!(chi2 < 1.5, "{key}: {chi2}");
    }
}

/// Of two sensors that the data do not distinguish, none is written as if it were known.
#[test]
fn a_confounded_set_changes_no_rig() {
    let folder = Folder::with(&[("scenario.toml", SCENARIO), ("pipeline.toml", PIPELINE)]);
    let gain = r#"effect=[{plugin="sensor-gain",targets=["S4"],relative_gain=-0.02}]"#;
    assert_eq!(folder.run(&["simulate", "scenario.toml", "--out", "campaign.h5", "--set", gain]).status, 0);
    let diagnosis = document(&folder, &["diagnose", "pipeline.toml", "--write", "corrected.toml"]);
    assert!(!diagnosis["added"][0]["confounded_with"].as_array().unwrap().is_empty());
    assert_eq!(diagnosis["added"][0]["change"], Value::Null);
    let rig = fs::read_to_string(folder.path().join("corrected.toml")).unwrap();
    assert!(!rig.lines().any(|line| line.starts_with("gain")), "{rig}");
    let said = diagnosis["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .any(|said| said.as_str().unwrap().contains("corrected.toml does not declare"));
    assert!(said, "{}", diagnosis["warnings"]);
}

#[test]
fn the_corrected_rig_replaces_nothing_that_is_read() {
    let folder = campaign("");
    for (path, words) in [
        ("pipeline.toml", "read as configuration"),
        ("out/diagnosed/form.parquet", "written by an exporter"),
        ("campaign.h5", "the corrected rig is a TOML file"),
        ("corrected", "the corrected rig is a TOML file"),
    ] {
        let ran = folder.run(&["diagnose", "pipeline.toml", "--write", path]);
        assert!(ran.status == 2 && ran.stderr.contains(words), "{path}: {}", ran.stderr);
    }
}

/// Effects of known size, in the rig's units: what is declared is corrected, named, and not looked for.
#[test]
fn a_known_effect_is_in_the_units_of_the_rig() {
    let folder = campaign("");
    let known = r#"diagnose.known=[{effect="reversal-angle",target="b",values={angle=0.34}}]"#;
    let diagnosis = document(&folder, &["diagnose", "pipeline.toml", "--set", known]);
    assert_eq!((&diagnosis["verdict"], &diagnosis["added"]), (&json!("at-noise-floor"), &json!([])));
    let summary = written(&folder, "out/diagnosed/summary.json");
    assert_eq!(
        (&summary["effects"][0]["effect"], &summary["effects"][0]["known"]),
        (&json!("reversal-angle"), &json!(true))
    );
}

//! `runout new`: a pipeline for each method, which `check` accepts, and for a file that it reads.

use std::{fs, path::Path};

use runout_cli::builtin;

use crate::folder::Folder;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn with_file(file: &str) -> (Folder, String) {
    let folder = Folder::with(&[]);
    let name = Path::new(file).file_name().unwrap().to_str().unwrap().to_owned();
    fs::copy(Path::new(ROOT).join(file), folder.path().join(&name)).unwrap();
    (folder, name)
}

#[test]
fn check_accepts_the_pipeline_of_every_method() {
    let folder = Folder::with(&[]);
    for separator in builtin::registry().separators.iter() {
        let made = folder.run(&["new", separator.name]);
        assert!(made.status == 0 && made.stdout.contains("runout check"), "{}: {}", separator.name, made.stderr);
        let checked = folder.run(&["check", &format!("{}.toml", separator.name)]);
        assert_eq!(checked.status, 0, "{}: {}", separator.name, checked.stderr);
    }
}

#[test]
fn nothing_is_written_over_unless_that_is_asked_for() {
    let folder = Folder::with(&[("three-point.toml", "mine"), ("other.toml", "mine")]);
    let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    for words in [&["new", "three-point"][..], &["new", "multi-step", "--out", "other.toml"]] {
        let refused = folder.run(words);
        assert!(refused.status == 2 && refused.stderr.contains("is there already"), "{}", refused.stderr);
    }
    assert_eq!([text("three-point.toml"), text("other.toml")], ["mine", "mine"]);
    let made = folder.run(&["new", "three-point", "--overwrite", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&made.stdout).unwrap();
    assert_eq!((made.status, &report["pipeline"]), (0, &"three-point.toml".into()));
    assert!(text("three-point.toml").contains("plugin = \"three-point\""));
}

#[test]
fn a_method_with_a_typing_mistake_is_suggested() {
    let folder = Folder::with(&[]);
    let refused = folder.run(&["new", "three-points"]);
    assert!(refused.status == 2 && refused.stderr.contains("did you mean `three-point`?"), "{}", refused.stderr);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The channels of the file are those of the rig's sensors, in a folder of its own too, and the run reads them.
#[test]
fn a_recording_of_channels_is_read_by_the_pipeline_that_is_made_for_it() {
    for file in ["campaign.tdms", "campaign.mat", "campaign.csv", "campaign.uff"] {
        let (folder, name) = with_file(&format!("formats/channels/tests/assets/campaign/{file}"));
        let made = folder.run(&["new", "three-point", &name, "--out", "made/pipeline.toml"]);
        assert_eq!(made.status, 0, "{file}: {}", made.stderr);
        let text = fs::read_to_string(folder.path().join("made/pipeline.toml")).unwrap();
        assert!(text.contains("channels = { S1 = \"A\", S2 = \"B\", S3 = \"C\" }"), "{file}: {text}");
        let checked = folder.run(&["check", "made/pipeline.toml"]);
        assert_eq!(checked.status, 0, "{file}: {}", checked.stderr);
        let ran = folder.run(&["run", "made/pipeline.toml", "--set", "preprocess.1.samples_per_rev=32"]);
        assert!(ran.status == 0 && ran.stdout.contains("RONt"), "{file}: {}{text}", ran.stderr);
    }
    // A rig with fewer sensors than the file has channels, and with more setups.
    let (folder, name) = with_file("formats/channels/tests/assets/campaign/campaign.tdms");
    let made = folder.run(&["new", "donaldson-reversal", &name]);
    assert_eq!(made.status, 0, "{}", made.stderr);
    let text = fs::read_to_string(folder.path().join("donaldson-reversal.toml")).unwrap();
    assert!(text.contains("channels = { S1 = \"A\" }") && text.contains("does not have: \"B\", \"C\""), "{text}");
    assert!(text.contains("with a file for each setup"), "{text}");
    // The file holds one setup: the pipeline is valid, and the data do not fit it yet.
    let checked = folder.run(&["check", "donaldson-reversal.toml"]);
    assert!(checked.status == 1 && checked.stdout.contains("The configuration is valid."), "{}", checked.shown());
    assert!(checked.stdout.contains("! The data cannot be used"), "{}", checked.shown());
}

#[test]
fn maps_and_points_are_read_by_their_loaders() {
    let (folder, name) = with_file("examples/23-measured-surface/ground.x3p");
    assert_eq!(folder.run(&["new", "as-measured", &name]).status, 0);
    let ran = folder.run(&["run", "as-measured.toml"]);
    assert!(ran.status == 0 && ran.stdout.contains("Sa"), "{}", ran.stderr);
    let refused = folder.run(&["new", "three-point", &name]);
    assert!(refused.status == 1 && refused.stderr.contains("no recording"), "{}", refused.stderr);
    let (folder, name) = with_file("examples/04-straightness-reversal/traces.csv");
    assert_eq!(folder.run(&["new", "axial-reversal", &name]).status, 0);
    assert_eq!(folder.run(&["run", "axial-reversal.toml"]).status, 0);
    let refused = folder.run(&["new", "fly-cutting", &name]);
    assert!(refused.status == 1 && refused.stderr.contains("no height map"), "{}", refused.stderr);
    // Points as measured are those of circles, or of a profile.
    for (head, object) in [("angle_deg,radius_mm", "cylinder"), ("x_mm,height_nm", "profile")] {
        fs::write(folder.path().join("points.csv"), format!("{head}\n0,1\n1,2\n")).unwrap();
        assert_eq!(folder.run(&["new", "as-measured", "points.csv", "--overwrite"]).status, 0);
        let text = fs::read_to_string(folder.path().join("as-measured.toml")).unwrap();
        assert!(text.contains(&format!("object = \"{object}\"")) && !text.contains("form ="), "{text}");
    }
    let missing = folder.run(&["new", "axial-reversal", "there-is-none.csv", "--out", "x.toml"]);
    assert!(missing.status == 1 && missing.stderr.contains("no such file"), "{}", missing.stderr);
}

/// Each example that the program holds runs in a folder of its own.
#[test]
fn examples_that_the_program_holds_run() {
    let folder = Folder::with(&[]);
    let listed = folder.run(&["example", "--json"]);
    let listed: serde_json::Value = serde_json::from_str(&listed.stdout).unwrap();
    let names: Vec<&str> = listed["examples"].as_array().unwrap().iter().map(|one| one[0].as_str().unwrap()).collect();
    assert_eq!(names, ["three-point", "r-test", "touch-probe", "spatial-error"]);
    for name in names {
        let written = folder.run(&["example", name]);
        assert_eq!(written.status, 0, "{}", written.stderr);
        let run = folder.run(&["run", &format!("{name}/pipeline.toml")]);
        assert_eq!(run.status, 0, "{name}: {}", run.stderr);
        assert!(run.stdout.contains("Key values"), "{name}: {}", run.stdout);
    }
    let again = folder.run(&["example", "r-test"]);
    assert!(again.status == 2 && again.stderr.contains("is there already"), "{}", again.stderr);
    let unknown = folder.run(&["example", "threepoint"]);
    assert!(unknown.status == 2 && unknown.stderr.contains("did you mean `three-point`"), "{}", unknown.stderr);
}

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
    // The eccentricity is larger than the part; and without exact geometry, its form is no smaller.
    for (second_order, radius_mm, said) in
        [(true, 1e-3, "more than exact geometry is solved for"), (false, 1e-6, "mm rms on 0.000001 mm radius")]
    {
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
    assert!(said.contains("interrupted: unfinished output files were removed"), "{said}");
    assert!(!out.exists());
}

/// A separator that is a program ends with the run, and so does what it has started.
#[test]
#[cfg(target_os = "linux")]
fn an_interrupted_run_ends_its_programs() {
    use std::{
        process::{Command, Stdio},
        time::Duration,
    };

    let program = "plugin = \"external\"\ncommand = [\"sh\", \"-c\", \"sleep 600 & echo $$ $! > pids; wait\"]";
    let folder = campaign(&pipeline().replace("plugin = \"four-sensor-reversal\"", program));
    let pids = || fs::read_to_string(folder.path().join("pids")).unwrap_or_default();
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("runout"));
    let command = command.current_dir(folder.path()).args(["run", "pipeline.toml"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !pids().ends_with('\n') && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    let runs = |pid: &str| {
        let state = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        // A process that has ended is a name until somebody asks for its status.
        !state.is_empty() && !state.contains(") Z ")
    };
    for _ in 0..500 {
        if !pids().split_whitespace().any(runs) {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(pids().split_whitespace().count(), 2);
    assert!(!pids().split_whitespace().any(runs), "{}", pids());
    assert!(!folder.path().join("out").exists());
}

/// Every file below a folder, with its contents.
fn contents(folder: &std::path::Path) -> std::collections::BTreeMap<std::path::PathBuf, Vec<u8>> {
    let mut found = std::collections::BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            found.extend(contents(&entry.path()));
        } else {
            found.insert(entry.path(), fs::read(entry.path()).unwrap());
        }
    }
    found
}

#[test]
fn equal_runs_give_equal_files() {
    let text = pipeline() + "\n[[export]]\nplugin = \"hdf5\"\npath = \"out/result.h5\"\n\n[surface]\n";
    let folder = campaign(&text);
    let run = || {
        assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
        assert_eq!(folder.run(&["simulate", "scenario.toml", "--out", "out/again.h5"]).status, 0);
        contents(&folder.path().join("out"))
    };
    let first = run();
    // Times in HDF5 are whole seconds.
    std::thread::sleep(std::time::Duration::from_millis(1100));
    let second = run();
    let other: Vec<_> =
        first.iter().filter(|(path, bytes)| second.get(*path) != Some(bytes)).map(|(path, _)| path).collect();
    assert!(other.is_empty() && first.len() == second.len(), "{other:?}");
}

/// After a kill at any step, the next run succeeds and leaves nothing else; until it, what is there is old or new as a whole, or a journal
/// says that it is neither. A step that fails undoes those before it.
#[test]
#[cfg(target_os = "linux")]
fn a_kill_at_any_step_leaves_old_or_new_results() {
    // Values would take two thirds of the time of each of some hundred runs, and none of their steps.
    let evaluate = "\n[evaluate]\nvalues = []\n";
    let text = pipeline() + evaluate + "\n[[export]]\nplugin = \"hdf5\"\npath = \"elsewhere/result.h5\"\n";
    let folder = campaign(&text);
    let results = || -> std::collections::BTreeMap<_, _> {
        ["out", "elsewhere"].iter().flat_map(|name| contents(&folder.path().join(name))).collect()
    };
    let shown = |files: &std::collections::BTreeMap<std::path::PathBuf, Vec<u8>>| {
        files
            .iter()
            .filter(|(path, _)| !path.file_name().unwrap().to_string_lossy().starts_with('.'))
            .map(|(path, bytes)| (path.clone(), bytes.clone()))
            .collect::<std::collections::BTreeMap<_, _>>()
    };
    let run = |title: &str, fault: Option<String>| {
        let mut command = assert_cmd::cargo::cargo_bin_cmd!("runout");
        command.current_dir(folder.path()).args(["run", "pipeline.toml", "--set", &format!("title={title}")]);
        command.envs(fault.map(|fault| ("RUNOUT_TEST_FAULT", fault))).output().unwrap().status.code()
    };
    let whole = |title: &str| {
        assert_eq!(run(title, None), Some(0));
        results()
    };
    let (new, old) = (whole("new"), whole("old"));
    assert!(new.len() > 4 && new.keys().eq(old.keys()));
    for kind in ["kill", "fail"] {
        let mut interrupted = 0;
        // Kills at every step; failures, which undo renames, at some.
        for step in (1..).step_by(if kind == "kill" { 1 } else { 3 }) {
            assert!(step < 200, "the steps do not end");
            let code = run("new", Some(format!("{kind}:{step}")));
            let left = results();
            let journal = left.keys().any(|path| path.extension().is_some_and(|extension| extension == "journal"));
            let state = shown(&left);
            if code == Some(0) && kind == "kill" {
                break;
            }
            if kind == "fail" && code == Some(0) {
                // A step that only cleans up, or none.
                assert!(state == new, "{kind}:{step}");
                if left == new {
                    break;
                }
            } else {
                interrupted += usize::from(state != old && state != new);
                assert!(
                    state == old || state == new || (journal && kind == "kill"),
                    "{kind}:{step}: {:?}",
                    state.keys()
                );
            }
            if journal && kind == "kill" {
                // A command that reads results completes them first.
                let inspected = folder.run(&["inspect", "elsewhere/result.h5"]);
                assert!(inspected.status == 0, "{kind}:{step}: {}", inspected.stderr);
                let read = shown(&results());
                // Before the last journal is there, all are old.
                let whole = read == new || (state == old && read == old);
                assert!(whole, "{kind}:{step}: a reader saw {:?}", read.keys());
            }
            assert!(whole("old") == old, "{kind}:{step}: the next run leaves other files");
        }
        assert!(interrupted <= new.len(), "{kind}: {interrupted}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_read_may_not_change_meanwhile() {
    use std::time::Duration;
    let folder = campaign(&pipeline());
    assert_eq!(folder.run(&["run", "pipeline.toml"]).status, 0);
    let before = contents(&folder.path().join("out"));
    // A pipeline that takes long enough, and a recording that comes in the place of the one that is read.
    let long = ["recording.stations={ first_z_mm = 0, step_mm = 0.01, count = 60 }", "output=long.h5"];
    assert_eq!(folder.run(&["simulate", "scenario.toml", "--set", long[0], "--set", long[1]]).status, 0);
    fs::copy(folder.path().join("long.h5"), folder.path().join("other.h5")).unwrap();
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("runout"));
    command.current_dir(folder.path()).args(["run", "pipeline.toml", "--set", "load.path=long.h5"]);
    let child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let locked = folder.path().join("out/.runout.lock");
    while !locked.exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let second = folder.run(&["run", "pipeline.toml"]);
    assert!(second.status == 1 && second.stderr.contains(&format!("process {}", child.id())), "{}", second.stderr);
    fs::rename(folder.path().join("other.h5"), folder.path().join("long.h5")).unwrap();
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("another file took its place"), "{said}");
    assert!(contents(&folder.path().join("out")) == before);
}

#[test]
fn what_a_file_or_a_key_says_harms_neither_program_nor_terminal() {
    let folder = campaign(&pipeline());
    let deep = format!("{}=1", vec!["a"; 30_000].join("."));
    let long = format!("title = \"{}\"\nx = 1", "x".repeat(70_000));
    let escapes = pipeline().replace("Turned shaft", "\\u001b[2J\\u202eshaft");
    let dotted = format!("{}\n{deep}\n", pipeline());
    for (name, text) in [("long.toml", &long), ("escapes.toml", &escapes), ("deep.toml", &dotted)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    fs::write(folder.path().join("column.toml"), format!("rig = {{ {}x = [}}", " ".repeat(70_000))).unwrap();
    for (arguments, status) in [
        (&["check", "pipeline.toml", "--json", "--set", &deep][..], 2),
        (&["check", "deep.toml", "--json"], 2),
        (&["check", "long.toml", "--json"], 2),
        (&["check", "column.toml", "--json"], 2),
        (&["check", "pipeline.toml", "--json", "--set", "title=\"a\\u0000b\""], 2),
        (&["run", "escapes.toml"], 0),
        (&["run", "escapes.toml", "--json"], 0),
    ] {
        let ran = folder.run(arguments);
        let named = arguments[..2].join(" ");
        assert_eq!(ran.status, status, "{named}: {}", ran.stderr);
        assert!(
            !ran.stdout.contains(['\u{1b}', '\u{202e}']) && !ran.stderr.contains(['\u{1b}', '\u{202e}']),
            "{named}"
        );
        assert!(!arguments.contains(&"--json") || serde_json::from_str::<Value>(&ran.stdout).is_ok(), "{named}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_no_file_is_refused_at_once() {
    let folder = campaign(&pipeline());
    assert!(std::process::Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    for path in ["pipe", "/dev/zero", "."] {
        for arguments in [
            &["inspect", path][..],
            &["check", path],
            &["run", "pipeline.toml", "--set", &format!("load.path=\"{path}\"")],
        ] {
            let ran = folder.run(arguments);
            assert!(
                ran.status != 0 && ran.stderr.contains("expected a file, found a"),
                "{arguments:?}: {}",
                ran.stderr
            );
        }
    }
    for angle in ["1e308", "-1e308", "nan"] {
        let ran = folder.run(&["run", "pipeline.toml", "--set", &format!("rig.sensors.0.angle_deg={angle}")]);
        assert!(ran.status != 101 && ran.status != 0, "{angle}: {}", ran.stdout);
    }
}

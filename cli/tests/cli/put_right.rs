//! Mistakes of a recording that `runout diagnose` puts right before the closed loop: marks that do not count the part's turns, exchanged stations.

use serde_json::{Value, json};

use crate::{
    diagnosed::{PIPELINE, SCENARIO, document, value},
    folder::Folder,
    trials::{fewest, is_full},
};

/// Example 6 with an effect in place of its own, 50 turns.
fn campaign(seed: u64, effect: &str) -> Folder {
    let sound = SCENARIO.split("[[effect]]").next().unwrap();
    let seeded = sound.replace("seed = ", &format!("seed = {seed}"));
    let scenario = seeded + "[recording]\nrevolutions = 50\n" + effect;
    let folder = Folder::with(&[("scenario.toml", &scenario), ("pipeline.toml", PIPELINE)]);
    let simulated = folder.run(&["simulate", "scenario.toml", "--out", "campaign.h5"]);
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    folder
}

fn form_error(diagnosis: &Value) -> f64 {
    diagnosis["truth"]["form_rms_error_um"]["after"].as_f64().unwrap()
}

/// A mark on another shaft, by a thousandth of a degree to a tenth of a turn, and samples that are lost, in one setup or in all: found with their
/// size, and the form is that of the same campaign without them. In a usual run the smallest and the largest of each, in one setup and in all.
#[test]
fn marks_that_do_not_count_the_turns_are_put_right() {
    let run = |targets: &str, deg: f64| {
        format!("[[effect]]\nplugin = 'turn-ratio'\ntargets = {targets}\nturning_deg = {deg}\n")
    };
    let lost = |targets: &str, after: f64, deg: f64| {
        format!("[[effect]]\nplugin = 'lost-samples'\ntargets = {targets}\nafter_turns = {after}\nangle_deg = {deg}\n")
    };
    let (one, all) = ("['b']", "['a', 'b', 'c']");
    let (mut errors, mut held, mut compared) = (Vec::new(), 0, 0);
    for (seed, effect, id, parameter, truth, targets) in [
        (1, run(one, 0.004), "turn-ratio", "turning", 0.004, 1),
        (2, run(one, -0.05), "turn-ratio", "turning", -0.05, 1),
        (3, run(all, 0.2), "turn-ratio", "turning", 0.2, 3),
        (4, run(one, 1.08), "turn-ratio", "turning", 1.08, 1),
        (5, run(all, 18.0), "turn-ratio", "turning", 18.0, 3),
        (6, lost(one, 21.0, 0.3), "lost-samples", "lost", 0.3, 1),
        (7, lost(all, 33.4, 3.0), "lost-samples", "lost", 3.0, 3),
        (8, lost(one, 20.3, 90.0), "lost-samples", "lost", 90.0, 1),
    ]
    .into_iter()
    .filter(|(seed, ..)| is_full() || [1, 5, 7, 8].contains(seed))
    {
        let folder = campaign(seed, &effect);
        let diagnosis = document(&folder, &["diagnose", "pipeline.toml", "--write", "corrected.toml"]);
        println!("simulated, {effect:?}: {} {}", diagnosis["verdict"], diagnosis["added"]);
        assert_eq!(diagnosis["verdict"], "explained", "{effect}");
        let (added, beside): (Vec<&Value>, Vec<&Value>) =
            diagnosis["added"].as_array().unwrap().iter().partition(|added| added["effect"] == id);
        assert_eq!(added.len(), targets, "{effect}: {added:#?}");
        // Averages know the angle of a setup better than single turns know a step: an offset may be left of it, and nothing else.
        let is_left = |added: &&Value| id == "lost-samples" && added.to_string().contains("index-offset");
        assert!(beside.iter().all(is_left), "{effect}: {beside:#?}");
        for added in added {
            let found =
                added["parameters"].as_array().unwrap().iter().find(|found| found["name"] == parameter).unwrap();
            let [value, std] = ["value", "std"].map(|key| found[key].as_f64().unwrap());
            compared += 1;
            held += usize::from((value - truth).abs() < 2.0 * std);
            assert!((value - truth).abs() < 5.0 * std, "{effect}: {found}");
        }
        let sound = document(&campaign(seed, ""), &["diagnose", "pipeline.toml"]);
        assert_eq!(sound["verdict"], "at-noise-floor");
        errors.push(form_error(&diagnosis) / form_error(&sound));
        if id == "turn-ratio" {
            let again = document(&folder, &["diagnose", "pipeline.toml", "--set", "rig=corrected.toml"]);
            assert_eq!((&again["verdict"], &again["added"]), (&json!("at-noise-floor"), &json!([])), "{effect}");
        }
    }
    println!("simulated, form error over that without: {errors:.3?}; {held} of {compared} sizes within 2 std");
    assert!(errors.iter().all(|ratio| *ratio < 1.1), "{errors:?}");
    assert!(held >= fewest(compared, [12, 14], 0.95), "{held} of {compared}");
}

/// A list of effects leaves out the mistakes that it does not name, and no mistake is of known size.
#[test]
fn only_what_is_listed_is_put_right() {
    let folder = campaign(2, "[[effect]]\nplugin = 'turn-ratio'\ntargets = ['b']\nturning_deg = 0.2\n");
    for (listed, verdict, added) in [("turn-ratio", "explained", 1), ("lost-samples", "unexplained", 0)] {
        let effects = format!("diagnose.effects=['{listed}']");
        let diagnosis = document(&folder, &["diagnose", "pipeline.toml", "--set", &effects]);
        assert_eq!(diagnosis["verdict"], verdict, "{listed}");
        assert_eq!(diagnosis["added"].as_array().unwrap().len(), added, "{listed}: {}", diagnosis["added"]);
    }
    let known = "diagnose.known=[{ effect = 'turn-ratio', target = 'b', values = { turning = 0.2 } }]";
    let refused = folder.run(&["diagnose", "pipeline.toml", "--set", known]);
    assert_eq!(refused.status, 2, "{}", refused.stderr);
    assert!(refused.stderr.contains("turns_per_mark"), "{}", refused.stderr);
}

/// A mark in every second turn of the part.
#[test]
fn a_mark_in_two_turns_is_put_right() {
    let folder = campaign(9, "");
    let sound = document(&folder, &["diagnose", "pipeline.toml"]);
    let file = hdf5_metno::File::open_rw(folder.path().join("campaign.h5")).unwrap();
    for setup in ["a", "b", "c"] {
        let capture = file.group(&format!("{setup}/s001")).unwrap();
        let marks: Vec<f64> = capture.dataset("index").unwrap().read_raw().unwrap();
        let every_second: Vec<f64> = marks.into_iter().step_by(2).collect();
        capture.unlink("index").unwrap();
        capture.new_dataset_builder().with_data(&every_second).create("index").unwrap();
    }
    drop(file);
    let diagnosis = document(&folder, &["diagnose", "pipeline.toml"]);
    println!("simulated: {}", diagnosis["added"]);
    assert_eq!(diagnosis["verdict"], "explained");
    for (added, setup) in diagnosis["added"].as_array().unwrap().iter().zip(["a", "b", "c"]) {
        assert_eq!((&added["effect"], &added["targets"]), (&json!("turn-ratio"), &json!([setup])));
        assert!(added["change"].as_str().unwrap().ends_with("turns_per_mark = 2.0"), "{added}");
    }
    assert!(form_error(&diagnosis) < 1.1 * form_error(&sound), "{} {}", form_error(&diagnosis), form_error(&sound));
}

/// Five stations, of which two were recorded under each other's name in one setup.
#[test]
fn exchanged_stations_are_found_and_put_right() {
    let sound = SCENARIO.split("[[effect]]").next().unwrap();
    let scenario = sound.to_owned() + "[recording]\nstations = { count = 5, step_mm = 20 }\n";
    let folder = Folder::with(&[("scenario.toml", &scenario), ("pipeline.toml", PIPELINE)]);
    let simulated = folder.run(&["simulate", "scenario.toml", "--out", "campaign.h5"]);
    assert_eq!(simulated.status, 0, "{}", simulated.stderr);
    let as_named = document(&folder, &["diagnose", "pipeline.toml"]);
    assert_eq!((&as_named["verdict"], &as_named["added"]), (&json!("at-noise-floor"), &json!([])));
    let file = hdf5_metno::File::open_rw(folder.path().join("campaign.h5")).unwrap();
    let setup = file.group("b").unwrap();
    for part in ["samples", "index"] {
        let [one, other] = ["s002", "s004"].map(|station| format!("{station}/{part}"));
        setup.relink(&one, "held").unwrap();
        setup.relink(&other, &one).unwrap();
        setup.relink("held", &other).unwrap();
    }
    drop((setup, file));
    let run = document(&folder, &["run", "pipeline.toml"]);
    let diagnosis = document(&folder, &["diagnose", "pipeline.toml"]);
    assert_eq!(diagnosis["verdict"], "explained");
    let [added] = &diagnosis["added"].as_array().unwrap()[..] else { panic!("{:#}", diagnosis["added"]) };
    assert_eq!((&added["effect"], &added["targets"]), (&json!("stations-exchanged"), &json!(["b", "s002", "s004"])));
    assert_eq!(added["confounded_with"], json!([]));
    let advice = diagnosis["warnings"].as_array().unwrap().iter();
    let advice = advice.filter(|said| said.as_str().unwrap().contains("exchange the names of the two recordings"));
    assert_eq!(advice.count(), 1);
    // Before: what a run of the names says; after: what the right names give.
    let moved = |diagnosis: &Value, station: &str| {
        let all = diagnosis["moved"].as_array().unwrap().iter();
        let section = format!("a@{station}");
        all.clone().find(|moved| moved["value"] == "RONt" && moved["section"] == section).unwrap().clone()
    };
    for (station, name) in ["s001", "s002", "s003", "s004", "s005"].into_iter().enumerate() {
        let (found, right) = (moved(&diagnosis, name), moved(&as_named, name));
        assert_eq!(found["before"], value(&run["stations"][station]["sections"][0], "RONt")["value"], "{name}");
        assert_eq!(found["after"], right["after"], "{name}");
        assert_eq!(found["before"] != right["before"], name == "s002" || name == "s004", "{name}");
    }
}

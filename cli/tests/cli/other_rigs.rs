//! `examples/03-other-rigs` as it stands: rigs that have no method of their own.

use std::{fs, path::Path};

use serde_json::{Value, json};

use crate::folder::{Folder, Ran};

const SCENARIO: &str = include_str!("../../../examples/03-other-rigs/scenario.toml");
const PIPELINE: &str = include_str!("../../../examples/03-other-rigs/pipeline.toml");

/// What a rig is to show, besides a form that is right.
struct Expected {
    rig: &'static str,
    sections: usize,
    /// Readings less unknowns, at 2/rev.
    residual_dof: u64,
    lost: Value,
}

fn example(rig: &str) -> Folder {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/03-other-rigs").join(rig);
    let rig_text = fs::read_to_string(path).unwrap();
    Folder::with(&[("scenario.toml", SCENARIO), ("pipeline.toml", PIPELINE), (rig, &rig_text)])
}

fn document(ran: &Ran) -> Value {
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    serde_json::from_str(&ran.stdout).unwrap()
}

#[test]
fn each_rig_gives_its_form() {
    let nothing = json!({ "form": [], "motion": [] });
    // Along one direction, 1/rev motion and eccentricity are the same in every reading.
    let first_motion = json!({ "form": [], "motion": [1] });
    let rigs = [
        Expected { rig: "reversal-160.toml", sections: 2, residual_dof: 2, lost: nothing.clone() },
        Expected { rig: "reversal-70-31.toml", sections: 2, residual_dof: 2, lost: nothing.clone() },
        Expected { rig: "three-probes-two-setups.toml", sections: 1, residual_dof: 3, lost: nothing.clone() },
        Expected { rig: "multi-step.toml", sections: 1, residual_dof: 3, lost: first_motion },
        Expected { rig: "six-sensors.toml", sections: 2, residual_dof: 6, lost: nothing },
    ];
    for Expected { rig, sections, residual_dof, lost } in rigs {
        let folder = example(rig);
        let choice = format!("rig={rig}");
        let json = ["--set", &choice, "--json"];
        // Fewer turns than the example has, to be quick.
        let few = ["--set", "recording.revolutions=20", "--set", "recording.samples_per_rev=256"];
        document(&folder.run(&[&["simulate", "scenario.toml"], &few[..], &json[..]].concat()));

        let check = document(&folder.run(&[&["check", "pipeline.toml"], &json[..]].concat()));
        assert_eq!(check["lost_orders"], lost, "{rig}");
        assert_eq!(check["orders"][1]["residual_dof"], residual_dof, "{rig}");

        let summary = document(&folder.run(&[&["run", "pipeline.toml"], &json[..]].concat()));
        assert_eq!(summary["lost_orders"], lost, "{rig}");
        let found = summary["stations"][0]["sections"].as_array().unwrap();
        assert_eq!(found.len(), sections, "{rig}");
        for section in found {
            // Two orders make most of the error where a rig's noise gain is high there: four numbers, which pass 2.5
            // times their standard deviation once in 30 000. Motion left in the form would be 1.5 µm.
            let [error, stated] = ["truth_form_rms_error_um", "form_std_um"].map(|key| section[key].as_f64().unwrap());
            assert!(error < 2.5 * stated && stated < 0.15, "{rig}: {error} µm for ± {stated} µm");
        }
        // The declared rig explains the readings, up to what 20 turns show of their own scatter.
        let chi2 = summary["stations"][0]["chi2_per_dof"].as_f64().unwrap();
        assert!((0.5..2.0).contains(&chi2), "{rig}: {chi2}");
    }
}

/// The closed form of multi-step takes unequal steps as well.
#[test]
fn unequal_steps_have_a_closed_form() {
    let folder = example("multi-step.toml");
    let choice = ["--set", "rig=multi-step.toml"];
    let few = ["--set", "recording.revolutions=6", "--set", "recording.samples_per_rev=256", "--json"];
    document(&folder.run(&[&["simulate", "scenario.toml"], &choice[..], &few[..]].concat()));
    let run = |plugin: &str| -> f64 {
        let plugin = format!("separate.plugin={plugin}");
        let ran = folder.run(&[&["run", "pipeline.toml", "--json", "--set", &plugin], &choice[..]].concat());
        document(&ran)["stations"][0]["sections"][0]["form_rms_um"].as_f64().unwrap()
    };
    // 0.01 µm: the general solver weights readings by six turns' scatter of 0.15 µm, the closed form weights none.
    assert!((run("harmonic-least-squares") - run("multi-step")).abs() < 0.01);
}

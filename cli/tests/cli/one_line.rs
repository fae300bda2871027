//! Probes along one line that is neither x nor y: motion there is observable, and is given with its direction.

use std::fs::File;

use serde_json::Value;

use crate::folder::{Folder, Ran};

const RIG: &str = r#"part_radius_mm = 30.0
sensors = [
  { id = "S1", angle_deg = 30, z_mm = 200, section = "a" },
  { id = "S2", angle_deg = 30, z_mm = 230, section = "b" },
]
setups = [
  { id = "initial",  part_deg = 0,   sensors_deg = 0 },
  { id = "reversed", part_deg = 180, sensors_deg = 180 },
]
"#;

const STAGES: &str = r#"
[load]
plugin = "hdf5"
path = "shaft.h5"

[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 256

[separate]
plugin = "donaldson-reversal"

[evaluate]
values = ["roundness", "error-motion"]

[[export]]
plugin = "parquet"
path = "out"

[[export]]
plugin = "hdf5"
path = "out/result.h5"
"#;

const SCENARIO: &str = r#"plugin = "spindle"
output = "shaft.h5"
seed = 5

[recording]
revolutions = 30
samples_per_rev = 256

[form]
rms_um = 3.0

[motion]
x_rms_um = 1.5
y_rms_um = 1.0
tilt_rms_urad = 3.0

[asynchronous]
rms_um = 0.1

[noise]
rms_um = 0.02
"#;

fn document(ran: &Ran) -> Value {
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{}", ran.stdout);
    serde_json::from_str(&ran.stdout).unwrap()
}

#[test]
fn motion_along_the_line_is_given_with_its_direction() {
    let rig = format!("\n[rig]\n{RIG}");
    let pipeline = format!("title = \"Oblique\"\n{rig}{STAGES}");
    let folder = Folder::with(&[("pipeline.toml", &pipeline), ("scenario.toml", &format!("{SCENARIO}{rig}"))]);
    document(&folder.run(&["simulate", "scenario.toml", "--json"]));

    let check = document(&folder.run(&["check", "pipeline.toml", "--json"]));
    assert_eq!(check["lost_orders"]["motion"], serde_json::json!([1]), "only 1/rev, which is eccentricity as well");
    let unknowns: Vec<&str> =
        check["unknowns"].as_array().unwrap().iter().map(|unknown| unknown["quantity"].as_str().unwrap()).collect();
    assert_eq!(unknowns, ["form", "form", "along", "tilt_along"]);
    assert!(check["notes"].to_string().contains("along 30° from x towards y only"), "{}", check["notes"]);

    let general = ["run", "pipeline.toml", "--json", "--set", "separate.plugin=harmonic-least-squares"];
    for arguments in [&["run", "pipeline.toml", "--json"][..], &general[..]] {
        let summary = document(&folder.run(arguments));
        let station = &summary["stations"][0];
        assert_eq!(station["motion_along_deg"], 30.0);
        // 30 turns of 0.1 µm and 0.02 µm in four readings leave some 0.02 µm, 3 times that at z = 0, and 1 µrad of tilt.
        let truth = &station["truth"];
        assert!(truth["along_rms_error_um"].as_f64().unwrap() < 0.3, "{truth}");
        assert!(truth["tilt_along_rms_error_urad"].as_f64().unwrap() < 2.0, "{truth}");
        let symbols = station["motion_values"].to_string();
        assert!(symbols.contains("synchronous-radial-along") && !symbols.contains("radial-x"), "{symbols}");
    }

    let text = folder.run(&["run", "pipeline.toml"]).stdout;
    assert!(text.contains("radial along 30°"), "{text}");

    let motion = File::open(folder.path().join("out/motion.parquet")).unwrap();
    let bytes = runout_hdf5::inspect(&folder.path().join("out/result.h5")).unwrap();
    assert!(motion.metadata().unwrap().len() > 0);
    let columns = &bytes.tables.iter().find(|table| table.table == "motion").unwrap().columns;
    for name in ["along_deg", "along_um", "std_along_um", "tilt_along_urad", "std_tilt_along_urad", "x_um"] {
        assert!(columns.contains(&name.to_owned()), "{name}: {columns:?}");
    }
    let looked = folder.run(&["inspect", "out/motion.parquet"]).stdout;
    assert!(looked.contains("along_um"), "{looked}");
}
